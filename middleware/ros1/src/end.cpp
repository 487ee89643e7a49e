// A robot of ours that programs of ROS 1 drive.
#include "bf/middleware/topic_end.hpp"
#include "draft.hpp"
#include "master.hpp"
#include "robot.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <ros/network.h>
#include <ros/xmlrpc_manager.h>
#include <utility>

namespace bf::ros1 {

namespace {

class ServedTopics final : public middleware::ServedTopics {
  public:
    explicit ServedTopics(const std::string& name_space)
        : node_(
              {.name = "robot", .remap = {"__ns:=" + name_space}, .name_space = name_space, .joins = true}) {}

    void open(const middleware::RobotDescription& robot) override {
        node_.open();
        joints_ = node_.advertise({"joint_states", joint_.type()});
        clock_ = node_.advertise({"/clock", time_.type()});
        for (const auto& name : robot.wrenches)
            wrenches_.push_back(
                {name, node_.advertise({middleware::plain(name) + "/wrench", wrench_.type()})});
        for (const auto& name : robot.imus)
            imus_.push_back({name, node_.advertise({middleware::plain(name) + "/imu", imu_.type()})});
        joint_.set("name", robot.joints);
    }
    void close() noexcept override {
        node_.stop_sending();
        services_.clear();
        commands_.clear();
        wrenches_.clear();
        imus_.clear();
        joints_.reset();
        clock_.reset();
        node_.close();
    }

    void hear_references(const std::string& topic,
                         std::function<std::string(std::span<const double>)> taken) override {
        hear(topic, 1, MessageType::find("std_msgs/Float64MultiArray"),
             [taken = std::move(taken)](const MessageType& type, const Message& message) {
                 return taken(numbers(type, message, "data"));
             });
    }
    void hear_trajectories(const std::string& topic,
                           std::function<std::string(const middleware::JointTrajectory&)> taken) override {
        hear(topic, 10, MessageType::find("trajectory_msgs/JointTrajectory"),
             [taken = std::move(taken),
              point_type = MessageType::find("trajectory_msgs/JointTrajectoryPoint")](
                 const MessageType& type, const Message& message) {
                 middleware::JointTrajectory to{texts_of(type.value(message, "joint_names")), {}};
                 type.each(message, "points", *point_type, [&](const Message& point) {
                     to.points.push_back({numbers(*point_type, point, "time_from_start")[0],
                                          numbers(*point_type, point, "positions"),
                                          numbers(*point_type, point, "velocities")});
                 });
                 return taken(to);
             });
    }
    void offer(const std::string& name, std::function<std::string(bool&)> answer) override {
        offer(name, "std_srvs/Trigger",
              [answer = std::move(answer)](const auto&, const auto&, bool& is_done) {
                  return answer(is_done);
              });
    }
    void offer(const std::string& name, std::function<std::string(bool, bool&)> answer) override {
        offer(name, "std_srvs/SetBool",
              [answer = std::move(answer)](const MessageType& type, const Message& request, bool& is_done) {
                  return answer(numbers(type, request, "data")[0] != 0, is_done);
              });
    }
    void add(const std::shared_ptr<middleware::Sender>& sender) override { node_.add(sender); }
    middleware::Bell& bell() noexcept override { return node_.bell(); }

    void send_states(const middleware::JointStates& states) override {
        joint_.set("header.stamp", states.stamp);
        joint_.set("position", states.position);
        joint_.set("velocity", states.velocity);
        joint_.set("effort", states.effort);
        joints_->publish(joint_.raw());
    }
    void send_wrench(int sensor, const Eigen::Matrix<double, 6, 1>& w, double stamp) override {
        const auto& [name, topic] = wrenches_[static_cast<std::size_t>(sensor)];
        wrench_.set("header.stamp", stamp);
        wrench_.set("header.frame_id", {name});
        wrench_.set("wrench.force", {w.data(), 3});
        wrench_.set("wrench.torque", {w.data() + 3, 3});
        topic->publish(wrench_.raw());
    }
    void send_imu(int sensor, const Eigen::Matrix<double, 10, 1>& m, double stamp) override {
        const auto& [name, topic] = imus_[static_cast<std::size_t>(sensor)];
        imu_.set("header.stamp", stamp);
        imu_.set("header.frame_id", {name});
        imu_.set("orientation", {m.data(), 4});
        imu_.set("linear_acceleration", {m.data() + 4, 3});
        imu_.set("angular_velocity", {m.data() + 7, 3});
        topic->publish(imu_.raw());
    }
    void send_time(double time) override {
        time_.set("clock", time);
        clock_->publish(time_.raw());
    }
    int readers() const noexcept override {
        int all = joints_->readers();
        for (const auto* list : {&wrenches_, &imus_})
            for (const auto& each : *list) all += each.topic->readers();
        return all;
    }
    int writers() const noexcept override try {
        int all = 0;
        for (const auto& each : commands_) all += static_cast<int>(each->getNumPublishers());
        const double time = middleware::now();
        if (all == 0 || time - heard_ < silence) return all;
        if (time - looked_ > silence) {
            looked_ = time;
            killed_ = killed();
        }
        return all - killed_;
    } catch (const XmlRpc::XmlRpcException&) { // what roscpp tells of itself is something else
        return 1;
    }
    /// The master ends a node when another one of its name comes.
    bool has_double() const noexcept override { return !ros::ok(); }
    std::string node_of(std::uint64_t program) const override {
        const std::lock_guard lock(mutex_);
        const auto found = nodes_.find(program);
        return found == nodes_.end() ? "" : found->second;
    }

