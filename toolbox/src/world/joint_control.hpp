// What stands between references and torques of a simulated robot: loops of the low level and motors.
#pragma once

#include "bf/toolbox/robot.hpp"

namespace bf::toolbox {

/// Motors and what the loops begin with, one element per joint.
struct Motors {
    Eigen::VectorXd gear_ratio;      ///< turns of the motor for one of the joint
    Eigen::VectorXd torque_constant; ///< joint torque per current
    MotorParameters parameters;      ///< PWM = k_tau tau + k_bemf s_dot, tau in Nm, s_dot in rad/s
    Gains position;                  ///< Nm/rad, Nm/(rad s), Nm s/rad
    Gains torque;                    ///< PWM per Nm, per Nm s, PWM s per Nm
};

/// The loops of all joints. The motor torque in each mode, with the motor's true k_tau and k_bemf, and k'_tau
/// and k'_bemf as the loop believes them:
///
///   position         s_t follows the reference at the speed limit, then as position_direct with s_dot_t
///   velocity         s_dot_t follows the reference at the acceleration limit, s_t is its integral, then
///   likewise position_direct  tau = P (s_t - s) + I ∫(s_t - s) + D (s_dot_t - s_dot),   s_t the reference,
///   s_dot_t = 0 torque           PWM = k'_tau tau_d + k'_bemf s_dot + P e + I ∫e + D de/dt,   e = tau_d -
///   tau measured pwm              tau = (PWM - k_bemf s_dot) / k_tau current          tau = torque_constant
///   current
///
/// It begins in torque mode with zero references.
class JointControl {
  public:
    explicit JointControl(Motors motors);

    const Motors& motors() const { return motors_; }
    ControlMode mode() const { return mode_; }
    const Gains& gains(Loop loop) const { return loop == Loop::position ? position_ : torque_; }
    const MotorParameters& believed() const { return believed_; }

    /// Back to the beginning, gains and parameters included.
    void reset() noexcept;
    /// Trajectories begin at the positions s; references are such that nothing moves: s, or zero.
    void set_mode(ControlMode mode, const Eigen::Ref<const Eigen::VectorXd>& s) noexcept;
    void set_reference(const Eigen::Ref<const Eigen::VectorXd>& reference) noexcept {
        reference_ = reference;
    }
    void set_trajectory_limit(ControlMode mode, double limit) noexcept;
    void set_gains(Loop loop, const Gains& gains) noexcept;
    void set_believed(const MotorParameters& parameters) noexcept { believed_ = parameters; }

    /// Motor torques (n) for the next interval of `period`, from joint positions, velocities and torques
    /// measured now. Advances trajectories and integrals.
    const Eigen::VectorXd& advance(double period, const Eigen::Ref<const Eigen::VectorXd>& s,
                                   const Eigen::Ref<const Eigen::VectorXd>& s_dot,
                                   const Eigen::Ref<const Eigen::VectorXd>& tau) noexcept;

    /// PWM that a motor has at torques and joint velocities.
    void pwm(const Eigen::Ref<const Eigen::VectorXd>& tau, const Eigen::Ref<const Eigen::VectorXd>& s_dot,
             Eigen::Ref<Eigen::VectorXd> values) const noexcept;

    int state_size() const;
    void save(double* to) const;
    void restore(const double* from);

  private:
    /// f(vector) of all vectors of the state.
    template <class Self, class F> static void for_each(Self& self, F&& f);

    Motors motors_;
    ControlMode mode_ = ControlMode::torque;
    double speed_limit_ = 0, acceleration_limit_ = 0;
    Gains position_, torque_;
    MotorParameters believed_;
    Eigen::VectorXd reference_, s_t_, s_dot_t_, integral_, last_error_, command_;
    bool has_error_ = false; ///< of the last interval
};

} // namespace bf::toolbox
