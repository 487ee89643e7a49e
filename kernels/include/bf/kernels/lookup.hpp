#pragma once

#include "bf/kernels/convert.hpp"

/// Tables of values over strictly increasing points. Computed in the type of the points; integer results are
/// rounded to the nearest and held within their type. A NaN among the inputs gives NaN.
namespace bf::kernels {

/// Value between two points: the lower one's, the nearer one's, on the straight line between them.
enum class Interpolation { flat, nearest, linear };

/// More dimensions than this would need 2^dimensions values at a time.
inline constexpr int most_table_dimensions = 6;

/// The k in 0 … n - 2 with x_k ≤ u < x_{k+1}, the first or last one beyond the ends; 0 for a single point or
/// NaN. `guess` is tried before bisection, whatever it holds.
template <class X> constexpr int interval(const X* x, int n, X u, int guess) noexcept {
    if (guess >= 0 && guess < n - 1 && u >= x[guess] && u < x[guess + 1]) return guess;
    int low = 0, high = n - 1; // x_low ≤ u < x_high, beyond the ends taken for granted
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (u >= x[middle])
            low = middle;
        else
            high = middle;
    }
    return low;
}

/// The part of the interval [x_k, x_{k+1}] at u: 0 at its begin, 1 at its end, held there by `clips`.
template <class X> constexpr X fraction(const X* x, int n, int k, X u, bool clips) noexcept {
    if (n < 2) return u == u ? X(0) : u;
    const X f = (u - x[k]) / (x[k + 1] - x[k]);
    return !clips || f != f ? f : clamp(f, X(0), X(1));
}

/// a for f = 0, b for f = 1, even when the other one is infinite.
template <class T> constexpr T between(T a, T b, T f) noexcept {
    return f == T(0) ? a : f == T(1) ? b : a + f * (b - a);
}

/// Table in d dimensions, one input in the list u for each: y_j = table at (u_0j, u_1j, …), from dimension to
/// dimension along straight lines. The elements of the table lie with the first dimension running fastest.
/// layout = [interpolation clips n_0 … n_{d-1} points_0 … points_{d-1}]. Beyond the ends the border's values
/// are held, or with clips = 0 its straight lines go on. guess: d integers, any content.
struct Lookup {
    static constexpr const char* name = "bf::kernels::Lookup{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class L, class V, class U, class G>
    void operator()(const Y& y, const L& layout, const V& table, const U& u, const G& guess) const noexcept {
        const auto how = static_cast<Interpolation>(static_cast<int>(layout[0]));
        const bool clips = layout[1] != 0 || how != Interpolation::linear;
        const int d = u.size();
        using R = Element<L>;
        for (int j = 0; j < y.size(); ++j) {
            R part[most_table_dimensions] = {}, value[1 << most_table_dimensions];
            int corner[1 << most_table_dimensions] = {}; // places in the table, doubled by each dimension
            int stride = 1, points = 2 + d;
            for (int i = 0; i < d; ++i) {
                const int n = static_cast<int>(layout[2 + i]);
                const R at = static_cast<R>(u[i][pick(j, u[i].size())]);
                const int k = interval(&layout[points], n, at, guess[i]);
                guess[i] = k;
                R f = fraction(&layout[points], n, k, at, clips);
                if (how == Interpolation::flat && f == f) f = f < 1 ? 0 : 1;
                if (how == Interpolation::nearest && f == f) f = f < R(0.5) ? 0 : 1;
                part[i] = f;
                for (int c = 0; c < 1 << i; ++c) {
                    corner[c] += k * stride;
                    corner[c + (1 << i)] = n > 1 ? corner[c] + stride : corner[c];
                }
                stride *= n;
                points += n;
            }
            for (int c = 0; c < 1 << d; ++c) value[c] = static_cast<R>(table[corner[c]]);
            // The last dimension first: its corners lie in the two halves.
            for (int i = d - 1; i >= 0; --i)
                for (int c = 0; c < 1 << i; ++c) value[c] = between(value[c], value[c + (1 << i)], part[i]);
            y[j] = converted<Element<Y>>(value[0], Rounding::nearest, Overflow::saturate);
        }
    }
};

