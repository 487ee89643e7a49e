// bf run: simulates a model.
#include "run.hpp"

#include "bf/engine/recorder.hpp"
#include "run_realtime.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

namespace bf::tools {

nlohmann::ordered_json RunResult::to_json() const {
    nlohmann::ordered_json json;
    json["model"] = model;
    json["outcome"] = is_interrupted ? "interrupted" : failure.empty() ? "finished" : "failed";
    json["simulated_s"] = simulated;
    json["wall_s"] = wall;
    json["real_time_factor"] = wall > 0 ? simulated / wall : 0;
    json["steps"] = steps;
    if (!realtime.is_null()) json["realtime"] = realtime;
    auto& list = json["checks"] = nlohmann::ordered_json::object();
    for (const auto& check : checks) {
        if (check.is_boolean)
            list[check.name] = check.value != 0;
        else
            list[check.name] = check.value; // null when not finite
    }
    if (!failure.empty()) json["failure"] = failure;
    return json;
}

RunResult run(Simulation& simulation, double stop, const std::function<bool(double wall)>& go_on) {
    using Clock = std::chrono::steady_clock;
    const double count = std::round(stop / simulation.diagram().step);
    const auto steps = count < 9e18 ? static_cast<std::int64_t>(count) : INT64_MAX;
    simulation.start();
    const auto begin = Clock::now();
    auto asked = begin;
    const auto seconds = [&](Clock::time_point t) {
        return std::chrono::duration<double>(t - begin).count();
    };
    // Asking after every step would cost more than a small model's step.
    std::int64_t stride = 1, next = 1;
    while (simulation.steps() < steps && simulation.step()) {
        if (!go_on || simulation.steps() < next) continue;
        const auto now = Clock::now();
        stride =
            now - asked < std::chrono::milliseconds(2) ? stride * 2 : std::max<std::int64_t>(1, stride / 2);
        next = simulation.steps() + stride;
        asked = now;
        if (!go_on(seconds(now))) break;
    }
    RunResult result;
    result.model = simulation.diagram().name;
    result.wall = seconds(Clock::now());
    result.simulated = simulation.time();
    result.steps = simulation.steps();
    result.failure = simulation.failure();
    result.checks = simulation.checks();
    simulation.stop();
    return result;
}

namespace {

std::string fixed(double x, int digits) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", digits, x);
    return text;
}

/// Where a run is: time, real-time factor and what the model's Display blocks show.
class Progress {
  public:
    explicit Progress(const Simulation& simulation) : simulation_(simulation) {
        for (const auto& node : simulation.diagram().nodes)
            if (node.type == "Display" && node.sources[0].node >= 0)
                shown_.push_back({node.path.substr(node.path.rfind('.') + 1), node.sources[0]});
    }

    std::string text(double wall) const {
        const double stop = simulation_.diagram().stop;
        std::string line = "  t = " + fixed(simulation_.time(), 2);
        if (std::isfinite(stop)) line += " / " + number(stop);
        line += " s, " + factor_text(wall) + " x real time";
        for (const auto& [label, end] : shown_) {
            constexpr int most = 6;
            const Slot& slot = simulation_.diagram().slot(end);
            line += "   " + label;
            for (int i = 0; i < std::min(slot.size.count(), most); ++i)
                line +=
                    " " + number(read_value(simulation_.context().data(end.node, end.slot), slot.type, i));
            if (slot.size.count() > most) line += " ...";
        }
        return line;
    }

  private:
    std::string factor_text(double wall) const {
        const double factor = wall > 0 ? simulation_.time() / wall : 0;
        return fixed(factor, factor < 100 ? 1 : 0);
    }

