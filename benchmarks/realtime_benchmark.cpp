// What our loop adds, per period, to the machine's own wake-up latency: 99.99th percentiles over 20,000
// periods of the balancing iCub, controlled at 1 kHz, with all that is not its blocks: pacing, recording,
// live signals.
#include "session.hpp"

#include "bf/engine/recorder.hpp"
#include "bf/realtime/server.hpp"

#include <benchmark/benchmark.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <unistd.h>

namespace {

using namespace bf::realtime;

constexpr int periods = 20'000;

void report_time(benchmark::State& state, Nanoseconds time) {
    state.SetIterationTime(static_cast<double>(time) / 1e9);
    state.SetItemsProcessed(1);
}

/// The time when the observers registered before it were done.
class Stamp final : public bf::Simulation::Observer {
  public:
    void observe(const bf::Simulation&) noexcept override { time = now(); }
    Nanoseconds time = 0;
};

class Since final : public bf::Simulation::Observer {
  public:
    explicit Since(const Stamp& begin) : begin_(begin) {}
    void observe(const bf::Simulation&) noexcept override { histogram.add(now() - begin_.time); }
    Histogram histogram;

  private:
    const Stamp& begin_;
};

void with_runner(benchmark::State& state) {
    bf::tools::ModelOptions model;
    model.file = BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml";
    model.sets = {"T_control=0.001", "scenario=1"};
    const auto loaded = bf::tools::load_model(model);
    const auto& diagram = loaded.diagram;
    const auto file =
        std::filesystem::temp_directory_path() / ("bf_rt_" + std::to_string(getpid()) + ".mcap");
    for (auto _ : state) {
        bf::Simulation simulation(diagram);
        bf::Recorder recorder(simulation, diagram.signals(), file, {}, {.drop_when_full = true});
        RunnerOptions options;
        options.thread.priority = 50; // as cyclictest; where it is refused, both are ordinary threads
        Runner runner(simulation, options);
        Server server(simulation, diagram.signals(), runner.parameters(), {.port = 0});
        Stamp begin;
        Since observers(begin);
        runner.add_observer(begin);
        runner.add_observer(recorder);
        runner.add_observer(server);
        runner.add_observer(observers);
        runner.run(periods * 0.001, [](const auto&) { return true; });
        recorder.close();
        if (const auto failure = runner.failure(); !failure.empty()) throw std::runtime_error(failure);
        report_time(state,
                    runner.statistics().latency.percentile(0.9999) + observers.histogram.percentile(0.9999));
    }
    std::filesystem::remove(file);
}

/// From the histogram that cyclictest prints, lines "latency in us, count".
void cyclictest(benchmark::State& state) {
    for (auto _ : state) {
        std::FILE* pipe = popen("cyclictest -q -m -p50 -i1000 -l20000 -h20000", "r");
        char line[200];
        long latency = 0, count = 0, seen = 0, result = 0;
        while (pipe && std::fgets(line, sizeof line, pipe))
            if (std::sscanf(line, "%ld %ld", &latency, &count) == 2 && (seen += count) <= periods * 0.9999)
                result = latency + 1;
        if (!pipe || pclose(pipe) != 0 || seen == 0) state.SkipWithError("cyclictest failed");
        report_time(state, result * 1000);
    }
}

} // namespace

BENCHMARK(with_runner)
    ->Name("realtime.overhead_p9999")
    ->UseManualTime()
    ->Iterations(1)
    ->Repetitions(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(cyclictest)
    ->Name("realtime.overhead_p9999/cyclictest")
    ->UseManualTime()
    ->Iterations(1)
    ->Repetitions(1)
    ->Unit(benchmark::kMicrosecond);
