// Terrain from the XML file of a world, for worlds of one robot and for planners.
#pragma once

#include "bf/core/types.hpp"
#include "bf/physics/world_options.hpp"

#include <string>
#include <vector>

namespace bf::toolbox {

/// The objects of the file. Throws std::runtime_error, for a robot in it, too.
std::vector<physics::SceneObject> read_terrain(const std::string& file);

/// They as boxes whose edges are parallel to the axes of the world, rows x y z a b c: centre and half-sizes
/// (m). Throws std::runtime_error for an object that is none.
Matrix read_boxes(const std::string& file);

} // namespace bf::toolbox
