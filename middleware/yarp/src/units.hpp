// Units of YARP's programs.
#pragma once

#include "bf/toolbox/robot_device.hpp"

#include <cmath>

namespace bf::yarp {

inline constexpr double degrees = 180 / M_PI; ///< for one rad

/// Is it of angles, in degrees, where the joint is no prismatic one? The others are Nm or N, and raw.
constexpr bool is_of_angles(toolbox::Measurement what) {
    return what != toolbox::Measurement::joint_torque && what != toolbox::Measurement::motor_current &&
           what != toolbox::Measurement::motor_pwm;
}

} // namespace bf::yarp
