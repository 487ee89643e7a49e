#include "bf/middleware/robot_host.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <unistd.h>
#include <utility>

namespace bf::middleware {

namespace {

/// Does that not throw?
template <class F> bool holds(F&& f) {
    try {
        f();
    } catch (const std::exception&) {
        return false;
    }
    return true;
}

bool are_finite(const double* values, int count) noexcept {
    return std::all_of(values, values + count, [](double x) { return std::isfinite(x); });
}

} // namespace

RobotHost::RobotHost(std::string name, const toolbox::RobotDevice& device, toolbox::RobotConnection& robot,
                     RobotEnd& end, const HostOptions& options)
    : device_(device), robot_(robot), end_(end), options_(options) {
    description_.name = std::move(name);
    description_.process = static_cast<int>(getpid());
    description_.waits = options.waits;
    description_.watchdog = options.waits ? 0 : options.watchdog;
    description_.joints = device.joint_names();
}

void RobotHost::start(double period) {
    RobotDescription& d = description_;
    d.period = period;
    d.wrenches = robot_.sensors(Sensor::wrench);
    d.imus = robot_.sensors(Sensor::imu);
    for (int i = 0; i < measurement_count; ++i)
        if (holds([&] { device_.check_measurement(static_cast<Measurement>(i)); })) d.measurements |= 1U << i;
    for (int i = 0; i < mode_count; ++i)
        if (holds([&] { device_.check_mode(static_cast<ControlMode>(i)); })) d.modes |= 1U << i;
    d.has_position_gains = holds([&] { device_.check_gains(Loop::position); });
    d.has_torque_gains = holds([&] { device_.check_gains(Loop::torque); });
    d.has_motor_parameters = holds([&] { device_.check_motor_parameters(); });
    const auto n = static_cast<Eigen::Index>(d.joints.size());
    for (auto* limits : {&d.position_min, &d.position_max, &d.velocity_min, &d.velocity_max})
        limits->resize(n);
    if (!robot_.read(Limits::position, d.position_min, d.position_max) ||
        !robot_.read(Limits::velocity, d.velocity_min, d.velocity_max))
        throw std::runtime_error(std::string("the robot tells no limits: ") + robot_.error());

    at_ = RobotLayout(d);
    state_.assign(static_cast<std::size_t>(at_.state_size()), std::numeric_limits<double>::quiet_NaN());
    std::fill_n(state_.begin(), RobotLayout::state_head, 0.0);
    state_[RobotLayout::mode] = state_[RobotLayout::other] = -1;
    command_.assign(static_cast<std::size_t>(at_.command_size()), 0);
    settings_.assign(static_cast<std::size_t>(at_.settings_size()), 0);
    gains_ = settings_;
    values_.resize(n);
    wrench_.resize(wrench_size);
    imu_.resize(imu_size);
    loops_ = before_ = Loops(n);
    end_.start(d);
    show_gains();
    if (!options_.waits) take_joints(OnLoss::hold); // its time goes on before a controller comes
}

void RobotHost::step() noexcept {
    const auto waits = [this] { return options_.waits && !(options_.is_once && gone() > 0); };
    while (waits() && !has_all()) {
        if (is_interrupted() || end_.wants_reset() || (options_.goes_on && !options_.goes_on())) return;
        lose();
        end_.wait(0.05);
    }
    if (!waits()) {
        heed();
        const auto is_over = [&](double since, double longest) {
            return session_ != 0 && longest > 0 && now() - since > longest;
        };
        if (is_over(heard_, options_.watchdog))
            let_go(Event::silent);
        else if (is_over(referred_, options_.idle_after))
            suspend();
    }
    obey();
}

bool RobotHost::has_all() noexcept {
    take();
    const bool has_settings = take_settings();
    return has_settings && session_ != 0 && may_go();
}

/// Takes the joints back from a controller that is gone, whose last words come first.
void RobotHost::lose() noexcept {
    if (session_ == 0 || !end_.is_gone() || has_all()) return;
    if (session_ != 0) let_go(Event::died); // they were no farewell
}

void RobotHost::heed() noexcept {
    take();
    lose();
}

void RobotHost::stop() noexcept {
    if (session_ != 0) let_go(Event::left);
}

void RobotHost::reset() noexcept {
    stop();
    end_.reset();
}

void RobotHost::show(double time) noexcept {
    state_[RobotLayout::time] = time;
    const double mode = state_[RobotLayout::mode];
    state_[RobotLayout::other] =
        mode < 0 || is_suspended_
            ? -1
            : robot_.joint_in_other_mode(static_cast<ControlMode>(static_cast<int>(mode)));
    const auto put = [&](int where, const Eigen::VectorXd& values) {
        std::copy(values.begin(), values.end(), state_.begin() + where);
    };
    for (int i = 0; i < measurement_count; ++i) {
        const auto what = static_cast<Measurement>(i);
        if (!(description_.measurements >> i & 1)) continue;
        if (robot_.read(what, values_))
            put(at_.measurement(what), values_);
        else if (what == Measurement::joint_position)
            return; // it tells nothing: that is no state, and its controller finds that none comes
    }
    state_[RobotLayout::age] = robot_.age(); // of what was read
    for (int i = 0; i < at_.wrenches; ++i)
        if (robot_.read(Sensor::wrench, description_.wrenches[static_cast<std::size_t>(i)], wrench_))
            put(at_.wrench(i), wrench_);
    for (int i = 0; i < at_.imus; ++i)
        if (robot_.read(Sensor::imu, description_.imus[static_cast<std::size_t>(i)], imu_))
            put(at_.imu(i), imu_);
    end_.show_state(state_.data(), now());
}

void RobotHost::read(Loops& loops) noexcept {
    if (description_.has_position_gains) robot_.read_gains(Loop::position, loops.position);
    if (description_.has_torque_gains) robot_.read_gains(Loop::torque, loops.torque);
    if (description_.has_motor_parameters) robot_.read_motor_parameters(loops.motors);
}

void RobotHost::show_gains() noexcept {
    read(loops_);
    auto to = gains_.begin() + RobotLayout::settings_head;
    for (const auto* part : {&loops_.position.P, &loops_.position.I, &loops_.position.D, &loops_.torque.P,
                             &loops_.torque.I, &loops_.torque.D, &loops_.motors.k_tau, &loops_.motors.k_bemf})
        to = std::copy(part->begin(), part->end(), to);
    end_.show_gains(gains_.data());
}

void RobotHost::take() noexcept {
    for (Stamp stamp; end_.take_command(command_.data(), stamp);) {
        const double session = command_[RobotLayout::session];
        if (session == last_session_ || session == 0 || !std::isfinite(session)) continue;
        if (session != session_) {
            if (session_ != 0) let_go(Event::died);
            session_ = session;
            state_[RobotLayout::owner] = session;
            state_[RobotLayout::commands] = state_[RobotLayout::settings] = state_[RobotLayout::refused] = 0;
            gains_[RobotLayout::of] = session;
            gains_[RobotLayout::count] = 0;
            read(before_);
            is_changed_ = false;
            show_gains();
            tell(Event::came);
        }
        heard_ = stamp.time;
        is_leaving_ = command_[RobotLayout::release] != 0;
    }
    // Where its time waits, what was commanded last is done to its end, whenever the farewell comes.
    if (is_leaving_ && !may_go()) let_go(Event::left);
}

/// Does its time wait, and does the newest command let it go on?
bool RobotHost::may_go() const noexcept {
    return options_.waits &&
           command_[RobotLayout::until] >= state_[RobotLayout::time] + description_.period / 2;
}

/// Have those come that were given before the newest command?
bool RobotHost::take_settings() noexcept {
    are_new_ |= end_.take_settings(settings_.data());
    const double came = settings_[RobotLayout::of] == session_ ? settings_[RobotLayout::count] : 0;
    return came >= command_[RobotLayout::given];
}

void RobotHost::obey() noexcept {
    if (session_ == 0) return;
    obey_settings();
    const double mode = command_[RobotLayout::mode_asked];
    if (command_[RobotLayout::mode_count] != modes_set_ && command_[RobotLayout::mode_count] != 0) {
        modes_set_ = command_[RobotLayout::mode_count];
        references_ = 0;
        if (!set_mode()) refuse(Refusal::mode);
    }
    if (command_[RobotLayout::references] != references_ && state_[RobotLayout::mode] == mode &&
        modes_set_ != 0) {
        references_ = command_[RobotLayout::references];
        referred_ = now();
        if (is_suspended_ && !set_mode()) refuse(Refusal::mode);
        const double* given = &command_[RobotLayout::command_head];
        values_ = Eigen::Map<const Eigen::VectorXd>(given, at_.n);
        if (!are_finite(given, at_.n) ||
            !robot_.write(static_cast<ControlMode>(static_cast<int>(mode)), values_))
            refuse(Refusal::references);
    }
    state_[RobotLayout::commands] = command_[RobotLayout::number];
}

/// That which the controller asks for.
bool RobotHost::set_mode() noexcept {
    const double mode = command_[RobotLayout::mode_asked], limit = command_[RobotLayout::limit];
    if (!(mode >= 0 && mode < mode_count) || !(description_.modes >> static_cast<int>(mode) & 1))
        return false;
    const auto asked = static_cast<ControlMode>(static_cast<int>(mode));
    if (!robot_.set_mode(asked) || (limit > 0 && !robot_.set_trajectory_limit(asked, limit))) return false;
    state_[RobotLayout::mode] = mode;
    referred_ = now();
    is_suspended_ = false;
    return true;
}

/// Joints that live from references wait for them as those of a controller that is gone; the mode that is
/// shown stays the one that is asked for.
void RobotHost::suspend() noexcept {
    const double mode = state_[RobotLayout::mode];
    if (is_suspended_ || modes_set_ == 0 || mode == static_cast<int>(ControlMode::position) ||
        mode == static_cast<int>(ControlMode::position_direct))
        return;
    take_joints(options_.on_loss);
    state_[RobotLayout::mode] = mode;
    is_suspended_ = true;
    tell(Event::idle);
}

void RobotHost::obey_settings() noexcept {
    take_settings();
    if (!are_new_ || settings_[RobotLayout::of] != session_) return;
    are_new_ = false;
    const double changed = settings_[RobotLayout::changed];
    const int which = changed >= 0 && changed < 8 ? static_cast<int>(changed) : 0;
    is_changed_ = true;
    const auto part = [&](int at) {
        return Eigen::Map<const Eigen::VectorXd>(&settings_[static_cast<std::size_t>(at)], at_.n);
    };
    for (const auto& [loop, bit, has, refusal] :
         {std::tuple(Loop::position, 1, description_.has_position_gains, Refusal::position_gains),
          std::tuple(Loop::torque, 2, description_.has_torque_gains, Refusal::torque_gains)}) {
        if (!(which & bit)) continue;
        auto& gains = loop == Loop::position ? loops_.position : loops_.torque;
        const int at = at_.gains(loop);
        gains.P = part(at);
        gains.I = part(at + at_.n);
        gains.D = part(at + 2 * at_.n);
        if (!has || !are_finite(&settings_[static_cast<std::size_t>(at)], 3 * at_.n) ||
            !robot_.write_gains(loop, gains))
            refuse(refusal);
    }
    if (which & 4) {
        loops_.motors.k_tau = part(at_.motors());
        loops_.motors.k_bemf = part(at_.motors() + at_.n);
        if (!description_.has_motor_parameters ||
            !are_finite(&settings_[static_cast<std::size_t>(at_.motors())], 2 * at_.n) ||
            !robot_.write_motor_parameters(loops_.motors))
            refuse(Refusal::motor_parameters);
    }
    state_[RobotLayout::settings] = gains_[RobotLayout::count] = settings_[RobotLayout::count];
    show_gains();
}

void RobotHost::refuse(Refusal what) noexcept {
    if (state_[RobotLayout::refused] == 0) tell(Event::refused);
    state_[RobotLayout::refused] = static_cast<double>(what);
}

void RobotHost::let_go(Event why) noexcept {
    if (is_changed_) {
        if (description_.has_position_gains) robot_.write_gains(Loop::position, before_.position);
        if (description_.has_torque_gains) robot_.write_gains(Loop::torque, before_.torque);
        if (description_.has_motor_parameters) robot_.write_motor_parameters(before_.motors);
        show_gains();
    }
    if (modes_set_ != 0) take_joints(options_.on_loss); // which nobody else has commanded
    is_suspended_ = false;
    modes_set_ = references_ = 0;
    last_session_ = std::exchange(session_, 0);
    state_[RobotLayout::owner] = 0;
    gone_.fetch_add(1, std::memory_order_relaxed);
    tell(std::exchange(is_leaving_, false) && why == Event::died ? Event::left : why);
}

void RobotHost::take_joints(OnLoss how) noexcept {
    const auto go_to = [&](ControlMode mode) {
        if (!(description_.modes >> static_cast<int>(mode) & 1) || !robot_.set_mode(mode)) return false;
        state_[RobotLayout::mode] = static_cast<int>(mode);
        return true;
    };
    if (how == OnLoss::limp) {
        go_to(ControlMode::torque);
    } else if (!go_to(ControlMode::position) && go_to(ControlMode::position_direct) &&
               robot_.read(Measurement::joint_position, values_)) {
        robot_.write(ControlMode::position_direct, values_);
    }
}

void RobotHost::tell(Event event) noexcept {
    const unsigned next = told_.load(std::memory_order_relaxed);
    if (next - seen_.load(std::memory_order_acquire) == events_.size()) return; // nobody listens
    events_[next % events_.size()].store(event, std::memory_order_relaxed);
    told_.store(next + 1, std::memory_order_release);
}

bool RobotHost::take_event(Event& event) noexcept {
    const unsigned next = seen_.load(std::memory_order_relaxed);
    if (next == told_.load(std::memory_order_acquire)) return false;
    event = events_[next % events_.size()].load(std::memory_order_relaxed);
    seen_.store(next + 1, std::memory_order_release);
    return true;
}

} // namespace bf::middleware
