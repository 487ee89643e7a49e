// Roots and minima of functions of one number.
#pragma once

#include <cmath>

namespace bf::analysis {

/// Where f changes its sign between a < b, by the Illinois method.
/// Source: Dowell and Jarratt, BIT 11 (1971).
template <class F> double find_root(F&& f, double a, double b) {
    double at_a = f(a), at_b = f(b), last = a;
    for (int i = 0, side = 0; i < 100; ++i) {
        double w = b - at_b * (b - a) / (at_b - at_a);
        if (!(w > a && w < b)) w = 0.5 * (a + b);
        const double at = f(w);
        if (at == 0 || std::abs(w - last) <= 1e-15 * std::abs(w)) return w;
        last = w;
        if ((at > 0) == (at_b > 0)) {
            b = w;
            at_b = at;
            if (side == -1) at_a *= 0.5;
            side = -1;
        } else {
            a = w;
            at_a = at;
            if (side == 1) at_b *= 0.5;
            side = 1;
        }
    }
    return last;
}

/// Where f is least between a and b, by golden sections.
template <class F> double find_least(F&& f, double a, double b) {
    constexpr double ratio = 0.6180339887498949;
    double left = b - ratio * (b - a), right = a + ratio * (b - a), at_left = f(left), at_right = f(right);
    for (int i = 0; i < 30; ++i) {
        if (at_left < at_right) {
            b = right;
            right = left;
            at_right = at_left;
            at_left = f(left = b - ratio * (b - a));
        } else {
            a = left;
            left = right;
            at_left = at_right;
            at_right = f(right = a + ratio * (b - a));
        }
    }
    return at_left < at_right ? left : right;
}

} // namespace bf::analysis
