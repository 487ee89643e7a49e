#include "world/joint_control.hpp"

#include <algorithm>
#include <limits>

namespace bf::toolbox {

JointControl::JointControl(Motors motors) : motors_(std::move(motors)) {
    const auto n = motors_.gear_ratio.size();
    for (auto* vector : {&reference_, &s_t_, &s_dot_t_, &integral_, &last_error_, &command_})
        vector->setZero(n);
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
    has_error_ = false;
}

void JointControl::set_mode(ControlMode mode, const Eigen::Ref<const Eigen::VectorXd>& s) noexcept {
    mode_ = mode;
    s_t_ = s;
    s_dot_t_.setZero();
    integral_.setZero();
    has_error_ = false;
    if (mode == ControlMode::position || mode == ControlMode::position_direct)
        reference_ = s;
    else
        reference_.setZero();
}

void JointControl::set_trajectory_limit(ControlMode mode, double limit) noexcept {
    if (mode == ControlMode::position) speed_limit_ = limit;
    if (mode == ControlMode::velocity) acceleration_limit_ = limit;
}

void JointControl::set_gains(Loop loop, const Gains& gains) noexcept {
    (loop == Loop::position ? position_ : torque_) = gains;
}

const Eigen::VectorXd& JointControl::advance(double period, const Eigen::Ref<const Eigen::VectorXd>& s,
                                             const Eigen::Ref<const Eigen::VectorXd>& s_dot,
                                             const Eigen::Ref<const Eigen::VectorXd>& tau) noexcept {
    const auto& k_tau = motors_.parameters.k_tau;
    const auto& k_bemf = motors_.parameters.k_bemf;
    for (Eigen::Index i = 0; i < command_.size(); ++i) {
        const double reference = reference_[i];
        switch (mode_) {
        case ControlMode::pwm: command_[i] = (reference - k_bemf[i] * s_dot[i]) / k_tau[i]; continue;
        case ControlMode::current: command_[i] = motors_.torque_constant[i] * reference; continue;
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
        case ControlMode::impedance: // which WorldDevice refuses
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

void JointControl::pwm(const Eigen::Ref<const Eigen::VectorXd>& tau,
                       const Eigen::Ref<const Eigen::VectorXd>& s_dot,
                       Eigen::Ref<Eigen::VectorXd> values) const noexcept {
    values = motors_.parameters.k_tau.cwiseProduct(tau) + motors_.parameters.k_bemf.cwiseProduct(s_dot);
}

template <class Self, class F> void JointControl::for_each(Self& self, F&& f) {
    for (auto* gains : {&self.position_, &self.torque_})
        for (auto* vector : {&gains->P, &gains->I, &gains->D}) f(*vector);
    for (auto* vector : {&self.believed_.k_tau, &self.believed_.k_bemf, &self.reference_, &self.s_t_,
                         &self.s_dot_t_, &self.integral_, &self.last_error_})
        f(*vector);
}

int JointControl::state_size() const { return 4 + 13 * static_cast<int>(command_.size()); }

void JointControl::save(double* to) const {
    for (const double value :
         {static_cast<double>(mode_), static_cast<double>(has_error_), speed_limit_, acceleration_limit_})
        *to++ = value;
    for_each(*this,
             [&](const Eigen::VectorXd& vector) { to = std::copy_n(vector.data(), vector.size(), to); });
}

void JointControl::restore(const double* from) {
    mode_ = static_cast<ControlMode>(static_cast<int>(*from++));
    has_error_ = *from++ != 0;
    speed_limit_ = *from++;
    acceleration_limit_ = *from++;
    for_each(*this, [&](Eigen::VectorXd& vector) {
        std::copy_n(from, vector.size(), vector.data());
        from += vector.size();
    });
}

} // namespace bf::toolbox
