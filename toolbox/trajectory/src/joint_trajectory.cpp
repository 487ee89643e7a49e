#include "bf/trajectory/joint_trajectory.hpp"

#include <ruckig/ruckig.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace bf::trajectory {

namespace {

/// Ruckig, for so many elements.
class TimeOptimal {
  public:
    /// Motions to a target are told from where they are.
    struct Element {
        double way, velocity, acceleration, max_velocity, max_acceleration, max_jerk;
    };
    std::vector<Element> elements;

    TimeOptimal(std::size_t size, ruckig::Synchronization how)
        : elements(size), solver_(size), input_(size), output_(size), unit_(size, 1.0), position_(size),
          velocity_(size), acceleration_(size) {
        input_.synchronization = how;
    }

    bool find(double shortest) noexcept {
        if (shortest > 0.0)
            input_.minimum_duration = shortest;
        else
            input_.minimum_duration.reset();
        // The solver compares with absolute tolerances, which suit numbers of about one. Each element has
        // therefore a unit that is a power of two, so that nothing is rounded: first the one in which its
        // greatest velocity is about one, and where rounding spoils that, larger ones.
        for (const int larger : {0, 4, 8}) {
            for (std::size_t i = 0; i < elements.size(); ++i) {
                const Element& e = elements[i];
                const double unit = unit_[i] = std::exp2(std::ilogb(e.max_velocity) + larger);
                input_.current_position[i] = 0.0;
                input_.current_velocity[i] = e.velocity / unit;
                input_.current_acceleration[i] = e.acceleration / unit;
                input_.target_position[i] = e.way / unit;
                input_.max_velocity[i] = e.max_velocity / unit;
                input_.max_acceleration[i] = e.max_acceleration / unit;
                input_.max_jerk[i] = e.max_jerk / unit;
            }
            if (solver_.calculate(input_, output_) == ruckig::Result::Working) return true;
        }
        return false;
    }

    double duration() const noexcept { return output_.get_duration(); }
    void go_to(double t) const noexcept { output_.at_time(t, position_, velocity_, acceleration_); }
    /// From where it began, at the time that it went to.
    Motion motion(std::size_t i) const noexcept {
        return {unit_[i] * position_[i], unit_[i] * velocity_[i], unit_[i] * acceleration_[i]};
    }

  private:
    ruckig::Ruckig<ruckig::DynamicDOFs> solver_;
    ruckig::InputParameter<ruckig::DynamicDOFs> input_;
    ruckig::Trajectory<ruckig::DynamicDOFs> output_;
    std::vector<double> unit_; ///< of the positions in the solver
    mutable std::vector<double> position_, velocity_, acceleration_;
};

} // namespace

struct JointTrajectory::Content {
    Content(int joints, Timing which, Synchronisation how)
        : timing(which), size(static_cast<std::size_t>(joints)), stays_on_line(how == Synchronisation::phase),
          quintics(size), brakes(size), rest(joints),
          each(size,
               how == Synchronisation::none ? ruckig::Synchronization::None : ruckig::Synchronization::Time),
          line(1, ruckig::Synchronization::None), direction(joints) {}

    Timing timing;
    std::size_t size;
    bool stays_on_line;
    bool is_planned = false;
    Status status = Status::not_finite;
    Question asked;
    double duration = 0.0;
    std::vector<Quintic> quintics, brakes; ///< those to the target, and before them to rest
    double braking = 0.0;                  ///< s
    Eigen::VectorXd rest;                  ///< where they begin
    TimeOptimal each, line;                ///< of all elements, or of the part of `direction`
    bool is_on_line = false;               ///< the latter
    Eigen::VectorXd direction;
};

JointTrajectory::JointTrajectory(int joints, Timing timing, Synchronisation synchronisation) {
    if (joints < 1)
        throw std::invalid_argument("a trajectory needs a joint, but has " + std::to_string(joints));
    content_ = std::make_unique<Content>(joints, timing, synchronisation);
    question.position = question.velocity = question.acceleration = question.target =
        Eigen::VectorXd::Zero(joints);
    question.max_velocity = question.max_acceleration = question.max_jerk = Eigen::VectorXd::Ones(joints);
    content_->asked = question;
}
JointTrajectory::~JointTrajectory() = default;
JointTrajectory::JointTrajectory(JointTrajectory&&) noexcept = default;
JointTrajectory& JointTrajectory::operator=(JointTrajectory&&) noexcept = default;

double JointTrajectory::duration() const noexcept { return content_->duration; }

