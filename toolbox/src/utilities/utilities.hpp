#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// The small blocks of the paper's toolbox.
void add_utilities(Library& library);

} // namespace bf::toolbox
