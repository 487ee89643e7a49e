// Cost of a block and step, and of elaboration, beside the same arithmetic written by hand.
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/model/builder.hpp"

#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using bf::model::Builder;
using bf::model::End;
using bf::model::Model;

/// `pairs` times (Gain, Sum with a constant) in a row, then `delays` unit delays back to the begin.
Model chain(int pairs, int delays, const char* constant) {
    Builder b{"chain"};
    b.step(0.001);
    b.add("one", "Constant", {{"value", constant}});
    End last{"d" + std::to_string(delays - 1)};
    for (int i = 0; i < pairs; ++i) {
        const End gain = b.add("g" + std::to_string(i), "Gain", {{"K", 0.999}});
        const End sum = b.add("s" + std::to_string(i), "Sum");
        b.connect(last, gain);
        b.connect(gain, sum["u1"]);
        b.connect({"one"}, sum["u2"]);
        last = sum;
    }
    for (int i = 0; i < delays; ++i) {
        const End delay = b.add("d" + std::to_string(i), "UnitDelay");
        b.connect(last, delay);
        last = delay;
    }
    return b.build();
}

void count_blocks(benchmark::State& state, int blocks) {
    state.SetItemsProcessed(state.iterations() * blocks);
}

void diagram_steps(benchmark::State& state, const char* constant) {
    bf::Registry registry;
    registry.add(bf::standard_library());
    const auto diagram = bf::elaborate(chain(500, 10, constant), registry);
    bf::Simulation simulation(diagram);
    simulation.start();
    for (auto _ : state)
        if (!simulation.step()) throw std::runtime_error(simulation.failure());
    count_blocks(state, 1010);
}

struct HandBlock {
    virtual ~HandBlock() = default;
    virtual void output() {}
    virtual void update() {}
};
struct HandGain final : HandBlock {
    const double* u = nullptr;
    double k = 0.999, y = 0;
    void output() override { y = k * *u; }
};
struct HandSum final : HandBlock {
    const double *u1 = nullptr, *u2 = nullptr;
    double y = 0;
    void output() override { y = *u1 + *u2; }
};
struct HandDelay final : HandBlock {
    const double* u = nullptr;
    double x = 0, next = 0, y = 0;
    void output() override { y = x; }
    void update() override { next = *u; }
};

void hand_virtual(benchmark::State& state) {
    const double one = 1;
    std::vector<std::unique_ptr<HandBlock>> blocks;
    std::vector<HandDelay*> delays;
    for (int i = 0; i < 10; ++i) {
        auto delay = std::make_unique<HandDelay>();
        if (i > 0) delay->u = &delays.back()->y;
        delays.push_back(delay.get());
        blocks.push_back(std::move(delay));
    }
    const double* last = &delays.back()->y;
    for (int i = 0; i < 500; ++i) {
        auto gain = std::make_unique<HandGain>();
        gain->u = last;
        auto sum = std::make_unique<HandSum>();
        sum->u1 = &gain->y;
        sum->u2 = &one;
        last = &sum->y;
        blocks.push_back(std::move(gain));
        blocks.push_back(std::move(sum));
    }
    delays.front()->u = last;
    for (auto _ : state) {
        for (auto& block : blocks) block->output();
        for (auto& block : blocks) block->update();
        for (auto* delay : delays) delay->x = delay->next;
        benchmark::ClobberMemory();
    }
    count_blocks(state, 1010);
}

void hand_loop(benchmark::State& state) {
    std::array<double, 10> x{};
    std::array<double, 500> gains{}, sums{};
    for (auto _ : state) {
        double last = x[9];
        for (std::size_t i = 0; i < 500; ++i) {
            gains[i] = 0.999 * last;
            last = sums[i] = gains[i] + 1;
        }
        for (std::size_t i = 9; i > 0; --i) x[i] = x[i - 1];
        x[0] = last;
        benchmark::DoNotOptimize(gains.data());
        benchmark::DoNotOptimize(sums.data());
        benchmark::ClobberMemory();
    }
    count_blocks(state, 1010);
}

void hand_vector_loop(benchmark::State& state) {
    using Row = std::array<double, 23>;
    Row one;
    one.fill(1);
    std::array<Row, 10> x{};
    std::vector<Row> gains(500), sums(500);
    for (auto _ : state) {
        const Row* last = &x[9];
        for (std::size_t i = 0; i < 500; ++i) {
            for (std::size_t j = 0; j < 23; ++j) gains[i][j] = 0.999 * (*last)[j];
            for (std::size_t j = 0; j < 23; ++j) sums[i][j] = gains[i][j] + one[j];
            last = &sums[i];
        }
        for (std::size_t i = 9; i > 0; --i) x[i] = x[i - 1];
        x[0] = *last;
        benchmark::ClobberMemory();
    }
    count_blocks(state, 1010);
}

/// From the document to the first step.
void elaboration(benchmark::State& state, int blocks) {
    const Model model = chain(blocks / 2, 1, "1");
    for (auto _ : state) {
        bf::Registry registry;
        registry.add(bf::standard_library());
        const auto diagram = bf::elaborate(model, registry);
        bf::Simulation simulation(diagram);
        simulation.start();
        if (!simulation.step()) throw std::runtime_error(simulation.failure());
    }
}

const int registered = [] {
    using benchmark::RegisterBenchmark;
    RegisterBenchmark("engine.scalar_block", diagram_steps, "1");
    RegisterBenchmark("engine.scalar_block/hand_virtual", hand_virtual);
    RegisterBenchmark("engine.scalar_block/hand_loop", hand_loop);
    RegisterBenchmark("engine.vector23_block", diagram_steps, "ones(23, 1)");
    RegisterBenchmark("engine.vector23_block/hand_loop", hand_vector_loop);
    RegisterBenchmark("elaborate.1000_blocks", elaboration, 1000)->Unit(benchmark::kMillisecond);
    for (const int blocks : {1000, 10000, 100000})
        RegisterBenchmark(("elaborate.blocks/" + std::to_string(blocks)).c_str(), elaboration, blocks)
            ->Iterations(100'000 / blocks)
            ->Unit(benchmark::kMillisecond);
    return 0;
}();

} // namespace
