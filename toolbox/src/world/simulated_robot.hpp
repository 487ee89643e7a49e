// The robot of a physics world, as a robot that can be connected to.
#pragma once

#include "bf/toolbox/simulated_robot.hpp"
#include "world/joint_control.hpp"

#include <stdexcept>

namespace bf::toolbox {

/// A running robot: the physics, its motors and the loops in front of them.
class SimulatedRobot final : public RobotConnection {
  public:
    SimulatedRobot(std::shared_ptr<const physics::World> world, const Motors& motors)
        : simulation(std::move(world)), control(motors) {}

    physics::Simulation simulation;
    JointControl control;

    /// The time step is the period of the world block; a world compiled for another one is compiled again.
    void set_time_step(double period);
    /// Joint torques of the next interval (n), by the loops from what was commanded last.
    const Eigen::VectorXd& next_torques() noexcept;

    void start() override;
    void stop() noexcept override { control.reset(); }
    bool read(Measurement what, Eigen::Ref<Eigen::VectorXd> values) noexcept override;
    bool read(Sensor kind, int index, Eigen::Ref<Eigen::VectorXd> values) noexcept override;
    bool set_mode(ControlMode mode) noexcept override;
    int joint_in_other_mode(ControlMode mode) const noexcept override {
        return mode == control.mode() ? -1 : 0;
    }
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override;
    bool write(ControlMode, const Eigen::Ref<const Eigen::VectorXd>& references) noexcept override;
    bool read_gains(Loop loop, Gains& gains) noexcept override;
    bool write_gains(Loop loop, const Gains& gains) noexcept override;
    bool read_motor_parameters(MotorParameters& parameters) noexcept override;
    bool write_motor_parameters(const MotorParameters& parameters) noexcept override;
    const char* error() const noexcept override { return simulation.error(); }

    bool can_save() const override { return true; }
    int state_size() const override { return simulation.state_size() + control.state_size(); }
    void save(double* to) const override;
    void restore(const double* from) override;
};

/// The compiled world and the motors of its robot.
class WorldDevice final : public SimulatedDevice {
  public:
    WorldDevice(std::shared_ptr<const physics::World> compiled, Motors motors,
                std::vector<std::string> sensor_names)
        : world_(std::move(compiled)), motors_(std::move(motors)), sensors_(std::move(sensor_names)) {}

    const physics::World& world() const override { return *world_; }
    const std::vector<std::string>& joint_names() const override { return world_->joint_names(); }
    void limits(Limits which, Eigen::VectorXd& minimum, Eigen::VectorXd& maximum) const override;
    int sensor_index(Sensor kind, const std::string& name) const override;
    void check_mode(ControlMode mode) const override {
        if (mode == ControlMode::impedance)
            throw std::runtime_error(
                "the robot of a MujocoWorld has no impedance loop; use a control_type of "
                "Position Direct, or the robot of a World");
    }
    void check_measurement(Measurement) const override {}
    void check_gains(Loop) const override {}
    void check_motor_parameters() const override {}
    std::shared_ptr<RobotConnection> open() const override {
        return std::make_shared<SimulatedRobot>(world_, motors_);
    }

  private:
    std::shared_ptr<const physics::World> world_;
    Motors motors_;
    std::vector<std::string> sensors_; ///< force/torque sensors, named as in the model file
};

} // namespace bf::toolbox
