#include "world/simulated_robot.hpp"

namespace bf::toolbox {

void SimulatedRobot::set_time_step(double period) {
    auto options = simulation.world().options();
    physics::Delays& delays = options.imperfections.delays;
    const bool has_delays = delays.command == delays_.command && delays.measurement == delays_.measurement;
    if (period == options.time_step && has_delays) return;
    options.time_step = period;
    delays = delays_;
    simulation = physics::Simulation(std::make_shared<const physics::World>(std::move(options)));
    control = simulation.world().control();
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
