// The robot of a world of its own.
#pragma once

#include "bf/toolbox/simulated_robot.hpp"
#include "world/simulated.hpp"

namespace bf::toolbox {

/// A running robot with its world.
class SimulatedRobot final : public SimulatedConnection {
  public:
    SimulatedRobot(std::shared_ptr<const physics::World> world, const physics::Delays& delays,
                   std::vector<std::string> sensors)
        : SimulatedConnection(0, std::move(sensors)), simulation(world->scene()), world_(std::move(world)),
          delays_(delays) {
        bind(simulation);
    }

    physics::SceneSimulation simulation;

    /// The time step is the period of the world block; a world compiled for another one is compiled again.
    /// Throws std::runtime_error for delays that are no multiples of it.
    void set_time_step(double period);

    void start() override { simulation.reset(); }
    void stop() noexcept override { simulation.control(0).reset(); }

    int state_size() const override { return simulation.state_size(); }
    void save(double* to) const override { simulation.save(to); }
    void restore(const double* from) override {
        warn_of_another_world(simulation, from, "its MujocoWorld");
        simulation.restore(from);
    }

  private:
    std::shared_ptr<const physics::World> world_;
    const physics::Delays delays_;
};

/// The compiled world, and the delays of its robot, which its time step has yet to fit.
class WorldDevice final : public SimulatedAs<SimulatedDevice> {
  public:
    WorldDevice(std::shared_ptr<const physics::World> compiled, const physics::Delays& delays,
                std::vector<std::string> sensors)
        : SimulatedAs(compiled->scene(), 0, std::move(sensors), "world"), world_(std::move(compiled)),
          delays_(delays) {}

    const physics::World& world() const override { return *world_; }
    std::shared_ptr<RobotConnection> open() const override {
        return std::make_shared<SimulatedRobot>(world_, delays_, sensors_);
    }

  private:
    std::shared_ptr<const physics::World> world_;
    physics::Delays delays_;
};

} // namespace bf::toolbox
