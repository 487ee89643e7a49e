// What happened in a loop against the clock, for programs.
#pragma once

#include "bf/realtime/statistics.hpp"

#include <nlohmann/json.hpp>

namespace bf::realtime {

/// {"period_us", "steps", "wake_up_us", "step_us", "response_us", "deviation_us",
/// "deviation_of_the_period": rows, "missed", "missed_by_cause", "skipped", "degraded"}. Durations are
/// {"p50", "p99", "p99_9", "p99_99", "worst", "rows"}, rows {"from_us", "to_us", "count"}. All of it may be
/// asked for while the loop counts.
nlohmann::ordered_json statistics_json(const Statistics& statistics);

/// The first misses, each {"step", "cause", "late_us", "wake_up_us", "step_us"}; when the loop has ended.
nlohmann::ordered_json first_misses_json(const Statistics& statistics);

} // namespace bf::realtime
