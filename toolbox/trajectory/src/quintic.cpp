#include "bf/trajectory/quintic.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace bf::trajectory {

Quintic::Quintic(const Motion& start, double to, double T) noexcept : target(to), duration(T) {
    const double way = target - start.position, v = start.velocity * T, a = start.acceleration * T * T;
    c[0] = start.position;
    c[1] = v;
    c[2] = 0.5 * a;
    c[3] = 10.0 * way - 6.0 * v - 1.5 * a;
    c[4] = -15.0 * way + 8.0 * v + 1.5 * a;
    c[5] = 6.0 * way - 3.0 * v - 0.5 * a;
}

Motion Quintic::at(double t) const noexcept {
    if (t >= duration) return {target, 0.0, 0.0};
    const double x = t / duration;
    Motion now;
    now.position = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))));
    now.velocity = (c[1] + x * (2 * c[2] + x * (3 * c[3] + x * (4 * c[4] + x * 5 * c[5])))) / duration;
    now.acceleration = (2 * c[2] + x * (6 * c[3] + x * (12 * c[4] + x * 20 * c[5]))) / (duration * duration);
    return now;
}

Quintic::Peaks Quintic::peaks() const noexcept {
    const double T = duration;
    if (!(T > 0.0)) return {0.0, 0.0, 0.0};
    Peaks peaks{std::abs(c[1]) / T, 2.0 * std::abs(c[2]) / (T * T), 6.0 * std::abs(c[3]) / (T * T * T)};
    const auto jerk = [&](double x) { return (6 * c[3] + x * (24 * c[4] + x * 60 * c[5])) / (T * T * T); };
    const auto look = [&](double x) {
        if (!(x > 0.0 && x < 1.0)) return;
        const Motion now = at(x * T);
        peaks.velocity = std::max(peaks.velocity, std::abs(now.velocity));
        peaks.acceleration = std::max(peaks.acceleration, std::abs(now.acceleration));
        peaks.jerk = std::max(peaks.jerk, std::abs(jerk(x)));
    };
    const auto roots = [&](double p, double q, double r) { // of p x² + q x + r
        const double discriminant = q * q - 4.0 * p * r;
        if (p == 0.0 || discriminant < 0.0) return q != 0.0 ? look(-r / q) : void();
        const double w = -0.5 * (q + std::copysign(std::sqrt(discriminant), q));
        look(w / p);
        if (w != 0.0) look(r / w);
    };
    // The acceleration is zero at the end, too: what is left of it without that root is of second order.
    roots(20 * c[5], 20 * c[5] + 12 * c[4], 20 * c[5] + 12 * c[4] + 6 * c[3]);
    roots(60 * c[5], 24 * c[4], 6 * c[3]);
    if (c[5] != 0.0) look(-c[4] / (5 * c[5]));
    peaks.jerk = std::max(peaks.jerk, std::abs(jerk(1.0)));
    return peaks;
}

} // namespace bf::trajectory
