#pragma once

#include "bf/kernels/matrix.hpp"

/// Inverses and linear equations. Every kernel returns false when its matrix is singular (to working
/// precision where stated); the output then holds what IEEE arithmetic gives, infinities and NaN. `work`
/// needs at least the number of elements stated and shares no memory with the rest. Reference: Golub & Van
/// Loan, Matrix Computations, 4th ed., §3.4, §4.2, §5.4.
namespace bf::kernels {

namespace detail {

template <class A> constexpr void swap_rows(const A& a, int p, int q) noexcept {
    for (int j = 0; j < a.cols; ++j) {
        const Element<A> held = a(p, j);
        a(p, j) = a(q, j);
        a(q, j) = held;
    }
}

/// y = uᵀ for u of rows × cols.
template <class T> constexpr void transpose(T* y, const T* u, int rows, int cols) noexcept {
    for (int j = 0; j < cols; ++j)
        for (int i = 0; i < rows; ++i) y[j + i * cols] = u[i + j * rows];
}

/// b = a⁻¹ b by LU with partial pivoting; a becomes its factors.
template <class A, class B> constexpr bool lu_solve(const A& a, const B& b) noexcept {
    using T = Element<A>;
    const int n = a.rows;
    bool regular = true;
    for (int k = 0; k < n; ++k) {
        int p = k;
        for (int i = k + 1; i < n; ++i)
            if (absolute(a(i, k)) > absolute(a(p, k))) p = i;
        if (p != k) {
            swap_rows(a, k, p);
            swap_rows(b, k, p);
        }
        const T pivot = a(k, k);
        regular = regular && pivot != T(0) && pivot - pivot == T(0);
        const int below = n - k - 1;
        T* const factors = a.data + k + 1 + k * n;
        for (int i = 0; i < below; ++i) factors[i] /= pivot;
        for (int j = k + 1; j < n; ++j) add_scaled(a.data + k + 1 + j * n, factors, -a(k, j), below);
        for (int j = 0; j < b.cols; ++j) add_scaled(b.data + k + 1 + j * n, factors, -b(k, j), below);
    }
    for (int j = 0; j < b.cols; ++j)
        for (int k = n - 1; k >= 0; --k) {
            b(k, j) /= a(k, k);
            add_scaled(b.data + j * n, a.data + k * n, -b(k, j), k);
        }
    return regular;
}

/// C columns of y, R rows, behind `depth` columns of a that are solved already:
/// y_c := (y_c - Σ_{k < depth} a_k b_kc - Σ_{k < c} y_k b_{depth + k, c}) / b_{depth + c, c}, subtracted in
/// the order of k. Columns of a and y are `step` apart, b_kc lies at b[k b_step + c b_next]. The differences
/// stay in registers.
template <int R, int C, class T>
constexpr void solve_tile(T* y, const T* a, int step, const T* b, int b_step, int b_next,
                          int depth) noexcept {
    T left[C][R] = {};
    for (int c = 0; c < C; ++c)
        for (int r = 0; r < R; ++r) left[c][r] = y[r + c * step];
    for (int k = 0; k < depth; ++k, a += step, b += b_step)
        for (int c = 0; c < C; ++c)
            for (int r = 0; r < R; ++r) left[c][r] = left[c][r] - a[r] * b[c * b_next];
    for (int c = 0; c < C; ++c) {
        for (int k = 0; k < c; ++k)
            for (int r = 0; r < R; ++r) left[c][r] -= left[k][r] * b[k * b_step + c * b_next];
        for (int r = 0; r < R; ++r) left[c][r] /= b[c * b_step + c * b_next];
    }
    for (int c = 0; c < C; ++c)
        for (int r = 0; r < R; ++r) y[r + c * step] = left[c][r];
}

/// The same for any number of rows.
template <int C, class T>
constexpr void solve_rows(int rows, T* y, const T* a, int step, const T* b, int b_step, int b_next,
                          int depth) noexcept {
    int i = 0;
    for (; i + 8 <= rows; i += 8) solve_tile<8, C>(y + i, a + i, step, b, b_step, b_next, depth);
    if (i + 4 <= rows) {
        solve_tile<4, C>(y + i, a + i, step, b, b_step, b_next, depth);
        i += 4;
    }
    if (i + 2 <= rows) {
        solve_tile<2, C>(y + i, a + i, step, b, b_step, b_next, depth);
        i += 2;
    }
    if (i < rows) solve_tile<1, C>(y + i, a + i, step, b, b_step, b_next, depth);
}

/// C columns from column j on of (L; (L⁻¹ b)ᵀ), `height` rows, where those before are there already and these
/// hold (a; bᵀ). False when a pivot is not positive.
template <int C, class T> constexpr bool cholesky_columns(T* l, int height, int j) noexcept {
    T* const corner = l + j + j * height;
    bool positive = true;
    for (int c = 0; c < C; ++c)
        for (int r = c; r < C; ++r) {
            T left = corner[r + c * height];
            for (int k = 0; k < j + c; ++k) left -= l[j + r + k * height] * l[j + c + k * height];
            if (r == c) {
                positive = positive && left > T(0) && left - left == T(0);
                left = sqrt(left);
            } else {
                left /= corner[c + c * height];
            }
            corner[r + c * height] = left;
        }
    solve_rows<C>(height - j - C, corner + C, l + j + C, height, l + j, height, 1, j);
    return positive;
}

} // namespace detail

/// x = a \ b, the solution of a x = b, by LU with partial pivoting; a is n × n. work: n².
struct Solve {
    static constexpr const char* name = "bf::kernels::Solve{}";
    static constexpr char failure[] =
        "the matrix is singular to working precision: the equations have no unique solution";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class X, class A, class B, class W>
    constexpr bool operator()(const X& x, const A& a, const B& b, const W& work) const noexcept {
        const View<Element<X>> lu{work.data, a.rows, a.rows};
        for (int i = 0; i < a.size(); ++i) lu[i] = a[i];
        for (int i = 0; i < b.size(); ++i) x[i] = b[i];
        return detail::lu_solve(lu, x);
    }
};

/// x = b / a, the solution of x a = b, by LU of aᵀ with partial pivoting; a is n × n, b m × n. work: n² + m
/// n.
struct SolveRight {
    static constexpr const char* name = "bf::kernels::SolveRight{}";
    static constexpr char failure[] =
        "the matrix is singular to working precision: the equations have no unique solution";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class X, class B, class A, class W>
    constexpr bool operator()(const X& x, const B& b, const A& a, const W& work) const noexcept {
        using T = Element<X>;
        const View<T> lu{work.data, a.rows, a.rows}, z{work.data + a.size(), b.cols, b.rows};
        detail::transpose<T>(lu.data, a.data, a.rows, a.cols);
        detail::transpose<T>(z.data, b.data, b.rows, b.cols);
        const bool regular = detail::lu_solve(lu, z);
        detail::transpose<T>(x.data, z.data, z.rows, z.cols);
        return regular;
    }
};

/// y = a⁻¹ by LU with partial pivoting; a is n × n. work: n².
struct Inverse {
    static constexpr const char* name = "bf::kernels::Inverse{}";
    static constexpr char failure[] =
        "the matrix is singular to working precision and has no inverse; a PseudoInverse tolerates lost rank";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class A, class W>
    constexpr bool operator()(const Y& y, const A& a, const W& work) const noexcept {
        const View<Element<Y>> lu{work.data, a.rows, a.rows};
        for (int i = 0; i < a.size(); ++i) lu[i] = a[i];
        Identity{}(y);
        return detail::lu_solve(lu, y);
    }
};

/// x = a⁻¹ b for symmetric positive definite a = L Lᵀ, of which only the lower triangle is read; a is n × n.
/// False if a is not positive definite. work: n² + n m for b of n × m.
struct CholeskySolve {
    static constexpr const char* name = "bf::kernels::CholeskySolve{}";
    static constexpr char failure[] =
        "the matrix is not positive definite: use method lu, or look at what computes it";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class X, class A, class B, class W>
    constexpr bool operator()(const X& x, const A& a, const B& b, const W& work) const noexcept {
        using T = Element<X>;
        const int n = a.rows, m = b.cols, height = n + m;
        // (a; bᵀ) becomes (L; (L⁻¹ b)ᵀ), then (L; xᵀ): what is solved lies in columns, as L does.
        T *const l = work.data, *const z = l + n, *const last = z + (n - 1) * height;
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) l[i + j * height] = a[i + j * n];
            for (int i = 0; i < m; ++i) z[i + j * height] = b[j + i * n];
        }
        bool positive = true;
        int j = 0;
        for (; j + 2 <= n; j += 2) positive = detail::cholesky_columns<2>(l, height, j) && positive;
        if (j < n) positive = detail::cholesky_columns<1>(l, height, j) && positive;
        for (j = n - 1; j > 0; j -= 2)
            detail::solve_rows<2>(m, z + j * height, last, -height, l + n - 1 + j * height, -1, -height,
                                  n - 1 - j);
        if (j == 0) detail::solve_rows<1>(m, z, last, -height, l + n - 1, -1, -height, n - 1);
        for (int i = 0; i < m; ++i)
            for (j = 0; j < n; ++j) x[j + i * n] = z[i + j * height];
        return positive;
    }
};

