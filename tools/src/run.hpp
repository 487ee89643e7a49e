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
    std::string failure;             ///< empty when the run went to its end
    bool is_interrupted = false;

    nlohmann::ordered_json to_json() const;
};

/// Starts, steps to `stop` s (or to a failure or an interrupt) and stops the simulation. `progress` is called
/// five times a second and once at the end.
RunResult run(Simulation& simulation, double stop, const std::function<void(double wall, bool is_last)>& progress = {});

} // namespace bf::tools
