#include "bf/trajectory/cartesian_trajectory.hpp"

#include <Eigen/LU>

#include <algorithm>

namespace bf::trajectory {
namespace {

using dynamics::Jet;
using Eigen::Matrix3d;
using Eigen::Vector3d;

} // namespace

CartesianTrajectory::CartesianTrajectory(const FrameMotion& start, const Eigen::Matrix4d& target, Path path,
                                         double T) noexcept
    : target_(target), path_(path), duration_(T) {
    // All seen from the target: its axes, and for a screw its origin.
    const Matrix3d R = target.topLeftCorner<3, 3>();
    const auto in_target = [&](const Vector3d& v) -> Vector3d { return R.transpose() * v; };
    Jet turn,
        place{start.pose.topRightCorner<3, 1>(), start.velocity.head<3>(), start.acceleration.head<3>()};
    turn.value = dynamics::rotation_log(R.transpose() * start.pose.topLeftCorner<3, 3>());
    const Matrix3d inverse = dynamics::left_jacobian(turn.value).inverse();
    turn.rate = inverse * in_target(start.velocity.tail<3>());
    // α = d/dt (J φ̇), of which J φ̈ is the part that is not yet known.
    const Jet angular = dynamics::left_jacobian_times(turn, {turn.rate, Vector3d::Zero(), Vector3d::Zero()});
    turn.second = inverse * (in_target(start.acceleration.tail<3>()) - angular.rate);
    if (path == Path::screw) {
        // p = J(φ) ρ, and what its rates have beside those of ρ.
        Jet rho{inverse * in_target(place.value - target.topRightCorner<3, 1>()), Vector3d::Zero(),
                Vector3d::Zero()};
        rho.rate = inverse * (in_target(place.rate) - dynamics::left_jacobian_times(turn, rho).rate);
        rho.second = inverse * (in_target(place.second) - dynamics::left_jacobian_times(turn, rho).second);
        place = rho;
    }
    const Vector3d goal = path == Path::screw ? Vector3d::Zero() : Vector3d(target.topRightCorner<3, 1>());
    for (int i = 0; i < 3; ++i) {
        place_[i] = Quintic({place.value[i], place.rate[i], place.second[i]}, goal[i], T);
        turn_[i] = Quintic({turn.value[i], turn.rate[i], turn.second[i]}, 0.0, T);
    }
}

Jet CartesianTrajectory::jet(const Quintic* of, double t) const noexcept {
    Jet jet;
    for (int i = 0; i < 3; ++i) {
        const Motion now = of[i].at(t);
        jet.value[i] = now.position;
        jet.rate[i] = now.velocity;
        jet.second[i] = now.acceleration;
    }
    return jet;
}

FrameMotion CartesianTrajectory::at(double t) const noexcept {
    FrameMotion now;
    now.pose = target_;
    if (t >= duration_) return now;
    const Matrix3d R = target_.topLeftCorner<3, 3>();
    const Jet turn = jet(turn_, t);
    Jet place = jet(place_, t);
    if (path_ == Path::screw) {
        const Jet local = dynamics::left_jacobian_times(turn, place);
        place = {target_.topRightCorner<3, 1>() + R * local.value, R * local.rate, R * local.second};
    }
    const Jet angular = dynamics::left_jacobian_times(turn, {turn.rate, turn.second, Vector3d::Zero()});
    now.pose.topLeftCorner<3, 3>() = R * dynamics::rotation_exp(turn.value);
    now.pose.topRightCorner<3, 1>() = place.value;
    now.velocity << place.rate, R * angular.value;
    now.acceleration << place.second, R * angular.rate;
    return now;
}

double CartesianTrajectory::shortest(const Eigen::Matrix4d& start, const Eigen::Matrix4d& target,
                                     double max_speed, double max_angular_speed) noexcept {
    const Vector3d way = target.topRightCorner<3, 1>() - start.topRightCorner<3, 1>();
    const Vector3d turn =
        dynamics::rotation_log(target.topLeftCorner<3, 3>() * start.topLeftCorner<3, 3>().transpose());
    return 1.875 * std::max(way.norm() / max_speed, turn.norm() / max_angular_speed);
}

} // namespace bf::trajectory
