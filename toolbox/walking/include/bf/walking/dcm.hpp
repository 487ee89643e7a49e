#pragma once

#include "bf/walking/footsteps.hpp"

/// The divergent component of motion of a biped.
///
///   xi = c + c_dot / omega,   c_ddot = omega² (c - r),   xi_dot = omega (xi - r),   omega = sqrt(g / height)
///
/// c is the centre of mass and r the virtual repellent point (VRP), `height` above the point in which the
/// line of the whole contact force meets the ground; while c stays at one height that is the zero-moment
/// point (ZMP). Source: J. Englsberger, C. Ott, A. Albu-Schäffer, Three-dimensional bipedal walking control
/// based on divergent component of motion, 2015.
namespace bf::walking {

/// omega (1/s) for a VRP `height` > 0 above the ground.
double natural_frequency(double height, double gravity = 9.81) noexcept;

/// Where the VRP is while one foot stands: in the axes of the left sole, y to the left; mirrored for the
/// right one.
struct Vrp {
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    Eigen::Vector3d over(const Foothold& foothold, Side side) const noexcept;
};

/// A moment of the wanted motion.
struct DcmReference {
    Eigen::Vector3d dcm, velocity, vrp;
};

/// A phase in which the VRP goes from r_0 to r_1 at constant velocity v = (r_1 - r_0)/T, at time t of it:
///
///   xi(t) = r(t) + v/omega + e^(omega (t - T)) (xi(T) - r_1 - v/omega)
///
/// the solution of xi_dot = omega (xi - r) that ends at xi(T). Source: J. Englsberger, G. Mesesan, C. Ott,
/// Smooth trajectory generation and push-recovery based on divergent component of motion, 2017.
DcmReference dcm_phase(const Eigen::Vector3d& r_0, const Eigen::Vector3d& r_1, double T,
                       const Eigen::Vector3d& xi_T, double omega, double t) noexcept;

/// The r_0 from which dcm_phase begins at xi(0) = xi_0, for T > 0: where the VRP goes first when the DCM
/// rests at xi_0, which is away from where it shall come to, as when one pushes oneself off with the other
/// foot.
Eigen::Vector3d vrp_from_rest(const Eigen::Vector3d& xi_0, const Eigen::Vector3d& r_1, double T,
                              const Eigen::Vector3d& xi_T, double omega) noexcept;

/// The wanted motion now. The VRP stays over each foot while that stands alone, and goes to the next one at
/// constant velocity while both do; after the last step it goes midway between the feet and stays. The DCM
/// follows backwards from its rest there (Englsberger 2015, section V), so that all of it is continuous, and
/// the ZMP is always between points of the soles that carry. Of a step from rest the DCM begins at rest
/// midway between the feet, by vrp_from_rest(); the ZMP is between the soles then when omega T_d is well
/// above 1. `footholds` (4×k, k ≥ step.ahead + 2).
DcmReference plan_dcm(const Eigen::Ref<const Eigen::Matrix4Xd>& footholds, const Step& step, const Vrp& vrp,
                      double omega) noexcept;

/// The VRP that leads the DCM to its reference, xi_dot = xi_dot_ref - gain (xi - xi_ref):
///
///   r = xi - xi_dot_ref / omega + gain / omega (xi - xi_ref)
///
/// Source: Englsberger 2015, section VI.
Eigen::Vector3d follow_dcm(const Eigen::Vector3d& dcm, const DcmReference& reference, double gain,
                           double omega) noexcept;

/// Most corners of a support polygon.
inline constexpr int max_corners = 8;
/// Corners of the soles that stand, 4 or 8 of them; returns how many. `footholds` as in plan_dcm.
int support_corners(const Eigen::Ref<const Eigen::Matrix4Xd>& footholds, const Step& step, const Sole& sole,
                    Eigen::Matrix<double, 2, max_corners>& corners) noexcept;

/// The point of the convex hull of the first `count` corners (1 to max_corners) that is nearest to p.
Eigen::Vector2d nearest_in_hull(const Eigen::Matrix<double, 2, max_corners>& corners, int count,
                                const Eigen::Vector2d& p) noexcept;

/// How a step changes after a push.
struct Adjustment {
    Eigen::Vector2d shift = Eigen::Vector2d::Zero(); ///< m, of the next foothold and all after it, world axes
    double delay = 0.0;                              ///< s, by which the foot lands later
};

/// What remains of an error e = xi - xi_ref of the DCM when the foot lands, after all that the ZMP can do
/// within the standing sole, goes to the place and the time of the foothold. With the time t_r that is left
/// of the single support, tau = e^(omega t_r), tau' the same of a foot that lands `delay` later and a =
/// xi_ref - r,
///
///   E = tau' e + (tau' - tau) a,   room = (tau' - 1) [sole - r],   shift = (E - E within room) / gamma
///   gamma = (1 - e^(-omega T_d)) / (omega T_d)
///   min over tau' of |shift|² + (cost/omega)² (tau'/tau - 1)²,   t_r/2 <= t_r + delay <= 3 t_r/2
///
/// in each coordinate of the standing sole. E is the distance of the DCM from where the plan has it when the
/// foot lands, which a step of another duration does not change; gamma is what a moved foothold moves that,
/// because the VRP goes there during the double support of duration T_d. The cost, in m/s, is the shift that
/// is as bad as a second of delay; infinite: the time stays. The problem is convex in tau'. Zero while both
/// feet stand. `sole` may be made smaller to leave room for what is not modelled.
///
/// Sources: J. Pratt, J. Carff, S. Drakunov, A. Goswami, Capture point: a step toward humanoid push recovery,
/// 2006; M. Khadiv, A. Herzog, S. A. A. Moosavian, L. Righetti, Walking control based on step timing
/// adaptation, 2020, here for one foothold of a plan that goes on.
Adjustment adjust_step(const Eigen::Vector2d& dcm, const DcmReference& reference, const Foothold& stance,
                       const Step& step, const Sole& sole, double omega, double cost) noexcept;

} // namespace bf::walking
