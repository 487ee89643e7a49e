// The gain of a loop of a model, and why there is none.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/engine/simulation.hpp"

#include <string>
#include <vector>

namespace bf::analysis {

/// L of the loop through a signal, or an element of it, as of negative feedback, 1 + L = 0: linearised at the
/// run's present state from the signal to itself, cut there and at the signals `open`, with the sign turned.
/// Like `linearize` it takes a step of the run. Throws RunError: what `linearize` refuses; several elements.
LinearSystem loop_gain(Simulation& run, const std::string& signal, const std::vector<std::string>& open = {});

/// Is what comes out 0 whatever goes in?
bool is_nothing(const LinearSystem& system);

/// Of a loop of which that is so: the blocks on the way that pass nothing on at the run's present state, or
/// what is held. Takes a step of the run.
std::string why_nothing_returns(Simulation& run, const std::string& signal,
                                const std::vector<std::string>& open = {});

} // namespace bf::analysis
