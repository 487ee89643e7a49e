// bf run: simulates a model.
#include "run.hpp"

#include "bf/engine/recorder.hpp"
#include "session.hpp"
#include "verbs.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <optional>
#include <unistd.h>

namespace bf::tools {

namespace {

using Seconds = std::chrono::duration<double>;

// Async-signal-safe: the only thing a handler may do is set this.
volatile std::sig_atomic_t interrupted = 0;

/// The line that shows where a run is: time, real-time factor and what the model's Display blocks show.
class Progress {
  public:
    Progress(const Simulation& simulation, double stop) : simulation_(simulation), stop_(stop) {
        const auto& nodes = simulation.diagram().nodes;
        for (const auto& node : nodes)
            if (node.type == "Display" && node.sources[0].node >= 0) shown_.push_back({node.path.substr(node.path.rfind('.') + 1), node.sources[0]});
    }

    void show(double wall, bool is_last) {
        std::string line = "  t = " + fixed(simulation_.time(), 2);
        if (std::isfinite(stop_)) line += " / " + number(stop_);
        line += " s   " + fixed(wall > 0 ? simulation_.time() / wall : 0, 1) + " x real time";
        for (const auto& [label, end] : shown_) {
            const Slot& slot = simulation_.diagram().slot(end);
            line += "   " + label + " ";
            for (int i = 0; i < std::min(slot.size.count(), 6); ++i)
                line += (i ? " " : "") + fixed(read_value(simulation_.context().data(end.node, end.slot), slot.type, i), 2);
        }
        const bool is_terminal = isatty(STDERR_FILENO);
        std::fprintf(stderr, is_terminal ? "\r%s\033[K%s" : "%s%s", line.c_str(), is_last || !is_terminal ? "\n" : "");
        std::fflush(stderr);
    }

  private:
    static std::string fixed(double x, int digits) {
        char text[32];
        std::snprintf(text, sizeof text, "%.*f", digits, x);
        return text;
    }
    const Simulation& simulation_;
    double stop_;
    std::vector<std::pair<std::string, Node::End>> shown_;
};

struct RunOptions {
    ModelOptions model;
    std::string stop, record, summary;
    bool is_quiet = false, as_json = false;
};

} // namespace

nlohmann::ordered_json RunResult::to_json() const {
    nlohmann::ordered_json json;
    json["model"] = model;
    json["simulated_s"] = simulated;
    json["wall_s"] = wall;
    json["real_time_factor"] = wall > 0 ? simulated / wall : 0;
    json["steps"] = steps;
    auto& list = json["checks"] = nlohmann::ordered_json::object();
    for (const auto& check : checks) {
        if (check.is_boolean) list[check.name] = check.value != 0;
        else if (std::isfinite(check.value)) list[check.name] = check.value;
        else list[check.name] = nullptr;
    }
    if (!failure.empty()) json["failure"] = failure;
    return json;
}

RunResult run(Simulation& simulation, double stop, const std::function<void(double wall, bool is_last)>& progress) {
    const auto steps = std::isfinite(stop) ? static_cast<std::int64_t>(std::llround(stop / simulation.diagram().step)) : INT64_MAX;
    simulation.start();
    const auto begin = std::chrono::steady_clock::now();
    auto shown = begin;
    const auto wall = [&] { return Seconds(std::chrono::steady_clock::now() - begin).count(); };
    RunResult result;
    result.model = simulation.diagram().name;
    while (simulation.steps() < steps && !interrupted) {
        if (!simulation.step()) break;
        // Looking at the clock every step would cost more than a small model's step.
        if (progress && (simulation.steps() & 63) == 0)
            if (const auto now = std::chrono::steady_clock::now(); now - shown > std::chrono::milliseconds(200)) {
                shown = now;
                progress(wall(), false);
            }
    }
    result.wall = wall();
    result.simulated = simulation.time();
    result.steps = simulation.steps();
    result.failure = simulation.failure();
    result.is_interrupted = interrupted != 0;
    if (progress) progress(result.wall, true);
    result.checks = simulation.checks();
    simulation.stop();
    return result;
}

namespace {

void execute(const RunOptions& options) {
    std::vector<std::pair<std::string, std::string>> extra;
    if (!options.stop.empty()) extra.emplace_back("stop", options.stop);
    const LoadedModel loaded = load_model(options.model, extra);
    const Diagram& diagram = loaded.diagram;

    Simulation simulation(diagram);
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        std::vector<SignalName> signals = diagram.record;
        for (const auto& panel : diagram.plots) signals.insert(signals.end(), panel.signals.begin(), panel.signals.end());
        if (signals.empty()) signals = diagram.signals();
        recorder.emplace(diagram, signals, options.record, loaded.text);
        simulation.add_observer(*recorder);
    }
    interrupted = 0;
    std::signal(SIGINT, [](int) { interrupted = 1; });
    std::signal(SIGTERM, [](int) { interrupted = 1; });

    Progress progress(simulation, diagram.stop);
    const auto show = [&](double wall, bool is_last) { progress.show(wall, is_last); };
    const RunResult result = run(simulation, diagram.stop, options.is_quiet ? std::function<void(double, bool)>() : show);
    if (recorder) recorder->close();

    const std::string text = result.to_json().dump(2) + "\n";
    if (!options.summary.empty()) write_file(options.summary, text);
    if (options.as_json) std::fputs(text.c_str(), stdout);
    else {
        for (const auto& check : result.checks)
            std::printf("  %-32s %s\n", check.name.c_str(), check.is_boolean ? (check.value != 0 ? "yes" : "NO") : number(check.value).c_str());
        if (recorder) std::printf("  recorded in %s; look at it with: bf plot %s\n", options.record.c_str(), options.record.c_str());
    }
    if (!result.failure.empty())
        throw CommandError(loaded.diagram.name + " stopped at t = " + number(result.simulated) + " s: " + result.failure);
    if (result.is_interrupted) throw CommandError("interrupted at t = " + number(result.simulated) + " s");
}

} // namespace

void add_run(CLI::App& app) {
    auto* command = app.add_subcommand("run", "simulate a model");
    auto options = std::make_shared<RunOptions>();
    options->model.add_to(*command);
    command->add_option("--stop", options->stop, "duration, s (an expression)")->type_name("T");
    command->add_option("--record", options->record, "write the recorded signals to this MCAP file")->type_name("FILE");
    command->add_option("--summary", options->summary, "write the summary to this JSON file")->type_name("FILE");
    command->add_flag("--quiet", options->is_quiet, "no progress line");
    command->add_flag("--json", options->as_json, "print the summary as JSON");
    command->footer("Example: bf run examples/icub_balancing/balancing.yaml --set scenario=2 --record run.mcap");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
