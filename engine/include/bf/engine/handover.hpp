// What a running diagram leaves to another one that goes on in its place.
#pragma once

#include "bf/engine/simulation.hpp"

#include <string>
#include <utility>
#include <vector>

namespace bf {

/// States of two runs, compared by the paths (see Origin) and types of their blocks, and by their own names,
/// types and sizes.
struct Handover {
    /// States of the first run that the second one cannot take over, with the reason: "'x.state' is 2x1
    /// double and was 3x1 double".
    std::vector<std::string> lost;
    /// States of the second run alone, which begin with their initial values: "y.state".
    std::vector<std::string> begun;
};

/// What `to.go_on_from(from, origin)` would do, of two runs of which neither needs to be started.
Handover handover(const Simulation& from, const Simulation& to, const Origin& origin = {});

/// Blocks with states, or subsystems with such, that seem to have exchanged their names: each is in `to`,
/// with its arguments, values and wires, what the other one was in `from`, and both are of the same paths in
/// both. Nobody but whoever wrote the model knows whether names were exchanged, or all the rest.
std::vector<std::pair<std::string, std::string>> exchanged(const Diagram& from, const Diagram& to);

} // namespace bf
