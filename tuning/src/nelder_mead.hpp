#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <utility>

namespace bf::tuning {

/// The best point of two coordinates that was seen in `most` evaluations of f, from `start` and the two
/// points at a distance of `size` along the axes. Source: J. A. Nelder, R. Mead, A simplex method for
/// function minimization, The Computer Journal 7 (1965), with coefficients 1, 2, 1/2, 1/2.
template <class F>
Eigen::Vector2d nelder_mead(const F& f, const Eigen::Vector2d& start, double size, int most) {
    using Point = std::pair<double, Eigen::Vector2d>;
    int left = most;
    const auto evaluated = [&](const Eigen::Vector2d& x) { return --left, Point(f(x), x); };
    std::array<Point, 3> simplex{evaluated(start), evaluated(start + Eigen::Vector2d(size, 0)),
                                 evaluated(start + Eigen::Vector2d(0, size))};
    while (left > 0) {
        std::stable_sort(simplex.begin(), simplex.end(),
                         [](const Point& a, const Point& b) { return a.first < b.first; });
        auto& [best, good, worst] = simplex;
        const Eigen::Vector2d middle = (best.second + good.second) / 2, away = middle - worst.second;
        if (away.norm() < 1e-4 * size) break;
        const Point reflected = evaluated(middle + away);
        if (reflected.first < best.first) {
            const Point expanded = evaluated(middle + 2 * away);
            worst = expanded.first < reflected.first ? expanded : reflected;
            continue;
        }
        if (reflected.first < good.first) {
            worst = reflected;
            continue;
        }
        const bool is_outside = reflected.first < worst.first;
        const Point contracted = evaluated(middle + (is_outside ? 0.5 : -0.5) * away);
        if (contracted.first < std::min(reflected.first, worst.first)) {
            worst = contracted;
            continue;
        }
        good = evaluated((best.second + good.second) / 2);
        worst = evaluated((best.second + worst.second) / 2);
    }
    return std::min_element(simplex.begin(), simplex.end(),
                            [](const Point& a, const Point& b) { return a.first < b.first; })
        ->second;
}

} // namespace bf::tuning
