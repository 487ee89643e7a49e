#include "robot.hpp"

#include "bf/middleware/clock.hpp"
#include "messages.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace bf::ros2 {

using middleware::JointStates, middleware::now;

namespace {

class Commands final : public middleware::CommandTopic {
  public:
    explicit Commands(std::shared_ptr<Publisher> publisher) : publisher_(std::move(publisher)) {}
    int readers() const noexcept override { return publisher_->readers(); }
    void send(std::span<const double> values, double) noexcept override {
        messages::assign(numbers_->data, values);
        publisher_->publish(numbers_.get());
    }

  private:
    const std::shared_ptr<Publisher> publisher_;
    const std::shared_ptr<messages::Numbers> numbers_ =
        messages::make<messages::Numbers>(messages::numbers());
};

/// Ways of one point.
class Ways final : public middleware::CommandTopic {
  public:
    Ways(std::shared_ptr<Publisher> publisher, const std::vector<std::string>& joints)
        : publisher_(std::move(publisher)) {
        messages::assign(way_->joint_names, joints);
        trajectory_msgs__msg__JointTrajectoryPoint__Sequence__init(&way_->points, 1);
    }
    int readers() const noexcept override { return publisher_->readers(); }
    void send(std::span<const double> values, double duration) noexcept override {
        auto& point = way_->points.data[0];
        messages::assign(point.positions, values);
        const auto time = messages::time_of(duration);
        point.time_from_start.sec = time.sec;
        point.time_from_start.nanosec = time.nanosec;
        publisher_->publish(way_.get());
    }

  private:
    const std::shared_ptr<Publisher> publisher_;
    const std::shared_ptr<messages::Trajectory> way_ =
        messages::make<messages::Trajectory>(messages::trajectory());
};

class Topics final : public middleware::RobotTopics {
  public:
    Topics(const NodeOptions& options, bool is_stepped)
        // Best effort hears all writers, and only the newest counts. A robot that stands still sends each
        // state once, so none may be lost.
        : node_(options), newest_{1, is_stepped} {}

    void open() override {
        node_.open();
        tell("");
        release_ = messages::trigger(node_, "robot/release",
                                     [this](bool, const std::string&) { is_released_ = true; });
    }
    void close() noexcept override {
        wait_until_heard(now() + longest_farewell);
        node_.close();
        commands_.clear();
        step_ = release_ = {};
    }
    std::string refusal() const override {
        const std::lock_guard lock(mutex_);
        return why_not_;
    }
    double longest_search() const noexcept override { return 3; }
    std::string other_driver() override {
        std::string other;
        for (const auto& each : commands_)
            if (other.empty()) other = each->another();
        return other;
    }

    std::shared_ptr<void> hear_states(const std::string& topic,
                                      std::function<void(const JointStates&)> taken) override {
        return hear<messages::JointState>(
            messages::joint_state(), topic,
            [names = std::vector<std::string>(), taken = std::move(taken)](const auto& state,
                                                                           std::uint64_t from) mutable {
                const auto is_same = [](const std::string& name, const rosidl_runtime_c__String& its) {
                    return name == its.data;
                };
                const auto& its = state.name; // mostly those of the message before
                if (!std::equal(names.begin(), names.end(), its.data, its.data + its.size, is_same)) {
                    names.clear();
                    for (std::size_t i = 0; i < its.size; ++i) names.push_back(messages::text(its.data[i]));
                }
                taken({names,
                       {state.position.data, state.position.size},
                       {state.velocity.data, state.velocity.size},
                       {state.effort.data, state.effort.size},
                       messages::seconds(state.header.stamp),
                       from});
            });
    }
    std::shared_ptr<void> hear_wrenches(
        const std::string& topic,
        std::function<void(const Eigen::Matrix<double, 6, 1>&, double)> taken) override {
        return hear<messages::Wrench>(
            messages::wrench(), topic, [taken = std::move(taken)](const auto& message, std::uint64_t) {
                const auto &f = message.wrench.force, &m = message.wrench.torque;
                taken({f.x, f.y, f.z, m.x, m.y, m.z}, messages::seconds(message.header.stamp));
            });
    }
    std::shared_ptr<void> hear_imu(
        const std::string& topic,
        std::function<void(const Eigen::Matrix<double, 10, 1>&, double)> taken) override {
        return hear<messages::Imu>(
            messages::imu(), topic, [taken = std::move(taken)](const auto& message, std::uint64_t) {
                const auto& q = message.orientation;
                const auto &a = message.linear_acceleration, &omega = message.angular_velocity;
                taken({q.x, q.y, q.z, q.w, a.x, a.y, a.z, omega.x, omega.y, omega.z},
                      messages::seconds(message.header.stamp));
            });
    }
    std::shared_ptr<void> hear_time(std::function<void(double)> taken) override {
        return hear<messages::Clock>(messages::clock(), "/clock",
                                     [taken = std::move(taken)](const auto& time, std::uint64_t) {
                                         taken(messages::seconds(time.clock));
                                     });
    }
    std::unique_ptr<middleware::CommandTopic> commands(const std::string& topic) override {
        return std::make_unique<Commands>(advertise(messages::numbers(), topic));
    }
    std::unique_ptr<middleware::CommandTopic> ways(const std::string& topic,
                                                   const std::vector<std::string>& joints) override {
        return std::make_unique<Ways>(advertise(messages::trajectory(), topic), joints);
    }

