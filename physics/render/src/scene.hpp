#pragma once

#include "bf/physics/renderer.hpp"

#include <mujoco/mujoco.h>

namespace bf::physics {

/// Adds sky, lamps, the floor's pattern and the picture's settings to a model.
void decorate(mjSpec* spec, const RenderOptions& options);

/// Add to what is drawn, as far as the scene has room; an arrow shorter than 1 mm is dropped.
void add_arrow(mjvScene& scene, const Arrow& arrow);
void add_line(mjvScene& scene, const Line& line);
void add_centre(mjvScene& scene, const Eigen::Vector3d& centre);

} // namespace bf::physics
