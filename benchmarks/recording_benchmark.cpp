#include "bf/recording/writer.hpp"

#include <array>
#include <benchmark/benchmark.h>
#include <cstring>
#include <filesystem>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

using namespace bf::recording;
using Sample = std::array<double, 23>;

/// What recording a vector of 23 doubles costs the thread that simulates. The pauses let the background
/// thread keep up, as it does in a run that also computes something; without them the disk's speed is
/// measured.
void record_23_vector(benchmark::State& state, bool pauses) {
    const auto path =
        std::filesystem::temp_directory_path() / ("bf_benchmark_" + std::to_string(::getpid()) + ".mcap");
    {
        Writer writer(path);
        const ChannelId channel = writer.add_channel("tau", {.rows = 23});
        writer.begin();
        Sample sample{};
        std::int64_t time = 0;
        for (auto _ : state) {
            sample[0] = static_cast<double>(time);
            benchmark::DoNotOptimize(sample);
            writer.append(channel, time, sample.data());
            if (++time % 10'000 == 0 && pauses) { // 2 MB of a buffer of 8 MB
                state.PauseTiming();
                ::usleep(50'000);
                state.ResumeTiming();
            }
        }
        state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(sizeof sample));
    }
    std::filesystem::remove(path);
}
BENCHMARK_CAPTURE(record_23_vector, at_ease, true)->Iterations(200'000);
BENCHMARK_CAPTURE(record_23_vector, as_fast_as_the_disk, false)->Iterations(1'000'000)->UseRealTime();

/// The floor: the same 184 bytes, copied one after the other into memory of the size of the writer's buffer.
void copy_23_vector(benchmark::State& state) {
    std::vector<std::byte> memory(std::size_t{8} << 20);
    std::size_t at = 0;
    Sample sample{};
    for (auto _ : state) {
        sample[0] = static_cast<double>(at);
        benchmark::DoNotOptimize(sample);
        std::memcpy(&memory[at], sample.data(), sizeof sample);
        benchmark::ClobberMemory();
        at = at + 2 * sizeof sample > memory.size() ? 0 : at + sizeof sample;
    }
}
BENCHMARK(copy_23_vector)->Iterations(1'000'000);

} // namespace
