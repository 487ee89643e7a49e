// A robot behind the topics of ROS 2's controllers, and our robots behind the same topics.
#pragma once

#include "bf/middleware/threaded_robot.hpp"
#include "node.hpp"

#include <string>
#include <vector>

namespace bf::ros2 {

/// What controllers of ros2_control listen to, by the names that their configurations mostly have; empty:
/// there is none.
struct CommandTopics {
    std::string effort = "effort_controller/commands", velocity = "velocity_controller/commands",
                position = "position_controller/commands",
                trajectory = "joint_trajectory_controller/joint_trajectory";
};

/// What a diagram drives.
struct RobotOptions {
    NodeOptions node;
    std::vector<std::string> joints; ///< in the order of the diagram
    std::string states;              ///< topic of sensor_msgs/msg/JointState
    CommandTopics commands;
    std::vector<std::string> wrenches, imus; ///< "sensor=topic" each
    bool use_sim_time;                       ///< the robot's time is that of its messages
    double
        step_size; ///< of a robot that stands still until it is commanded, s; 0: its time goes on by itself
    double start_timeout; ///< s
};

/// A driver whose calls wait. Nothing is opened yet.
middleware::WaitingDriver make_driver(const RobotOptions& options);

/// Numbers of the toolbox's inertial sensors as an orientation, x y z w: R = R_z(yaw) R_y(pitch) R_x(roll).
Eigen::Vector4d quaternion_of(const Eigen::Vector3d& roll_pitch_yaw);

} // namespace bf::ros2
