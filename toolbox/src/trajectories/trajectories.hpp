#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// JointTrajectory and CartesianTrajectory.
void add_trajectories(Library& library);

} // namespace bf::toolbox
