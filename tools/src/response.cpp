// bf bode, nyquist, nichols, rootlocus, step: what a linear system of a model does.
#include "bf/analysis/response.hpp"

#include "bf/base/escape.hpp"
#include "figure.hpp"
#include "files.hpp"
#include "linearize.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

namespace bf::tools {

namespace {

using analysis::LinearSystem;
using recording::Curve;
using recording::Figure;

struct ResponseOptions {
    LinearOptions linear;
    std::string output;
    FigureSize size{900};
    double duration = 0; ///< s, of a step
};

std::string decibels(double ratio) { return number(20 * std::log10(ratio)) + " dB"; }

void line(const char* what, const std::string& value) { std::printf("  %-16s%s\n", what, value.c_str()); }

void print_margins(const analysis::Margins& m) {
    line("closed loop",
         m.is_stable ? "stable" : "unstable; the margins lead to a limit of stability, not away from it");
    line("gain margin", std::isinf(m.gain) ? "none"
                        : std::isinf(m.phase_crossover)
                            ? decibels(m.gain) + " at infinite frequency"
                            : decibels(m.gain) + " at " + number(m.phase_crossover) + " rad/s");
    if (m.gain_reduction > 0) line("", "and down to " + decibels(m.gain_reduction));
    line("phase margin", std::isinf(m.phase)
                             ? "none"
                             : number(m.phase) + " degrees at " + number(m.gain_crossover) + " rad/s");
    line("delay margin", std::isinf(m.delay) ? "none" : number(m.delay) + " s");
    line("modulus margin", number(m.modulus));
    line("bandwidth", std::isinf(m.bandwidth) ? "none" : number(m.bandwidth) + " rad/s");
}

Curve curve(std::string name, std::vector<double> x, std::vector<double> y, bool reference = false,
            Curve::Mark mark = Curve::Mark::none) {
    return {std::move(name), std::move(x), std::move(y), reference, false, mark};
}

std::string title(const ResponseOptions& options, const LinearSystem& s) {
    return options.linear.loop.empty() ? "From " + s.inputs.front() + " to " + s.outputs.front()
                                       : "Loop through " + options.linear.loop;
}

bool is_loop(const ResponseOptions& options) { return !options.linear.loop.empty(); }

/// The response over all that its margins tell of.
analysis::Response seen(const ResponseOptions& options, const LinearSystem& s, int count) {
    return analysis::response(s, 0, 0, analysis::frequencies(s, 0, 0, count, is_loop(options)));
}

/// Odd multiples of 180 degrees that a phase passes, or the one that is nearest to it: there L is negative
/// real.
std::vector<double> reversals(const std::vector<double>& phase) {
    double low = INFINITY, high = -INFINITY;
    for (const double p : phase)
        if (std::isfinite(p)) {
            low = std::min(low, p);
            high = std::max(high, p);
        }
    std::vector<double> all;
    if (!(low <= high)) return {-180};
    for (double k = std::ceil((low - 181) / 360); 360 * k + 180 <= high + 1; ++k)
        all.push_back(360 * k + 180);
    if (all.empty()) all.push_back(360 * std::round((low + high - 360) / 720) + 180);
    return all;
}

Figure bode(const ResponseOptions& options, const LinearSystem& s) {
    analysis::Margins m;
    if (is_loop(options)) {
        m = analysis::margins(s);
        print_margins(m);
    } else {
        line("gain at 0", number(analysis::frequency_response(s, 0, 0, 0).real()));
    }
    if (options.output.empty()) return {};
    const auto r = seen(options, s, 600);
    Figure figure{title(options, s),
                  {{"Magnitude", "dB", {curve("magnitude", r.omega, r.magnitude)}},
                   {"Phase", "degrees", {curve("phase", r.omega, r.phase)}}},
                  "frequency (rad/s)",
                  true};
    if (!is_loop(options)) return figure;
    const auto level_line = [&](std::size_t panel, const std::string& name, double level) {
        figure.panels[panel].curves.push_back(
            curve(name, {r.omega.front(), r.omega.back()}, {level, level}, true));
    };
    level_line(0, "0 dB", 0);
    for (const double level : reversals(r.phase)) level_line(1, number(level) + " degrees", level);
    const auto mark_gain = [&](const std::string& name, double w, double factor) {
        if (factor > 0 && w >= r.omega.front() && w <= r.omega.back())
            figure.panels[0].curves.push_back(
                curve(name, {w}, {-20 * std::log10(factor)}, false, Curve::Mark::circle));
    };
    mark_gain("gain margin " + decibels(m.gain), m.phase_crossover, m.gain);
    mark_gain("and down to " + decibels(m.gain_reduction), m.reduction_crossover, m.gain_reduction);
    if (std::isfinite(m.phase)) {
        // As far as its phase is unwrapped there.
        std::vector<double> until(r.omega.begin(),
                                  std::lower_bound(r.omega.begin(), r.omega.end(), m.gain_crossover));
        until.push_back(m.gain_crossover);
        const double at = analysis::response(s, 0, 0, until).phase.back();
        figure.panels[1].curves.push_back(curve("phase margin " + number(m.phase) + " degrees",
                                                {m.gain_crossover}, {at}, false, Curve::Mark::circle));
    }
    return figure;
}

/// Of radius 1 around 0.
Curve unit_circle(const char* name) {
    Curve circle = curve(name, {}, {}, true);
    for (int i = 0; i <= 200; ++i) {
        circle.time.push_back(std::cos(2 * std::numbers::pi * i / 200));
        circle.value.push_back(std::sin(2 * std::numbers::pi * i / 200));
    }
    return circle;
}

Figure nyquist(const ResponseOptions& options, const LinearSystem& s) {
    const auto m = analysis::margins(s);
    print_margins(m);
    if (options.output.empty()) return {};
    // Integrators lead to infinity, which no picture shows: it ends beyond the farthest place that a margin
    // tells of.
    const double farthest = m.gain_reduction > 0 ? std::clamp(1.5 / m.gain_reduction, 4.0, 1e3) : 4;
    const auto r = seen(options, s, 2000);
    std::vector<double> x, y, mirrored;
    bool is_cut = false;
    for (const auto& value : r.value) {
        const bool is_far = std::abs(value) > farthest;
        is_cut = is_cut || is_far;
        x.push_back(is_far ? NAN : value.real());
        y.push_back(is_far ? NAN : value.imag());
        mirrored.push_back(-y.back());
    }
    Figure figure{title(options, s),
                  {{is_cut ? "Nyquist, up to |L| = " + number(farthest) : "Nyquist",
                    "imaginary part",
                    {curve("positive frequencies", x, y), curve("negative frequencies", x, mirrored),
                     unit_circle("unit circle"), curve("-1", {-1}, {0}, false, Curve::Mark::cross)}}},
                  "real part",
                  false,
                  true};
    const auto mark = [&](const std::string& name, double real, double imaginary) {
        figure.panels[0].curves.push_back(curve(name, {real}, {imaginary}, false, Curve::Mark::circle));
    };
    if (std::isfinite(m.gain)) mark("gain margin " + decibels(m.gain), -1 / m.gain, 0);
    if (1 / m.gain_reduction <= farthest)
        mark("and down to " + decibels(m.gain_reduction), -1 / m.gain_reduction, 0);
    if (std::isfinite(m.phase)) {
        const auto at = analysis::frequency_response(s, 0, 0, m.gain_crossover);
        mark("phase margin " + number(m.phase) + " degrees", at.real(), at.imag());
    }
    return figure;
}

Figure nichols(const ResponseOptions& options, const LinearSystem& s) {
    print_margins(analysis::margins(s));
    if (options.output.empty()) return {};
    auto r = seen(options, s, 2000);
    for (std::size_t i = 0; i < r.omega.size(); ++i)
        if (std::abs(r.magnitude[i]) > 60) r.magnitude[i] = r.phase[i] = NAN;
    const auto at = reversals(r.phase);
    // Without states L is one point.
    const auto mark = s.A.rows() == 0 ? Curve::Mark::circle : Curve::Mark::none;
    return {title(options, s),
            {{"Nichols",
              "dB",
              {curve("L", r.phase, r.magnitude, false, mark),
               curve("-1", at, std::vector<double>(at.size(), 0), false, Curve::Mark::cross)}}},
            "phase (degrees)"};
}

Figure root_locus(const ResponseOptions& options, const LinearSystem& s) {
    std::printf("poles of the closed loop\n");
    const auto closed_poles = analysis::poles(analysis::closed(s));
    for (const auto& root : closed_poles) std::printf("  %s\n", root_text(root).c_str());
    if (options.output.empty()) return {};
    const auto locus = analysis::root_locus(s);
    const auto zeros = analysis::zeros(s, 0, 0);
    double size = 1e-3;
    for (const auto& roots : {locus.roots.front(), zeros, closed_poles})
        for (const auto& root : roots) size = std::max(size, std::abs(root));
    Figure figure{title(options, s),
                  {{"Root locus, k from 0 to 1000", "imaginary part", {}}},
                  "real part",
                  false,
                  true};
    auto& curves = figure.panels.front().curves;
    for (std::size_t b = 0; b < locus.roots.front().size(); ++b) {
        Curve branch = curve("branch " + std::to_string(b + 1), {}, {});
        for (const auto& roots : locus.roots) {
            const bool is_far = std::abs(roots[b]) > 2 * size;
            branch.time.push_back(is_far ? NAN : roots[b].real());
            branch.value.push_back(is_far ? NAN : roots[b].imag());
        }
        curves.push_back(std::move(branch));
    }
    const auto marks = [&](const char* name, const std::vector<analysis::Complex>& roots, Curve::Mark mark) {
        Curve all = curve(name, {}, {}, false, mark);
        for (const auto& root : roots) {
            all.time.push_back(root.real());
            all.value.push_back(root.imag());
        }
        if (!roots.empty()) curves.push_back(std::move(all));
    };
    if (s.period > 0) curves.push_back(unit_circle("limit of stability"));
    marks("open-loop poles", locus.roots.front(), Curve::Mark::cross);
    marks("zeros", zeros, Curve::Mark::circle);
    return figure;
}

Figure step(const ResponseOptions& options, const LinearSystem& s) {
    const auto r = analysis::step_response(s, 0, 0, options.duration);
    if (std::isnan(r.final)) {
        line("final value", "none: the system is unstable");
    } else {
        line("final value", number(r.final));
        const auto known = [&](const char* what, double value, const char* unit) {
            line(what, std::isnan(value) ? "none" : number(value) + unit);
        };
        known("overshoot", r.overshoot, " %"); // of a final value that is not 0
        known("rise time", r.rise_time, " s");
        known("settling time", r.settling_time, " s");
        line("peak", number(r.peak) + " at " + number(r.peak_time) + " s");
        if (r.undershoot > 1e-6) // else it is rounding
            line("undershoot", number(r.undershoot) + " % at " + number(r.undershoot_time) + " s");
    }
    Figure figure{
        title(options, s),
        {{"Response to a step of 1", s.output_units.front(), {curve("response", r.time, r.value)}}}};
    figure.panels.front().curves.front().steps = s.period > 0;
    if (!std::isnan(r.final))
        figure.panels.front().curves.push_back(
            curve("final value", {r.time.front(), r.time.back()}, {r.final, r.final}, true));
    return figure;
}

using Draw = Figure (*)(const ResponseOptions&, const LinearSystem&);

void add(CLI::App& app, const char* verb, const char* what, const char* example, bool has_loop, Draw draw) {
    auto* command = app.add_subcommand(verb, what);
    auto options = std::make_shared<ResponseOptions>();
    options->linear.add_to(*command, has_loop);
    command
        ->add_option("-o,--output", options->output,
                     "PNG or SVG file of the picture; otherwise there is none")
        ->type_name("FILE");
    options->size.add_to(*command);
    if (draw == step)
        command->add_option("--duration", options->duration, "seconds; 0: until it has settled")
            ->check(between(0, 1e9))
            ->type_name("SECONDS")
            ->capture_default_str();
    command->footer(std::string("Example: bf ") + verb + " " + example);
    command->callback([options, draw] {
        if (!options->output.empty())
            refuse_overwriting({{"-o", options->output}}, files_of(options->linear.model.file));
        const auto figure = draw(*options, options->linear.single());
        if (options->output.empty()) return;
        const bool is_square = figure.is_equal && options->size.height == 0;
        write_figure(figure, options->output, options->size.width,
                     is_square ? options->size.width * 7 / 10 : options->size.height);
    });
}

} // namespace

void add_responses(CLI::App& app) {
    const char* loop = "docs/start/motor.yaml --loop controller.voltage -o loop.png";
    add(app, "bode", "frequency response of a linearised model, with the margins of a loop", loop, true,
        bode);
    add(app, "nyquist", "Nyquist curve of a loop, with its margins", loop, true, nyquist);
    add(app, "nichols", "Nichols curve of a loop, with its margins", loop, true, nichols);
    add(app, "rootlocus", "poles of a closed loop over its gain", loop, true, root_locus);
    add(app, "step", "response of a linearised model to a step",
        "docs/start/motor.yaml --from reference --to motor.omega", false, step);
}

} // namespace bf::tools
