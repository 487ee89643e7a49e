#pragma once

#include <bf/qp/solver.hpp>

namespace bf::qp {

/// A problem as the solvers want it: checked, H symmetric, A row-major, all bounds present in one vector.
struct Data {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

    /// Throws std::invalid_argument on impossible sizes or options.
    Data(int variables, int constraints, const Options& options);

    /// Copies `problem`; its result is `solved` when nothing was found at fault.
    Result load(const Problem& problem, Eigen::Index size_of_x) noexcept;

    /// Is H + shift() 1 positive definite? Its negative curvature is then at most that of rounding.
    bool is_convex() noexcept;
    double shift() const noexcept { return 1e-5 * H.cwiseAbs().maxCoeff(); }
    double objective(const Eigen::VectorXd& x) const noexcept;

    int n, m;
    double tolerance;
    RowMajor H;            // n × n
    Eigen::VectorXd g;     // n
    RowMajor A;            // m × n
    Eigen::VectorXd lower; // [lb; lbA], n + m
    Eigen::VectorXd upper; // [ub; ubA]
    bool bounded = false;  // lb or ub is present

  private:
    RowMajor factor_;        // n × n
    bool has_lower_ = false; // lbA was present

    Result find_fault(const Problem& problem) const noexcept;
    Term wrong_size(const Problem& problem, Eigen::Index size_of_x) const noexcept;
};

} // namespace bf::qp
