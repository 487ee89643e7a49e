// Exact linearisation beside central differences of the same blocks, and the gradient of a run beside the
// run.
#include "bf/analysis/gradient.hpp"
#include "bf/analysis/linearize.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/formats/yaml.hpp"
#include "part_of_diagram.hpp"
#include "session.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

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

/// The law by which the iCub balances, alone and each millisecond, at what the robot measures in a run.
class BalancingLaw {
  public:
    BalancingLaw() {
        bf::tools::ModelOptions options;
        options.file = BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml";
        options.sets = {"T_control=0.001"};
        loaded_ = bf::tools::load_model(options);
        leave(loaded_.diagram, "", [](const bf::DiagramNode& node) {
            const bool touches_robot = node.type == "WholeBodyToolbox/GetMeasurement" ||
                                       node.type == "WholeBodyToolbox/GetSensor" ||
                                       node.type == "WholeBodyToolbox/SetReferences";
            return node.path == "robot" || (node.path.starts_with("controller.") && !touches_robot);
        });
        const auto whole = bf::tools::load_model(options);
        bf::Simulation simulation(whole.diagram);
        Watch watch(loaded_.diagram.inputs);
        simulation.add_observer(watch);
        simulation.start();
        for (std::size_t k = 0; k < points; ++k)
            if (!simulation.step()) throw std::runtime_error(simulation.failure());
        measured_ = std::move(watch.values);
        run_ = std::make_unique<bf::Simulation>(loaded_.diagram);
        inputs_ = std::make_unique<Inputs>(*run_, measured_);
        run_->start();
        at_ = run_->snapshot();
        bf::analysis::LinearizeOptions asked{.from = {"controller.s", "controller.s_dot"},
                                             .to = {"controller.tau"}};
        exact_.emplace(*run_, asked);
        asked.by_differences = true;
        by_blocks_.emplace(*run_, asked);
        find_elements();
    }

    /// To the next measurements, and the states to which the last step went.
    void go_on() {
        k_ = (k_ + 1) % points;
        inputs_->set(k_);
    }
    /// Makes the step.
    bf::analysis::LinearSystem linearize(bool by_differences) {
        return (by_differences ? *by_blocks_ : *exact_)();
    }
    /// [A B; C D] by two steps for each column, which need but states, inputs and outputs; and makes the
    /// step.
    bf::analysis::Matrix by_steps() {
        at_ = run_->snapshot();
        const auto columns = static_cast<Eigen::Index>(moved_.size()),
                   rows = static_cast<Eigen::Index>(results_.size());
        bf::analysis::Matrix slopes(rows, columns);
        bf::analysis::Vector above(rows), below(rows);
        for (Eigen::Index c = 0; c < columns; ++c) {
            const double change = 6e-6 * std::max(1.0, std::abs(*moved_[static_cast<std::size_t>(c)]));
            step_from_here(c, change, above);
            step_from_here(c, -change, below);
            slopes.col(c) = (above - below) / (2 * change);
        }
        restore();
        step();
        return slopes;
    }
    void restore() {
        run_->restore(at_);
        inputs_->set(k_);
    }
    void step() {
        if (!run_->step()) throw std::runtime_error(run_->failure());
    }

  private:
    static constexpr std::size_t points = 64;

    void step_from_here(Eigen::Index c, double change, bf::analysis::Vector& results) {
        restore();
        *moved_[static_cast<std::size_t>(c)] += change;
        step();
        for (std::size_t i = 0; i < results_.size(); ++i)
            results[static_cast<Eigen::Index>(i)] = *results_[i];
    }
    /// Where the states, inputs and outputs of the linear system have their numbers.
    void find_elements() {
        std::map<std::string, double*> numbers;
        const auto& d = run_->diagram();
        const auto add = [&](const std::string& name, const bf::Node::End& end) {
            if (d.slot(end).type != bf::Type::float64) return;
            const int count = d.slot(end).size.count();
            auto* data = static_cast<double*>(run_->context().data(end.node, end.slot));
            for (int e = 0; e < count; ++e)
                numbers[count == 1 ? name : name + d.element_text(end, e)] = data + e;
        };
        const auto count_of_slots = [&](int n) {
            return static_cast<int>(d.nodes[static_cast<std::size_t>(n)].block->resolution().slots.size());
        };
        for (const std::string name : {"controller.s", "controller.s_dot", "controller.tau"})
            add(name, d.find_signal(name));
        for (int n = 0; n < static_cast<int>(d.nodes.size()); ++n)
            for (int s = 0; s < count_of_slots(n); ++s)
                if (d.slot({n, s}).role == bf::Role::discrete_state) add(d.end_path({n, s}), {n, s});
        go_on();
        const auto system = linearize(false);
        for (const auto* names : {&system.states, &system.inputs})
            for (const auto& name : *names) moved_.push_back(numbers.at(name));
        for (const auto* names : {&system.states, &system.outputs})
            for (const auto& name : *names) results_.push_back(numbers.at(name));
        restore();
        bf::analysis::Matrix exact(results_.size(), moved_.size());
        exact << system.A, system.B, system.C, system.D;
        if (!by_steps().isApprox(exact, 1e-5))
            throw std::runtime_error("the law's linear system is not what its steps say");
    }

    bf::LoadedModel loaded_;
    std::vector<double> measured_; ///< inputs of all points
    std::unique_ptr<bf::Simulation> run_;
    std::unique_ptr<Inputs> inputs_;
    std::optional<bf::analysis::Linearizer> exact_, by_blocks_;
    std::vector<std::byte> at_;
    std::size_t k_ = 0;
    std::vector<double*> moved_, results_; ///< states and inputs, states and outputs
};

enum class Measured : std::uint8_t { exact, steps, blocks, one_step };

/// From what the robot measures to the torques of the balancing controller, each time at another point.
void linearize_icub(benchmark::State& state, Measured what) {
    BalancingLaw law;
    for (auto _ : state) {
        law.go_on();
        switch (what) {
        case Measured::exact: benchmark::DoNotOptimize(law.linearize(false)); break;
        case Measured::steps: benchmark::DoNotOptimize(law.by_steps()); break;
        case Measured::blocks: benchmark::DoNotOptimize(law.linearize(true)); break;
        case Measured::one_step: law.step(); break;
        }
    }
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
    }
    for (const auto& [how, what] : {std::pair{"exact", Measured::exact},
                                    {"steps", Measured::steps},
                                    {"blocks", Measured::blocks},
                                    {"one_step", Measured::one_step}})
        RegisterBenchmark((std::string("analysis.linearize_icub/") + how).c_str(), linearize_icub, what)
            ->Unit(benchmark::kMillisecond);
    return true;
}();

} // namespace
