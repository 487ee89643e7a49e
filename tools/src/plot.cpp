// bf plot, bf export: look at a recording.
#include "bf/recording/plot.hpp"
#include "bf/base/escape.hpp"
#include "bf/recording/export.hpp"
#include "figure.hpp"
#include "files.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct PlotOptions {
    std::string recording, output;
    std::vector<std::string> signals, references;
    FigureSize size{1200};
};

/// Does a word of its name say that others follow the signal?
bool is_called_reference(const std::string& signal) {
    constexpr std::string_view separators = "._";
    for (std::size_t begin = 0; begin < signal.size();) {
        const auto end = std::min(signal.find_first_of(separators, begin), signal.size());
        const auto word = signal.substr(begin, end - begin);
        for (const char* known : {"reference", "ref", "setpoint", "desired", "target"})
            if (word == known) return true;
        begin = end + 1;
    }
    return false;
}

/// Which signals are drawn as references: those that the user names, otherwise those that are called so. Not
/// all of a panel.
std::vector<bool> are_references(const recording::Recording& r, const std::vector<std::string>& signals,
                                 const std::vector<std::string>& named) {
    std::vector<bool> are;
    for (const auto& signal : signals)
        are.push_back(named.empty() ? is_called_reference(r.find(signal).channel.name)
                                    : std::any_of(named.begin(), named.end(), [&](const std::string& name) {
                                          return &r.find(name).channel == &r.find(signal).channel;
                                      }));
    if (std::find(are.begin(), are.end(), false) == are.end()) are.assign(are.size(), false);
    return are;
}

/// One panel of several signals.
recording::Panel panel(const recording::Recording& r, const std::string& title,
                       const std::vector<std::string>& signals, const std::vector<std::string>& named) {
    recording::Panel result;
    const auto references = are_references(r, signals, named);
    for (std::size_t i = 0; i < signals.size(); ++i) {
        const auto& signal = signals[i];
        const auto [channel, element] = r.find(signal);
        auto part = recording::panel_of(channel);
        if (element) part.curves = {part.curves[*element]};
        for (auto& curve : part.curves) {
            if (signals.size() > 1 && part.curves.size() == 1) curve.name = signal;
            curve.reference = references[i];
            result.curves.push_back(std::move(curve));
        }
        if (i == 0) result.y_label = part.y_label;
        if (result.y_label != part.y_label) result.y_label.clear(); // no unit is that of all
        if (result.names.empty()) result.names = part.names;
    }
    result.title = title;
    return result;
}

/// The signals of an argument: one, several with commas between, or all that begin as in "world.*".
std::vector<std::string> signals_of(const recording::Recording& r, const std::string& text) {
    std::vector<std::string> signals;
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
        const auto before = signals.size();
        if (part.ends_with('*'))
            for (const auto& channel : r.channels)
                if (channel.name.starts_with(part.substr(0, part.size() - 1)))
                    signals.push_back(channel.name);
        if (signals.size() == before) signals.push_back(part); // reported when it is looked for
    }
    if (signals.empty()) signals.push_back(text);
    return signals;
}

/// Says which panels stay empty.
void tell_of_empty_panels(const recording::Figure& figure) {
    for (const auto& panel : figure.panels)
        if (std::ranges::none_of(panel.curves, [](const recording::Curve& curve) {
                return std::ranges::any_of(curve.value, [](double y) { return std::isfinite(y); });
            }))
            std::fprintf(stderr, "%s has no finite value: its panel is empty\n",
                         escape::terminal(panel.title).c_str());
}

