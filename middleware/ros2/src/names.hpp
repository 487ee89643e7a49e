// Names of ROS 2, by the functions of rcl and rmw that know their rules.
#pragma once

#include "bf/middleware/names.hpp"

namespace bf::ros2 {

extern const middleware::NameRules name_rules;

} // namespace bf::ros2
