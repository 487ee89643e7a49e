// Snapshots of the balancing iCub beside a copy of the same bytes, and what recording and profiling add to a
// run.
#include "bf/run/profile.hpp"
#include "bf/run/recorder.hpp"
#include "run.hpp"
#include "session.hpp"

#include <benchmark/benchmark.h>

#include <cstring>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

constexpr double simulated = 20.0; // s

const bf::LoadedModel& balancing() {
    static const bf::LoadedModel loaded = [] {
        bf::tools::ModelOptions options;
        options.file = BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml";
        return bf::tools::load_model(options);
    }();
    return loaded;
}

/// A simulation in the middle of a motion.
bf::Simulation& standing() {
    static bf::Simulation simulation(balancing().diagram);
    if (simulation.steps() == 0) {
        simulation.start();
        if (!simulation.run_until(0.5)) throw std::runtime_error(simulation.failure());
    }
    return simulation;
}

void snapshot(benchmark::State& state) {
    const auto& simulation = standing();
    for (auto _ : state) benchmark::DoNotOptimize(simulation.snapshot());
    state.counters["bytes"] = static_cast<double>(simulation.snapshot().size());
}

void restore(benchmark::State& state) {
    auto& simulation = standing();
    const auto bytes = simulation.snapshot();
    for (auto _ : state) simulation.restore(bytes);
}

void copy_of_the_same_bytes(benchmark::State& state) {
    const auto bytes = standing().snapshot();
    for (auto _ : state) benchmark::DoNotOptimize(std::vector<std::byte>(bytes));
}

enum class What { nothing, recording, profile };

void run(benchmark::State& state, What what) {
    const auto& diagram = balancing().diagram;
    const auto file =
        std::filesystem::temp_directory_path() / ("bf_runs_" + std::to_string(::getpid()) + ".mcap");
    ::sync(); // what a build or another measurement has left for the disk
    for (auto _ : state) {
        bf::Simulation simulation(diagram);
        std::optional<bf::Recorder> recorder;
        std::optional<bf::Profiler> profiler;
        if (what == What::recording)
            simulation.add_observer(recorder.emplace(simulation, simulation.signals(), file));
        if (what == What::profile) profiler.emplace(simulation);
        const auto result = bf::tools::run(simulation, simulated);
        if (!result.failure.empty()) throw std::runtime_error(result.failure);
        if (!recorder) continue;
        recorder->close();
        state.PauseTiming(); // to discard as much again takes time, too
        state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(file));
        std::filesystem::remove(file);
        state.ResumeTiming();
    }
}

const int registered = [] {
    using benchmark::RegisterBenchmark;
    RegisterBenchmark("snapshot.icub", snapshot);
    RegisterBenchmark("restore.icub", restore);
    RegisterBenchmark("snapshot.icub/memcpy", copy_of_the_same_bytes);
    // The time of all threads: the one that writes the file too.
    for (const auto& [name, what] : {std::pair{"record.overhead/all_signals", What::recording},
                                     {"record.overhead/no_recording", What::nothing},
                                     {"profile.overhead/profiled", What::profile}})
        RegisterBenchmark(name, run, what)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
    return 0;
}();

} // namespace
