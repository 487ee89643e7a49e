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
            y[i] = q * std::round(u[pick(i, u.size())] / q);
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

/// y = F::apply(control, threshold) ? on : off; all inputs are given. A scalar control switches all elements.
template <class F> struct SwitchBy {
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class H, class A, class C, class B>
    constexpr void operator()(const Y& y, const H& threshold, const A& on, const C& control,
                              const B& off) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i) {
            const bool choice = F::apply(static_cast<double>(control[pick(i, control.size())]),
                                         static_cast<double>(threshold[pick(i, threshold.size())]));
            y[i] = choice ? static_cast<T>(on[pick(i, on.size())]) : static_cast<T>(off[pick(i, off.size())]);
        }
    }
};

/// y = control ≥ threshold ? on : off.
struct SwitchGreaterEqual : SwitchBy<SwitchGreaterEqual> {
    static constexpr const char* name = "bf::kernels::SwitchGreaterEqual{}";
    static constexpr bool apply(double control, double threshold) noexcept { return control >= threshold; }
};

/// y = control > threshold ? on : off.
struct SwitchGreater : SwitchBy<SwitchGreater> {
    static constexpr const char* name = "bf::kernels::SwitchGreater{}";
    static constexpr bool apply(double control, double threshold) noexcept { return control > threshold; }
};

/// y = control ≠ 0 ? on : off; the threshold is not looked at.
struct SwitchNotZero : SwitchBy<SwitchNotZero> {
    static constexpr const char* name = "bf::kernels::SwitchNotZero{}";
    static constexpr bool apply(double control, double) noexcept { return control != 0; }
};

/// y = u_k for the k whose index equals the scalar control without its fraction; the last operand if none
/// does.
struct MultiportSwitch {
    static constexpr const char* name = "bf::kernels::MultiportSwitch{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class C, class L>
    constexpr void operator()(const Y& y, const I& indices, const C& control, const L& u) const noexcept {
        const double wanted = std::trunc(static_cast<double>(control[0]));
        int k = 0;
        while (k < u.size() - 1 && static_cast<double>(indices[k]) != wanted) ++k;
        for (int i = 0; i < y.size(); ++i) y[i] = static_cast<Element<Y>>(u[k][pick(i, u[k].size())]);
    }
};

} // namespace bf::kernels
