// Ctrl-C, a service manager's request to end, and a terminal that is gone.
//
// C++17 and POSIX alone, and no other header of BlockFactory: generated projects carry a copy of this file.
#pragma once

#include <csignal>

namespace bf::realtime {

/// While one lives, SIGINT, SIGTERM and SIGHUP only set a flag, once: a second one ends the program at once.
/// A program that ended because of it exits with 128 + the signal's number. Under nohup SIGHUP stays ignored.
class InterruptGuard {
  public:
    InterruptGuard() {
        came_ = 0;
        struct sigaction action {};
        action.sa_handler = [](int number) { __atomic_store_n(&came_, number, __ATOMIC_RELAXED); };
        action.sa_flags = static_cast<int>(SA_RESETHAND);
        ::sigaction(SIGINT, &action, nullptr);
        ::sigaction(SIGTERM, &action, nullptr);
        ::sigaction(SIGHUP, nullptr, &before_);
        if (before_.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);
    }
    ~InterruptGuard() {
        std::signal(SIGINT, SIG_DFL);
        std::signal(SIGTERM, SIG_DFL);
        ::sigaction(SIGHUP, &before_, nullptr);
    }
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

    /// The number of the signal that came, or 0.
    static int signal() noexcept { return __atomic_load_n(&came_, __ATOMIC_RELAXED); }
    /// Where that number stands. It is read as one word by any thread.
    static const volatile std::sig_atomic_t* flag() noexcept { return &came_; }

  private:
    struct sigaction before_ {};                        ///< SIGHUP
    inline static volatile std::sig_atomic_t came_ = 0; // the only thing that a signal handler may touch
};

} // namespace bf::realtime
