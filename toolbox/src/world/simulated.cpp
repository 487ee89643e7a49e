#include "world/simulated.hpp"

#include "bf/core/registry.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace bf::toolbox {

bool SimulatedConnection::read(Measurement what, Eigen::Ref<Vector> values) noexcept {
    const auto now = view();
    if (!now) return false;
    const physics::Readings& joints = now->joints;
    switch (what) {
    case Measurement::joint_position: values = joints.s; break;
    case Measurement::joint_velocity: values = joints.s_dot; break;
    case Measurement::joint_acceleration: values = joints.s_ddot; break;
    case Measurement::joint_torque: values = joints.tau; break;
    case Measurement::motor_position: values = joints.motor_position; break;
    case Measurement::motor_velocity: values = joints.motor_velocity; break;
    case Measurement::motor_acceleration: values = joints.motor_acceleration; break;
    case Measurement::motor_current:
        values = joints.tau.cwiseQuotient(now->control.motors().torque_constant);
        break;
    case Measurement::motor_pwm: now->control.pwm(joints.tau, joints.s_dot, values); break;
    }
    return true;
}

bool SimulatedConnection::read(Sensor kind, int index, Eigen::Ref<Vector> values) noexcept {
    const auto now = view();
    if (!now) return false;
    if (kind == Sensor::wrench)
        values = ft_wrench(index);
    else
        values << now->imu_rpy, now->accelerometer, now->gyro, Vector3::Zero();
    return true;
}

int SimulatedConnection::joint_in_other_mode(ControlMode mode) noexcept {
    const auto now = view();
    return !now || now->control.mode() == mode ? -1 : 0;
}

bool SimulatedConnection::set_mode(ControlMode mode) noexcept {
    const auto now = view();
    if (now) now->control.set_mode(mode, now->at_loops.s);
    return now.has_value();
}

template <class F> bool SimulatedConnection::with_control(F&& f) noexcept {
    const auto now = view();
    if (now) f(now->control);
    return now.has_value();
}

bool SimulatedConnection::set_trajectory_limit(ControlMode mode, double limit) noexcept {
    return with_control([&](auto& control) { control.set_trajectory_limit(mode, limit); });
}
bool SimulatedConnection::write(ControlMode, const Eigen::Ref<const Vector>& references) noexcept {
    return with_control([&](auto& control) { control.set_reference(references); });
}
bool SimulatedConnection::read_gains(Loop loop, Gains& gains) noexcept {
    return with_control([&](auto& control) { gains = control.gains(loop); });
}
bool SimulatedConnection::write_gains(Loop loop, const Gains& gains) noexcept {
    return with_control([&](auto& control) { control.set_gains(loop, gains); });
}
bool SimulatedConnection::read_motor_parameters(MotorParameters& parameters) noexcept {
    return with_control([&](auto& control) { parameters = control.believed(); });
}
bool SimulatedConnection::write_motor_parameters(const MotorParameters& parameters) noexcept {
    return with_control([&](auto& control) { control.set_believed(parameters); });
}

void simulated_limits(Limits which, const Vector& lower, const Vector& upper, Vector& minimum,
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
int simulated_sensor(Sensor kind, const std::string& name, const std::string& imu,
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

} // namespace bf::toolbox
