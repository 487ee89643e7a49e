// Names of ROS 1's graph (https://wiki.ros.org/Names).
#pragma once

#include "bf/middleware/names.hpp"

namespace bf::ros1 {

extern const middleware::NameRules name_rules;

} // namespace bf::ros1
