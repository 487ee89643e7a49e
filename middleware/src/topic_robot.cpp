#include "bf/middleware/topic_robot.hpp"

#include "bf/core/value.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/outbox.hpp"
#include "reference_limits.hpp"
#include "told_joints.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

namespace bf::middleware {

using Eigen::VectorXd;

Eigen::Vector3d roll_pitch_yaw(const Eigen::Vector4d& q) {
    const Eigen::Matrix3d R = Eigen::Quaterniond(q).normalized().toRotationMatrix();
    return {std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
            std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Vector4d quaternion_of(const Eigen::Vector3d& rpy) {
    const Eigen::Quaterniond q = Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX());
    return q.coeffs();
}

void RobotTopics::halt(double) { throw std::runtime_error("it cannot be stepped"); }

namespace {

constexpr double longest_step = 5; ///< s that a robot may take which stands still otherwise

/// A sensor's newest message.
struct SensorTopic {
    SensorTopic(const std::string& text, Eigen::Index size) : values(size) {
        const auto equals = text.find('=');
        name = text.substr(0, equals);
        topic = text.substr(equals + 1);
    }
    std::string name, topic;
    VectorXd values;
    double stamp = never; ///< s
};

class TopicRobot final : public toolbox::RobotConnection {
  public:
    TopicRobot(std::unique_ptr<RobotTopics> topics, const TopicRobotOptions& options)
        : topics_(std::move(topics)), options_(options), n_(static_cast<Eigen::Index>(options.joints.size())),
          told_(options.joints) {
        for (const auto& text : options.wrenches) wrenches_.emplace_back(text, wrench_size);
        for (const auto& text : options.imus) imus_.emplace_back(text, imu_size);
    }
    ~TopicRobot() override { stop(); }

    void start() override {
        stop();
        const double end = now() + options_.patience;
        is_open_ = true;
        topics_->open();
        told_.clear();
        is_driver_ = false;
        has_all_joints_ = true;
        heard_.push_back(topics_->hear_states(options_.states, [this](const auto& states) {
            const std::lock_guard lock(mutex_);
            // One that is led has one program, and when that begins again its time goes back.
            told_.take(states, !is_stepped());
            bell_.ring();
        }));
        const auto stands = [this](double time) {
            const std::lock_guard lock(mutex_);
            told_.stand_at(time);
        };
        if (!is_stepped()) heard_.push_back(topics_->hear_time(stands));
        for (auto* sensors : {&wrenches_, &imus_})
            for (auto& sensor : *sensors) {
                sensor.values.setZero();
                sensor.stamp = never;
            }
        for (auto& sensor : wrenches_)
            heard_.push_back(
                topics_->hear_wrenches(sensor.topic, [this, &sensor](const auto& wrench, double stamp) {
                    const std::lock_guard lock(mutex_);
                    sensor.values = wrench;
                    sensor.stamp = stamp;
                    bell_.ring();
                }));
        for (auto& sensor : imus_)
            heard_.push_back(topics_->hear_imu(sensor.topic, [this, &sensor](const auto& imu, double stamp) {
                const std::lock_guard lock(mutex_);
                sensor.values.head<3>() = roll_pitch_yaw(imu.template head<4>());
                sensor.values.segment<6>(3) = imu.template tail<6>();
                sensor.stamp = stamp;
                bell_.ring();
            }));
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
        const auto has_all = [&] {
            const std::lock_guard lock(mutex_);
            return told_.has_all();
        };
        if (!wait_until(end, has_all)) refuse();
        // Who listens is known a little later than what was said, and where messages are lost seconds later.
        const auto is_heard = [](const auto& each) { return each.second.end->readers() > 0; };
        wait_until(std::min(end, now() + topics_->longest_search()),
                   [&] { return std::ranges::any_of(outputs_, is_heard); });
        wait_until(std::min(end, now() + 0.3), [&] { return std::ranges::all_of(outputs_, is_heard); });
        const auto is_awaited = [&](const auto& each) {
            return !is_heard(each) && topics_->has_listener(each.second.topic);
        };
        wait_until(end, [&] { return std::ranges::none_of(outputs_, is_awaited); });
        sent_.setZero(n_);
        std::string other;
        const auto is_alone = [&] { return (other = topics_->other_driver()).empty(); };
        // Programs that have to be looked for are found one by one.
        wait_until(std::min(end, now() + std::min(0.3, topics_->longest_search())),
                   [&] { return !is_alone(); });
        if (!wait_until(end, is_alone))
            throw std::runtime_error("the node '" + other +
                                     "' sends commands to it; end it first, or wait until it is forgotten "
                                     "where it was killed");
        if (is_stepped()) halt(end);
        find_order();
        is_driver_ = is_stepped();
        is_silent_ = !is_stepped();
    }
    void stop() noexcept override {
        if (!is_open_) return;
        if (!left_) left_ = mode_;
        mode_.reset();
        is_driver_ |= std::exchange(is_silent_, false) && is_its_controller();
        let_go();
        heard_.clear();
        outputs_.clear();
        topics_->close();
        is_open_ = false;
    }

    double age() const noexcept override {
        if (is_stepped()) return 0; // it stands still until it is commanded: its last state is that of now
        const std::lock_guard lock(mutex_);
        return now() - told_.since();
    }
    double time() const {
        const std::lock_guard lock(mutex_);
        return told_.stamp();
    }
    /// Completes a sentence that says that there is no new state: why what came since is none. Empty: nothing
    /// did.
    void say_left_out(ErrorText& text) const noexcept {
        const std::lock_guard lock(mutex_);
        told_.say_left_out(text);
        if (text[0] == '\0' && options_.is_clock && now() - told_.since() < longest_silence)
            std::snprintf(text, sizeof text, "the stamps of what came did not go on from t = %.9g s",
                          told_.stamp());
    }
    double step_size() const { return options_.step_size; }
    /// Lets a robot that stands still do that many steps, and waits for what was measured then. Each command
    /// is a step, and where there is none it is asked for one.
    bool advance(int steps) noexcept {
        for (; steps > 0; --steps) {
            const double before = due_;
            const auto is_back = [&] { return time() < before - options_.step_size / 2; };
            due_ += options_.step_size;
            const bool is_asked = std::exchange(is_written_, false) || topics_->step();
            is_driver_ |= is_asked;
            if (is_asked)
                bell_.wait(
                    longest_step, [&] { return are_there() || is_back(); }, 0);
            if (is_asked && are_there()) continue;
            if (is_back()) {
                std::snprintf(
                    error_, sizeof error_,
                    "has begun again, as its time went back from t = %.9g s to t = %.9g s; start this run "
                    "anew",
                    before, time());
                return false;
            }
            std::string why = topics_->refusal();
            if (ErrorText left_out; why.empty()) say_left_out(left_out), why = left_out;
            std::snprintf(error_, sizeof error_, "does not go on from t = %.9g s%s%s", time(),
                          !is_asked     ? ", as a call of its service 'robot/step' is not sent"
                          : why.empty() ? "; look at its server"
                                        : ": ",
                          why.c_str());
            return false;
        }
        return true;
    }
    bool read(Measurement what, Eigen::Ref<VectorXd> values) noexcept override {
        if (left_) let_go();
        if (!is_stepped() && age() > longest_silence)
            return told(false, "no state of all joints on", options_.states);
        const std::lock_guard lock(mutex_);
        switch (what) {
        case Measurement::joint_position: values = told_.position(); return true;
        case Measurement::joint_velocity:
            values = told_.velocity();
            return told(told_.has_velocities(), "no velocities of all joints on", options_.states);
        case Measurement::joint_torque:
            values = told_.effort();
            return told(told_.has_efforts(), "no efforts of all joints on", options_.states);
        default: return told(false, "no such measurement on", options_.states);
        }
    }
    bool read(Sensor kind, const std::string& name, Eigen::Ref<VectorXd> values) noexcept override {
        const std::lock_guard lock(mutex_);
        for (const auto& sensor : kind == Sensor::imu ? imus_ : wrenches_) {
            if (sensor.name != name) continue;
            values = sensor.values;
            return true;
        }
        return told(false, "no sensor", name);
    }
    bool read(Limits, Eigen::Ref<VectorXd> minimum, Eigen::Ref<VectorXd> maximum) noexcept override {
        maximum.setConstant(std::numeric_limits<double>::infinity());
        minimum = -maximum;
        return true;
    }
    std::vector<std::string> sensors(Sensor kind) const override {
        std::vector<std::string> names;
        for (const auto& sensor : kind == Sensor::imu ? imus_ : wrenches_) names.push_back(sensor.name);
        return names;
    }
    bool set_mode(ControlMode mode) noexcept override {
        if (mode != mode_) {
            left_ = mode_;
            // Joints are taken back by this mode without a reference in it; who can be asked to hold them is.
            if (mode != ControlMode::position || !topics_->takes_joints_back()) leave();
        }
        mode_ = mode;
        limits_.begin(n_, time_of_commands() - options_.step_size);
        if (!has_all_joints_) return told(false, "the diagram has not all joints of", options_.states);
        const auto found = outputs_.find(mode);
        // Without ways the joints stay as the robot holds them.
        if (found == outputs_.end()) return told(mode == ControlMode::position, "no topic for that mode", "");
        return mode == ControlMode::position || found->second.end->readers() > 0 ||
               told(false, "nobody listens to", found->second.topic);
    }
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override {
        if (mode == ControlMode::position && limit > 0) limits_.speed = limit;
        if (mode == ControlMode::velocity && limit > 0) limits_.acceleration = limit;
        return true;
    }
    bool write(ControlMode mode, const Eigen::Ref<const VectorXd>& references) noexcept override {
        const auto found = outputs_.find(mode);
        if (found == outputs_.end()) return told(false, "no topic for that mode", "");
        left_.reset();
        double duration = 0;
        if (mode == ControlMode::position) {
            if (target_.size() == n_ && references == target_) return true; // it is on its way
            const std::lock_guard lock(mutex_);
            duration = limits_.duration(told_.position(), references);
        }
        target_ = references;
        if (mode == ControlMode::velocity)
            target_ = limits_.next(references, time_of_commands(), longest_silence);
        send(mode, target_, duration);
        if (mode != ControlMode::position) target_.resize(0);
        return true;
    }
    const ErrorText& error() const noexcept override { return error_; }
    bool has(Measurement what) const {
        const std::lock_guard lock(mutex_);
        return what == Measurement::joint_position ||
               (what == Measurement::joint_velocity && told_.has_velocities()) ||
               (what == Measurement::joint_torque && told_.has_efforts());
    }
    bool has(ControlMode mode) const { return mode == ControlMode::position || outputs_.contains(mode); }
    void expect_commands() noexcept { is_to_command_ = true; }

  private:
    struct Output {
        std::unique_ptr<CommandTopic> end;
        std::string topic;
    };

    bool is_stepped() const noexcept { return options_.step_size > 0; }
    /// Has all come that was measured at the time where the robot is to be?
    bool are_there() const {
        const std::lock_guard lock(mutex_);
        const double from = due_ - options_.step_size / 2;
        const auto is_there = [&](const SensorTopic& sensor) { return sensor.stamp >= from; };
        return told_.stamp() >= from && std::ranges::all_of(wrenches_, is_there) &&
               std::ranges::all_of(imus_, is_there);
    }
    /// Lets the robot stand still until it is stepped.
    void halt(double end) {
        topics_->halt(end);
        std::this_thread::sleep_for(std::chrono::milliseconds(20)); // a step under way ends
        due_ = time();
        is_written_ = false;
        if (!wait_until(end, [&] { return are_there(); }))
            throw std::runtime_error("its sensors tell nothing of t = " + Value(due_).describe() +
                                     " s, at which it stands still; correct their topics");
    }
    [[noreturn]] void refuse() const {
        if (const auto why = topics_->refusal(); !why.empty()) throw std::runtime_error(why);
        const std::lock_guard lock(mutex_);
        throw std::runtime_error(
            told_.what_is_missing(options_.states, Value(options_.patience).describe() + " s"));
    }
    /// Is it the robot's controller without having commanded it, as where the first step fails?
    bool is_its_controller() noexcept try {
        return is_to_command_ && topics_->takes_joints_back() && topics_->other_driver().empty();
    } catch (const std::exception&) { // it is not known
        return false;
    }
    /// The robot holds its joints where it lets itself be asked to, without zeros before, by which they would
    /// fall.
    void let_go() noexcept {
        if (std::exchange(is_driver_, false) && topics_->let_go())
            left_.reset();
        else
            leave();
    }
    /// Joints that were driven by efforts or velocities are let go.
    void leave() noexcept {
        target_.resize(0);
        const auto mode = std::exchange(left_, std::nullopt);
        if (mode != ControlMode::torque && mode != ControlMode::velocity) return;
        if (outputs_.contains(*mode)) send(*mode, VectorXd::Zero(n_), 0);
    }
    /// Commands carry no names, ways do.
    void send(ControlMode mode, const VectorXd& values, double duration) noexcept {
        for (Eigen::Index i = 0; i < n_; ++i)
            sent_[i] = values[mode == ControlMode::position ? i : order_[static_cast<std::size_t>(i)]];
        outputs_.find(mode)->second.end->send({sent_.data(), static_cast<std::size_t>(n_)}, duration);
        is_written_ = is_driver_ = true;
        is_silent_ = false;
    }
    double time_of_commands() const noexcept { return is_stepped() ? due_ : now(); }
    /// A robot of ours takes commands in the order in which its states have all joints.
    void find_order() {
        order_.resize(static_cast<std::size_t>(n_));
        std::iota(order_.begin(), order_.end(), 0);
        if (!topics_->takes_joints_back()) return;
        const std::lock_guard lock(mutex_);
        const auto its = told_.order();
        if ((has_all_joints_ = its.has_value())) order_ = *its;
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
    std::map<ControlMode, Output> outputs_;
    mutable std::mutex mutex_; ///< of what has come
    std::vector<SensorTopic> wrenches_, imus_;
    ToldJoints told_; ///< with the lock
    Bell bell_{};
    double due_ = 0;             ///< time to which a robot that is stepped is to go, s
    bool is_written_ = false;    ///< a command, since it went on
    bool is_driver_ = false;     ///< it has commanded or stepped the robot, or made it stand still
    bool is_silent_ = false;     ///< it has started, and commanded nothing
    bool is_to_command_ = false; ///< the diagram has blocks that do
    std::optional<ControlMode> mode_;
    std::optional<ControlMode> left_; ///< mode before, in which the robot may still be
    VectorXd target_, sent_;
    ReferenceLimits limits_;
    std::vector<Eigen::Index> order_; ///< our number of each value of a command
    bool has_all_joints_ = true;      ///< of a robot of ours
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
    driver.expect_commands = [its] { its->expect_commands(); };
    driver.left_out = [its](auto& text) { its->say_left_out(text); };
    if (options.is_clock) driver.clock = [its] { return its->time(); };
    if (options.step_size > 0) {
        driver.time = [its] { return its->time(); };
        driver.period = [its] { return its->step_size(); };
        driver.advance = [its](int steps) { return its->advance(steps); };
    }
    return driver;
}

} // namespace bf::middleware
