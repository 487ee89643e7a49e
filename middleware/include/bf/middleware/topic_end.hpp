// A robot of ours behind joint states and topics of commands, as ROS has them.
#pragma once

#include "bf/middleware/driver_news.hpp"
#include "bf/middleware/joint_path.hpp"
#include "bf/middleware/outbox.hpp"
#include "bf/middleware/robot_host.hpp"
#include "bf/middleware/topic_robot.hpp"

#include <functional>
#include <memory>
#include <span>
#include <string>

namespace bf::middleware {

/// The topics and services of a robot that this program serves, by its middleware. It calls what it is given
/// in a thread of its own. Throws std::runtime_error.
class ServedTopics {
  public:
    virtual ~ServedTopics() = default;
    /// Joins the network, and shows joint_states, SENSOR/wrench, SENSOR/imu and /clock.
    virtual void open(const RobotDescription& robot) = 0;
    /// Nothing is called any more when this returns.
    virtual void close() noexcept = 0;

    /// `taken` says of a command that it leaves out what was sent, for the news; empty: it has taken it.
    virtual void hear_references(const std::string& topic,
                                 std::function<std::string(std::span<const double>)> taken) = 0;
    virtual void hear_trajectories(const std::string& topic,
                                   std::function<std::string(const JointTrajectory&)> taken) = 0;
    /// Services ROBOT/NAME of std_srvs: Trigger, and SetBool with what is asked. They answer whether it is
    /// done, and why not.
    virtual void offer(const std::string& name, std::function<std::string(bool& is_done)> answer) = 0;
    virtual void offer(const std::string& name,
                       std::function<std::string(bool asked, bool& is_done)> answer) = 0;
    /// Of commands, also those of another type, in the thread that hears them.
    DriverNews news;

    /// The thread that sends looks at it as long as somebody else has it, too.
    virtual void add(const std::shared_ptr<Sender>& sender) = 0;
    virtual Bell& bell() noexcept = 0; ///< wakes that thread

    // In that thread.
    virtual void send_states(const JointStates& states) = 0;
    /// Of a sensor, by its number in the description: force and torque.
    virtual void send_wrench(int sensor, const Eigen::Matrix<double, 6, 1>& wrench, double stamp) = 0;
    /// Orientation x y z w, linear acceleration, angular velocity.
    virtual void send_imu(int sensor, const Eigen::Matrix<double, 10, 1>& imu, double stamp) = 0;
    virtual void send_time(double time) = 0;
    virtual int readers() const noexcept = 0; ///< of states, wrenches and IMUs
    virtual int writers() const noexcept = 0; ///< of commands
    /// The name of a node of the program with that number, which has sent commands; empty: it is not known.
    virtual std::string node_of(std::uint64_t program) const = 0;
    /// Does another program show a robot in this one's place?
    virtual bool has_double() const noexcept = 0;
};

/// What carries states and commands of a served robot over them, where controllers listen to such commands.
/// `name` is how users call it.
std::unique_ptr<RobotEnd> make_topic_end(std::string name, std::unique_ptr<ServedTopics> topics,
                                         const RobotCommandTopics& commands, bool waits);

} // namespace bf::middleware
