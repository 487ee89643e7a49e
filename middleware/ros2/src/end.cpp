#include "end.hpp"

#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "path.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

namespace bf::ros2 {

namespace {

using middleware::ControlMode;
using middleware::ExchangeBuffer;
using middleware::Measurement;
using middleware::RobotDescription;
using middleware::RobotLayout;
using middleware::Stamp;

constexpr double look = 0.1;   ///< s between two looks at who listens while the time stands still
constexpr double patience = 1; ///< s until a state that stands is sent again

/// What goes out, in the thread of the node.
class States final : public Sender {
  public:
    States(Node& node, const RobotDescription& robot)
        : newest(RobotLayout(robot).state_size()), robot_(robot), at_(robot),
          state_(static_cast<std::size_t>(at_.state_size())) {
        joints_ = node.advertise(messages::joint_state(), "joint_states", {});
        clock_ = node.advertise(messages::clock(), "/clock", {});
        for (const auto& name : robot.wrenches)
            wrenches_.push_back(node.advertise(messages::wrench(), plain(name) + "/wrench", {}));
        for (const auto& name : robot.imus)
            imus_.push_back(node.advertise(messages::imu(), plain(name) + "/imu", {}));
        messages::assign(joint_->name, robot.joints);
    }
    bool has_news() const noexcept override {
        return newest.newest() != sent_ || (sent_ != 0 && middleware::now() - looked_ > look);
    }
    void send() override {
        looked_ = middleware::now();
        const int before = std::exchange(readers_, readers());
        const bool has_come = readers_ > before;
        if (newest.newest() == sent_) {
            clock_->publish(clock_message_.get()); // by which others know that it stands still
            // Whoever answers each state would answer one that comes twice. So it is sent again only for
            // those who have come since, when both sides know each other, and nobody answers it.
            if (has_come) {
                have_come_ = true;
                last_ = looked_;
            }
            if (!have_come_ || looked_ - last_ < patience) return;
        }
        Stamp stamp;
        if (!newest.read(state_.data(), stamp)) return;
        sent_ = stamp.number;
        last_ = looked_;
        have_come_ = has_come; // who may not know us yet, and miss it
        const auto time = messages::time_of(state_[RobotLayout::time]);
        clock_message_->clock = time;
        const auto fill = [&](Measurement what, rosidl_runtime_c__double__Sequence& to) {
            const bool has = robot_.measurements >> static_cast<int>(what) & 1;
            messages::resize(to, has ? static_cast<std::size_t>(at_.n) : 0);
            if (has) std::copy_n(state_.begin() + at_.measurement(what), at_.n, to.data);
        };
        joint_->header.stamp = time;
        fill(Measurement::joint_position, joint_->position);
        fill(Measurement::joint_velocity, joint_->velocity);
        fill(Measurement::joint_torque, joint_->effort);
        for (int i = 0; i < at_.wrenches; ++i) {
            const double* w = &state_[static_cast<std::size_t>(at_.wrench(i))];
            wrench_->header.stamp = time;
            messages::assign(wrench_->header.frame_id, robot_.wrenches[static_cast<std::size_t>(i)]);
            wrench_->wrench.force = {w[0], w[1], w[2]};
            wrench_->wrench.torque = {w[3], w[4], w[5]};
            wrenches_[static_cast<std::size_t>(i)]->publish(wrench_.get());
        }
        for (int i = 0; i < at_.imus; ++i) {
            const double* m = &state_[static_cast<std::size_t>(at_.imu(i))];
            imu_->header.stamp = time;
            messages::assign(imu_->header.frame_id, robot_.imus[static_cast<std::size_t>(i)]);
            const Eigen::Vector4d q = quaternion_of({m[0], m[1], m[2]});
            imu_->orientation = {q.x(), q.y(), q.z(), q.w()};
            imu_->linear_acceleration = {m[3], m[4], m[5]};
            imu_->angular_velocity = {m[6], m[7], m[8]};
            imus_[static_cast<std::size_t>(i)]->publish(imu_.get());
        }
        joints_->publish(joint_.get());
        clock_->publish(clock_message_.get()); // last: whoever goes by it has the state of that time
    }

    ExchangeBuffer newest;
    const std::shared_ptr<Publisher>& joints() const { return joints_; }

  private:
    /// Of all that a state is sent to.
    int readers() const noexcept {
        int all = joints_->readers();
        for (const auto* list : {&wrenches_, &imus_})
            for (const auto& each : *list) all += each->readers();
        return all;
    }

