// A loop against the clock: pacing, deadlines, and what the machine must grant.
//
// C++17 and POSIX alone, and of BlockFactory only statistics.hpp: generated projects carry a copy of this
// file.
#pragma once

#include "bf/realtime/statistics.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <pthread.h>
#include <sched.h>
#include <string>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>
#include <vector>

namespace bf::realtime {

/// 31 years: no run takes longer, and the sum of a few fits.
constexpr Nanoseconds longest_wait = 1'000'000'000'000'000'000;

/// A duration or a period of s seconds, at most the longest wait.
inline Nanoseconds nanoseconds(double s) noexcept {
    return std::llround(std::min(s * 1e9, static_cast<double>(longest_wait)));
}

inline Nanoseconds now(clockid_t clock = CLOCK_MONOTONIC) noexcept {
    timespec t;
    ::clock_gettime(clock, &t);
    return Nanoseconds{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

inline void sleep_until(Nanoseconds at) noexcept {
    const timespec t{static_cast<time_t>(at / 1'000'000'000), static_cast<long>(at % 1'000'000'000)};
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
    }
}

// ---- what the machine grants ----

struct ThreadOptions {
    int priority = 0;                ///< 1 ... 99: SCHED_FIFO; 0: the ordinary scheduler
    int cpu = -1;                    ///< the only processor the thread runs on; -1: any
    bool locks_memory = true;        ///< of the process, present and future: no page is ever fetched
    std::size_t stack = 256u * 1024; ///< bytes of the thread's stack touched in advance
};

/// Makes the calling thread fit for real time. What the machine refuses comes back as texts, each with its
/// remedy; the rest is in effect. Threads that are started later inherit priority and processor.
inline std::vector<std::string> prepare_thread(const ThreadOptions& options) {
    std::vector<std::string> refused;
    if (options.cpu >= 0) {
        cpu_set_t set;
        CPU_ZERO(&set);
        if (options.cpu < CPU_SETSIZE) CPU_SET(static_cast<unsigned>(options.cpu), &set);
        if (const int error = ::pthread_setaffinity_np(::pthread_self(), sizeof set, &set))
            refused.push_back("processor " + std::to_string(options.cpu) + " was refused (" +
                              std::strerror(error) +
                              "): name one of those that 'nproc' counts, from 0, and that the process may "
                              "use ('taskset -p $$')");
    }
    if (options.priority > 0) {
        sched_param parameter{};
        parameter.sched_priority = options.priority;
        if (const int error = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameter))
            refused.push_back("real-time priority " + std::to_string(options.priority) + " was refused (" +
                              std::strerror(error) + "): give the user the right with a line '" +
                              std::string("NAME - rtprio 98") +
                              "' in /etc/security/limits.conf and log in again, or the program with 'sudo "
                              "setcap cap_sys_nice,cap_ipc_lock+ep PROGRAM'");
    }
    if (options.locks_memory) {
        // Under a finite limit, locking the future too would make a later allocation fail.
        rlimit limit{};
        ::getrlimit(RLIMIT_MEMLOCK, &limit);
        const bool is_free = ::geteuid() == 0 || limit.rlim_cur == RLIM_INFINITY;
        if (::mlockall(is_free ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) != 0)
            refused.push_back(std::string("locking the memory was refused (") + std::strerror(errno) +
                              "): give the user the right with a line 'NAME - memlock unlimited' in "
                              "/etc/security/limits.conf and log in again, or the program with 'sudo setcap "
                              "cap_sys_nice,cap_ipc_lock+ep PROGRAM'");
    }
    if (options.stack > 0) {
        const long page = ::sysconf(_SC_PAGESIZE);
        auto* const top = static_cast<volatile char*>(__builtin_alloca(options.stack));
        for (std::size_t i = 0; i < options.stack; i += static_cast<std::size_t>(page)) top[i] = 0;
    }
    return refused;
}

// ---- the loop ----

/// What follows when a step ends after its deadline, which is the next release.
enum class Overrun {
    skip,     ///< releases that have passed are left out; the next step begins at a release to come
    catch_up, ///< steps follow one another without pause until none is behind
    stop,     ///< the run ends
    degrade   ///< as skip, and `is_degraded` until 100 steps in a row were in time
};
/// The policies by the names that users give them, in their order.
inline constexpr std::array<const char*, 4> overrun_names{"skip", "catch-up", "stop", "degrade"};
inline std::optional<Overrun> overrun_of(const std::string& name) {
    for (std::size_t i = 0; i < overrun_names.size(); ++i)
        if (name == overrun_names[i]) return static_cast<Overrun>(i);
    return std::nullopt;
}

/// Why a run with the policy to stop ended at its first miss; empty when there was none.
inline std::string missed_deadline(const Statistics& s) {
    if (s.missed() == 0) return {};
    const auto& miss = s.first_misses.front();
    return "step " + std::to_string(miss.step) + " missed its deadline by " +
           std::to_string(miss.late / 1000) + " us: " + text(miss.cause) +
           "; choose another --overrun than stop, or give the step more time";
}

/// Paces a loop: step k is released at begin + k period, an absolute time, so that errors do not add up.
///
///     Pacer pacer(1'000'000, Overrun::skip);
///     for (pacer.start(); pacer.wait(); pacer.end_step()) model.step();
///
/// Nothing allocates or locks between start and the end.
class Pacer {
  public:
    Pacer(Nanoseconds period, Overrun overrun) : overrun_(overrun) { statistics_.period = period; }

