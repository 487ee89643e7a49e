// Exact linearisation beside central differences of the same blocks, and the gradient of a run beside the
// run.
#include "bf/analysis/gradient.hpp"
#include "bf/analysis/linearize.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/formats/yaml.hpp"
#include "session.hpp"

#include <benchmark/benchmark.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace {

/// Links of a chain, each with its state: x_i' = sin(x_{i-1}) - 0.3 x_i.
std::string chain(int links) {
    std::string blocks, wires = "connections:\n  u: f0\n";
    for (int i = 0; i < links; ++i) {
        const std::string n = std::to_string(i);
        blocks += "  f" + n + ": {block: Fcn, expression: sin(u)}\n  s" + n +
                  ": {block: Sum, signs: +-}\n  x" + n + ": {block: Integrator}\n  d" + n +
                  ": {block: Gain, K: 0.3}\n";
        wires += "  f" + n + ": s" + n + ".u1\n  s" + n + ": x" + n + "\n  d" + n + ": s" + n + ".u2\n  x" +
                 n + ": [d" + n + ", " + (i + 1 < links ? "f" + std::to_string(i + 1) : "y") + "]\n";
    }
    return "model: chain\nstep: 0.01\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n" + blocks + wires;
}

void linearize_1000(benchmark::State& state, bool by_differences) {
    bf::Registry registry;
    registry.add(bf::standard_library());
    const auto diagram = bf::elaborate(bf::formats::read_yaml_text(chain(250), "chain.yaml"), registry);
    bf::Simulation run(diagram);
    run.start();
    for (auto _ : state)
        benchmark::DoNotOptimize(bf::analysis::linearize(run, {.by_differences = by_differences}));
}

/// From what the robot measures to the torques of the balancing controller.
void linearize_icub(benchmark::State& state, bool by_differences) {
    const auto loaded = bf::load(BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml");
    bf::Simulation run(loaded.diagram);
    run.start();
    const bf::analysis::LinearizeOptions options{.from = {"controller.s", "controller.s_dot"},
                                                 .to = {"controller.tau"},
                                                 .by_differences = by_differences};
    for (auto _ : state) benchmark::DoNotOptimize(bf::analysis::linearize(run, options));
    run.stop();
}

/// 1 s of the closed loop of examples/cart_pole, and its gradient by the four gains that centre it.
void gradient_cartpole(benchmark::State& state, bool is_gradient) {
    const auto loaded = bf::load(BF_SOURCE_DIRECTORY "/examples/cart_pole/model.yaml");
    bf::Simulation run(loaded.diagram);
    run.start();
    const bf::analysis::GradientOptions options{
        .by = {"controller.centring.K"}, .cost = "controller.distance", .duration = 1};
    for (auto _ : state)
        if (is_gradient) {
            benchmark::DoNotOptimize(bf::analysis::gradient(run, options));
        } else {
            run.start();
            if (!run.run_until(1)) throw std::runtime_error(run.failure());
        }
}

/// 1 s of a linear system of 32 states, and its gradient by the 1024 numbers of its matrix.
void gradient_1024(benchmark::State& state, bf::analysis::GradientOptions::Way way) {
    bf::Registry registry;
    registry.add(bf::standard_library());
    const auto diagram =
        bf::elaborate(bf::formats::read_yaml_text(
                          "model: m\nstep: 0.01\nblocks:\n  x: {block: UnitDelay, initial: (1:32)', period: "
                          "0.01}\n  A: {block: Gain, multiplication: K*u, K: 0.9*eye(32)}\n  J: {block: "
                          "Dot}\nconnections: {x: [A, J.u1, J.u2], A: x}\n",
                          "m.yaml"),
                      registry);
    bf::Simulation run(diagram);
    run.start();
    const bf::analysis::GradientOptions options{.by = {"A.K"}, .cost = "J", .duration = 1, .way = way};
    for (auto _ : state) benchmark::DoNotOptimize(bf::analysis::gradient(run, options));
}

const bool added = [] {
    using benchmark::RegisterBenchmark;
    for (const bool is_gradient : {true, false})
        RegisterBenchmark(is_gradient ? "analysis.gradient_cartpole/gradient"
                                      : "analysis.gradient_cartpole/run",
                          gradient_cartpole, is_gradient)
            ->Unit(benchmark::kMillisecond);
    using Way = bf::analysis::GradientOptions::Way;
    for (const Way way : {Way::adjoint, Way::forward})
        RegisterBenchmark(way == Way::adjoint ? "analysis.gradient_1024/adjoint"
                                              : "analysis.gradient_1024/forward",
                          gradient_1024, way)
            ->Unit(benchmark::kMillisecond);
    for (const bool by_differences : {false, true}) {
        const std::string how = by_differences ? "differences" : "exact";
        RegisterBenchmark(("analysis.linearize_1000/" + how).c_str(), linearize_1000, by_differences)
            ->Unit(benchmark::kMillisecond);
        RegisterBenchmark(("analysis.linearize_icub/" + how).c_str(), linearize_icub, by_differences)
            ->Unit(benchmark::kMillisecond);
    }
    return true;
}();

} // namespace