/// Damped pseudo-inverse y = aᵀ (a aᵀ + σ I)⁻¹ = (aᵀ a + σ I)⁻¹ aᵀ of a, m × n. The form with the smaller
/// inverse is used, LU with partial pivoting; both agree for σ > 0, and for σ = 0 and full rank y is the
/// pseudo-inverse. work: k² + m n with k = min(m, n).
struct DampedPinv {
    static constexpr const char* name = "bf::kernels::DampedPinv{}";
    static constexpr char failure[] =
        "the damped matrix is not positive definite: raise the damping, or look at what computes the matrix";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class S, class A, class W>
    constexpr bool operator()(const Y& y, const S& sigma, const A& a, const W& work) const noexcept {
        using T = Element<Y>;
        const bool wide = a.rows <= a.cols;
        const int n = wide ? a.rows : a.cols, m = wide ? a.cols : a.rows;
        const View<T> gram{work.data, n, n};
        const View<T> z{wide ? work.data + n * n : y.data, n, m}; // a if wide, aᵀ if tall
        if (wide)
            for (int i = 0; i < a.size(); ++i) z[i] = a[i];
        else
            detail::transpose<T>(z.data, a.data, a.rows, a.cols);
        for (int i = 0; i < gram.size(); ++i) gram[i] = 0;
        for (int k = 0; k < m; ++k)
            for (int j = 0; j < n; ++j) detail::add_scaled<T>(gram.data + j * n, z.data + k * n, z(j, k), n);
        for (int i = 0; i < n; ++i) gram(i, i) += static_cast<T>(sigma[0]);
        const bool regular = detail::lu_solve(gram, z);
        if (wide) detail::transpose<T>(y.data, z.data, n, m);
        return regular;
    }
};

