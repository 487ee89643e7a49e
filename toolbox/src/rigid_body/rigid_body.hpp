#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Kinematics and dynamics of the robot configuration around a block.
void add_rigid_body(Library& library);
void add_inverse_kinematics(Library& library);

} // namespace bf::toolbox
