// Which middleware the user asks ROS 2 for.
#pragma once

namespace bf::ros2 {

/// The variable that says so.
constexpr const char* rmw_choice = "RMW_IMPLEMENTATION";

/// To be called once librcl is there.
__attribute__((visibility("default"))) void give_rmw_choice_back();

} // namespace bf::ros2
