// bf run: simulates a model.
#include "run.hpp"

#include "bf/codegen/input_file.hpp"
#include "bf/run/comparison.hpp"
#include "bf/run/recorder.hpp"
#include "bf/run/snapshot.hpp"
#include "files.hpp"
#include "model_parameters.hpp"
#include "profile.hpp"
#include "run_realtime.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>

namespace bf::tools {

nlohmann::ordered_json RunResult::to_json() const {
    nlohmann::ordered_json json;
    json["model"] = model;
    json["outcome"] = is_interrupted        ? "interrupted"
                      : !failure.empty()    ? "failed"
                      : !stopped_by.empty() ? "stopped"
                                            : "finished";
    if (!stopped_by.empty()) json["stopped_by"] = stopped_by;
    json["simulated_s"] = simulated - from;
    json["wall_s"] = wall;
    json["real_time_factor"] = wall > 0 ? (simulated - from) / wall : 0;
    json["steps"] = steps;
    if (!realtime.is_null()) json["realtime"] = realtime;
    auto& list = json["checks"] = nlohmann::ordered_json::object();
    for (const auto& check : checks) {
        if (!has_run())
            list[check.name] = nullptr;
        else if (check.is_boolean)
            list[check.name] = check.value != 0;
        else
            list[check.name] = check.value; // null when not finite
    }
    if (!failure.empty()) json["failure"] = failure;
    return json;
}

namespace {
/// False where a signal ended what its start waited for.
bool starts(Simulation& simulation) {
    try {
        simulation.start();
    } catch (const RunError& error) {
        if (!without_interruption(error.what()).empty()) throw;
        return false;
    }
    return true;
}
} // namespace

RunResult run(Simulation& simulation, double stop, const RunHooks& hooks) {
    using Clock = std::chrono::steady_clock;
    const std::int64_t steps = simulation.steps_before(stop);
    simulation.leave_outputs_of_solver();
    const bool is_started = hooks.is_started || starts(simulation);
    const std::int64_t first = simulation.steps();
    const auto begin = Clock::now();
    auto asked = begin;
    const auto seconds = [&](Clock::time_point t) {
        return std::chrono::duration<double>(t - begin).count();
    };
    // Asking after every step would cost more than a small model's step.
    std::int64_t stride = 1, next = first + 1;
    while (is_started && simulation.steps() < steps && (!hooks.between_steps || hooks.between_steps()) &&
           simulation.step()) {
        if (!hooks.go_on || simulation.steps() < next) continue;
        const auto now = Clock::now();
        stride =
            now - asked < std::chrono::milliseconds(2) ? stride * 2 : std::max<std::int64_t>(1, stride / 2);
        next = simulation.steps() + stride;
        asked = now;
        if (!hooks.go_on(seconds(now))) break;
    }
    if (hooks.before_stop && is_started && simulation.failure().empty()) hooks.before_stop();
    RunResult result;
    result.model = simulation.diagram().name;
    result.wall = seconds(Clock::now());
    result.simulated = simulation.time();
    result.from = static_cast<double>(first) * simulation.diagram().step;
    result.steps = simulation.steps() - first;
    result.failure = without_interruption(simulation.failure());
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
    explicit Progress(const Simulation& simulation) : simulation_(simulation), from_(simulation.time()) {
        for (const auto& node : simulation.diagram().nodes)
            if (node.block->declaration().traits.is_displayed && node.sources[0].node >= 0)
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
        const double factor = wall > 0 ? (simulation_.time() - from_) / wall : 0;
        return fixed(factor, factor < 100 ? 1 : 0);
    }

    const Simulation& simulation_;
    const double from_; ///< s
    std::vector<std::pair<std::string, Node::End>> shown_;
};

struct RunOptions {
    ModelOptions model;
    RealtimeOptions realtime;
    std::string inputs, stop, record, summary, until, snapshot, from_snapshot, profile, ros1, ros2;
    std::optional<double> snapshot_at, checkpoint_every; ///< s
    bool as_json = false, is_profiled = false;
};

void print(const RunResult& result) {
    std::size_t width = 0;
    for (const auto& check : result.checks) width = std::max(width, check.name.size());
    for (const auto& check : result.checks)
        std::printf("  %-*s  %s\n", static_cast<int>(width), check.name.c_str(),
                    !result.has_run()  ? "not run"
                    : check.is_boolean ? (check.value != 0 ? "yes" : "NO")
                                       : number(check.value).c_str());
    std::fputs(result.report.c_str(), stdout);
}

/// Writes a snapshot to a file, once, when its time has come or the run ends.
class SnapshotFile {
  public:
    SnapshotFile(const RunOptions& options, const Simulation& simulation) {
        if (options.snapshot.empty()) return;
        static_cast<void>(make_snapshot(simulation)); // refuses before the first step
        const Diagram& diagram = simulation.diagram();
        const double at = options.snapshot_at.value_or(diagram.stop);
        if (at > diagram.stop || at < simulation.time())
            throw CommandError("--snapshot-at " + number(at) + " s is not within the run, from " +
                               number(simulation.time()) + " s to " + number(diagram.stop) + " s");
        step_ = simulation.steps_before(at);
        is_at_end_ = !options.snapshot_at;
        file_.emplace(options.snapshot);
    }

