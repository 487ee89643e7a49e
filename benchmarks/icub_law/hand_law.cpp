#include "hand_law.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace {

using namespace Eigen;
constexpr int n = 23;

template <int N> Map<const Matrix<double, N, 1>> map(const double (&x)[N]) {
    return Map<const Matrix<double, N, 1>>(x);
}
template <int N> Map<Matrix<double, N, 1>> map(double (&x)[N]) { return Map<Matrix<double, N, 1>>(x); }
template <int R, int C> Map<const Matrix<double, R, C>> map(const bf::generated::Matrix<double, R, C>& x) {
    return Map<const Matrix<double, R, C>>(x.data);
}
/// Gains of elements may be written as a row.
template <int N> Map<const Matrix<double, N, 1>> map(const bf::generated::Matrix<double, 1, N>& x) {
    return Map<const Matrix<double, N, 1>>(x.data);
}
template <int R, int C> Map<Matrix<double, R, C>> map(bf::generated::Matrix<double, R, C>& x) {
    return Map<Matrix<double, R, C>>(x.data);
}

} // namespace

/// The states of the step: 1 both feet, 2 shift, 3 unload, 4 one foot, 5 lift, 6 lower, 7 touch, 8 return, 9
/// both feet.
int HandLaw::next_state(double com_y, double force_right) {
    const double waited = time_ - entered_ + 1e-6 * IcubLaw::period;
    const bool is_over_left = std::abs(p_.controller_references_goal_value - (com_y - com_start_.y())) < 0.01;
    switch (state_) {
    case 1: return p_.controller_references_one_foot_value != 0 && waited >= 1 ? 2 : 1;
    case 2: return waited >= 1.7 ? 3 : 2;
    case 3: return is_over_left && force_right < 100 && waited >= 1.3 ? 4 : 3;
    case 4: return waited >= 1 ? 5 : 4;
    case 5: return waited >= 7 ? 6 : 5;
    case 6: return waited >= 2.3 ? 7 : 6;
    case 7: return (force_right > 10 && waited >= 0.1) || waited >= 3 ? 8 : 7;
    case 8: return waited >= 3 ? 9 : 8;
    default: return state_;
    }
}

