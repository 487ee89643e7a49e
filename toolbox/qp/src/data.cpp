#include "data.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace bf::qp {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// dst = src or, when absent, `fallback`.
void copy_bound(const Problem::Vector& src, double fallback, Eigen::Ref<Eigen::VectorXd> dst) noexcept {
    if (src.size() == 0) {
        dst.setConstant(fallback);
    } else {
        dst = src;
    }
}

/// Copies the symmetric part of H; returns 0, or NaN if an entry is not finite (0 · inf = NaN).
double copy_symmetric(const Problem::Matrix& from, Data::RowMajor& to) noexcept {
    const auto n = to.rows();
    double check = 0.0;
    for (Eigen::Index j = 0; j < n; ++j) {
        double column = 0.0;
        for (Eigen::Index i = 0; i <= j; ++i) {
            const double mean = 0.5 * (from(i, j) + from(j, i));
            to(i, j) = mean;
            to(j, i) = mean;
            column += 0.0 * mean;
        }
        check += column;
    }
    return check;
}

/// Copies a column-major matrix into a row-major one, four columns at a time; returns 0 or NaN as above.
double copy_transposed(const Problem::Matrix& from, Data::RowMajor& to) noexcept {
    const auto rows = to.rows();
    const auto columns = to.cols();
    double c0 = 0.0, c1 = 0.0, c2 = 0.0, c3 = 0.0;
    Eigen::Index j = 0;
    for (; j + 4 <= columns; j += 4) {
        const double* a0 = &from.coeffRef(0, j);
        const double* a1 = a0 + from.outerStride();
        const double* a2 = a1 + from.outerStride();
        const double* a3 = a2 + from.outerStride();
        double* row = to.data() + j;
        for (Eigen::Index i = 0; i < rows; ++i, row += columns) {
            row[0] = a0[i];
            row[1] = a1[i];
            row[2] = a2[i];
            row[3] = a3[i];
            c0 += 0.0 * a0[i];
            c1 += 0.0 * a1[i];
            c2 += 0.0 * a2[i];
            c3 += 0.0 * a3[i];
        }
    }
    for (; j < columns; ++j) {
        for (Eigen::Index i = 0; i < rows; ++i) {
            to(i, j) = from(i, j);
            c0 += 0.0 * from(i, j);
        }
    }
    return (c0 + c1) + (c2 + c3);
}

Result fault(Status status, Term term, Eigen::Index row, Eigen::Index column, double value,
             double other = 0.0) noexcept {
    Result r;
    r.status = status;
    r.term = term;
    r.row = static_cast<int>(row);
    r.column = static_cast<int>(column);
    r.value = value;
    r.other = other;
    return r;
}

/// The first entry of `matrix` (by columns) that is not finite.
template <class Matrix> Result find_non_finite(const Matrix& matrix, Term term) noexcept {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
        for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
            if (!std::isfinite(matrix(i, j))) {
                const bool vector = term == Term::g;
                return fault(Status::internal_error, term, i, vector ? -1 : j, matrix(i, j));
            }
        }
    }
    return {};
}

} // namespace

Data::Data(int variables, int constraints, const Options& options)
    : n(variables), m(constraints), tolerance(options.tolerance) {
    options.validate();
    if (n < 1 || m < 0) {
        throw std::invalid_argument("a quadratic program of " + std::to_string(n) + " variables and " +
                                    std::to_string(m) +
                                    " constraints was asked for: it needs at least 1 and at least 0");
    }
    H.setIdentity(n, n);
    factor_ = H;
    g.setZero(n);
    A.setZero(m, n);
    lower.setConstant(n + m, -infinity);
    upper.setConstant(n + m, infinity);
}

Result Data::load(const Problem& p, Eigen::Index size_of_x) noexcept {
    if (const Term term = wrong_size(p, size_of_x); term != Term::none) {
        return fault(Status::internal_error, term, -1, -1, 0.0);
    }
    double check = copy_symmetric(p.H, H);
    if (m > 0) {
        check += copy_transposed(p.A, A);
    }
    g = p.g;
    check += 0.0 * g.sum();
    const bool was_bounded = bounded;
    bounded = p.lb.size() + p.ub.size() > 0;
    if (bounded || was_bounded) {
        copy_bound(p.lb, -infinity, lower.head(n));
        copy_bound(p.ub, infinity, upper.head(n));
    }
    copy_bound(p.lbA, -infinity, lower.tail(m));
    copy_bound(p.ubA, infinity, upper.tail(m));

    bool sound = check == 0.0;
    for (int i = bounded ? 0 : n; i < n + m; ++i) {
        sound &= lower[i] - upper[i] <= tolerance; // false for NaN and for equal infinities too
    }
    return sound ? Result{} : find_fault(p);
}

bool Data::is_convex() noexcept {
    const double by = shift();
    if (by == 0.0) return true; // H = 0
    factor_ = H;
    factor_.diagonal().array() += by;
    const Eigen::LLT<Eigen::Ref<RowMajor>> cholesky(factor_);
    return cholesky.info() == Eigen::Success;
}

double Data::objective(const Eigen::VectorXd& x) const noexcept {
    return 0.5 * x.dot(H.lazyProduct(x)) + g.dot(x);
}

Term Data::wrong_size(const Problem& p, Eigen::Index size_of_x) const noexcept {
    const auto is = [](const auto& vector, int size) { return vector.size() == size || vector.size() == 0; };
    return p.H.rows() != n || p.H.cols() != n              ? Term::H
           : p.g.size() != n                               ? Term::g
           : m > 0 && (p.A.rows() != m || p.A.cols() != n) ? Term::A
           : !is(p.lbA, m)                                 ? Term::lbA
           : !is(p.ubA, m)                                 ? Term::ubA
           : !is(p.lb, n)                                  ? Term::lb
           : !is(p.ub, n)                                  ? Term::ub
           : size_of_x != n                                ? Term::x
                                                           : Term::none;
}

Result Data::find_fault(const Problem& p) const noexcept {
    for (const auto& r : {find_non_finite(p.H, Term::H), find_non_finite(p.g, Term::g),
                          m > 0 ? find_non_finite(p.A, Term::A) : Result{}}) {
        if (r.term != Term::none) {
            return r;
        }
    }
    for (int i = 0; i < n + m; ++i) {
        const bool on_x = i < n;
        const int row = on_x ? i : i - n;
        const auto low = on_x ? Term::lb : Term::lbA;
        const auto high = on_x ? Term::ub : Term::ubA;
        if (std::isnan(lower[i])) {
            return fault(Status::internal_error, low, row, -1, lower[i]);
        }
        if (std::isnan(upper[i])) {
            return fault(Status::internal_error, high, row, -1, upper[i]);
        }
        if (!(lower[i] - upper[i] <= tolerance)) {
            return fault(Status::infeasible, low, row, -1, lower[i], upper[i]);
        }
    }
    // Every entry is finite, so a sum overflowed: the numbers are too large to compute with.
    Result r;
    r.status = Status::internal_error;
    return r;
}

} // namespace bf::qp
