// A step uses no heap.
#include "heap.hpp"
#include "support.hpp"

#include "bf/run/recorder.hpp"

#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf::test {
namespace {

TEST(Heap, CallsAreCounted) {
    if (!heap_is_counted()) GTEST_SKIP() << "not counted here";
    const long before = heap_calls();
    auto* volatile number = new int(1);
    delete number;
    EXPECT_EQ(heap_calls() - before, 2);
}

TEST(Heap, IsNotUsedInAStepNorByARecorder) {
    Session run(R"m(
model: m
step: 0.125
blocks:
  on: {block: Pulse}
  v: {block: Constant, value: "ones(23, 1)"}
  a: {block: Sum}
  x: {block: UnitDelay}
  slow: {block: Delay, steps: 3, period: 0.625}
  sine: {block: Sine}
  s:
    execution: enabled
    states: reset
    inputs: [u]
    outputs: {y: {when_disabled: reset}}
    blocks: {i: {block: DiscreteIntegrator}}
    connections: {u: i, i: y}
connections: {on: s.enable, v: a.u1, x: [a.u2, slow], a: x, sine: s.u}
record: all
)m");
    const auto file =
        std::filesystem::path(testing::TempDir()) / ("heap_" + std::to_string(getpid()) + ".mcap");
    Recorder recorder(*run.simulation, run.simulation->quantities(run.diagram.record), file);
    run.simulation->add_observer(recorder);
    ASSERT_TRUE(run.simulation->step());
    const long before = heap_calls();
    for (int k = 0; k < 1000; ++k) ASSERT_TRUE(run.simulation->step());
    EXPECT_EQ(heap_calls() - before, 0);
    recorder.close();
}

TEST(Heap, IsNotUsedWhenARunTakesThePlaceOfAnother) {
    Session run(multirate), other(multirate);
    run.simulation->run_until(0.7);
    Simulation next(other.diagram, *run.simulation);
    next.start();
    run.simulation->run_until(1.1);
    const long before = heap_calls();
    next.take_over();
    for (int k = 0; k < 10; ++k) ASSERT_TRUE(next.step());
    EXPECT_EQ(heap_calls() - before, 0);
    EXPECT_EQ(next.steps(), 21);
}

} // namespace
} // namespace bf::test
