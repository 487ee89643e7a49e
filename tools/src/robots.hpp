// What the program knows about robots; in a build without them (BF_ROBOTS) nothing.
#pragma once

#include "bf/core/resolution.hpp"
#include "bf/elaborate/diagram.hpp"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace bf::physics {
class Scene;
class World;
} // namespace bf::physics

namespace bf::tools {

/// The URDF of the robot that the block provides; empty if it provides none.
std::filesystem::path urdf_of(const Resolution& block);

/// The physics worlds of a diagram with the paths of their blocks.
std::vector<std::pair<std::string, const physics::World*>> worlds_of(const Diagram& diagram);

/// Those that several robots share.
std::vector<std::pair<std::string, const physics::Scene*>> shared_worlds_of(const Diagram& diagram);

} // namespace bf::tools
