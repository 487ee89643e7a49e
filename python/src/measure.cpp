// What is found out about a run in Python by running it on from where it is.
#include "interruptible.hpp"
#include "simulation.hpp"

#include "bf/analysis/measured_response.hpp"
#include "bf/analysis/sensitivity.hpp"
#include "bf/analysis/tune_loop.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/complex.h>
#include <nanobind/stl/tuple.h>

namespace bf::python {

namespace {

using analysis::MeasuredResponse;
using analysis::Sensitivities;
using analysis::TunedLoop;

/// Of a run that nobody observes.
template <class F> auto explored(PythonRun& self, F&& f) {
    const InUse use(self);
    self.require_started();
    if (!self.observers.empty() || !self.recorders.empty())
        raise("RunError", "the run is recorded or observed, and would show what is only tried; end that "
                          "first, or use another run");
    auto found = interruptible(f, [&] { return self.pending.is_there(); });
    self.pending.raise();
    return std::move(*found);
}

} // namespace

void bind_measure(nb::module_& m) {
    nb::class_<MeasuredResponse>(m, "_MeasuredResponse")
        .def_ro("input", &MeasuredResponse::input)
        .def_ro("output", &MeasuredResponse::output)
        .def_ro("input_unit", &MeasuredResponse::input_unit)
        .def_ro("output_unit", &MeasuredResponse::output_unit)
        .def_ro("amplitude", &MeasuredResponse::amplitude)
        .def_ro("time", &MeasuredResponse::time)
        .def_prop_ro("omega", [](const MeasuredResponse& r) { return r.response.omega; })
        .def_prop_ro("value", [](const MeasuredResponse& r) { return r.response.value; })
        .def_prop_ro("magnitude", [](const MeasuredResponse& r) { return r.response.magnitude; })
        .def_prop_ro("phase", [](const MeasuredResponse& r) { return r.response.phase; })
        .def_ro("coherence", &MeasuredResponse::coherence)
        .def_ro("distortion", &MeasuredResponse::distortion)
        .def_ro("unsettled", &MeasuredResponse::unsettled);
    m.def(
        "_measure_response",
        [](PythonRun& run, const std::string& from, const std::string& to, const std::string& loop,
           const std::vector<double>& omega, double amplitude, bool is_chirp, double tolerance,
           int most_periods) {
            analysis::MeasureOptions options{.from = from,
                                             .to = to,
                                             .loop = loop,
                                             .omega = omega,
                                             .amplitude = amplitude,
                                             .tolerance = tolerance,
                                             .most_periods = most_periods};
            if (is_chirp) options.excitation = analysis::MeasureOptions::Excitation::chirp;
            return explored(run, [&](std::function<bool()> go_on) {
                options.go_on = std::move(go_on);
                return analysis::measure_response(run.run, options);
            });
        },
        nb::arg("run"), nb::arg("from_"), nb::arg("to"), nb::arg("loop"), nb::arg("omega"),
        nb::arg("amplitude"), nb::arg("is_chirp"), nb::arg("tolerance"), nb::arg("most_periods"));

    nb::class_<TunedLoop>(m, "_TunedLoop")
        .def_prop_ro("gains",
                     [](const TunedLoop& t) {
                         std::vector<std::tuple<std::string, double, double>> all;
                         for (const auto& gain : t.gains)
                             all.emplace_back(gain.name, gain.before, gain.after);
                         return all;
                     })
        .def_prop_ro("loop_before", [](const TunedLoop& t) { return t.before.loop; })
        .def_prop_ro("loop", [](const TunedLoop& t) { return t.after.loop; })
        .def_prop_ro("margins_before", [](const TunedLoop& t) { return t.before.margins; })
        .def_prop_ro("margins", [](const TunedLoop& t) { return t.after.margins; })
        .def_prop_ro("step_before", [](const TunedLoop& t) { return t.before.step; })
        .def_prop_ro("step", [](const TunedLoop& t) { return t.after.step; });
    m.def(
        "_tune_loop",
        [](PythonRun& run, const std::string& loop, const std::vector<std::string>& by, double crossover,
           double bandwidth, std::optional<double> phase_margin, std::optional<double> overshoot,
           double gain_margin, const std::vector<std::string>& open) {
            return explored(run, [&](std::function<bool()> go_on) {
                return analysis::tune_loop(run.run, {.loop = loop,
                                                     .by = by,
                                                     .crossover = crossover,
                                                     .bandwidth = bandwidth,
                                                     .phase_margin = phase_margin,
                                                     .overshoot = overshoot,
                                                     .gain_margin = gain_margin,
                                                     .open = open,
                                                     .go_on = std::move(go_on)});
            });
        },
        nb::arg("run"), nb::arg("loop"), nb::arg("by"), nb::arg("crossover"), nb::arg("bandwidth"),
        nb::arg("phase_margin").none(), nb::arg("overshoot").none(), nb::arg("gain_margin"), nb::arg("open"));
    m.def(
        "_simulated_step",
        [](PythonRun& run, const std::string& loop, double duration, double height,
           const std::vector<std::string>& open) {
            return explored(run, [&](std::function<bool()> go_on) {
                const auto found = analysis::simulated_step(run.run, loop, duration, height, open, go_on);
                return std::pair(found.time, found.value);
            });
        },
        nb::arg("run"), nb::arg("loop"), nb::arg("duration"), nb::arg("height"), nb::arg("open"));

    using Check = Sensitivities::Check;
    nb::class_<Check>(m, "CheckSensitivity", "How near a check is to its limits, and what takes it there.")
        .def_ro("name", &Check::name, "Of the block.")
        .def_ro("value", &Check::value, "That it reports at the end of the run.")
        .def_ro("at_least", &Check::lower, "Its lower limit; -inf: none.")
        .def_ro("at_most", &Check::upper, "Its upper limit; inf: none.")
        .def_ro("passed", &Check::has_passed, "Is the value within its limits?")
        .def_ro("distance", &Check::distance, "To the nearer limit, negative beyond it; inf: there is none.")
        .def_prop_ro(
            "slopes", [](const Check& c) { return c.slopes; }, "Of the value by each number.")
        .def_prop_ro(
            "distance_slopes", [](const Check& c) { return c.distance_slopes; },
            "Of the distance by each number; 0 without a limit.")
        .def_prop_ro(
            "changes_to_limit",
            [](const Check& c) {
                analysis::Vector all(c.slopes.size());
                for (Eigen::Index i = 0; i < all.size(); ++i) all[i] = c.change_to_limit(i);
                return all;
            },
            "Of each number, the change that takes the distance to 0 if it goes on as it begins; inf: none "
            "does.")
        .def_ro("differenced", &Check::differenced,
                "Why slopes are differences of runs; empty: they are exact.")
        .def_ro("has_corner", &Check::has_corner,
                "A jump or corner was met on the way: slopes are those of one side.");
    nb::class_<Sensitivities>(m, "_Sensitivities")
        .def_ro("names", &Sensitivities::names)
        .def_prop_ro("at", [](const Sensitivities& s) { return s.at; })
        .def_ro("checks", &Sensitivities::checks);
    m.def(
        "_sensitivities",
        [](const PythonModel& model, const std::vector<std::string>& by,
           const std::vector<std::string>& checks, double duration, double difference) {
            if (!model.examined.diagnostics.empty()) throw model::Errors(model.examined.diagnostics);
            auto found = interruptible(
                [&](std::function<bool()> go_on) {
                    return analysis::sensitivities(model.examined.diagram, {.by = by,
                                                                            .checks = checks,
                                                                            .duration = duration,
                                                                            .step = difference,
                                                                            .go_on = std::move(go_on)});
                },
                [] { return false; });
            return std::move(*found);
        },
        nb::arg("model"), nb::arg("by"), nb::arg("checks"), nb::arg("duration"), nb::arg("difference"));
}

} // namespace bf::python
