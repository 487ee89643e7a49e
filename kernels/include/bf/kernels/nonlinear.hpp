#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// Limits, steps and switches with memory, element by element; scalars expand.
namespace bf::kernels {

/// y = u held between lower and upper; NaN stays NaN.
struct Saturate {
    static constexpr const char* name = "bf::kernels::Saturate{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class L, class H, class U>
    constexpr void operator()(const Y& y, const L& lower, const H& upper, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i)
            y[i] = clamp(static_cast<T>(u[pick(i, u.size())]), static_cast<T>(lower[pick(i, lower.size())]),
                         static_cast<T>(upper[pick(i, upper.size())]));
    }
};

/// y = u - end above the zone, u - start below it, 0 between start and end.
struct DeadZone {
    static constexpr const char* name = "bf::kernels::DeadZone{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class S, class E, class U>
    constexpr void operator()(const Y& y, const S& start, const E& end, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i) {
            const T x = static_cast<T>(u[pick(i, u.size())]);
            const T low = static_cast<T>(start[pick(i, start.size())]);
            const T high = static_cast<T>(end[pick(i, end.size())]);
            y[i] = x > high ? subtract(x, high) : x < low ? subtract(x, low) : x == x ? T(0) : x;
        }
    }
};

/// y = q round(u/q), halves away from zero.
struct Quantize {
    static constexpr const char* name = "bf::kernels::Quantize{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class Q, class U>
    constexpr void operator()(const Y& y, const Q& interval, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const Element<Y> q = interval[pick(i, interval.size())];
            y[i] = q * round(u[pick(i, u.size())] / q);
        }
    }
};

/// y = u, moving from the previous output by at most rising·T up and falling·T down (falling ≤ 0, unit of u
/// per second; T = period [s]).
struct RateLimit {
    static constexpr const char* name = "bf::kernels::RateLimit{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class R, class F, class P, class X, class U>
    constexpr void operator()(const Y& y, const R& rising, const F& falling, const P& period,
                              const X& previous, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i) {
            const T x = previous[pick(i, previous.size())], step = static_cast<T>(period[0]);
            y[i] = clamp<T>(u[pick(i, u.size())], x + falling[pick(i, falling.size())] * step,
                            x + rising[pick(i, rising.size())] * step);
        }
    }
};

/// Mode of a relay: on from u ≥ on_point, off from u ≤ off_point, between them as before.
struct RelayMode {
    static constexpr const char* name = "bf::kernels::RelayMode{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class M, class A, class B, class X, class U>
    constexpr void operator()(const M& mode, const A& on_point, const B& off_point, const X& previous,
                              const U& u) const noexcept {
        for (int i = 0; i < mode.size(); ++i) {
            const auto x = u[pick(i, u.size())];
            mode[i] = x >= on_point[pick(i, on_point.size())]     ? true
                      : x <= off_point[pick(i, off_point.size())] ? false
                                                                  : previous[i] != 0;
        }
    }
};

/// The mode that shows: in continuous time (period 0) events alone change it once a step was taken
/// (started), so that it does not jump inside a solver's step; else what the input asks for.
struct ShownMode {
    static constexpr const char* name = "bf::kernels::ShownMode{}";
    template <class M, class P, class S, class X, class W>
    constexpr void operator()(const M& shown, const P& period, const S& started, const X& mode,
                              const W& wanted) const noexcept {
        const bool is_frozen = period[0] == 0 && started[0] != 0;
        for (int i = 0; i < shown.size(); ++i) shown[i] = is_frozen ? mode[i] : wanted[i];
    }
};

/// y = choice ? on : off; both are given. A scalar choice switches all elements.
struct Choose {
    static constexpr const char* name = "bf::kernels::Choose{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class A, class C, class B>
    constexpr void operator()(const Y& y, const A& on, const C& choice, const B& off) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i)
            y[i] = choice[pick(i, choice.size())] != 0 ? static_cast<T>(on[pick(i, on.size())])
                                                       : static_cast<T>(off[pick(i, off.size())]);
    }
};

/// y = u_k for the k whose index equals the scalar control without its fraction; the last operand if none
/// does.
struct MultiportSwitch {
    static constexpr const char* name = "bf::kernels::MultiportSwitch{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class C, class L>
    constexpr void operator()(const Y& y, const I& indices, const C& control, const L& u) const noexcept {
        const auto wanted = static_cast<Element<I>>(detail::whole(control[0]));
        int k = 0;
        while (k < u.size() - 1 && indices[k] != wanted) ++k;
        for (int i = 0; i < y.size(); ++i) y[i] = static_cast<Element<Y>>(u[k][pick(i, u[k].size())]);
    }
};

/// y follows u through a play: previous output, moved only as far as |u - y| ≤ width/2 asks.
struct Backlash {
    static constexpr const char* name = "bf::kernels::Backlash{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class W, class X, class U>
    constexpr void operator()(const Y& y, const W& width, const X& previous, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i) {
            const T half = width[pick(i, width.size())] / T(2), x = u[pick(i, u.size())];
            y[i] = clamp<T>(previous[pick(i, previous.size())], x - half, x + half);
        }
    }
};

/// y = sign(u) (viscous |u| + coulomb): friction that jumps at u = 0.
struct Friction {
    static constexpr const char* name = "bf::kernels::Friction{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class C, class V, class U>
    constexpr void operator()(const Y& y, const C& coulomb, const V& viscous, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i) {
            const T x = u[pick(i, u.size())], jump = coulomb[pick(i, coulomb.size())];
            y[i] = viscous[pick(i, viscous.size())] * x + (x > T(0) ? jump : x < T(0) ? -jump : T(0));
        }
    }
};

/// y = u up to the threshold, 0 above it.
struct WrapToZero {
    static constexpr const char* name = "bf::kernels::WrapToZero{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class H, class U>
    constexpr void operator()(const Y& y, const H& threshold, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i) {
            const T x = u[pick(i, u.size())];
            y[i] = x > threshold[pick(i, threshold.size())] ? T(0) : x;
        }
    }
};

/// y = u reached or passed the level since the step before, whose u is given: from below if direction > 0,
/// from above if direction < 0, either way for 0. Never in the first step (started = 0).
struct HitCrossing {
    static constexpr const char* name = "bf::kernels::HitCrossing{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class D, class L, class S, class X, class U>
    constexpr void operator()(const Y& y, const D& direction, const L& levels, const S& started,
                              const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const auto level = levels[pick(i, levels.size())];
            const auto before = previous[pick(i, previous.size())], now = u[pick(i, u.size())];
            const bool rises = before < level && now >= level, falls = before > level && now <= level;
            y[i] = started[0] != 0 && ((rises && direction[0] >= 0) || (falls && direction[0] <= 0));
        }
    }
};

} // namespace bf::kernels
