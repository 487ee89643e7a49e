// Operating points: where a diagram stays as it is.
#pragma once

#include "bf/engine/simulation.hpp"

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace bf::analysis {

/// Elements are called as in `linearize`: "u", "position.x", "arm.q[elbow]" or "arm.q[2]".
struct TrimOptions {
    struct Bounds {
        std::string name;
        double lower = -std::numeric_limits<double>::infinity(),
               upper = std::numeric_limits<double>::infinity();
    };
    std::vector<std::string> free = {};                      ///< inputs of the root that may change
    std::vector<std::pair<std::string, double>> hold = {};   ///< states, and inputs, at these values
    std::vector<std::pair<std::string, double>> target = {}; ///< signals that shall have these values
    std::vector<Bounds> bounds = {};                         ///< of free inputs and states
};

/// A number by its name.
using NamedNumber = std::pair<std::string, double>;

struct TrimResult {
    /// What was held although it may move, as `LinearSystem` says it.
    std::vector<std::string> held = {};
    std::vector<NamedNumber> free; ///< what was found: states that are not held, and free inputs
    std::vector<NamedNumber>
        residuals; ///< that are left: x' of continuous states, x⁺ - x of sampled ones, y - target
};

/// Finds states and free inputs at which x' = 0, x⁺ = x and signals have their targets, by Newton's method of
/// KINSOL with the exact derivatives of `linearize`; bounds are kept by substitution (James, MINUIT, CERN
/// D506, §1.2.1). States of blocks without outputs, which only look on, are left out. Begins with the values
/// that the started run has, and leaves it there: its next step begins at the operating point. Throws
/// RunError: there are not as many free numbers as equations (with both lists); no solution, with the
/// residual that is worst and the variable that it depends on most, or that is at its bound; unknown names;
/// blocks that cannot be saved; sample times with an offset; built without SUNDIALS.
TrimResult trim(Simulation& run, const TrimOptions& options);

} // namespace bf::analysis
