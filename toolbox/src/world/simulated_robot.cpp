#include "world/simulated_robot.hpp"

#include "BlockFactory/Core/Log.h"

namespace bf::toolbox {

void SimulatedRobot::set_time_step(double period) {
    auto options = world_->options();
    physics::Delays& delays = options.imperfections.delays;
    const bool has_delays = delays.command == delays_.command && delays.measurement == delays_.measurement;
    if (period != options.time_step || !has_delays) {
        options.time_step = period;
        delays = delays_;
        world_ = std::make_shared<const physics::World>(std::move(options));
        simulation = physics::SceneSimulation(world_->scene());
    }
    for (const auto& warning : world_->scene()->loop_warnings()) bfWarning << warning; // known only now
}

} // namespace bf::toolbox
