#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Quadratic programs.
void add_qp(Library& library);

} // namespace bf::toolbox
