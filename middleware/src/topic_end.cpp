#include "bf/middleware/topic_end.hpp"

#include "bf/base/names.hpp"
#include "bf/core/value.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

namespace bf::middleware {

namespace {

constexpr double look = 0.1;   ///< s between two looks at who listens while the time stands still
constexpr double patience = 1; ///< s until a state that stands is sent again

/// What goes out, in the thread that sends.
class States final : public Sender {
  public:
    States(ServedTopics& topics, const RobotDescription& robot)
        : newest(RobotLayout(robot).state_size()), topics_(topics), robot_(robot), at_(robot),
          state_(static_cast<std::size_t>(at_.state_size())) {}
    bool has_news() const noexcept override {
        return newest.newest() != sent_ || (sent_ != 0 && now() - looked_ > look);
    }
    void send() override {
        looked_ = now();
        const int before = std::exchange(readers_, topics_.readers());
        const bool has_come = readers_ > before;
        if (newest.newest() == sent_) {
            topics_.send_time(state_[RobotLayout::time]); // by which others know that it stands still
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
        const double time = state_[RobotLayout::time];
        for (int i = 0; i < at_.wrenches; ++i)
            topics_.send_wrench(i, Eigen::Map<const Eigen::Matrix<double, 6, 1>>(numbers(at_.wrench(i))),
                                time);
        for (int i = 0; i < at_.imus; ++i) {
            const double* m = numbers(at_.imu(i));
            Eigen::Matrix<double, 10, 1> imu;
            imu << quaternion_of({m[0], m[1], m[2]}), Eigen::Map<const Eigen::Matrix<double, 6, 1>>(m + 3);
            topics_.send_imu(i, imu, time);
        }
        topics_.send_states({robot_.joints, measured(Measurement::joint_position),
                             measured(Measurement::joint_velocity), measured(Measurement::joint_torque),
                             time});
        topics_.send_time(time); // last: whoever goes by it has the state of that time
    }

    ExchangeBuffer newest;

  private:
    const double* numbers(int first) const { return state_.data() + first; }
    /// Empty where the robot has none.
    std::span<const double> measured(Measurement what) const {
        const bool has = robot_.measurements >> static_cast<int>(what) & 1;
        return {numbers(at_.measurement(what)), has ? static_cast<std::size_t>(at_.n) : 0};
    }

    ServedTopics& topics_;
    const RobotDescription robot_;
    const RobotLayout at_;
    std::vector<double> state_;
    std::uint64_t sent_ = 0;
    double looked_ = 0, last_ = 0; ///< s; when a state was sent last, or a reader has come since
    int readers_ = 0;
    bool have_come_ = false; ///< readers, since then
};

/// How many programs send commands, looked at in the thread that sends, what is told of them, and whether
/// another one is in the robot's place.
class Watch final : public Sender {
  public:
    explicit Watch(ServedTopics& topics) : topics_(topics) {}
    bool has_news() const noexcept override { return now() - last_ > look; }
    void send() override {
        last_ = now();
        writers = topics_.writers();
        is_doubled = topics_.has_double();
        topics_.news.find_names([this](std::uint64_t program) { return topics_.node_of(program); });
    }
    std::atomic<bool> is_doubled{false};
    std::atomic<int> writers{0};

  private:
    ServedTopics& topics_;
    double last_ = 0;
};

class TopicEnd final : public RobotEnd {
  public:
    TopicEnd(std::string name, std::unique_ptr<ServedTopics> topics, RobotCommandTopics commands, bool waits)
        : name_(std::move(name)), commands_(std::move(commands)), waits_(waits), topics_(std::move(topics)),
          watch_(std::make_shared<Watch>(*topics_)) {}
    ~TopicEnd() override {
        is_over_ = true;
        steps_bell_.ring();
        topics_->close();
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
        topics_->open(description);
        states_ = std::make_shared<States>(*topics_, description);
        topics_->add(states_);
        const auto modes = description.modes;
        for (const auto& [mode, topic] : {std::pair(ControlMode::torque, commands_.effort),
                                          std::pair(ControlMode::velocity, commands_.velocity),
                                          std::pair(ControlMode::position_direct, commands_.position)})
            if (modes >> static_cast<int>(mode) & 1)
                topics_->hear_references(
                    topic, [this, m = mode, joints = description.joints](std::span<const double> values) {
                        return take(m, values, joints);
                    });
        if (modes >> static_cast<int>(ControlMode::position_direct) & 1)
            topics_->hear_trajectories(
                commands_.trajectory,
                [this, joints = description.joints](const auto& message) { return take(message, joints); });
        topics_->add(watch_);
        topics_->offer("step", [this](bool& is_done) { return step(is_done); });
        topics_->offer("reset", [this](bool& is_done) { return begin_again(is_done); });
        topics_->offer("pause", [this](bool asked, bool& is_done) { return pause(asked, is_done); });
        topics_->offer("release", [this](bool& is_done) {
            is_done = is_release_asked_ = true;
            bell_.ring();
            return std::string();
        });
    }

