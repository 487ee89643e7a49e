#pragma once

#include "bf/kernels/functions.hpp"

/// Signals as functions of the time t [s], a scalar operand; parameters expand. Computed in the type of t and
/// the parameters.
namespace bf::kernels {

/// y = before for t < step_time, after from there on.
struct Step {
    static constexpr const char* name = "bf::kernels::Step{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class S, class B, class A, class T>
    constexpr void operator()(const Y& y, const S& step_time, const B& before, const A& after,
                              const T& t) const noexcept {
        for (int i = 0; i < y.size(); ++i)
            y[i] = t[0] < step_time[pick(i, step_time.size())] ? before[pick(i, before.size())]
                                                               : after[pick(i, after.size())];
    }
};

/// y = initial + slope · max(t - start, 0).
struct Ramp {
    static constexpr const char* name = "bf::kernels::Ramp{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class S, class B, class I, class T>
    constexpr void operator()(const Y& y, const S& slope, const B& start, const I& initial,
                              const T& t) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            using R = Computed<S, T>;
            const R since = maximum<R>(t[0] - start[pick(i, start.size())], 0);
            y[i] = static_cast<Element<Y>>(initial[pick(i, initial.size())] +
                                           slope[pick(i, slope.size())] * since);
        }
    }
};

/// y = amplitude · sin(frequency · t + phase) + bias; frequency [rad/s], phase [rad].
struct SineWave {
    static constexpr const char* name = "bf::kernels::SineWave{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class A, class F, class P, class B, class T>
    void operator()(const Y& y, const A& amplitude, const F& frequency, const P& phase, const B& bias,
                    const T& t) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const auto angle = frequency[pick(i, frequency.size())] * t[0] + phase[pick(i, phase.size())];
            y[i] = static_cast<Element<Y>>(amplitude[pick(i, amplitude.size())] * Sin::apply(angle) +
                                           bias[pick(i, bias.size())]);
        }
    }
};

namespace detail {
/// What is left of x after whole cycles. k · step is seldom n · cycle exactly, so an x less than `slack`
/// before the end of a cycle counts as the beginning of the next one.
template <class T> T within(T x, T cycle, T slack) noexcept { return x - floor((x + slack) / cycle) * cycle; }
/// More than rounding makes of a time and of what it was computed from.
template <class T> constexpr T rounding(T a, T b = 0) noexcept {
    return 4 * std::numeric_limits<T>::epsilon() * (absolute(a) + absolute(b));
}
template <class T> bool is_high(T t, T period, T width, T delay) noexcept {
    const T since = t - delay, slack = rounding(t, delay);
    return since >= -slack && within(since, period, slack) < period * (width / 100) - slack;
}
} // namespace detail

/// y = amplitude during the first `width` percent of every period [s] after the delay [s], else 0.
struct Pulse {
    static constexpr const char* name = "bf::kernels::Pulse{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class A, class P, class W, class D, class T>
    void operator()(const Y& y, const A& amplitude, const P& period, const W& width, const D& delay,
                    const T& t) const noexcept {
        for (int i = 0; i < y.size(); ++i)
            y[i] = detail::is_high(t[0], period[pick(i, period.size())], width[pick(i, width.size())],
                                   delay[pick(i, delay.size())])
                       ? static_cast<Element<Y>>(amplitude[pick(i, amplitude.size())])
                       : Element<Y>(0);
    }
};

/// g counts the edges of a pulse: odd while it is high.
struct PulseEdges {
    static constexpr const char* name = "bf::kernels::PulseEdges{}";
    template <class G, class P, class W, class D, class T>
    void operator()(const G& g, const P& period, const W& width, const D& delay, const T& t) const noexcept {
        for (int i = 0; i < g.size(); ++i) {
            const auto cycle = period[pick(i, period.size())], late = delay[pick(i, delay.size())];
            const auto since = t[0] - late, slack = detail::rounding(t[0], late);
            const auto before = since < -slack ? -1 : floor((since + slack) / cycle);
            const bool high = detail::is_high(t[0], cycle, width[pick(i, width.size())], late);
            g[i] = detail::counted(2 * before + (high ? 1 : 2));
        }
    }
};

/// y = sin(2π (f₀ t + (f₁ - f₀) t² / (2 T))): the frequency [Hz] grows from f₀ and reaches f₁ at T = target
/// [s].
struct Chirp {
    static constexpr const char* name = "bf::kernels::Chirp{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class A, class B, class C, class T>
    void operator()(const Y& y, const A& f0, const B& f1, const C& target, const T& t) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            using R = Computed<A, B, C, T>;
            const R f = f0[pick(i, f0.size())], rise = f1[pick(i, f1.size())] - f;
            const R turns = f * t[0] + rise * t[0] * t[0] / (2 * target[pick(i, target.size())]);
            y[i] = static_cast<Element<Y>>(Sin::apply(2 * pi<R> * turns));
        }
    }
};

