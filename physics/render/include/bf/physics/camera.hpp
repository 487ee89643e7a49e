// What a camera in a Scene sees.
#pragma once

#include "bf/physics/scene.hpp"

#include <Eigen/Dense>
#include <cstdint>
#include <memory>
#include <span>

namespace bf::physics {

/// A pinhole camera with square pixels.
struct CameraOptions {
    int width = 320;
    int height = 240;
    double field_of_view = 0.8; ///< rad, vertical
    double range = 10.0;        ///< m, farthest depth
    /// Standard deviation of depths z: noise[0] + noise[1] z² (m), as structured light has it (Nguyen, Izadi,
    /// Lovell 2012).
    Eigen::Vector2d noise = Eigen::Vector2d::Zero();
    std::uint64_t seed = 1;
    bool has_colour = true, has_depth = true, has_segmentation = true; ///< what will be asked for

    /// Throws std::invalid_argument that lists every value out of range.
    void validate() const;
};

/// Off-screen pictures of a Scene from where a camera is, drawn on the CPU. Its frame is that of optics: x to
/// the right of the picture, y down, z ahead. Any thread may use it, one at a time.
class Camera {
  public:
    using Colours = Eigen::Ref<Eigen::Matrix<std::uint8_t, -1, -1>>;
    using Bodies = Eigen::Ref<Eigen::Matrix<std::int32_t, -1, -1>>;

    /// Loads the visual meshes. Throws std::invalid_argument, std::runtime_error: mesh not found (with the
    /// places searched), no OpenGL.
    explicit Camera(const Scene& scene, const CameraOptions& options = {});
    ~Camera();
    Camera(Camera&&) noexcept;
    Camera& operator=(Camera&&) noexcept;

    /// Draws a scene placed by SceneSimulation::q, for what follows. False, and no picture: OpenGL refuses.
    bool look(std::span<const double> q, const Eigen::Matrix4d& w_H_camera) noexcept;

    /// height x 3 width: red, green and blue beside each other, 0 to 255. In memory, column by column, that
    /// is an array of height x width x 3.
    void colour(Colours picture) const noexcept;
    /// height x width, along the axis of the camera (m), range where nothing is nearer. `picture_number`
    /// seeds the noise.
    void depth(Eigen::Ref<Eigen::MatrixXd> picture, std::uint64_t picture_number = 0) const noexcept;
    /// height x width: the body that is seen, by its number in Scene::bodies counted from 1; 0: the world,
    /// its floor included; -1: nothing.
    void segmentation(Bodies picture) const noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace bf::physics
