// A look at a run in the middle of a step.
#pragma once

#include "bf/engine/simulation.hpp"

#include <functional>

namespace bf::analysis {

/// Makes a step, in which `look` runs where the outputs are there and the states have not moved on. Throws
/// what it throws; the status is the step's.
Status step_with(Simulation& run, const std::function<void()>& look);

} // namespace bf::analysis
