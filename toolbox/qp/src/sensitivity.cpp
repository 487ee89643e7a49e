#include <bf/qp/sensitivity.hpp>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace bf::qp {
namespace {

using Eigen::Index;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// A constraint that x meets: aᵀ x = b.
struct Active {
    Index row;                  ///< of A, or element of x
    bool is_bound;              ///< of an element
    bool is_lower, is_equality; ///< of two equal limits the lower one is named
    double multiplier = 0;      ///< λ, with H x + g = Σ λ a; > 0 of a lower limit, < 0 of an upper one
};

Vector coefficients(const Problem& problem, const Active& one, Index n) {
    return one.is_bound ? Vector(Vector::Unit(n, one.row)) : Vector(problem.A.row(one.row));
}

std::vector<Active> met(const Problem& problem, const Eigen::Ref<const Vector>& x) {
    std::vector<Active> found;
    const auto look = [&](const auto& lower, const auto& upper, bool is_bound, const auto& at) {
        const auto size = std::max(lower.size(), upper.size());
        for (Index i = 0; i < size; ++i) {
            const std::pair<double, double> value = at(i); // and the size of its terms
            const auto is_met = [&](const auto& limits) {
                return limits.size() > 0 && std::isfinite(limits[i]) &&
                       std::abs(value.first - limits[i]) <= 3e-6 * (1 + std::abs(limits[i]) + value.second);
            };
            const bool at_lower = is_met(lower), at_upper = is_met(upper);
            if (at_lower || at_upper) found.push_back({i, is_bound, at_lower, at_lower && at_upper});
        }
    };
    look(problem.lb, problem.ub, true, [&](Index i) { return std::pair(x[i], std::abs(x[i])); });
    look(problem.lbA, problem.ubA, false, [&](Index i) {
        return std::pair(problem.A.row(i).dot(x), problem.A.row(i).cwiseAbs().dot(x.cwiseAbs()));
    });
    return found;
}

/// min |E λ - r| with λ ≥ 0 where it is not free, by active sets; true where an element is in the set that is
/// not held at 0. `least` is the slope below which nothing is gained.
std::vector<bool> multipliers(const Matrix& E, const Vector& r, const std::vector<bool>& free, double least,
                              Vector& lambda) {
    const Index k = E.cols();
    std::vector<bool> in = free;
    lambda = Vector::Zero(k);
    for (Index round = 0; round < 3 * k + 1; ++round) {
        while (true) {
            std::vector<Index> set;
            for (Index i = 0; i < k; ++i)
                if (in[static_cast<std::size_t>(i)]) set.push_back(i);
            Vector z = Vector::Zero(k);
            if (!set.empty()) {
                const Matrix columns = E(Eigen::all, set);
                const Vector solution = columns.completeOrthogonalDecomposition().solve(r);
                z(set) = solution;
            }
            double part = 1;
            Index leaves = -1;
            for (const Index i : set)
                if (!free[static_cast<std::size_t>(i)] && z[i] <= 0 &&
                    lambda[i] / (lambda[i] - z[i]) <= part) {
                    part = lambda[i] > 0 ? lambda[i] / (lambda[i] - z[i]) : 0;
                    leaves = i;
                }
            lambda += part * (z - lambda);
            if (leaves < 0) break;
            lambda[leaves] = 0;
            in[static_cast<std::size_t>(leaves)] = false;
        }
        const Vector slope = E.transpose() * (r - E * lambda);
        Index best = -1;
        for (Index i = 0; i < k; ++i)
            if (!in[static_cast<std::size_t>(i)] && slope[i] > least * E.col(i).norm() &&
                (best < 0 || slope[i] > slope[best]))
                best = i;
        if (best < 0) break;
        in[static_cast<std::size_t>(best)] = true;
    }
    return in;
}

} // namespace

