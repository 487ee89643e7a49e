#include "bf/trajectory/joint_trajectory.hpp"

#include <ruckig/ruckig.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace bf::trajectory {

struct JointTrajectory::Content {
    Content(int joints, Timing which, Synchronisation how)
        : timing(which), size(static_cast<std::size_t>(joints)), quintics(size), brakes(size), rest(joints),
          solver(size), input(size), output(size), unit(size, 1.0), position(size), velocity(size),
          acceleration(size) {
        input.synchronization = how == Synchronisation::phase  ? ruckig::Synchronization::Phase
                                : how == Synchronisation::none ? ruckig::Synchronization::None
                                                               : ruckig::Synchronization::Time;
    }

    Timing timing;
    std::size_t size;
    bool is_planned = false;
    Status status = Status::not_finite;
    Question asked;
    double duration = 0.0;
    std::vector<Quintic> quintics, brakes; ///< those to the target, and before them to rest
    double braking = 0.0;                  ///< s
    Eigen::VectorXd rest;                  ///< where they begin
    ruckig::Ruckig<ruckig::DynamicDOFs> solver;
    ruckig::InputParameter<ruckig::DynamicDOFs> input;
    ruckig::Trajectory<ruckig::DynamicDOFs> output;
    std::vector<double> unit; ///< of the positions in the solver
    mutable std::vector<double> position, velocity, acceleration;
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

JointTrajectory::Status JointTrajectory::plan_time_optimal() noexcept {
    Content& c = *content_;
    const Question& q = question;
    if (!q.max_velocity.allFinite()) return Status::bad_limits;
    if (q.shortest > 0.0)
        c.input.minimum_duration = q.shortest;
    else
        c.input.minimum_duration.reset();
    // The solver compares with absolute tolerances, which suit numbers of about one. Each element is
    // therefore told from where it is, in a unit that is a power of two, so that nothing is rounded: first
    // the one in which its greatest velocity is about one, and where rounding spoils that, larger ones.
    for (const int larger : {0, 4, 8}) {
        for (std::size_t i = 0; i < c.size; ++i) {
            const auto k = static_cast<Eigen::Index>(i);
            if (std::isinf(q.max_acceleration[k]) && !std::isinf(q.max_jerk[k])) return Status::bad_limits;
            const double unit = c.unit[i] = std::exp2(std::ilogb(q.max_velocity[k]) + larger);
            c.input.current_position[i] = 0.0;
            c.input.current_velocity[i] = q.velocity[k] / unit;
            c.input.current_acceleration[i] = q.acceleration[k] / unit;
            c.input.target_position[i] = (q.target[k] - q.position[k]) / unit;
            c.input.max_velocity[i] = q.max_velocity[k] / unit;
            c.input.max_acceleration[i] = q.max_acceleration[k] / unit;
            c.input.max_jerk[i] = q.max_jerk[k] / unit;
        }
        if (c.solver.calculate(c.input, c.output) == ruckig::Result::Working) {
            c.duration = c.output.get_duration();
            return Status::planned;
        }
    }
    return Status::not_found;
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
    if (c.timing == Timing::time_optimal) c.output.at_time(t, c.position, c.velocity, c.acceleration);
    for (std::size_t i = 0; i < c.size; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        const Motion now = c.timing == Timing::time_optimal
                               ? Motion{c.asked.position[k] + c.unit[i] * c.position[i],
                                        c.unit[i] * c.velocity[i], c.unit[i] * c.acceleration[i]}
                           : t < c.braking ? c.brakes[i].at(t)
                                           : c.quintics[i].at(t - c.braking);
        position[k] = now.position;
        velocity[k] = now.velocity;
        acceleration[k] = now.acceleration;
    }
}

} // namespace bf::trajectory
