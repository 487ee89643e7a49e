// A robot behind the topics of ROS 2's controllers, and our robots behind the same topics.
#pragma once

#include "bf/middleware/topic_robot.hpp"
#include "node.hpp"

#include <memory>

namespace bf::ros2 {

/// What controllers of ros2_control listen to, by the names that their configurations mostly have.
struct CommandTopics : middleware::RobotCommandTopics {
    CommandTopics()
        : RobotCommandTopics{"effort_controller/commands", "velocity_controller/commands",
                             "position_controller/commands", "joint_trajectory_controller/joint_trajectory"} {
    }
};

/// Those of a robot. One that `is_stepped` stands still until it is commanded, and sends each state once.
std::unique_ptr<middleware::RobotTopics> make_robot_topics(const NodeOptions& node, bool is_stepped);

} // namespace bf::ros2
