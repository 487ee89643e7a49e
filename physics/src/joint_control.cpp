#include "bf/physics/joint_control.hpp"

#include "bf/base/numbers.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace bf::physics {

namespace {

using Eigen::Index;

/// Greatest absolute eigenvalue of the linear map next(x, y).
template <class Next> double spectral_radius(const Next& next) {
    Eigen::Matrix3d A;
    for (Index i = 0; i < 3; ++i) A.col(i) = next(Eigen::Vector3d(Eigen::Vector3d::Unit(i)));
    return A.eigenvalues().cwiseAbs().maxCoeff();
}

/// One element for each joint, of none, one for all or n.
Eigen::VectorXd of_joints(const std::string& name, const std::vector<double>& given, double otherwise,
                          bool has_inverse, const std::vector<std::string>& joints) {
    const size_t n = joints.size();
    if (given.size() > 1 && given.size() != n)
        throw std::runtime_error("'" + name + "' has " + std::to_string(given.size()) +
                                 " elements, but there are " + std::to_string(n) +
                                 " joints; give one for all or one each");
    Eigen::VectorXd all = Eigen::VectorXd::Constant(static_cast<Index>(n), otherwise);
    for (size_t i = 0; i < n && !given.empty(); ++i) {
        const double value = given[given.size() == 1 ? 0 : i];
        if (!std::isfinite(value) || (has_inverse && value == 0.0))
            throw std::runtime_error("'" + name + "' has " + number_text(value) + " for joint '" + joints[i] +
                                     "'; give a finite number" + (has_inverse ? " other than 0" : ""));
        all[static_cast<Index>(i)] = value;
    }
    return all;
}

/// One row for each joint, of none, one for all or n.
Eigen::MatrixXd rows_of_joints(const std::string& name, const char* columns, const Eigen::MatrixXd& given,
                               const Eigen::MatrixXd& otherwise) {
    if (given.size() == 0) return otherwise;
    const bool is_one = given.rows() == 1;
    if (given.cols() != otherwise.cols() || (!is_one && given.rows() != otherwise.rows()) ||
        !given.allFinite())
        throw std::runtime_error("'" + name + "' is " + std::to_string(given.rows()) + "x" +
                                 std::to_string(given.cols()) + "; give finite rows " + columns +
                                 ", one for all joints or one each");
    if (is_one) return given.replicate(otherwise.rows(), 1);
    return given;
}

/// P I D that damp an inertia critically at a frequency (rad/s).
Eigen::MatrixXd critical(const Eigen::VectorXd& inertias, double frequency) {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(inertias.size(), 3);
    rows.col(0) = frequency * frequency * inertias;
    rows.col(2) = 2.0 * frequency * inertias;
    return rows;
}

Gains gains_of(const Eigen::MatrixXd& rows) {
    Gains all;
    all.P = rows.col(0);
    all.I = rows.col(1);
    all.D = rows.col(2);
    return all;
}

} // namespace

Motors::Motors(const MotorOptions& options, const std::vector<std::string>& joints,
               const Eigen::VectorXd& inertias)
    : gear_ratio(of_joints("gear_ratio", options.gear_ratio, 1.0, true, joints)),
      torque_constant(of_joints("torque_constant", options.torque_constant, 1.0, true, joints)),
      position(gains_of(
          rows_of_joints("position_gains", "P I D", options.position_gains, critical(inertias, 30.0)))),
      torque(
          gains_of(rows_of_joints("torque_gains", "P I D", options.torque_gains, critical(inertias, 0.0)))) {
    parameters.k_tau = of_joints("k_tau", options.k_tau, 1.0, true, joints);
    parameters.k_bemf = of_joints("k_bemf", options.k_bemf, 0.0, false, joints);
    Eigen::MatrixXd soft(inertias.size(), 2);
    soft << 100.0 * inertias, 20.0 * inertias;
    const Eigen::MatrixXd impedance = rows_of_joints("impedance_gains", "K D", options.impedance_gains, soft);
    stiffness = impedance.col(0);
    damping = impedance.col(1);
}

double LoopGrowth::position(double inertia, double damping, double step, int steps) const {
    return spectral_radius([&](Eigen::Vector3d x) { // position, velocity, integral of the error
        x[2] -= x[0] * step * steps;
        const double tau = -P * x[0] + I * x[2] - D * x[1];
        for (int k = 0; k < steps; ++k) {
            x[1] = (inertia * x[1] + step * tau) / (inertia + step * damping);
            x[0] += step * x[1];
        }
        return x;
    });
}

double LoopGrowth::torque(double k_tau, double period) const {
    return spectral_radius([&](const Eigen::Vector3d& x) { // torque, integral of the error, last error
        const double error = -x[0], integral = x[1] + error * period;
        const double pid = P * error + I * integral + D * (error - x[2]) / period;
        return Eigen::Vector3d(pid / k_tau, integral, error);
    });
}

JointControl::JointControl(Motors motors, int command_delay) : motors_(std::move(motors)) {
    const auto n = motors_.gear_ratio.size();
    for (auto* vector : {&reference_, &s_t_, &s_dot_t_, &integral_, &last_error_, &command_, &arrived_})
        vector->setZero(n);
    underway_.setZero(n, command_delay);
    reset();
}

void JointControl::reset() noexcept {
    mode_ = ControlMode::torque;
    speed_limit_ = acceleration_limit_ = std::numeric_limits<double>::infinity();
    position_ = motors_.position;
    torque_ = motors_.torque;
    believed_ = motors_.parameters;
    for (auto* vector : {&reference_, &s_t_, &s_dot_t_, &integral_, &last_error_, &command_})
        vector->setZero();
    underway_.setZero();
    next_ = 0;
    has_error_ = false;
}

