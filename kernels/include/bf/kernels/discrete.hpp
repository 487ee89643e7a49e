#pragma once

#include "bf/kernels/elementwise.hpp"

/// Rules of discrete blocks, element by element on vectors. States are operands: a rule reads the present
/// ones and writes the next ones, or an output. A unit delay is `Copy` both ways; T is the period [s].
namespace bf::kernels {

/// y = clamp(x + K T u, lower, upper): an integral after u held for T.
struct Accumulate {
    static constexpr const char* name = "bf::kernels::Accumulate{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class K, class P, class L, class H, class X, class U>
    constexpr void operator()(const Y& y, const K& gain, const P& period, const L& lower, const H& upper,
                              const X& x, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i) {
            const T step = gain[pick(i, gain.size())] * static_cast<T>(period[0]);
            y[i] = clamp<T>(x[pick(i, x.size())] + step * u[pick(i, u.size())], lower[pick(i, lower.size())],
                            upper[pick(i, upper.size())]);
        }
    }
};

/// y = clamp(x + K T/2 u, lower, upper): half of the trapezoidal rule, with u from either end of T.
struct AccumulateHalf {
    static constexpr const char* name = "bf::kernels::AccumulateHalf{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class K, class P, class L, class H, class X, class U>
    constexpr void operator()(const Y& y, const K& gain, const P& period, const L& lower, const H& upper,
                              const X& x, const U& u) const noexcept {
        const Element<Y> half = static_cast<Element<Y>>(period[0]) / 2;
        Accumulate{}(y, gain, FixedView<const Element<Y>, 1>{&half}, lower, upper, x, u);
    }
};

/// y = u > 0 ≥ previous: a rising reset.
struct RisingEdge {
    static constexpr const char* name = "bf::kernels::RisingEdge{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U>
    constexpr void operator()(const Y& y, const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = u[i] > 0 && !(previous[i] > 0);
    }
};

/// y = u ≤ 0 < previous: a falling reset.
struct FallingEdge {
    static constexpr const char* name = "bf::kernels::FallingEdge{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U>
    constexpr void operator()(const Y& y, const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = !(u[i] > 0) && previous[i] > 0;
    }
};

/// y = a rising or a falling edge.
struct EitherEdge {
    static constexpr const char* name = "bf::kernels::EitherEdge{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U>
    constexpr void operator()(const Y& y, const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = (u[i] > 0) != (previous[i] > 0);
    }
};

/// y = u ≠ 0 or previous ≠ 0: a level reset holds while u is not 0 and on the step where it returns to 0.
struct LevelReset {
    static constexpr const char* name = "bf::kernels::LevelReset{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U>
    constexpr void operator()(const Y& y, const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = u[i] != 0 || previous[i] != 0;
    }
};

/// y = (u - previous) / T, or 0 where no time has passed: in the first run of a triggered subsystem.
struct Difference {
    static constexpr const char* name = "bf::kernels::Difference{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class P, class X, class U>
    constexpr void operator()(const Y& y, const P& period, const X& previous, const U& u) const noexcept {
        using T = Element<Y>;
        const T step = static_cast<T>(period[0]);
        for (int i = 0; i < y.size(); ++i)
            y[i] = step > T(0) ? (u[pick(i, u.size())] - previous[pick(i, previous.size())]) / step : T(0);
    }
};

/// Filter of order N = max(sizes of b, a) - 1 in direct form II transposed, on every element of u:
///
///          b₀ + b₁ z⁻¹ + …
///   H(z) = ───────────────      y = (b₀ u + s₁) / a₀,      s_i⁺ = b_i u - a_i y + s_{i+1}
///          a₀ + a₁ z⁻¹ + …
///
/// The state s is N × (number of elements), one column per element; a₀ ≠ 0, missing coefficients are 0.
/// Reference: Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed., §6.3.
struct FilterOutput {
    static constexpr const char* name = "bf::kernels::FilterOutput{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class B, class A, class S, class U>
    constexpr void operator()(const Y& y, const B& b, const A& a, const S& s, const U& u) const noexcept {
        for (int j = 0; j < y.size(); ++j) {
            const Element<Y> delayed = s.rows > 0 ? s(0, j) : Element<Y>(0);
            y[j] = (b[0] * u[j] + delayed) / a[0];
        }
    }
};

