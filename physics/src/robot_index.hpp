#pragma once

#include "bf/physics/world.hpp"
#include "spec.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace bf::physics {

/// Where in a compiled model the quantities of one robot live. `prefix` stands before the robot's names
/// there.
struct RobotIndex {
    std::vector<int> position; ///< n, joint → index in qpos
    std::vector<int> velocity; ///< n, joint → index in qvel
    std::vector<int> motors;   ///< n, joint → index in ctrl
    /// n, joint → index in ctrl of the actuator that makes the velocity's part of the loop implicit, or -1.
    std::vector<int> dampers;
    std::vector<int> ft_sites, push_sites, foot_sites;
    std::vector<int>
        foot_of_geom; ///< per geom: number of the foot that it belongs to, or -1; without feet none
    std::vector<int> force_sensors, torque_sensors; ///< per F/T sensor: index in sensordata
    std::vector<FollowerAddress> followers;
    int base_site = -1, imu_site = -1;
    int gyro = -1, accelerometer = -1; ///< index in sensordata
    /// Bodies whose subtrees make the robot; none: everything that there is.
    std::vector<int> roots;
    Eigen::VectorXd lower_limits, upper_limits, effort_limits; ///< n

    /// Of a joint with backlash: where the play of its gear stands in qpos and qvel; -1: its gear is rigid.
    std::vector<int> play_position, play_velocity;
    Eigen::VectorXd encoder_resolution, motor_encoder_resolution; ///< n, 0: exact
    int delay = 0;                                                ///< time steps until a measurement is read

    /// The motors, and the loops that drive them.
    std::optional<Motors> drives;
    Eigen::VectorXd inertias; ///< n, kg m2, that the joints see at the start
    int loop_steps = 1;       ///< time steps from one advance of the loops to the next
    int command_delay = 0;    ///< advances until references arrive

    /// Looks everything up that make_robot named. Throws std::runtime_error for a force/torque sensor that
    /// carries no mass, and for a delay that is no multiple of the time step.
    void find(const mjModel* m, const RobotOptions& options, const std::string& prefix = {});
    /// Fills in motors and loops. `start` is qpos at the start. Throws std::runtime_error.
    void drive(const mjModel* m, const RobotOptions& options, const MotorOptions& motors, double loop_period,
               const Eigen::VectorXd& start);
    /// A text for each loop that lets a disturbance grow at its period, by joint, gains and remedy.
    std::vector<std::string> unstable_loops(const mjModel* m, const RobotOptions& options) const;
    JointControl control() const { return JointControl(*drives, command_delay); }
    int n() const { return static_cast<int>(position.size()); }
};

/// Where each measurement of a robot stands in a flat vector, which is saved and restored as it is.
struct RobotLayout {
    /// What the low level measures.
    int s, s_dot, s_ddot, tau, motor_position, motor_velocity, motor_acceleration, imu_rotation, gyro,
        accelerometer, ft_wrenches;
    /// What is so, whoever measures.
    int w_H_b, v_b, com, foot_poses, foot_wrenches;
    int measured = 0;  ///< how many numbers the former are, from `s` on
    int slots = 0;     ///< how many of them are remembered, to be read later or again; 0: none has to be
    int memory = 0;    ///< where these stand
    int delivered = 0; ///< how far behind `s` and the others stand those that are read now

    /// `at` is where the first one stands, and becomes where the next thing may stand.
    RobotLayout(int& at, const RobotIndex& robot, const RobotOptions& options);

    Readings read(const double* from, int n, int shift) const noexcept;
};

/// Homogeneous transform of a site or body after MuJoCo's kinematics (position, row-major rotation).
Eigen::Matrix4d transform(const mjtNum* position, const mjtNum* rotation);
Eigen::Matrix4d inverse(const Eigen::Matrix4d& H);

/// Writes what a Simulation calls "now" to `out`, laid out as `at` says.
void measure_now(const mjModel* m, const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                 const RobotOptions& options, std::uint64_t step, double* out) noexcept;
/// Writes what it calls "last interval".
void measure_last_interval(const mjModel* m, const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                           const Noise& noise, std::uint64_t step, double* out) noexcept;

/// Once all of a step is measured: what of it, or of former steps, is read now.
void deliver(const RobotLayout& at, const RobotOptions& options, std::uint64_t step, double* out) noexcept;

/// Puts a joint-wise list (none, one for all, n) into the positions of the joints. Throws std::runtime_error
/// where one lies outside of its limits.
void put_joints(const RobotIndex& robot, const RobotOptions& options, double* qpos);

/// How many steps (s) a time (s) is. Throws std::runtime_error where it is no whole number of them; `of` says
/// what the steps are.
int steps_of(const char* name, double seconds, double step, const char* of);

} // namespace bf::physics
