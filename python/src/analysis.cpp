// Linear systems in Python.
#include "simulation.hpp"

#include "bf/analysis/gradient.hpp"
#include "bf/analysis/linearize.hpp"
#include "bf/analysis/response.hpp"
#include "bf/base/numbers.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/complex.h>
#include <nanobind/stl/tuple.h>

namespace bf::python {

namespace {

using analysis::Gradient;
using analysis::LinearSystem;
using analysis::Margins;
using analysis::StepResponse;

void check(const LinearSystem& system, int output, int input) {
    if (output < 0 || output >= system.C.rows() || input < 0 || input >= system.B.cols())
        raise("WrongValue", "the system has " + std::to_string(system.C.rows()) + " outputs and " +
                                std::to_string(system.B.cols()) + " inputs, counted from 0");
}

void bind_results(nb::module_& m) {
    nb::class_<Margins>(m, "Margins",
                        "Of a loop that is closed by negative feedback, 1 + L = 0; inf: there is none.")
        .def_ro("gain", &Margins::gain, "By which L may be multiplied until the loop is unstable, > 1.")
        .def_ro("gain_reduction", &Margins::gain_reduction,
                "The greatest factor < 1 that makes it unstable; 0: none does.")
        .def_ro("phase", &Margins::phase,
                "That L may lose, or must gain where it is negative [degrees]; the least of all crossovers.")
        .def_ro("delay", &Margins::delay, "That L may get [s].")
        .def_ro("modulus", &Margins::modulus, "Least distance of L from -1.")
        .def_ro("phase_crossover", &Margins::phase_crossover,
                "Where L is negative real, of `gain` [rad/s]; may be 0 or infinite.")
        .def_ro("reduction_crossover", &Margins::reduction_crossover, "The same of `gain_reduction` [rad/s].")
        .def_ro("gain_crossover", &Margins::gain_crossover, "Where |L| = 1, of `phase` [rad/s].")
        .def_ro("bandwidth", &Margins::bandwidth,
                "Of L/(1 + L): where it first is 3 dB below its value at 0 [rad/s].")
        .def_ro("is_stable", &Margins::is_stable, "Is the closed loop?")
        .def("__repr__", [](const Margins& m) {
            char text[200];
            std::snprintf(text, sizeof text,
                          "<Margins: gain %.4g at %.4g rad/s, phase %.4g degrees at %.4g rad/s, delay %.4g "
                          "s, closed loop %s>",
                          m.gain, m.phase_crossover, m.phase, m.gain_crossover, m.delay,
                          m.is_stable ? "stable" : "unstable");
            return std::string(text);
        });
    nb::class_<StepResponse>(m, "StepResponse", "Of a step of 1 at 0 s, from rest.")
        .def_ro("_time", &StepResponse::time)
        .def_ro("_value", &StepResponse::value)
        .def_ro("final", &StepResponse::final, "Value that it comes to; nan of an unstable system.")
        .def_ro("overshoot", &StepResponse::overshoot, "% of `final`; nan where that is 0.")
        .def_ro("peak", &StepResponse::peak, "The extreme on the side of `final`.")
        .def_ro("peak_time", &StepResponse::peak_time, "[s]")
        .def_ro("undershoot", &StepResponse::undershoot,
                "How far it goes to the other side of 0 [% of `final`].")
        .def_ro("undershoot_time", &StepResponse::undershoot_time, "[s]")
        .def_ro("rise_time", &StepResponse::rise_time, "From 10 % to 90 % of `final` [s].")
        .def_ro(
            "settling_time", &StepResponse::settling_time,
            "After which it stays within 2 % of `final`, or of its largest value where that is 0 [s]; nan: "
            "not within its time.");
    nb::class_<Gradient>(m, "Gradient",
                         "How what a run costs changes with parameters, initial states and inputs.")
        .def_ro("cost", &Gradient::cost, "Of the run.")
        .def_ro("names", &Gradient::names, "One per element: 'controller.lqr.K[1][2]'.")
        .def_prop_ro(
            "at", [](const Gradient& g) { return g.at; }, "Their values.")
        .def_prop_ro(
            "slopes", [](const Gradient& g) { return g.slopes; }, "Derivatives of the cost by each.")
        .def_ro("has_corner", &Gradient::has_corner,
                "A comparison met its limit on the way: the gradient is that of one side.")
        .def_ro("is_adjoint", &Gradient::is_adjoint,
                "It was found back from the cost to all parameters at once, else forward.")
        .def_ro("differenced", &Gradient::differenced,
                "Paths of blocks that went in by central differences of single calls; none: it is exact.")
        .def("__repr__", [](const Gradient& g) {
            std::string text = "<Gradient: cost " + number_text(g.cost);
            for (std::size_t i = 0; i < std::min<std::size_t>(g.names.size(), 4); ++i)
                text += ", by " + g.names[i] + " " + number_text(g.slopes[static_cast<Eigen::Index>(i)]);
            return text + (g.names.size() > 4 ? ", ...>" : ">");
        });
}

} // namespace

void bind_analysis(nb::module_& m) {
    bind_results(m);
    nb::class_<analysis::LinearizeOptions>(m, "_LinearizeOptions")
        .def(
            "__init__",
            [](analysis::LinearizeOptions* self, std::vector<std::string> from, std::vector<std::string> to,
               std::vector<std::string> open, bool all_states, bool by_differences) {
                new (self) analysis::LinearizeOptions{.from = std::move(from),
                                                      .to = std::move(to),
                                                      .open = std::move(open),
                                                      .all_states = all_states,
                                                      .by_differences = by_differences};
            },
            nb::arg("from_"), nb::arg("to"), nb::arg("open"), nb::arg("all_states"),
            nb::arg("by_differences"));
    nb::class_<LinearSystem>(m, "LinearSystem")
        .def_prop_ro("A", [](const LinearSystem& s) { return s.A; })
        .def_prop_ro("B", [](const LinearSystem& s) { return s.B; })
        .def_prop_ro("C", [](const LinearSystem& s) { return s.C; })
        .def_prop_ro("D", [](const LinearSystem& s) { return s.D; })
        .def_prop_ro("x", [](const LinearSystem& s) { return s.x; })
        .def_prop_ro("u", [](const LinearSystem& s) { return s.u; })
        .def_prop_ro("y", [](const LinearSystem& s) { return s.y; })
        .def_ro("states", &LinearSystem::states)
        .def_ro("inputs", &LinearSystem::inputs)
        .def_ro("outputs", &LinearSystem::outputs)
        .def_ro("input_units", &LinearSystem::input_units)
        .def_ro("output_units", &LinearSystem::output_units)
        .def_ro("period", &LinearSystem::period)
        .def_ro("time", &LinearSystem::time)
        .def_ro("differenced", &LinearSystem::differenced)
        .def_ro("held", &LinearSystem::held)
        .def_ro("kinks", &LinearSystem::kinks)
        .def("_poles", [](const LinearSystem& s) { return analysis::poles(s); })
        .def(
            "_zeros",
            [](const LinearSystem& s, int output, int input) {
                check(s, output, input);
                return analysis::zeros(s, output, input);
            },
            nb::arg("output"), nb::arg("input"))
        .def(
            "_frequencies",
            [](const LinearSystem& s, int output, int input, int count, bool of_loop) {
                check(s, output, input);
                return analysis::frequencies(s, output, input, count, of_loop);
            },
            nb::arg("output"), nb::arg("input"), nb::arg("count"), nb::arg("of_loop"))
        .def(
            "_response",
            [](const LinearSystem& s, int output, int input, const std::vector<double>& omega) {
                check(s, output, input);
                auto r = analysis::response(s, output, input, omega);
                return std::tuple(r.value, r.magnitude, r.phase);
            },
            nb::arg("output"), nb::arg("input"), nb::arg("omega"))
        .def(
            "_margins",
            [](const LinearSystem& s, int output, int input) {
                check(s, output, input);
                return analysis::margins(s, output, input);
            },
            nb::arg("output"), nb::arg("input"))
        .def(
            "_step_response",
            [](const LinearSystem& s, int output, int input, double duration) {
                check(s, output, input);
                return analysis::step_response(s, output, input, duration);
            },
            nb::arg("output"), nb::arg("input"), nb::arg("duration"))
        .def(
            "_root_locus",
            [](const LinearSystem& s, int output, int input, const std::vector<double>& gains) {
                check(s, output, input);
                auto locus = analysis::root_locus(s, output, input, gains);
                return std::pair(locus.gains, locus.roots);
            },
            nb::arg("output"), nb::arg("input"), nb::arg("gains"))
        .def("_negative", [](const LinearSystem& s) { return analysis::negative(s); });
    m.def(
        "_linearize",
        [](const PythonModel& model, const analysis::LinearizeOptions& options, double time) {
            if (!model.examined.diagnostics.empty()) throw model::Errors(model.examined.diagnostics);
            const WithoutGil parallel;
            return analysis::linearize(model.examined.diagram, options, time);
        },
        nb::arg("model"), nb::arg("options"), nb::arg("time"));
}

} // namespace bf::python
