// Running a simulation to its end, for `bf run`, tests and benchmarks.
#pragma once

#include "bf/engine/simulation.hpp"

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace bf::tools {

/// What a run came to.
struct RunResult {
    std::string model;
    double from = 0, simulated = 0, wall = 0; ///< s; from: where a run from a snapshot began
    std::int64_t steps = 0;
    std::vector<CheckResult> checks; ///< of the model's own check blocks
    std::string failure;             ///< why the run ended early; empty when it went to its end
    std::string stopped_by;          ///< a viewer of a run in real time; empty where none did
    bool is_interrupted = false;
    std::string report;              ///< of a run in real time, for people
    nlohmann::ordered_json realtime; ///< the same for programs

    /// False where the run was stopped before its first step, so that nothing was checked.
    bool has_run() const { return steps > 0 || simulated > 0; }
    /// {"model", "outcome": "finished" | "stopped" | "failed" | "interrupted", "stopped_by", "simulated_s",
    /// "wall_s", "real_time_factor", "steps", "realtime", "checks": {name: value}, "failure"}; a check that
    /// was not made is null, and what does not apply is left out
    nlohmann::ordered_json to_json() const;
};

/// What happens besides the steps of a run; each function may be empty.
struct RunHooks {
    /// Asked a few hundred times a second, given the wall time in s, whether to go on.
    std::function<bool(double wall)> go_on;
    /// Asked before every step whether to go on.
    std::function<bool()> between_steps;
    /// After the last step of a run that did not fail.
    std::function<void()> before_stop;
    bool is_started = false; ///< the simulation was started already, and perhaps restored from a snapshot
};

/// Starts, steps to `stop` s and stops the simulation; a failed step ends it.
RunResult run(Simulation& simulation, double stop, const RunHooks& hooks = {});

} // namespace bf::tools
