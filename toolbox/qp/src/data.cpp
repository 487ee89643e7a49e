#include "data.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace bf::qp {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// To `to` goes `from` or, when absent, `fallback`.
inline void copy_bound(const Problem::Vector& from, double fallback, double* to, Eigen::Index size) noexcept {
    if (from.size() == 0)
        std::fill_n(to, size, fallback);
    else
        std::copy_n(from.data(), size, to);
}

/// Two numbers as a register holds them. Sums have several, as each addition waits for the one before it.
using Pair = double __attribute__((vector_size(16)));
Pair load(const double* from) noexcept {
    Pair pair;
    std::memcpy(&pair, from, sizeof pair);
    return pair;
}
void store(Pair pair, double* to) noexcept { std::memcpy(to, &pair, sizeof pair); }
double sum(Pair pair) noexcept { return pair[0] + pair[1]; }
/// The rows of the 2 × 2 matrix of these columns.
Pair first_of(Pair left, Pair right) noexcept { return __builtin_shufflevector(left, right, 0, 2); }
Pair second_of(Pair left, Pair right) noexcept { return __builtin_shufflevector(left, right, 1, 3); }

/// Copies the symmetric part of H, two rows and columns at a time; returns a sum of all that it wrote above
/// the diagonal, which is finite only if all entries are.
double copy_symmetric(const Problem::Matrix& from, Data::RowMajor& to) noexcept {
    const auto n = to.rows(), even = n - n % 2, stride = from.outerStride();
    Pair all{};
    for (Eigen::Index j = 0; j < even; j += 2)
        for (Eigen::Index i = 0; i <= j; i += 2) {
            const double *above = from.data() + i + j * stride, *below = from.data() + j + i * stride;
            const Pair left = load(above), right = load(above + stride);
            const Pair mean0 = 0.5 * (first_of(left, right) + load(below));
            const Pair mean1 = 0.5 * (second_of(left, right) + load(below + stride));
            all += mean0 + mean1;
            double *out = to.data() + i * n + j, *mirrored = to.data() + j * n + i;
            store(mean0, out);
            store(mean1, out + n);
            store(first_of(mean0, mean1), mirrored);
            store(second_of(mean0, mean1), mirrored + n);
        }
    double last = 0.0;
    for (Eigen::Index i = 0; even < n && i < n; ++i)
        last += to(even, i) = to(i, even) = 0.5 * (from(i, even) + from(even, i));
    return sum(all) + last;
}

/// Copies a column-major matrix into a row-major one, four columns at a time; returns a sum as above.
double copy_transposed(const Problem::Matrix& from, Data::RowMajor& to) noexcept {
    const auto rows = to.rows(), columns = to.cols(), stride = from.outerStride();
    Pair all[4] = {};
    double last = 0.0;
    const auto even = rows - rows % 2;
    Eigen::Index j = 0;
    for (; j + 4 <= columns; j += 4) {
        const double *a0 = from.data() + j * stride, *a1 = a0 + stride, *a2 = a1 + stride, *a3 = a2 + stride;
        double* row = to.data() + j;
        for (Eigen::Index i = 0; i < even; i += 2, row += 2 * columns) {
            const Pair c0 = load(a0 + i), c1 = load(a1 + i), c2 = load(a2 + i), c3 = load(a3 + i);
            store(first_of(c0, c1), row);
            store(first_of(c2, c3), row + 2);
            store(second_of(c0, c1), row + columns);
            store(second_of(c2, c3), row + columns + 2);
            all[0] += c0;
            all[1] += c1;
            all[2] += c2;
            all[3] += c3;
        }
        if (even < rows)
            for (const double* column : {a0, a1, a2, a3}) last += * row++ = column[even];
    }
    for (; j < columns; ++j)
        for (Eigen::Index i = 0; i < rows; ++i) last += to(i, j) = from(i, j);
    return sum((all[0] + all[1]) + (all[2] + all[3])) + last;
}

/// Does every pair of bounds leave a value between them? Not where one is NaN or both are the same infinity.
bool leave_values(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, Eigen::Index first,
                  double tolerance) noexcept {
    const Pair most{tolerance, tolerance};
    auto hold = most == most;
    for (; first + 2 <= lower.size(); first += 2) hold &= load(&lower[first]) - load(&upper[first]) <= most;
    return hold[0] && hold[1] && (first == lower.size() || lower[first] - upper[first] <= tolerance);
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
    check += g.sum();
    const bool was_bounded = bounded;
    bounded = p.lb.size() + p.ub.size() > 0;
    if (bounded || was_bounded) {
        copy_bound(p.lb, -infinity, lower.data(), n);
        copy_bound(p.ub, infinity, upper.data(), n);
    }
    const bool had_lower = has_lower_;
    has_lower_ = p.lbA.size() > 0;
    if (has_lower_ || had_lower) copy_bound(p.lbA, -infinity, lower.data() + n, m);
    copy_bound(p.ubA, infinity, upper.data() + n, m);

    const bool sound = std::isfinite(check) && leave_values(lower, upper, bounded ? 0 : n, tolerance);
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