JointTrajectory::Status JointTrajectory::plan() noexcept {
    Content& c = *content_;
    if (c.is_planned && question == c.asked) return c.status;
    c.is_planned = true;
    c.asked = question;
    const Question& q = question;
    if (!q.position.allFinite() || !q.velocity.allFinite() || !q.acceleration.allFinite() ||
        !q.target.allFinite() || !std::isfinite(q.shortest))
        return c.status = Status::not_finite;
    const auto are_limits = [](const Eigen::VectorXd& limits) { return (limits.array() > 0.0).all(); };
    if (!are_limits(q.max_velocity) || !are_limits(q.max_acceleration) || !are_limits(q.max_jerk))
        return c.status = Status::bad_limits;
    return c.status = c.timing == Timing::minimum_jerk ? plan_minimum_jerk() : plan_time_optimal();
}

namespace {

/// The shortest time in which `excess`, the factor by which limits are exceeded, is at most 1: the first one
/// of a geometric row from `from`, and then the shortest before it; where none is, that of the least excess.
template <class Excess> std::pair<double, bool> shortest_time(double from, const Excess& excess) {
    constexpr double kept = 1.0 + 1e-9;
    double least = std::numeric_limits<double>::infinity(), best = from, before = 0.0;
    double T = from;
    for (int k = 0; k < 64; ++k, before = T, T *= 1.15) {
        const double now = excess(T);
        if (now < least) {
            least = now;
            best = T;
        }
        if (now <= kept) break;
    }
    if (least <= kept && before > 0.0) {
        double low = before;
        for (int k = 0; k < 40; ++k) {
            const double middle = 0.5 * (low + best);
            (excess(middle) <= kept ? best : low) = middle;
        }
    }
    return {best, least <= kept};
}

} // namespace

JointTrajectory::Status JointTrajectory::plan_minimum_jerk() noexcept {
    Content& c = *content_;
    const Question& q = question;
    const auto excess = [&q](const Quintic::Peaks& peaks, Eigen::Index i, double v, double a) {
        return std::max({peaks.velocity / std::max(v, q.max_velocity[i]),
                         peaks.acceleration / std::max(a, q.max_acceleration[i]),
                         peaks.jerk / q.max_jerk[i]});
    };
    const auto from_rest = [&] {
        double T = 0.0;
        for (Eigen::Index i = 0; i < q.target.size(); ++i) {
            const double way = std::abs(q.target[i] - c.rest[i]);
            T = std::max({T, 1.875 * way / q.max_velocity[i],
                          std::sqrt(10.0 / std::sqrt(3.0) * way / q.max_acceleration[i]),
                          std::cbrt(60.0 * way / q.max_jerk[i])});
        }
        return T;
    };
    c.rest = q.position;
    c.braking = 0.0;
    double T = from_rest();
    if (q.velocity.isZero(0.0) && q.acceleration.isZero(0.0)) {
        T = std::max(q.shortest, T);
        if (T == 0.0 && q.target != q.position) return Status::bad_limits;
        for (std::size_t i = 0; i < c.size; ++i) {
            const auto k = static_cast<Eigen::Index>(i);
            c.quintics[i] = Quintic({q.position[k], 0.0, 0.0}, q.target[k], T);
        }
        c.duration = T;
        return std::isfinite(T * T * T) ? Status::planned : Status::not_found;
    }
    // Under way: one polynomial to the target, where that keeps the limits.
    const auto straight_on = [&](double time) {
        double worst = 0.0;
        for (std::size_t i = 0; i < c.size; ++i) {
            const auto k = static_cast<Eigen::Index>(i);
            c.quintics[i] = Quintic({q.position[k], q.velocity[k], q.acceleration[k]}, q.target[k], time);
            worst = std::max(worst, excess(c.quintics[i].peaks(), k, 0.0, 0.0));
        }
        return worst;
    };
    const double stop = q.velocity.cwiseAbs().cwiseQuotient(q.max_acceleration).maxCoeff();
    const auto [time, keeps] =
        shortest_time(std::max({q.shortest, 0.2 * std::max(T, stop), 1e-3}), straight_on);
    if (keeps) {
        straight_on(time);
        c.duration = time;
        return std::isfinite(time * time * time) ? Status::planned : Status::not_found;
    }
    // Otherwise a long polynomial would go far astray and be fast: each element is first brought to rest, by
    // the polynomial of least jerk whose end is free, within its limits or what it has beyond them.
    const auto brake = [&](double T_brake) {
        double worst = 0.0;
        for (std::size_t i = 0; i < c.size; ++i) {
            const auto k = static_cast<Eigen::Index>(i);
            const double v = q.velocity[k], a = q.acceleration[k];
            c.rest[k] = q.position[k] + T_brake * (v / 2.0 + T_brake * a / 12.0);
            c.brakes[i] = Quintic({q.position[k], v, a}, c.rest[k], T_brake);
            worst = std::max(worst, excess(c.brakes[i].peaks(), k, std::abs(v), std::abs(a)));
        }
        return worst;
    };
    double least = 1e-3;
    for (Eigen::Index i = 0; i < q.target.size(); ++i) {
        const double a = std::abs(q.acceleration[i]);
        least = std::max({least, 0.2 * std::abs(q.velocity[i]) / std::max(a, q.max_acceleration[i]),
                          0.2 * a / q.max_jerk[i]});
    }
    c.braking = shortest_time(least, brake).first;
    brake(c.braking);
    T = std::max(q.shortest - c.braking, from_rest());
    for (std::size_t i = 0; i < c.size; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        c.quintics[i] = Quintic({c.rest[k], 0.0, 0.0}, q.target[k], T);
    }
    c.duration = c.braking + T;
    return std::isfinite(T * T * T) ? Status::planned : Status::not_found;
}

