#pragma once

#include "bf/dynamics/data.hpp"
#include "bf/dynamics/model.hpp"

#include <Eigen/Core>

/// Rigid-body quantities of the state that `set_state` put into a Data.
///
/// Mixed representation throughout: nu = [pdot; omega; s_dot] (6+n) with pdot the velocity of the base's
/// origin and omega the angular velocity of the base, both in world axes. Spatial 6-vectors are [linear;
/// angular]. Joints are in the order of Model::joint_names(). Matrices are column-major. Outputs must have
/// the stated size.
///
/// Equations of motion: M nu_dot + h = [0; tau] + sum of Jᵀ f.
///
/// A fixed base has no velocity: nu = s_dot, and the first six columns of J, A and M and the first six rows
/// of M, h, g and tau, which are those of the base, are left out. Sizes below are those of a floating base;
/// in all of them 6+n stands for Model::velocities().
///
/// No function allocates memory or throws.
namespace bf::dynamics {

using Vector3Out = Eigen::Ref<Eigen::Vector3d>;
using Vector6Out = Eigen::Ref<Eigen::Matrix<double, 6, 1>>;
using VectorOut = Eigen::Ref<Eigen::VectorXd>;
using Matrix4Out = Eigen::Ref<Eigen::Matrix4d>;
using Matrix3XOut = Eigen::Ref<Eigen::Matrix<double, 3, Eigen::Dynamic>>;
using Matrix6XOut = Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>>;
using MatrixOut = Eigen::Ref<Eigen::MatrixXd>;

/// Pose of a frame in the world, w_H_f (4×4). Depends on the position.
void forward_kinematics(const Model& model, Data& data, Frame frame, Matrix4Out w_H_f) noexcept;

/// J (6×(6+n)): J nu = [velocity of the frame's origin; angular velocity of the frame], world axes.
/// Depends on the position.
void jacobian(const Model& model, Data& data, Frame frame, Matrix6XOut J) noexcept;

/// J nu (6): velocity of the frame's origin and angular velocity of the frame, world axes. Depends on
/// position and velocity.
void frame_velocity(const Model& model, Data& data, Frame frame, Vector6Out J_nu) noexcept;

/// J_dot nu (6): the acceleration of the frame for nu_dot = 0. Depends on position and velocity.
void bias_acceleration(const Model& model, Data& data, Frame frame, Vector6Out J_dot_nu) noexcept;

/// Position of the centre of mass in the world (3), m. Depends on the position.
void center_of_mass(const Model& model, Data& data, Vector3Out com) noexcept;

/// Velocity of the centre of mass, world axes (3). Depends on position and velocity.
void center_of_mass_velocity(const Model& model, Data& data, Vector3Out com_dot) noexcept;

/// J (3×(6+n)): J nu = velocity of the centre of mass. Depends on the position.
void com_jacobian(const Model& model, Data& data, Matrix3XOut J) noexcept;

/// J_dot nu of the centre of mass (3). Depends on position and velocity.
void com_bias_acceleration(const Model& model, Data& data, Vector3Out J_dot_nu) noexcept;

/// Mass matrix M ((6+n)×(6+n)), both triangles. Depends on the position.
void mass_matrix(const Model& model, Data& data, MatrixOut M) noexcept;

/// Bias forces h(q, nu) (6+n): Coriolis, centrifugal and gravity terms. Depends on position and velocity.
void bias_forces(const Model& model, Data& data, VectorOut h) noexcept;

/// Gravity forces g(q) = h(q, 0) (6+n). Depends on the position.
void gravity_forces(const Model& model, Data& data, VectorOut g) noexcept;

/// Coriolis and centrifugal forces c(q, nu) = h(q, nu) - g(q) (6+n). Depends on position and velocity.
void coriolis_forces(const Model& model, Data& data, VectorOut c) noexcept;

/// C ((6+n)×(6+n)) with C nu = c and dM/dt = C + Cᵀ, of the joints as the Christoffel symbols make it. Its
/// first three columns are zero. Source: S. Echeandia, P. M. Wensing, Numerical methods to compute the
/// Coriolis matrix and Christoffel symbols for rigid-body systems, 2021. Depends on position and velocity.
void coriolis_matrix(const Model& model, Data& data, MatrixOut C) noexcept;

/// dM/dt ((6+n)×(6+n)), both triangles. Depends on position and velocity.
void mass_matrix_derivative(const Model& model, Data& data, MatrixOut M_dot) noexcept;

/// M nu_dot + h (6+n) for nu_dot = [base_acceleration; s_ddot]: the wrench on the base (force; moment about
/// the base's origin; world axes) and the joint torques of this motion. base_acceleration (6) is the time
/// derivative of nu_base, so a robot at rest has zero. Depends on position and velocity.
void inverse_dynamics(const Model& model, Data& data,
                      const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& base_acceleration,
                      const Eigen::Ref<const Eigen::VectorXd>& s_ddot, VectorOut tau) noexcept;

/// Adds Jᵀ f to generalised forces (6+n): those of the wrench f (6) = [force; moment about the frame's
/// origin], world axes, that acts on a frame. Depends on the position.
void add_wrench(const Model& model, Data& data, Frame frame,
                const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& f, VectorOut forces) noexcept;

/// nu_dot (6+n) = M⁻¹ (forces - h) of the generalised forces (6+n) = [0; tau] + sum of Jᵀ f. By the factor
/// M = Lᵀ D L, as sparse as M (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, §6.5), which is kept
/// while the position stays. Returns -1, or the row of M of a joint (or base) that moves no inertia of its
/// own, which makes M singular; nu_dot is then not written. Depends on position and velocity.
int forward_dynamics(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& forces,
                     VectorOut nu_dot) noexcept;

/// Momentum (6): [linear; angular about the centre of mass], world axes. Depends on position and velocity.
void centroidal_momentum(const Model& model, Data& data, Vector6Out H) noexcept;

/// A (6×(6+n)): A nu = centroidal momentum. Depends on the position.
void centroidal_momentum_matrix(const Model& model, Data& data, Matrix6XOut A) noexcept;

/// dA/dt nu (6): the rate of the centroidal momentum for nu_dot = 0. Depends on position and velocity.
void centroidal_momentum_bias(const Model& model, Data& data, Vector6Out A_dot_nu) noexcept;

/// Pose of `frame` seen from `reference` (4×4). Depends on the joint positions only.
void relative_transform(const Model& model, Data& data, Frame reference, Frame frame,
                        Matrix4Out reference_H_frame) noexcept;

/// J (6×n): J s_dot = velocity of the origin of `frame` and angular velocity of `frame`, both relative to
/// `reference` and in its axes. Depends on the joint positions only.
void relative_jacobian(const Model& model, Data& data, Frame reference, Frame frame, Matrix6XOut J) noexcept;

} // namespace bf::dynamics