/// Slopes at the points of the cubic spline through (x_k, v_k), twice continuously differentiable, whose
/// first and last two pieces are one polynomial each ("not a knot"); of two or three points the line or
/// parabola. work: n. Source: de Boor, A Practical Guide to Splines, rev. ed., ch. IV.
struct SplineSlopes {
    static constexpr const char* name = "bf::kernels::SplineSlopes{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class S, class X, class V, class W>
    constexpr void operator()(const S& slope, const X& x, const V& v, const W& work) const noexcept {
        const int n = x.size();
        using R = Element<X>;
        const auto h = [&](int i) { return x[i + 1] - x[i]; };
        const auto secant = [&](int i) { return (static_cast<R>(v[i + 1]) - static_cast<R>(v[i])) / h(i); };
        if (n < 3) {
            for (int i = 0; i < n; ++i) slope[i] = n == 2 ? secant(0) : R(0);
            return;
        }
        // Rows a s_{i-1} + b s_i + c s_{i+1} = r, eliminated from top to bottom; work holds c/b.
        for (int i = 0; i < n; ++i) {
            R a = 0, b = 1, c = 0, r = 0;
            if (i == 0 && n == 3) {
                c = 1;
                r = 2 * secant(0);
            } else if (i == 0) {
                b = h(1);
                c = h(0) + h(1);
                r = ((h(0) + 2 * c) * h(1) * secant(0) + h(0) * h(0) * secant(1)) / c;
            } else if (i < n - 1) {
                a = h(i);
                b = 2 * (h(i - 1) + h(i));
                c = h(i - 1);
                r = 3 * (h(i) * secant(i - 1) + h(i - 1) * secant(i));
            } else if (n == 3) {
                a = 1;
                r = 2 * secant(1);
            } else {
                a = h(n - 3) + h(n - 2);
                b = h(n - 3);
                r = (h(n - 2) * h(n - 2) * secant(n - 3) + (2 * a + h(n - 2)) * h(n - 3) * secant(n - 2)) / a;
            }
            const R pivot = i == 0 ? b : b - a * work[i - 1];
            work[i] = c / pivot;
            slope[i] = i == 0 ? r / pivot : (r - a * slope[i - 1]) / pivot;
        }
        for (int i = n - 2; i >= 0; --i) slope[i] -= work[i] * slope[i + 1];
    }
};

/// Slopes of the modified Akima interpolant: those of the neighbouring secants m, weighted by how little the
/// secants on the other side change, w = |m_{+1} - m| + |m_{+1} + m|/2. Less waviness than a spline; each
/// piece depends on six points. Source: Akima, J. ACM 17 (1970) 589-602, with the weights of MATLAB's makima.
struct AkimaSlopes {
    static constexpr const char* name = "bf::kernels::AkimaSlopes{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class S, class X, class V>
    constexpr void operator()(const S& slope, const X& x, const V& v) const noexcept {
        const int n = x.size();
        using R = Element<X>;
        const auto inner = [&](int i) {
            return (static_cast<R>(v[i + 1]) - static_cast<R>(v[i])) / (x[i + 1] - x[i]);
        };
        // Two secants beyond each end continue the last ones as a parabola does.
        const auto secant = [&](int i) {
            if (n == 2) return inner(0);
            if (i < 0) return inner(0) + R(i) * (inner(1) - inner(0));
            if (i > n - 2) return inner(n - 2) + R(i - n + 2) * (inner(n - 2) - inner(n - 3));
            return inner(i);
        };
        const auto weight = [](R a, R b) { return fabs(b - a) + fabs(b + a) / R(2); };
        for (int i = 0; i < n; ++i) {
            if (n == 1) {
                slope[i] = 0;
                continue;
            }
            const R left = secant(i - 1), right = secant(i);
            const R w_left = weight(right, secant(i + 1)), w_right = weight(secant(i - 2), left);
            slope[i] =
                w_left + w_right == R(0) ? R(0) : (w_left * left + w_right * right) / (w_left + w_right);
        }
    }
};

/// y_j = cubic through the points (x_k, v_k) with the given slopes, at u_j. Beyond the ends the end's value
/// is held, or with clips = 0 its straight line goes on. guess: one integer, any content.
struct Hermite {
    static constexpr const char* name = "bf::kernels::Hermite{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class C, class X, class V, class S, class U, class G>
    constexpr void operator()(const Y& y, const C& clips, const X& x, const V& v, const S& slope, const U& u,
                              const G& guess) const noexcept {
        using R = Element<X>;
        const int n = x.size();
        for (int j = 0; j < y.size(); ++j) {
            const R at = static_cast<R>(u[j]);
            const int k = interval(&x[0], n, at, guess[0]);
            guess[0] = k;
            const int end = n > 1 && at > x[n - 1] ? n - 1 : 0;
            R value = at; // NaN
            if (n > 1 && at >= x[0] && at <= x[n - 1]) {
                const R h = x[k + 1] - x[k], t = at - x[k], low = static_cast<R>(v[k]);
                const R secant = (static_cast<R>(v[k + 1]) - low) / h;
                const R c = (3 * secant - 2 * slope[k] - slope[k + 1]) / h;
                const R b = (slope[k] + slope[k + 1] - 2 * secant) / (h * h);
                value = low + t * (slope[k] + t * (c + t * b));
            } else if (at == at) {
                value = static_cast<R>(v[end]) + (clips[0] != 0 ? R(0) : slope[end] * (at - x[end]));
            }
            y[j] = static_cast<Element<Y>>(value);
        }
    }
};

