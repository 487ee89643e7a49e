#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// PID and impedance of joints and frames.
void add_controllers(Library& library);

} // namespace bf::toolbox
