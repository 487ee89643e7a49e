#include "run_realtime.hpp"

#include "bf/realtime/server.hpp"
#include "bf/realtime/statistics_json.hpp"
#include "bf/realtime/token.hpp"
#include "bf/realtime/watchdog.hpp"
#include "session.hpp"
#include "terminal.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <thread>

namespace bf::tools {

namespace {

using namespace realtime;

nlohmann::ordered_json json_of(const LogEntry& entry) {
    return {{"clock_s", entry.clock}, {"time_s", entry.time}, {"who", entry.who}, {"what", entry.what}};
}

} // namespace

void RealtimeOptions::add_to(CLI::App& app) {
    auto* asked =
        app.add_flag("--realtime", is_asked, "step against the clock; see docs/how-to/real-time.md");
    const auto option = [&](const char* name, auto& value, const char* text, const char* type) {
        return app.add_option(name, value, text)->needs(asked)->type_name(type);
    };
    option("--realtime-factor", factor, "seconds of the model per second", "X")->check(between(1e-6, 1e6));
    option("--duration", duration, "end after this many seconds on the clock", "S")
        ->check(within(stop_range));
    option("--overrun", overrun,
           "what a missed deadline leads to: skip, catch-up, stop or degrade (skip by default)", "POLICY")
        ->check(CLI::IsMember(std::vector<std::string>(overrun_names.begin(), overrun_names.end()))
                    .description(""));
    option("--priority", priority, "of SCHED_FIFO, 1 to 99; 0: the ordinary scheduler (50 by default)", "P")
        ->check(within(priority_range));
    option("--cpu", cpu, "run the loop on this processor alone", "N")->check(within(processor_range));
    option("--watchdog", watchdog, "end the program when a step takes longer, s; 0: never (1 by default)",
           "S")
        ->check(within(watchdog_range));
    app.add_flag("--strict", is_strict, "fail when the machine refuses priority, processor or locked memory")
        ->needs(asked);
    option("--serve", serve,
           "serve live signals and parameters to viewers on this computer (bf edit --attach, Foxglove), at a "
           "port or at a Unix socket, unix:PATH; port 8765 by default",
           "[WHERE]")
        ->expected(0, 1)
        ->default_str("8765")
        ->check(CLI::Validator(check_place, ""));
    app.add_option("--token", token,
                   "the token that viewers must know is the line in this file, which is made if it is not "
                   "there (a random one for each run by default)")
        ->needs("--serve")
        ->type_name("FILE");
    auto* control = app.add_flag("--control", is_controlled,
                                 "let viewers change parameters, start and stop the run; without it they "
                                 "look alone")
                        ->needs("--serve");
    app.add_flag(
           "--editable", is_editable,
           "let edits of the model act in the run, between two steps; without it they change the file alone")
        ->needs(control);
    app.add_flag("--wait", waits, "open no device and make no step until a viewer starts the run")
        ->needs(control);
}

RunResult run_realtime(Run& run, const RealtimeOptions& options, SimulationEditing* editing,
                       Recorder* recorder, std::function<void()> before_step,
                       const std::function<bool(const std::string& progress)>& go_on,
                       const std::function<void(const RunResult&)>& on_stall) {
    const std::string name = run.name();
    const double period = run.period();
    RunnerOptions how;
    how.factor = options.factor;
    how.overrun = *overrun_of(options.overrun);
    how.thread.priority = options.priority;
    how.thread.cpu = options.cpu;
    how.is_strict = options.is_strict;
    how.duration = options.duration;
    how.watchdog = stall_limit(options.watchdog, realtime::nanoseconds(period / options.factor));
    const auto begin = std::chrono::steady_clock::now();
    const Nanoseconds patience = emergency_limit(realtime::nanoseconds(period / options.factor));
    const Control* control = nullptr;
    Server* serving = nullptr;
    how.on_stall = [&](std::int64_t step, const std::string& block) {
        RunResult stalled;
        stalled.model = name;
        stalled.simulated = static_cast<double>(step) * period;
        stalled.steps = step;
        stalled.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        stalled.failure = control->state() == Control::State::emergency
                              ? emergency_text(step, stalled.simulated, patience, block)
                              : stall_text(step, stalled.simulated, how.watchdog, block);
        std::fprintf(stderr, "bf: %s: %s\n", name.c_str(), stalled.failure.c_str());
        // The disk may be what hangs.
        std::promise<void> told;
        const auto is_told = told.get_future();
        std::thread([&] {
            try {
                if (serving) serving->end(stalled.failure, false);
                on_stall(stalled);
            } catch (const std::exception& error) {
                std::fprintf(stderr, "bf: %s\n", error.what());
            }
            told.set_value();
        }).detach();
        is_told.wait_for(std::chrono::seconds(2));
        std::_Exit(1);
    };
    how.before_step = std::move(before_step);
    how.waits = options.waits;
    Runner runner(run, how);
    control = &runner.access().control;
    if (recorder) runner.add_observer(*recorder);
    std::optional<Server> server;
    if (options.serve) {
        ServerOptions served{.where = *options.serve, .is_controlled = options.is_controlled};
        served.editing = editing;
        if (!options.token.empty())
            if (const auto wrong = read_token(options.token, served.token); !wrong.empty())
                throw CommandError(wrong);
        if (recorder) {
            served.on_change = [&](std::int64_t step, const std::vector<ParameterValue>& values,
                                   const std::string& who) {
                for (const auto& [path, elements] : values)
                    recorder->parameter_changed(step, path, elements, who);
            };
            served.on_control = [&](const LogEntry& entry) {
                recorder->controlled(entry.time, entry.clock, entry.who, entry.what);
            };
            served.on_edit = [&](std::int64_t step, const LogEntry& entry) {
                recorder->edited(step, entry.who, entry.what, editing->prepared());
            };
        }
        server.emplace(run, run.signals(), runner.access(), served);
        runner.add_observer(*server);
        serving = &*server;
        std::fprintf(stderr, "  live at %s%s\n", server->address().c_str(),
                     options.token.empty() ? server->token().c_str()
                                           : ("..., the line in " + options.token).c_str());
    }
    bool has_warned = false;
    const auto warn = [&] {
        if (std::exchange(has_warned, true) || runner.refused().empty()) return;
        std::fprintf(stderr, "bf: warning: the period is not guaranteed on this machine (see bf doctor)\n");
        for (const auto& refusal : runner.refused()) std::fprintf(stderr, "  %s\n", refusal.c_str());
    };
    try {
        runner.run(run.stop_time(), [&](const Runner::Progress& progress) {
            if (progress.steps > 0) warn();
            if (control->state() == Control::State::waiting) return go_on("  waits to be started");
            return go_on("  t = " + number(static_cast<double>(progress.steps) * period) + " s, " +
                         std::to_string(progress.steps) + " steps, " + std::to_string(progress.missed) +
                         " deadlines missed");
        });
    } catch (const std::exception& error) {
        if (!without_interruption(error.what()).empty()) { // else its start was waiting
            if (server) server->end(error.what(), false);
            throw;
        }
    }
    warn();

    RunResult result;
    result.model = name;
    result.wall = runner.wall();
    result.simulated = runner.stepped().time();
    result.steps = runner.stepped().steps();
    result.failure = without_interruption(runner.failure());
    if (server)
        server->end(result.failure.empty() && recorder ? recorder->status() : result.failure,
                    InterruptGuard::signal() != 0);
    result.checks = runner.stepped().checks();
    result.report = report(runner.statistics());
    result.realtime = statistics_json(runner.statistics());
    result.realtime["first_misses"] = first_misses_json(runner.statistics());
    result.realtime["overrun"] = options.overrun;
    result.realtime["refused"] = runner.refused();
    const auto lost = [&](const char* key, std::uint64_t count, const char* text) {
        result.realtime[key] = count;
        if (count > 0) result.report += "  " + std::to_string(count) + " " + text + "\n";
    };
    if (recorder)
        lost("lost_samples_recorded", recorder->dropped(), "samples not recorded: the disk was too slow");
    if (server) {
        const auto counts = server->counts();
        lost("lost_samples_served", counts.lost_samples, "samples not served: the server was too slow");
        lost("lost_messages_served", counts.lost_messages, "messages not served: a viewer was too slow");
        lost("parameter_changes", counts.changes, "changes of parameters");
        lost("edits", counts.edits, "edits of the model");
        const auto log = server->log();
        auto& list = result.realtime["log"] = nlohmann::ordered_json::array();
        for (const auto& entry : log) list.push_back(json_of(entry));
        result.report += log_text(log);
        if (const LogEntry* const stop = stop_in(log)) result.stopped_by = stop->who;
        if (result.failure.empty()) result.failure = emergency_in(log);
    }
    return result;
}

} // namespace bf::tools