    void show_state(const double* state, double) noexcept override {
        states_->newest.write(state, now());
        topics_->bell().ring();
        measured_ =
            Eigen::Map<const Eigen::VectorXd>(state + at_->measurement(Measurement::joint_position), at_->n);
        if (is_ours_ && state[RobotLayout::owner] != session_) {
            is_ours_ = is_following_ = false;
            is_taken_back_ = true;
        }
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
        // Whoever leaves before a first command has been its controller, too, and who was silent has left
        // before.
        if (is_release_asked_.exchange(false) && (waits_ || !std::exchange(is_taken_back_, false))) {
            if (!is_ours_) begin_session();
            command_[RobotLayout::release] = 1;
            is_ours_ = is_following_ = had_writers_ = false;
            give(command, stamp);
            return true;
        }
        bool may_go = is_new || is_begun;
        if (!is_granted_ && (steps_asked_ > steps_done_ || (is_free_ && now() >= due_))) may_go = true;
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
            due_ = std::max(due_ + period_, now() - 10 * period_);
        }
        give(command, stamp);
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
        const double left = is_free_ ? std::clamp(due_ - now(), 0.0, timeout) : timeout;
        bell_.wait(
            left, [&] { return is_news(); }, 0);
    }
    /// One that has sent a command once and is gone, whose positions stay, is none.
    bool is_gone() noexcept override {
        if (messages_ < 2 && mode_ == ControlMode::position_direct) return false;
        const bool has = watch_->writers > 0;
        // One that has let the robot go is about to be taken as such.
        const bool is = std::exchange(had_writers_, has) && !has && !is_release_asked_;
        if (is) is_ours_ = is_following_ = false; // while its time stands still no state tells so
        return is;
    }
    Counts counts() const noexcept override { return {.rejected = topics_->news.rejected()}; }
    std::string take_news() override { return topics_->news.take(); }
    const std::string& name() const noexcept override { return name_; }

  private:
    // ---- in the thread of the middleware
    // What is of another robot, or nothing that a joint can do, takes the robot from nobody.
    std::string take(ControlMode mode, std::span<const double> values,
                     const std::vector<std::string>& joints) {
        if (values.size() != joints.size())
            return std::to_string(values.size()) + " numbers, but the joints are " + name_list(joints);
        for (std::size_t i = 0; i < joints.size(); ++i)
            if (!std::isfinite(values[i]))
                return Value(values[i]).describe() + " for the joint '" + joints[i] + "'";
        arriving_[0] = static_cast<double>(mode);
        std::ranges::copy(values, arriving_.begin() + 1);
        newest_->write(arriving_.data(), now());
        bell_.ring();
        return "";
    }
    std::string take(const JointTrajectory& message, const std::vector<std::string>& joints) {
        try {
            auto path = std::make_unique<JointPath>(message, joints);
            const std::lock_guard lock(path_mutex_);
            next_path_ = std::move(path);
            has_path_ = true;
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        bell_.ring();
        return "";
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
        due_ = now();
        is_free_ = !asked;
        bell_.ring();
        return "";
    }

    // ---- in the thread of the steps
    bool is_news() const noexcept {
        return newest_->newest() != taken_.number || has_path_ || steps_asked_ > steps_done_ || is_over_ ||
               is_reset_asked_ || is_release_asked_ || (is_free_ && now() >= due_);
    }
    void give(double* command, Stamp& stamp) noexcept {
        ++command_[RobotLayout::number];
        std::copy(command_.begin(), command_.end(), command);
        stamp = {static_cast<std::uint64_t>(command_[RobotLayout::number]), now()};
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
        path_->begin(time_, measured_);
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
        session_ = session_ == 0 ? std::floor(now() * 1e6) + 1 : session_ + 1;
        command_[RobotLayout::session] = session_;
        command_[RobotLayout::until] = time_;
        is_ours_ = true;
        is_taken_back_ = false;
        messages_ = 0;
    }

    const std::string name_;
    const RobotCommandTopics commands_;
    const bool waits_;
    double period_ = 0;
    std::optional<RobotLayout> at_;
    std::vector<double> command_, numbers_, arriving_;
    Eigen::VectorXd references_, measured_;
    std::optional<ExchangeBuffer> newest_; ///< of the middleware's thread: mode, references
    Stamp taken_;
    std::mutex path_mutex_;
    std::unique_ptr<JointPath> path_,
        next_path_; ///< the one that is followed; the newest, or one to be forgotten
    std::atomic<bool> has_path_{false}, is_free_{false}, is_over_{false};
    std::atomic<bool> may_reset_{false}, is_reset_asked_{false}, is_reset_{false}, is_release_asked_{false};
    std::atomic<int> resets_{0}; ///< that are shown
    std::atomic<std::uint64_t> steps_asked_{0}, steps_done_{0};
    std::atomic<double> shown_time_{0}, due_{0};
    bool is_ours_ = false, is_following_ = false, had_writers_ = false;
    bool is_taken_back_ = false;                 ///< from a controller that has not let it go
    bool is_given_ = false, is_granted_ = false; ///< in this step: a command, and that the time may go on
    ControlMode mode_ = ControlMode::position;
    double session_ = 0, time_ = 0;
    int messages_ = 0;
    Bell bell_{}, steps_bell_{};
    const std::unique_ptr<ServedTopics> topics_;
    std::shared_ptr<States> states_;
    const std::shared_ptr<Watch> watch_;
};

} // namespace

std::unique_ptr<RobotEnd> make_topic_end(std::string name, std::unique_ptr<ServedTopics> topics,
                                         const RobotCommandTopics& commands, bool waits) {
    return std::make_unique<TopicEnd>(std::move(name), std::move(topics), commands, waits);
}

} // namespace bf::middleware
