// bf frequency-response: the frequency response of a model, measured in simulation.
#include "bf/analysis/measured_response.hpp"

#include "bf/analysis/loop_gain.hpp"
#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"
#include "figure.hpp"
#include "files.hpp"
#include "linearize.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

namespace bf::tools {

namespace {

using analysis::MeasuredResponse;
using recording::Curve;
using recording::Figure;

struct Arguments {
    LinearOptions at; ///< model and operating point
    analysis::MeasureOptions measure;
    std::string range;
    int points = 20;
    bool is_chirp = false;
    std::vector<std::string> outputs;
    FigureSize size{900};
};

/// "1:100", evenly on a logarithmic axis, or "3".
std::vector<double> frequencies_of(const Arguments& arguments) {
    const auto colon = arguments.range.find(':');
    const auto low = number_of(arguments.range.substr(0, colon)),
               high = colon == std::string::npos ? low : number_of(arguments.range.substr(colon + 1));
    if (!low || !high || !(*low > 0) || !(*high >= *low) || !std::isfinite(*high))
        throw CommandError("--frequencies " + arguments.range +
                           " is neither LOW:HIGH nor one number, in rad/s and above 0");
    return analysis::logarithmic(*low, *high, *high > *low ? arguments.points : 1);
}

void print(const MeasuredResponse& found, double tolerance) {
    const auto& r = found.response;
    std::printf("from %s to %s at %s s, amplitude %s\n", escape::terminal(found.input).c_str(),
                escape::terminal(found.output).c_str(), number(found.time).c_str(),
                number(found.amplitude).c_str());
    std::printf("%12s  %10s  %10s  %10s  %12s\n", "rad/s", "dB", "degrees", "coherence", "distortion %");
    for (std::size_t i = 0; i < r.omega.size(); ++i) {
        const auto& distortion = found.distortion[i];
        std::printf("%12s  %10.3f  %10.2f  %10.6f  %12s%s\n", number(r.omega[i]).c_str(), r.magnitude[i],
                    r.phase[i], found.coherence[i],
                    std::isnan(distortion) ? "-" : number(std::round(1e6 * distortion) / 1e4).c_str(),
                    found.unsettled[i] <= tolerance ? "" : "  not settled");
    }
}

nlohmann::ordered_json to_json(const MeasuredResponse& found) {
    std::vector<double> real, imaginary;
    for (const auto& value : found.response.value) {
        real.push_back(value.real());
        imaginary.push_back(value.imag());
    }
    return {{"input", found.input},
            {"output", found.output},
            {"input_unit", found.input_unit},
            {"output_unit", found.output_unit},
            {"time", found.time},
            {"amplitude", found.amplitude},
            {"omega", found.response.omega},
            {"real", real},
            {"imaginary", imaginary},
            {"magnitude_db", found.response.magnitude},
            {"phase_degrees", found.response.phase},
            {"coherence", found.coherence},
            {"distortion", found.distortion},
            {"unsettled", found.unsettled}};
}

std::vector<recording::MatVariable> to_mat(const nlohmann::ordered_json& all) {
    std::vector<recording::MatVariable> variables;
    for (const auto& [key, value] : all.items()) {
        if (value.is_array()) {
            std::vector<double> numbers;
            for (const auto& one : value) numbers.push_back(one.is_null() ? NAN : one.get<double>());
            variables.push_back({key, numbers.size(), 1, std::move(numbers)});
        } else if (value.is_number()) {
            variables.push_back({key, 1, 1, {value.get<double>()}});
        } else if (!value.get<std::string>().empty()) {
            variables.push_back({key, 0, 0, {}, {value.get<std::string>()}});
        }
    }
    return variables;
}

/// What the linearised model says of the same, where it can be linearised.
std::optional<analysis::Response> linearised(Simulation& run, const Arguments& arguments,
                                             const std::vector<double>& measured) {
    const auto& asked = arguments.measure;
    try {
        const auto system = asked.loop.empty()
                                ? analysis::linearize(run, {.from = {asked.from}, .to = {asked.to}})
                                : analysis::loop_gain(run, asked.loop);
        auto omega = analysis::logarithmic(measured.front(), measured.back(), 300);
        if (system.period > 0) std::erase_if(omega, [&](double w) { return w > M_PI / system.period; });
        return analysis::response(system, 0, 0, omega);
    } catch (const RunError&) {
        return std::nullopt;
    }
}

Figure figure_of(const MeasuredResponse& found, const std::optional<analysis::Response>& linear,
                 const Arguments& arguments) {
    const auto& r = found.response;
    std::vector<double> phase = r.phase;
    // Both are unwrapped, and may begin whole turns apart.
    if (linear && !linear->phase.empty())
        for (double& p : phase) p += 360 * std::round((linear->phase.front() - r.phase.front()) / 360);
    const auto marks = [&](const char* name, const std::vector<double>& values) {
        return Curve{name, r.omega, values, false, false, Curve::Mark::circle};
    };
    Figure figure{arguments.measure.loop.empty() ? "From " + found.input + " to " + found.output
                                                 : "Loop through " + arguments.measure.loop,
                  {{"Magnitude", "dB", {marks("measured", r.magnitude)}},
                   {"Phase", "degrees", {marks("measured", phase)}}},
                  "frequency (rad/s)",
                  true};
    if (linear && !linear->omega.empty()) {
        figure.panels[0].curves.push_back({"linearised", linear->omega, linear->magnitude});
        figure.panels[1].curves.push_back({"linearised", linear->omega, linear->phase});
    }
    std::vector<double> percent;
    for (const double d : found.distortion) percent.push_back(100 * d);
    if (arguments.is_chirp)
        figure.panels.push_back({"Coherence", "", {marks("coherence", found.coherence)}});
    else
        figure.panels.push_back({"Distortion", "%", {marks("distortion", percent)}});
    return figure;
}

void execute(Arguments& arguments) {
    auto& options = arguments.measure;
    if (options.loop.empty() && (options.from.empty() || options.to.empty()))
        throw CommandError("name the loop by --loop SIGNAL, or both ends by --from SIGNAL and --to SIGNAL");
    std::vector<WrittenFile> written;
    for (const auto& file : arguments.outputs) {
        if (!is_figure(file) && !is_data(file)) refuse_format(file, ".png, .svg, .yaml, .json or .mat");
        written.push_back({"-o", file});
    }
    refuse_overwriting(written, files_of(arguments.at.model.file));
    options.omega = frequencies_of(arguments);
    if (arguments.is_chirp) options.excitation = analysis::MeasureOptions::Excitation::chirp;
    const LoadedModel loaded = load_model(arguments.at.model);
    Simulation run(loaded.diagram);
    const auto found = [&] {
        const Waiting waiting("measuring " + std::to_string(options.omega.size()) + " frequencies");
        arguments.at.go_to_operating_point(run);
        return analysis::measure_response(run, options);
    }();
    print(found, options.tolerance);
    for (const auto& file : arguments.outputs) {
        if (is_data(file)) {
            const auto all = to_json(found);
            write_data(all, to_mat(all), file);
            continue;
        }
        write_figure(figure_of(found, linearised(run, arguments, found.response.omega), arguments), file,
                     arguments.size.width, arguments.size.height);
    }
}

} // namespace

void add_frequency_response(CLI::App& app) {
    auto* command = app.add_subcommand(
        "frequency-response", "frequency response of a model, measured in simulation by sines or a chirp");
    auto arguments = std::make_shared<Arguments>();
    auto& options = arguments->measure;
    arguments->at.model.add_to(*command);
    auto* from =
        command->add_option("--from", options.from, "the signal to which sines are added; a[3]: one element")
            ->type_name("SIGNAL");
    auto* to = command->add_option("--to", options.to, "the signal or state, block.state, that is looked at")
                   ->type_name("SIGNAL");
    command
        ->add_option(
            "--loop", options.loop,
            "the loop through this signal, which stays closed: its gain as of negative feedback, 1 + L = 0")
        ->type_name("SIGNAL")
        ->excludes(from)
        ->excludes(to);
    command->add_option("--frequencies", arguments->range, "rad/s, evenly on a logarithmic axis, or one")
        ->type_name("LOW:HIGH")
        ->required();
    command->add_option("--points", arguments->points, "number of frequencies")
        ->check(between(2, 10000))
        ->type_name("N")
        ->capture_default_str();
    command
        ->add_option("--amplitude", options.amplitude,
                     "of what is added; otherwise 1 % of what the signal is, at least 0.01")
        ->check(between(1e-12, 1e12))
        ->type_name("A");
    command->add_flag("--chirp", arguments->is_chirp,
                      "one chirp for all frequencies instead of a sine for each");
    command->add_option("--tolerance", options.tolerance, "of the response, relative: it is waited so long")
        ->check(between(1e-12, 0.1))
        ->type_name("SHARE")
        ->capture_default_str();
    command->add_option("--most-periods", options.most_periods, "after which it is not waited any more")
        ->check(between(8, 1e7))
        ->type_name("N")
        ->capture_default_str();
    arguments->at.add_operating_point_to(*command);
    command
        ->add_option("-o,--output", arguments->outputs,
                     "picture, PNG or SVG, or data, YAML, JSON or a MAT-file; may be repeated")
        ->type_name("FILE")
        ->allow_extra_args(false);
    arguments->size.add_to(*command);
    command->footer("Example: bf frequency-response docs/start/motor.yaml --loop controller.voltage "
                    "--frequencies 1:100 -o measured.png");
    command->callback([arguments] { execute(*arguments); });
}

} // namespace bf::tools
