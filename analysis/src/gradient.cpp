#include "bf/analysis/gradient.hpp"

#include "bf/core/registry.hpp"
#include "dual_run.hpp"
#include "named.hpp"

#include <algorithm>
#include <cmath>

namespace bf::analysis {

namespace {

/// An element of a parameter, a state or an input.
struct Place {
    Node::End end;
    int element;
    std::string name;
};

/// Appends what a name stands for: one element, or all.
void append(const Diagram& d, const SignalFinder& finder, const std::string& name, bool is_signal,
            std::vector<Place>& places) {
    const auto its = named(name, [&](const std::string& path) {
        const auto signal = finder.find(path);
        const bool is_input =
            signal.node >= 0 &&
            d.nodes[static_cast<std::size_t>(signal.node)].block->declaration().traits.is_root_input;
        if (is_signal || is_input) return signal;
        const auto parameter = d.find_parameter(path);
        return parameter.node >= 0 ? parameter : find_state(d, path);
    });
    if (its.end.node < 0) {
        std::vector<std::string> known;
        if (is_signal)
            for (const auto& one : finder.all()) known.push_back(one.path);
        else
            for (const auto& node : d.nodes)
                for (const auto& slot : node.block->resolution().slots)
                    if (slot.role == Role::parameter || is_state(slot.role))
                        known.push_back(node.path + "." + slot.name);
        throw RunError("the model has no " +
                       std::string(is_signal ? "signal '" : "parameter, state or input '") + its.path + "'" +
                       did_you_mean(its.path, known) +
                       (is_signal ? "" : "; variables are named by the parameters that they decide"));
    }
    const Slot& slot = d.slot(its.end);
    if (slot.type != Type::float64)
        throw RunError("'" + its.path + "' is of type " + bf::name(slot.type) +
                       "; derivatives are of doubles alone");
    const auto found = elements(d, its);
    if (found.empty())
        throw RunError("'" + its.path + "' has no element " + its.element + "; it has " +
                       std::to_string(slot.size.count()));
    for (const int e : found)
        places.push_back({its.end, e, its.path + (slot.size.count() == 1 ? "" : d.element_text(its.end, e))});
}

} // namespace

Gradient gradient(const Simulation& run, const GradientOptions& options) {
    const Diagram& d = run.diagram();
    if (!(options.duration >= 0) || !std::isfinite(options.duration))
        throw RunError("a run lasts at least 0 s, not " + std::to_string(options.duration));
    std::vector<Place> by, costs;
    const SignalFinder finder(d);
    for (const auto& name : options.by) append(d, finder, name, false, by);
    append(d, finder, options.cost, true, costs);
    if (costs.size() != 1)
        throw RunError("the cost '" + options.cost + "' has " + std::to_string(costs.size()) +
                       " elements; a cost is one number: name an element, as '" + options.cost + "[1]'");
    if (by.empty()) throw RunError("name parameters by which the cost is differentiated");

    const auto steps = static_cast<std::int64_t>(std::llround(options.duration / d.step));
    constexpr auto lanes = static_cast<std::size_t>(Dual::directions);
    DualRun dual(run);
    Gradient result{.names = {},
                    .at = Vector(static_cast<Eigen::Index>(by.size())),
                    .slopes = Vector(static_cast<Eigen::Index>(by.size()))};
    for (const auto& place : by) result.names.push_back(place.name);
    Dual::is_at_corner = false;
    for (std::size_t first = 0; first < by.size(); first += lanes) {
        const auto count = std::min(lanes, by.size() - first);
        const auto for_each = [&](bool states, auto&& f) {
            for (std::size_t i = 0; i < count; ++i)
                if (const auto& place = by[first + i]; is_state(d.slot(place.end).role) == states)
                    f(i, dual.elements(place.end)[place.element]);
        };
        for_each(false, [](std::size_t i, Dual& element) { element.slope[i] = 1; });
        dual.start();
        for_each(true, [](std::size_t i, Dual& element) { element.slope[i] = 1; });
        for (std::size_t i = 0; i < count; ++i)
            result.at[static_cast<Eigen::Index>(first + i)] =
                dual.elements(by[first + i].end)[by[first + i].element].value;
        Dual total = 0;
        const Dual* const cost = dual.elements(costs[0].end) + costs[0].element;
        for (std::int64_t k = 0; k < steps; ++k) {
            dual.outputs();
            total += d.step * *cost;
            dual.update();
        }
        if (options.over == GradientOptions::Over::end) {
            dual.outputs();
            total = *cost;
        }
        result.cost = total.value;
        for (std::size_t i = 0; i < count; ++i)
            result.slopes[static_cast<Eigen::Index>(first + i)] = total.slope[i];
        for_each(false, [](std::size_t, Dual& element) { element.slope = {}; });
    }
    result.has_corner = Dual::is_at_corner;
    if (!result.slopes.allFinite())
        throw RunError(
            "the gradient is not finite: a derivative on the way is infinite, as that of a root at "
            "0; begin elsewhere");
    return result;
}

Gradient gradient(const Diagram& diagram, const GradientOptions& options) {
    Simulation run(diagram);
    run.start();
    return gradient(run, options);
}

} // namespace bf::analysis
