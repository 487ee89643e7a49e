#include "robot.hpp"

#include "bf/base/names.hpp"
#include "bf/core/value.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/topic_robot.hpp"
#include "messages.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

namespace bf::ros2 {

using Eigen::VectorXd;
using middleware::ControlMode;
using middleware::Limits;
using middleware::Loop;
using middleware::Measurement;
using middleware::Sensor;

Eigen::Vector4d quaternion_of(const Eigen::Vector3d& rpy) {
    const Eigen::Quaterniond q = Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX());
    return q.coeffs();
}

namespace {

constexpr double longest_silence = 0.1; ///< s; older states are none
constexpr double slowest = 0.05;        ///< s; shortest way of a trajectory
constexpr double usual_speed = 0.5;     ///< rad/s of trajectories without a limit
constexpr double longest_step = 5;      ///< s that a robot may take which stands still otherwise
constexpr double never = -std::numeric_limits<double>::infinity();

/// A sensor's newest message.
struct SensorTopic {
    explicit SensorTopic(const std::string& text) {
        const auto equals = text.find('=');
        name = text.substr(0, equals);
        topic = text.substr(equals + 1);
    }
    std::string name, topic;
    VectorXd values;
    double stamp = never; ///< s
    std::shared_ptr<Subscription> subscription;
};

void put(Eigen::Ref<VectorXd> to, const geometry_msgs__msg__Vector3& v) { to << v.x, v.y, v.z; }

class Robot final : public toolbox::RobotConnection {
  public:
    explicit Robot(const RobotOptions& options)
        : options_(options), n_(static_cast<Eigen::Index>(options.joints.size())), node_(options.node) {
        for (const auto& text : options.wrenches) wrenches_.emplace_back(text);
        for (const auto& text : options.imus) imus_.emplace_back(text);
        for (std::size_t i = 0; i < options.joints.size(); ++i)
            ours_[options.joints[i]] = static_cast<Eigen::Index>(i);
    }
    ~Robot() override { stop(); }

    void start() override {
        stop();
        const double end = middleware::now() + 0.9 * options_.start_timeout; // so that it says why itself
        node_.open();
        for (auto* values : {&position_, &velocity_, &effort_}) values->setZero(n_);
        came_.setConstant(n_, never);
        for (auto* has : {&has_velocity_, &has_effort_}) has->setConstant(n_, false);
        stamp_ = 0;
        names_.clear();
        // Best effort hears all writers, and only the newest counts. A robot that stands still sends each
        // state once, so none may be lost.
        const Quality newest{1, options_.step_size > 0};
        states_ =
            node_.subscribe(messages::joint_state(), options_.states, newest, [this](const void* message) {
                take(*static_cast<const messages::JointState*>(message));
            });
        // A time that stands still brings no new state, and the newest one counts on.
        const auto stands = [this](const void* message) {
            const auto& time = static_cast<const messages::Clock*>(message)->clock;
            const std::lock_guard lock(mutex_);
            if (messages::seconds(time) != stamp_) return;
            came_ = (came_.array() > 0).select(middleware::now(), came_);
        };
        if (options_.step_size == 0) clock_ = node_.subscribe(messages::clock(), "/clock", newest, stands);
        for (auto& sensor : wrenches_) {
            sensor.values.setZero(middleware::wrench_size);
            sensor.stamp = never;
            sensor.subscription = node_.subscribe(
                messages::wrench(), sensor.topic, newest, [this, &sensor](const void* message) {
                    const auto& its = static_cast<const messages::Wrench*>(message)->wrench;
                    const std::lock_guard lock(mutex_);
                    put(sensor.values.head<3>(), its.force);
                    put(sensor.values.tail<3>(), its.torque);
                    has_come(sensor, static_cast<const messages::Wrench*>(message)->header.stamp);
                });
        }
        for (auto& sensor : imus_) {
            sensor.values.setZero(middleware::imu_size);
            sensor.stamp = never;
            sensor.subscription =
                node_.subscribe(messages::imu(), sensor.topic, newest, [this, &sensor](const void* message) {
                    const auto& its = *static_cast<const messages::Imu*>(message);
                    const auto& q = its.orientation;
                    const std::lock_guard lock(mutex_);
                    sensor.values.head<3>() = middleware::roll_pitch_yaw({q.x, q.y, q.z, q.w});
                    put(sensor.values.segment<3>(3), its.linear_acceleration);
                    put(sensor.values.segment<3>(6), its.angular_velocity);
                    has_come(sensor, its.header.stamp);
                });
        }
        for (const auto& [mode, topic, type] :
             {std::tuple(ControlMode::torque, &options_.commands.effort, &messages::numbers()),
              std::tuple(ControlMode::velocity, &options_.commands.velocity, &messages::numbers()),
              std::tuple(ControlMode::position_direct, &options_.commands.position, &messages::numbers()),
              std::tuple(ControlMode::position, &options_.commands.trajectory, &messages::trajectory())})
            if (!topic->empty()) publishers_[mode] = {node_.advertise(*type, *topic, {1, true}), *topic};
        wait_for_all(end);
        // Who listens is known a little later than what was said, and where messages are lost seconds later.
        const auto is_heard = [](const auto& each) { return each.second.end->readers() > 0; };
        wait_until(std::min(end, middleware::now() + 3),
                   [&] { return std::ranges::any_of(publishers_, is_heard); });
        wait_until(std::min(end, middleware::now() + 0.3),
                   [&] { return std::ranges::all_of(publishers_, is_heard); });
        if (options_.step_size > 0) halt(end);
    }
    void stop() noexcept override {
        if (!node_.context()) return;
        leave();
        node_.close(); // whose threads write what is cleared now
        publishers_.clear();
        step_ = {};
        states_.reset();
        clock_.reset();
        for (auto* sensors : {&wrenches_, &imus_})
            for (auto& sensor : *sensors) sensor.subscription.reset();
    }

