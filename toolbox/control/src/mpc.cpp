#include "bf/control/mpc.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace bf::control {
namespace {

using Eigen::Index;
constexpr double infinity = std::numeric_limits<double>::infinity();

} // namespace

int Mpc::Options::variables(int states, int inputs) const {
    return horizon * ((form == Form::sparse ? states + inputs : inputs) +
                      (is_soft ? static_cast<int>(bounded.size()) : 0));
}

void Mpc::Options::validate(int states, int inputs) const {
    if (horizon < 1)
        throw std::invalid_argument("a horizon has at least one step, but horizon is " +
                                    std::to_string(horizon));
    if (horizon > max_variables || variables(states, inputs) > max_variables)
        throw std::invalid_argument("a problem has at most " + std::to_string(max_variables) +
                                    " variables, but a horizon of " + std::to_string(horizon) +
                                    " steps needs more; shorten it");
    for (std::size_t i = 0; i < bounded.size(); ++i)
        if (bounded[i] < 0 || bounded[i] >= states ||
            std::find(bounded.begin(), bounded.begin() + static_cast<std::ptrdiff_t>(i), bounded[i]) !=
                bounded.begin() + static_cast<std::ptrdiff_t>(i))
            throw std::invalid_argument("bounded states are listed once each, from the first to number " +
                                        std::to_string(states) + ", but there is number " +
                                        std::to_string(bounded[i] + 1));
}

Mpc::Mpc(int states, int inputs, Options options)
    : options_(std::move(options)), is_sparse_(options_.form == Form::sparse), n_(states), m_(inputs),
      N_(options_.horizon), c_(static_cast<int>(options_.bounded.size())) {
    if (states < 1 || inputs < 1)
        throw std::invalid_argument("predictive control needs states and inputs, but has " +
                                    std::to_string(states) + " and " + std::to_string(inputs));
    options_.validate(states, inputs);
    first_slack_ = N_ * (is_sparse_ ? n_ + m_ : m_);
    variables_ = options_.variables(n_, m_);
    equations_ = is_sparse_ ? N_ * n_ : 0;
    // Hard bounds of states that are variables are bounds of variables.
    first_rate_ = equations_ + (options_.is_soft ? 2 * N_ * c_ : is_sparse_ ? 0 : N_ * c_);
    constraints_ = first_rate_ + (options_.limits_rates ? N_ * m_ : 0);

    u_min = Eigen::VectorXd::Constant(m_, -infinity);
    u_max = Eigen::VectorXd::Constant(m_, infinity);
    du_min = u_min;
    du_max = u_max;
    u_last = Eigen::VectorXd::Zero(m_);
    x_min = Eigen::VectorXd::Constant(c_, -infinity);
    x_max = Eigen::VectorXd::Constant(c_, infinity);
    slack_weight = Eigen::VectorXd::Ones(c_);
    slack_linear = Eigen::VectorXd::Zero(c_);
    A_ = W_ = AW_ = state_weight_ = terminal_weight_ = Eigen::MatrixXd::Zero(n_, n_);
    Q_ = P_ = A_;
    B_ = WB_ = Eigen::MatrixXd::Zero(n_, m_);
    R_ = input_weight_ = Eigen::MatrixXd::Zero(m_, m_);
    powers_ = Eigen::MatrixXd::Zero(n_, is_sparse_ ? 0 : m_ * N_);
    H_ = Eigen::MatrixXd::Zero(variables_, variables_);
    rows_ = Eigen::MatrixXd::Zero(constraints_, variables_);
    g_ = z_ = Eigen::VectorXd::Zero(variables_);
    low_ = Eigen::VectorXd::Constant(variables_, -infinity);
    high_ = Eigen::VectorXd::Constant(variables_, infinity);
    lower_ = Eigen::VectorXd::Constant(constraints_, -infinity);
    upper_ = Eigen::VectorXd::Constant(constraints_, infinity);
    adjoint_ = next_ = error_ = Eigen::VectorXd::Zero(n_);
    free_ = x_ = Eigen::MatrixXd::Zero(n_, N_);
    u_ = Eigen::MatrixXd::Zero(m_, N_);
    if (options_.method == Method::daqp) {
        solver_ = qp::make_daqp(variables_, constraints_, {options_.max_iterations, options_.tolerance});
    } else {
        qp::OsqpOptions of;
        of.max_iterations = options_.max_iterations;
        of.tolerance = options_.tolerance;
        of.adaptive_rho = true;
        solver_ = qp::make_osqp(variables_, constraints_, of);
    }
}

