// What the program knows about robots; in a build without them (BF_ROBOTS) nothing.
#pragma once

#include "bf/core/declaration.hpp"

#include <filesystem>

namespace bf::tools {

/// The URDF that the resource was made from; empty if it is no robot.
std::filesystem::path urdf_of(const ProvisionDeclaration& provision);

} // namespace bf::tools