    double age() const noexcept override {
        const std::lock_guard lock(mutex_);
        return middleware::now() - came_.minCoeff();
    }
    double time() const {
        const std::lock_guard lock(mutex_);
        return stamp_;
    }

    double step_size() const { return options_.step_size; }
    /// Lets a robot that stands still do that many steps, and waits for what was measured then. Each command
    /// is a step, and where there is none it is asked for one.
    bool advance(int steps) noexcept {
        for (; steps > 0; --steps) {
            due_ += options_.step_size;
            const bool is_asked = std::exchange(is_written_, false) || step_.send();
            if (is_asked)
                bell_.wait(
                    longest_step, [&] { return are_there(); }, 0);
            if (is_asked && are_there()) continue;
            const std::lock_guard lock(mutex_);
            std::snprintf(error_, sizeof error_, "does not go on from t = %.9g s%s%s", stamp_,
                          !is_asked             ? ", as a call of its service 'robot/step' is not sent"
                          : why_not_[0] == '\0' ? "; look at its server"
                                                : ": ",
                          why_not_);
            return false;
        }
        return true;
    }

    bool read(Measurement what, Eigen::Ref<VectorXd> values) noexcept override {
        if (options_.step_size == 0 && age() > longest_silence)
            return told(false, "no state of all joints on", options_.states);
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
        if (mode != mode_) leave();
        mode_ = mode;
        const auto found = publishers_.find(mode);
        // Without trajectories the joints stay as the robot holds them.
        if (found == publishers_.end())
            return told(mode == ControlMode::position, "no topic for that mode", "");
        return mode == ControlMode::position || found->second.end->readers() > 0 ||
               told(false, "nobody listens to", found->second.topic);
    }
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override {
        if (mode == ControlMode::position && limit > 0) speed_ = limit;
        return true;
    }
    bool write(ControlMode mode, const Eigen::Ref<const VectorXd>& references) noexcept override {
        const auto found = publishers_.find(mode);
        if (found == publishers_.end()) return told(false, "no topic for that mode", "");
        if (mode == ControlMode::position) {
            if (target_.size() == n_ && references == target_) return true; // it is on its way
            target_ = references;
            go_to(*found->second.end);
            is_written_ = true;
            return true;
        }
        target_.resize(0);
        send(*found->second.end, references);
        is_written_ = true;
        return true;
    }
    const ErrorText& error() const noexcept override { return error_; }
    bool has(Measurement what) const {
        const std::lock_guard lock(mutex_);
        return what == Measurement::joint_position ||
               (what == Measurement::joint_velocity && has_velocity_.all()) ||
               (what == Measurement::joint_torque && has_effort_.all());
    }
    bool has(ControlMode mode) const { return mode == ControlMode::position || publishers_.contains(mode); }

