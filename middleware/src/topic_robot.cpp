#include "bf/middleware/topic_robot.hpp"

#include "bf/base/names.hpp"
#include "bf/core/value.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/outbox.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>

namespace bf::middleware {

using Eigen::VectorXd;

Eigen::Vector3d roll_pitch_yaw(const Eigen::Vector4d& q) {
    const Eigen::Matrix3d R = Eigen::Quaterniond(q).normalized().toRotationMatrix();
    return {std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
            std::atan2(R(1, 0), R(0, 0))};
}

namespace {

constexpr double longest_silence = 0.1; ///< s; older states are none
constexpr double slowest = 0.05;        ///< s; shortest way
constexpr double usual_speed = 0.5;     ///< rad/s of ways without a limit
constexpr double never = -std::numeric_limits<double>::infinity();

class TopicRobot final : public toolbox::RobotConnection {
  public:
    TopicRobot(std::unique_ptr<RobotTopics> topics, const TopicRobotOptions& options)
        : topics_(std::move(topics)), options_(options),
          n_(static_cast<Eigen::Index>(options.joints.size())) {
        for (std::size_t i = 0; i < options.joints.size(); ++i)
            ours_[options.joints[i]] = static_cast<Eigen::Index>(i);
    }
    ~TopicRobot() override { stop(); }

    void start() override {
        stop();
        const double end = now() + 0.8 * options_.start_timeout; // so that it says why itself
        is_open_ = true;
        topics_->open();
        for (auto* values : {&position_, &velocity_, &effort_}) values->setZero(n_);
        came_.setConstant(n_, never);
        for (auto* has : {&has_velocity_, &has_effort_}) has->setConstant(n_, false);
        stamp_ = 0;
        names_.clear();
        heard_.push_back(topics_->hear_states(options_.states, [this](const auto& states) { take(states); }));
        for (const auto& text : options_.wrenches) {
            VectorXd& values = wrenches_[text.substr(0, text.find('='))];
            values.setZero(wrench_size);
            heard_.push_back(
                topics_->hear_wrenches(text.substr(text.find('=') + 1), [this, &values](const auto& wrench) {
                    const std::lock_guard lock(mutex_);
                    values = wrench;
                }));
        }
        for (const auto& text : options_.imus) {
            VectorXd& values = imus_[text.substr(0, text.find('='))];
            values.setZero(imu_size);
            heard_.push_back(
                topics_->hear_imu(text.substr(text.find('=') + 1), [this, &values](const auto& imu) {
                    const std::lock_guard lock(mutex_);
                    values.head<3>() = roll_pitch_yaw(imu.template head<4>());
                    values.segment<6>(3) = imu.template tail<6>();
                }));
        }
        const auto add = [&](ControlMode mode, const std::string& topic) {
            if (topic.empty()) return;
            outputs_[mode] = {mode == ControlMode::position ? topics_->ways(topic, options_.joints)
                                                            : topics_->commands(topic),
                              topic};
        };
        add(ControlMode::torque, options_.commands.effort);
        add(ControlMode::velocity, options_.commands.velocity);
        add(ControlMode::position_direct, options_.commands.position);
        add(ControlMode::position, options_.commands.trajectory);
        const auto missing = [&] {
            std::vector<std::string> all;
            const std::lock_guard lock(mutex_);
            for (Eigen::Index i = 0; i < n_; ++i)
                if (came_[i] < 0) all.push_back(options_.joints[static_cast<std::size_t>(i)]);
            return all;
        };
        if (!wait_until(end, [&] { return missing().empty(); })) refuse(missing());
        // Who listens is known a little later than what was said.
        wait_until(std::min(end, now() + 0.3), [&] {
            return std::ranges::all_of(outputs_,
                                       [](const auto& its) { return its.second.end->readers() > 0; });
        });
    }
    void stop() noexcept override {
        if (!is_open_) return;
        leave();
        heard_.clear();
        outputs_.clear();
        topics_->close();
        is_open_ = false;
    }

