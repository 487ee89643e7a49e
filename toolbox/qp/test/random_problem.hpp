#pragma once

#include <Eigen/Dense>
#include <bf/qp/solver.hpp>
#include <limits>
#include <random>

namespace bf::qp::test {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// A problem that owns its data, and x as the caller's memory.
struct Owned {
    Eigen::MatrixXd H;
    Eigen::VectorXd g;
    Eigen::MatrixXd A{};
    Eigen::VectorXd lbA{}, ubA{}, lb{}, ub{};

    Problem problem() const { return {H, g, A, lbA, ubA, lb, ub}; }
    double objective(const Eigen::VectorXd& x) const { return 0.5 * x.dot(H * x) + g.dot(x); }
};

/// Strictly convex and feasible; a third of the rows each one-sided, two-sided or (at most n/2) equal.
inline Owned random_problem(std::mt19937& random, int n, int m, bool box) {
    std::normal_distribution<double> normal;
    std::uniform_int_distribution<int> kind(0, 3);
    const auto matrix = [&](int r, int c) {
        return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(r, c, [&] { return normal(random); }));
    };
    const Eigen::MatrixXd B = matrix(n, n);
    const Eigen::VectorXd inside = matrix(n, 1);
    Owned p{B.transpose() * B + 0.1 * Eigen::MatrixXd::Identity(n, n),
            3.0 * matrix(n, 1),
            matrix(m, n),
            {},
            {},
            {},
            {}};
    if (m > 0) {
        p.lbA = p.A * inside - matrix(m, 1).cwiseAbs();
        p.ubA = p.A * inside + matrix(m, 1).cwiseAbs();
        int equalities = 0;
        for (int i = 0; i < m; ++i) {
            switch (kind(random)) {
            case 0: p.lbA[i] = -infinity; break;
            case 1: p.ubA[i] = infinity; break;
            case 2:
                if (equalities++ < n / 2) p.lbA[i] = p.ubA[i] = p.A.row(i).dot(inside);
                break;
            default: break;
            }
        }
    }
    if (box) {
        p.lb = inside - matrix(n, 1).cwiseAbs();
        p.ub = inside + matrix(n, 1).cwiseAbs();
    }
    return p;
}

/// Largest violation of the optimality conditions at x. The multipliers y of the active rows N come from the
/// least-squares solution of Nᵀy = −(Hx + g), independently of any solver.
inline double kkt_violation(const Owned& p, const Eigen::VectorXd& x, double active_within) {
    const int n = static_cast<int>(x.size());
    double worst = 0.0;
    Eigen::MatrixXd N(n, 0);
    std::vector<int> sides; // +1 upper, −1 lower, 0 equality
    const auto visit = [&](const Eigen::VectorXd& row, double low, double high) {
        const double value = row.dot(x);
        worst = std::max({worst, low - value, value - high});
        const bool at_low = value - low < active_within, at_high = high - value < active_within;
        if (at_low || at_high) {
            N.conservativeResize(n, N.cols() + 1);
            N.rightCols(1) = row;
            sides.push_back(at_low && at_high ? 0 : at_high ? 1 : -1);
        }
    };
    for (int i = 0; i < p.A.rows(); ++i) {
        visit(p.A.row(i), p.lbA.size() ? p.lbA[i] : -infinity, p.ubA.size() ? p.ubA[i] : infinity);
    }
    for (int i = 0; i < n; ++i) {
        visit(Eigen::VectorXd::Unit(n, i), p.lb.size() ? p.lb[i] : -infinity,
              p.ub.size() ? p.ub[i] : infinity);
    }
    const Eigen::VectorXd gradient = p.H * x + p.g;
    if (N.cols() == 0) {
        return std::max(worst, gradient.cwiseAbs().maxCoeff());
    }
    const Eigen::VectorXd y = N.completeOrthogonalDecomposition().solve(-gradient);
    for (int i = 0; i < y.size(); ++i) {
        worst = std::max(worst, -sides[i] * y[i]);
    }
    return std::max(worst, (gradient + N * y).cwiseAbs().maxCoeff());
}

} // namespace bf::qp::test
