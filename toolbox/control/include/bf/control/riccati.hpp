#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace bf::control {

using MatrixIn = Eigen::Ref<const Eigen::MatrixXd>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>;

/// The linear-quadratic regulator u = -K x of a system with n states and m inputs:
///
///   discrete:    x⁺ = A x + B u,    min Σ xᵀQx + uᵀRu,   X = AᵀXA - AᵀXB K + Q,   K = (R + BᵀXB)⁻¹ BᵀXA
///   continuous:  dx/dt = A x + B u, min ∫ xᵀQx + uᵀRu dt, AᵀX + XA - XB K + Q = 0, K = R⁻¹ BᵀX
///
/// X (n×n) is the stabilising solution, xᵀXx the cost to go. By structure-preserving doubling, whose k-th
/// step has the closed loop's transition over 2ᵏ periods (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang,
/// Structure-preserving algorithms for periodic discrete-time algebraic Riccati equations, 2004); an equation
/// in continuous time becomes one in discrete time by Cayley's transform (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin,
/// A structure-preserving doubling algorithm for continuous-time algebraic Riccati equations, 2005). Where Q
/// does not see a motion that grows, doubling finds another solution; there X is found from that of a larger
/// Q by Newton's method (G. A. Hewer, An iterative technique for the computation of the steady state gains
/// for the discrete optimal regulator, 1971).
///
/// All memory is allocated by the constructor, of up to some hundred states. Not for concurrent use.
class Regulator {
  public:
    enum class Time { discrete, continuous };
    enum class Status {
        solved = 0,
        not_stabilising = 1, ///< no gain stabilises A, B, or Q does not see a motion that neither grows nor
                             ///< decays
        no_cost = 2,         ///< R is not positive definite
        not_finite = 3,      ///< an entry is not finite
        indefinite = 4       ///< Q is not positive semidefinite
    };

    /// Throws std::invalid_argument unless there is a state and an input.
    Regulator(int states, int inputs, Time time);

    /// Finds X and K, which are not valid unless it is solved. Only the symmetric parts of Q, positive
    /// semidefinite, and R count. Does nothing when the matrices are those of the last call, bit for bit.
    Status solve(const MatrixIn& A, const MatrixIn& B, const MatrixIn& Q, const MatrixIn& R) noexcept;

    const Eigen::MatrixXd& X() const { return H_; }
    const Eigen::MatrixXd& K() const { return K_; }

  private:
    Status solve_anew() noexcept;
    bool transform() noexcept;
    bool double_up() noexcept;
    bool start_larger() noexcept;

    Time time_;
    Status status_ = Status::not_finite;
    bool is_first_ = true;
    Eigen::MatrixXd A_, B_, Q_, R_;              ///< as they were given
    Eigen::MatrixXd Ak_, Gk_, H_;                ///< of the doubling
    Eigen::MatrixXd A0_, G0_, H0_;               ///< with which it begins
    Eigen::MatrixXd W_, left_, right_, product_; ///< (n×n)
    Eigen::MatrixXd BtX_, RB_, K_, S_;
    Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
    Eigen::LLT<Eigen::MatrixXd> llt_, of_Q_;
};

} // namespace bf::control
