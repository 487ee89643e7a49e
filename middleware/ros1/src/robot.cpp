// A robot behind joint states and the topics of ros_control's controllers.
#include "robot.hpp"

#include "asker.hpp"
#include "bf/middleware/topic_robot_block.hpp"
#include "draft.hpp"
#include "names.hpp"

#include <atomic>
#include <cstring>
#include <mutex>
#include <stdexcept>

namespace bf::ros1 {

std::vector<double> numbers(const MessageType& type, const Message& message, const char* path) {
    const Field& field = *type.field(path);
    std::vector<double> all(field.length(&message));
    field.read(&message, all.data(), all.size());
    return all;
}

namespace {

using middleware::JointStates;

class Commands final : public middleware::CommandTopic {
  public:
    Commands(Node& node, const std::string& topic) : publisher_(node.advertise({topic, draft_.type(), 1})) {}
    std::string topic() const { return publisher_->topic(); }
    int readers() const noexcept override { return publisher_->readers(); }
    void send(std::span<const double> values, double) noexcept override {
        draft_.set("data", values);
        publisher_->publish(draft_.raw());
    }

  private:
    Draft draft_{"std_msgs/Float64MultiArray"};
    const std::shared_ptr<Publisher> publisher_;
};

/// Ways of one point.
class Ways final : public middleware::CommandTopic {
  public:
    Ways(Node& node, const std::string& topic, const std::vector<std::string>& joints)
        : publisher_(node.advertise({topic, draft_.type(), 1})) {
        draft_.set("joint_names", joints);
    }
    std::string topic() const { return publisher_->topic(); }
    int readers() const noexcept override { return publisher_->readers(); }
    void send(std::span<const double> values, double duration) noexcept override {
        point_.set("positions", values);
        point_.set("time_from_start", duration);
        Raw raw = draft_.raw(); // the list of points is last, and empty
        constexpr std::uint32_t one = 1;
        std::memcpy(raw.bytes.data() + raw.bytes.size() - sizeof one, &one, sizeof one);
        point_.append_to(raw.bytes);
        publisher_->publish(raw);
    }

  private:
    Draft draft_{"trajectory_msgs/JointTrajectory"}, point_{"trajectory_msgs/JointTrajectoryPoint"};
    const std::shared_ptr<Publisher> publisher_;
};

class Topics final : public middleware::RobotTopics {
  public:
    explicit Topics(NodeOptions options) : node_(std::move(options)) {}
    void open() override {
        tell(""); // of a run before
        driven_.clear();
        node_.open();
    }
    void close() noexcept override {
        step_.reset();
        node_.close();
    }
    std::string refusal() const override {
        const std::lock_guard lock(mutex_);
        return refusal_;
    }

