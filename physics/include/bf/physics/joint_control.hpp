// What stands between references and torques of a simulated robot: loops of the low level and motors.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace bf::physics {

/// How joints are commanded.
enum class ControlMode {
    position,        ///< rad, by a trajectory of the given reference speed
    position_direct, ///< rad
    velocity,        ///< rad/s
    torque,          ///< Nm
    pwm,             ///< raw
    current,         ///< raw
    impedance,       ///< rad, by a spring and a damper of the joint
};

/// Loops of the low level whose gains can be read and changed: those behind the modes position,
/// position_direct and velocity, and the one behind the mode torque.
enum class Loop { position, torque };

/// Gains of one loop, one element per joint: command = P e + I integral of e + D de/dt for the error e =
/// reference - measurement. Units are those of the robot.
struct Gains {
    explicit Gains(Eigen::Index joints = 0)
        : P(Eigen::VectorXd::Zero(joints)), I(Eigen::VectorXd::Zero(joints)),
          D(Eigen::VectorXd::Zero(joints)) {}
    Eigen::VectorXd P, I, D;
};

/// What the torque loop knows of the motors, one element per joint: command = k_tau tau + k_bemf s_dot + the
/// loop's PID. Units are those of the robot.
struct MotorParameters {
    explicit MotorParameters(Eigen::Index joints = 0)
        : k_tau(Eigen::VectorXd::Zero(joints)), k_bemf(Eigen::VectorXd::Zero(joints)) {}
    Eigen::VectorXd k_tau, k_bemf;
};

/// Motors of a robot and what its loops begin with, as they are given. Lists hold no value (see there), one
/// for all joints, or n; matrices have as many rows.
struct MotorOptions {
    std::vector<double> gear_ratio;      ///< turns of the motor for one of the joint; none: 1
    std::vector<double> torque_constant; ///< joint torque per current; none: 1
    std::vector<double> k_tau, k_bemf;   ///< PWM = k_tau tau + k_bemf s_dot, PWM per Nm and rad/s; none: 1, 0
    /// P I D: Nm/rad, Nm/(rad s), Nm s/rad; none: critical damping of 30 rad/s for the inertia of the joint.
    Eigen::MatrixXd position_gains;
    Eigen::MatrixXd torque_gains; ///< P I D: PWM per Nm, per Nm s, PWM s per Nm; none: 0
    /// Stiffness and damping, Nm/rad and Nm s/rad; none: critical damping of 10 rad/s.
    Eigen::MatrixXd impedance_gains;
};

/// The same, complete: one element per joint.
struct Motors {
    /// `inertias` (n) are those that the joints see, kg m2. Throws std::runtime_error that names the option,
    /// the joint and the remedy.
    Motors(const MotorOptions& options, const std::vector<std::string>& joints,
           const Eigen::VectorXd& inertias);

    Eigen::VectorXd gear_ratio, torque_constant;
    MotorParameters parameters;
    Gains position, torque;
    Eigen::VectorXd stiffness, damping;
};

/// What one loop is, for its stability: by how much a disturbance grows in a period T, which is the spectral
/// radius of the loop from one sampling instant to the next (K. Åström, B. Wittenmark, Computer-Controlled
/// Systems, 1997, chapter 3). It is stable below 1.
struct LoopGrowth {
    double P, I, D;

    /// Of a loop of positions, whose torque is held for `steps` time steps of `step` s, on a joint of an
    /// inertia (kg m2) and a damping (Nm s/rad) that the integrator takes implicitly. Of one time step and
    /// without I and damping it is stable while D > 0 and 2 D T / inertia + P T^2 / inertia < 4.
    double position(double inertia, double damping, double step, int steps) const;
    /// Of a loop of torques, which measures the torque of the last period: stable while
    /// P + 2 D / T + I T / 2 < k_tau and |D| / T < k_tau.
    double torque(double k_tau, double period) const;
};

