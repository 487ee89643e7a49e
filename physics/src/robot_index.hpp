#pragma once

#include "bf/physics/world.hpp"
#include "spec.hpp"

#include <cstdint>
#include <vector>

namespace bf::physics {

/// Where in a compiled model the quantities of one robot live. `prefix` stands before the robot's names
/// there.
struct RobotIndex {
    std::vector<int> position; ///< n, joint → index in qpos
    std::vector<int> velocity; ///< n, joint → index in qvel
    std::vector<int> motors;   ///< n, joint → index in ctrl
    std::vector<int> ft_sites, push_sites;
    std::vector<int> force_sensors, torque_sensors; ///< per F/T sensor: index in sensordata
    std::vector<FollowerAddress> followers;
    int base_site = -1, imu_site = -1;
    int gyro = -1, accelerometer = -1; ///< index in sensordata
    /// Bodies whose subtrees make the robot; none: everything that there is.
    std::vector<int> roots;
    Eigen::VectorXd lower_limits, upper_limits, effort_limits; ///< n

    /// Looks everything up that make_robot named. Throws std::runtime_error for a force/torque sensor that
    /// carries no mass.
    void find(const mjModel* m, const RobotOptions& options, const std::string& prefix = {});
    int n() const { return static_cast<int>(position.size()); }
};

/// Where each measurement of a robot stands in a flat vector, which is saved and restored as it is.
struct RobotLayout {
    int s, s_dot, s_ddot, tau, w_H_b, v_b, com, imu_rotation, imu_rpy, gyro, accelerometer, ft_wrenches;

    /// `at` is where the first one stands, and becomes where the next thing may stand.
    RobotLayout(int& at, int n, int ft_sensors);
};

/// Homogeneous transform of a site or body after MuJoCo's kinematics (position, row-major rotation).
Eigen::Matrix4d transform(const mjtNum* position, const mjtNum* rotation);
Eigen::Matrix4d inverse(const Eigen::Matrix4d& H);
/// Writes the pose of a site to 16 doubles, column-major.
void measure_pose(const mjData* d, int site, double* out) noexcept;

/// Writes what a Simulation calls "now" to `out`, laid out as `at` says.
void measure_now(const mjModel* m, const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                 const Noise& noise, std::uint64_t step, double* out) noexcept;
/// Writes what it calls "last interval".
void measure_last_interval(const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                           const Noise& noise, std::uint64_t step, double* out) noexcept;

/// Puts a joint-wise list (none, one for all, n) into the positions of the joints. Throws std::runtime_error
/// where one lies outside of its limits.
void put_joints(const RobotIndex& robot, const RobotOptions& options, double* qpos);

/// The inertia (n, kg m2) that each joint sees at positions qpos, its armature and followers included.
Eigen::VectorXd joint_inertias(const mjModel* m, const RobotIndex& robot, const Eigen::VectorXd& qpos);

} // namespace bf::physics
