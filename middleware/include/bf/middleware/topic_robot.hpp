// Robots behind joint states and topics of commands, as ROS has them.
#pragma once

#include "bf/middleware/threaded_robot.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bf::middleware {

/// A message of joint states. What it does not tell of all of its joints is of another size.
struct JointStates {
    const std::vector<std::string>& names;
    std::span<const double> position, velocity, effort;
    double stamp;           ///< of its header, s
    std::uint64_t from = 0; ///< a number of the program that has sent them; 0: it is not known
};

/// A topic that a robot's controller listens to.
class CommandTopic {
  public:
    virtual ~CommandTopic() = default;
    virtual int readers() const noexcept = 0;
    /// Values of all joints; `duration` says how long the way to them takes, where the topic takes ways, s.
    virtual void send(std::span<const double> values, double duration) noexcept = 0;
};

/// The topics of a robot, by its middleware, which calls what it is given in a thread of its own. What is
/// heard ends with what it returns. Throws std::runtime_error. It is not for steps.
class RobotTopics {
  public:
    virtual ~RobotTopics() = default;
    virtual void open() = 0;
    /// Waits until the last commands are heard, at most `longest_farewell` s.
    virtual void close() noexcept = 0;
    virtual std::shared_ptr<void> hear_states(const std::string& topic,
                                              std::function<void(const JointStates&)> taken) = 0;
    /// Force and torque, and the stamp of the header, s.
    virtual std::shared_ptr<void> hear_wrenches(
        const std::string& topic,
        std::function<void(const Eigen::Matrix<double, 6, 1>&, double stamp)> taken) = 0;
    /// Orientation x y z w, linear acceleration, angular velocity, and the stamp of the header, s.
    virtual std::shared_ptr<void> hear_imu(
        const std::string& topic,
        std::function<void(const Eigen::Matrix<double, 10, 1>&, double stamp)> taken) = 0;
    /// The time that drives the robot, s, which may stand still; null: nobody tells it.
    virtual std::shared_ptr<void> hear_time(std::function<void(double)>) { return nullptr; }
    virtual std::unique_ptr<CommandTopic> commands(const std::string& topic) = 0;
    virtual std::unique_ptr<CommandTopic> ways(const std::string& topic,
                                               const std::vector<std::string>& joints) = 0;
    /// How long nobody may be known to listen to commands, though somebody does, s.
    virtual double longest_search() const noexcept { return 0; }
    /// Is somebody known to listen to that topic of commands, connected to it or on his way?
    virtual bool has_listener(const std::string&) { return false; }
    /// Another node that sends to one of the topics of commands; empty: none does.
    virtual std::string other_driver() { return ""; }
    /// Why what came is not taken, such as who sends another type, or why the robot did no step; empty:
    /// nothing is wrong.
    virtual std::string refusal() const = 0;

    /// Lets a robot that is stepped stand still, up to that time of now(). Throws std::runtime_error.
    virtual void halt(double end);
    /// Asks it for a step, which has no answer; false: it is not asked.
    virtual bool step() noexcept { return false; }
    /// Is it a robot that lets itself be told that no command follows, as those of bf serve?
    virtual bool takes_joints_back() noexcept { return false; }
    /// Tells it so, behind the last command, and waits until it is heard, at most `longest_farewell` s, in an
    /// interrupt, too. False: it does not answer.
    virtual bool let_go() noexcept { return false; }
    static constexpr double longest_farewell = 1;
};

/// What controllers listen to; empty: there is none.
struct RobotCommandTopics {
    std::string effort, velocity, position, trajectory;
};

struct TopicRobotOptions {
    std::string kind;                ///< how messages begin, such as "ROS 1 robot"
    std::vector<std::string> joints; ///< in the order of the diagram
    std::string states;              ///< topic of the joint states
    RobotCommandTopics commands;
    std::vector<std::string> wrenches, imus; ///< "sensor=topic" each
    bool is_clock;                           ///< the robot's time is that of its messages
    double patience;                         ///< of the start, until it says what is missing, s
    double step_size = 0; ///< of a robot that stands still until it is commanded, s; 0: its time goes on
};

/// A driver whose calls wait. Nothing is opened yet.
WaitingDriver make_topic_robot(std::unique_ptr<RobotTopics> topics, const TopicRobotOptions& options);

/// Numbers of the toolbox's inertial sensors: R = R_z(yaw) R_y(pitch) R_x(roll), from x y z w.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Vector4d& quaternion);
/// The other way, x y z w.
Eigen::Vector4d quaternion_of(const Eigen::Vector3d& roll_pitch_yaw);

} // namespace bf::middleware
