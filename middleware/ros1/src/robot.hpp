// Robots behind the topics of ROS 1's controllers: those of others, and ours.
#pragma once

#include "bf/middleware/robot_host.hpp"
#include "bf/middleware/topic_robot.hpp"
#include "node.hpp"

#include <memory>

namespace bf::ros1 {

/// What controllers of ros_control listen to, by the names that their configurations mostly have.
struct CommandTopics : middleware::RobotCommandTopics {
    CommandTopics()
        : RobotCommandTopics{"effort_controller/command", "velocity_controller/command",
                             "position_controller/command", "joint_trajectory_controller/command"} {}
};

/// Numbers of a field of a message.
std::vector<double> numbers(const MessageType& type, const Message& message, const char* path);

/// Serves a robot of ours in a namespace, under those topics.
std::unique_ptr<middleware::RobotEnd> make_end(const std::string& name_space, bool waits);

} // namespace bf::ros1