Sensitivity differentiate(const Problem& problem, const Eigen::Ref<const Vector>& x, const Changes& changes,
                          Index directions) {
    const Index n = x.size(), m = problem.A.rows();
    Sensitivity result{.x = Matrix::Zero(n, directions), .objective = Eigen::RowVectorXd::Zero(directions)};
    const Matrix H = 0.5 * (Matrix(problem.H) + Matrix(problem.H).transpose());
    const Vector gradient = H * x + problem.g;
    const double scale = (H * x).norm() + problem.g.norm();

    // The active set: what is met, and of that what pushes.
    auto active = met(problem, x);
    const auto count = static_cast<Index>(active.size());
    Matrix E(n, count);
    std::vector<bool> free;
    for (Index i = 0; i < count; ++i) {
        const auto& one = active[static_cast<std::size_t>(i)];
        E.col(i) = (one.is_lower ? 1 : -1) * coefficients(problem, one, n);
        free.push_back(one.is_equality);
    }
    Vector lambda;
    const auto pushes = multipliers(E, gradient, free, 1e-9 * scale, lambda);
    if ((E * lambda - gradient).norm() > 1e-5 * (scale + 1e-300)) return result; // x is no solution
    std::vector<Active> idle, held;
    for (Index i = 0; i < count; ++i) {
        auto one = active[static_cast<std::size_t>(i)];
        one.multiplier = (one.is_lower ? 1 : -1) * lambda[i];
        (pushes[static_cast<std::size_t>(i)] ? held : idle).push_back(one);
    }

    // q = -dH x - dg + dWᵀ λ, c = db - dW x, and W.
    const auto held_count = static_cast<Index>(held.size());
    Matrix q = Matrix::Zero(n, directions), c = Matrix::Zero(held_count, directions), W(held_count, n);
    if (changes.g.rows() > 0) q -= changes.g;
    Matrix H_x = Matrix::Zero(n, directions);
    using Values = Eigen::Map<const Matrix>; // of one direction
    for (Index d = 0; changes.H.rows() > 0 && d < directions; ++d) {
        const Values dH(changes.H.col(d).data(), n, n);
        H_x.col(d) = 0.5 * (dH * x + dH.transpose() * x);
    }
    q -= H_x;
    for (Index k = 0; k < held_count; ++k) {
        const auto& one = held[static_cast<std::size_t>(k)];
        W.row(k) = coefficients(problem, one, n);
        const auto& limit = one.is_bound ? (one.is_lower ? changes.lb : changes.ub)
                                         : (one.is_lower ? changes.lbA : changes.ubA);
        if (limit.rows() > 0) c.row(k) += limit.row(one.row);
        if (one.is_bound || changes.A.rows() == 0) continue;
        for (Index d = 0; d < directions; ++d) {
            const Values dA(changes.A.col(d).data(), m, n);
            c(k, d) -= dA.row(one.row).dot(x);
            q.col(d) += one.multiplier * dA.row(one.row).transpose();
        }
    }

    // What the constraints say, and within them what the objective says: x = W⁺ c + Z p, Z'HZ p = Z'(q -
    // HW⁺c).
    Matrix Z = Matrix::Identity(n, n);
    if (held_count > 0) {
        const Eigen::CompleteOrthogonalDecomposition<Matrix> constraints(W);
        result.x = constraints.solve(c);
        const Eigen::ColPivHouseholderQR<Matrix> transposed(W.transpose());
        const Matrix Q = transposed.householderQ();
        Z = Q.rightCols(n - transposed.rank());
    }
    if (Z.cols() > 0) {
        const Matrix reduced = Z.transpose() * H * Z;
        const Eigen::LDLT<Matrix> factor(reduced);
        const double largest = reduced.diagonal().cwiseAbs().maxCoeff();
        if (factor.info() != Eigen::Success || factor.vectorD().minCoeff() <= 1e-13 * largest) return result;
        result.x += Z * factor.solve(Z.transpose() * (q - H * result.x));
    }
    result.exists = true;
    result.objective = gradient.transpose() * result.x + 0.5 * x.transpose() * H_x;
    if (changes.g.rows() > 0) result.objective += x.transpose() * changes.g;
    for (const auto& one : idle) {
        const Vector a = coefficients(problem, one, n);
        result.is_one_sided |= (Z.transpose() * a).norm() > 1e-7 * a.norm();
    }
    return result;
}

} // namespace bf::qp
