#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Where the feet go.
void add_footsteps(Library& library);
/// Walking of bipeds: footsteps, divergent component of motion, swing foot.
void add_walking(Library& library);

} // namespace bf::toolbox
