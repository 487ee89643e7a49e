#include "bf/analysis/gradient.hpp"

#include "bf/base/names.hpp"
#include "dual_run.hpp"
#include "linearised_run.hpp"
#include "named.hpp"

#include <algorithm>
#include <cmath>

namespace bf::analysis {

namespace {

/// Appends what a name stands for: one element, or all.
void append(const Diagram& d, const SignalFinder& finder, const std::string& name, bool is_signal,
            std::vector<Element>& places) {
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
        places.push_back(
            {its.end, e, its.path + (slot.size.count() == 1 ? "" : d.element_text(its.end, e)), ""});
}

void go_forwards(const Diagram& d, DualRun& dual, const std::vector<Element>& by, const Element& cost_at,
                 const Horizon& horizon, Gradient& result) {
    constexpr auto lanes = static_cast<std::size_t>(Dual::directions);
    for (std::size_t first = 0; first < by.size(); first += lanes) {
        const auto count = std::min(lanes, by.size() - first);
        const auto for_each = [&](bool states, auto&& f) {
            for (std::size_t i = 0; i < count; ++i)
                if (const auto& place = by[first + i]; is_state(d.slot(place.end).role) == states)
                    f(i, dual.elements(place.end)[place.number]);
        };
        for_each(false, [](std::size_t i, Dual& element) { element.slope[i] = 1; });
        dual.start();
        for_each(true, [](std::size_t i, Dual& element) { element.slope[i] = 1; });
        for (std::size_t i = 0; i < count; ++i)
            result.at[static_cast<Eigen::Index>(first + i)] =
                dual.elements(by[first + i].end)[by[first + i].number].value;
        Dual total = 0;
        const Dual* const cost = dual.elements(cost_at.end) + cost_at.number;
        for (std::int64_t k = 0; k < horizon.steps; ++k) {
            horizon.begin_step(k);
            dual.outputs();
            total += horizon.step * *cost;
            dual.update();
        }
        if (horizon.counts_end) {
            dual.outputs();
            total = *cost;
        }
        result.cost = total.value;
        for (std::size_t i = 0; i < count; ++i)
            result.slopes[static_cast<Eigen::Index>(first + i)] = total.slope[i];
        for_each(false, [](std::size_t, Dual& element) { element.slope = {}; });
    }
}

void go_backwards(const Diagram& d, DualRun& dual, const std::vector<Element>& by, const Element& cost_at,
                  const Horizon& horizon, Gradient& result) {
    dual.remember(true);
    dual.start();
    const auto started = dual.remembered();
    for (std::size_t i = 0; i < by.size(); ++i)
        result.at[static_cast<Eigen::Index>(i)] = dual.elements(by[i].end)[by[i].number].value;
    dual.remember(false);

    const auto length =
        std::max<std::int64_t>(1, std::llround(std::ceil(std::sqrt(static_cast<double>(horizon.steps)))));
    const Dual& cost = dual.elements(cost_at.end)[cost_at.number];
    std::vector<DualRun::Checkpoint> checkpoints{dual.checkpoint()};
    for (std::int64_t k = 0; k < horizon.steps; ++k) {
        horizon.begin_step(k);
        if (k > 0 && k % length == 0) checkpoints.push_back(dual.checkpoint());
        dual.outputs();
        result.cost += horizon.step * cost.value;
        dual.update();
    }
    double& adjoint = dual.adjoints(cost_at.end)[cost_at.number];
    dual.remember(true);
    if (horizon.counts_end) {
        dual.outputs();
        result.cost = cost.value;
        adjoint = 1;
        dual.go_back(started);
    }
    for (auto begin = static_cast<std::int64_t>(checkpoints.size() - 1) * length; begin >= 0;
         begin -= length) {
        dual.restore(checkpoints.back());
        checkpoints.pop_back();
        std::vector<std::pair<std::size_t, std::size_t>> steps; // where their outputs and updates begin
        for (auto k = begin; k < std::min(begin + length, horizon.steps); ++k) {
            horizon.begin_step(k);
            const auto outputs = dual.remembered();
            dual.outputs();
            steps.emplace_back(outputs, dual.remembered());
            dual.update();
        }
        for (; !steps.empty(); steps.pop_back()) {
            dual.go_back(steps.back().second);
            if (!horizon.counts_end) adjoint += horizon.step;
            dual.go_back(steps.back().first);
        }
    }
    const auto take = [&](bool states) {
        for (std::size_t i = 0; i < by.size(); ++i)
            if (is_state(d.slot(by[i].end).role) == states)
                result.slopes[static_cast<Eigen::Index>(i)] = dual.adjoints(by[i].end)[by[i].number];
    };
    take(true);
    dual.go_back(0);
    take(false);
}

/// By what goes through kernels in a first step: the adjoint makes each step twice, and goes back once.
bool is_cheaper_backwards(DualRun& dual, std::size_t parameters) {
    constexpr auto lanes = static_cast<std::size_t>(Dual::directions);
    const auto passes = static_cast<double>((parameters + lanes - 1) / lanes);
    if (passes <= 3) return false; // as it takes at least three
    dual.start();
    dual.remember(true);
    const auto before = dual.checkpoint();
    dual.outputs();
    dual.update();
    const auto [forwards, backwards] = dual.work(0);
    dual.go_back(0); // of no cost: nothing moves, so that nothing but the memory goes back
    dual.restore(before);
    dual.remember(false);
    return 2 * forwards + backwards < passes * forwards;
}

void go_through_rules(const Simulation& run, const std::vector<Element>& by, const Element& cost,
                      const Horizon& horizon, GradientOptions::Way way, Gradient& result) {
    using Way = GradientOptions::Way;
    const Diagram& d = run.diagram();
    DualRun dual(run);
    for (const auto& place : by)
        if (!is_state(d.slot(place.end).role)) dual.follow(place.end);
    Dual::is_at_corner = false;
    result.is_adjoint = way == Way::adjoint || (way == Way::cheaper && is_cheaper_backwards(dual, by.size()));
    if (result.is_adjoint)
        go_backwards(d, dual, by, cost, horizon, result);
    else
        go_forwards(d, dual, by, cost, horizon, result);
    result.has_corner = Dual::is_at_corner;
}

} // namespace

std::optional<GradientOptions::Way> way_named(std::string_view name) {
    using Way = GradientOptions::Way;
    if (name == "cheaper") return Way::cheaper;
    if (name == "forward") return Way::forward;
    if (name == "adjoint") return Way::adjoint;
    return std::nullopt;
}

Gradient gradient(const Simulation& run, const GradientOptions& options) {
    const Diagram& d = run.diagram();
    if (!(options.duration >= 0) || !std::isfinite(options.duration))
        throw RunError("a run lasts at least 0 s, not " + std::to_string(options.duration));
    std::vector<Element> by, costs;
    const SignalFinder finder(d);
    for (const auto& name : options.by) append(d, finder, name, false, by);
    append(d, finder, options.cost, true, costs);
    if (costs.size() != 1)
        throw RunError("the cost '" + options.cost + "' has " + std::to_string(costs.size()) +
                       " elements; a cost is one number: name an element, as '" + options.cost + "[1]'");
    if (by.empty()) throw RunError("name parameters by which the cost is differentiated");

    Gradient result{.names = {},
                    .at = Vector(static_cast<Eigen::Index>(by.size())),
                    .slopes = Vector(static_cast<Eigen::Index>(by.size())),
                    .differenced = {}};
    for (const auto& place : by) result.names.push_back(place.name);
    const Horizon horizon{static_cast<std::int64_t>(std::llround(options.duration / d.step)), d.step,
                          options.over == GradientOptions::Over::end, options.go_on};
    try {
        go_through_rules(run, by, costs[0], horizon, options.way, result);
    } catch (const NoRule&) {
        if (options.by_rules_alone || options.way == GradientOptions::Way::adjoint) throw;
        go_along(run, by, costs[0], horizon, result);
    }
    if (!result.slopes.allFinite())
        throw RunError("the gradient is not finite: a derivative on the way is infinite, as that of a root "
                       "at 0; begin elsewhere");
    return result;
}

Gradient gradient(const Diagram& diagram, const GradientOptions& options) {
    Simulation run(diagram);
    run.start();
    return gradient(run, options);
}

} // namespace bf::analysis
