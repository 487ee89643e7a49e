#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// External wrenches, and the base of robots that walk.
void add_estimators(Library& library);

} // namespace bf::toolbox
