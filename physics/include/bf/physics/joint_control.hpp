// The loops that run on the boards of a robot, one for each joint.
#pragma once

#include <algorithm>
#include <vector>

namespace bf::physics {

/// What the reference of a joint is, and how its motor follows it.
enum class JointMode { torque, position, position_direct, velocity, pwm, current, impedance };

/// Gains of one joint; 0 where there is none.
struct JointGains {
    double kp = 0.0;              ///< Nm/rad, position
    double kd = 0.0;              ///< Nm s/rad, velocity
    double reference_speed = 0.0; ///< rad/s, of the way to a position
    double torque_constant = 0.0; ///< Nm/A, at the joint
    double pwm_gain = 0.0;        ///< Nm, at a duty cycle of 1 at rest
    double back_emf = 0.0;        ///< Nm s/rad, what speed takes from that
    double stiffness = 0.0;       ///< Nm/rad, of the impedance
    double damping = 0.0;         ///< Nm s/rad, of the impedance
};

/// The torque of a joint (Nm) with reference r, position s and velocity s_dot, held for dt:
///
/// - torque: r; current: torque_constant r; pwm: pwm_gain r - back_emf s_dot;
/// - position_direct: kp (r - s) - kd s_dot; impedance: stiffness (r - s) - damping s_dot;
/// - position: kp (p - s) - kd s_dot, where p goes towards r with reference_speed;
/// - velocity: kp (p - s) + kd (r - s_dot), where p goes on with r.
///
/// `p` is the loop's memory; it begins at the position in which the mode was set.
inline double joint_torque(JointMode mode, const JointGains& gains, double r, double dt, double s,
                           double s_dot, double& p) noexcept {
    switch (mode) {
    case JointMode::torque: return r;
    case JointMode::current: return gains.torque_constant * r;
    case JointMode::pwm: return gains.pwm_gain * r - gains.back_emf * s_dot;
    case JointMode::position_direct: return gains.kp * (r - s) - gains.kd * s_dot;
    case JointMode::impedance: return gains.stiffness * (r - s) - gains.damping * s_dot;
    case JointMode::position:
        p += std::clamp(r - p, -gains.reference_speed * dt, gains.reference_speed * dt);
        return gains.kp * (p - s) - gains.kd * s_dot;
    case JointMode::velocity: p += r * dt; return gains.kp * (p - s) + gains.kd * (r - s_dot);
    }
    return 0.0;
}

/// Gains of all joints of a robot. Lists hold no value, one for all joints, or n.
struct JointLoops {
    double period = 0.0; ///< s, of the loops, a multiple of the time step; 0: that
    std::vector<double> kp, kd, reference_speed, torque_constant, pwm_gain, back_emf, stiffness, damping;
};

} // namespace bf::physics
