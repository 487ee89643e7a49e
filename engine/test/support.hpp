// Models as text, elaborated and run.
#pragma once

#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include <optional>
#include <string>
#include <vector>

namespace bf::test {

using Values = std::vector<double>;

/// A started simulation of a model in text.
class Session {
  public:
    explicit Session(const model::Model& model, const Library* more = nullptr) {
        registry_.add(standard_library());
        if (more) registry_.add(*more);
        diagram = elaborate(model, registry_);
        simulation.emplace(diagram);
    }
    explicit Session(const std::string& text, const Library* more = nullptr)
        : Session(formats::read_yaml_text(text, "m.yaml"), more) {
        simulation->start();
    }

    Values values(const std::string& path) const {
        const auto end = diagram.find_signal(path);
        if (end.node < 0) throw std::runtime_error("no signal " + path);
        const Slot& slot = diagram.slot(end);
        Values result;
        for (int i = 0; i < slot.size.count(); ++i)
            result.push_back(read_value(simulation->context().data(end.node, end.slot), slot.type, i));
        return result;
    }
    double operator()(const std::string& path) const { return values(path).at(0); }

    /// The signal after the outputs of each of the next steps.
    Values trace(const std::string& path, int steps) {
        Values result;
        for (int k = 0; k < steps; ++k) {
            if (!simulation->step()) throw std::runtime_error(simulation->failure());
            result.push_back((*this)(path));
        }
        return result;
    }

    Diagram diagram;
    std::optional<Simulation> simulation;

  private:
    Registry registry_;
};

/// Several rates and offsets, a continuous state, an enabled and a triggered subsystem.
inline const std::string multirate = R"m(
model: m
step: 0.1
blocks:
  sine: {block: Sine, frequency: "[3 5]"}
  gain: {block: Gain, K: 2}
  slow: {block: DiscreteIntegrator, period: 0.3, offset: 0.1}
  fast: {block: DiscreteIntegrator}
  plant: {block: Integrator}
  on: {block: Pulse, period: 0.4, width: 0.2, delay: 0.2}
  s:
    execution: enabled
    states: reset
    inputs: [u]
    outputs: [y]
    blocks:
      i: {block: DiscreteIntegrator}
    connections: {u: i, i: y}
  t:
    execution: triggered
    inputs: [u]
    outputs: [y]
    blocks:
      j: {block: DiscreteIntegrator}
    connections: {u: j, j: y}
connections: {sine: [gain, s.u, t.u], gain: [slow, fast, plant], on: [s.enable, t.trigger]}
)m";

} // namespace bf::test
