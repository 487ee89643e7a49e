// The robot of a physics world, as a robot that can be connected to.
#pragma once

#include "bf/toolbox/simulated_robot.hpp"
#include "world/simulated.hpp"

namespace bf::toolbox {

/// A running robot: the physics, its motors and the loops in front of them.
class SimulatedRobot final : public SimulatedConnection {
  public:
    SimulatedRobot(std::shared_ptr<const physics::World> world, const physics::Delays& delays)
        : simulation(std::move(world)), control(simulation.world().control()), delays_(delays) {}

    physics::Simulation simulation;
    physics::JointControl control;

    /// The time step is the period of the world block; a world compiled for another one is compiled again.
    /// Throws std::runtime_error for delays that are no multiples of it.
    void set_time_step(double period);
    /// Joint torques of the next interval (n), by the loops from what was commanded last.
    const Vector& next_torques() noexcept {
        const physics::Readings now = simulation.readings_at_loops();
        return control.advance(simulation.world().options().time_step, now.s, now.s_dot, now.tau);
    }

    void start() override;
    void stop() noexcept override { control.reset(); }
    const char* error() const noexcept override { return simulation.error(); }

    int state_size() const override { return simulation.state_size() + control.state_size(); }
    void save(double* to) const override;
    void restore(const double* from) override;

  protected:
    std::optional<View> view() noexcept override {
        return View{control,
                    simulation.readings(),
                    simulation.readings_at_loops(),
                    simulation.imu_rpy(),
                    simulation.accelerometer(),
                    simulation.gyro()};
    }
    Eigen::Map<const Vector6> ft_wrench(int i) const noexcept override { return simulation.ft_wrench(i); }

  private:
    const physics::Delays delays_;
};

/// The compiled world, and the delays of its robot, which its time step has yet to fit.
class WorldDevice final : public WithAllModes<SimulatedDevice> {
  public:
    WorldDevice(std::shared_ptr<const physics::World> compiled, const physics::Delays& delays,
                std::vector<std::string> sensor_names)
        : world_(std::move(compiled)), delays_(delays), sensors_(std::move(sensor_names)) {}

    const physics::World& world() const override { return *world_; }
    const std::vector<std::string>& joint_names() const override { return world_->joint_names(); }
    void limits(Limits which, Vector& minimum, Vector& maximum) const override {
        simulated_limits(which, world_->lower_limits(), world_->upper_limits(), minimum, maximum);
    }
    int sensor_index(Sensor kind, const std::string& name) const override {
        return simulated_sensor(kind, name, world_->options().imu_frame, sensors_, "world");
    }
    std::shared_ptr<RobotConnection> open() const override {
        return std::make_shared<SimulatedRobot>(world_, delays_);
    }

  private:
    std::shared_ptr<const physics::World> world_;
    physics::Delays delays_;
    std::vector<std::string> sensors_; ///< force/torque sensors, named as in the model file
};

} // namespace bf::toolbox
