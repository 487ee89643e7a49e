// bf replay: runs a recorded simulation again and compares it bit for bit.
#include "bf/run/replay.hpp"

#include "bf/engine/play_back.hpp"
#include "bf/engine/simulation.hpp"
#include "files.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

namespace bf::tools {

namespace {

struct ReplayOptions {
    std::string recording, output;
    std::optional<double> from, until;
};

/// The signals that the recording holds, for a recording of the replay.
std::vector<Quantity> signals_of(const Simulation& simulation, const recording::Recording& recording) {
    std::vector<SignalName> signals;
    const SignalFinder finder(simulation.diagram());
    for (const auto& channel : recording.channels)
        if (const auto end = finder.find(channel.name); end.node >= 0) signals.push_back({channel.name, end});
    return simulation.quantities(signals);
}

std::string sentence(const Replay& replay) {
    std::string text =
        std::to_string(replay.signals()) + " signals, " + std::to_string(replay.samples()) + " samples";
    if (replay.played_back() > 0)
        text += "; " + std::to_string(replay.played_back()) +
                " signals from outside were taken from the recording";
    if (replay.missing() > 0)
        text += "; " + std::to_string(replay.missing()) + " samples are not in the recording";
    return text;
}

void execute(const ReplayOptions& options) {
    const auto recording = load_recording(options.recording);
    LoadedModel loaded = load_model(recorded_source(recording));
    play_back_devices(loaded.diagram, recording);
    Simulation simulation(loaded.diagram);
    Replay replay(simulation, recording);
    std::optional<Recorder> recorder;
    if (!options.output.empty()) {
        FileSet read = files_of(loaded);
        read.insert(options.recording);
        refuse_overwriting({{"-o", options.output}}, read);
        recorder.emplace(simulation, signals_of(simulation, recording), options.output, loaded.source);
        simulation.add_observer(*recorder);
        replay.record(*recorder);
    }

    const InterruptGuard guard;
    StatusLine line;
    const double until = std::min(options.until.value_or(INFINITY), replay.end());
    replay.start(options.from.value_or(0));
    const double begin = simulation.time(), last = until + loaded.diagram.step / 2;
    if (recorder && simulation.steps() > 0) recorder->checkpoint(simulation);
    const auto started = std::chrono::steady_clock::now();
    for (std::int64_t k = 0; simulation.time() < last && !InterruptGuard::signal() && replay.step(); ++k) {
        if (k % 16 != 0) continue;
        const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - started;
        if (wall.count() > 1 && line.is_due())
            line.show("  t = " + number(simulation.time()) + " / " + number(until) + " s");
    }
    const std::string failure = without_interruption(simulation.failure());
    const double end = simulation.time();
    simulation.stop();
    if (recorder) recorder->close();
    if (!replay.difference().empty())
        throw CommandError(options.recording + " and its replay differ: " + replay.difference() + " (" +
                           sentence(replay) + " before it are identical)");
    if (InterruptGuard::signal())
        throw Interrupted(InterruptGuard::signal(), "interrupted at t = " + number(end) +
                                                        " s; until then identical: " + sentence(replay));
    std::printf("identical: %s, from %s s to %s s\n", sentence(replay).c_str(), number(begin).c_str(),
                number(std::min(end, until)).c_str());
    if (const auto edited = replay.edited(); edited && until == replay.end())
        std::printf(
            "  the model was edited while it ran, at %s s: what the recording has from there on was not "
            "compared\n",
            number(*edited).c_str());
    if (!failure.empty()) std::printf("  and it fails as the recorded run did: %s\n", failure.c_str());
}

} // namespace

void add_replay(CLI::App& app) {
    auto* command = app.add_subcommand("replay", "run a recording again and compare it bit for bit");
    auto options = std::make_shared<ReplayOptions>();
    command->add_option("RECORDING", options->recording, "MCAP file that bf run wrote")
        ->required()
        ->type_name("");
    command->add_option("--from", options->from, "begin with the last checkpoint not after this time, s")
        ->type_name("T")
        ->check(within(stop_range));
    command->add_option("--until", options->until, "compare until this time, s; otherwise to the end")
        ->type_name("T")
        ->check(within(stop_range));
    command->add_option("-o,--output", options->output, "record the replay in this MCAP file")
        ->type_name("NEW");
    command->footer(
        "The model is taken from the recording, so the model's files need not be there any more.\n"
        "Exit code 0: every recorded sample came again; 1: one differed, and the first is named.\n"
        "Examples:\n"
        "  bf run examples/icub_balancing/balancing.yaml --record run.mcap --checkpoint-every 5\n"
        "  bf replay run.mcap --from 12");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