/// y_j = s_0j, the output of a filter with b₀ = 0 and a₀ = 1; 0 if it has no state.
struct FirstRow {
    static constexpr const char* name = "bf::kernels::FirstRow{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class S> constexpr void operator()(const Y& y, const S& s) const noexcept {
        for (int j = 0; j < y.size(); ++j) y[j] = s.rows > 0 ? s(0, j) : Element<Y>(0);
    }
};

namespace detail {
template <class V> constexpr Element<V> coefficient(const V& v, int i) noexcept {
    return i < v.size() ? v[i] : Element<V>(0);
}
} // namespace detail

/// Next state of the filter; `next` may be s.
struct FilterUpdate {
    static constexpr const char* name = "bf::kernels::FilterUpdate{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class N, class B, class A, class S, class Y, class U>
    constexpr void operator()(const N& next, const B& b, const A& a, const S& s, const Y& y,
                              const U& u) const noexcept {
        for (int j = 0; j < s.cols; ++j)
            for (int i = 0; i < s.rows; ++i) {
                const Element<N> later = i + 1 < s.rows ? s(i + 1, j) : Element<N>(0);
                next(i, j) =
                    detail::coefficient(b, i + 1) * u[j] - detail::coefficient(a, i + 1) * y[j] + later;
            }
    }
};

/// State of the filter after the inputs u and outputs y of the past, newest in row 0 (N × elements each; with
/// one row it stands for a constant past): s_i = Σ_{k ≥ i} b_k u_{k-i} - a_k y_{k-i}. Lets coefficients
/// change without a jump.
struct FilterState {
    static constexpr const char* name = "bf::kernels::FilterState{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class S, class B, class A, class Y, class U>
    constexpr void operator()(const S& s, const B& b, const A& a, const Y& past_y,
                              const U& past_u) const noexcept {
        for (int j = 0; j < s.cols; ++j)
            for (int i = 1; i <= s.rows; ++i) {
                Element<S> sum = 0;
                for (int k = i; k <= s.rows; ++k)
                    sum += detail::coefficient(b, k) * past_u(pick(k - i, past_u.rows), j) -
                           detail::coefficient(a, k) * past_y(pick(k - i, past_y.rows), j);
                s(i - 1, j) = sum;
            }
    }
};

/// State from which the filter goes on at the output y0. With a gain at frequency 0 (|Σb| > 1e-9) it has
/// rested at the input (Σa/Σb) y0; without, its past inputs are u0 and its past outputs a₀/(a₀ - Σa) y0, or
/// y0 where that is not defined.
struct FilterInitial {
    static constexpr const char* name = "bf::kernels::FilterInitial{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class S, class B, class A, class Y, class U>
    constexpr void operator()(const S& s, const B& b, const A& a, const Y& y0, const U& u0) const noexcept {
        using T = Element<S>;
        T sum_b = 0, sum_a = 0;
        for (int i = 0; i < b.size(); ++i) sum_b += b[i];
        for (int i = 0; i < a.size(); ++i) sum_a += a[i];
        const T rest = a[0] - sum_a;
        const bool has_gain = absolute(sum_b) > T(1e-9);
        for (int j = 0; j < s.cols; ++j) {
            const T y = y0[pick(j, y0.size())];
            const T u = has_gain ? sum_a / sum_b * y : u0[pick(j, u0.size())];
            const T past = has_gain || absolute(rest) <= T(1e-9) ? y : a[0] / rest * y;
            FilterState{}(View<T>{&s(0, j), s.rows}, b, a, FixedView<const T, 1>{&past},
                          FixedView<const T, 1>{&u});
        }
    }
};

