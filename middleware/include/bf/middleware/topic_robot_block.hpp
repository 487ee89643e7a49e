// The block Robot of middlewares that have topics.
#pragma once

#include "bf/middleware/names.hpp"
#include "bf/middleware/remote_robot.hpp"
#include "bf/middleware/topic_robot.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf::middleware {

/// What differs between such middlewares.
struct TopicRobotKind {
    const char* name;            ///< such as "ROS 2"
    const char* clock;           ///< name of the argument that lets the robot's time drive the loop
    RobotCommandTopics commands; ///< where none are said
    const NameRules& names;
};

class TopicRobotBlock : public RemoteRobot {
  public:
    TopicRobotBlock(const Arguments& arguments, const TopicRobotKind& kind);

  private:
    const TopicRobotKind kind_;

  public:
    Argument<std::string> name_space{
        this,
        "namespace",
        {.initial = "/", .doc = "of the robot, in which names are that do not begin with /"}};
    Argument<std::string> node{this, "node", {.initial = "blockfactory", .doc = "name of our node"}};
    Argument<std::vector<std::string>> remap{
        this, "remap", {.doc = "names that stand for others, each as from:=to"}};
    Argument<bool> is_clock{this,
                            kind_.clock,
                            {.initial = false,
                             .doc = "the robot's time is that of its states' headers, as of a simulator, "
                                    "which then drives the loop"}};
    Argument<double> step_size{
        this,
        "step_size",
        {.initial = 0,
         .minimum = 0,
         .maximum = 10,
         .doc = "of a robot that stands still until it is commanded, as bf serve has it, s: it goes on with "
                "each step of the diagram; 0: its time goes on by itself"}};
    Argument<std::string> states{
        this, "states", {.initial = "joint_states", .doc = "topic of JointState (sensor_msgs)"}};
    Argument<std::string> effort{this,
                                 "effort",
                                 {.initial = kind_.commands.effort,
                                  .doc = "topic of the mode Torque: Float64MultiArray (std_msgs), as an "
                                         "effort controller takes it; empty: there is none"}};
    Argument<std::string> velocity{
        this, "velocity", {.initial = kind_.commands.velocity, .doc = "of the mode Velocity, the same"}};
    Argument<std::string> position{
        this,
        "position",
        {.initial = kind_.commands.position, .doc = "of the mode Position Direct, the same"}};
    Argument<std::string> trajectory{
        this,
        "trajectory",
        {.initial = kind_.commands.trajectory,
         .doc = "of the mode Position: JointTrajectory (trajectory_msgs); empty: there is none"}};
    Argument<std::vector<std::string>> wrenches{
        this,
        "wrenches",
        {.doc = "force/torque sensors, each as name=topic of WrenchStamped (geometry_msgs)"}};
    Argument<std::vector<std::string>> imus{
        this, "imus", {.doc = "inertial sensors, each as name=topic of Imu (sensor_msgs)"}};
    ThreadArguments thread{this};

  protected:
    /// Nothing is opened yet.
    virtual std::unique_ptr<RobotTopics> make_topics() const = 0;

  private:
    std::unique_ptr<RobotLink> make_link() const final;
};

} // namespace bf::middleware
