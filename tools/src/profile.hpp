// What `bf run --profile` shows.
#pragma once

#include "bf/run/profile.hpp"
#include "output.hpp"

#include <nlohmann/json.hpp>

namespace bf::tools {

/// How many calls a trace holds: the last ones.
inline constexpr std::size_t trace_events = 200'000;

/// Tables of blocks and rates; `wall`: what the whole run took [s].
void print_profile(const Profiler& profiler, double wall);

/// {"timer_s", "calls", "blocks": [{"name", "period_s", "calls", "seconds"}], "rates": [...]}
nlohmann::ordered_json profile_json(const Profiler& profiler);

/// Writes and commits the file of trace events.
void write_trace(const Profiler& profiler, OutputFile& file);

} // namespace bf::tools
