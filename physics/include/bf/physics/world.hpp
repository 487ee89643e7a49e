#pragma once

#include "bf/physics/world_options.hpp"

#include <Eigen/Dense>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bf::physics {

using Vector6d = Eigen::Matrix<double, 6, 1>;

class Scene;

/// What is measured of joints and of the motors before their gears (n each): positions and velocities now,
/// accelerations and torques of the last interval. A motor turns gear_ratio times as far as its joint, apart
/// from backlash.
struct Readings {
    Eigen::Map<const Eigen::VectorXd> s, s_dot, s_ddot, tau, motor_position, motor_velocity,
        motor_acceleration;
};

/// Compiled physics model of one robot on a floor. Immutable: any number of Simulations, in any threads,
/// share it.
class World {
  public:
    /// Reads the URDF and compiles it.
    /// Throws std::runtime_error (file missing, name unknown or not actuated, MuJoCo refuses the model) and
    /// std::invalid_argument (WorldOptions::validate).
    explicit World(WorldOptions options);
    ~World();
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;

    const std::shared_ptr<const Scene>& scene() const; ///< of which this is the only robot, number 0
    const WorldOptions& options() const;
    int joint_count() const;                             ///< n
    const std::vector<std::string>& joint_names() const; ///< n, order of every joint vector
    const std::string& base_link() const;                ///< the link that w_H_b describes
    /// Links that MuJoCo moves by themselves, each with all that is fixed to it; a fixed base is one, too.
    const std::vector<std::string>& bodies() const;
    const Eigen::VectorXd& lower_limits() const;  ///< n, joint positions; -inf when the URDF has none
    const Eigen::VectorXd& upper_limits() const;  ///< n, joint positions; +inf when the URDF has none
    const Eigen::VectorXd& effort_limits() const; ///< n, |tau| is clamped to it; +inf when the URDF has none
    double mass() const;                          ///< kg, whole robot
    /// What the world does otherwise than the URDF says: links whose inertia no body can have, and what they
    /// have here.
    const std::vector<std::string>& warnings() const;

  private:
    friend class Simulation;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// A force that takes hold of the robot somewhere, such as a hand that pulls.
struct Disturbance {
    int body = 0; ///< number in World::bodies(), counted from 1; 0: there is none
    Eigen::Vector3d point = Eigen::Vector3d::Zero(); ///< where it acts, in the frame of the body's link (m)
    Eigen::Vector3d force = Eigen::Vector3d::Zero(); ///< in world axes (N)
};

/// One running copy of a World, driven by torques past the loops of its Scene: its state and what its sensors
/// read.
///
/// A step from t_k to t_k+1 = t_k + time_step, with tau and the external wrenches held:
///
///     qacc, contact and constraint forces at (q_k, v_k, tau)     → measured as "last interval"
///     v_k+1, q_k+1                                               → integration
///     kinematics and velocities at (q_k+1, v_k+1)                → measured as "now"
///
/// | now (t_k+1)                                        | last interval (t_k, with the torque then applied) |
/// |----------------------------------------------------|--------------------------------------------------------|
/// | s, s_dot, w_H_b, v_b, com, foot_pose, imu_rotation, | s_ddot, tau, foot_wrench, ft_wrench, accelerometer
/// | | gyro                                               | |
///
/// After reset() the second column is evaluated at t = 0 with zero torque.
/// All vectors are in the World's joint order. Velocities are in the mixed representation: derivative of the
/// origin and angular velocity, both in world axes. Every returned map is a view that stays valid and changes
/// with the next step.
class Simulation {
  public:
    using VectorView = Eigen::Map<const Eigen::VectorXd>;
    using Vector3View = Eigen::Map<const Eigen::Vector3d>;
    using Vector6View = Eigen::Map<const Vector6d>;
    using Matrix3View = Eigen::Map<const Eigen::Matrix3d>;
    using Matrix4View = Eigen::Map<const Eigen::Matrix4d>;

    /// Allocates everything and resets. Throws std::bad_alloc or std::runtime_error.
    explicit Simulation(std::shared_ptr<const World> world);
    ~Simulation();
    Simulation(Simulation&&) noexcept;
    Simulation& operator=(Simulation&&) noexcept;

    const World& world() const noexcept;

    /// Back to t = 0, the start pose, zero velocity.
    void reset() noexcept;

    /// Advances one time step under `tau` (n) and, per push link, a force and a moment (6) in world axes at
    /// the link's centre of mass, besides a disturbance; no wrenches stand for zeros. False when an input is
    /// not finite or has the wrong length, or when the motion diverged; error() says why. After a failure
    /// every further step fails with the same text until reset() or restore().
    [[nodiscard]] bool step(std::span<const double> tau, std::span<const double> wrenches = {},
                            const Disturbance& disturbance = {}) noexcept;

    /// Why the last step failed; empty when it did not.
    const char* error() const noexcept;

    double time() const noexcept; ///< s

    /// Joints and motors, as they are measured, with RobotOptions::noise and imperfections; torques are those
    /// after the effort limits.
    Readings readings() const noexcept;
    /// The same as the low level has them, without delays and dropouts.
    Readings readings_at_loops() const noexcept;
    VectorView s() const noexcept { return readings().s; }
    VectorView s_dot() const noexcept { return readings().s_dot; }
    VectorView s_ddot() const noexcept { return readings().s_ddot; }
    VectorView tau() const noexcept { return readings().tau; }

    Matrix4View w_H_b() const noexcept; ///< pose of the base link, now
    Vector6View v_b() const noexcept;   ///< velocity of the base link, mixed, now
    Vector3View com() const noexcept;   ///< centre of mass of the robot in the world, now

    Matrix3View imu_rotation() const noexcept;  ///< w_R_imu, now, exact
    Eigen::Vector3d imu_rpy() const noexcept;   ///< w_R_imu = Rz(yaw) Ry(pitch) Rx(roll) (rad), now
    Vector3View gyro() const noexcept;          ///< angular velocity in IMU axes, now
    Vector3View accelerometer() const noexcept; ///< acceleration minus gravity in IMU axes, last interval

    /// Pose of the frame of foot `i` of WorldOptions::feet, now.
    Matrix4View foot_pose(int i) const noexcept;
    /// Force and moment of the floor on foot `i`, in world axes at the origin of its frame, last interval.
    Vector6View foot_wrench(int i) const noexcept;
    /// Force and moment that sensor `i` of WorldOptions::ft_sensors reads: what the child link exerts on its
    /// parent, in the axes and at the origin of the child link ("child_to_parent"; a standing foot pushes its
    /// leg up), last interval.
    Vector6View ft_wrench(int i) const noexcept;

    /// Number of doubles of a saved state.
    int state_size() const noexcept;
    /// Writes the complete state, measurements and noise included, to `state` (state_size() doubles).
    void save(double* state) const noexcept;
    /// Continues, bit for bit, from a state that save() wrote for the same World.
    void restore(const double* state) noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace bf::physics