/// Piecewise linear table: y_j = value at u_j between the points (x_k, v_k), x increasing; beyond the ends
/// the first or last value is held. At least one point; a NaN gives NaN.
struct Interpolate {
    static constexpr const char* name = "bf::kernels::Interpolate{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class X, class V, class U>
    constexpr void operator()(const Y& y, const X& x, const V& v, const U& u) const noexcept {
        using R = Element<Y>;
        const int last = x.size() - 1;
        for (int j = 0; j < y.size(); ++j) {
            const auto at = u[pick(j, u.size())];
            int k = 0;
            while (k < last - 1 && at >= x[k + 1]) ++k;
            if (at <= x[0])
                y[j] = v[0];
            else if (at >= x[last])
                y[j] = v[last];
            else if (last == 0)
                y[j] = at; // NaN
            else
                y[j] = static_cast<R>(v[k] + (v[k + 1] - v[k]) * ((at - x[k]) / (x[k + 1] - x[k])));
        }
    }
};

enum class Waveform { sine, square, sawtooth, triangle };

/// Periodic wave between -amplitude and amplitude. With p = frequency t [turns] less its whole part: sin 2πp;
/// 1 in the first half, then -1; 2p - 1; 4p - 1 up to p = 1/2, then 3 - 4p. waveform is the enumeration as a
/// number, frequency in Hz.
struct Wave {
    static constexpr const char* name = "bf::kernels::Wave{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class W, class A, class F, class T>
    void operator()(const Y& y, const W& waveform, const A& amplitude, const F& frequency,
                    const T& t) const noexcept {
        const auto shape = static_cast<Waveform>(static_cast<int>(waveform[0]));
        for (int i = 0; i < y.size(); ++i) {
            using R = Computed<F, T>;
            const R turns = frequency[pick(i, frequency.size())] * t[0], slack = detail::rounding(turns),
                    p = maximum(detail::within(turns, R(1), slack), R(0));
            const R value = shape == Waveform::sine       ? Sin::apply(2 * pi<R> * p)
                            : shape == Waveform::square   ? R(p < R(0.5) - slack ? 1 : -1)
                            : shape == Waveform::sawtooth ? 2 * p - 1
                            : p < R(0.5)                  ? 4 * p - 1
                                                          : 3 - 4 * p;
            y[i] = static_cast<Element<Y>>(amplitude[pick(i, amplitude.size())] * value);
        }
    }
};

/// g counts the jumps and corners of a wave.
struct WaveEdges {
    static constexpr const char* name = "bf::kernels::WaveEdges{}";
    template <class G, class W, class F, class T>
    void operator()(const G& g, const W& waveform, const F& frequency, const T& t) const noexcept {
        const auto shape = static_cast<Waveform>(static_cast<int>(waveform[0]));
        const int per_turn = shape == Waveform::sine ? 0 : shape == Waveform::sawtooth ? 1 : 2;
        for (int i = 0; i < g.size(); ++i) {
            const auto turns = frequency[pick(i, frequency.size())] * t[0];
            g[i] = detail::counted(floor(per_turn * (turns + detail::rounding(turns))));
        }
    }
};

/// t brought into one cycle: first + mod(t - first, last - first), of the points' first and last time.
struct WithinCycle {
    static constexpr const char* name = "bf::kernels::WithinCycle{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class X, class T>
    void operator()(const Y& y, const X& points, const T& t) const noexcept {
        const Computed<X, T> first = points[0], last = points[points.size() - 1];
        y[0] =
            maximum(first, first + detail::within(t[0] - first, last - first, detail::rounding(t[0], first)));
    }
};

/// g counts the points that t has passed, cycle after cycle.
struct CycleEdges {
    static constexpr const char* name = "bf::kernels::CycleEdges{}";
    template <class G, class X, class T>
    void operator()(const G& g, const X& points, const T& t) const noexcept {
        const int last = points.size() - 1;
        const auto since = t[0] - points[0], cycle = points[last] - points[0];
        Computed<X, T> at = 0;
        WithinCycle{}(FixedView<Computed<X, T>, 1>{&at}, points, t);
        int k = 0;
        while (k < last - 1 && at >= points[k + 1]) ++k;
        g[0] = detail::counted(floor((since + detail::rounding(t[0], points[0])) / cycle) * last + k);
    }
};

/// y = u + 1, or 0 instead of what exceeds the limit.
struct CountUp {
    static constexpr const char* name = "bf::kernels::CountUp{}";
    template <class Y, class L, class U>
    constexpr void operator()(const Y& y, const L& limit, const U& u) const noexcept {
        y[0] = u[0] >= limit[0] ? Element<Y>(0) : add(u[0], Element<U>(1));
    }
};

/// y = u_k, k counted from 0; the last element beyond the end.
struct ElementOf {
    static constexpr const char* name = "bf::kernels::ElementOf{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U, class K>
    constexpr void operator()(const Y& y, const U& u, const K& k) const noexcept {
        const auto last = static_cast<Element<K>>(u.size() - 1);
        y[0] = u[static_cast<int>(k[0] < last ? k[0] : last)];
    }
};

/// y = k + 1, or 0 after the last element of u.
struct CountAlong {
    static constexpr const char* name = "bf::kernels::CountAlong{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U, class K>
    constexpr void operator()(const Y& y, const U& u, const K& k) const noexcept {
        const auto last = static_cast<Element<K>>(u.size() - 1);
        y[0] = k[0] >= last ? Element<Y>(0) : static_cast<Element<Y>>(k[0] + 1);
    }
};

} // namespace bf::kernels
