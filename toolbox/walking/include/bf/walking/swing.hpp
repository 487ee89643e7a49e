#pragma once

#include "bf/walking/footsteps.hpp"

namespace bf::walking {

/// Position, velocity and acceleration of a point.
struct Motion {
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero(),
                    acceleration = Eigen::Vector3d::Zero();
};

/// Where a motion is after `dt` on the way of least jerk that comes to rest at `target` after `time_left`:
///
///   p(t) of fifth order with p, p', p'' as in `from` at t = 0, and target, 0, 0 at t = time_left.
///
/// Followed from rest to a target that stays, the whole way is 10 x³ - 15 x⁴ + 6 x⁵ of the distance, x = t/T;
/// the rest of a way of least jerk is one of least jerk, so that a target may change at any time, and
/// position, velocity and acceleration go on. Where dt reaches time_left it is at rest at the target.
/// Source: T. Flash, N. Hogan, The coordination of arm movements, 1985.
Motion towards(const Motion& from, const Eigen::Vector3d& target, double time_left, double dt) noexcept;

/// Sets the height of `along` to that of a way from z_0 to z_1 at time t of a swing of duration T > 0:
/// upwards in the first half of it, downwards in the second one, by 10 y³ - 15 y⁴ + 6 y⁵ with y from 0 to 1
/// in that half, so that a foot that passes an edge in the middle is above both.
void climb(Motion& along, double z_0, double z_1, double t, double T) noexcept;

/// A foot's motion: pose, velocity and acceleration [linear; angular] in world axes.
struct SwingState {
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    Eigen::Matrix<double, 6, 1> velocity = Eigen::Matrix<double, 6, 1>::Zero(),
                                acceleration = Eigen::Matrix<double, 6, 1>::Zero();
};

/// The foot at time t of a swing of duration T > 0, x = t/T within [0, 1]:
///
///   position     that of `along` (from towards()), and above it 64 x³ (1 - x)³ apex
///   orientation  R = R_0 exp(s S(log(R_0ᵀ R_1))) R_y(pitch b), s = 10 x³ - 15 x⁴ + 6 x⁵
///
/// with b = x³ (1 - x)⁵ / ((3/8)³ (5/8)⁵), which is 1 at 3/8: a positive pitch lets the toes hang while the
/// foot is behind the body, where an ankle would be bent most. Velocity and acceleration are zero at both
/// ends. R_0, R_1 are the rotations of two poses.
SwingState swing(const Motion& along, const Eigen::Matrix3d& R_0, const Eigen::Matrix3d& R_1, double apex,
                 double pitch, double t, double T) noexcept;

} // namespace bf::walking