    /// The first release is one period from now.
    void start() noexcept {
        release_ = now() + statistics_.period;
        end_ = now();
        processor_time_ = now(CLOCK_THREAD_CPUTIME_ID);
    }

    /// Returns at the next release, or at once when it has passed. False: a deadline was missed and the
    /// policy is to stop.
    bool wait() noexcept {
        if (is_stopped_) return false;
        if (end_ < release_) sleep_until(release_);
        const Nanoseconds begin = now();
        if (statistics_.steps > 0) {
            const Nanoseconds deviation = (begin - begin_) - (release_ - last_release_);
            statistics_.jitter.add(deviation < 0 ? -deviation : deviation);
            statistics_.periods.add(begin - begin_ - statistics_.period);
        }
        begin_ = begin;
        statistics_.latency.add(begin - release_);
        if (is_degraded()) ++statistics_.degraded;
        return true;
    }

    /// The step that `wait` began is over.
    void end_step() noexcept {
        const Nanoseconds previous_end = end_, period = statistics_.period;
        end_ = now();
        const Nanoseconds processor_time = now(CLOCK_THREAD_CPUTIME_ID);
        statistics_.computation.add(end_ - begin_);
        statistics_.response.add(end_ - release_);
        last_release_ = release_;
        release_ += period;
        if (end_ > release_)
            miss(std::max(last_release_, previous_end), processor_time - processor_time_);
        else if (in_time_ < recovery)
            ++in_time_;
        processor_time_ = processor_time;
        ++statistics_.steps;
    }

    /// Work that may wait (recording, telemetry) is to be left out of this step.
    bool is_degraded() const noexcept { return overrun_ == Overrun::degrade && in_time_ < recovery; }
    const Statistics& statistics() const noexcept { return statistics_; }
    Nanoseconds release() const noexcept { return release_; } ///< of the step to come or under way
    Nanoseconds begin() const noexcept { return begin_; }     ///< of the last step
    Nanoseconds end() const noexcept { return end_; }         ///< of the last step that is over

  private:
    static constexpr int recovery = 100;

    /// `ready`: when the step could have begun.
    void miss(Nanoseconds ready, Nanoseconds used) noexcept {
        const Nanoseconds period = statistics_.period, computation = end_ - begin_, late = end_ - release_;
        const Cause cause = used > period           ? Cause::computation
                            : computation > period  ? Cause::interruption
                            : end_ - ready > period ? Cause::wakeup
                                                    : Cause::backlog;
        ++statistics_.misses[static_cast<std::size_t>(cause)];
        if (statistics_.first_misses.size() < statistics_.first_misses.capacity())
            statistics_.first_misses.push_back(
                {statistics_.steps, cause, late, begin_ - last_release_, computation});
        in_time_ = 0;
        is_stopped_ = overrun_ == Overrun::stop;
        if (overrun_ != Overrun::skip && overrun_ != Overrun::degrade) return;
        const Nanoseconds passed = late / period + 1;
        statistics_.skipped += passed;
        release_ += passed * period;
    }

    Statistics statistics_;
    const Overrun overrun_;
    Nanoseconds release_ = 0, last_release_ = 0, begin_ = 0, end_ = 0, processor_time_ = 0;
    int in_time_ = recovery;
    bool is_stopped_ = false;
};

} // namespace bf::realtime
