#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Robot configuration, measurements, limits and references.
void add_robot(Library& library);

} // namespace bf::toolbox
