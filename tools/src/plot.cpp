// bf plot, bf export: look at a recording.
#include "bf/recording/export.hpp"
#include "bf/recording/plot.hpp"
#include "session.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cstdio>
#include <sstream>

namespace bf::tools {

namespace {

struct PlotOptions {
    std::string recording, output;
    std::vector<std::string> signals;
    int width = 1200, height = 0;
};

/// One panel of several signals: a scalar overlays the others, the first of two equally sized is the reference.
recording::Panel panel(const recording::Recording& r, const std::string& title, const std::vector<std::string>& signals) {
    recording::Panel result;
    for (const auto& signal : signals) {
        auto part = recording::panel_of(r.channel(signal));
        const std::string prefix = signals.size() > 1 ? signal + ": " : "";
        for (auto& curve : part.curves) {
            if (signals.size() > 1 && part.curves.size() == 1) curve.name = signal;
            curve.reference = signals.size() == 2 && &signal == &signals.front() && part.curves.size() <= 3;
            result.curves.push_back(std::move(curve));
        }
        if (result.y_label.empty()) result.y_label = part.y_label;
    }
    result.title = title;
    return result;
}

void plot(const PlotOptions& options) {
    const auto r = recording::load(options.recording);
    if (!r.complete) std::fprintf(stderr, "%s is not complete: %s\n", options.recording.c_str(), r.defect.c_str());
    recording::Figure figure;
    if (const auto m = r.metadata.find("recording"); m != r.metadata.end() && m->second.contains("model")) figure.title = m->second.at("model");
    if (!options.signals.empty()) {
        for (const auto& signal : options.signals) figure.panels.push_back(panel(r, signal, {signal}));
    } else if (const auto plots = r.metadata.find("plots"); plots != r.metadata.end() && !plots->second.empty()) {
        for (const auto& [key, text] : plots->second) {
            std::istringstream lines(text);
            std::vector<std::string> signals;
            for (std::string line; std::getline(lines, line);) signals.push_back(line);
            figure.panels.push_back(panel(r, key.substr(key.find(' ') + 1), signals));
        }
    } else {
        for (const auto& channel : r.channels) figure.panels.push_back(recording::panel_of(channel));
        if (figure.panels.size() > 8) figure.panels.resize(8);
    }
    const std::string output = options.output.empty() ? std::filesystem::path(options.recording).replace_extension(".png").string() : options.output;
    recording::save(figure, output, options.width, options.height);
    std::printf("%s\n", output.c_str());
}

void write_export(const std::string& recording_file, const std::string& output) {
    const auto r = recording::load(recording_file);
    if (output.ends_with(".mat")) recording::write_mat(r, output);
    else if (output.ends_with(".csv"))
        for (const auto& file : recording::write_csv(r, output)) std::printf("%s\n", file.c_str());
    else throw CommandError("cannot tell the format of " + output + ": give a name that ends in .csv or .mat");
}

} // namespace

void add_plot(CLI::App& app) {
    auto* command = app.add_subcommand("plot", "draw a recording");
    auto options = std::make_shared<PlotOptions>();
    command->add_option("recording", options->recording, "MCAP file that bf run wrote")->required();
    command->add_option("signals", options->signals, "what to draw; nothing: the panels that the model asks for");
    command->add_option("-o,--output", options->output, "PNG or SVG file; otherwise beside the recording")->type_name("FILE");
    command->add_option("--width", options->width, "pixels");
    command->add_option("--height", options->height, "pixels; 0: as needed");
    command->footer("Example: bf plot run.mcap world.com -o com.png");
    command->callback([options] { plot(*options); });
}

void add_export(CLI::App& app) {
    auto* command = app.add_subcommand("export", "convert a recording to CSV or a MAT-file");
    auto input = std::make_shared<std::string>(), output = std::make_shared<std::string>();
    command->add_option("recording", *input, "MCAP file that bf run wrote")->required();
    command->add_option("-o,--output", *output, "file ending in .csv or .mat")->required()->type_name("FILE");
    command->footer("Example: bf export run.mcap -o run.mat");
    command->callback([input, output] { write_export(*input, *output); });
}

} // namespace bf::tools
