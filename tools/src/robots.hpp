// What the program knows about robots; in a build without them (BF_ROBOTS) nothing.
#pragma once

#include "bf/core/resolution.hpp"

#include <filesystem>

namespace bf::tools {

/// The URDF of the robot that the block provides; empty if it provides none.
std::filesystem::path urdf_of(const Resolution& block);

} // namespace bf::tools