  private:
    struct Sensor {
        std::string name;
        std::shared_ptr<Publisher> topic;
    };
    void hear(const std::string& topic, int depth, const std::shared_ptr<const MessageType>& type,
              std::function<std::string(const MessageType&, const Message&)> taken) {
        const auto leave_out = [this, name = node_.resolve(topic)](const std::string& what,
                                                                   const std::string& from) {
            news.left_out(name, number_of(from), what);
        };
        const auto came = [this](const std::string& from) {
            const std::lock_guard lock(mutex_);
            nodes_.try_emplace(number_of(from), from);
        };
        commands_.push_back(node_.hear(
            {topic, type, depth},
            [=, this, taken = std::move(taken)](const Message& message, const std::string& from) {
                heard_ = middleware::now();
                came(from);
                if (const auto what = taken(*type, message); what.empty())
                    news.came(number_of(from));
                else
                    leave_out(what, from);
            },
            [=](const std::string& what, const std::string& from) {
                came(from);
                leave_out(what, from);
            }));
    }
    template <class F> void offer(const std::string& name, const char* type, F&& answer) {
        const auto its = ServiceType::find(type);
        services_.push_back(node_.offer(
            "robot/" + name, its,
            [this, its, answer = std::forward<F>(answer)](const Message& request, Message& response) mutable {
                heard_ = middleware::now();
                bool is_done = false;
                const std::string why = answer(*its.request, request, is_done);
                const double number = is_done;
                its.response->field("success")->write(&response, &number, 1);
                its.response->field("message")->write(&response, {why});
            }));
    }

    /// roscpp counts a program that was killed, as it tries to reach it for ever. How many of those who send
    /// commands are such?
    int killed() const {
        XmlRpc::XmlRpcValue caller;
        caller[0] = ros::this_node::getName();
        // Of each connection: number, address of the other node, direction, transport, topic, ...
        auto all = ask({ros::network::getHost(), ros::XMLRPCManager::instance()->getServerPort()},
                       "getBusInfo", caller, 1);
        int count = 0;
        for (int i = 0; all && i < all->size(); ++i) {
            const auto text = [&](int part) { return static_cast<std::string>((*all)[i][part]); };
            const auto is_its = [&](const auto& each) { return each->getTopic() == text(4); };
            Address its{};
            count += text(2) == "i" && std::ranges::any_of(commands_, is_its) &&
                     ros::network::splitURI(text(1), its.host, its.port) && is_refused(its);
        }
        return count;
    }

    static constexpr double silence = 1; ///< s without a command or call until it looks for killed programs
    Node node_;
    std::atomic<double> heard_{0}; ///< when the last one came, s
    mutable double looked_ = 0;    ///< in the thread that sends, as the next
    mutable int killed_ = 0;
    Draft joint_{"sensor_msgs/JointState"}, time_{"rosgraph_msgs/Clock"},
        wrench_{"geometry_msgs/WrenchStamped"}, imu_{"sensor_msgs/Imu"};
    std::shared_ptr<Publisher> joints_, clock_;
    std::vector<Sensor> wrenches_, imus_;
    std::vector<std::shared_ptr<ros::Subscriber>> commands_;
    mutable std::mutex mutex_;                   ///< of the next
    std::map<std::uint64_t, std::string> nodes_; ///< that have sent to any of them
    std::vector<std::shared_ptr<ros::ServiceServer>> services_;
};

} // namespace

std::unique_ptr<middleware::RobotEnd> make_end(const std::string& name_space, bool waits) {
    return middleware::make_topic_end("ROS 1 robot in the namespace " + name_space,
                                      std::make_unique<ServedTopics>(name_space), CommandTopics(), waits);
}

} // namespace bf::ros1
