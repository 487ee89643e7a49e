// The paper's API: reading a signal element by element, and what hosting adds to a block's step.
#include "BlockFactory/Core/BlockInformation.h"
#include "BlockFactory/Core/Signal.h"
#include "bf/boundary/hosted_block.hpp"
#include "bf/core/context.hpp"
#include "bf/core/registry.hpp"
#include "bf/core/resolve.hpp"

#include <benchmark/benchmark.h>

namespace {

using namespace bf;

/// Nothing but the array beneath the signal.
void read_23_bare(benchmark::State& state) {
    double memory[23] = {};
    for (auto _ : state) {
        benchmark::DoNotOptimize(memory);
        double sum = 0;
        for (std::size_t i = 0; i < 23; ++i) sum += memory[i];
        benchmark::DoNotOptimize(sum);
    }
}

void read_23(benchmark::State& state) {
    double memory[23] = {};
    blockfactory::core::Signal signal;
    signal.initializeBufferFromContiguousZeroCopy(memory, 23);
    for (auto _ : state) {
        benchmark::DoNotOptimize(memory);
        benchmark::DoNotOptimize(signal);
        double sum = 0;
        for (std::size_t i = 0; i < signal.getWidth(); ++i) sum += signal.get<double>(i);
        benchmark::DoNotOptimize(sum);
    }
}

/// One block that copies a scalar, of this plugin or another; items are steps.
void step(benchmark::State& state, const char* name) {
    Registry registry;
    registry.add_search_path(BF_TEST_PLUGINS);
    const BlockClass& block_class = registry.find(name);
    const auto block = block_class.make({});
    auto& d = block->declaration();
    propagate(*block);
    Context context({{block.get(), block_class.methods, {}, {}, 0}});
    if (!context.initialize(0)) state.SkipWithError("reset failed");
    context.start(0);
    std::vector<Task> tasks;
    for (const Phase phase : {Phase::output, Phase::update})
        for (int i = 0; i < context.activities(0, phase); ++i) tasks.push_back(context.task(0, phase, i));
    const auto* y = static_cast<const double*>(context.data(0, d.find("y1")));
    for (auto _ : state) {
        for (const Task& task : tasks)
            if (!task()) state.SkipWithError("a step failed");
        benchmark::DoNotOptimize(*y);
    }
    context.stop(0);
}

BENCHMARK(read_23)->Name("boundary.read_23");
BENCHMARK(read_23_bare)->Name("boundary.read_23/bare");
BENCHMARK_CAPTURE(step, hosted, "LegacyPlugin/Nothing")->Name("boundary.hosting");
BENCHMARK_CAPTURE(step, native, "NativePlugin/Nothing")->Name("boundary.hosting/native");

} // namespace
