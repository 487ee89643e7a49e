#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

namespace bf::kernels {

enum class AntiWindup { none, back_calculation, clamping };

/// PID controller of the setpoint r and the measurement m, element by element:
///
///   e = r - m,   q = N (c r - m - z),   v = P (b r - m) + w + D q,   y = clamp(v, lower, upper)
///
/// where w integrates `slope_i` = I e + anti-windup + (tracked - y)/T_t, and z integrates `slope_d` = q.
/// options = [anti_windup has_tracking θ_i θ_d]: the states x_i, x_d are w, z as far as they are known before
/// this step, w = x_i + θ_i T I e and z = x_d + θ_d T q, with T = period [s]: θ is 0 in continuous time and
/// for forward Euler, 1/2 for the trapezoidal rule, 1 for backward Euler. Anti-windup acts on the slope
/// alone: (y - v)/T_t by back-calculation, or I e stops while it drives v further beyond a limit. Source:
/// Åström, Hägglund, Advanced PID Control, §3.5 (limits) and §13.4 (discretisation).
struct Pid {
    static constexpr const char* name = "bf::kernels::Pid{}";
    template <class Y, class SI, class SD, class O, class P, class I, class D, class N, class B, class C,
              class K, class L, class H, class T, class XI, class XD, class R, class M, class A>
    constexpr void operator()(const Y& y, const SI& slope_i, const SD& slope_d, const O& options, const P& p,
                              const I& i, const D& d, const N& bandwidth, const B& b, const C& c,
                              const K& tracking_time, const L& lower, const H& upper, const T& period,
                              const XI& x_i, const XD& x_d, const R& r, const M& m,
                              const A& tracked) const noexcept {
        const auto anti_windup = static_cast<AntiWindup>(static_cast<int>(options[0]));
        const auto at = [](const auto& v, int k) { return v[pick(k, v.size())]; };
        for (int k = 0; k < y.size(); ++k) {
            const double set = at(r, k), is = at(m, k), n = at(bandwidth, k);
            const double drive = at(i, k) * (set - is);
            // q = N (c r - m - x_d - θ T q), solved for q
            const double q = n * (at(c, k) * set - is - at(x_d, k)) / (1 + options[3] * period[0] * n);
            const double w = at(x_i, k) + options[2] * period[0] * drive;
            const double v = at(p, k) * (at(b, k) * set - is) + w + at(d, k) * q;
            const double low = at(lower, k), high = at(upper, k), limited = clamp(v, low, high);
            double slope = drive;
            if (anti_windup == AntiWindup::back_calculation) slope += (limited - v) / at(tracking_time, k);
            if (anti_windup == AntiWindup::clamping && ((v > high && drive > 0) || (v < low && drive < 0)))
                slope = 0;
            if (options[1] != 0) slope += (at(tracked, k) - limited) / at(tracking_time, k);
            y[k] = limited;
            slope_i[k] = slope;
            slope_d[k] = q;
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