void HandLaw::step(const IcubLaw::Inputs& in, IcubLaw::Outputs& out) {
    time_ = steps_ * IcubLaw::period;
    const auto s = map(in.s_y), s_dot = map(in.s_dot_y);
    const auto f = map(in.distribution_qp_x);
    const auto M = map(in.M_M_);
    const Vector3d com = map(in.com_pose_w_H_frame).topRightCorner<3, 1>();

    // Where the robot should be.
    if (steps_ == 0) com_start_ = com;
    const double force_right = p_.controller_force_right_weight_value - in.force_right_sensor_y[2];
    if (const int next = next_state(com.y(), force_right); next != state_) {
        state_ = next;
        entered_ = time_;
    }
    const int row = state_ - 1;
    out.references_machine_state = state_;
    map(out.references_postures_y) = map(p_.controller_references_postures_table).row(row).transpose();
    out.references_releases_y = p_.controller_references_releases_table[row];
    map(out.references_target_y) =
        com_start_ + map(p_.controller_references_shifts_table).row(row).transpose();
    const Vector2d contacts = map(p_.controller_references_contact_flags_table).row(row).transpose();
    const double release = std::clamp(in.references_smooth_release_position, 0.0, 1.0);
    const double w = p_.controller_references_sine_frequency, A = p_.controller_references_sine_amplitude[1];
    auto com_r = map(out.references_com_r_y), com_dot_r = map(out.references_com_dot_r_y),
         com_ddot_r = map(out.references_com_ddot_r_y);
    com_r = map(in.references_smooth_com_position);
    com_dot_r = map(in.references_smooth_com_velocity);
    com_ddot_r = map(in.references_smooth_com_acceleration);
    com_r.y() += A * std::sin(w * time_);
    com_dot_r.y() += w * A * std::cos(w * time_);
    com_ddot_r.y() -= w * w * A * std::sin(w * time_);

    // Feet: Jacobians, wrench map A, constraints C f <= d.
    Matrix<double, 12, n + 6> J_c;
    Matrix<double, 12, 1> J_dot_nu;
    Matrix<double, 6, 12> A_f;
    auto C = map(out.distribution_C_y);
    auto d = map(out.distribution_d_y);
    C.setZero();
    const auto foot = [&](int k, const auto& J, const auto& bias, const auto& pose, const auto& cone,
                          const auto& limits) {
        const double contact = contacts[k];
        J_c.middleRows<6>(6 * k) = contact * J;
        J_dot_nu.segment<6>(6 * k) = contact * bias;
        const Vector3d lever = pose.template topRightCorner<3, 1>() - com;
        auto map_f = A_f.middleCols<6>(6 * k);
        map_f = contact * Matrix<double, 6, 6>::Identity();
        map_f.bottomLeftCorner<3, 3>() << 0, -contact * lever.z(), contact * lever.y(), contact * lever.z(),
            0, -contact * lever.x(), -contact * lever.y(), contact * lever.x(), 0;
        const Matrix3d sole_R_w = pose.template topLeftCorner<3, 3>().transpose();
        C.template block<19, 3>(19 * k, 6 * k).noalias() = cone.template leftCols<3>() * sole_R_w;
        C.template block<19, 3>(19 * k, 6 * k + 3).noalias() = cone.template rightCols<3>() * sole_R_w;
        d.template segment<19>(19 * k) = contact * limits;
    };
    foot(0, map(in.left_J_sole_J), map(in.left_J_dot_nu_sole_J_dot_nu), map(in.left_w_H_sole_w_H_frame),
         map(p_.controller_left_C_rotated_K), map(p_.controller_left_limits_K));
    foot(1, map(in.right_J_sole_J), map(in.right_J_dot_nu_sole_J_dot_nu), map(in.right_w_H_sole_w_H_frame),
         map(p_.controller_right_C_rotated_K), map(p_.controller_right_limits_K));

    // Pose and velocity of the base: no sole in contact moves.
    map(out.base_pose_a_H_c).noalias() =
        map(p_.controller_base_w_H_l_value) * map(in.base_l_H_b_frame1_H_frame2);
    const Matrix<double, 12, 6> J_b = J_c.leftCols<6>();
    const Matrix<double, 12, 1> v_soles = J_c.rightCols<n>() * s_dot;
    Matrix<double, 6, 6> normal = J_b.transpose() * J_b;
    normal.diagonal().array() += 1e-7;
    map(out.base_velocity_y) = -normal.llt().solve(J_b.transpose() * v_soles);

    // Rate of momentum that the ground must give.
    Matrix<double, 6, 1> r;
    r.head<3>() =
        M(0, 0) *
        (com_ddot_r - map(p_.controller_momentum_rate_K_p_K).cwiseProduct(com - com_r) -
         map(p_.controller_momentum_rate_K_d_K).cwiseProduct(map(in.com_velocity_com_dot) - com_dot_r) +
         9.81 * Vector3d::UnitZ());
    r.tail<3>() = p_.controller_momentum_rate_angular_K * map(in.momentum_H).tail<3>();

    // tau = tau_0 + Sigma f.
    Matrix<double, n + 6, 13> W;
    W.leftCols<12>() = J_c.transpose();
    W.col(12) = map(in.h_h);
    const Matrix<double, n + 6, 12> X = M.llt().solve(J_c.transpose());
    Matrix<double, 12, 13> G = X.transpose() * W;
    G.col(12) -= J_dot_nu;
    const Matrix<double, n, 12> LambdaT = X.bottomRows<n>();
    Matrix<double, n, 13> P = W.bottomRows<n>();
    P.noalias() -= M.bottomLeftCorner<n, 6>() * M.topLeftCorner<6, 6>().llt().solve(W.topRows<6>());
    P.col(12) +=
        map(p_.controller_torque_map_K_p_K).cwiseProduct(map(in.references_smooth_posture_position) - s) -
        map(p_.controller_torque_map_K_d_K).cwiseProduct(s_dot);
    Matrix<double, 12, 12> damped = map(p_.controller_torque_map_damping_value);
    damped.noalias() += LambdaT.transpose() * LambdaT;
    G.noalias() -= LambdaT.transpose() * P;
    const Matrix<double, 12, 13> correction = damped.llt().solve(G);
    P.noalias() += LambdaT * correction;
    const Matrix<double, n, 12> Sigma = -P.leftCols<12>();
    const auto tau_0 = P.col(12);

    // Quadratic program of the wrenches.
    const double weight = contacts[0] * contacts[1] * p_.controller_distribution_weight_K,
                 weight2 = weight * weight;
    auto H = map(out.distribution_H_y);
    H.noalias() = A_f.transpose() * A_f;
    H.noalias() += weight2 * (Sigma.transpose() * Sigma);
    H.diagonal() += release * map(p_.controller_distribution_right_penalty_K);
    H.diagonal().array() += p_.controller_distribution_wrench_penalty_value;
    map(out.distribution_g_y).noalias() = weight2 * (Sigma.transpose() * tau_0) - A_f.transpose() * r;
    double largest = -INFINITY;
    for (int k = 0; k < 2; ++k)
        largest = std::max(
            largest,
            (C.block<19, 6>(19 * k, 6 * k) * f.segment<6>(6 * k) - d.segment<19>(19 * k)).maxCoeff());
    out.distribution_largest_y = largest;
    map(out.limited_y) =
        (tau_0 + Sigma * f).cwiseMax(p_.controller_limited_lower).cwiseMin(p_.controller_limited_upper);
    ++steps_;
}