    double age() const noexcept override {
        const std::lock_guard lock(mutex_);
        return now() - came_.minCoeff();
    }
    double time() const {
        const std::lock_guard lock(mutex_);
        return stamp_;
    }
    bool read(Measurement what, Eigen::Ref<VectorXd> values) noexcept override {
        if (age() > longest_silence) return told(false, "no state of all joints on", options_.states);
        const std::lock_guard lock(mutex_);
        switch (what) {
        case Measurement::joint_position: values = position_; return true;
        case Measurement::joint_velocity:
            values = velocity_;
            return told(has_velocity_.all(), "no velocities of all joints on", options_.states);
        case Measurement::joint_torque:
            values = effort_;
            return told(has_effort_.all(), "no efforts of all joints on", options_.states);
        default: return told(false, "no such measurement on", options_.states);
        }
    }
    bool read(Sensor kind, const std::string& name, Eigen::Ref<VectorXd> values) noexcept override {
        const std::lock_guard lock(mutex_);
        const auto& all = kind == Sensor::imu ? imus_ : wrenches_;
        const auto found = all.find(name);
        if (found == all.end()) return told(false, "no sensor", name);
        values = found->second;
        return true;
    }
    bool read(Limits, Eigen::Ref<VectorXd> minimum, Eigen::Ref<VectorXd> maximum) noexcept override {
        maximum.setConstant(std::numeric_limits<double>::infinity());
        minimum = -maximum;
        return true;
    }
    std::vector<std::string> sensors(Sensor kind) const override {
        std::vector<std::string> names;
        for (const auto& [name, values] : kind == Sensor::imu ? imus_ : wrenches_) names.push_back(name);
        return names;
    }
    bool set_mode(ControlMode mode) noexcept override {
        if (mode != mode_) leave();
        mode_ = mode;
        const auto found = outputs_.find(mode);
        // Without ways the joints stay as the robot holds them.
        if (found == outputs_.end()) return told(mode == ControlMode::position, "no topic for that mode", "");
        return mode == ControlMode::position || found->second.end->readers() > 0 ||
               told(false, "nobody listens to", found->second.topic);
    }
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override {
        if (mode == ControlMode::position && limit > 0) speed_ = limit;
        return true;
    }
    bool write(ControlMode mode, const Eigen::Ref<const VectorXd>& references) noexcept override {
        const auto found = outputs_.find(mode);
        if (found == outputs_.end()) return told(false, "no topic for that mode", "");
        double duration = 0;
        if (mode == ControlMode::position) {
            if (target_.size() == n_ && references == target_) return true; // it is on its way
            const std::lock_guard lock(mutex_);
            // A straight way, all joints at once, none faster than the limit.
            duration = std::max(slowest, (references - position_).cwiseAbs().maxCoeff() / speed_);
        }
        target_ = references;
        found->second.end->send({target_.data(), static_cast<std::size_t>(n_)}, duration);
        if (mode != ControlMode::position) target_.resize(0);
        return true;
    }
    const ErrorText& error() const noexcept override { return error_; }
    bool has(Measurement what) const {
        const std::lock_guard lock(mutex_);
        return what == Measurement::joint_position ||
               (what == Measurement::joint_velocity && has_velocity_.all()) ||
               (what == Measurement::joint_torque && has_effort_.all());
    }
    bool has(ControlMode mode) const { return mode == ControlMode::position || outputs_.contains(mode); }

  private:
    struct Output {
        std::unique_ptr<CommandTopic> end;
        std::string topic;
    };

