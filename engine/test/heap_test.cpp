// Interposes the C library's heap to count calls: a step must make none.
#include "support.hpp"

#include "bf/run/recorder.hpp"

#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
namespace {
thread_local long calls = 0;
}

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void __libc_free(void*);
void* malloc(std::size_t size) { return ++calls, __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) { return ++calls, __libc_calloc(count, size); }
void* realloc(void* pointer, std::size_t size) { return ++calls, __libc_realloc(pointer, size); }
void free(void* pointer) { return ++calls, __libc_free(pointer); }
}

namespace bf::test {
namespace {

TEST(Heap, CallsAreCounted) {
    const long before = calls;
    auto* volatile number = new int(1);
    delete number;
    EXPECT_EQ(calls - before, 2);
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
    const long before = calls;
    for (int k = 0; k < 1000; ++k) ASSERT_TRUE(run.simulation->step());
    EXPECT_EQ(calls - before, 0);
    recorder.close();
}

TEST(Heap, IsNotUsedWhenARunTakesThePlaceOfAnother) {
    Session run(multirate), other(multirate);
    run.simulation->run_until(0.7);
    Simulation next(other.diagram, *run.simulation);
    next.start();
    run.simulation->run_until(1.1);
    const long before = calls;
    next.take_over();
    for (int k = 0; k < 10; ++k) ASSERT_TRUE(next.step());
    EXPECT_EQ(calls - before, 0);
    EXPECT_EQ(next.steps(), 21);
}

} // namespace
} // namespace bf::test
#endif
