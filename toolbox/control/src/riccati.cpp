#include "bf/control/riccati.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace bf::control {
namespace {

using Eigen::MatrixXd;

void make_symmetric(MatrixXd& matrix) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j)
        for (Eigen::Index i = 0; i < j; ++i)
            matrix(i, j) = matrix(j, i) = 0.5 * (matrix(i, j) + matrix(j, i));
}

} // namespace

Regulator::Regulator(int states, int inputs, Time time)
    : time_(time), A_(states, states), B_(states, inputs), Q_(states, states), R_(inputs, inputs),
      Ak_(states, states), Gk_(states, states), H_(states, states), A0_(states, states), G0_(states, states),
      H0_(states, states), W_(states, states), left_(states, states), right_(states, states),
      product_(states, states), BtX_(inputs, states), RB_(inputs, states), K_(inputs, states),
      S_(inputs, inputs), lu_(states), llt_(inputs), of_Q_(states) {
    if (states < 1 || inputs < 1)
        throw std::invalid_argument("a regulator needs states and inputs, but has " + std::to_string(states) +
                                    " and " + std::to_string(inputs));
}

Regulator::Status Regulator::solve(const MatrixIn& A, const MatrixIn& B, const MatrixIn& Q,
                                   const MatrixIn& R) noexcept {
    if (!is_first_ && A == A_ && B == B_ && Q == Q_ && R == R_) return status_;
    is_first_ = false;
    A_ = A;
    B_ = B;
    Q_ = Q;
    R_ = R;
    status_ = solve_anew();
    return status_;
}

Regulator::Status Regulator::solve_anew() noexcept {
    if (!A_.allFinite() || !B_.allFinite() || !Q_.allFinite() || !R_.allFinite()) return Status::not_finite;
    S_ = R_;
    make_symmetric(S_);
    llt_.compute(S_);
    if (llt_.info() != Eigen::Success) return Status::no_cost;
    H_ = Q_;
    make_symmetric(H_);
    // Semidefinite but for what rounding makes of a zero.
    W_ = H_;
    W_.diagonal().array() += 1e-12 * H_.norm() + std::numeric_limits<double>::min();
    of_Q_.compute(W_);
    if (of_Q_.info() != Eigen::Success) return Status::indefinite;
    RB_ = B_.transpose();
    llt_.solveInPlace(RB_);
    Ak_ = A_;
    Gk_.noalias() = B_ * RB_;
    make_symmetric(Gk_);
    if (time_ == Time::continuous && !transform()) return Status::not_stabilising;
    A0_ = Ak_;
    G0_ = Gk_;
    H0_ = H_;
    if (!double_up() && !start_larger()) return Status::not_stabilising;
    BtX_.noalias() = B_.transpose() * H_;
    if (time_ == Time::continuous) {
        K_ = BtX_;
    } else {
        S_.noalias() += BtX_ * B_;
        llt_.compute(S_);
        if (llt_.info() != Eigen::Success) return Status::not_stabilising;
        K_.noalias() = BtX_ * A_;
    }
    llt_.solveInPlace(K_);
    return K_.allFinite() ? Status::solved : Status::not_stabilising;
}

/// From dx/dt to x⁺: with A_γ = A - γ 1 and W = A_γᵀ + H A_γ⁻¹ G,
/// A' = 1 + 2γ W⁻ᵀ, G' = 2γ A_γ⁻¹ G W⁻¹, H' = 2γ W⁻¹ H A_γ⁻¹.
bool Regulator::transform() noexcept {
    // Above the magnitudes of the eigenvalues of the Hamiltonian [A, -G; -H, -Aᵀ] neither matrix is singular.
    const double size = A_.norm() + std::sqrt(Gk_.norm() * H_.norm());
    const double gamma = size > 0.0 ? size : 1.0;
    W_ = A_;
    W_.diagonal().array() -= gamma;
    lu_.compute(W_);
    left_ = lu_.solve(Gk_); // A_γ⁻¹ G
    right_.setIdentity();
    product_ = lu_.solve(right_);     // A_γ⁻¹
    right_.noalias() = H_ * product_; // H A_γ⁻¹
    product_ = W_.transpose();
    product_.noalias() += H_ * left_;
    lu_.compute(product_);
    H_ = lu_.solve(right_);
    H_ *= 2.0 * gamma;
    right_.setIdentity();
    W_ = lu_.solve(right_); // W⁻¹
    Gk_.noalias() = 2.0 * gamma * (left_ * W_);
    Ak_ = 2.0 * gamma * W_.transpose();
    Ak_.diagonal().array() += 1.0;
    make_symmetric(Gk_);
    make_symmetric(H_);
    return Ak_.allFinite() && Gk_.allFinite() && H_.allFinite();
}

/// With W = 1 + G H: A⁺ = A W⁻¹ A, G⁺ = G + A W⁻¹ G Aᵀ, H⁺ = H + Aᵀ H W⁻¹ A, and H becomes X. A becomes the
/// transition of the closed loop over all time, which vanishes where X stabilises.
bool Regulator::double_up() noexcept {
    for (int k = 0; k < 60; ++k) {
        W_.setIdentity();
        W_.noalias() += Gk_ * H_;
        lu_.compute(W_);
        left_ = lu_.solve(Ak_);
        right_ = lu_.solve(Gk_);
        W_.noalias() = H_ * left_;
        H_.noalias() += Ak_.transpose() * W_;
        W_.noalias() = Ak_ * right_;
        Gk_.noalias() += W_ * Ak_.transpose();
        product_.noalias() = Ak_ * left_;
        Ak_.swap(product_);
        make_symmetric(H_);
        make_symmetric(Gk_);
        if (!H_.allFinite() || !Ak_.allFinite()) return false;
        // What is still to come is below its square, relative to H.
        if (Ak_.norm() < 1e-10) return true;
    }
    return false;
}

/// Newton's method: with the closed loop A_c = (1 + G X)⁻¹ A of one X the next one is its cost to go,
/// X⁺ = A_cᵀ X⁺ A_c + H + (X A_c)ᵀ G X A_c, whose sum over all time doubles its length in each step. It is
/// quadratic where X stabilises, and halves the distance where some motion neither grows nor decays.
bool Regulator::start_larger() noexcept {
    const double size = G0_.norm();
    if (!(size > 0.0)) return false;
    H_ = H0_;
    H_.diagonal().array() += 1e-3 * (H0_.norm() + 1.0 / size);
    Ak_ = A0_;
    Gk_ = G0_;
    if (!double_up()) return false;
    for (int k = 0; k < 25; ++k) {
        W_.setIdentity();
        W_.noalias() += G0_ * H_;
        lu_.compute(W_);
        Ak_ = lu_.solve(A0_);
        left_.noalias() = H_ * Ak_;
        right_.noalias() = G0_ * left_;
        W_ = H0_;
        W_.noalias() += left_.transpose() * right_;
        for (int i = 0; i < 60 && !(Ak_.norm() < 1e-10); ++i) {
            left_.noalias() = W_ * Ak_;
            W_.noalias() += Ak_.transpose() * left_;
            product_.noalias() = Ak_ * Ak_;
            Ak_.swap(product_);
        }
        make_symmetric(W_);
        if (!(Ak_.norm() < 1e-10) || !W_.allFinite()) return false;
        H_.swap(W_);
        W_ -= H_;
        if (W_.norm() <= 1e-12 * H_.norm()) return true;
    }
    return false;
}

} // namespace bf::control
