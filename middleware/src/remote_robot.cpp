#include "bf/middleware/remote_robot.hpp"

#include "bf/base/names.hpp"
#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <random>
#include <sstream>
#include <stdexcept>

namespace bf::middleware {

namespace {

/// A number that is hardly drawn twice, below 2^53.
double new_session() {
    std::random_device random;
    const auto bits = (std::uint64_t{random()} << 32 | random()) >> 12;
    return static_cast<double>(bits | 1);
}

/// A number of the other program as the integer that it should be; -1 where it is none.
int whole(double number) { return number >= 0 && number < 1e9 ? static_cast<int>(number) : -1; }

std::string list(const std::vector<std::string>& names) {
    std::string text;
    for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
    return text.empty() ? "none" : text;
}

} // namespace

// ---- the connection

RemoteConnection::RemoteConnection(std::unique_ptr<RobotLink> link, const RemoteOptions& options)
    : link_(std::move(link)), options_(options) {}

RemoteConnection::~RemoteConnection() { stop(); }

template <class... Values> bool RemoteConnection::fail(const char* format, Values... values) noexcept {
    const int head = std::snprintf(error_, sizeof error_, "%s: ", link_->name().c_str());
    if (head > 0 && head < static_cast<int>(sizeof error_))
        std::snprintf(error_ + head, sizeof error_ - static_cast<std::size_t>(head), format, values...);
    return false;
}

void RemoteConnection::start() {
    stop();
    fail("its connection is closed"); // and what fails later says so itself
    const auto refuse = [&](const std::string& text) {
        is_open_ = false; // a link that has stopped takes no farewell
        link_->stop();
        throw std::runtime_error(link_->name() + ": " + text);
    };
    try {
        robot_ = link_->start(options_.start_timeout);
    } catch (const std::runtime_error& error) {
        refuse(is_interrupted() ? interrupted : error.what()); // whatever the wait was for
    }
    theirs_.clear();
    for (const auto& joint : options_.joints) {
        const auto found = std::find(robot_.joints.begin(), robot_.joints.end(), joint);
        if (found == robot_.joints.end())
            refuse("it has no joint '" + joint + "'" + did_you_mean(joint, robot_.joints) +
                   "; its joints are " + list(robot_.joints));
        theirs_.push_back(static_cast<int>(found - robot_.joints.begin()));
    }
    if (theirs_.size() != robot_.joints.size())
        refuse("it has " + std::to_string(robot_.joints.size()) + " joints, and this diagram drives " +
               std::to_string(theirs_.size()) + " of them; name all: " + list(robot_.joints));
    const double ratio = period_ / robot_.period;
    if (robot_.waits && options_.follows && period_ > 0 &&
        !(ratio > 0.5 && std::abs(ratio - std::round(ratio)) < 1e-6 * ratio))
        refuse("it goes on by " + Value(robot_.period).describe() +
               " s in each of its steps, and this block by " + Value(period_).describe() +
               " s; give the block the period of the robot, or a multiple of it");
    server_ = robot_.process > 0 ? "its server (process " + std::to_string(robot_.process) + ")" : "it";
    at_ = RobotLayout(robot_);
    state_.assign(static_cast<std::size_t>(at_.state_size()), 0);
    command_.assign(static_cast<std::size_t>(at_.command_size()), 0);
    settings_.assign(static_cast<std::size_t>(at_.settings_size()), 0);
    gains_ = settings_;
    command_[RobotLayout::session] = settings_[RobotLayout::of] = new_session();
    sent_ = command_;
    steps_ = 0;
    mode_command_ = asked_ = 0;
    is_open_ = true;
    is_begun_ = is_driven_ = has_come_ = false;
    back_from_.reset();
    ahead_from_.reset();
    const double end = now() + options_.start_timeout;
    // Gains come on their own, and a step that reads them does not wait.
    bool has_state = false,
         has_gains = !robot_.has_position_gains && !robot_.has_torque_gains && !robot_.has_motor_parameters;
    const auto has_all = [&] {
        has_state |= take();
        has_gains |= take_gains();
        return has_state && has_gains;
    };
    while (!has_all()) {
        if (is_interrupted()) return; // the first step tells
        if (!is_fitting()) {
            is_open_ = false;
            const std::string text = error_;
            link_->stop();
            throw std::runtime_error(text);
        }
        if (link_->is_gone()) refuse("it ended while it was connected to");
        if (now() > end)
            refuse(has_state ? "it is there, but sends no gains; look whether it runs"
                             : "it is there, but sends no state; look whether it runs");
        link_->wait(0.01);
    }
    begin_ = time();
}

void RemoteConnection::stop() noexcept {
    if (!std::exchange(is_open_, false)) return;
    // The last whole step is done to its end; what a step has asked for that did not end is no command.
    sent_[RobotLayout::release] = 1;
    ++sent_[RobotLayout::number];
    link_->send_command(sent_.data());
    link_->stop();
}

bool RemoteConnection::take() noexcept {
    const double before = time();
    Stamp stamp;
    if (!link_->take_state(state_.data(), stamp)) return false;
    if (has_come_ && time() < before) back_from_ = before; // links give nothing that is older
    // A robot that is not led has its own clock, which goes on while this program stands still.
    if (has_come_ && !robot_.waits && time() - before > options_.timeout + std::max(stamp.time - came_, 0.0))
        ahead_from_ = before;
    has_come_ = true;
    came_ = stamp.time;
    asked_ = 0;
    return true;
}

bool RemoteConnection::begin_step() noexcept {
    if (std::exchange(is_begun_, true)) return is_good_;
    return is_good_ = is_open_ && refresh() && is_still_ours();
}

bool RemoteConnection::refresh() noexcept {
    take();
    // Where a robot waits, no time passes before it is told how far it may go, and the first step is now. The
    // robot's clock counts in its own periods, of which a step may take several: only the last one is due.
    const double due = begin_ + static_cast<double>(steps_) * period_ - std::min(period_, robot_.period) / 2;
    for (const double began = now();;) {
        if (is_interrupted()) return fail("%s", interrupted);
        if (options_.follows && ahead_from_)
            return fail("its time jumped ahead from t = %.3f s to t = %.3f s; start this run anew",
                        *ahead_from_, time());
        const bool is_due = !options_.follows || time() >= due;
        if (is_due && age() < options_.timeout) return true;
        if (!is_fitting()) return false;
        if (link_->is_gone())
            return fail("%s %s; the last state is of t = %g s", server_.c_str(), link_->how_gone(), time());
        if (options_.follows && back_from_)
            return fail("its time went back from t = %g s to t = %g s, so it has begun again; start this run "
                        "anew",
                        *back_from_, time());
        if (age() > options_.timeout || now() - began > options_.timeout) {
            const double silent = std::max(age(), options_.follows ? now() - began : 0);
            ErrorText why;
            link_->say_left_out(why);
            return why[0] != '\0'
                       ? fail("no state for %g s, the last one is of t = %g s; %.150s", silent, time(), why)
                       : fail("no state for %g s, the last one is of t = %g s; look whether %s stands still, "
                              "or raise timeout",
                              silent, time(), server_.c_str());
        }
        link_->wait(std::min(0.05, options_.timeout));
        take();
    }
}

double RemoteConnection::silence() const noexcept {
    // The time of a robot that waits for its controller stands still until it is told how far it may go.
    if (robot_.waits) return asked_ > 0 ? now() - asked_ : 0;
    return std::max(0.0, now() - came_);
}

bool RemoteConnection::is_fitting() noexcept {
    const int size = link_->wrong_size();
    return size < 0 || fail("%s sends states of %d numbers, and has described states of %d; use the same "
                            "BlockFactory on both sides",
                            server_.c_str(), size, at_.state_size());
}

bool RemoteConnection::is_still_ours() noexcept {
    const double session = command_[RobotLayout::session];
    if (state_[RobotLayout::owner] == session) {
        is_driven_ = true;
        const auto refused = static_cast<Refusal>(whole(state_[RobotLayout::refused]));
        switch (refused) {
        case Refusal::nothing: return true;
        case Refusal::mode: {
            ErrorText why;
            link_->say_refusal(why);
            return fail("it refuses the mode %s%s%s",
                        mode_names[std::clamp(static_cast<int>(command_[RobotLayout::mode_asked]), 0,
                                              mode_count - 1)],
                        why[0] == '\0' ? "" : ": ", why);
        }
        case Refusal::references: return fail("it refuses the references; look at what computes them");
        case Refusal::position_gains:
        case Refusal::torque_gains: return fail("it refuses the gains");
        case Refusal::motor_parameters: return fail("it refuses the motor parameters");
        }
        return fail("it refuses something for a reason that this program does not know");
    }
    if (is_driven_ && robot_.process > 0)
        return fail("its server has taken the joints back, since no command came for %g s", robot_.watchdog);
    if (is_driven_)
        return fail("its joints were taken back, since no step came for %g s; look whether steps waited for "
                    "its states, and raise silence or take the clock own",
                    robot_.watchdog);
    return true;
}

void RemoteConnection::end_step() noexcept {
    if (!is_open_) return;
    ++steps_;
    command_[RobotLayout::until] = begin_ + static_cast<double>(steps_) * period_;
    ++command_[RobotLayout::number];
    sent_ = command_; // of the same size
    link_->send_command(sent_.data());
    if (asked_ == 0) asked_ = now();
    is_begun_ = false;
}

void RemoteConnection::from_robot(const double* what, Eigen::Ref<Eigen::VectorXd> values) const noexcept {
    for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = what[theirs_[static_cast<std::size_t>(i)]];
}

void RemoteConnection::to_robot(const Eigen::Ref<const Eigen::VectorXd>& values,
                                double* what) const noexcept {
    for (Eigen::Index i = 0; i < values.size(); ++i) what[theirs_[static_cast<std::size_t>(i)]] = values[i];
}

bool RemoteConnection::read(Measurement what, Eigen::Ref<Eigen::VectorXd> values) noexcept {
    if (!begin_step()) return false;
    const int kind = static_cast<int>(what);
    if (!(robot_.measurements >> kind & 1))
        return fail("it measures no %s; let it tell them, or read something else", measurement_names[kind]);
    from_robot(&state_[static_cast<std::size_t>(at_.measurement(what))], values);
    if (what != Measurement::joint_position && what != Measurement::joint_velocity) return true;
    for (Eigen::Index i = 0; i < values.size(); ++i) // which no robot lacks
        if (!std::isfinite(values[i]))
            return fail("it sends %s that are not finite: %g of '%.60s'; look at what %s measures",
                        measurement_names[kind], values[i],
                        options_.joints[static_cast<std::size_t>(i)].c_str(), server_.c_str());
    return true;
}

bool RemoteConnection::read(Sensor kind, const std::string& name,
                            Eigen::Ref<Eigen::VectorXd> values) noexcept {
    if (!begin_step()) return false;
    const bool is_imu = kind == Sensor::imu;
    const auto& names = is_imu ? robot_.imus : robot_.wrenches;
    auto found = std::find(names.begin(), names.end(), name);
    if (is_imu && name.empty() && names.size() == 1) found = names.begin();
    if (found == names.end()) {
        fail("it has no %s sensor '%s'; it has", is_imu ? "inertial" : "force/torque", name.c_str());
        std::size_t end = std::char_traits<char>::length(error_);
        for (const auto& known : names)
            if (const std::size_t left = sizeof error_ - end; known.size() + 2 < left)
                end += static_cast<std::size_t>(std::snprintf(error_ + end, left, " %s", known.c_str()));
        if (names.empty()) std::snprintf(error_ + end, sizeof error_ - end, " none");
        return false;
    }
    const int i = static_cast<int>(found - names.begin());
    values = Eigen::Map<const Eigen::VectorXd>(
        &state_[static_cast<std::size_t>(is_imu ? at_.imu(i) : at_.wrench(i))],
        is_imu ? imu_size : wrench_size);
    return true;
}

bool RemoteConnection::read(Limits which, Eigen::Ref<Eigen::VectorXd> minimum,
                            Eigen::Ref<Eigen::VectorXd> maximum) noexcept {
    if (!is_open_) return false;
    const bool is_position = which == Limits::position;
    from_robot((is_position ? robot_.position_min : robot_.velocity_min).data(), minimum);
    from_robot((is_position ? robot_.position_max : robot_.velocity_max).data(), maximum);
    return true;
}

double RemoteConnection::age() const noexcept {
    return state_.empty() ? 0 : state_[RobotLayout::age] + silence();
}

std::vector<std::string> RemoteConnection::sensors(Sensor kind) const {
    return kind == Sensor::imu ? robot_.imus : robot_.wrenches;
}

bool RemoteConnection::set_mode(ControlMode mode) noexcept {
    if (!begin_step()) return false;
    const int number = static_cast<int>(mode);
    if (!(robot_.modes >> number & 1)) return fail("it has no mode %s", mode_names[number]);
    ++command_[RobotLayout::mode_count];
    command_[RobotLayout::mode_asked] = number;
    command_[RobotLayout::references] = 0;
    mode_command_ = command_[RobotLayout::number] + 1;
    return true;
}

int RemoteConnection::joint_in_other_mode(ControlMode mode) noexcept {
    if (!begin_step() || state_[RobotLayout::commands] < mode_command_ || !is_driven_) return -1;
    if (state_[RobotLayout::mode] >= 0 && state_[RobotLayout::mode] != static_cast<int>(mode)) return 0;
    const int other = whole(state_[RobotLayout::other]);
    const auto ours = std::find(theirs_.begin(), theirs_.end(), other);
    return other < 0 || ours == theirs_.end() ? -1 : static_cast<int>(ours - theirs_.begin());
}

bool RemoteConnection::set_trajectory_limit(ControlMode, double limit) noexcept {
    command_[RobotLayout::limit] = limit;
    return true;
}

bool RemoteConnection::write(ControlMode, const Eigen::Ref<const Eigen::VectorXd>& references) noexcept {
    if (!begin_step()) return false;
    to_robot(references, &command_[RobotLayout::command_head]);
    ++command_[RobotLayout::references];
    return true;
}

bool RemoteConnection::take_gains() noexcept {
    // What was written is read back before the robot has taken it.
    if (!link_->take_gains(gains_.data())) return false;
    const bool is_ours = gains_[RobotLayout::of] == settings_[RobotLayout::of];
    if (settings_[RobotLayout::count] > (is_ours ? gains_[RobotLayout::count] : 0)) return true;
    std::copy(gains_.begin() + RobotLayout::settings_head, gains_.end(),
              settings_.begin() + RobotLayout::settings_head);
    return true;
}

bool RemoteConnection::send_settings(double which) noexcept {
    const auto bits = static_cast<int>(settings_[RobotLayout::changed]) | static_cast<int>(which);
    settings_[RobotLayout::changed] = bits;
    command_[RobotLayout::given] = ++settings_[RobotLayout::count];
    link_->send_settings(settings_.data());
    return true;
}

bool RemoteConnection::read_gains(Loop loop, toolbox::Gains& gains) noexcept {
    if (!begin_step()) return false;
    if (!(loop == Loop::position ? robot_.has_position_gains : robot_.has_torque_gains))
        return fail("it tells no gains of its %s loop", loop == Loop::position ? "position" : "torque");
    take_gains();
    const double* from = &settings_[static_cast<std::size_t>(at_.gains(loop))];
    for (auto* part : {&gains.P, &gains.I, &gains.D}) {
        from_robot(from, *part);
        from += at_.n;
    }
    return true;
}

bool RemoteConnection::write_gains(Loop loop, const toolbox::Gains& gains) noexcept {
    if (!begin_step()) return false;
    take_gains(); // those of the other loop go with them
    double* to = &settings_[static_cast<std::size_t>(at_.gains(loop))];
    for (const auto* part : {&gains.P, &gains.I, &gains.D}) {
        to_robot(*part, to);
        to += at_.n;
    }
    return send_settings(loop == Loop::position ? 1 : 2);
}

bool RemoteConnection::read_motor_parameters(toolbox::MotorParameters& parameters) noexcept {
    if (!begin_step()) return false;
    if (!robot_.has_motor_parameters) return fail("it tells no parameters of its motors");
    take_gains();
    const double* from = &settings_[static_cast<std::size_t>(at_.motors())];
    from_robot(from, parameters.k_tau);
    from_robot(from + at_.n, parameters.k_bemf);
    return true;
}

bool RemoteConnection::write_motor_parameters(const toolbox::MotorParameters& parameters) noexcept {
    if (!begin_step()) return false;
    take_gains();
    double* to = &settings_[static_cast<std::size_t>(at_.motors())];
    to_robot(parameters.k_tau, to);
    to_robot(parameters.k_bemf, to + at_.n);
    return send_settings(4);
}

// ---- the block

class RemoteRobot::Device final : public toolbox::RobotDevice {
  public:
    Device(const RemoteRobot& block, RemoteOptions options) : block_(block), options_(std::move(options)) {}
    const std::vector<std::string>& joint_names() const override { return options_.joints; }
    void check_mode(ControlMode) const override { is_to_command_ = true; }
    void check_gains(Loop) const override {}
    void check_motor_parameters() const override {}
    std::shared_ptr<Live> open() const override {
        auto link = block_.make_link();
        if (is_to_command_) link->expect_commands();
        return std::make_shared<RemoteConnection>(std::move(link), options_);
    }

