// The balancing iCub in closed loop, beside the bare physics of the same motion.
#include "run.hpp"
#include "session.hpp"

#include "bf/physics/world.hpp"
#include "bf/toolbox/robot.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace {

constexpr double simulated = 4.0; // s

bf::LoadedModel balancing(const char* period) {
    bf::tools::ModelOptions options;
    options.file = BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml";
    options.sets = {std::string("T_control=") + period, "scenario=1"};
    return bf::tools::load_model(options);
}

void closed_loop(benchmark::State& state, const char* period) {
    const auto loaded = balancing(period);
    bf::Simulation simulation(loaded.diagram);
    for (auto _ : state) {
        const auto result = bf::tools::run(simulation, simulated);
        if (!result.failure.empty()) throw std::runtime_error(result.failure);
    }
    state.counters["simulated_s"] = simulated;
}

/// Records the torques that the controller sends, to repeat the motion without it.
class Torques final : public bf::Run::Observer {
  public:
    explicit Torques(const bf::Diagram& diagram) : end_(diagram.find_signal("world.tau_measured")) {}
    void observe(const bf::Run& run) noexcept override {
        const auto& simulation = static_cast<const bf::Simulation&>(run);
        const auto* tau = static_cast<const double*>(simulation.context().data(end_.node, end_.slot));
        values.insert(values.end(), tau, tau + n);
    }
    static constexpr int n = 23;
    std::vector<double> values;

  private:
    bf::Node::End end_;
};

void bare_physics(benchmark::State& state) {
    const auto loaded = balancing("0.01");
    bf::Simulation simulation(loaded.diagram);
    Torques torques(loaded.diagram);
    simulation.add_observer(torques);
    bf::tools::run(simulation, simulated);

    // A fresh world of the same options, stepped with the same torques: the same motion without a controller.
    bf::Simulation world_only(loaded.diagram);
    const int world = loaded.diagram.find_node("world");
    auto task = world_only.context().task(world, bf::Phase::update, 0);
    const auto& objects = loaded.diagram.nodes[static_cast<std::size_t>(world)].block->declaration().objects;
    const auto provided =
        std::find_if(objects.begin(), objects.end(), [](const auto& o) { return o.provision == 0; });
    auto& robot = *static_cast<bf::toolbox::RobotConnection*>(
        world_only.context().frame(world).objects[provided - objects.begin()]);
    world_only.start();
    // The torque measured at step k + 1 is the one that acted in step k.
    const auto steps = torques.values.size() / Torques::n;
    for (auto _ : state) {
        world_only.context().start(world);
        for (std::size_t k = 1; k < steps; ++k) {
            robot.write(bf::toolbox::ControlMode::torque,
                        Eigen::Map<const Eigen::VectorXd>(&torques.values[k * Torques::n], Torques::n));
            if (!task()) throw std::runtime_error(robot.error());
        }
    }
}

void closed_loop_100hz(benchmark::State& state) { closed_loop(state, "0.01"); }
void closed_loop_1khz(benchmark::State& state) { closed_loop(state, "0.001"); }

} // namespace

BENCHMARK(closed_loop_100hz)->Name("loop.icub_100hz/diagram")->Unit(benchmark::kMillisecond);
BENCHMARK(closed_loop_1khz)->Name("loop.icub_1khz/diagram")->Unit(benchmark::kMillisecond);
BENCHMARK(bare_physics)->Name("loop.icub/bare_physics")->Unit(benchmark::kMillisecond);
