#pragma once

#include "bf/physics/renderer.hpp"

#include <mujoco/mujoco.h>

namespace bf::physics {

/// Adds sky, lamps, the floor's pattern and the picture's settings to a model.
void decorate(mjSpec* spec, const RenderOptions& options);

/// Adds an arrow to what is drawn; dropped when shorter than 1 mm or when the scene is full.
void add_arrow(mjvScene& scene, const Arrow& arrow);

} // namespace bf::physics
