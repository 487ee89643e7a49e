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
    double simulated = 0, wall = 0; ///< s
    std::int64_t steps = 0;
    std::vector<CheckResult> checks; ///< of the model's own check blocks
    std::string failure;             ///< why the run ended early; empty when it went to its end
    bool is_interrupted = false;
    std::string report;              ///< of a run in real time, for people
    nlohmann::ordered_json realtime; ///< the same for programs

    /// {"model", "outcome": "finished" | "failed" | "interrupted", "simulated_s", "wall_s",
    /// "real_time_factor", "steps", "realtime", "checks": {name: value}, "failure"}
    nlohmann::ordered_json to_json() const;
};

/// Starts, steps to `stop` s and stops the simulation; a failed step ends it. `go_on`, given the wall time in
/// s, is asked a few hundred times a second whether to go on.
RunResult run(Simulation& simulation, double stop, const std::function<bool(double wall)>& go_on = {});

} // namespace bf::tools
