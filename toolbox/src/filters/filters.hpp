#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Filters and trajectory generators.
void add_filters(Library& library);

} // namespace bf::toolbox
