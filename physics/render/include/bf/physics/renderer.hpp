#pragma once

#include "bf/physics/scene.hpp"
#include "bf/physics/world.hpp"

#include <Eigen/Dense>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
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

/// Through points, in world axes (m): where something was, or an outline, which shines through as arrows do.
struct Line {
    enum class Kind { trail, outline };
    std::vector<Eigen::Vector3d> points;
    Kind kind = Kind::trail;
    int number = 0; ///< of a trail: each has a colour of its own
};

/// What is drawn besides the world.
struct Marks {
    std::vector<Arrow> arrows{};
    std::vector<Line> lines{};
    std::vector<Eigen::Vector3d> centres{}; ///< of mass (m), which shine through, with their shadows on z = 0
    std::string caption{};                  ///< in the upper left corner
};

/// Size of the picture and the camera.
struct RenderOptions {
    int width = 960;
    int height = 720;
    int samples = 8;        ///< anti-aliasing samples per pixel; 0 switches it off
    double azimuth = 150.0; ///< deg, direction of view about z: 0 looks along +x, 180 faces the robot's front
    double elevation = -10.0; ///< deg, negative looks down
    /// m, of the camera from the point looked at, and the height of that point; none: such that all that
    /// moves is seen at first.
    std::optional<double> distance{}, look_at_height{};
    /// The point looked at follows a body in x and y, and its height, where that was not given; else it stays
    /// where it is first.
    bool follows = true;
    /// The body that is followed; empty: the base of a World's robot, and nothing in a Scene.
    std::string followed{};
    double metres_per_newton = 0.0015; ///< length of the arrows of force_arrows()

    /// Throws std::invalid_argument that lists every value out of range.
    void validate() const;
};

/// Off-screen pictures of a World's robot or of a Scene, drawn on the CPU. Any thread may use it, one at a
/// time. Robots are those of the Scene; a World has one.
class Renderer {
  public:
    /// Loads the visual meshes. Throws std::runtime_error: mesh not found (with the places searched), an
    /// unknown body to follow, no OpenGL.
    Renderer(const World& world, RenderOptions options = {});
    Renderer(const Scene& scene, RenderOptions options = {});
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    const RenderOptions& options() const;
    int robot_count() const;

    /// Puts the base at `w_H_b` and the joints at `s` (n, the World's order). Throws std::invalid_argument
    /// for a wrong number of them.
    void place(const Eigen::Matrix4d& w_H_b, std::span<const double> s);
    /// Puts everything where SceneSimulation::q says. The same.
    void place(std::span<const double> q);

    /// Where the origin of a frame of the Scene, or of the World's, was placed (m).
    Eigen::Vector3d position(const Frame& frame) const;
    Eigen::Vector3d com(int robot) const; ///< centre of mass of a robot, as it was placed (m)
    /// The support polygon of a robot as it was placed: the convex hull, seen from above and
    /// counterclockwise, of the points at which it touches what stands still (m). Empty: there are none, or
    /// its base is fixed.
    std::vector<Eigen::Vector3d> support(int robot);

    /// Draws what was placed.
    void draw(const Marks& marks, Image& image);
    /// Both at once.
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
