// Where the time of a run goes.
#pragma once

#include "bf/run/run.hpp"

#include <cstdint>
#include <deque>
#include <iosfwd>
#include <string>
#include <vector>

namespace bf {

/// Times every task of a run from its construction to its destruction, in wall time; without one a
/// run times nothing. The run outlives the profiler.
class Profiler {
  public:
    /// Keeps the last `events` calls for write_trace. Measures the cost of the timer, which is taken off.
    explicit Profiler(Run& run, std::size_t events = 0);
    ~Profiler();
    Profiler(const Profiler&) = delete;
    Profiler& operator=(const Profiler&) = delete;

    struct Row {
        std::string name; ///< path of a block, or what is not one block; a rate: its period
        double period;    ///< s; 0 for a continuous rate
        std::int64_t calls = 0;
        double seconds = 0;
    };
    std::vector<Row> blocks() const;                          ///< slowest first
    std::vector<Row> rates() const;                           ///< slowest first
    double timer_seconds() const { return timer_ns_ * 1e-9; } ///< cost of timing one call
    std::int64_t calls() const;

    /// Trace events in JSON, one thread per rate: open it in https://ui.perfetto.dev or chrome://tracing.
    void write_trace(std::ostream& stream) const;

  private:
    struct Entry {
        Profiler* profiler;
        Task task;
        Phase phase;
        std::string block;
        int rate;
        std::int64_t calls, nanoseconds;
    };
    struct Event {
        const Entry* entry;
        std::int64_t begin, duration; ///< ns
    };
    static Status timed(const void* entry, int);
    double period(int rate) const;
    double seconds(const Entry& entry) const;
    template <class KeyOf> std::vector<Row> rows(KeyOf&& key_of) const;

    Run& run_;
    const std::vector<RunRate> rates_;
    std::deque<Entry> entries_;
    std::vector<Event> events_; ///< a ring
    std::size_t event_count_ = 0;
    std::int64_t begin_ = 0;
    double inside_ns_ = 0,
           timer_ns_ = 0; ///< the part of the timer that a measurement contains, and all of it
};

} // namespace bf
