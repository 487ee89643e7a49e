#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Walking of bipeds: footsteps, divergent component of motion, swing foot.
void add_walking(Library& library);

} // namespace bf::toolbox
