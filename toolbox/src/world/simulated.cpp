#include "world/simulated.hpp"

#include "BlockFactory/Core/Log.h"
#include "bf/base/names.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace bf::toolbox {

void warn_of_another_world(const physics::SceneSimulation& simulation, const double* state,
                           const std::string& describes) {
    if (!simulation.is_of_this_scene(state))
        bfWarning << "the state that is restored is of another world than " + describes +
                         " describes now: masses, shapes, seeds or others of its numbers, or a file that it "
                         "names, have changed; the run goes on in the new one";
}

bool SimulatedConnection::read(Measurement what, Eigen::Ref<Vector> values) noexcept {
    if (!scene_) return false;
    const physics::Readings joints = scene_->readings(robot_);
    const physics::JointControl& control = scene_->control(robot_);
    switch (what) {
    case Measurement::joint_position: values = joints.s; break;
    case Measurement::joint_velocity: values = joints.s_dot; break;
    case Measurement::joint_acceleration: values = joints.s_ddot; break;
    case Measurement::joint_torque: values = joints.tau; break;
    case Measurement::motor_position: values = joints.motor_position; break;
    case Measurement::motor_velocity: values = joints.motor_velocity; break;
    case Measurement::motor_acceleration: values = joints.motor_acceleration; break;
    case Measurement::motor_current:
        values = joints.tau.cwiseQuotient(control.motors().torque_constant);
        break;
    case Measurement::motor_pwm: control.pwm(joints.tau, joints.s_dot, values); break;
    }
    return true;
}

bool SimulatedConnection::read(Sensor kind, const std::string& name, Eigen::Ref<Vector> values) noexcept {
    if (!scene_) return false;
    if (kind == Sensor::imu) {
        values << scene_->imu_rpy(robot_), scene_->accelerometer(robot_), scene_->gyro(robot_),
            Vector3::Zero();
        return true;
    }
    const auto found = std::find(wrenches_.begin(), wrenches_.end(), name);
    if (found == wrenches_.end()) return false;
    values = scene_->ft_wrench(robot_, static_cast<int>(found - wrenches_.begin()));
    return true;
}

bool SimulatedConnection::read(Limits which, Eigen::Ref<Vector> minimum,
                               Eigen::Ref<Vector> maximum) noexcept {
    if (!scene_) return false;
    if (which == Limits::position) {
        minimum = scene_->scene().lower_limits(robot_);
        maximum = scene_->scene().upper_limits(robot_);
    } else { // torque motors have none of their own
        maximum.setConstant(std::numeric_limits<double>::infinity());
        minimum = -maximum;
    }
    return true;
}

std::vector<std::string> SimulatedConnection::sensors(Sensor kind) const {
    if (kind == Sensor::wrench) return wrenches_;
    if (!scene_) return {};
    return {scene_->scene().options().robots[static_cast<std::size_t>(robot_)].options.imu_frame};
}

int SimulatedConnection::joint_in_other_mode(ControlMode mode) noexcept {
    return !scene_ || scene_->control(robot_).mode() == mode ? -1 : 0;
}

bool SimulatedConnection::set_mode(ControlMode mode) noexcept {
    if (scene_) scene_->set_mode(robot_, mode);
    return scene_ != nullptr;
}

template <class F> bool SimulatedConnection::with_control(F&& f) noexcept {
    if (scene_) f(scene_->control(robot_));
    return scene_ != nullptr;
}

bool SimulatedConnection::set_trajectory_limit(ControlMode mode, double limit) noexcept {
    return with_control([&](auto& control) { control.set_trajectory_limit(mode, limit); });
}
bool SimulatedConnection::write(ControlMode, const Eigen::Ref<const Vector>& references) noexcept {
    // What is beyond the numbers that a scene takes asks for all that the joint can give, as they do.
    return with_control(
        [&](auto& control) { control.set_reference(references.cwiseMax(-1e10).cwiseMin(1e10)); });
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

Status failed_step(const physics::Failure& failure) {
    using Cause = physics::Failure::Cause;
    switch (failure.cause) {
    case Cause::reference:
        return Status::failure("the reference of joint {} of the robot {} of the world is not finite or not "
                               "below 1e10; look at what computes it",
                               failure.part + 1, failure.robot + 1);
    case Cause::wrench:
        return Status::failure("the wrench on push link {} of the robot {} of the world is not finite or not "
                               "below 1e10; look at what computes it",
                               failure.part + 1, failure.robot + 1);
    case Cause::control:
        return Status::failure("the signal of an actuator is not finite or not below 1e10; look at what "
                               "computes it");
    case Cause::contacts:
        return Status::failure("there are more than 256 contacts at a time, which the blocks that feel "
                               "contacts do not remember; give bodies simpler shapes, or leave these blocks "
                               "out");
    case Cause::none:
    case Cause::motion: break;
    }
    return Status::failure("the physics diverged; look at the gains, the contact parameters and the step");
}

void check_simulated_sensor(Sensor kind, const std::string& name, const std::string& imu,
                            const std::vector<std::string>& sensors, const std::string& place) {
    if (kind == Sensor::imu) {
        if (name.empty() || name == imu) return;
        throw std::runtime_error("the simulated robot's inertial sensor is on '" + imu + "', not on '" +
                                 name + "'; name it in the " + place + "'s imu_frame");
    }
    if (std::find(sensors.begin(), sensors.end(), name) != sensors.end()) return;
    std::string list;
    for (const auto& known : sensors) list += (list.empty() ? "" : ", ") + known;
    throw std::runtime_error("the simulated robot has no force/torque sensor '" + name + "'" +
                             did_you_mean(name, sensors) + "; sensors: " + (list.empty() ? "none" : list) +
                             "; name it in the " + place + "'s ft_sensors");
}

} // namespace bf::toolbox