    const RobotDescription robot_;
    const RobotLayout at_;
    std::vector<double> state_;
    std::uint64_t sent_ = 0;
    double looked_ = 0, last_ = 0; ///< s; when a state was sent last, or a reader has come since
    int readers_ = 0;
    bool have_come_ = false; ///< readers, since then
    std::shared_ptr<Publisher> joints_, clock_;
    std::vector<std::shared_ptr<Publisher>> wrenches_, imus_;
    std::shared_ptr<messages::JointState> joint_ =
        messages::make<messages::JointState>(messages::joint_state());
    std::shared_ptr<messages::Clock> clock_message_ = messages::make<messages::Clock>(messages::clock());
    std::shared_ptr<messages::Wrench> wrench_ = messages::make<messages::Wrench>(messages::wrench());
    std::shared_ptr<messages::Imu> imu_ = messages::make<messages::Imu>(messages::imu());
};

/// How many programs send commands, looked at in the thread of the node, and whether another one sends states
/// in the robot's place.
class Watch final : public Sender {
  public:
    bool has_news() const noexcept override { return middleware::now() - last_ > 0.1; }
    void send() override {
        last_ = middleware::now();
        int all = 0;
        for (const auto& each : topics) all += each->writers();
        writers = all;
        is_doubled = states->others() > 0;
    }
    std::vector<std::shared_ptr<Subscription>> topics;
    std::shared_ptr<Publisher> states;
    std::atomic<bool> is_doubled{false};
    std::atomic<int> writers{0};

  private:
    double last_ = 0;
};

class End final : public middleware::RobotEnd {
  public:
    End(const NodeOptions& node, CommandTopics topics, bool waits)
        : name_("ROS 2 robot in the namespace " + node.name_space), topics_(std::move(topics)), waits_(waits),
          node_(node) {}
    ~End() override {
        is_over_ = true;
        steps_bell_.ring();
        node_.close();
    }

    void start(const RobotDescription& description) override {
        at_.emplace(description);
        period_ = description.period;
        command_.assign(static_cast<std::size_t>(at_->command_size()), 0.0);
        numbers_.assign(static_cast<std::size_t>(at_->n) + 1, 0.0);
        references_.setZero(at_->n);
        measured_.setZero(at_->n);
        newest_.emplace(at_->n + 1);
        arriving_.assign(numbers_.size(), 0.0);
        node_.open();
        states_ = std::make_shared<States>(node_, description);
        node_.add(states_);
        const auto modes = description.modes;
        for (const auto& [mode, topic] : {std::pair(ControlMode::torque, topics_.effort),
                                          std::pair(ControlMode::velocity, topics_.velocity),
                                          std::pair(ControlMode::position_direct, topics_.position)})
            if (modes >> static_cast<int>(mode) & 1)
                watch_->topics.push_back(node_.subscribe(
                    messages::numbers(), topic, {1, true}, [this, m = mode](const void* message) {
                        take(m, static_cast<const messages::Numbers*>(message)->data);
                    }));
        if (modes >> static_cast<int>(ControlMode::position_direct) & 1)
            watch_->topics.push_back(
                node_.subscribe(messages::trajectory(), topics_.trajectory, {},
                                [this, joints = description.joints](const void* message) {
                                    take(*static_cast<const messages::Trajectory*>(message), joints);
                                }));
        watch_->states = states_->joints();
        node_.add(watch_);
        services_.push_back(
            messages::serve(node_, "~/step", [this](bool& is_done) { return step(is_done); }));
        services_.push_back(
            messages::serve(node_, "~/reset", [this](bool& is_done) { return begin_again(is_done); }));
        services_.push_back(messages::serve(
            node_, "~/pause", [this](bool asked, bool& is_done) { return pause(asked, is_done); }));
    }

    void show_state(const double* state, double) noexcept override {
        states_->newest.write(state, middleware::now());
        node_.bell().ring();
        measured_ =
            Eigen::Map<const Eigen::VectorXd>(state + at_->measurement(Measurement::joint_position), at_->n);
        if (is_ours_ && state[RobotLayout::owner] != session_) is_ours_ = is_following_ = false;
        is_given_ = is_granted_ = false;
        time_ = state[RobotLayout::time];
        shown_time_ = time_;
        if (is_reset_.exchange(false)) ++resets_;
        steps_bell_.ring();
    }
    bool has_double() const noexcept override { return watch_->is_doubled; }
    void show_gains(const double*) noexcept override {}