void plot(const PlotOptions& options) {
    const auto r = load_recording(options.recording);
    recording::Figure figure;
    if (const auto m = r.metadata.find("recording"); m != r.metadata.end() && m->second.contains("model"))
        figure.title = m->second.at("model");
    if (!options.signals.empty()) {
        for (const auto& signal : options.signals)
            figure.panels.push_back(panel(r, signal, signals_of(r, signal), options.references));
    } else if (const auto plots = r.metadata.find("plots");
               plots != r.metadata.end() && !plots->second.empty()) {
        for (const auto& [key, text] : plots->second) { // "100 title": the number keeps the order
            std::istringstream lines(text);
            std::vector<std::string> signals;
            for (std::string line; std::getline(lines, line);) signals.push_back(line);
            figure.panels.push_back(panel(r, key.substr(key.find(' ') + 1), signals, options.references));
        }
    } else {
        constexpr std::size_t most = 8;
        if (r.channels.size() > most)
            std::fprintf(stderr, "showing the first %zu of %zu signals; name those to show\n", most,
                         r.channels.size());
        for (std::size_t i = 0; i < std::min(most, r.channels.size()); ++i)
            figure.panels.push_back(recording::panel_of(r.channels[i]));
    }
    if (figure.panels.empty())
        throw CommandError(options.recording + " holds no signal: there is nothing to draw");
    const std::string output = options.output.empty()
                                   ? fs::path(options.recording).replace_extension(".png").string()
                                   : options.output;
    refuse_overwriting({{"-o", output}}, {options.recording});
    tell_of_empty_panels(figure);
    const Waiting waiting("drawing " + output);
    write_figure(figure, output, options.size.width, options.size.height);
    refuse_incomplete(r, options.recording, output);
}

void execute_export(const std::string& recording_file, const std::string& output) {
    const bool is_csv = output.ends_with(".csv") || output == "/dev/stdout";
    if (!is_csv && !output.ends_with(".mat"))
        throw CommandError("cannot tell the format of " + output + ": give a name that ends in .csv or .mat");
    refuse_overwriting({{"-o", output}}, {recording_file});
    const auto r = load_recording(recording_file);
    const Waiting waiting("writing " + output);
    if (is_csv) {
        const auto files = recording::csv_files(r, output);
        if (files.size() > 1 && output == "/dev/stdout")
            throw CommandError("signals of different rates go to a file each; give a name that ends in .csv");
        for (const auto& file : files) refuse_overwriting({{"-o", file}}, {recording_file});
        for (const auto& file : recording::write_csv(r, output))
            if (output != "/dev/stdout") std::printf("%s\n", file.c_str());
        return refuse_incomplete(r, recording_file, output);
    }
    OutputFile file(output);
    recording::write_mat(r, file.path());
    file.commit();
    std::printf("%s\n", output.c_str());
    refuse_incomplete(r, recording_file, output);
}

} // namespace

void add_plot(CLI::App& app) {
    auto* command = app.add_subcommand("plot", "draw a recording");
    auto options = std::make_shared<PlotOptions>();
    command->add_option("RECORDING", options->recording, "MCAP file that bf run wrote")
        ->required()
        ->type_name("");
    command
        ->add_option(
            "SIGNALS", options->signals,
            "what to draw, a panel each; a,b in one panel; a.* all of a; a[3], a[NAME] one element; nothing: "
            "the panels that the model asks for")
        ->type_name("");
    command
        ->add_option(
            "--reference", options->references,
            "a signal to draw dashed over the one that follows it; may be repeated. Otherwise signals with "
            "reference, ref, setpoint, desired or target in their name")
        ->type_name("SIGNAL")
        ->allow_extra_args(false);
    command->add_option("-o,--output", options->output, "PNG or SVG file; otherwise beside the recording")
        ->type_name("FILE");
    options->size.add_to(*command);
    command->footer("Examples:\n"
                    "  bf plot run.mcap\n"
                    "  bf plot run.mcap controller.com_reference,world.com controller.tau -o com.svg\n"
                    "  bf plot run.mcap 'world.s[l_knee],world.s[r_knee]'");
    command->callback([options] { plot(*options); });
}

void add_export(CLI::App& app) {
    auto* command = app.add_subcommand("export", "convert a recording to CSV or a MAT-file");
    auto input = std::make_shared<std::string>(), output = std::make_shared<std::string>();
    command->add_option("RECORDING", *input, "MCAP file that bf run wrote")->required()->type_name("");
    command->add_option("-o,--output", *output, "file ending in .csv or .mat, or /dev/stdout for CSV")
        ->required()
        ->type_name("FILE");
    command->footer("Signals of different rates go to one CSV file each, e.g. run_controller.tau.csv.\n"
                    "Example: bf export run.mcap -o run.mat");
    command->callback([input, output] { execute_export(*input, *output); });
}

} // namespace bf::tools