void Mpc::set_model(const MatrixIn& A, const MatrixIn& B, const MatrixIn& Q, const MatrixIn& R,
                    const MatrixIn& P) noexcept {
    if (has_model_ && A == A_ && B == B_ && Q == Q_ && R == R_ && P == P_) return;
    has_model_ = true;
    A_ = A;
    B_ = B;
    Q_ = Q;
    R_ = R;
    P_ = P;
    state_weight_ = 0.5 * (Q_ + Q_.transpose());
    terminal_weight_ = 0.5 * (P_ + P_.transpose());
    input_weight_ = 0.5 * (R_ + R_.transpose());
    H_.setZero();
    rows_.setZero();
    is_sparse_ ? form_sparse() : form_condensed();
    set_bound_rows();
}

/// H_ij = Bᵀ W_i A^{i-j} B + δ_ij R for i ≥ j, with the cost to go of the plant without inputs W_{N-1} = P
/// and W_{i-1} = Q + Aᵀ W_i A.
void Mpc::form_condensed() noexcept {
    powers_.leftCols(m_) = B_;
    for (int k = 1; k < N_; ++k)
        powers_.middleCols(k * m_, m_).noalias() = A_ * powers_.middleCols((k - 1) * m_, m_);
    W_ = terminal_weight_;
    for (int i = N_ - 1; i >= 0; --i) {
        WB_.noalias() = W_.transpose() * B_;
        for (int j = 0; j <= i; ++j) {
            auto block = H_.block(i * m_, j * m_, m_, m_);
            block.noalias() = WB_.transpose() * powers_.middleCols((i - j) * m_, m_);
            if (i == j) block += input_weight_;
            H_.block(j * m_, i * m_, m_, m_) = block.transpose();
        }
        AW_.noalias() = A_.transpose() * W_;
        W_ = state_weight_;
        W_.noalias() += AW_ * A_;
    }
}

void Mpc::form_sparse() noexcept {
    for (int k = 0; k < N_; ++k) {
        H_.block(input_at(k), input_at(k), m_, m_) = input_weight_;
        H_.block(state_at(k + 1), state_at(k + 1), n_, n_) = k + 1 == N_ ? terminal_weight_ : state_weight_;
        rows_.block(k * n_, state_at(k + 1), n_, n_).setIdentity();
        rows_.block(k * n_, input_at(k), n_, m_) = -B_;
        if (k > 0) rows_.block(k * n_, state_at(k), n_, n_) = -A_;
    }
}

/// Rows of the bounded states: x_k, or of soft bounds x_k + s and x_k - s. Then those of limited rates.
void Mpc::set_bound_rows() noexcept {
    const int sides = options_.is_soft ? 2 : 1;
    for (int k = 0; k < N_ && options_.limits_rates; ++k) {
        rows_.block(first_rate_ + k * m_, input_at(k), m_, m_).setIdentity();
        if (k > 0) rows_.block(first_rate_ + k * m_, input_at(k - 1), m_, m_).diagonal().setConstant(-1.0);
    }
    for (int k = 1; k <= N_ && first_rate_ > equations_; ++k)
        for (int i = 0; i < c_; ++i) {
            const int state = options_.bounded[static_cast<std::size_t>(i)];
            for (int side = 0; side < sides; ++side) {
                auto row = rows_.row(equations_ + sides * ((k - 1) * c_ + i) + side);
                if (is_sparse_)
                    row[state_at(k) + state] = 1.0;
                else
                    for (int j = 0; j < k; ++j)
                        row.segment(j * m_, m_) = powers_.block(state, (k - 1 - j) * m_, 1, m_);
                if (options_.is_soft) row[slack_at(k, i)] = side == 0 ? 1.0 : -1.0;
            }
        }
}

