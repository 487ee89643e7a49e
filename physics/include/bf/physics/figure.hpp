// What a World's robot looks like, for whoever draws it.
#pragma once

#include "bf/physics/scene.hpp"
#include "bf/physics/world.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace bf::physics {

/// Triangles. Vertex i has position `vertices[3i..]` (m) and unit normal `normals[3i..]`.
struct Mesh {
    std::vector<float> vertices, normals;
    std::vector<std::uint32_t> triangles; ///< 3 vertices each
};

/// A visible part, fixed to a body.
struct Shape {
    enum class Kind { mesh, sphere, box, cylinder, capsule, ellipsoid };
    Kind kind = Kind::mesh;
    int body = 0;
    int mesh = -1;                 ///< number of the mesh
    std::array<double, 7> pose{};  ///< in the body: x y z (m), qw qx qy qz
    std::array<double, 3> size{};  ///< radius; half-sizes; radius and half-length along z; half-axes (m)
    std::array<float, 4> colour{}; ///< red, green, blue, opacity, 0 to 1
};

/// A force of a contact, where all of it may be taken to act (m, N, world axes); below 1 N there is none.
struct ContactForce {
    Eigen::Vector3d origin, force;
};
/// At the point of the wrench's axis that is nearest to the point that the wrench (N, Nm) refers to:
/// origin = point + force x moment / |force|². Source: L. Poinsot, Éléments de statique, 1803.
std::optional<ContactForce> axial_force(const Eigen::Vector3d& point, const Vector6d& wrench);
/// At the centre of pressure x = -m_y/f_z, y = m_x/f_z in sole axes, from the pose of a foot and the wrench
/// of the floor at its origin in world axes. A frame whose z axis is more than 60 degrees away from the force
/// is that of no sole: its force is an `axial_force`.
std::optional<ContactForce> contact_force(const Eigen::Matrix4d& w_H_foot, const Vector6d& wrench);

/// The looks of a World's robot or of a Scene, and where the bodies are. A body is a link, or an object, with
/// all that is fixed to it.
class Figure {
  public:
    /// Loads the visual meshes. Throws std::runtime_error: mesh not found, with the places searched.
    explicit Figure(const World& world);
    explicit Figure(const Scene& scene);
    ~Figure();
    Figure(Figure&&) noexcept;
    Figure& operator=(Figure&&) noexcept;

    const std::vector<std::string>& bodies() const; ///< names of their links
    const std::vector<Shape>& shapes() const;
    int mesh_count() const;
    Mesh mesh(int number) const;

    /// Puts the base at `w_H_b` and the joints at `s` (n, the World's order).
    void place(const Eigen::Matrix4d& w_H_b, std::span<const double> s) noexcept;
    /// Puts everything where SceneSimulation::q says.
    void place(std::span<const double> q) noexcept;
    /// Centre of mass of all there is, as it was placed (m).
    Eigen::Vector3d com() const noexcept;
    /// Where a body was placed in the world: x y z (m), qw qx qy qz.
    std::array<double, 7> pose(int body) const noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace bf::physics
