#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Robot configuration, measurements, limits and references.
void add_robot(Library& library);
/// Gains of the low level and motor parameters.
void add_low_level(Library& library);

} // namespace bf::toolbox
