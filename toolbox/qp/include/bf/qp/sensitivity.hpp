#pragma once

#include <bf/qp/solver.hpp>

namespace bf::qp {

/// Small changes of a problem along several directions, one column each; rows are elements in their order in
/// memory. Without rows it does not change.
struct Changes {
    using Columns = Eigen::Ref<const Eigen::MatrixXd>;
    Columns H = Eigen::MatrixXd(), g = Eigen::MatrixXd(), A = Eigen::MatrixXd();
    Columns lbA = Eigen::MatrixXd(), ubA = Eigen::MatrixXd(), lb = Eigen::MatrixXd(), ub = Eigen::MatrixXd();
};

/// How a solution changes with its problem.
struct Sensitivity {
    Eigen::MatrixXd x;            ///< n × directions
    Eigen::RowVectorXd objective; ///< directions
    /// Is there a derivative? Not where the solution is not unique, or x is none.
    bool exists = false;
    /// A constraint is met without a force: the derivative is that to the side where it is left.
    bool is_one_sided = false;
};

/// The derivative of the solution x of a problem: with the constraints W x = b that hold with a multiplier,
/// H dx - Wᵀ dλ = -dH x - dg + dWᵀ λ and W dx = db - dW x, the KKT system of the active set. Source: A. V.
/// Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear Programming, 1983, §3.2. The
/// active set is found from x itself, its multipliers as non-negative least squares (C. L. Lawson, R. J.
/// Hanson, Solving Least Squares Problems, 1974, §23.3), whichever solver x is from: an exact one. Allocates.
Sensitivity differentiate(const Problem& problem, const Eigen::Ref<const Eigen::VectorXd>& x,
                          const Changes& changes, Eigen::Index directions);

} // namespace bf::qp
