#include "world/simulated_robot.hpp"

#include "bf/core/registry.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace bf::toolbox {

void SimulatedRobot::set_time_step(double period) {
    if (period == simulation.world().options().time_step) return;
    auto options = simulation.world().options();
    options.time_step = period;
    simulation = physics::Simulation(std::make_shared<const physics::World>(std::move(options)));
}

const Eigen::VectorXd& SimulatedRobot::next_torques() noexcept {
    return control.advance(simulation.world().options().time_step, simulation.s(), simulation.s_dot(),
                           simulation.tau());
}

void SimulatedRobot::start() {
    simulation.reset();
    control.reset();
}

bool SimulatedRobot::read(Measurement what, Eigen::Ref<Eigen::VectorXd> values) noexcept {
    const Motors& motors = control.motors();
    switch (what) {
    case Measurement::joint_position: values = simulation.s(); break;
    case Measurement::joint_velocity: values = simulation.s_dot(); break;
    case Measurement::joint_acceleration: values = simulation.s_ddot(); break;
    case Measurement::joint_torque: values = simulation.tau(); break;
    case Measurement::motor_position: values = motors.gear_ratio.cwiseProduct(simulation.s()); break;
    case Measurement::motor_velocity: values = motors.gear_ratio.cwiseProduct(simulation.s_dot()); break;
    case Measurement::motor_acceleration: values = motors.gear_ratio.cwiseProduct(simulation.s_ddot()); break;
    case Measurement::motor_current: values = simulation.tau().cwiseQuotient(motors.torque_constant); break;
    case Measurement::motor_pwm: control.pwm(simulation.tau(), simulation.s_dot(), values); break;
    }
    return true;
}

bool SimulatedRobot::read(Sensor kind, int index, Eigen::Ref<Eigen::VectorXd> values) noexcept {
    if (kind == Sensor::wrench) {
        values = simulation.ft_wrench(index);
    } else {
        values << simulation.imu_rpy(), simulation.accelerometer(), simulation.gyro(),
            Eigen::Vector3d::Zero();
    }
    return true;
}

bool SimulatedRobot::set_mode(ControlMode mode) noexcept {
    control.set_mode(mode, simulation.s());
    return true;
}

bool SimulatedRobot::set_trajectory_limit(ControlMode mode, double limit) noexcept {
    control.set_trajectory_limit(mode, limit);
    return true;
}

bool SimulatedRobot::write(ControlMode, const Eigen::Ref<const Eigen::VectorXd>& references) noexcept {
    control.set_reference(references);
    return true;
}

bool SimulatedRobot::read_gains(Loop loop, Gains& gains) noexcept {
    gains = control.gains(loop);
    return true;
}

bool SimulatedRobot::write_gains(Loop loop, const Gains& gains) noexcept {
    control.set_gains(loop, gains);
    return true;
}

bool SimulatedRobot::read_motor_parameters(MotorParameters& parameters) noexcept {
    parameters = control.believed();
    return true;
}

bool SimulatedRobot::write_motor_parameters(const MotorParameters& parameters) noexcept {
    control.set_believed(parameters);
    return true;
}

void SimulatedRobot::save(double* to) const {
    simulation.save(to);
    control.save(to + simulation.state_size());
}

void SimulatedRobot::restore(const double* from) {
    simulation.restore(from);
    control.restore(from + simulation.state_size());
}

void WorldDevice::limits(Limits which, Eigen::VectorXd& minimum, Eigen::VectorXd& maximum) const {
    if (which == Limits::position) {
        minimum = world_->lower_limits();
        maximum = world_->upper_limits();
    } else { // torque motors have no speed limit of their own
        maximum = Eigen::VectorXd::Constant(joints(), std::numeric_limits<double>::infinity());
        minimum = -maximum;
    }
}

int WorldDevice::sensor_index(Sensor kind, const std::string& name) const {
    if (kind == Sensor::imu) {
        const auto& options = world_->options();
        const auto& link = options.imu_frame.empty() ? world_->base_link() : options.imu_frame;
        if (name.empty() || name == link) return 0;
        throw std::runtime_error("the simulated robot's inertial sensor is on '" + link + "', not on '" +
                                 name + "'; name it in the world's imu_frame");
    }
    const auto found = std::find(sensors_.begin(), sensors_.end(), name);
    if (found != sensors_.end()) return static_cast<int>(found - sensors_.begin());
    std::string list;
    for (const auto& known : sensors_) list += (list.empty() ? "" : ", ") + known;
    throw std::runtime_error("the simulated robot has no force/torque sensor '" + name + "'" +
                             did_you_mean(name, sensors_) + "; sensors: " + (list.empty() ? "none" : list) +
                             "; name it in the world's ft_sensors");
}

} // namespace bf::toolbox
