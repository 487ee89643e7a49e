// What our loop adds, per period, to the machine's own wake-up latency, and that latency beside
// cyclictest's: 99.99th percentiles over 20,000 periods of the balancing iCub, controlled at 1 kHz, recorded
// as its model says, with a server of live signals.
#include "session.hpp"

#include "bf/engine/simulation.hpp"
#include "bf/realtime/server.hpp"
#include "bf/run/recorder.hpp"

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

/// Of this thread: what a hypervisor or another program takes away is not the loop's.
Nanoseconds processor_time() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

/// The time when the observers registered before it were done.
class Stamp final : public bf::Run::Observer {
  public:
    void observe(const bf::Run&) noexcept override { time = processor_time(); }
    Nanoseconds time = 0;
};

class Since final : public bf::Run::Observer {
  public:
    explicit Since(const Stamp& begin) : begin_(begin) {}
    void observe(const bf::Run&) noexcept override { histogram.add(processor_time() - begin_.time); }
    Histogram histogram;

  private:
    const Stamp& begin_;
};

struct Percentiles {
    Nanoseconds overhead, latency;
};

Percentiles with_runner() {
    bf::tools::ModelOptions model;
    model.file = BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml";
    model.sets = {"T_control=0.001", "scenario=1"};
    const auto loaded = bf::tools::load_model(model);
    const auto& diagram = loaded.diagram;
    const auto file =
        std::filesystem::temp_directory_path() / ("bf_rt_" + std::to_string(getpid()) + ".mcap");
    bf::Simulation simulation(diagram);
    bf::Recorder recorder(simulation, simulation.recorded(), file, {}, {.drop_when_full = true});
    RunnerOptions options;
    options.thread.priority = 50; // as cyclictest; where it is refused, both are ordinary threads
    Runner runner(simulation, options);
    Server server(simulation, simulation.signals(), runner.access(), {.where = "0"});
    Stamp begin;
    Since observers(begin);
    runner.add_observer(begin);
    runner.add_observer(recorder);
    runner.add_observer(server);
    runner.add_observer(observers);
    runner.run(periods * 0.001, [](const auto&) { return true; });
    recorder.close();
    std::filesystem::remove(file);
    if (const auto failure = runner.failure(); !failure.empty()) throw std::runtime_error(failure);
    return {observers.histogram.percentile(0.9999), runner.statistics().latency.percentile(0.9999)};
}

void runner(benchmark::State& state, Nanoseconds Percentiles::*which) {
    static const Percentiles measured = with_runner();
    for (auto _ : state) report_time(state, measured.*which);
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

/// It takes 20 s and names its own time.
void once(benchmark::internal::Benchmark* measurement) {
    measurement->UseManualTime()->Iterations(1)->Repetitions(1)->Unit(benchmark::kMicrosecond);
}

} // namespace

BENCHMARK_CAPTURE(runner, overhead, &Percentiles::overhead)->Name("realtime.overhead_p9999")->Apply(once);
BENCHMARK_CAPTURE(runner, latency, &Percentiles::latency)->Name("realtime.latency_p9999")->Apply(once);
BENCHMARK(cyclictest)->Name("realtime.latency_p9999/cyclictest")->Apply(once);
