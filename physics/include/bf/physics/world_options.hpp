#pragma once

#include "bf/physics/joint_control.hpp"

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace bf::physics {

/// Contact primitive fixed to a frame; it has no mass.
struct ContactShape {
    enum class Kind { sphere, box };
    Kind kind = Kind::sphere;
    Eigen::Vector3d position = Eigen::Vector3d::Zero(); ///< centre in the frame (m)
    Eigen::Vector3d size = Eigen::Vector3d::Zero();     ///< sphere: (radius, 0, 0); box: half-sizes (m)

    static ContactShape sphere(const Eigen::Vector3d& centre, double radius);
    static ContactShape box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_sizes);
};

/// Four spheres of radius 5 mm that touch the plane z = 0 of an iCub's sole: x = 0.0265 ± 0.075 m, y = ±
/// 0.031 m.
std::vector<ContactShape> four_spheres();

/// Link that may touch the floor, and the shapes it touches with. Wrenches refer to the origin of its frame.
struct Foot {
    std::string frame;
    std::vector<ContactShape> shapes = four_spheres();
    bool has_urdf_shapes =
        false; ///< the link's <collision> shapes touch as well; meshes by their convex hulls
};

/// Joint without a motor that keeps `position = multiplier * (position of the leader) + offset`; without a
/// leader it is locked at `offset`.
struct Follower {
    std::string joint;
    std::string leader; ///< one of WorldOptions::joints, or empty
    double multiplier = 1.0;
    double offset = 0.0; ///< rad or m
};

/// How a shape touches others. Of two that touch, the greater friction counts and the mean of all else.
/// Source: MuJoCo's documentation, Modeling, Contact parameters and Solver parameters.
struct Surface {
    double friction = 1.0;              ///< Coulomb's coefficient
    Eigen::Vector2d solref{0.005, 1.0}; ///< time constant (s) and damping ratio with which a contact recedes
    /// Impedance at the surface and `width` below it, width (m), midpoint and power of the curve in between.
    std::array<double, 5> solimp{0.9, 0.95, 0.001, 0.5, 2.0};

    /// Empty, or which value is out of range, and the remedy.
    std::string complaint() const;
};

/// Plane z = 0.
struct Floor : Surface {
    bool enabled = true;
};

/// White noise added to measured joint quantities; each value is a standard deviation per step, 0 switches it
/// off. The sample of step k is a function of (seed, k, channel) alone, so that a restored simulation repeats
/// it.
struct Noise {
    double position = 0.0; ///< rad or m
    double velocity = 0.0; ///< rad/s or m/s
    double torque = 0.0;   ///< N m or N
    std::uint64_t seed = 1;
};

/// Time between the low level of a robot and who reads and commands it (s).
struct Delays {
    double command = 0.0;     ///< until a reference reaches the loops, a multiple of their period
    double measurement = 0.0; ///< until a measurement is read, a multiple of the time step
};

/// What measurements and commands suffer besides noise. The loops of the low level sit beside encoders and
/// motors, so that delays and dropouts are not theirs. Joint-wise lists hold no value, one for all joints, or
/// n; what is 0 is off.
struct Imperfections {
    Delays delays;
    /// Probability that the measurements of a time step get lost, all of the robot together; the last ones
    /// are read again. Whether those of step k do depends on (Noise::seed, k) alone.
    double dropout = 0.0;
    /// Play of the gear (rad or m at the joint): from one flank of its teeth to the other. In between the
    /// motor, which is the joint's armature, turns alone, and the joint swings freely.
    std::vector<double> backlash;
    std::vector<double> encoder_resolution;       ///< rad or m per tick, behind the gear
    std::vector<double> motor_encoder_resolution; ///< rad of the motor per tick, before the gear
    /// Velocities are differences of what the encoders count in a time step, without noise of their own.
    bool velocities_from_encoders = false;
};

enum class Integrator { euler, implicit_fast };
enum class FrictionCone { pyramidal, elliptic };

/// Environment and solver. SI units.
struct PhysicsOptions {
    double time_step = 1e-3; ///< s
    Integrator integrator = Integrator::implicit_fast;
    FrictionCone cone = FrictionCone::elliptic;
    double impratio = 100.0; ///< frictional to normal impedance of contacts
    Eigen::Vector3d gravity{0.0, 0.0, -9.81};
    Floor floor;

