#include "bf/core/interrupt.hpp"

#include <atomic>
#include <signal.h>
#include <unistd.h>

namespace bf {

namespace {
std::atomic<const volatile std::sig_atomic_t*> caught{nullptr}; // signals belong to the process, too
std::atomic<void (*)(const char*)> listener{nullptr};           // and so does its terminal
} // namespace

bool is_interrupted() noexcept {
    const auto* flag = caught.load(std::memory_order_acquire);
    return flag && __atomic_load_n(flag, __ATOMIC_RELAXED) != 0;
}

void look_for_interrupt(const volatile std::sig_atomic_t* flag) noexcept {
    caught.store(flag, std::memory_order_release);
}

bool interrupt() noexcept { return caught.load(std::memory_order_acquire) && kill(getpid(), SIGINT) == 0; }

void tell_wait(const char* what) noexcept {
    if (auto* told = listener.load(std::memory_order_acquire)) told(what);
}

void listen_to_waits(void (*told)(const char* what)) noexcept {
    listener.store(told, std::memory_order_release);
}

} // namespace bf
