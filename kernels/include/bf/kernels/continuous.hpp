#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// Outputs and derivatives of continuous states, element by element.
namespace bf::kernels {

namespace detail {
/// Where a state that shows as y stays because u would lead further out: 1 at the upper limit, -1 at the
/// lower one, else 0.
template <class T> constexpr int held_side(T lower, T upper, T y, T u) noexcept {
    return y >= upper && u > 0 ? 1 : y <= lower && u < 0 ? -1 : 0;
}
} // namespace detail

/// Derivative u of a state that shows as y between lower and upper: 0 where u would lead further out.
struct LimitedRate {
    static constexpr const char* name = "bf::kernels::LimitedRate{}";
    template <class R, class L, class H, class Y, class U>
    constexpr void operator()(const R& rate, const L& lower, const H& upper, const Y& y,
                              const U& u) const noexcept {
        for (int i = 0; i < rate.size(); ++i) {
            const auto slope = u[pick(i, u.size())];
            const bool is_held = detail::held_side(lower[pick(i, lower.size())], upper[pick(i, upper.size())],
                                                   y[pick(i, y.size())], slope) != 0;
            rate[i] = is_held ? 0 : slope;
        }
    }
};

/// g tells at which limit a LimitedRate is 0: it changes where the state is stopped, and where it leaves.
/// Once an event has stopped it at `side`, u alone tells: a step that reaches beyond the moment at which it
/// leaves interpolates a y that is off the limit before that moment, too.
struct HeldSide {
    static constexpr const char* name = "bf::kernels::HeldSide{}";
    template <class G, class S, class L, class H, class Y, class U>
    constexpr void operator()(const G& g, const S& side, const L& lower, const H& upper, const Y& y,
                              const U& u) const noexcept {
        for (int i = 0; i < g.size(); ++i) {
            const auto low = lower[pick(i, lower.size())], high = upper[pick(i, upper.size())];
            const auto stopped = side[pick(i, side.size())];
            const auto at = stopped > 0 ? high : stopped < 0 ? low : y[pick(i, y.size())];
            g[i] = detail::held_side(low, high, at, u[pick(i, u.size())]);
        }
    }
};

/// y = 1 at the upper limit, -1 at the lower one, 0 between them.
struct LimitReached {
    static constexpr const char* name = "bf::kernels::LimitReached{}";
    template <class Y, class L, class H, class X>
    constexpr void operator()(const Y& y, const L& lower, const H& upper, const X& x) const noexcept {
        for (int i = 0; i < y.size(); ++i)
            y[i] = x[i] >= upper[pick(i, upper.size())] ? 1 : x[i] <= lower[pick(i, lower.size())] ? -1 : 0;
    }
};

/// y = (u - x) / τ: the derivative of a lag x of u, and of u itself after that lag.
struct Lag {
    static constexpr const char* name = "bf::kernels::Lag{}";
    template <class Y, class T, class X, class U>
    constexpr void operator()(const Y& y, const T& tau, const X& x, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i)
            y[i] = (u[pick(i, u.size())] - x[pick(i, x.size())]) / tau[pick(i, tau.size())];
    }
};

/// Controllable canonical form of Σ b_i sⁿ⁻ⁱ / Σ a_i sⁿ⁻ⁱ with a_0 = 1, one column of x per element of u:
/// y = Σ (b_i - a_i b_0) x_i + b_0 u. Source: Ogata, Modern Control Engineering, 5th ed., §9.2.
struct CompanionOutput {
    static constexpr const char* name = "bf::kernels::CompanionOutput{}";
    template <class Y, class B, class A, class X, class U>
    constexpr void operator()(const Y& y, const B& b, const A& a, const X& x, const U& u) const noexcept {
        for (int j = 0; j < y.size(); ++j) {
            Element<Y> sum = b[0] * u[pick(j, u.size())];
            for (int i = 0; i < x.rows; ++i) sum += (b[i + 1] - a[i + 1] * b[0]) * x(i, j);
            y[j] = sum;
        }
    }
};

