#pragma once

#include "bf/kernels/view.hpp"

/// What states become where zero-crossing functions cross: their element is 1 where one rose through 0, -1
/// where it fell, else 0. States that nothing is said of keep their value x.
namespace bf::kernels {

/// y = upper - base above the upper limit, lower - base below the lower one: where a state that shows as x +
/// base stops. `above` and `below` are the crossings of its distances from both.
struct StoppedState {
    static constexpr const char* name = "bf::kernels::StoppedState{}";
    template <class Y, class A, class B, class L, class H, class Z, class X>
    constexpr void operator()(const Y& y, const A& above, const B& below, const L& lower, const H& upper,
                              const Z& base, const X& x) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const auto from = base[pick(i, base.size())];
            if (above[pick(i, above.size())] > 0)
                y[i] = upper[pick(i, upper.size())] - from;
            else if (below[pick(i, below.size())] < 0)
                y[i] = lower[pick(i, lower.size())] - from;
            else
                y[i] = x[pick(i, x.size())];
        }
    }
};

/// y = 1 where it stops at the upper limit, -1 at the lower one.
struct StoppedSide {
    static constexpr const char* name = "bf::kernels::StoppedSide{}";
    template <class Y, class A, class B, class X>
    constexpr void operator()(const Y& y, const A& above, const B& below, const X& x) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            if (above[pick(i, above.size())] > 0)
                y[i] = 1;
            else if (below[pick(i, below.size())] < 0)
                y[i] = -1;
            else
                y[i] = x[pick(i, x.size())];
        }
    }
};

/// y = value where the signal of `edge` crosses: [1] rising, [-1] falling, [0] either way.
struct BegunState {
    static constexpr const char* name = "bf::kernels::BegunState{}";
    template <class Y, class E, class G, class V, class X>
    constexpr void operator()(const Y& y, const E& edge, const G& crossing, const V& value,
                              const X& x) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const auto g = crossing[pick(i, crossing.size())];
            const bool begins = edge[0] > 0 ? g > 0 : edge[0] < 0 ? g < 0 : g != 0;
            if (begins)
                y[i] = static_cast<Element<Y>>(value[pick(i, value.size())]);
            else
                y[i] = x[pick(i, x.size())];
        }
    }
};

/// y = on where `at_on` rises, off where `at_off` falls.
struct SwitchedMode {
    static constexpr const char* name = "bf::kernels::SwitchedMode{}";
    template <class Y, class N, class F, class X>
    constexpr void operator()(const Y& y, const N& at_on, const F& at_off, const X& x) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            if (at_off[pick(i, at_off.size())] < 0)
                y[i] = 0;
            else if (at_on[pick(i, at_on.size())] > 0)
                y[i] = 1;
            else
                y[i] = x[pick(i, x.size())];
        }
    }
};

} // namespace bf::kernels
