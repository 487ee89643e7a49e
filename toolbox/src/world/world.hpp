#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Physics worlds with a simulated robot.
void add_world(Library& library);
/// A world that several robots share.
void add_shared_world(Library& library);
/// What is seen and felt in it.
void add_world_sensors(Library& library);

} // namespace bf::toolbox
