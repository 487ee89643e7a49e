#include "bf/trajectory/joint_trajectory.hpp"

#include <ruckig/ruckig.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace bf::trajectory {

struct JointTrajectory::Content {
    Content(int joints, Timing which, Synchronisation how)
        : timing(which), size(static_cast<std::size_t>(joints)), quintics(size), solver(size), input(size),
          output(size), position(size), velocity(size), acceleration(size) {
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
    std::vector<Quintic> quintics;
    ruckig::Ruckig<ruckig::DynamicDOFs> solver;
    ruckig::InputParameter<ruckig::DynamicDOFs> input;
    ruckig::Trajectory<ruckig::DynamicDOFs> output;
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

/// By how much limits are exceeded, as a factor, when the motion takes the time T; plans that motion.
double JointTrajectory::excess(double T) noexcept {
    Content& c = *content_;
    const Question& q = question;
    double worst = 0.0;
    for (std::size_t i = 0; i < c.size; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        c.quintics[i] = Quintic({q.position[k], q.velocity[k], q.acceleration[k]}, q.target[k], T);
        const Quintic::Peaks peaks = c.quintics[i].peaks();
        worst = std::max({worst, peaks.velocity / q.max_velocity[k],
                          peaks.acceleration / q.max_acceleration[k], peaks.jerk / q.max_jerk[k]});
    }
    c.duration = T;
    return worst;
}

JointTrajectory::Status JointTrajectory::plan_minimum_jerk() noexcept {
    const Question& q = question;
    double from_rest = 0.0;
    bool rests = true;
    for (Eigen::Index i = 0; i < q.target.size(); ++i) {
        const double way = std::abs(q.target[i] - q.position[i]);
        from_rest = std::max({from_rest, 1.875 * way / q.max_velocity[i],
                              std::sqrt(10.0 / std::sqrt(3.0) * way / q.max_acceleration[i]),
                              std::cbrt(60.0 * way / q.max_jerk[i])});
        rests = rests && q.velocity[i] == 0.0 && q.acceleration[i] == 0.0;
    }
    if (rests) {
        const double T = std::max(q.shortest, from_rest);
        if (T == 0.0 && q.target != q.position) return Status::bad_limits;
        excess(T);
        return Status::planned;
    }
    // Under way: the first duration of a geometric row that keeps the limits, and then the shortest one
    // before it.
    double least = std::numeric_limits<double>::infinity(), best = 0.0, before = 0.0;
    const double stop = (q.velocity.cwiseAbs().cwiseQuotient(q.max_acceleration)).maxCoeff();
    double T = std::max({q.shortest, 0.2 * std::max(from_rest, stop), 1e-3});
    for (int k = 0; k < 64; ++k, before = T, T *= 1.15) {
        const double now = excess(T);
        if (now < least) {
            least = now;
            best = T;
        }
        if (now <= 1.0) break;
    }
    if (least <= 1.0 && before > 0.0) {
        double low = before;
        for (int k = 0; k < 40; ++k) {
            const double middle = 0.5 * (low + best);
            (excess(middle) <= 1.0 ? best : low) = middle;
        }
    }
    excess(best);
    return Status::planned;
}

JointTrajectory::Status JointTrajectory::plan_time_optimal() noexcept {
    Content& c = *content_;
    const Question& q = question;
    if (!q.max_velocity.allFinite()) return Status::bad_limits;
    for (std::size_t i = 0; i < c.size; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        if (std::isinf(q.max_acceleration[k]) && !std::isinf(q.max_jerk[k])) return Status::bad_limits;
        c.input.current_position[i] = q.position[k];
        c.input.current_velocity[i] = q.velocity[k];
        c.input.current_acceleration[i] = q.acceleration[k];
        c.input.target_position[i] = q.target[k];
        c.input.max_velocity[i] = q.max_velocity[k];
        c.input.max_acceleration[i] = q.max_acceleration[k];
        c.input.max_jerk[i] = q.max_jerk[k];
    }
    if (q.shortest > 0.0)
        c.input.minimum_duration = q.shortest;
    else
        c.input.minimum_duration.reset();
    const ruckig::Result result = c.solver.calculate(c.input, c.output);
    c.duration = c.output.get_duration();
    return result == ruckig::Result::Working ? Status::planned : Status::not_found;
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
                               ? Motion{c.position[i], c.velocity[i], c.acceleration[i]}
                               : c.quintics[i].at(t);
        position[k] = now.position;
        velocity[k] = now.velocity;
        acceleration[k] = now.acceleration;
    }
}

} // namespace bf::trajectory
