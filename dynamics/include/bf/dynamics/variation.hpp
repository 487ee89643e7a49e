#pragma once

#include "bf/dynamics/algorithms.hpp"

#include <memory>

/// Derivatives of the quantities of algorithms.hpp: the same recursions, run on numbers with derivatives, so
/// that they are exact to rounding.
namespace bf::dynamics {

/// Small changes of a state along several directions, one column each; elements of w_H_b in their order in
/// memory (16). Any change of it is taken, though only those that keep its rotation one mean anything.
struct StateChanges {
    Eigen::MatrixXd w_H_b, s, nu_base, s_dot; ///< rows: elements; none: it does not change
};

/// A state, its changes, and what was computed from them: as with Data, callers that set the same pay once.
class Variation {
  public:
    explicit Variation(const Model& model);
    ~Variation();
    Variation(Variation&&) noexcept;
    Variation& operator=(Variation&&) noexcept;

    struct Content;
    Content& content() { return *content_; } ///< for the algorithms of this folder

  private:
    std::unique_ptr<Content> content_;
};

using Changed = Eigen::Ref<const Eigen::MatrixXd>;

/// As of Data. There are as many directions as the changes have columns, which must agree.
void set_state(const Model& model, Variation& variation, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
               const Eigen::Ref<const Eigen::VectorXd>& s,
               const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& nu_base,
               const Eigen::Ref<const Eigen::VectorXd>& s_dot, const StateChanges& changes,
               Eigen::Index directions);
/// Sets base pose and joint positions, with their changes, and keeps the velocities.
void set_position(const Model& model, Variation& variation, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
                  const Eigen::Ref<const Eigen::VectorXd>& s, const StateChanges& changes,
                  Eigen::Index directions);
/// Sets the joint positions, with their changes, and keeps all else.
void set_joint_position(const Model& model, Variation& variation, const Eigen::Ref<const Eigen::VectorXd>& s,
                        const StateChanges& changes, Eigen::Index directions);

// Each function gives the changes of the quantity of its name: elements × directions.
void forward_kinematics(const Model& model, Variation& variation, Frame frame, MatrixOut changes);
void jacobian(const Model& model, Variation& variation, Frame frame, MatrixOut changes);
void bias_acceleration(const Model& model, Variation& variation, Frame frame, MatrixOut changes);
void center_of_mass(const Model& model, Variation& variation, MatrixOut changes);
void center_of_mass_velocity(const Model& model, Variation& variation, MatrixOut changes);
void com_jacobian(const Model& model, Variation& variation, MatrixOut changes);
void com_bias_acceleration(const Model& model, Variation& variation, MatrixOut changes);
void mass_matrix(const Model& model, Variation& variation, MatrixOut changes);
void bias_forces(const Model& model, Variation& variation, MatrixOut changes);
void gravity_forces(const Model& model, Variation& variation, MatrixOut changes);
void coriolis_forces(const Model& model, Variation& variation, MatrixOut changes);
void coriolis_matrix(const Model& model, Variation& variation, MatrixOut changes);
void mass_matrix_derivative(const Model& model, Variation& variation, MatrixOut changes);
void centroidal_momentum(const Model& model, Variation& variation, MatrixOut changes);
void centroidal_momentum_matrix(const Model& model, Variation& variation, MatrixOut changes);
void centroidal_momentum_bias(const Model& model, Variation& variation, MatrixOut changes);
void relative_transform(const Model& model, Variation& variation, Frame reference, Frame frame,
                        MatrixOut changes);
void relative_jacobian(const Model& model, Variation& variation, Frame reference, Frame frame,
                       MatrixOut changes);
/// Of motions with these accelerations and their changes.
void inverse_dynamics(const Model& model, Variation& variation,
                      const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& base_acceleration,
                      const Eigen::Ref<const Eigen::VectorXd>& s_ddot,
                      const Changed& base_acceleration_changes, const Changed& s_ddot_changes,
                      MatrixOut changes);
/// Adds those of a wrench f (6) that acts on a frame to changes of generalised forces (6+n).
void add_wrench(const Model& model, Variation& variation, Frame frame,
                const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& f, const Changed& f_changes,
                MatrixOut forces_changes);
/// d nu_dot = M⁻¹ (d forces - dh - dM nu_dot) of the accelerations nu_dot that forward_dynamics gave.
void forward_dynamics(const Model& model, Variation& variation,
                      const Eigen::Ref<const Eigen::VectorXd>& nu_dot, const Changed& forces_changes,
                      MatrixOut changes);

} // namespace bf::dynamics