/// Its derivative: x_1' = u - Σ a_i x_i, x_i' = x_{i-1}.
struct CompanionRate {
    static constexpr const char* name = "bf::kernels::CompanionRate{}";
    template <class R, class A, class X, class U>
    constexpr void operator()(const R& rate, const A& a, const X& x, const U& u) const noexcept {
        for (int j = 0; j < x.cols && x.rows > 0; ++j) {
            Element<R> first = u[pick(j, u.size())];
            for (int i = 0; i < x.rows; ++i) first -= a[i + 1] * x(i, j);
            for (int i = x.rows - 1; i > 0; --i) rate(i, j) = x(i - 1, j);
            rate(0, j) = first;
        }
    }
};

/// y = (u - u_before) / (t - t_before), or `last` before there was a step (started = 0) and at its time.
struct DifferenceQuotient {
    static constexpr const char* name = "bf::kernels::DifferenceQuotient{}";
    template <class Y, class S, class P, class X, class L, class T, class U>
    constexpr void operator()(const Y& y, const S& started, const P& t_before, const X& u_before,
                              const L& last, const T& t, const U& u) const noexcept {
        const auto length = t[0] - t_before[0];
        for (int i = 0; i < y.size(); ++i)
            y[i] = started[0] && length > 0 ? (u[i] - u_before[i]) / length : last[i];
    }
};

/// y = u(t - delay) from the samples of the past, between two samples on their line, after the newest one on
/// that of the last two; `initial` before the first sample. times and values (one row per sample) are rings,
/// of which `count` entries were written so far. False when the delay reaches beyond what the ring still
/// holds.
struct DelayedSample {
    static constexpr const char* name = "bf::kernels::DelayedSample{}";
    static constexpr char failure[] = "the delay is longer than the buffer holds: give 'buffer' more samples";
    template <class Y, class I, class D, class R, class V, class N, class T>
    constexpr bool operator()(const Y& y, const I& initial, const D& delay, const R& times, const V& values,
                              const N& count, const T& t) const noexcept {
        const unsigned capacity = static_cast<unsigned>(times.size());
        const unsigned held = count[0] < capacity ? count[0] : capacity, oldest = count[0] - held;
        const auto slot = [&](unsigned i) { return static_cast<int>((oldest + i) % capacity); };
        bool known = true;
        for (int j = 0; j < y.size(); ++j) {
            using S = Computed<D, T>;
            const S late = delay[pick(j, delay.size())], at = t[0] - (late > S(0) ? late : S(0));
            if (held == 0 || at < times[slot(0)]) {
                known = known && (held == 0 || oldest == 0);
                y[j] = initial[pick(j, initial.size())];
                continue;
            }
            unsigned low = 0, high = held; // times(low) <= at < times(high)
            while (high - low > 1) {
                const unsigned middle = low + (high - low) / 2;
                if (times[slot(middle)] <= at)
                    low = middle;
                else
                    high = middle;
            }
            if (low + 1 == held && held > 1) --low; // the line of the last two
            const int a = slot(low), b = slot(held > 1 ? low + 1 : low);
            const S part = a == b ? S(0) : (at - times[a]) / (times[b] - times[a]);
            y[j] = part == S(1) ? values(b, j) : values(a, j) + part * (values(b, j) - values(a, j));
        }
        return known;
    }
};

/// Next rings and count after the sample (t, u). A sample of the same time as the newest replaces it.
struct KeepSample {
    static constexpr const char* name = "bf::kernels::KeepSample{}";
    template <class R, class V, class N, class R0, class V0, class N0, class T, class U>
    constexpr void operator()(const R& times, const V& values, const N& count, const R0& old_times,
                              const V0& old_values, const N0& old_count, const T& t,
                              const U& u) const noexcept {
        for (int i = 0; i < times.size(); ++i) times[i] = old_times[i];
        for (int i = 0; i < values.size(); ++i) values[i] = old_values[i];
        const unsigned capacity = static_cast<unsigned>(times.size());
        const bool replaces =
            old_count[0] > 0 && old_times[static_cast<int>((old_count[0] - 1) % capacity)] >= t[0];
        const unsigned sample = replaces ? old_count[0] - 1 : old_count[0];
        const int row = static_cast<int>(sample % capacity);
        times[row] = t[0];
        for (int j = 0; j < values.cols; ++j) values(row, j) = u[j];
        count[0] = sample + 1;
    }
};

} // namespace bf::kernels
