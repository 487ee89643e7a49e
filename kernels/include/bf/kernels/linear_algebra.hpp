#pragma once

#include "bf/kernels/matrix.hpp"

#include <limits>

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

/// Factors of C columns at `depth` columns before them, b[k step + c next] d[k d_step], without the k where
/// all C of b are 0: of each k that is left, `live` of them, k itself and its C factors. Matrices of chains
/// and trees have zeros where one body does not carry another.
template <int C, class T>
constexpr int pack_factors(T* packed, const T* b, int step, int next, const T* d, int d_step,
                           int depth) noexcept {
    int live = 0;
    for (int k = 0; k < depth; ++k, b += step, d += d_step) {
        T* const entry = packed + live * (C + 1);
        entry[0] = static_cast<T>(k);
#pragma GCC unroll 4
        for (int c = 0; c < C; ++c) entry[1 + c] = b[c * next] * *d;
        live += !are_zero<C>(b, next);
    }
    return live;
}

/// R rows of C columns: y_c := (y_c - Σ_k a_k b_kc - Σ_{k < c} y_k corner_kc) corner_cc over packed factors b
/// in their order, a_k column k of a; without a corner the first difference alone. Columns of y are `next`
/// apart, those of a `step`. What is left stays in registers.
template <int R, int C, int most, class T>
constexpr void solve_tile(T* y, int next, const T* a, int step, const T* packed, int live,
                          const T* corner) noexcept {
    using Pack = Lanes<T, R, most>;
    constexpr int count = R / Pack::count;
    typename Pack::type left[C][count];
#pragma GCC unroll 4
    for (int c = 0; c < C; ++c)
#pragma GCC unroll 4
        for (int r = 0; r < count; ++r) Pack::load(left[c][r], y + c * next + r * Pack::count);
    for (int l = 0; l < live; ++l, packed += C + 1) {
        const T* const column = a + static_cast<int>(packed[0]) * step;
#pragma GCC unroll 4
        for (int r = 0; r < count; ++r) {
            typename Pack::type x;
            Pack::load(x, column + r * Pack::count);
#pragma GCC unroll 4
            for (int c = 0; c < C; ++c) left[c][r] = left[c][r] - x * packed[1 + c];
        }
    }
    if (corner != nullptr)
#pragma GCC unroll 4
        for (int c = 0; c < C; ++c)
#pragma GCC unroll 4
            for (int r = 0; r < count; ++r) {
#pragma GCC unroll 4
                for (int k = 0; k < c; ++k) left[c][r] = left[c][r] - left[k][r] * corner[k * C + c];
                left[c][r] = left[c][r] * corner[c * C + c];
            }
#pragma GCC unroll 4
    for (int c = 0; c < C; ++c)
#pragma GCC unroll 4
        for (int r = 0; r < count; ++r) Pack::store(y + c * next + r * Pack::count, left[c][r]);
}

/// The same for any number of rows, in tiles of at most Tall.
template <int Tall, int C, int most, class T>
constexpr void solve_rows(int rows, T* y, int next, const T* a, int step, const T* packed, int live,
                          const T* corner, int i = 0) noexcept {
    for (; i + Tall <= rows; i += Tall)
        solve_tile<Tall, C, most>(y + i, next, a + i, step, packed, live, corner);
    if constexpr (Tall > 1) solve_rows<Tall / 2, C, most>(rows, y, next, a, step, packed, live, corner, i);
}

/// z has a column for each row of a: m elements, those of bᵀ, then a. It becomes (U⁻¹ b)ᵀ and U D, a = U D Uᵀ
/// with 1 on the diagonal of U, and there 1 / D; here in the C columns j, j - 1, ..., where those behind are
/// there already. False when a pivot is not positive.
template <int C, int most, class T>
constexpr bool factor_columns(T* z, int m, int n, int j, T* packed) noexcept {
    const int height = m + n, above = m + j - C + 1;
    T *const y = z + j * height, *const last = z + (n - 1) * height;
    const int live =
        pack_factors<C>(packed, last + m + j, -height, -1, last + height - 1, -height - 1, n - 1 - j);
    solve_tile<C, C, most, T>(y + above, -height, last + above, -height, packed, live, nullptr);
    T corner[C * C];
    bool positive = true;
#pragma GCC unroll 4
    for (int c = 0; c < C; ++c) {
        T inverse = 1;
#pragma GCC unroll 4
        for (int r = c; r < C; ++r) {
            T& v = y[m + j - r - c * height];
#pragma GCC unroll 4
            for (int k = 0; k < c; ++k) v -= y[m + j - r - k * height] * corner[k * C + c];
            if (r == c) {
                const bool is_good = v > T(0) && v - v == T(0);
                positive = positive && is_good;
                v = inverse = is_good ? T(1) / v : std::numeric_limits<T>::quiet_NaN();
                corner[c * C + c] = T(1);
            } else {
                corner[c * C + r] = v * inverse;
            }
        }
    }
    solve_rows<(most > 32 ? 8 : 4), C, most, T>(above, y, -height, last, -height, packed, live, corner);
    return positive;
}

