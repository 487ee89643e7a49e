#pragma once

#include "bf/service/scenery.hpp"

namespace bf::tools {

/// Makes those of MujocoWorld blocks; none in a build without robots. Meshes are loaded once.
service::MakeSceneries scenery_maker();

} // namespace bf::tools
