#pragma once

#include "bf/physics/world.hpp"
#include "spec.hpp"

#include <vector>

namespace bf::physics {

/// The model, and where in it each quantity of the interface lives.
struct World::Impl {
    WorldOptions options; ///< complete: joints, base link, IMU frame and F/T child links filled in
    ModelPtr model;

    std::vector<int> position;     ///< n, joint → index in qpos
    std::vector<int> velocity;     ///< n, joint → index in qvel
    std::vector<int> foot_of_geom; ///< per geom: foot it belongs to, or -1
    std::vector<int> foot_sites, ft_sites, push_sites;
    std::vector<int> force_sensors, torque_sensors; ///< per F/T sensor: index in sensordata
    std::vector<FollowerAddress> followers;
    std::vector<std::string> warnings, bodies;
    int base_site = -1, imu_site = -1;
    int gyro = -1, accelerometer = -1; ///< index in sensordata

    Eigen::VectorXd start; ///< nq, qpos at t = 0
    Eigen::VectorXd lower_limits, upper_limits, effort_limits;
    double mass = 0.0;

    int n() const { return static_cast<int>(options.joints.size()); }

    /// Indices of a compiled model.
    void index();
    /// Fills `start`; places a fixed base.
    void place();
};

/// Homogeneous transform of a site or body after MuJoCo's kinematics (position, row-major rotation).
Eigen::Matrix4d transform(const mjtNum* position, const mjtNum* rotation);
Eigen::Matrix4d inverse(const Eigen::Matrix4d& H);

} // namespace bf::physics