    /// In the thread of the steps.
    bool take_command(double* command, Stamp& stamp) noexcept override {
        const bool is_new = take_numbers();
        const bool is_begun = take_path();
        bool may_go = is_new || is_begun;
        if (!is_granted_ && (steps_asked_ > steps_done_ || (is_free_ && middleware::now() >= due_)))
            may_go = true;
        // Positions that were asked for stay; efforts and velocities are to be asked for again and again.
        const bool stays =
            is_ours_ && command_[RobotLayout::mode_count] > 0 && mode_ == ControlMode::position_direct;
        if (is_following_ && !is_given_) follow();
        if (!may_go && (is_given_ || !(stays || is_following_))) return false;
        is_given_ = true;
        if (!is_ours_) begin_session();
        if (waits_ && may_go && !std::exchange(is_granted_, true)) {
            command_[RobotLayout::until] = time_ + period_;
            if (steps_asked_ > steps_done_) steps_done_.fetch_add(1);
            due_ = std::max(due_ + period_, middleware::now() - 10 * period_);
        }
        ++command_[RobotLayout::number];
        std::copy(command_.begin(), command_.end(), command);
        stamp = {static_cast<std::uint64_t>(command_[RobotLayout::number]), middleware::now()};
        return true;
    }
    bool take_settings(double*) noexcept override { return false; }
    void allow_reset() noexcept override { may_reset_ = true; }
    bool wants_reset() const noexcept override { return is_reset_asked_; }
    void reset() noexcept override {
        is_ours_ = is_following_ = false;
        steps_done_ = steps_asked_.load();
        newest_->read(numbers_.data(), taken_); // a command for what is over
        has_path_ = false;
        is_reset_asked_ = false;
        is_reset_ = true;
    }
    void wait(double timeout) noexcept override {
        const double left = is_free_ ? std::clamp(due_ - middleware::now(), 0.0, timeout) : timeout;
        bell_.wait(
            left, [&] { return is_news(); }, 0);
    }
    /// One that has sent a command once and is gone, whose positions stay, is none.
    bool is_gone() noexcept override {
        if (messages_ < 2 && mode_ == ControlMode::position_direct) return false;
        const bool has = watch_->writers > 0;
        const bool is = std::exchange(had_writers_, has) && !has;
        if (is) is_ours_ = is_following_ = false; // while its time stands still no state tells so
        return is;
    }
    middleware::Counts counts() const noexcept override { return {.rejected = rejected_}; }
    const char* what_is_rejected() const noexcept override {
        return "a command that has not one number for each of its joints, or a trajectory that it cannot "
               "follow";
    }
    const std::string& name() const noexcept override { return name_; }

  private:
    // ---- in the thread of the node
    void take(ControlMode mode, const rosidl_runtime_c__double__Sequence& data) {
        if (static_cast<int>(data.size) != at_->n) { // of another robot
            ++rejected_;
            return;
        }
        arriving_[0] = static_cast<double>(mode);
        std::copy_n(data.data, data.size, arriving_.begin() + 1);
        newest_->write(arriving_.data(), middleware::now());
        bell_.ring();
    }
    void take(const messages::Trajectory& message, const std::vector<std::string>& joints) {
        try {
            auto path = std::make_unique<Path>(message, joints);
            const std::lock_guard lock(path_mutex_);
            next_path_ = std::move(path);
            has_path_ = true;
        } catch (const std::runtime_error&) { // of another robot
            ++rejected_;
            return;
        }
        bell_.ring();
    }
    std::string step(bool& is_done) {
        is_done = false;
        if (!waits_) return "the robot's time goes by the clock; serve it without --realtime";
        if (is_free_) return "the robot's time runs; pause it";
        const double before = shown_time_;
        steps_asked_.fetch_add(1);
        bell_.ring();
        steps_bell_.wait(
            5, [&] { return shown_time_ != before || is_over_; }, 0);
        is_done = shown_time_ != before;
        return is_done ? "" : "the step is not done within 5 s";
    }
    std::string begin_again(bool& is_done) {
        is_done = false;
        if (!waits_) return "the robot's time goes by the clock; serve it without --realtime";
        if (!may_reset_)
            return "this model does not begin again: it is recorded, or one of its blocks cannot";
        const int before = resets_;
        is_reset_asked_ = true;
        bell_.ring();
        steps_bell_.wait(
            5, [&] { return resets_ != before || is_over_; }, 0);
        is_done = resets_ != before;
        return is_done ? "" : "it is not as it began within 5 s";
    }
    std::string pause(bool asked, bool& is_done) {
        is_done = waits_;
        if (!waits_) return "the robot's time goes by the clock; serve it without --realtime";
        due_ = middleware::now();
        is_free_ = !asked;
        bell_.ring();
        return "";
    }

