// What robots in every physics world have in common.
#pragma once

#include "bf/core/block.hpp"
#include "bf/toolbox/robot.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace bf::toolbox {

/// Those of positions are the model's; torque motors have no speed limit of their own.
inline void simulated_limits(Limits which, const Vector& lower, const Vector& upper, Vector& minimum,
                             Vector& maximum) {
    if (which == Limits::position) {
        minimum = lower;
        maximum = upper;
    } else {
        maximum = Vector::Constant(lower.size(), std::numeric_limits<double>::infinity());
        minimum = -maximum;
    }
}

/// RobotDevice::sensor_index of a robot with one inertial sensor, on `imu`, and force/torque sensors. `place`
/// says where sensors are named.
inline int simulated_sensor(Sensor kind, const std::string& name, const std::string& imu,
                            const std::vector<std::string>& sensors, const std::string& place) {
    if (kind == Sensor::imu) {
        if (name.empty() || name == imu) return 0;
        throw std::runtime_error("the simulated robot's inertial sensor is on '" + imu + "', not on '" +
                                 name + "'; name it in the " + place + "'s imu_frame");
    }
    const auto found = std::find(sensors.begin(), sensors.end(), name);
    if (found != sensors.end()) return static_cast<int>(found - sensors.begin());
    std::string list;
    for (const auto& known : sensors) list += (list.empty() ? "" : ", ") + known;
    throw std::runtime_error("the simulated robot has no force/torque sensor '" + name + "'" +
                             did_you_mean(name, sensors) + "; sensors: " + (list.empty() ? "none" : list) +
                             "; name it in the " + place + "'s ft_sensors");
}

inline void check_simulated_measurement(Measurement what) {
    if (what > Measurement::joint_torque)
        throw std::runtime_error(
            "the simulated robot measures at its joints, not at motors; use a measured_type of Joints");
}

} // namespace bf::toolbox