void Mpc::set_bounds() noexcept {
    for (int k = 0; k < N_; ++k) {
        low_.segment(input_at(k), m_) = u_min;
        high_.segment(input_at(k), m_) = u_max;
        if (options_.limits_rates) {
            auto low = lower_.segment(first_rate_ + k * m_, m_),
                 high = upper_.segment(first_rate_ + k * m_, m_);
            low = du_min;
            high = du_max;
            if (k == 0) low += u_last, high += u_last;
        }
        for (int i = 0; i < c_; ++i) {
            const int state = options_.bounded[static_cast<std::size_t>(i)];
            const double offset = is_sparse_ ? 0.0 : free_(state, k);
            const int row = equations_ + (options_.is_soft ? 2 : 1) * (k * c_ + i);
            if (options_.is_soft) {
                lower_[row] = x_min[i] - offset;
                upper_[row + 1] = x_max[i] - offset;
                const int slack = slack_at(k + 1, i);
                low_[slack] = 0.0;
                H_(slack, slack) = slack_weight[i];
                g_[slack] = slack_linear[i];
            } else if (is_sparse_) {
                low_[state_at(k + 1) + state] = x_min[i];
                high_[state_at(k + 1) + state] = x_max[i];
            } else {
                lower_[row] = x_min[i] - offset;
                upper_[row] = x_max[i] - offset;
            }
        }
    }
}

qp::Result Mpc::solve(const VectorIn& x, const MatrixIn& reference, const VectorIn& u_reference,
                      const VectorIn& disturbance) noexcept {
    const auto r = [&](int k) { return reference.col(reference.cols() == 1 ? 0 : k - 1); };
    next_ = x;
    for (int k = 0; k < N_; ++k) {
        free_.col(k) = disturbance;
        free_.col(k).noalias() += A_ * next_;
        next_ = free_.col(k);
    }
    if (is_sparse_) {
        for (int k = 0; k < N_; ++k) {
            g_.segment(input_at(k), m_).noalias() = -input_weight_ * u_reference;
            g_.segment(state_at(k + 1), n_).noalias() =
                -(k + 1 == N_ ? terminal_weight_ : state_weight_) * r(k + 1);
            lower_.segment(k * n_, n_) = k == 0 ? free_.col(0) : disturbance;
        }
        upper_.head(equations_) = lower_.head(equations_);
    } else {
        // The adjoint of the plant without inputs: λ_N = P e_N, λ_k = Q e_k + Aᵀ λ_{k+1}, g_{k-1} = Bᵀ λ_k.
        error_ = free_.col(N_ - 1) - r(N_);
        adjoint_.noalias() = terminal_weight_ * error_;
        for (int k = N_; k >= 1; --k) {
            auto part = g_.segment(input_at(k - 1), m_);
            part.noalias() = B_.transpose() * adjoint_;
            part.noalias() -= input_weight_ * u_reference;
            if (k == 1) break;
            next_.noalias() = A_.transpose() * adjoint_;
            error_ = free_.col(k - 2) - r(k - 1);
            next_.noalias() += state_weight_ * error_;
            adjoint_ = next_;
        }
    }
    set_bounds();
    const qp::Result result = solver_->solve({H_, g_, rows_, lower_, upper_, low_, high_}, z_);
    if (result.status != qp::Status::solved) return result;
    next_ = x;
    for (int k = 0; k < N_; ++k) {
        u_.col(k) = z_.segment(input_at(k), m_);
        x_.col(k) = disturbance;
        x_.col(k).noalias() += A_ * next_;
        x_.col(k).noalias() += B_ * u_.col(k);
        next_ = x_.col(k);
    }
    return result;
}

} // namespace bf::control
