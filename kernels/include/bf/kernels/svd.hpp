#pragma once

#include "bf/kernels/linear_algebra.hpp"

namespace bf::kernels {

namespace detail {

/// Σ x_i y_i as four partial sums, which shortens the chain of additions.
template <class T> constexpr T dot(const T* x, const T* y, int n) noexcept {
    T sum[4] = {};
    int i = 0;
    for (; i + 4 <= n; i += 4)
        for (int r = 0; r < 4; ++r) sum[r] += x[i + r] * y[i + r];
    for (; i < n; ++i) sum[0] += x[i] * y[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/// [x y] = [x y] [c s; -s c].
template <class T> constexpr void rotate(T* __restrict x, T* __restrict y, T c, T s, int n) noexcept {
    for (int i = 0; i < n; ++i) {
        const T held = x[i];
        x[i] = c * held - s * y[i];
        y[i] = s * held + c * y[i];
    }
}

} // namespace detail

/// One-sided Jacobi: turns the columns of g (p × q, p ≥ q) orthogonal, g = g₀ v with v (q × q) orthogonal, so
/// that g₀ = Σ_k g_k v_kᵀ and the singular values, in no order, are |g_k|. False if 40 sweeps do not suffice,
/// which finite numbers do not need. Reference: Golub & Van Loan, Matrix Computations, 4th ed., §8.6.3.
template <class G, class V> constexpr bool orthogonalize(const G& g, const V& v) noexcept {
    using T = Element<G>;
    const int p = g.rows, q = g.cols;
    const T epsilon = std::numeric_limits<T>::epsilon(), small = epsilon * static_cast<T>(p);
    // Of a lost rank a column of rounding is left, which every turn makes shorter until no bits are left to
    // turn.
    const T nothing = epsilon * epsilon * sqrt(detail::dot(g.data, g.data, p * q));
    Identity{}(v);
    for (int sweep = 0; sweep < 40; ++sweep) {
        bool done = true;
        for (int i = 0; i < q - 1; ++i)
            for (int j = i + 1; j < q; ++j) {
                T *const x = g.data + i * p, *const y = g.data + j * p;
                const T xx = detail::dot(x, x, p), yy = detail::dot(y, y, p), xy = detail::dot(x, y, p);
                if (absolute(xy) <= small * (sqrt(xx) * sqrt(yy)) || sqrt(xx < yy ? xx : yy) <= nothing)
                    continue;
                done = false;
                const T zeta = (yy - xx) / (T(2) * xy);
                const T root = absolute(zeta) + sqrt(T(1) + zeta * zeta);
                const T t = zeta < T(0) ? T(-1) / root : T(1) / root;
                const T c = T(1) / sqrt(T(1) + t * t);
                detail::rotate(x, y, c, c * t, p);
                detail::rotate(v.data + i * q, v.data + j * q, c, c * t, q);
            }
        if (done) return true;
    }
    return false;
}

/// Truncated pseudo-inverse y = Σ v_k u_kᵀ / σ_k over the singular values σ_k > tolerance of a, m × n. A
/// negative tolerance stands for max(m, n) times the spacing of numbers at the largest σ. False if the
/// singular values were not found (a holds NaN or infinities). work: k² + m n with k = min(m, n).
struct TruncatedPinv {
    static constexpr const char* name = "bf::kernels::TruncatedPinv{}";
    static constexpr char failure[] =
        "the singular values do not converge: look for NaN or infinity in the matrix";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class S, class A, class W>
    constexpr bool operator()(const Y& y, const S& tolerance, const A& a, const W& work) const noexcept {
        using T = Element<Y>;
        const bool tall = a.rows >= a.cols;
        const int q = tall ? a.cols : a.rows, p = tall ? a.rows : a.cols;
        const View<T> v{work.data, q, q}, g{work.data + q * q, p, q}; // g = a if tall, else aᵀ
        if (tall)
            for (int i = 0; i < a.size(); ++i) g[i] = a[i];
        else
            detail::transpose(g.data, a.data, a.rows, a.cols);
        const bool found = orthogonalize(g, v);

        T limit = static_cast<T>(tolerance[0]), largest = 0;
        for (int k = 0; k < q; ++k)
            largest = maximum(largest, sqrt(detail::dot(g.data + k * p, g.data + k * p, p)));
        if (limit < T(0))
            limit = static_cast<T>(p) * (std::nextafter(largest, std::numeric_limits<T>::max()) - largest);
        for (int i = 0; i < y.size(); ++i) y[i] = 0;
        for (int k = 0; k < q; ++k) {
            const View<T> left{(tall ? v.data : g.data) + k * (tall ? q : p), tall ? q : p};
            const View<T> right{(tall ? g.data : v.data) + k * (tall ? p : q), tall ? p : q};
            const T sigma = sqrt(detail::dot(g.data + k * p, g.data + k * p, p));
            if (sigma <= limit) continue;
            for (int j = 0; j < right.rows; ++j)
                detail::add_scaled<T>(y.data + j * left.rows, left.data, right[j] / sigma / sigma, left.rows);
        }
        return found;
    }
};

} // namespace bf::kernels