    void halt(double end) override {
        tell("");
        const auto answered = [this](bool is_done, const std::string& why) {
            if (!is_done) tell(why);
        };
        enum { nothing, good, bad };
        const auto answer = std::make_shared<std::atomic<int>>(nothing); // which may come when this is over
        step_ = messages::trigger(node_, "robot/step", answered);
        auto pause = messages::set_bool(node_, "robot/pause", true,
                                        [answer, answered](bool is_done, const std::string& why) {
                                            answered(is_done, why);
                                            *answer = is_done ? good : bad;
                                        });
        if (!wait_until(end, [&] { return step_.has_server() && pause.has_server(); }))
            throw std::runtime_error("it has no services 'robot/step' and 'robot/pause', as those of bf "
                                     "serve --ros2; with step_size: 0 its time goes on by itself");
        if (pause.send()) wait_until(end, [&] { return *answer != nothing; });
        if (*answer != good)
            throw std::runtime_error(
                "it does not stand still: " +
                (*answer == bad ? refusal() : "its service 'robot/pause' does not answer"));
    }
    bool step() noexcept override { return step_.send(); }
    bool takes_joints_back() noexcept override { return release_.client && release_.has_server(); }
    bool let_go() noexcept override {
        if (!takes_joints_back()) return false;
        const double end = now() + longest_farewell;
        wait_until_heard(end);
        is_released_ = false;
        if (!release_.send()) return false;
        while (!is_released_ && now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return is_released_;
    }

  private:
    template <class T, class Taken>
    std::shared_ptr<void> hear(const MessageMemory& type, const std::string& topic, Taken taken) {
        return node_.subscribe(type, topic, newest_,
                               [taken = std::move(taken)](const void* message, std::uint64_t from) mutable {
                                   taken(*static_cast<const T*>(message), from);
                               });
    }
    std::shared_ptr<Publisher> advertise(const MessageMemory& type, const std::string& topic) {
        commands_.push_back(node_.advertise(type, topic, {1, true}));
        return commands_.back();
    }
    void wait_until_heard(double end) const noexcept {
        for (const auto& each : commands_) each->wait_until_heard(end - now());
    }
    void tell(const std::string& why) {
        const std::lock_guard lock(mutex_);
        why_not_ = why;
    }

    Node node_;
    const Quality newest_;
    /// They stay until the node ends: where messages are lost, the last command is sent again.
    std::vector<std::shared_ptr<Publisher>> commands_;
    messages::Call step_, release_;
    std::atomic<bool> is_released_{false};
    mutable std::mutex mutex_;
    std::string why_not_; ///< it did no step; with the lock
};

} // namespace

std::unique_ptr<middleware::RobotTopics> make_robot_topics(const NodeOptions& node, bool is_stepped) {
    return std::make_unique<Topics>(node, is_stepped);
}

} // namespace bf::ros2
