#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// LQR and MPC.
void add_optimal_control(Library& library);

} // namespace bf::toolbox
