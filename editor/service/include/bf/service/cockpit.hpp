// What pages are told of a program that runs against the clock.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bf::service {

/// Durations in a row of a histogram, from `from_us` on; the outermost rows are open.
struct TimingRow {
    double from_us = 0, to_us = 0;
    std::int64_t count = 0;
    double per_us = 0; ///< count per us of width
};
struct TimingSummary {
    double p50 = 0, p99 = 0, p99_9 = 0, p99_99 = 0, worst = 0; ///< us
    std::vector<TimingRow> rows = {};
};
/// Why steps ended after their deadlines: see docs/how-to/real-time.md.
struct TimingMisses {
    std::int64_t computation = 0, interruption = 0, wakeup = 0, backlog = 0;
};
/// How a loop against the clock keeps its period, since it began.
struct Timing {
    std::string state;    ///< "waiting", "running", "stopping", "emergency stop"; "ended" or "failed" at last
    std::string end;      ///< how it ended, a sentence; empty before
    double time = 0;      ///< of the model, s
    double period_us = 0; ///< on the clock
    std::int64_t steps = 0;
    TimingSummary wake_up_us;   ///< from the release of a step to its beginning
    TimingSummary step_us;      ///< from its beginning to its end
    TimingSummary response_us;  ///< from the release to the end; above the period: the deadline was missed
    TimingSummary deviation_us; ///< of the time between two beginnings, its size
    std::vector<TimingRow> deviation_of_the_period = {}; ///< to both sides
    std::int64_t missed = 0;
    TimingMisses missed_by_cause;
    std::int64_t skipped = 0, degraded = 0;
};

/// What was done to a run, as the program that runs it has noted it.
struct LiveEntry {
    std::int64_t number = 0; ///< counts entries; one that comes again replaces the one before
    double clock = 0;        ///< s since 1970
    double time = 0;         ///< of the model, s
    std::string who, what;
    std::optional<int> page = {}; ///< of this service that did it; none: somebody else
};

/// A run of another program.
struct LiveProgram {
    std::string name;         ///< of its model
    std::string refusal = {}; ///< why it can be watched alone; empty: it can be tuned, started and stopped
    /// Why edits change the file alone; empty: the run goes on with the edited model.
    std::string edit_refusal = {};
    std::string message = {}; ///< why there is no connection: how the program ended, where that is known
};

/// How a run of another program goes, a few times a second.
struct LiveReport {
    std::optional<Timing> timing = {};
    std::vector<LiveEntry> log = {}; ///< the last hundred
};

} // namespace bf::service
