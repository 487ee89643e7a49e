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

/// R × C elements of y -= a b, the products subtracted in the order of k: a_rk lies at a[r + k a_step], b_kc
/// at b[k b_step + c b_next]. The differences stay in registers.
template <int R, int C, class T>
constexpr void subtract_tile(T* y, int rows, const T* a, int a_step, const T* b, int b_step, int b_next,
                             int depth) noexcept {
    T left[C][R] = {};
    for (int c = 0; c < C; ++c)
        for (int r = 0; r < R; ++r) left[c][r] = y[r + c * rows];
    for (int k = 0; k < depth; ++k, a += a_step, b += b_step)
        for (int c = 0; c < C; ++c)
            for (int r = 0; r < R; ++r) left[c][r] -= a[r] * b[c * b_next];
    for (int c = 0; c < C; ++c)
        for (int r = 0; r < R; ++r) y[r + c * rows] = left[c][r];
}

/// C columns of L from column j on, where those before are there already; a is a symmetric matrix and becomes
/// L. False when a pivot is not positive.
template <int C, class T> constexpr bool cholesky_columns(T* a, int n, int j) noexcept {
    int i = j;
    for (; i + 4 <= n; i += 4) subtract_tile<4, C>(a + i + j * n, n, a + i, n, a + j, n, 1, j);
    for (; i < n; ++i) subtract_tile<1, C>(a + i + j * n, n, a + i, n, a + j, n, 1, j);
    bool positive = true;
    for (int k = j; k < j + C; ++k) {
        T* const column = a + k * n;
        positive = positive && column[k] > T(0) && column[k] - column[k] == T(0);
        column[k] = std::sqrt(column[k]);
        for (int r = k + 1; r < n; ++r) column[r] /= column[k];
        for (int c = k + 1; c < j + C; ++c) add_scaled(a + c + c * n, column + c, -column[c], n - c);
    }
    return positive;
}

/// R rows from row i on of C columns of L⁻¹ y, where those before are there already.
template <int R, int C, class T> constexpr void forward_rows(T* y, const T* l, int n, int i) noexcept {
    subtract_tile<R, C>(y + i, n, l + i, n, y, 1, n, i);
    for (int c = 0; c < C; ++c) {
        T* const x = y + i + c * n;
        for (int k = 0; k < R; ++k) {
            const T* const column = l + i + (i + k) * n;
            x[k] /= column[k];
            for (int r = k + 1; r < R; ++r) x[r] -= column[r] * x[k];
        }
    }
}

/// R rows from row i on of C columns of L⁻ᵀ y, where those behind are there already; Lᵀ lies above the
/// diagonal.
template <int R, int C, class T> constexpr void backward_rows(T* y, const T* l, int n, int i) noexcept {
    subtract_tile<R, C>(y + i, n, l + i + (n - 1) * n, -n, y + n - 1, -1, n, n - R - i);
    for (int c = 0; c < C; ++c) {
        T* const x = y + i + c * n;
        for (int k = R - 1; k >= 0; --k) {
            const T* const column = l + i + (i + k) * n;
            x[k] /= column[k];
            for (int r = 0; r < k; ++r) x[r] -= column[r] * x[k];
        }
    }
}

/// C columns of y := (L Lᵀ)⁻¹ y.
template <int C, class T> constexpr void substitute(T* y, const T* l, int n) noexcept {
    const int whole = n / 4 * 4;
    for (int i = 0; i < whole; i += 4) forward_rows<4, C>(y, l, n, i);
    for (int i = whole; i < n; ++i) forward_rows<1, C>(y, l, n, i);
    for (int i = n - 1; i >= whole; --i) backward_rows<1, C>(y, l, n, i);
    for (int i = whole - 4; i >= 0; i -= 4) backward_rows<4, C>(y, l, n, i);
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
/// False if a is not positive definite. work: n².
struct CholeskySolve {
    static constexpr const char* name = "bf::kernels::CholeskySolve{}";
    static constexpr char failure[] =
        "the matrix is not positive definite: use method lu, or look at what computes it";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class X, class A, class B, class W>
    constexpr bool operator()(const X& x, const A& a, const B& b, const W& work) const noexcept {
        using T = Element<X>;
        const int n = a.rows;
        T* const l = work.data; // L below, Lᵀ above the diagonal
        for (int i = 0; i < a.size(); ++i) l[i] = a[i];
        for (int i = 0; i < b.size(); ++i) x[i] = b[i];
        bool positive = true;
        int j = 0;
        for (; j + 2 <= n; j += 2) positive = detail::cholesky_columns<2>(l, n, j) && positive;
        if (j < n) positive = detail::cholesky_columns<1>(l, n, j) && positive;
        for (int k = 0; k < n; ++k)
            for (int i = k + 1; i < n; ++i) l[k + i * n] = l[i + k * n];
        for (j = 0; j + 4 <= b.cols; j += 4) detail::substitute<4>(x.data + j * n, l, n);
        for (; j < b.cols; ++j) detail::substitute<1>(x.data + j * n, l, n);
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

/// x = a \ b for a of any shape m × n: the least-squares solution with at most rank(a) nonzero rows, by
/// Householder QR with column pivoting. Pivots not above max(m, n) ε |r₁₁| count as 0; false when there is
/// one. b is m × p; work: m (n + p) + n.
struct LeastSquares {
    static constexpr const char* name = "bf::kernels::LeastSquares{}";
    static constexpr char failure[] = "the matrix has lost rank: the least-squares solution is not unique";
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
        for (int k = 0; k < most; ++k) {
            int pivot = k;
            T square = -1;
            for (int j = k; j < n; ++j) {
                T sum = 0;
                for (int i = k; i < m; ++i) sum += qr(i, j) * qr(i, j);
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

            const T norm = std::sqrt(square);
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
        for (int i = 0; i < x.size(); ++i) x[i] = 0;
        for (int j = 0; j < p; ++j) {
            T* const c = qr.data + (n + j) * m;
            for (int k = rank - 1; k >= 0; --k) {
                c[k] /= qr(k, k);
                detail::add_scaled<T>(c, qr.data + k * m, -c[k], k);
                x(static_cast<int>(order[k]), j) = c[k];
            }
        }
        return rank == most;
    }
};

} // namespace bf::kernels