void JointControl::set_mode(ControlMode mode, const Vector& s) noexcept {
    mode_ = mode;
    s_t_ = s;
    s_dot_t_.setZero();
    integral_.setZero();
    has_error_ = false;
    if (mode == ControlMode::position || mode == ControlMode::position_direct ||
        mode == ControlMode::impedance)
        reference_ = s;
    else
        reference_.setZero();
    underway_.colwise() = reference_;
}

void JointControl::preload(const Vector& tau) noexcept {
    for (Eigen::Index i = 0; i < tau.size(); ++i)
        integral_[i] = position_.I[i] == 0 ? 0 : tau[i] / position_.I[i];
}

void JointControl::set_trajectory_limit(ControlMode mode, double limit) noexcept {
    if (mode == ControlMode::position) speed_limit_ = limit;
    if (mode == ControlMode::velocity) acceleration_limit_ = limit;
}

void JointControl::send(const Vector& reference) noexcept {
    if (underway_.cols() == 0) {
        arrived_ = reference;
        return;
    }
    arrived_ = underway_.col(next_);
    underway_.col(next_) = reference;
    next_ = (next_ + 1) % underway_.cols();
}

const Eigen::VectorXd& JointControl::pass(const Vector& tau) noexcept {
    send(tau);
    return command_ = arrived_;
}

const Eigen::VectorXd& JointControl::advance(double period, const Vector& s, const Vector& s_dot,
                                             const Vector& tau) noexcept {
    const auto& k_tau = motors_.parameters.k_tau;
    const auto& k_bemf = motors_.parameters.k_bemf;
    send(reference_);
    for (Eigen::Index i = 0; i < command_.size(); ++i) {
        const double reference = arrived_[i];
        switch (mode_) {
        case ControlMode::pwm: command_[i] = (reference - k_bemf[i] * s_dot[i]) / k_tau[i]; continue;
        case ControlMode::current: command_[i] = motors_.torque_constant[i] * reference; continue;
        case ControlMode::impedance:
            command_[i] = motors_.stiffness[i] * (reference - s[i]) - motors_.damping[i] * s_dot[i];
            continue;
        case ControlMode::torque: {
            const double error = reference - tau[i];
            integral_[i] += error * period;
            const double slope = has_error_ ? (error - last_error_[i]) / period : 0;
            last_error_[i] = error;
            const double pid = torque_.P[i] * error + torque_.I[i] * integral_[i] + torque_.D[i] * slope;
            // What the loop knows wrongly of the motor is added, so that a right belief gives the reference
            // itself.
            command_[i] = reference + ((believed_.k_tau[i] - k_tau[i]) * reference +
                                       (believed_.k_bemf[i] - k_bemf[i]) * s_dot[i] + pid) /
                                          k_tau[i];
            continue;
        }
        case ControlMode::position: {
            const double most = speed_limit_ * period, way = std::clamp(reference - s_t_[i], -most, most);
            s_dot_t_[i] = way / period;
            s_t_[i] += way;
            break;
        }
        case ControlMode::velocity: {
            const double most = acceleration_limit_ * period;
            s_dot_t_[i] += std::clamp(reference - s_dot_t_[i], -most, most);
            s_t_[i] += s_dot_t_[i] * period;
            break;
        }
        case ControlMode::position_direct: s_t_[i] = reference; break;
        }
        const double error = s_t_[i] - s[i];
        integral_[i] += error * period;
        command_[i] = position_.P[i] * error + position_.I[i] * integral_[i] +
                      position_.D[i] * (s_dot_t_[i] - s_dot[i]);
    }
    has_error_ = true;
    return command_;
}

double JointControl::damping(Eigen::Index i) const noexcept {
    switch (mode_) {
    case ControlMode::position:
    case ControlMode::position_direct:
    case ControlMode::velocity: return position_.D[i];
    case ControlMode::impedance: return motors_.damping[i];
    case ControlMode::pwm: return motors_.parameters.k_bemf[i] / motors_.parameters.k_tau[i];
    case ControlMode::torque:
    case ControlMode::current: break;
    }
    return 0.0;
}

template <class Self, class F> void JointControl::for_each(Self& self, F&& f) {
    for (auto* gains : {&self.position_, &self.torque_})
        for (auto* vector : {&gains->P, &gains->I, &gains->D}) f(*vector);
    for (auto* vector : {&self.believed_.k_tau, &self.believed_.k_bemf, &self.reference_, &self.s_t_,
                         &self.s_dot_t_, &self.integral_, &self.last_error_, &self.command_})
        f(*vector);
    f(self.underway_);
}

void JointControl::save(double* to) const noexcept {
    for (const double value : {static_cast<double>(mode_), static_cast<double>(has_error_), speed_limit_,
                               acceleration_limit_, static_cast<double>(next_)})
        *to++ = value;
    for_each(*this, [&](const auto& matrix) { to = std::copy_n(matrix.data(), matrix.size(), to); });
}

void JointControl::restore(const double* from) noexcept {
    mode_ = static_cast<ControlMode>(static_cast<int>(*from++));
    has_error_ = *from++ != 0;
    speed_limit_ = *from++;
    acceleration_limit_ = *from++;
    next_ = static_cast<Eigen::Index>(*from++);
    for_each(*this, [&](auto& matrix) {
        std::copy_n(from, matrix.size(), matrix.data());
        from += matrix.size();
    });
}

} // namespace bf::physics
