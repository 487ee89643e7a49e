#pragma once

#include "bf/trajectory/quintic.hpp"

#include "bf/dynamics/lie.hpp"

#include <Eigen/Core>

namespace bf::trajectory {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A pose in the world with velocity [of the origin; angular] and its derivative, world axes (mixed).
struct FrameMotion {
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    Vector6 velocity = Vector6::Zero(), acceleration = Vector6::Zero();
};

/// The motion of a frame from any state to rest at a pose, on one of two paths:
///
/// - `straight`: the origin moves along a line, the orientation along the shortest rotation, R = R_target
///   exp(skew(φ));
/// - `screw`: the geodesic of SE(3), H = H_target exp([skew(φ), ρ; 0, 0]), a turn about and a way along one
/// axis.
///
/// The coordinates φ and ρ (or p) go to zero (or the target) by polynomials of least jerk, Quintic, from
/// values and rates that the start decides: what starts at rest moves along the path itself, what is under
/// way joins it without a jump of velocity or acceleration. Source: M. Žefran, V. Kumar, C. B. Croke, On the
/// generation of smooth three-dimensional rigid body motions, 1998.
class CartesianTrajectory {
  public:
    enum class Path { straight, screw };

    CartesianTrajectory() = default;
    /// T in s; 0: at the target at once. Rotations must be orthonormal.
    CartesianTrajectory(const FrameMotion& start, const Eigen::Matrix4d& target, Path path,
                        double T) noexcept;

    /// After the time t from the start; behind the end it rests at the target.
    FrameMotion at(double t) const noexcept;
    double duration() const { return duration_; }

    /// The shortest time from rest along a straight path with no more than these speeds, m/s and rad/s: 15/8
    /// of that at constant speed.
    static double shortest(const Eigen::Matrix4d& start, const Eigen::Matrix4d& target, double max_speed,
                           double max_angular_speed) noexcept;

  private:
    dynamics::Jet jet(const Quintic* of, double t) const noexcept;

    Eigen::Matrix4d target_ = Eigen::Matrix4d::Identity();
    Path path_ = Path::straight;
    double duration_ = 0.0;
    Quintic place_[3], turn_[3];
};

} // namespace bf::trajectory