    /// A recorder keeps the snapshot too, for a replay takes one there.
    void look(const Simulation& simulation, Recorder* recorder, bool is_end) {
        if (!file_ || is_written_ || (simulation.steps() != step_ && !(is_end && is_at_end_))) return;
        if (recorder) recorder->checkpoint(simulation);
        const auto bytes = make_snapshot(simulation);
        file_->write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        file_->commit();
        is_written_ = true;
    }
    bool is_missing() const { return file_ && !is_written_; }

  private:
    std::optional<OutputFile> file_;
    std::int64_t step_ = 0;
    bool is_at_end_ = false, is_written_ = false;
};

/// Sees in which step an event happens.
class EventObserver final : public Run::Observer {
  public:
    EventObserver(const Run& run, const std::string& text) : happens_(run, text) {}
    void observe(const Run& run) noexcept override {
        if (time < 0 && happens_()) time = run.time();
    }
    double time = -1; ///< s; -1: not yet

  private:
    const Comparison happens_;
};

/// Writes the root inputs of a simulation from a file.
class Inputs {
  public:
    Inputs(Simulation& simulation, const std::string& file) : simulation_(simulation) {
        const Diagram& diagram = simulation.diagram();
        for (const auto& input : diagram.inputs) {
            const Slot& slot = diagram.slot(input.end);
            void* const data = simulation.context().data(input.end.node, input.end.slot);
            table_.push_back({input.path.c_str(), "", "", static_cast<generated::Type>(slot.type),
                              generated::Where::inputs, slot.size.rows, slot.size.cols,
                              reinterpret_cast<std::size_t>(data), -1});
        }
        if (const auto wrong = file_.read(file, {table_.data(), static_cast<int>(table_.size())});
            !wrong.empty())
            throw CommandError(wrong);
    }
    /// Before a step.
    void write() noexcept {
        file_.go_to(simulation_.time(), simulation_.diagram().step,
                    [](const generated::Quantity& q) { return reinterpret_cast<void*>(q.offset); });
    }

  private:
    const Simulation& simulation_;
    std::vector<generated::Quantity> table_; ///< their offset is their address
    generated::InputFile file_;
};

void restore(Simulation& simulation, const std::string& file) {
    const std::string bytes = read_text_file(file);
    simulation.start();
    restore_snapshot(simulation, std::as_bytes(std::span(bytes)), file);
    if (simulation.time() >= simulation.diagram().stop)
        throw CommandError("the snapshot '" + file + "' stands at " + number(simulation.time()) +
                           " s, where the run ends; give a later --stop, which counts from 0 s");
}

/// How many steps lie between checkpoints; 0: there are none.
std::int64_t steps_of_checkpoints(const RunOptions& options, double step) {
    if (!options.checkpoint_every) return 0;
    const double steps = *options.checkpoint_every / step;
    if (!(steps >= 1 - 1e-9))
        throw CommandError("--checkpoint-every " + number(*options.checkpoint_every) +
                           " s is shorter than the base period; give at least " + number(step) + " s");
    return std::llround(std::min(steps, most_steps));
}

void execute(const RunOptions& options) {
    ModelOptions model = options.model;
    if (!options.stop.empty()) model.sets.push_back("stop=" + options.stop);
    const LoadedModel loaded = load_model(model);
    FileSet read = files_of(loaded);
    read.insert({options.inputs, options.from_snapshot});
    read.insert(model.params.begin(), model.params.end());
    refuse_overwriting({{"--record", options.record},
                        {"--summary", options.summary},
                        {"--snapshot", options.snapshot},
                        {"--profile", options.profile}},
                       read);
    const Diagram& diagram = loaded.diagram;
    const std::int64_t every = steps_of_checkpoints(options, diagram.step);
    const bool is_endless = !std::isfinite(diagram.stop);
    if (is_endless && options.stop.empty() && !std::isfinite(options.realtime.duration))
        throw CommandError(diagram.name + " does not say when it ends: give --stop SECONDS (--stop Inf runs "
                                          "until Ctrl-C), or write 'stop: SECONDS' in the model");

    std::optional<OutputFile> summary, trace;
    if (!options.summary.empty()) summary.emplace(options.summary);
    if (!options.profile.empty()) trace.emplace(options.profile);
    Simulation simulation(diagram);
    std::optional<EventObserver> event;
    if (!options.until.empty()) simulation.add_observer(event.emplace(simulation, options.until));
    if (!options.from_snapshot.empty()) restore(simulation, options.from_snapshot);
    SnapshotFile snapshot(options, simulation);
    if (options.checkpoint_every)
        static_cast<void>(make_snapshot(simulation)); // refuses before the first step
    std::optional<Inputs> inputs;
    if (!options.inputs.empty()) inputs.emplace(simulation, options.inputs);
    const InterruptGuard guard; // from here on Ctrl-C leaves whole files
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(simulation, simulation.recorded(), options.record, loaded.source,
                         recording::WriterOptions{.drop_when_full = options.realtime.is_asked});
        if (!options.realtime.is_asked) simulation.add_observer(*recorder);
        if (!options.from_snapshot.empty()) recorder->checkpoint(simulation);
    }
    std::unique_ptr<ModelParameters> parameters;
    for (const auto& [option, where] : {std::pair("--ros1", options.ros1), {"--ros2", options.ros2}})
        if (!where.empty())
            parameters = serve_parameters(option, where, loaded, simulation, recorder ? &*recorder : nullptr);
    const auto before_step = [&] {
        if (inputs) inputs->write();
        if (parameters) parameters->apply();
    };
    std::optional<Profiler> profiler;
    if (options.is_profiled) profiler.emplace(simulation, trace ? trace_events : 0);