/// Coefficients b₀ b₁ and a₀ a₁ of the low pass 1/(τ s + 1), τ = 1/(2π fc), by Tustin's rule: b = [T T],
/// a = [2τ + T, T - 2τ]. fc [Hz] and T [s] above 0.
struct LowPassCoefficients {
    static constexpr const char* name = "bf::kernels::LowPassCoefficients{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class B, class A, class F, class P>
    constexpr void operator()(const B& b, const A& a, const F& cutoff, const P& period) const noexcept {
        using T = Element<B>;
        const T tau = T(1) / (T(2) * pi<T> * cutoff[0]), step = period[0];
        b[0] = step;
        b[1] = step;
        a[0] = T(2) * tau + step;
        a[1] = step - T(2) * tau;
    }
};

/// Coefficients of third-order filters whose step response resembles a minimum-jerk trajectory that settles
/// in Ts: F(s) = -α/(s³ - γ s² - β s - α) with α = -150.765868956161/Ts³, β = -84.9812819469538/Ts², γ =
/// -15.9669610709384/Ts, by Tustin's rule. Four coefficients each: a is common, `position`, `velocity` and
/// `acceleration` are numerators. settling = Ts > 0 [s].
struct MinimumJerkCoefficients {
    static constexpr const char* name = "bf::kernels::MinimumJerkCoefficients{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class A, class X, class V, class W, class S, class P>
    constexpr void operator()(const A& a, const X& position, const V& velocity, const W& acceleration,
                              const S& settling, const P& period) const noexcept {
        using R = Element<A>;
        const R ts = settling[0], t = period[0];
        const R alpha = R(-150.765868956161) / (ts * ts * ts);
        const R beta = R(-84.9812819469538) / (ts * ts);
        const R gamma = R(-15.9669610709384) / ts;
        const R m = R(4) * gamma * t, n = R(2) * beta * t * t, p = alpha * t * t * t;
        a[0] = m + n + p - R(8);
        a[1] = -m + n + R(3) * p + R(24);
        a[2] = -m - n + R(3) * p - R(24);
        a[3] = m - n + p + R(8);
        constexpr int third[] = {1, 3, 3, 1}, second[] = {1, 1, -1, -1}, first[] = {1, -1, -1, 1};
        for (int i = 0; i < 4; ++i) {
            position[i] = p * static_cast<R>(third[i]);
            velocity[i] = R(2) * alpha * t * t * static_cast<R>(second[i]);
            acceleration[i] = R(4) * alpha * t * static_cast<R>(first[i]);
        }
    }
};

/// y = median of u and the samples before it, `past` (order - 1 rows, one column per element); of an even
/// order the mean of the two in the middle. A NaN counts as the largest. work: order.
struct MedianFilter {
    static constexpr const char* name = "bf::kernels::MedianFilter{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class S, class U, class W>
    constexpr void operator()(const Y& y, const S& past, const U& u, const W& work) const noexcept {
        using T = Element<Y>;
        const int order = past.rows + 1;
        for (int j = 0; j < y.size(); ++j) {
            for (int k = 0; k < order; ++k) { // insertion sort
                const T x = k == 0 ? u[j] : past(k - 1, j);
                int i = k;
                for (; i > 0 && (work[i - 1] > x || (work[i - 1] != work[i - 1] && x == x)); --i)
                    work[i] = work[i - 1];
                work[i] = x;
            }
            const T upper = work[order / 2];
            y[j] = order % 2 == 1 ? upper : (work[order / 2 - 1] + upper) / T(2);
        }
    }
};

/// next = past moved down by one row, with u in row 0: keeps the samples of a run, newest first. `next` may
/// be `past`.
struct Shift {
    static constexpr const char* name = "bf::kernels::Shift{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class N, class S, class U>
    constexpr void operator()(const N& next, const S& past, const U& u) const noexcept {
        for (int j = 0; j < next.cols && next.rows > 0; ++j) {
            for (int i = next.rows - 1; i > 0; --i) next(i, j) = past(i - 1, j);
            next(0, j) = u[j];
        }
    }
};

} // namespace bf::kernels
