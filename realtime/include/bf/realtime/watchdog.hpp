// A watch over a loop: a step that hangs ends the program, and the service manager hears of those that end.
//
// C++17 and POSIX alone, and of BlockFactory only control.hpp and pacer.hpp: generated projects carry a copy
// of this file.
#pragma once

#include "bf/realtime/control.hpp"
#include "bf/realtime/pacer.hpp"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <functional>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <utility>

namespace bf::realtime {

/// The service manager that started the program, by the protocol of sd_notify(3): datagrams to the socket
/// that NOTIFY_SOCKET names. Where there is none, nothing is sent.
class ServiceManager {
  public:
    ServiceManager() {
        const char* const path = std::getenv("NOTIFY_SOCKET");
        address_.sun_family = AF_UNIX;
        if (!path || (*path != '/' && *path != '@') || std::strlen(path) >= sizeof address_.sun_path) return;
        std::memcpy(address_.sun_path, path, std::strlen(path));
        if (*path == '@') address_.sun_path[0] = '\0'; // a name that is no file
        size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + std::strlen(path));
        socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        const char *const limit = std::getenv("WATCHDOG_USEC"), *const whose = std::getenv("WATCHDOG_PID");
        if (limit && (!whose || std::atol(whose) == static_cast<long>(::getpid())))
            limit_ = std::atoll(limit) * 1000;
    }
    ~ServiceManager() {
        if (socket_ >= 0) ::close(socket_);
    }
    ServiceManager(const ServiceManager&) = delete;
    ServiceManager& operator=(const ServiceManager&) = delete;

    void notify(const char* text) const noexcept {
        if (socket_ >= 0)
            ::sendto(socket_, text, std::strlen(text), MSG_NOSIGNAL,
                     reinterpret_cast<const sockaddr*>(&address_), size_);
    }
    bool is_there() const noexcept { return socket_ >= 0; }
    /// It ends the program when it hears nothing for so long; 0: it does not watch.
    Nanoseconds limit() const noexcept { return limit_; }

  private:
    sockaddr_un address_{};
    socklen_t size_ = 0;
    int socket_ = -1;
    Nanoseconds limit_ = 0;
};

/// How long a step may take before it hangs: what was asked for [s], but a step of a slow model may take as
/// long as its period. 0: for ever.
inline Nanoseconds stall_limit(double asked, Nanoseconds period) {
    return asked > 0 ? std::max(nanoseconds(asked), 10 * std::min(period, longest_wait / 10)) : 0;
}

/// How long an emergency stop may take, all blocks included.
inline Nanoseconds emergency_limit(Nanoseconds period) { return stall_limit(0.5, period); }

/// Calls a function, once and from a thread of its own, when the loop has not been heard of for too long
/// after the first `kick`: a step hangs. What counts is the processor time of the loop, and the time that it
/// waits while this thread runs: when the whole process is stopped or frozen, no step hangs. The same is
/// called when an emergency stop was asked for and this object still lives after its limit. Make it in the
/// thread that it watches, before `prepare_thread`, so that it does not share the loop's processor.
///
/// The service manager is told that the program is ready when the first step has ended, and afterwards that
/// it lives, by this thread as well, but only if steps have ended since: the loop itself calls no system.
class Watchdog {
  public:
    /// `limit` 0: no step hangs. `emergency` is the limit of such a stop. `priority` of SCHED_FIFO, where
    /// granted; above the loop's, which may never end.
    Watchdog(Nanoseconds limit, Nanoseconds emergency, int priority, const Control& control,
             std::function<void()> on_stall)
        : limit_(limit), emergency_(emergency), priority_(priority), control_(control),
          on_stall_(std::move(on_stall)) {
        ::pthread_getcpuclockid(::pthread_self(), &loop_time_);
        thread_ = std::thread([this] { watch(); });
    }
    ~Watchdog() {
        is_over_.store(true);
        thread_.join();
    }
    Watchdog(const Watchdog&) = delete;
    Watchdog& operator=(const Watchdog&) = delete;

    /// The loop is about to begin, or a step has ended.
    void kick() noexcept {
        kicks_.store(kicks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    }
    /// No step follows before the next `kick`: blocks are being started or stopped, which may take long.
    void rest() noexcept { kicks_.store(0, std::memory_order_relaxed); }
    /// The loop has ended.
    void end() noexcept {
        rest();
        manager_.notify("STOPPING=1");
    }

  private:
    void watch() {
        prepare_thread({priority_, -1, false, 0});
        constexpr Nanoseconds longest = 20'000'000;
        const Nanoseconds pause =
            limit_ > 0 ? std::min(std::max<Nanoseconds>(limit_ / 10, 100'000), longest) : longest;
        std::int64_t heard = 0;
        bool lives = false; // steps have ended since the manager was told
        Nanoseconds looked = now(), used = now(loop_time_), stalled = 0, urgent = 0, told = 0;
        while (!is_over_.load()) {
            sleep_until(now() + pause);
            const Nanoseconds last_looked = std::exchange(looked, now());
            const Nanoseconds last_used = std::exchange(used, now(loop_time_));
            const Nanoseconds passed = std::min(looked - last_looked, 2 * pause);
            if (control_.state() == Control::State::emergency && (urgent += passed) > emergency_)
                return on_stall_();
            const std::int64_t kicks = kicks_.load(std::memory_order_relaxed);
            if (lives && looked - told >= manager_.limit() / 4) {
                manager_.notify("WATCHDOG=1");
                told = looked;
                lives = false;
            }
            if (kicks != heard) {
                lives = kicks > 1;
                if (heard <= 1 && lives) manager_.notify("READY=1");
                heard = kicks;
                stalled = 0;
            } else if (heard > 0 && limit_ > 0) {
                stalled += std::max(used - last_used, passed);
                if (stalled > limit_) return on_stall_();
            }
        }
    }

    const Nanoseconds limit_, emergency_;
    const int priority_;
    const Control& control_;
    const std::function<void()> on_stall_;
    const ServiceManager manager_;
    clockid_t loop_time_{};
    std::atomic<std::int64_t> kicks_{0};
    std::atomic<bool> is_over_{false};
    std::thread thread_;
};

/// What a program says that ends since a step hangs; `at` s of the model, `block` may be unknown.
inline std::string stall_text(std::int64_t step, double at, Nanoseconds limit, const std::string& block) {
    char text[200];
    std::snprintf(text, sizeof text, "step %lld at t = %g s has not ended for %g s",
                  static_cast<long long>(step), at, static_cast<double>(limit) / 1e9);
    return text + (block.empty() ? "" : "; block '" + block + "' is at work") +
           ", so the program ends without stopping the blocks; look for a block that waits or never ends, or "
           "raise --watchdog";
}

/// What a program says that ends since its blocks could not be stopped in an emergency.
inline std::string emergency_text(std::int64_t step, double at, Nanoseconds limit, const std::string& block) {
    char text[200];
    std::snprintf(
        text, sizeof text,
        "emergency stop: in %g s neither step %lld at t = %g s has ended nor all blocks have stopped",
        static_cast<double>(limit) / 1e9, static_cast<long long>(step), at);
    return text + (block.empty() ? "" : "; block '" + block + "' was begun last") +
           ", so the program ends without them";
}

} // namespace bf::realtime
