#include "bf/physics/world.hpp"
#include "robots.hpp"

#include <atomic>
#include <cstdlib>
#include <gtest/gtest.h>

namespace {
std::atomic<long> allocations{0};
}

// Every allocation of this program, those of MuJoCo included, passes here.
extern "C" {
#ifdef __SANITIZE_ADDRESS__
void __sanitizer_malloc_hook(const volatile void*, size_t) { ++allocations; }
#else
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* block, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void* malloc(size_t size) { return ++allocations, __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return ++allocations, __libc_calloc(count, size); }
void* realloc(void* block, size_t size) { return ++allocations, __libc_realloc(block, size); }
void* aligned_alloc(size_t alignment, size_t size) { return ++allocations, __libc_memalign(alignment, size); }
#endif
}

using namespace bf::physics;
using namespace bf::physics::test;

TEST(Simulation, NeverTouchesTheHeapWhileItRuns) {
    WorldOptions options = icub_options();
    options.noise = {1e-4, 1e-2, 0.1, 1};
    const long before_setup = allocations;
    Simulation sim = simulate(options);
    EXPECT_GT(allocations - before_setup, 100) << "the counter does not see MuJoCo";
    HoldPosture hold(sim.world());
    std::vector<double> state(static_cast<size_t>(sim.state_size()));
    const std::vector<double> push{5, 0, 0, 0, 0, 0};
    double sum = 0.0;

    const long before = allocations;
    for (int k = 0; k < 300; ++k) {
        if (!sim.step(hold(sim), push)) break;
        sum += sim.w_H_b()(0, 3) + sim.v_b().norm() + sim.foot_wrench(0)[2] + sim.ft_wrench(1)[2] +
               sim.gyro()[0];
        if (k == 100) sim.save(state.data());
    }
    sim.restore(state.data());
    sim.reset();
    EXPECT_FALSE(sim.step(std::span<const double>{}));
    const long during = allocations - before;
    EXPECT_EQ(during, 0);
    EXPECT_NE(sum, 0.0);
}