  private:
    const RemoteRobot& block_; ///< which lives as long as its diagram
    const RemoteOptions options_;
    mutable std::atomic<bool> is_to_command_ = false; ///< by blocks of the diagram, which ask for its mode
};

RemoteRobot::RemoteRobot(const Arguments& arguments)
    : Block(arguments),
      joints{this,
             "joints",
             {.doc = "its joints, in the order of all n-vectors; none: those of the Configuration around"}},
      clock{this,
            "clock",
            {.initial = "robot",
             .doc = "robot: each step waits until the robot's time has come to it; own: the loop's own clock "
                    "decides when steps come, and each takes the newest state",
             .choices = {"robot", "own"}}},
      timeout{this,
              "timeout",
              {.initial = 1, .above = 0, .maximum = 1e6, .doc = "without a new state until the run ends, s"}},
      start_timeout{
          this,
          "start_timeout",
          {.initial = 10, .minimum = 0, .maximum = 1e6, .doc = "how long the start waits for it, s"}},
      controlled{this, "the joints that are driven", joints->empty()},
      device{this,
             [this]() -> std::shared_ptr<const toolbox::RobotDevice> {
                 return std::make_shared<Device>(
                     *this, RemoteOptions{joint_names(), *clock == "robot", timeout, start_timeout});
             }},
      n{this, "n",
        [this]() -> Dim::Names {
            if (joints->empty() && !controlled.is_bound()) return std::nullopt;
            return joint_names();
        }},
      s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "measured joint positions"}},
      s_dot{this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "measured joint velocities"}},
      tau_measured{this, "tau_measured", {.shape = {n}, .unit = unit<"Nm">, .doc = "measured joint torques"}},
      time{this, "time", {.unit = unit<"s">, .doc = "of the robot, to which the measurements belong"}},
      age{this, "age", {.unit = unit<"s">, .doc = "how long ago they were measured"}},
      drift{
          this,
          "drift",
          {.unit = unit<"s">, .doc = "by how much the robot's clock is ahead of the steps since the start"}},
      lost{this, "lost", {.doc = "messages so far that did not come"}},
      late{this, "late", {.doc = "messages so far that came after newer ones, which are left out"}},
      duplicates{this, "duplicates", {.doc = "messages so far that came again, which are left out"}},
      rejected{this, "rejected", {.doc = "messages so far that were none of this robot's"}},
      worst_age{this, "worst_age", {.unit = unit<"s">, .doc = "largest age", .reported = true}},
      last_drift{this, "final_drift", {.unit = unit<"s">, .doc = "last drift", .reported = true}} {
    for (auto joint = joints->begin(); joint != joints->end(); ++joint)
        if (std::find(joints->begin(), joint, *joint) != joint)
            problem("argument 'joints' lists '" + *joint + "' twice; list every joint once");
}

