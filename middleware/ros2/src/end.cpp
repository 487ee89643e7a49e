#include "end.hpp"

#include "bf/middleware/fields.hpp"
#include "bf/middleware/topic_end.hpp"
#include "messages.hpp"

#include <cstdint>
#include <utility>

namespace bf::ros2 {

namespace {

class ServedTopics final : public middleware::ServedTopics {
  public:
    explicit ServedTopics(const NodeOptions& node) : node_(node) {}

    void open(const middleware::RobotDescription& robot) override {
        node_.open();
        joints_ = node_.advertise(messages::joint_state(), "joint_states", {});
        clock_ = node_.advertise(messages::clock(), "/clock", {});
        for (const auto& name : robot.wrenches)
            wrenches_.push_back(node_.advertise(messages::wrench(), middleware::plain(name) + "/wrench", {}));
        for (const auto& name : robot.imus)
            imus_.push_back(node_.advertise(messages::imu(), middleware::plain(name) + "/imu", {}));
        messages::assign(joint_->name, robot.joints);
        wrench_names_ = robot.wrenches;
        imu_names_ = robot.imus;
    }
    void close() noexcept override { node_.close(); }

    void hear_references(const std::string& topic,
                         std::function<std::string(std::span<const double>)> taken) override {
        hear(messages::numbers(), topic, {1, true}, [taken = std::move(taken)](const void* message) {
            const auto& data = static_cast<const messages::Numbers*>(message)->data;
            return taken({data.data, data.size});
        });
    }
    void hear_trajectories(const std::string& topic,
                           std::function<std::string(const middleware::JointTrajectory&)> taken) override {
        hear(messages::trajectory(), topic, {}, [taken = std::move(taken)](const void* message) {
            const auto& from = *static_cast<const messages::Trajectory*>(message);
            middleware::JointTrajectory to;
            for (std::size_t i = 0; i < from.joint_names.size; ++i)
                to.joints.push_back(messages::text(from.joint_names.data[i]));
            const auto numbers = [](const rosidl_runtime_c__double__Sequence& all) {
                return std::vector<double>(all.data, all.data + all.size);
            };
            for (std::size_t i = 0; i < from.points.size; ++i) {
                const auto& point = from.points.data[i];
                to.points.push_back({point.time_from_start.sec + point.time_from_start.nanosec / 1e9,
                                     numbers(point.positions), numbers(point.velocities)});
            }
            return taken(to);
        });
    }
    void offer(const std::string& name, std::function<std::string(bool&)> answer) override {
        services_.push_back(messages::serve(node_, "~/" + name, std::move(answer)));
    }
    void offer(const std::string& name, std::function<std::string(bool, bool&)> answer) override {
        services_.push_back(messages::serve(node_, "~/" + name, std::move(answer)));
    }

    void add(const std::shared_ptr<Sender>& sender) override { node_.add(sender); }
    middleware::Bell& bell() noexcept override { return node_.bell(); }

    void send_states(const middleware::JointStates& states) override {
        joint_->header.stamp = messages::time_of(states.stamp);
        messages::assign(joint_->position, states.position);
        messages::assign(joint_->velocity, states.velocity);
        messages::assign(joint_->effort, states.effort);
        joints_->publish(joint_.get());
    }
    void send_wrench(int sensor, const Eigen::Matrix<double, 6, 1>& w, double stamp) override {
        const auto i = static_cast<std::size_t>(sensor);
        wrench_->header.stamp = messages::time_of(stamp);
        messages::assign(wrench_->header.frame_id, wrench_names_[i]);
        wrench_->wrench.force = {w[0], w[1], w[2]};
        wrench_->wrench.torque = {w[3], w[4], w[5]};
        wrenches_[i]->publish(wrench_.get());
    }
    void send_imu(int sensor, const Eigen::Matrix<double, 10, 1>& m, double stamp) override {
        const auto i = static_cast<std::size_t>(sensor);
        imu_->header.stamp = messages::time_of(stamp);
        messages::assign(imu_->header.frame_id, imu_names_[i]);
        imu_->orientation = {m[0], m[1], m[2], m[3]};
        imu_->linear_acceleration = {m[4], m[5], m[6]};
        imu_->angular_velocity = {m[7], m[8], m[9]};
        imus_[i]->publish(imu_.get());
    }
    void send_time(double time) override {
        time_->clock = messages::time_of(time);
        clock_->publish(time_.get());
    }
    int readers() const noexcept override {
        int all = joints_->readers();
        for (const auto* list : {&wrenches_, &imus_})
            for (const auto& each : *list) all += each->readers();
        return all;
    }
    int writers() const noexcept override {
        int all = 0;
        for (const auto& each : commands_) all += each->writers();
        return all;
    }
    bool has_double() const noexcept override { return joints_->others() > 0; }
    std::string node_of(std::uint64_t program) const override {
        std::string node;
        for (const auto& each : commands_)
            if (node.empty()) node = each->publisher(program);
        return node;
    }

  private:
    void hear(const MessageMemory& type, const std::string& topic, const Quality& quality,
              std::function<std::string(const void*)> taken) {
        commands_.push_back(node_.subscribe(type, topic, quality,
                                            [this, name = node_.resolve(topic), taken = std::move(taken)](
                                                const void* message, std::uint64_t from) {
                                                if (const auto what = taken(message); what.empty())
                                                    news.came(from);
                                                else
                                                    news.left_out(name, from, what);
                                            }));
    }

    Node node_;
    std::vector<std::string> wrench_names_, imu_names_;
    std::shared_ptr<Publisher> joints_, clock_;
    std::vector<std::shared_ptr<Publisher>> wrenches_, imus_;
    std::vector<std::shared_ptr<Subscription>> commands_;
    std::vector<std::shared_ptr<Service>> services_;
    std::shared_ptr<messages::JointState> joint_ =
        messages::make<messages::JointState>(messages::joint_state());
    std::shared_ptr<messages::Clock> time_ = messages::make<messages::Clock>(messages::clock());
    std::shared_ptr<messages::Wrench> wrench_ = messages::make<messages::Wrench>(messages::wrench());
    std::shared_ptr<messages::Imu> imu_ = messages::make<messages::Imu>(messages::imu());
};

} // namespace

std::unique_ptr<middleware::RobotEnd> make_end(const NodeOptions& node, const CommandTopics& commands,
                                               bool waits) {
    return middleware::make_topic_end("ROS 2 robot in the namespace " + node.name_space,
                                      std::make_unique<ServedTopics>(node), commands, waits);
}

} // namespace bf::ros2
