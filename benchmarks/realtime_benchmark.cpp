// What our loop adds, per period, to the machine's own wake-up latency: 99.99th percentiles over 10,000
// periods of 1 ms, from a release to the end of a small model's step, all observers included, beside a loop
// that only sleeps.
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/recorder.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/realtime/server.hpp"

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <unistd.h>

namespace {

using namespace bf::realtime;

constexpr int periods = 10'000;
constexpr Nanoseconds period = 1'000'000;
// As `cyclictest -m -p50`; where that is refused, all of them run as ordinary threads.
constexpr ThreadOptions thread_options{.priority = 50};

void report_time(benchmark::State& state, Nanoseconds time) {
    state.SetIterationTime(static_cast<double>(time) / 1e9);
    state.SetItemsProcessed(1);
}

void with_runner(benchmark::State& state) {
    bf::Registry registry;
    registry.add(bf::standard_library());
    const auto diagram = bf::elaborate(bf::formats::read_yaml_text(R"m(
model: small
step: 0.001
blocks:
  reference: {block: Sine, amplitude: "ones(23, 1)", frequency: 2}
  error: {block: Sum, signs: +-}
  control: {block: Gain, K: 0.3}
  plant: {block: DiscreteIntegrator}
connections: {reference: error.u1, plant: error.u2, error: control, control: plant}
)m",
                                                                   "small.yaml"),
                                       registry);
    const auto file =
        std::filesystem::temp_directory_path() / ("bf_rt_" + std::to_string(getpid()) + ".mcap");
    for (auto _ : state) {
        bf::Simulation simulation(diagram);
        bf::Recorder recorder(simulation, diagram.signals(), file, {}, {.drop_when_full = true});
        RunnerOptions options;
        options.thread = thread_options;
        Runner runner(simulation, options);
        Server server(simulation, diagram.signals(), runner.parameters(), {.port = 0});
        runner.add_observer(recorder);
        runner.add_observer(server);
        runner.run(periods * 0.001, [](const auto&) { return true; });
        recorder.close();
        report_time(state, runner.statistics().response.percentile(0.9999));
    }
    std::filesystem::remove(file);
}

void bare(benchmark::State& state) {
    for (auto _ : state) {
        Histogram latency;
        std::thread([&] {
            prepare_thread(thread_options);
            for (Nanoseconds release = now() + period, k = 0; k < periods; ++k, release += period) {
                sleep_until(release);
                latency.add(now() - release);
            }
        }).join();
        report_time(state, latency.percentile(0.9999));
    }
}

/// From the histogram that cyclictest prints, lines "latency in us, count".
void cyclictest(benchmark::State& state) {
    for (auto _ : state) {
        std::FILE* pipe = popen("cyclictest -q -m -p50 -i1000 -l10000 -h20000", "r");
        char line[200];
        long latency = 0, count = 0, seen = 0, result = 0;
        while (pipe && std::fgets(line, sizeof line, pipe))
            if (std::sscanf(line, "%ld %ld", &latency, &count) == 2 && (seen += count) <= periods * 0.9999)
                result = latency + 1;
        if (!pipe || pclose(pipe) != 0 || seen == 0) state.SkipWithError("cyclictest failed");
        report_time(state, result * 1000);
    }
}

benchmark::internal::Benchmark* once(benchmark::internal::Benchmark* b) {
    return b->UseManualTime()->Iterations(1)->Repetitions(3)->Unit(benchmark::kMicrosecond);
}
const auto* const registered = [] {
    once(benchmark::RegisterBenchmark("realtime.overhead_p9999", with_runner));
    once(benchmark::RegisterBenchmark("realtime.overhead_p9999/bare_clock_nanosleep", bare));
    if (std::system("command -v cyclictest >/dev/null") == 0)
        once(benchmark::RegisterBenchmark("realtime.overhead_p9999/cyclictest", cyclictest));
    return "";
}();

} // namespace
