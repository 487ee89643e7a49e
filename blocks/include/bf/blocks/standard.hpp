// The standard blocks: sources, mathematics, geometry, routing, logic and discrete time.
#pragma once

#include "bf/core/registry.hpp"

namespace bf {

/// All standard blocks. The library has no name: models say "Gain", not "Library/Gain".
Library standard_library();

} // namespace bf