/// Of all x that make |a x - b| smallest that with the smallest |x|, for a of any shape m × n and each column
/// of b, m × p: complete orthogonal decomposition, Householder QR with column pivoting and, where columns are
/// left over, reflections from the right. Pivots not above max(m, n) ε |r₁₁| count as 0. False if a holds NaN
/// or infinities. work: m (n + p) + n. Reference: §5.4.7, §5.5.
struct LeastSquares {
    static constexpr const char* name = "bf::kernels::LeastSquares{}";
    static constexpr char failure[] =
        "the matrix holds NaN or infinity, or numbers whose squares are infinite: look at what computes it";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class X, class A, class B, class W>
    constexpr bool operator()(const X& x, const A& a, const B& b, const W& work) const noexcept {
        using T = Element<X>;
        const int m = a.rows, n = a.cols, p = b.cols, most = m < n ? m : n;
        const View<T> qr{work.data, m, n + p}; // columns of a, then of b
        T* const order = work.data + m * (n + p);
        for (int i = 0; i < a.size(); ++i) qr[i] = a[i];
        for (int i = 0; i < b.size(); ++i) qr[a.size() + i] = b[i];
        for (int j = 0; j < n; ++j) order[j] = static_cast<T>(j);

        int rank = 0;
        T smallest = 0;
        bool is_finite = true;
        for (int k = 0; k < most; ++k) {
            int pivot = k;
            T square = -1;
            for (int j = k; j < n; ++j) {
                T sum = 0;
                for (int i = k; i < m; ++i) sum += qr(i, j) * qr(i, j);
                is_finite = is_finite && sum - sum == T(0);
                if (sum > square) {
                    square = sum;
                    pivot = j;
                }
            }
            for (int i = 0; i < m && pivot != k; ++i) {
                const T held = qr(i, k);
                qr(i, k) = qr(i, pivot);
                qr(i, pivot) = held;
            }
            const T held = order[k];
            order[k] = order[pivot];
            order[pivot] = held;

            const T norm = sqrt(square);
            if (k == 0) smallest = static_cast<T>(m > n ? m : n) * std::numeric_limits<T>::epsilon() * norm;
            if (!(norm > smallest)) break;
            rank = k + 1;
            const T head = qr(k, k), r = head > T(0) ? -norm : norm;
            const T half = norm * (norm + absolute(head)); // vᵀv / 2 of the reflection I - v vᵀ / half
            qr(k, k) = head - r;
            for (int j = k + 1; j < n + p; ++j) {
                T sum = 0;
                for (int i = k; i < m; ++i) sum += qr(i, k) * qr(i, j);
                detail::add_scaled<T>(&qr(k, j), &qr(k, k), -(sum / half), m - k);
            }
            qr(k, k) = r;
        }
        // [R S] becomes [L 0], L upper triangular: from the last row on a reflection I - f v vᵀ turns row k
        // into its diagonal element. v is 1 at k and (k, rank ...) beyond, where it stays.
        const auto factor = [&](int k) {
            T sum = 1;
            for (int j = rank; j < n; ++j) sum += qr(k, j) * qr(k, j);
            return T(2) / sum;
        };
        for (int k = rank - 1; k >= 0 && rank < n; --k) {
            T sum = qr(k, k) * qr(k, k);
            for (int j = rank; j < n; ++j) sum += qr(k, j) * qr(k, j);
            const T norm = sqrt(sum), diagonal = qr(k, k) > T(0) ? -norm : norm;
            const T head = qr(k, k) - diagonal;
            for (int j = rank; j < n; ++j) qr(k, j) /= head;
            qr(k, k) = diagonal;
            const T f = factor(k);
            for (int i = 0; i < k; ++i) {
                T along = qr(i, k);
                for (int j = rank; j < n; ++j) along += qr(i, j) * qr(k, j);
                qr(i, k) -= f * along;
                for (int j = rank; j < n; ++j) qr(i, j) -= f * along * qr(k, j);
            }
        }
        for (int i = 0; i < x.size(); ++i) x[i] = 0;
        for (int j = 0; j < p; ++j) {
            T* const c = qr.data + (n + j) * m;
            const auto element = [&](int k) -> T& { return x(static_cast<int>(order[k]), j); };
            for (int k = rank - 1; k >= 0; --k) {
                c[k] /= qr(k, k);
                detail::add_scaled<T>(c, qr.data + k * m, -c[k], k);
                element(k) = c[k];
            }
            for (int k = 0; k < rank && rank < n; ++k) {
                T along = element(k);
                for (int i = rank; i < n; ++i) along += qr(k, i) * element(i);
                along *= factor(k);
                element(k) -= along;
                for (int i = rank; i < n; ++i) element(i) -= along * qr(k, i);
            }
        }
        return is_finite;
    }
};

} // namespace bf::kernels
