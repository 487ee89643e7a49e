#pragma once

#include "bf/physics/world.hpp"

#include <Eigen/Dense>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bf::physics {

/// Picture, 8-bit RGB, rows from top to bottom.
struct Image {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> pixels; ///< 3 * width * height
};

/// Arrow from `origin` along `vector` (both in world axes, m); it shines through what is in front of it.
struct Arrow {
    enum class Kind { contact, push };
    Eigen::Vector3d origin;
    Eigen::Vector3d vector;
    Kind kind = Kind::contact;
};

/// Size of the picture and the camera, which looks at the base from `distance`.
struct RenderOptions {
    int width = 960;
    int height = 720;
    int samples = 8;        ///< anti-aliasing samples per pixel; 0 switches it off
    double azimuth = 150.0; ///< deg, direction of view about z: 0 looks along +x, 180 faces the robot's front
    double elevation = -10.0;    ///< deg, negative looks down
    double distance = 2.3;       ///< m
    double look_at_height = 0.5; ///< m, height of the point looked at
    bool follows = true; ///< the point looked at follows the base in x and y; else it stays where it is first
    double metres_per_newton = 0.0015; ///< length of the arrows of force_arrows()

    /// Throws std::invalid_argument that lists every value out of range.
    void validate() const;
};

/// Off-screen pictures of a World's robot, drawn on the CPU. Any thread may use it, one at a time.
class Renderer {
  public:
    /// Loads the visual meshes. Throws std::runtime_error: mesh not found (with the places searched), no
    /// OpenGL.
    Renderer(const World& world, RenderOptions options = {});
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    const RenderOptions& options() const;

    /// Draws the robot with base pose `w_H_b` and joint positions `s` (n, the World's order).
    void render(const Eigen::Matrix4d& w_H_b, std::span<const double> s, std::span<const Arrow> arrows,
                Image& image);

    /// Draws what `simulation` shows now, with its contact forces.
    void render(const Simulation& simulation, Image& image);

    /// Arrows of the forces on the feet, at their centres of pressure.
    std::vector<Arrow> force_arrows(const Simulation& simulation) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Writes `image` as PNG. Throws std::runtime_error naming the file.
void write_png(const std::filesystem::path& file, const Image& image);

/// H.264 video in an MP4 file, compressed by the program `ffmpeg`, to which frames go through a pipe.
class VideoWriter {
  public:
    /// Throws std::runtime_error when ffmpeg is missing or the file cannot be written.
    VideoWriter(const std::filesystem::path& file, int width, int height, double frames_per_second);
    ~VideoWriter(); ///< closes without reporting errors
    VideoWriter(VideoWriter&&) noexcept;
    VideoWriter& operator=(VideoWriter&&) noexcept;

    /// Appends a frame of the size given above. Throws std::runtime_error when ffmpeg has died, with its last
    /// words.
    void add(const Image& frame);
    /// Completes the file. Throws std::runtime_error when ffmpeg reports a failure.
    void close();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace bf::physics