/// k (from 0) and f of u_j among the points: x_k + f (x_{k+1} - x_k) = u_j, f held within 0 … 1 if clips ≠ 0.
/// The last point is k = n - 2, f = 1. guess: one integer, any content.
struct Prelookup {
    static constexpr const char* name = "bf::kernels::Prelookup{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class K, class F, class C, class X, class U, class G>
    constexpr void operator()(const K& k, const F& f, const C& clips, const X& x, const U& u,
                              const G& guess) const noexcept {
        for (int j = 0; j < k.size(); ++j) {
            const auto at = static_cast<Element<X>>(u[j]);
            guess[0] = interval(&x[0], x.size(), at, guess[0]);
            k[j] = static_cast<Element<K>>(guess[0]);
            f[j] = fraction(&x[0], x.size(), guess[0], at, clips[0] != 0);
        }
    }
};

/// Table in d dimensions at places that Prelookup found; the list is k_0 f_0 k_1 f_1 …, sizes the number of
/// points of each dimension. False when a place is outside; y is 0 there.
struct InterpolateAt {
    static constexpr const char* name = "bf::kernels::InterpolateAt{}";
    static constexpr char failure[] = "an index is outside the table: it must come from a Prelookup block "
                                      "with as many points as the table has";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class N, class V, class L>
    bool operator()(const Y& y, const N& sizes, const V& table, const L& places) const noexcept {
        using R = Element<N>;
        const int d = sizes.size();
        bool inside = true;
        for (int j = 0; j < y.size(); ++j) {
            R value[1 << most_table_dimensions];
            int corner[1 << most_table_dimensions] = {};
            int stride = 1;
            bool here = true;
            for (int i = 0; i < d; ++i) {
                const int n = static_cast<int>(sizes[i]);
                const R at = places[2 * i][pick(j, places[2 * i].size())];
                here = here && at >= 0 && at < (n > 1 ? n - 1 : 1);
                const int k = here ? static_cast<int>(at) : 0;
                for (int c = 0; c < 1 << i; ++c) {
                    corner[c] += k * stride;
                    corner[c + (1 << i)] = n > 1 ? corner[c] + stride : corner[c];
                }
                stride *= n;
            }
            for (int c = 0; c < 1 << d; ++c) value[c] = static_cast<R>(table[corner[c]]);
            for (int i = d - 1; i >= 0; --i)
                for (int c = 0; c < 1 << i; ++c)
                    value[c] = between<R>(value[c], value[c + (1 << i)],
                                          places[2 * i + 1][pick(j, places[2 * i + 1].size())]);
            y[j] = here ? static_cast<Element<Y>>(value[0]) : Element<Y>(0);
            inside = inside && here;
        }
        return inside;
    }
};

/// y_j = table(i_0j) or table(i_0j, i_1j), indices without their fraction and counted from 1, or from 0 if
/// options = [stops from_zero] says so. Outside, the nearest element; false if stops ≠ 0. NaN is outside.
struct ElementAt {
    static constexpr const char* name = "bf::kernels::ElementAt{}";
    static constexpr char failure[] = "an index is outside the table";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class O, class V, class L>
    constexpr bool operator()(const Y& y, const O& options, const V& table, const L& index) const noexcept {
        bool inside = true;
        for (int j = 0; j < y.size(); ++j) {
            int place = 0;
            for (int i = index.size() - 1; i >= 0; --i) {
                const int n = index.size() == 1 ? table.size() : i == 0 ? table.rows : table.cols;
                const auto at = detail::whole(index[i][pick(j, index[i].size())]) - (options[1] != 0 ? 0 : 1);
                inside = inside && at >= 0 && at < n;
                const int k = at >= n ? n - 1 : at >= 0 ? static_cast<int>(at) : 0;
                place = i == 0 ? place + k : k * table.rows;
            }
            y[j] = table[place];
        }
        return inside || options[0] == 0;
    }
};

} // namespace bf::kernels