    const Simulation& simulation_;
    std::vector<std::pair<std::string, Node::End>> shown_;
};

struct RunOptions {
    ModelOptions model;
    RealtimeOptions realtime;
    std::string stop, record, summary;
    bool is_quiet = false, as_json = false;
};

std::vector<SignalName> recorded_signals(const Diagram& diagram) {
    std::vector<SignalName> signals = diagram.record;
    for (const auto& panel : diagram.plots)
        signals.insert(signals.end(), panel.signals.begin(), panel.signals.end());
    return signals.empty() ? diagram.signals() : signals;
}

void print(const RunResult& result) {
    std::size_t width = 0;
    for (const auto& check : result.checks) width = std::max(width, check.name.size());
    for (const auto& check : result.checks)
        std::printf("  %-*s  %s\n", static_cast<int>(width), check.name.c_str(),
                    check.is_boolean ? (check.value != 0 ? "yes" : "NO") : number(check.value).c_str());
    std::fputs(result.report.c_str(), stdout);
}

void execute(const RunOptions& options) {
    ModelOptions model = options.model;
    if (!options.stop.empty()) model.sets.push_back("stop=" + options.stop);
    const LoadedModel loaded = load_model(model);
    const Diagram& diagram = loaded.diagram;
    const bool is_endless = !std::isfinite(diagram.stop);
    if (is_endless && options.stop.empty() && !std::isfinite(options.realtime.duration))
        throw CommandError(diagram.name +
                           " does not say how long it runs: give --stop SECONDS (--stop Inf runs until "
                           "Ctrl-C), or write 'stop: SECONDS' in the model");

    std::optional<OutputFile> summary;
    if (!options.summary.empty()) summary.emplace(options.summary);
    Simulation simulation(diagram);
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(diagram, recorded_signals(diagram), options.record, loaded.text,
                         recording::WriterOptions{.drop_when_full = options.realtime.is_asked});
        if (!options.realtime.is_asked) simulation.add_observer(*recorder);
    }

    RunResult result;
    {
        const InterruptGuard guard;
        StatusLine line;
        const auto goes_on = [&] { return !InterruptGuard::signal() && !(recorder && recorder->failed()); };
        if (options.realtime.is_asked) {
            std::string last;
            result = run_realtime(simulation, options.realtime, recorder ? &*recorder : nullptr,
                                  diagram.signals(), [&](const std::string& progress) {
                                      last = progress;
                                      if (!options.is_quiet && line.is_due()) line.show(progress);
                                      return goes_on();
                                  });
            if (!options.is_quiet) line.finish(last);
        } else {
            const Progress progress(simulation);
            result = run(simulation, diagram.stop, [&](double wall) {
                if (!options.is_quiet && wall > 1 && line.is_due()) line.show(progress.text(wall));
                return goes_on();
            });
            if (!options.is_quiet) line.finish(progress.text(result.wall));
        }
        result.is_interrupted = InterruptGuard::signal() != 0 && result.failure.empty();
    }
    if (recorder) {
        try {
            recorder->close();
        } catch (const std::exception& error) {
            if (result.failure.empty()) result.failure = error.what();
        }
    }
    const std::string text = to_text(result.to_json());
    if (summary) {
        summary->write(text);
        summary->commit();
    }
    if (options.as_json)
        std::fputs(text.c_str(), stdout);
    else
        print(result);
    if (recorder && !recorder->failed() && !options.as_json)
        std::printf("  recorded in %s; look at it with: bf plot %s\n", options.record.c_str(),
                    options.record.c_str());
    std::fflush(stdout);
    const std::string stopped = diagram.name + " stopped at t = " + number(result.simulated) + " s: ";
    if (!result.failure.empty()) throw CommandError(stopped + result.failure);
    if (result.is_interrupted) throw Interrupted(InterruptGuard::signal(), stopped + "interrupted");
}

} // namespace

void add_run(CLI::App& app) {
    auto* command = app.add_subcommand("run", "simulate a model");
    auto options = std::make_shared<RunOptions>();
    options->model.add_to(*command);
    command->add_option("--stop", options->stop, "duration, s (an expression); Inf: until Ctrl-C")
        ->type_name("T");
    command
        ->add_option("--record", options->record,
                     "write the signals that the model records to this MCAP file")
        ->type_name("FILE");
    command
        ->add_option("--summary", options->summary,
                     "write times, steps and the model's checks to this JSON file")
        ->type_name("FILE");
    options->realtime.add_to(*command);
    command->add_flag("--json", options->as_json, "print the summary as JSON");
    command->add_flag("--quiet,--headless", options->is_quiet, "show nothing while it runs");
    command->footer(
        "Examples:\n"
        "  bf run examples/icub_balancing/balancing.yaml\n"
        "  bf run examples/icub_balancing/balancing.yaml --set scenario=2 --stop 8 --record run.mcap\n"
        "  bf run docs/start/motor.yaml --realtime --serve\n"
        "Ctrl-C ends a run as its stop time does: recording and summary are complete, the exit code is 130.\n"
        "The exit code does not depend on the model's checks; look at them in the summary.");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