    std::shared_ptr<void> hear_states(const std::string& topic,
                                      std::function<void(const JointStates&)> taken) override {
        return hear(
            topic, "sensor_msgs/JointState",
            [taken = std::move(taken)](const MessageType& type, const Message& message, std::uint64_t from) {
                const auto names = texts_of(type.value(message, "name"));
                const auto position = numbers(type, message, "position"),
                           velocity = numbers(type, message, "velocity"),
                           effort = numbers(type, message, "effort");
                taken({names, position, velocity, effort, stamp(type, message), from});
            });
    }
    std::shared_ptr<void> hear_wrenches(
        const std::string& topic,
        std::function<void(const Eigen::Matrix<double, 6, 1>&, double)> taken) override {
        return hear(
            topic, "geometry_msgs/WrenchStamped",
            [taken = std::move(taken)](const MessageType& type, const Message& message, std::uint64_t) {
                Eigen::Matrix<double, 6, 1> wrench;
                type.field("wrench.force")->read(&message, wrench.data(), 3);
                type.field("wrench.torque")->read(&message, wrench.data() + 3, 3);
                taken(wrench, stamp(type, message));
            });
    }
    std::shared_ptr<void> hear_imu(
        const std::string& topic,
        std::function<void(const Eigen::Matrix<double, 10, 1>&, double)> taken) override {
        return hear(
            topic, "sensor_msgs/Imu",
            [taken = std::move(taken)](const MessageType& type, const Message& message, std::uint64_t) {
                Eigen::Matrix<double, 10, 1> imu;
                type.field("orientation")->read(&message, imu.data(), 4);
                type.field("linear_acceleration")->read(&message, imu.data() + 4, 3);
                type.field("angular_velocity")->read(&message, imu.data() + 7, 3);
                taken(imu, stamp(type, message));
            });
    }
    std::shared_ptr<void> hear_time(std::function<void(double)> taken) override {
        return hear("/clock", "rosgraph_msgs/Clock",
                    [taken = std::move(taken)](const MessageType& type, const Message& message,
                                               std::uint64_t) { taken(numbers(type, message, "clock")[0]); });
    }
    std::unique_ptr<middleware::CommandTopic> commands(const std::string& topic) override {
        return driving(std::make_unique<Commands>(node_, topic));
    }
    std::unique_ptr<middleware::CommandTopic> ways(const std::string& topic,
                                                   const std::vector<std::string>& joints) override {
        return driving(std::make_unique<Ways>(node_, topic, joints));
    }
    bool has_listener(const std::string& topic) override {
        return !Node::other(Node::Side::subscriber, {node_.resolve(topic)}).empty();
    }
    std::string other_driver() override {
        auto other = Node::other(Node::Side::publisher, driven_);
        // The master has others to answer.
        if (!other.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
        return other;
    }

    void halt(double end) override {
        tell("");
        const auto answered = [this](bool is_done, const std::string& why) {
            if (!is_done) tell(why);
        };
        step_ = std::make_unique<Asker>(node_.resolve("robot/step"), "std_srvs/Trigger", answered);
        std::atomic<bool> is_answered{false}, stands{false};
        Asker pause(node_.resolve("robot/pause"), "std_srvs/SetBool",
                    [&](bool is_done, const std::string& why) {
                        answered(is_done, why);
                        stands = is_done;
                        is_answered = true;
                    });
        if (!middleware::wait_until(end, [&] { return step_->has_server() && pause.has_server(); }))
            throw std::runtime_error(
                "it has no services 'robot/step' and 'robot/pause', as those of bf serve --ros1; with "
                "step_size: 0 its time goes on by itself");
        step_->begin();
        pause.begin();
        pause.ask();
        middleware::wait_until(end, [&] { return is_answered.load(); });
        if (!stands)
            throw std::runtime_error("it does not stand still: " +
                                     (is_answered ? refusal() : "its service 'robot/pause' does not answer"));
    }
    bool step() noexcept override {
        step_->ask();
        return true;
    }
    bool takes_joints_back() noexcept override try {
        return Caller(node_.resolve("robot/release"), ServiceType::find("std_srvs/Trigger")).has_server();
    } catch (const std::exception&) { // the master does not say so
        return false;
    }
    bool let_go() noexcept override try {
        std::atomic<bool> is_answered{false}, is_released{false};
        Asker release(node_.resolve("robot/release"), "std_srvs/Trigger",
                      [&](bool is_done, const std::string&) {
                          is_released = is_done;
                          is_answered = true;
                      });
        release.begin();
        release.ask();
        for (const double end = middleware::now() + longest_farewell;
             !is_answered && middleware::now() < end;)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return is_released;
    } catch (const std::exception&) { // it is told by the end of its topics alone
        return false;
    }

  private:
    template <class T> std::unique_ptr<T> driving(std::unique_ptr<T> topic) {
        driven_.push_back(topic->topic());
        return topic;
    }
    void tell(const std::string& why) {
        const std::lock_guard lock(mutex_);
        refusal_ = why;
    }
    std::shared_ptr<void> hear(const std::string& topic, const char* name,
                               std::function<void(const MessageType&, const Message&, std::uint64_t)> taken) {
        const auto type = MessageType::find(name);
        return node_.hear(
            {topic, type, 1},
            [type, taken = std::move(taken)](const Message& message, const std::string& from) {
                taken(*type, message, number_of(from));
            },
            [this](const std::string& what, const std::string& from) {
                tell("'" + from + "' sends " + what);
            });
    }
    static double stamp(const MessageType& type, const Message& message) {
        return numbers(type, message, "header.stamp")[0];
    }

    Node node_;
    std::vector<std::string> driven_; ///< topics of commands
    std::unique_ptr<Asker> step_;     ///< of a robot that is stepped
    mutable std::mutex mutex_;
    std::string refusal_; ///< with the lock
};

class RobotBlock final : public middleware::TopicRobotBlock {
  public:
    explicit RobotBlock(const Arguments& arguments)
        : TopicRobotBlock(arguments, {"ROS 1", "use_stamps", CommandTopics{}, name_rules}) {}

  private:
    std::unique_ptr<middleware::RobotTopics> make_topics() const override {
        return std::make_unique<Topics>(NodeOptions{.name = node, .remap = remap, .name_space = name_space});
    }
};

} // namespace

void add_robot(Library& library) {
    library.group("robot").add<RobotBlock>(
        "Robot",
        "A robot behind joint states and the topics of ros_control's controllers, in place of a world: the "
        "robot that GetMeasurement, GetSensor and SetReferences in its subsystem and below use. Positions, "
        "velocities and efforts are those of the joints that the messages name, in any order, of one program "
        "or several; the age is that of the oldest. Command messages have the joints in the order of "
        "`joints`, which the controllers are to have, too. A thread of its own reads, and sends what was "
        "commanded; when the run ends, or has not stepped for `silence` s, it sends zero efforts and "
        "velocities, and positions stay. Limits are not known. With `step_size` the thread steps the robot "
        "instead, in lockstep with the diagram, by commands and the service robot/step (std_srvs/Trigger). "
        "Errors: no master; no states, or not of all joints, or another node that sends commands, within "
        "start_timeout; in a step: the mode is refused where nobody listens to its topic; those of "
        "SharedMemory/Robot.");
}

} // namespace bf::ros1
