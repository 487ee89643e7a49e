// What a running diagram leaves to another one that goes on in its place.
#pragma once

#include "bf/engine/simulation.hpp"

#include <string>
#include <vector>

namespace bf {

/// States of two runs, compared by the paths and types of their blocks, and by their own names, types and
/// sizes.
struct Handover {
    /// States of the first run that the second one cannot take over, with the reason: "'x.state' is 2x1
    /// double and was 3x1 double".
    std::vector<std::string> lost;
    /// States of the second run alone, which begin with their initial values: "y.state".
    std::vector<std::string> begun;
};

/// What `to.go_on_from(from)` would do, of two runs of which neither needs to be started.
Handover handover(const Simulation& from, const Simulation& to);

} // namespace bf