    /// In the middleware's thread. Several programs may tell of some of the joints each.
    void take(const JointStates& states) {
        const std::lock_guard lock(mutex_);
        if (states.names != names_) {
            names_ = states.names;
            places_.clear();
            for (const auto& name : names_) {
                const auto found = ours_.find(name);
                places_.push_back(found == ours_.end() ? -1 : found->second);
            }
        }
        if (states.position.size() != names_.size()) return; // it tells nothing of where they are
        // What a robot does not know it may tell as NaN.
        const auto take_one = [](std::span<const double> from, std::size_t i, double& to) {
            const bool has = i < from.size() && std::isfinite(from[i]);
            if (has) to = from[i];
            return has;
        };
        for (std::size_t i = 0; i < names_.size(); ++i) {
            const Eigen::Index at = places_[i];
            if (at < 0 || !take_one(states.position, i, position_[at])) continue;
            has_velocity_[at] |= take_one(states.velocity, i, velocity_[at]);
            has_effort_[at] |= take_one(states.effort, i, effort_[at]);
            came_[at] = now();
            stamp_ = std::max(stamp_, states.stamp); // programs with some of the joints are not equally far
        }
    }
    [[noreturn]] void refuse(const std::vector<std::string>& missing) const {
        if (const auto why = topics_->refusal(); !why.empty()) throw std::runtime_error(why);
        const std::lock_guard lock(mutex_);
        const std::string within = " within " + Value(0.8 * options_.start_timeout).describe() + " s";
        if (names_.empty())
            throw std::runtime_error("no message came on the topic '" + options_.states + "'" + within +
                                     "; start the robot, or correct namespace and states");
        throw std::runtime_error("the topic '" + options_.states + "' tells nothing of " +
                                 name_list(missing) + within + "; it has " + name_list(names_));
    }
    /// Joints that were driven by efforts or velocities are let go.
    void leave() noexcept {
        if (mode_ == ControlMode::torque || mode_ == ControlMode::velocity)
            if (const auto found = outputs_.find(*mode_); found != outputs_.end()) {
                target_.setZero(n_);
                found->second.end->send({target_.data(), static_cast<std::size_t>(n_)}, 0);
            }
        target_.resize(0);
        mode_.reset();
    }
    bool told(bool is_good, const char* what, const std::string& which) noexcept {
        if (!is_good)
            std::snprintf(error_, sizeof error_, "%s: %s '%s'", options_.kind.c_str(), what, which.c_str());
        return is_good;
    }

    const std::unique_ptr<RobotTopics> topics_;
    const TopicRobotOptions options_;
    const Eigen::Index n_;
    bool is_open_ = false;
    std::map<std::string, Eigen::Index> ours_;
    std::map<ControlMode, Output> outputs_;
    mutable std::mutex mutex_; ///< of what has come
    std::map<std::string, VectorXd> wrenches_, imus_;
    std::vector<std::string> names_;
    std::vector<Eigen::Index> places_; ///< our number of each name; -1: none of ours
    VectorXd position_, velocity_, effort_, came_;
    Eigen::Array<bool, Eigen::Dynamic, 1> has_velocity_, has_effort_; ///< of each joint, so far
    double stamp_ = 0;
    std::optional<ControlMode> mode_;
    VectorXd target_;
    double speed_ = usual_speed;
    ErrorText error_ = "";
    std::vector<std::shared_ptr<void>> heard_; ///< ends before what it writes to
};

/// Asked when the robot has started.
class TopicDevice final : public toolbox::RobotDevice {
  public:
    TopicDevice(const TopicRobotOptions& options, TopicRobot& robot)
        : joints_(options.joints), robot_(robot) {}
    const std::vector<std::string>& joint_names() const override { return joints_; }
    void check_mode(ControlMode mode) const override {
        if (!robot_.has(mode)) throw std::runtime_error("there is no topic for that mode");
    }
    void check_measurement(Measurement what) const override {
        if (!robot_.has(what)) throw std::runtime_error("joint states do not tell it");
    }
    std::shared_ptr<Live> open() const override { return nullptr; } // its driver opens it

  private:
    const std::vector<std::string> joints_;
    TopicRobot& robot_;
};

} // namespace

WaitingDriver make_topic_robot(std::unique_ptr<RobotTopics> topics, const TopicRobotOptions& options) {
    auto robot = std::make_unique<TopicRobot>(std::move(topics), options);
    auto device = std::make_unique<TopicDevice>(options, *robot);
    TopicRobot* const its = robot.get();
    WaitingDriver driver{std::move(device), std::move(robot)};
    if (options.is_clock) driver.clock = [its] { return its->time(); };
    return driver;
}

} // namespace bf::middleware
