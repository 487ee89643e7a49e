#pragma once

#include "bf/dynamics/inverse_kinematics.hpp"

#include <limits>

/// Tasks and constraints of controllers in task space, as rows.
///
/// A row [a, lower, upper, weight] asks for lower ≤ a x ≤ upper: a task where the bounds are equal, a limit
/// where they are not; ±inf is no bound. Its violation costs ½ weight · violation², and nothing at weight 0.
/// The functions write matrices of such rows, whose last three columns are bounds and weight; weights and
/// gains have one element per row. Where several rows are joined they make one set of the same form.
///
/// x is nu_dot (6+n, n for a fixed base) for motions and one wrench f for contacts, in the conventions of
/// algorithms.hpp. No function allocates memory or throws.
namespace bf::dynamics {

using VectorIn = Eigen::Ref<const Eigen::VectorXd>;

/// Columns of a row behind those of a.
inline constexpr Eigen::Index row_extra = 3;

/// What a task of motion wants: a position or pose, its velocity and acceleration, and how errors are
/// answered:
///
///   A nu_dot = acceleration + K_d (velocity - velocity now) + K_p error - A_dot nu.
struct Wanted {
    VectorIn velocity, acceleration; ///< of the rows of the task
    VectorIn kp, kd;                 ///< 1/s², 1/s
    VectorIn weight;
};

/// Rows of a frame: position (3), orientation (3) or pose (6), world axes. The error is p_target - p and the
/// rotation vector of R_target Rᵀ, the logarithm in SO(3); it is written to `error` as well, and the Jacobian
/// to J (6×(6+n)). `target` (4×4) is read as far as `kind` says; its rotation must be orthonormal. Depends on
/// position and velocity.
void cartesian_task(const Model& model, Data& data, Frame frame, Target::Kind kind,
                    const Eigen::Ref<const Eigen::Matrix4d>& target, const Wanted& wanted, MatrixOut rows,
                    VectorOut error, Matrix6XOut J) noexcept;

/// Rows (3) of the centre of mass, world axes. Depends on position and velocity.
void com_task(const Model& model, Data& data, const Eigen::Ref<const Eigen::Vector3d>& target,
              const Wanted& wanted, MatrixOut rows, VectorOut error) noexcept;

/// Rows (6) of the centroidal momentum H [linear; angular about the centre of mass], world axes:
/// A nu_dot = rate + K (target - H) - dA/dt nu. Depends on position and velocity.
void momentum_task(const Model& model, Data& data,
                   const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& target,
                   const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& rate, const VectorIn& k,
                   const VectorIn& weight, MatrixOut rows, VectorOut error) noexcept;

/// Rows (n) of the joints at positions s and velocities s_dot.
void posture_task(const Model& model, const VectorIn& s, const VectorIn& s_dot, const VectorIn& target,
                  const Wanted& wanted, MatrixOut rows, VectorOut error) noexcept;

/// Rows of a frame that touches the world without slipping: J nu_dot = -J_dot nu - damping (J nu); 6 for a
/// surface, 3 (the position of the origin) for a point, by the number of rows. The damping (1/s) takes away
/// what velocity there is. The Jacobian is written to J (6×(6+n)), too. Depends on position and velocity.
void rigid_contact(const Model& model, Data& data, Frame frame, double damping, MatrixOut rows,
                   Matrix6XOut J) noexcept;

/// What a surface transmits.
struct ContactLimits {
    int faces = 4;          ///< of the pyramid in place of the cone of friction, at least 3
    double friction = 0.5;  ///< Coulomb's coefficient
    double torsion = 0.0;   ///< m: |moment about the normal| is at most this times the normal force
    double min_force = 0.0; ///< N, of the normal force
    double max_force = std::numeric_limits<double>::infinity();
    double x_min = 0.0, x_max = 0.0; ///< m, rectangle of the centre of pressure in the axes of the frame
    double y_min = 0.0, y_max = 0.0;
};

/// Number of rows of a contact: the faces of the cone and the normal force; for a surface two more of torsion
/// and four of the centre of pressure.
constexpr int contact_rows(bool is_surface, int faces) { return faces + 1 + (is_surface ? 6 : 0); }

/// Rows over the force (3, a point) or the wrench (6, a surface) on a frame with rotation w_R_c (3×3), whose
/// z axis is the normal that points from the world into the robot: f in world axes. The pyramid lies inside
/// the cone |f_t| ≤ friction f_n and touches it at its edges: row k asks cos(t_k) f_x + sin(t_k) f_y ≤
/// friction cos(pi/faces) f_z in the frame's axes, with t_k = 2 pi k / faces, so that four faces bound f_x
/// and f_y by themselves. The centre of pressure is
/// (-m_y, m_x)/f_z.
void contact_limits(const Eigen::Ref<const Eigen::Matrix3d>& w_R_c, const ContactLimits& limits,
                    MatrixOut rows) noexcept;

/// The same as C f ≤ d, one row more: the least normal force comes last. Without a largest one its row is f_z
/// ≤ inf.
void contact_inequalities(const Eigen::Ref<const Eigen::Matrix3d>& w_R_c, const ContactLimits& limits,
                          MatrixOut C, VectorOut d) noexcept;

/// A frame on which a wrench (size 6) or a force (3) acts.
struct Contact {
    Frame frame;
    int size = 6;
};

/// The equations of motion over x = [nu_dot; f_1; ...]: the matrix [M, -J_1ᵀ, ...] ((6+n) × x), whose product
/// with x is [0; tau] - h, and h (6+n). J (6×(6+n)) is memory. Depends on position and velocity.
void motion_equations(const Model& model, Data& data, const std::vector<Contact>& contacts, MatrixOut matrix,
                      VectorOut h, Matrix6XOut J) noexcept;

/// Bounds of the acceleration of one joint.
struct AccelerationBounds {
    double lower, upper;
};

/// The accelerations that, held over a period T, leave a joint within its limits at any time of it, and from
/// which it can stay within them for ever by accelerations up to `max_acceleration` that change once per
/// period. At a state from which that is impossible, and at one outside of the limits, they are the one that
/// brakes or returns most. Infinite limits are none; the period and max_acceleration must be finite and
/// positive.
///
/// Source: A. Del Prete, Joint position and velocity bounds in discrete-time acceleration/torque control of
/// robot arms, 2018.
AccelerationBounds acceleration_bounds(double s, double s_dot, double s_min, double s_max, double max_speed,
                                       double max_acceleration, double period) noexcept;

} // namespace bf::dynamics