    /// Throws std::invalid_argument that lists every value out of range.
    void validate() const;
};

/// A robot, its sensors and its start. SI units.
///
/// Joint-wise lists (`armature`, `damping`, `friction`, `initial_joints`) hold no value, one for all joints,
/// or n in the order of `joints`.
struct RobotOptions {
    std::filesystem::path urdf;
    /// Where `package://` and `model://` addresses of meshes are looked up first; then in the folders of the
    /// environment (bf/base/packages.hpp) and in those above the URDF.
    std::vector<std::filesystem::path> package_paths;

    std::vector<std::string> joints; ///< controlled joints, order of all n-vectors; empty: all movable ones,
                                     ///< URDF order. Every other joint is locked at 0,
    std::vector<Follower> followers; ///< except these.
    std::string base_link; ///< link that w_H_b describes; empty: the first link with inertia from the root
    bool floating_base = true;

    std::vector<Foot> feet; ///< the only parts of the robot that collide in a World, with the ground alone,
    bool lands = false;     ///< unless all its <collision> shapes do, so that it comes to lie when it falls
    std::optional<Surface> surface; ///< of all shapes that collide; none: that of the floor
    std::vector<std::string>
        ft_sensors;        ///< fixed joint (or its child link) cut by a six-axis force/torque sensor
    std::string imu_frame; ///< link that carries the IMU; empty: the base link
    std::vector<std::string>
        push_links; ///< links on which external wrenches act, at the link's centre of mass

    std::vector<double> armature; ///< rotor inertia seen at the joint (kg m²); empty: 0
    std::vector<double> damping;  ///< viscous joint friction (N m s/rad); empty: the URDF's
    std::vector<double> friction; ///< Coulomb joint friction (N m); empty: the URDF's
    Noise noise;
    Imperfections imperfections;

    std::vector<double> initial_joints; ///< empty: 0, or the limit next to it
    /// Start pose of the base link. Without it a fixed base starts at the identity, a floating base with feet
    /// upright (z axis of the base vertical), the origin of the world midway between the feet's frames, their
    /// mean x axis forward, and the lowest contact point 0.05 mm below the floor; a floating base without
    /// feet at the identity.
    std::optional<Eigen::Matrix4d> initial_w_H_b;

    /// Throws std::invalid_argument that lists every value out of range. What needs the URDF is checked by
    /// World.
    void validate() const;
};

/// A body that is no robot: it floats when it has a mass, and is fixed to the world otherwise, as terrain
/// (slope, steps, heights) always is.
struct SceneObject {
    enum class Kind { box, sphere, cylinder, mesh, slope, steps, heights };
    Kind kind = Kind::box;
    std::string name;
    /// What it means depends on the kind (m):
    /// - box: edges x y z; sphere: radius; cylinder: radius, length along z; mesh: factors of its
    /// coordinates;
    /// - slope: length along x, width along y, height to which it rises from the origin;
    /// - steps: depth along x, width along y and height of one of `count`, which rise from the origin;
    /// - heights: extent along x and y around the origin; height of an image's brightest pixel above its
    ///   darkest, or the factor of a file's numbers.
    Eigen::Vector3d size{0.1, 0.1, 0.1};
    int count = 1; ///< of steps
    /// Of a mesh, which touches with its convex hull; of heights: a PNG image, or rows of numbers (m), the
    /// first of them at the greatest y.
    std::filesystem::path file{};
    Eigen::Matrix4d w_H_o = Eigen::Matrix4d::Identity();
    std::optional<double> mass{}; ///< kg, spread evenly over the volume
    Surface surface{};
    std::array<float, 4> colour{0.8F, 0.6F, 0.3F, 1.0F}; ///< red, green, blue, opacity
    std::string where{};
};

/// Everything that defines a World: one robot in its environment.
struct WorldOptions : RobotOptions, PhysicsOptions {
    MotorOptions motors;
    std::vector<SceneObject> terrain; ///< without mass; feet touch it as they touch the floor

    /// Throws std::invalid_argument that lists every value out of range of both.
    void validate() const;
};

} // namespace bf::physics