  private:
    struct Output {
        std::shared_ptr<Publisher> end;
        std::string topic;
    };

    /// In the node's thread. Several programs may tell of some of the joints each.
    void take(const messages::JointState& state) {
        const std::lock_guard lock(mutex_);
        const auto& names = state.name;
        const auto is_same = [&] {
            if (names.size != names_.size()) return false;
            for (std::size_t i = 0; i < names.size; ++i)
                if (names_[i] != names.data[i].data) return false;
            return true;
        };
        if (!is_same()) {
            names_.clear();
            places_.clear();
            for (std::size_t i = 0; i < names.size; ++i) {
                names_.emplace_back(names.data[i].data, names.data[i].size);
                const auto found = ours_.find(names_.back());
                places_.push_back(found == ours_.end() ? -1 : found->second);
            }
        }
        if (state.position.size != names.size) return; // it tells nothing of where they are
        // What a controller manager does not know it tells as NaN.
        const auto take_one = [](const rosidl_runtime_c__double__Sequence& from, std::size_t i, double& to) {
            const bool has = i < from.size && std::isfinite(from.data[i]);
            if (has) to = from.data[i];
            return has;
        };
        const double now = middleware::now();
        for (std::size_t i = 0; i < names.size; ++i) {
            const Eigen::Index at = places_[i];
            if (at < 0 || !take_one(state.position, i, position_[at])) continue;
            has_velocity_[at] |= take_one(state.velocity, i, velocity_[at]);
            has_effort_[at] |= take_one(state.effort, i, effort_[at]);
            came_[at] = now;
            // Programs that tell of some of the joints each are not equally far.
            // One that is led has one program, and when that begins again its time goes back.
            const double stamp = messages::seconds(state.header.stamp);
            stamp_ = options_.step_size > 0 ? stamp : std::max(stamp_, stamp);
        }
        bell_.ring();
    }
    /// With the lock held.
    void has_come(SensorTopic& sensor, const messages::Time& stamp) {
        sensor.stamp = messages::seconds(stamp);
        bell_.ring();
    }
    /// Has all come that was measured at the time where the robot is to be?
    bool are_there() const {
        const std::lock_guard lock(mutex_);
        const double from = due_ - options_.step_size / 2;
        const auto is_there = [&](const SensorTopic& sensor) { return sensor.stamp >= from; };
        return stamp_ >= from && std::ranges::all_of(wrenches_, is_there) &&
               std::ranges::all_of(imus_, is_there);
    }
    /// Lets the robot stand still until it is stepped.
    void halt(double end) {
        {
            const std::lock_guard lock(mutex_);
            why_not_[0] = '\0';
        }
        const auto answered = [this](bool is_done, const std::string& why) {
            const std::lock_guard lock(mutex_);
            if (!is_done) std::snprintf(why_not_, sizeof why_not_, "%s", why.c_str());
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
            throw std::runtime_error(
                "it has no services 'robot/step' and 'robot/pause', as those of bf serve "
                "--ros2; with step_size: 0 its time goes on by itself");
        if (pause.send()) wait_until(end, [&] { return *answer != nothing; });
        if (*answer != good) {
            const std::lock_guard lock(mutex_);
            throw std::runtime_error(
                std::string("it does not stand still: ") +
                (*answer == bad ? why_not_ : "its service 'robot/pause' does not answer"));
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(20)); // a step under way ends
        due_ = time();
        is_written_ = false;
        if (!wait_until(end, [&] { return are_there(); }))
            throw std::runtime_error("its sensors tell nothing of t = " + Value(due_).describe() +
                                     " s, at which it stands still; correct their topics");
    }
    void wait_for_all(double end) {
        const auto have_all_come = [&] {
            const std::lock_guard lock(mutex_);
            return (came_.array() >= 0).all();
        };
        if (wait_until(end, have_all_come)) return;
        const std::lock_guard lock(mutex_);
        std::vector<std::string> missing;
        for (Eigen::Index i = 0; i < n_; ++i)
            if (came_[i] < 0) missing.push_back(options_.joints[static_cast<std::size_t>(i)]);
        const std::string within = " within " + Value(0.9 * options_.start_timeout).describe() + " s";
        if (names_.empty())
            throw std::runtime_error("no message came on the topic '" + options_.states + "'" + within +
                                     "; start the robot, or correct namespace and states");
        throw std::runtime_error("the topic '" + options_.states + "' tells nothing of " +
                                 name_list(missing) + within + "; it has " + name_list(names_));
    }
    /// Joints that were driven by efforts or velocities are let go.
    void leave() noexcept {
        if (mode_ != ControlMode::torque && mode_ != ControlMode::velocity) return;
        if (const auto found = publishers_.find(*mode_); found != publishers_.end())
            send(*found->second.end, VectorXd::Zero(n_));
        mode_.reset();
    }
    void send(Publisher& to, const Eigen::Ref<const VectorXd>& values) noexcept {
        messages::resize(numbers_->data, static_cast<std::size_t>(n_));
        std::copy(values.begin(), values.end(), numbers_->data.data);
        to.publish(numbers_.get());
    }
    /// A straight way to the target, all joints at once, none faster than the limit.
    void go_to(Publisher& to) noexcept {
        auto& path = *trajectory_;
        if (path.points.size != 1) {
            messages::assign(path.joint_names, options_.joints);
            trajectory_msgs__msg__JointTrajectoryPoint__Sequence__init(&path.points, 1);
        }
        auto& point = path.points.data[0];
        messages::resize(point.positions, static_cast<std::size_t>(n_));
        std::copy(target_.begin(), target_.end(), point.positions.data);
        double farthest = 0;
        {
            const std::lock_guard lock(mutex_);
            farthest = (target_ - position_).cwiseAbs().maxCoeff();
        }
        const auto duration = messages::time_of(std::max(slowest, farthest / speed_));
        point.time_from_start.sec = duration.sec;
        point.time_from_start.nanosec = duration.nanosec;
        to.publish(&path);
    }
    bool told(bool is_good, const char* what, const std::string& which) noexcept {
        if (!is_good) std::snprintf(error_, sizeof error_, "ROS 2 robot: %s '%s'", what, which.c_str());
        return is_good;
    }

    const RobotOptions options_;
    const Eigen::Index n_;
    Node node_;
    std::map<std::string, Eigen::Index> ours_;
    std::map<ControlMode, Output> publishers_;
    std::shared_ptr<Subscription> states_, clock_;
    std::vector<SensorTopic> wrenches_, imus_;
    mutable std::mutex mutex_; ///< of what has come
    std::vector<std::string> names_;
    std::vector<Eigen::Index> places_; ///< our number of each name; -1: none of ours
    VectorXd position_, velocity_, effort_, came_;
    Eigen::Array<bool, Eigen::Dynamic, 1> has_velocity_, has_effort_; ///< of each joint, so far
    double stamp_ = 0;
    std::optional<ControlMode> mode_;
    messages::Call step_;
    middleware::Bell bell_{};
    double due_ = 0;          ///< time to which the robot is to go, s
    bool is_written_ = false; ///< a command, since it went on
    char why_not_[150] = "";  ///< it did not do a step; with the lock
    VectorXd target_;
    double speed_ = usual_speed;
    std::shared_ptr<messages::Numbers> numbers_ = messages::make<messages::Numbers>(messages::numbers());
    std::shared_ptr<messages::Trajectory> trajectory_ =
        messages::make<messages::Trajectory>(messages::trajectory());
    ErrorText error_ = "";
};

/// Asked when the robot has started.
class Device final : public toolbox::RobotDevice {
  public:
    Device(const RobotOptions& options, Robot& robot) : joints_(options.joints), robot_(robot) {}
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
    Robot& robot_;
};

} // namespace

middleware::WaitingDriver make_driver(const RobotOptions& options) {
    auto robot = std::make_unique<Robot>(options);
    auto device = std::make_unique<Device>(options, *robot);
    middleware::WaitingDriver driver{std::move(device), std::move(robot)};
    auto* its = static_cast<Robot*>(driver.robot.get());
    if (options.use_sim_time) driver.clock = [its] { return its->time(); };
    if (options.step_size > 0) {
        driver.time = [its] { return its->time(); };
        driver.period = [its] { return its->step_size(); };
        driver.advance = [its](int steps) { return its->advance(steps); };
    }
    return driver;
}

} // namespace bf::ros2
