#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

namespace bf::kernels {

enum class AntiWindup { none, back_calculation, clamping };

namespace detail {
/// One element of a Pid: `side` is 1 where v is above the upper limit, -1 below the lower one, else 0.
template <class Number> struct PidElement {
    Number y, slope_i, slope_d;
    int side;
    bool stops; ///< the integral, by clamping
};
template <class O, class P, class I, class D, class N, class B, class C, class K, class L, class H, class T,
          class XI, class XD, class R, class M, class A>
constexpr auto pid_element(int k, const O& options, const P& p, const I& i, const D& d, const N& bandwidth,
                           const B& b, const C& c, const K& tracking_time, const L& lower, const H& upper,
                           const T& period, const XI& x_i, const XD& x_d, const R& r, const M& m,
                           const A& tracked) noexcept {
    using Number = Computed<XI, R, M>;
    const auto anti_windup = static_cast<AntiWindup>(static_cast<int>(options[0]));
    const auto at = [k](const auto& v) { return v[pick(k, v.size())]; };
    const Number set = at(r), is = at(m), n = at(bandwidth);
    const Number drive = at(i) * (set - is);
    // q = N (D (c r - m) - x_d - θ T q), solved for q
    const Number q = n * (at(d) * (at(c) * set - is) - at(x_d)) / (1 + options[3] * period[0] * n);
    const Number w = at(x_i) + options[2] * period[0] * drive;
    const Number v = at(p) * (at(b) * set - is) + w + q;
    const Number low = at(lower), high = at(upper), limited = clamp(v, low, high);
    const int side = v > high ? 1 : v < low ? -1 : 0;
    const bool stops = anti_windup == AntiWindup::clamping && static_cast<Number>(side) * drive > 0;
    Number slope = drive;
    if (anti_windup == AntiWindup::back_calculation) slope += (limited - v) / at(tracking_time);
    if (stops) slope = 0;
    if (options[1] != 0) slope += (at(tracked) - limited) / at(tracking_time);
    return PidElement<Number>{limited, slope, q, side, stops};
}
} // namespace detail

/// PID controller of the setpoint r and the measurement m, element by element:
///
///   e = r - m,   q = N (D (c r - m) - z),   v = P (b r - m) + w + q,   y = clamp(v, lower, upper)
///
/// where w integrates `slope_i` = I e + anti-windup + (tracked - y)/T_t, and z integrates `slope_d` = q.
/// options = [anti_windup has_tracking θ_i θ_d]: the states x_i, x_d are w, z as far as they are known before
/// this step, w = x_i + θ_i T I e and z = x_d + θ_d T q, with T = period [s]: θ is 0 in continuous time and
/// for forward Euler, 1/2 for the trapezoidal rule, 1 for backward Euler. The filter stands still while D is
/// 0; by forward Euler it is stable for N T < 2. Anti-windup acts on the slope
/// alone: (y - v)/T_t by back-calculation, or I e stops while it drives v further beyond a limit. Source:
/// Åström, Hägglund, Advanced PID Control, §3.5 (limits) and §13.4 (discretisation).
struct Pid {
    static constexpr const char* name = "bf::kernels::Pid{}";
    template <class Y, class SI, class SD, class... Operands>
    constexpr void operator()(const Y& y, const SI& slope_i, const SD& slope_d,
                              const Operands&... operands) const noexcept {
        for (int k = 0; k < y.size(); ++k) {
            const auto element = detail::pid_element(k, operands...);
            y[k] = element.y;
            slope_i[k] = element.slope_i;
            slope_d[k] = element.slope_d;
        }
    }
};

/// g tells for each element of a Pid at which limit it is, and whether its integral stands still: it changes
/// where y or a slope has a corner or jumps.
struct PidBranch {
    static constexpr const char* name = "bf::kernels::PidBranch{}";
    template <class G, class... Operands>
    constexpr void operator()(const G& g, const Operands&... operands) const noexcept {
        for (int k = 0; k < g.size(); ++k) {
            const auto element = detail::pid_element(k, operands...);
            g[k] = 2 * element.side + element.stops;
        }
    }
};

/// y = x + part T slope: the integral after the slope held for that part of T.
struct Advance {
    static constexpr const char* name = "bf::kernels::Advance{}";
    template <class Y, class A, class P, class X, class S>
    constexpr void operator()(const Y& y, const A& part, const P& period, const X& x,
                              const S& slope) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = x[i] + part[0] * period[0] * slope[i];
    }
};

} // namespace bf::kernels