void RemoteRobot::require_names_of(const std::vector<std::string>& sensors, const std::string& source) {
    const std::string separator = source.starts_with('/') ? "=/" : "=";
    for (const auto& sensor : sensors)
        if (sensor.find(separator) == std::string::npos)
            problem("the sensor '" + sensor + "' is not given as name=" + source);
}

void RemoteRobot::start(Now at) const {
    if (!(at.period() > 0))
        throw std::runtime_error("the block has no sample time, and a robot needs one; give it a period");
    connection(at).set_period(at.period());
    connection(at).start();
}

void RemoteRobot::stop(Now at) const noexcept { connection(at).stop(); }

Status RemoteRobot::output(Now at, Out out) const noexcept {
    auto& robot = connection(at);
    if (!robot.read(Measurement::joint_position, out[s]) ||
        !robot.read(Measurement::joint_velocity, out[s_dot]))
        return Status::failure(robot.error());
    if (!robot.read(Measurement::joint_torque, out[tau_measured])) out[tau_measured].setZero();
    const Counts counts = robot.counts();
    out[time] = robot.time();
    out[age] = robot.age();
    out[drift] = robot.drift();
    out[lost] = static_cast<double>(counts.lost);
    out[late] = static_cast<double>(counts.late);
    out[duplicates] = static_cast<double>(counts.duplicates);
    out[rejected] = static_cast<double>(counts.rejected);
    return ok;
}

Status RemoteRobot::update(Now at, Next next) const noexcept {
    next[worst_age] = std::max(at[worst_age], at[age]);
    next[last_drift] = at[drift];
    connection(at).end_step();
    return ok;
}

} // namespace bf::middleware
