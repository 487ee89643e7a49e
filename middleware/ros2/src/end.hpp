// A robot of ours that programs of ROS 2 drive.
#pragma once

#include "bf/middleware/robot_host.hpp"
#include "robot.hpp"

#include <memory>
#include <string>

namespace bf::ros2 {

/// Serves it in a namespace, under the topics that controllers of ros2_control have.
std::unique_ptr<middleware::RobotEnd> make_end(const NodeOptions& node, const CommandTopics& commands,
                                               bool waits);

} // namespace bf::ros2