    // ---- in the thread of the steps
    bool is_news() const noexcept {
        return newest_->newest() != taken_.number || has_path_ || steps_asked_ > steps_done_ || is_over_ ||
               is_reset_asked_ || (is_free_ && middleware::now() >= due_);
    }
    bool take_numbers() noexcept {
        if (newest_->newest() == taken_.number || !newest_->read(numbers_.data(), taken_)) return false;
        is_following_ = false;
        references_ = Eigen::Map<const Eigen::VectorXd>(numbers_.data() + 1, at_->n);
        ask(static_cast<ControlMode>(static_cast<int>(numbers_[0])));
        ++messages_;
        return true;
    }
    bool take_path() noexcept {
        if (!has_path_) return false;
        const std::unique_lock lock(path_mutex_, std::try_to_lock);
        if (!lock) return false; // the next step takes it
        std::swap(path_, next_path_);
        has_path_ = false;
        is_following_ = true;
        path_->begin(time_, is_ours_ && mode_ == ControlMode::position_direct ? references_ : measured_);
        follow();
        ++messages_;
        return true;
    }
    void follow() noexcept {
        is_following_ = path_->at(time_ + period_, references_);
        ask(ControlMode::position_direct);
    }
    void ask(ControlMode mode) noexcept {
        if (!is_ours_) begin_session();
        if (mode_ != mode || command_[RobotLayout::mode_count] == 0) {
            mode_ = mode;
            ++command_[RobotLayout::mode_count];
            command_[RobotLayout::mode_asked] = static_cast<double>(mode);
            command_[RobotLayout::references] = 0;
        }
        ++command_[RobotLayout::references];
        std::copy(references_.begin(), references_.end(), command_.begin() + RobotLayout::command_head);
    }
    /// Whoever sends the first command after nobody did is a new controller.
    void begin_session() noexcept {
        std::fill(command_.begin(), command_.end(), 0.0);
        session_ = session_ == 0 ? std::floor(middleware::now() * 1e6) + 1 : session_ + 1;
        command_[RobotLayout::session] = session_;
        command_[RobotLayout::until] = time_;
        is_ours_ = true;
        messages_ = 0;
    }

    const std::string name_;
    const CommandTopics topics_;
    const bool waits_;
    double period_ = 0;
    std::optional<RobotLayout> at_;
    std::vector<double> command_, numbers_, arriving_;
    Eigen::VectorXd references_, measured_;
    std::optional<ExchangeBuffer> newest_; ///< of the node's thread: mode, references
    Stamp taken_;
    std::mutex path_mutex_;
    std::unique_ptr<Path> path_, next_path_; ///< the one that is followed; the newest, or one to be forgotten
    std::atomic<bool> has_path_{false}, is_free_{false}, is_over_{false};
    std::atomic<bool> may_reset_{false}, is_reset_asked_{false}, is_reset_{false};
    std::atomic<int> resets_{0}; ///< that are shown
    std::atomic<std::uint64_t> steps_asked_{0}, steps_done_{0}, rejected_{0};
    std::atomic<double> shown_time_{0}, due_{0};
    bool is_ours_ = false, is_following_ = false, had_writers_ = false;
    bool is_given_ = false, is_granted_ = false; ///< in this step: a command, and that the time may go on
    ControlMode mode_ = ControlMode::position;
    double session_ = 0, time_ = 0;
    int messages_ = 0;
    middleware::Bell bell_{}, steps_bell_{};
    Node node_;
    std::shared_ptr<States> states_;
    std::shared_ptr<Watch> watch_ = std::make_shared<Watch>();
    std::vector<std::shared_ptr<Service>> services_;
};

} // namespace

std::unique_ptr<middleware::RobotEnd> make_end(const NodeOptions& node, const CommandTopics& commands,
                                               bool waits) {
    return std::make_unique<End>(node, commands, waits);
}

} // namespace bf::ros2