namespace {

/// Whether v is a multiple of `direction`, which it becomes, up to `tolerance` of each element; `most` is the
/// element that tells the multiple.
bool is_along(const Eigen::VectorXd& direction, Eigen::Index most, const Eigen::VectorXd& v,
              const Eigen::VectorXd& tolerance, double& multiple) noexcept {
    multiple = v[most] / direction[most];
    bool is_so = true;
    for (Eigen::Index i = 0; i < v.size(); ++i)
        is_so &= std::abs(v[i] - multiple * direction[i]) <= 1e-9 * std::min(tolerance[i], 1e100);
    return is_so;
}

} // namespace

/// A line has one element: λ of position + λ direction, with the limits that are the tightest along it.
bool JointTrajectory::find_line() noexcept {
    Content& c = *content_;
    const Question& q = question;
    TimeOptimal::Element& along = c.line.elements[0];
    c.direction = q.target - q.position;
    along.way = 1.0;
    if (c.direction.isZero(0.0)) { // it passes the target, and comes back
        c.direction = q.velocity.isZero(0.0) ? q.acceleration : q.velocity;
        along.way = 0.0;
    }
    Eigen::Index most = 0;
    if (c.direction.cwiseAbs().cwiseQuotient(q.max_velocity).maxCoeff(&most) == 0.0)
        return false; // at rest there
    if (!is_along(c.direction, most, q.velocity, q.max_velocity, along.velocity) ||
        !is_along(c.direction, most, q.acceleration, q.max_acceleration, along.acceleration))
        return false;
    const auto tightest = [&c](const Eigen::VectorXd& limits) {
        return limits.cwiseQuotient(c.direction.cwiseAbs()).minCoeff();
    };
    along.max_velocity = tightest(q.max_velocity);
    along.max_acceleration = tightest(q.max_acceleration);
    along.max_jerk = tightest(q.max_jerk);
    return std::isfinite(along.max_velocity); // not of a way that is hardly a number
}

JointTrajectory::Status JointTrajectory::plan_time_optimal() noexcept {
    Content& c = *content_;
    const Question& q = question;
    if (!q.max_velocity.allFinite()) return Status::bad_limits;
    for (Eigen::Index i = 0; i < q.target.size(); ++i)
        if (std::isinf(q.max_acceleration[i]) && !std::isinf(q.max_jerk[i])) return Status::bad_limits;
    c.is_on_line = c.stays_on_line && find_line();
    for (std::size_t i = 0; i < c.size; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        c.each.elements[i] = {q.target[k] - q.position[k], q.velocity[k],         q.acceleration[k],
                              q.max_velocity[k],           q.max_acceleration[k], q.max_jerk[k]};
    }
    TimeOptimal& solver = c.is_on_line ? c.line : c.each;
    if (!solver.find(q.shortest)) return Status::not_found;
    c.duration = solver.duration();
    return Status::planned;
}

void JointTrajectory::at(double t, VectorOut position, VectorOut velocity,
                         VectorOut acceleration) const noexcept {
    const Content& c = *content_;
    if (t >= c.duration) {
        position = c.asked.target;
        velocity.setZero();
        acceleration.setZero();
        return;
    }
    if (c.timing == Timing::time_optimal) (c.is_on_line ? c.line : c.each).go_to(t);
    for (std::size_t i = 0; i < c.size; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        if (c.timing == Timing::time_optimal) {
            const double part = c.is_on_line ? c.direction[k] : 1.0;
            const Motion moved = c.is_on_line ? c.line.motion(0) : c.each.motion(i);
            position[k] = c.asked.position[k] + part * moved.position;
            velocity[k] = part * moved.velocity;
            acceleration[k] = part * moved.acceleration;
            continue;
        }
        const Motion now = t < c.braking ? c.brakes[i].at(t) : c.quintics[i].at(t - c.braking);
        position[k] = now.position;
        velocity[k] = now.velocity;
        acceleration[k] = now.acceleration;
    }
}

} // namespace bf::trajectory
