#pragma once

#include <Eigen/Core>

/// Rotations as exponentials of rotation vectors φ (3), rad. Source: T. D. Barfoot, State Estimation for
/// Robotics, 2017, ch. 7. No function allocates memory or throws.
namespace bf::dynamics {

/// The skew-symmetric matrix with skew(v) u = v × u.
Eigen::Matrix3d skew(const Eigen::Vector3d& v) noexcept;

/// R = exp(skew(φ)).
Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& phi) noexcept;

/// φ of a rotation matrix R = exp(skew(φ)), |φ| ≤ π.
Eigen::Vector3d rotation_log(const Eigen::Matrix3d& R) noexcept;

/// What a pose (4×4) lacks to a target (4×4): [p_target - p; rotation vector of R_target Rᵀ], world axes, m
/// and rad.
Eigen::Matrix<double, 6, 1> pose_error(const Eigen::Matrix4d& pose, const Eigen::Matrix4d& target) noexcept;

/// J = Σ skew(φ)ᵏ/(k+1)!: ω = J φ̇ is the angular velocity of exp(skew(φ)), in the axes in which φ is written.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) noexcept;

/// Σ skew(φ)ᵏ/(k+2)!: what a turning acceleration adds to a position, as the left Jacobian is for the
/// velocity.
Eigen::Matrix3d second_left_jacobian(const Eigen::Vector3d& phi) noexcept;

/// A vector that changes, with its first and second rate.
struct Jet {
    Eigen::Vector3d value = Eigen::Vector3d::Zero(), rate = Eigen::Vector3d::Zero(),
                    second = Eigen::Vector3d::Zero();
};

/// J(φ) u with its rates.
Jet left_jacobian_times(const Jet& phi, const Jet& u) noexcept;

} // namespace bf::dynamics