    RunResult result;
    StatusLine line;
    const auto goes_on = [&] { return !InterruptGuard::signal() && !(recorder && recorder->failed()); };
    if (options.realtime.is_asked) {
        std::string last;
        std::optional<SimulationEditing> editing;
        if (options.realtime.is_editable)
            editing.emplace(loaded, simulation, [&](Run& next) -> std::unique_ptr<Run::Observer> {
                return recorder ? recorder->continued(next) : nullptr;
            });
        result = run_realtime(
            simulation, options.realtime, editing ? &*editing : nullptr, recorder ? &*recorder : nullptr,
            inputs || parameters ? before_step : std::function<void()>(),
            [&](const std::string& progress) {
                last = progress;
                if (!options.model.is_quiet && line.is_due()) line.show(progress);
                return goes_on();
            },
            [&](const RunResult& stalled) {
                if (!summary) return;
                summary->write(to_text(stalled.to_json()));
                summary->commit();
            });
        if (!options.model.is_quiet) line.finish(last);
    } else {
        const Progress progress(simulation);
        RunHooks hooks;
        hooks.go_on = [&](double wall) {
            if (!options.model.is_quiet && wall > 1 && line.is_due()) line.show(progress.text(wall));
            return goes_on();
        };
        const auto save = [&](bool is_last) {
            if (every && !is_last && simulation.steps() > 0 && simulation.steps() % every == 0)
                recorder->checkpoint(simulation);
            snapshot.look(simulation, recorder ? &*recorder : nullptr, is_last);
        };
        const auto save_alone = [&](bool is_last) {
            parameters ? parameters->alone([&] { save(is_last); }) : save(is_last);
        };
        if (every || event || inputs || parameters || !options.snapshot.empty())
            hooks.between_steps = [&] {
                before_step();
                if (event && event->time >= 0) return false;
                save_alone(false);
                return true;
            };
        hooks.before_stop = [&] { save_alone(true); };
        hooks.is_started = !options.from_snapshot.empty();
        result = run(simulation, diagram.stop, hooks);
        if (!options.model.is_quiet) line.finish(progress.text(result.wall));
    }
    parameters.reset();
    result.is_interrupted = InterruptGuard::signal() != 0 && result.failure.empty();
    bool is_recording_lost = false;
    if (recorder) {
        try {
            recorder->close();
        } catch (const std::exception& error) {
            is_recording_lost = result.failure.empty();
            if (is_recording_lost) result.failure = error.what();
        }
    }
    auto json = result.to_json();
    if (event) {
        json["until"] = {{"event", options.until}, {"time_s", nullptr}};
        if (event->time >= 0) json["until"]["time_s"] = event->time;
    }
    if (profiler) json["profile"] = profile_json(*profiler);
    const std::string text = to_text(json);
    if (summary) {
        summary->write(text);
        summary->commit();
    }
    if (trace) write_trace(*profiler, *trace);
    if (options.as_json) {
        std::fputs(text.c_str(), stdout);
    } else {
        print(result);
        if (event && event->time >= 0)
            std::printf("  %s at t = %s s\n", options.until.c_str(), number(event->time).c_str());
        if (profiler) print_profile(*profiler, result.wall);
        if (recorder && !recorder->failed())
            std::printf("  recorded in %s; look at it with: bf plot %s\n", options.record.c_str(),
                        options.record.c_str());
    }
    std::fflush(stdout);
    const std::string stopped = diagram.name + " stopped at t = " + number(result.simulated) + " s: ";
    // How far the recording goes is another time than that of the run, which was ahead of the disk.
    if (is_recording_lost) throw CommandError(diagram.name + ": " + result.failure);
    if (!result.failure.empty()) throw CommandError(stopped + result.failure);
    if (result.is_interrupted) throw Interrupted(InterruptGuard::signal(), stopped + "interrupted");
    if (event && event->time < 0) throw CommandError(stopped + options.until + " did not happen");
    if (snapshot.is_missing())
        throw CommandError(stopped + "before the time of the snapshot, so none was written");
}

} // namespace

