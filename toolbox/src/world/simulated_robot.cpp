#include "world/simulated_robot.hpp"

namespace bf::toolbox {

void SimulatedRobot::set_time_step(double period) {
    if (period == simulation.world().options().time_step) return;
    auto options = simulation.world().options();
    options.time_step = period;
    simulation = physics::Simulation(std::make_shared<const physics::World>(std::move(options)));
}

void SimulatedRobot::start() {
    simulation.reset();
    control.reset();
}

void SimulatedRobot::save(double* to) const {
    simulation.save(to);
    control.save(to + simulation.state_size());
}

void SimulatedRobot::restore(const double* from) {
    simulation.restore(from);
    control.restore(from + simulation.state_size());
}

} // namespace bf::toolbox
