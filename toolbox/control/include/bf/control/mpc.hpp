#pragma once

#include "bf/control/riccati.hpp"

#include "bf/qp/solver.hpp"

#include <memory>
#include <vector>

namespace bf::control {

/// Model predictive control of x⁺ = A x + B u + d (n states, m inputs) over a horizon of N steps:
///
///   min ½ Σ_{k=1}^{N-1} |x_k - r_k|²_Q + ½ |x_N - r_N|²_P + ½ Σ_{k=0}^{N-1} |u_k - u_r|²_R + Σ penalties
///   subject to u_min ≤ u_k ≤ u_max,  x_min ≤ x_k ≤ x_max of the bounded states, k = 1 … N,
///   and of limited rates Δu_min ≤ u_k - u_{k-1} ≤ Δu_max, k = 0 … N-1, where u_{-1} is in force already
///
/// in one of two forms of one problem: `condensed` has the inputs alone as variables, `sparse` inputs and
/// states under the equations of motion (J. B. Rawlings, D. Q. Mayne, M. M. Diehl, Model Predictive Control:
/// Theory, Computation, and Design, 2017, §8.2). Soft bounds of states may be exceeded by s ≥ 0 at the cost
/// slack_linear s + ½ slack_weight s²; where slack_linear is above the multiplier of the bound, they are kept
/// wherever that is possible (E. C. Kerrigan, J. M. Maciejowski, Soft constraints and exact penalty functions
/// in model predictive control, 2000).
///
/// All memory is allocated by the constructor. Not for concurrent use.
class Mpc {
  public:
    enum class Form { condensed, sparse };
    enum class Method { daqp, osqp }; ///< exact; approximate, to the tolerance of the options

    struct Options {
        int horizon = 20;
        Form form = Form::condensed;
        Method method = Method::daqp;
        std::vector<int> bounded;  ///< states with bounds, from 0
        bool is_soft = false;      ///< their bounds may be exceeded
        bool limits_rates = false; ///< inputs change within bounds from step to step
        int max_iterations = 1000;
        double tolerance = 1e-6;
        /// Matrices are dense: memory grows with the square of the variables, time with the cube.
        static constexpr int max_variables = 2000;
        int variables(int states, int inputs) const;
        /// Throws std::invalid_argument naming the option that is out of range.
        void validate(int states, int inputs) const;
    };

    /// Throws std::invalid_argument unless there is a state and an input.
    Mpc(int states, int inputs, Options options);

    Eigen::VectorXd u_min, u_max;   ///< (m), infinite at first
    Eigen::VectorXd du_min, du_max; ///< (m) of limited rates, in a step; infinite at first
    Eigen::VectorXd u_last; ///< u_{-1} (m), from which the first of limited rates counts; zeros at first
    Eigen::VectorXd x_min, x_max; ///< of the bounded states, infinite at first
    Eigen::VectorXd slack_weight; ///< of the bounded states, at least 0; ones at first
    Eigen::VectorXd slack_linear; ///< alike; zeros at first

    /// Plant and cost: Q and P (n×n) positive semidefinite, R (m×m) positive definite, only their symmetric
    /// parts count. Forms the matrices of the program, unless they are those of the last call, bit for bit.
    void set_model(const MatrixIn& A, const MatrixIn& B, const MatrixIn& Q, const MatrixIn& R,
                   const MatrixIn& P) noexcept;

    /// Solves for the state x (n), references (n×N: r_1 … r_N, or n×1: one for all), u_reference (m) and the
    /// disturbance d (n), beginning from the active bounds of the last solution. The plan stays as it was
    /// unless it is solved.
    qp::Result solve(const VectorIn& x, const MatrixIn& reference, const VectorIn& u_reference,
                     const VectorIn& disturbance) noexcept;

    /// u_0 … u_{N-1} (m×N) and x_1 … x_N (n×N) of the last solution.
    const Eigen::MatrixXd& inputs() const { return u_; }
    const Eigen::MatrixXd& states() const { return x_; }

    int variables() const { return variables_; }
    int constraints() const { return constraints_; }

    /// Forgets the active bounds: the next solve is what a new object would do, bit for bit.
    void reset() noexcept { solver_->reset(); }
    int state_size() const noexcept { return solver_->state_size(); }
    void save(double* state) const noexcept { solver_->save(state); }
    void restore(const double* state) noexcept { solver_->restore(state); }

  private:
    int input_at(int k) const { return is_sparse_ ? k * (n_ + m_) : k * m_; }
    int state_at(int k) const { return (k - 1) * (n_ + m_) + m_; } ///< of x_k, sparse
    int slack_at(int k, int i) const { return first_slack_ + (k - 1) * c_ + i; }
    void form_condensed() noexcept;
    void form_sparse() noexcept;
    void set_bound_rows() noexcept;
    void set_bounds() noexcept;

    Options options_;
    bool is_sparse_, has_model_ = false;
    int n_, m_, N_, c_, first_slack_, variables_, equations_, first_rate_, constraints_;
    Eigen::MatrixXd A_, B_, Q_, R_, P_;
    Eigen::MatrixXd powers_; ///< Aᵏ B (n×mN), condensed
    Eigen::MatrixXd W_, WB_, AW_, state_weight_, terminal_weight_, input_weight_;
    Eigen::MatrixXd H_, rows_;
    Eigen::VectorXd g_, lower_, upper_, low_, high_, z_, adjoint_, next_, error_;
    Eigen::MatrixXd free_; ///< states without inputs (n×N)
    Eigen::MatrixXd u_, x_;
    std::unique_ptr<qp::Solver> solver_;
};

} // namespace bf::control