void add_run(CLI::App& app) {
    auto* command = app.add_subcommand("run", "simulate a model");
    auto options = std::make_shared<RunOptions>();
    options->model.add_to(*command);
    command->add_option("--stop", options->stop, "duration, s (an expression); Inf: until Ctrl-C")
        ->type_name("T");
    command
        ->add_option("--inputs", options->inputs,
                     "CSV file of the model's inputs: columns time, u, x[1], ...; a row holds until the next")
        ->type_name("FILE");
    auto* record = command
                       ->add_option("--record", options->record,
                                    "write the signals that the model records to this MCAP file")
                       ->type_name("FILE");
    command
        ->add_option("--summary", options->summary,
                     "write times, steps and the model's checks to this JSON file")
        ->type_name("FILE");
    options->realtime.add_to(*command);
    auto* realtime = command->get_option("--realtime");
    auto* editable = command->get_option("--editable"); // what these look at is replaced by an edit
    command->get_option("--inputs")->excludes(editable);
    command
        ->add_option("--ros1", options->ros1,
                     "show variables and parameters of the model as NAMESPACE/model/NAME at the master of "
                     "ROS 1")
        ->type_name("NAMESPACE")
        ->check(CLI::Validator([](std::string& name) { return wrong_namespace(name); }, ""))
        ->excludes(command->get_option("--serve"));
    command
        ->add_option(
            "--ros2", options->ros2,
            "show variables and parameters of the model as those of the node NAMESPACE/model of ROS 2")
        ->type_name("NAMESPACE")
        ->check(CLI::Validator([](std::string& name) { return wrong_namespace(name); }, ""))
        ->excludes(command->get_option("--serve"))
        ->excludes(command->get_option("--ros1"));
    auto* snapshot = command
                         ->add_option("--snapshot", options->snapshot,
                                      "write the state of the run at its end to this file")
                         ->type_name("FILE")
                         ->excludes(realtime);
    command->add_option("--snapshot-at", options->snapshot_at, "write it before the step at this time, s")
        ->type_name("T")
        ->check(within(stop_range))
        ->needs(snapshot);
    command->add_option("--from-snapshot", options->from_snapshot, "go on from such a file, bit for bit")
        ->type_name("FILE")
        ->excludes(realtime);
    command
        ->add_option("--checkpoint-every", options->checkpoint_every,
                     "put a snapshot into the recording every so many s, for bf replay --from")
        ->type_name("S")
        ->check(within(stop_range))
        ->needs(record)
        ->excludes(realtime);
    command
        ->add_option(
            "--until", options->until,
            "end with the step in which SIGNAL > NUMBER (or >= < <= == ~=); exit code 1 if it never is")
        ->type_name("EVENT")
        ->excludes(realtime);
    auto* profile =
        command
            ->add_option("--profile", options->profile,
                         "print the time per block and rate; also write this JSON file of trace events for "
                         "ui.perfetto.dev")
            ->type_name("[FILE]")
            ->expected(0, 1)
            ->excludes(editable);
    command->add_flag("--json", options->as_json, "print the summary as JSON");
    command->add_flag("--quiet,--headless", options->model.is_quiet, "show nothing while it runs");
    command->footer(
        "Examples:\n"
        "  bf run examples/icub_balancing/balancing.yaml\n"
        "  bf run examples/icub_balancing/balancing.yaml --set scenario=2 --stop 8 --record run.mcap\n"
        "  bf run examples/icub_balancing/balancing.yaml --stop 6 --snapshot standing.bin\n"
        "  bf run examples/icub_balancing/balancing.yaml --from-snapshot standing.bin --until 'world.com[3] "
        "< 0.4'\n"
        "  bf run docs/start/motor.yaml --realtime --serve\n"
        "Ctrl-C ends a run as its stop time does: recording and summary are complete, the exit code is 130.\n"
        "The exit code does not depend on the model's checks; look at them in the summary.");
    command->callback([options, profile] {
        options->is_profiled = profile->count() > 0;
        execute(*options);
    });
}

} // namespace bf::tools
