// How a thread or a program wakes another one, without locks.
#pragma once

#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"

#include <algorithm>
#include <atomic>
#include <climits>
#include <cstdint>
#include <ctime>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace bf::middleware {

/// Rung by whoever has written something. Where nobody sleeps, that costs no call of the system; and it never
/// waits.
struct Bell {
    std::atomic<std::uint32_t> rung, sleepers;

    void ring() noexcept {
        rung.fetch_add(1);
        // A sleeper counts itself before it looks for the last time, so either it sees what was written, or
        // it is seen here. One that died asleep stays counted, which costs a call each time.
        if (sleepers.load() != 0) call(FUTEX_WAKE, INT_MAX, nullptr);
    }

    /// Who steps a robot answers soon, mostly: sleeping and being woken takes longer than that, s.
    static constexpr double usual_watch = 50e-6;

    /// Waits until `is_there()`, at most `timeout` s, or until it is interrupted. It looks for `watch` s
    /// before it sleeps, which takes a processor: 0 where other threads are to bring what is waited for.
    template <class F> void wait(double timeout, F&& is_there, double watch = usual_watch) noexcept {
        const double begin = now(), end = begin + timeout;
        for (double time = begin; time < std::min(begin + watch, end); time = now())
            for (int looked = 0; looked < 32; ++looked) {
                if (is_there()) return;
                pause();
            }
        while (!is_interrupted()) {
            const std::uint32_t seen = rung.load();
            sleepers.fetch_add(1);
            if (is_there()) {
                sleepers.fetch_sub(1);
                return;
            }
            const double left = std::min(end - now(), 0.05); // so that an interrupt is seen
            if (left > 0) {
                const timespec time{0, static_cast<long>(left * 1e9)};
                call(FUTEX_WAIT, static_cast<int>(seen), &time);
            }
            if (sleepers.load() != 0)
                sleepers.fetch_sub(1); // 0 was written over it: one at least was counted
            if (is_there() || now() >= end) return;
        }
    }

  private:
    void call(int what, int value, const timespec* time) noexcept {
        syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&rung), what, value, time, nullptr, 0);
    }
    static void pause() noexcept {
#if defined(__x86_64__) || defined(__i386__)
        __builtin_ia32_pause();
#elif defined(__aarch64__)
        asm volatile("yield");
#endif
    }
};

} // namespace bf::middleware