/// Then xᵀ = (U⁻ᵀ D⁻¹ U⁻¹ b)ᵀ, here in the C columns j, j + 1, ..., where those before are there already.
template <int C, int most, class T>
constexpr void solve_columns(T* z, int m, int n, int j, T* packed) noexcept {
    const int height = m + n;
    T *const y = z + j * height, *const v = y + m;
    T corner[C * C];
    for (int c = 0; c < C; ++c)
        for (int k = 0; k <= c; ++k) corner[k * C + c] = v[j + k + c * height];
    const T one = 1;
    const int live = pack_factors<C>(packed, v, 1, height, &one, 0, j);
    solve_rows<(most > 32 ? 8 : 4), C, most, T>(m, y, height, z, height, packed, live, corner);
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
        detail::transpose(lu.data, a.data, a.rows, a.cols);
        detail::transpose(z.data, b.data, b.rows, b.cols);
        const bool regular = detail::lu_solve(lu, z);
        detail::transpose(x.data, z.data, z.rows, z.cols);
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

/// x = a⁻¹ b for symmetric positive definite a = U D Uᵀ, U upper triangular with ones on its diagonal, D
/// diagonal; only the lower triangle of a is read; a is n × n. Zeros cost nothing where U keeps them: in the
/// mass matrix of a tree whose bodies stand behind their parents it keeps all (Featherstone 2008, §6.5).
/// False if a is not positive definite; x is then not finite. work: n² + n (m + 8) for b of n × m.
struct CholeskySolve {
    static constexpr const char* name = "bf::kernels::CholeskySolve{}";
    static constexpr bool chooses_registers = true;
    static constexpr char failure[] =
        "the matrix is not positive definite: use method lu, or look at what computes it";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class X, class A, class B, class W>
    constexpr bool operator()(const X& x, const A& a, const B& b, const W& work) const noexcept {
        return run_widest(*this, x, a, b, work);
    }
    template <int most, class X, class A, class B, class W>
    constexpr bool run(const X& x, const A& a, const B& b, const W& work) const noexcept {
        using T = Element<X>;
        const int n = a.rows, m = (b.cols + 3) / 4 * 4, height = m + n; // rows of zeros fill the last tile
        T *const z = work.data, *const packed = z + n * height;
        const int fours = n - n % 4;
        detail::transpose<most>(z, height, b.data, n, n, b.cols);
        for (int j = 0; j < n; ++j)
            for (int i = b.cols; i < m; ++i) z[i + j * height] = 0;
        // Tiles on the diagonal bring elements above it along, which nobody uses.
        for (int j = 0; j < fours; j += 4)
            detail::transpose<most>(z + m + j * height, height, a.data + j, n, 4, j + 4);
        detail::transpose<most>(z + m + fours * height, height, a.data + fours, n, n - fours, n);
        bool positive = true;
        for (int j = n - 1; j >= fours; --j)
            positive = detail::factor_columns<1, most>(z, m, n, j, packed) && positive;
        for (int j = fours - 1; j >= 0; j -= 4)
            positive = detail::factor_columns<4, most>(z, m, n, j, packed) && positive;
        for (int j = 0; j < fours; j += 4) detail::solve_columns<4, most>(z, m, n, j, packed);
        for (int j = fours; j < n; ++j) detail::solve_columns<1, most>(z, m, n, j, packed);
        detail::transpose<most>(x.data, n, z, height, b.cols, n);
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
            detail::transpose(z.data, a.data, a.rows, a.cols);
        for (int i = 0; i < gram.size(); ++i) gram[i] = 0;
        for (int k = 0; k < m; ++k)
            for (int j = 0; j < n; ++j) detail::add_scaled<T>(gram.data + j * n, z.data + k * n, z(j, k), n);
        for (int i = 0; i < n; ++i) gram(i, i) += static_cast<T>(sigma[0]);
        const bool regular = detail::lu_solve(gram, z);
        if (wide) detail::transpose(y.data, z.data, n, m);
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