/// The loops of all joints. The motor torque in each mode, with the reference r, the motor's true k_tau and
/// k_bemf, and k'_tau and k'_bemf as the loop believes them:
///
/// - position_direct: tau = P (s_t - s) + I ∫(s_t - s) + D (s_dot_t - s_dot), s_t = r, s_dot_t = 0;
/// - position: the same, where s_t goes to r at the speed limit, with the velocity s_dot_t;
/// - velocity: the same, where s_dot_t goes to r at the acceleration limit, and s_t is its integral;
/// - torque: PWM = k'_tau r + k'_bemf s_dot + P e + I ∫e + D de/dt, e = r - tau measured;
/// - pwm: tau = (r - k_bemf s_dot) / k_tau; current: tau = torque_constant r;
/// - impedance: tau = stiffness (r - s) - damping s_dot.
///
/// References arrive `command_delay` advances after they were set. It begins in torque mode with zero
/// references and without limits of speed and acceleration.
class JointControl {
  public:
    using Vector = Eigen::Ref<const Eigen::VectorXd>;

    explicit JointControl(Motors motors, int command_delay = 0);

    const Motors& motors() const { return motors_; }
    ControlMode mode() const { return mode_; }
    const Eigen::VectorXd& reference() const { return reference_; } ///< as it was set
    const Gains& gains(Loop loop) const { return loop == Loop::position ? position_ : torque_; }
    const MotorParameters& believed() const { return believed_; }

    /// Back to the beginning, gains and parameters included.
    void reset() noexcept;
    /// Trajectories begin at the positions s; references are such that nothing moves: s, or zero, also those
    /// on their way.
    void set_mode(ControlMode mode, const Vector& s) noexcept;
    template <class Expression> void set_reference(const Eigen::MatrixBase<Expression>& reference) noexcept {
        reference_ = reference;
    }
    /// Integrals with which the position loop gives the torques `tau` (n) at no error, where it has I.
    void preload(const Vector& tau) noexcept;
    /// Largest speed of trajectories of the mode position (rad/s), or acceleration of velocity (rad/s2).
    void set_trajectory_limit(ControlMode mode, double limit) noexcept;
    void set_gains(Loop loop, const Gains& gains) noexcept {
        (loop == Loop::position ? position_ : torque_) = gains;
    }
    void set_believed(const MotorParameters& parameters) noexcept { believed_ = parameters; }

    /// Motor torques (n) for the next interval of `period`, from joint positions, velocities and torques
    /// measured now. Advances trajectories and integrals.
    const Eigen::VectorXd& advance(double period, const Vector& s, const Vector& s_dot,
                                   const Vector& tau) noexcept;
    /// The same for torques that are commanded past the loops, which arrive as late as references.
    const Eigen::VectorXd& pass(const Vector& tau) noexcept;
    /// What the last of them gave.
    const Eigen::VectorXd& torques() const { return command_; }
    /// How much less the torque of joint i in the mode is for each rad/s, Nm s/rad.
    double damping(Eigen::Index i) const noexcept;

    /// PWM that a motor has at torques and joint velocities.
    void pwm(const Vector& tau, const Vector& s_dot, Eigen::Ref<Eigen::VectorXd> values) const noexcept {
        values = motors_.parameters.k_tau.cwiseProduct(tau) + motors_.parameters.k_bemf.cwiseProduct(s_dot);
    }

    int state_size() const { return static_cast<int>(5 + 14 * command_.size() + underway_.size()); }
    void save(double* to) const noexcept;
    void restore(const double* from) noexcept;

  private:
    /// Puts what was sent into `arrived_`, or what was sent earlier.
    void send(const Vector& reference) noexcept;
    /// f(matrix) of all matrices of the state.
    template <class Self, class F> static void for_each(Self& self, F&& f);

    Motors motors_;
    ControlMode mode_ = ControlMode::torque;
    double speed_limit_ = 0, acceleration_limit_ = 0;
    Gains position_, torque_;
    MotorParameters believed_;
    Eigen::VectorXd reference_, s_t_, s_dot_t_, integral_, last_error_, command_, arrived_;
    Eigen::MatrixXd underway_; ///< n x delay: references, one column for each advance
    Eigen::Index next_ = 0;    ///< column that arrives next
    bool has_error_ = false;   ///< of the last interval
};

} // namespace bf::physics
