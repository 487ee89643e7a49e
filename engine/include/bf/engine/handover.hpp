// What a running diagram leaves to another one that goes on in its place.
#pragma once

#include "bf/engine/simulation.hpp"

#include <string>
#include <utility>
#include <vector>

namespace bf {

/// States of two runs, compared by the paths (see Origin) and types of their blocks, and by their own names,
/// types and sizes. A state whose numbers stand for names (see About::value_names) is taken over by its name,
/// and its block begins anew where that is gone.
struct Handover {
    /// States of the first run that the second one cannot take over, with the reason: "'x.state' is 2x1
    /// double and was 3x1 double". Of a run that goes on until its place is taken, all names that are gone.
    std::vector<std::string> lost;
    /// States of the second run alone, which begin with their initial values: "y.state".
    std::vector<std::string> begun;
};

/// What `to.go_on_from(from, origin)` would do, of two runs of which neither needs to be started.
Handover handover(const Simulation& from, const Simulation& to, const Origin& origin = {});

/// Do runs of both compute the same? What a model says of its drawing, its documentation and what is recorded
/// does not count.
bool is_same_run(const Diagram& a, const Diagram& b);

/// The path in the second diagram of what has this one in the first; none: it is gone.
using PathSince = std::function<std::optional<std::string>(const std::string& path)>;

/// Values that were set in a run of the first diagram and hold in one of the second, too, under the names
/// that they have there: of variables and parameters of which both models say the same.
std::vector<ParameterValue> still_asked(const Diagram& from, const Diagram& to,
                                        const std::vector<ParameterValue>& asked,
                                        const PathSince& path_since);

/// Sets such values in a run between two steps, one after the other, as far as it takes them, and returns
/// those.
std::vector<ParameterValue> set_again(Run& run, const std::vector<ParameterValue>& asked);

/// Blocks with states, or subsystems with such, that seem to have exchanged their names: each is in `to`,
/// with its arguments, values and wires, what the other one was in `from`, and both are of the same paths in
/// both. Nobody but whoever wrote the model knows whether names were exchanged, or all the rest.
std::vector<std::pair<std::string, std::string>> exchanged(const Diagram& from, const Diagram& to);
/// The same in words: a sentence for each pair.
std::vector<std::string> unclear(const Diagram& from, const Diagram& to);

} // namespace bf
