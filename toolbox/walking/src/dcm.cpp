#include "bf/walking/dcm.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace bf::walking {

namespace {

double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

} // namespace

double natural_frequency(double height, double gravity) noexcept { return std::sqrt(gravity / height); }

Eigen::Vector3d Vrp::over(const Foothold& foothold, Side side) const noexcept {
    Eigen::Vector3d local = offset;
    if (side == Side::right) local.y() = -local.y();
    return foothold.head<3>() + yaw_rotation(foothold[3]) * local;
}

DcmReference dcm_phase(const Eigen::Vector3d& r_0, const Eigen::Vector3d& r_1, double T,
                       const Eigen::Vector3d& xi_T, double omega, double t) noexcept {
    if (!(T > 0)) return {xi_T, omega * (xi_T - r_1), r_1};
    const Eigen::Vector3d v = (r_1 - r_0) / T, r = r_0 + t * v;
    const Eigen::Vector3d xi = r + v / omega + std::exp(omega * (t - T)) * (xi_T - r_1 - v / omega);
    return {xi, omega * (xi - r), r};
}

Eigen::Vector3d vrp_from_rest(const Eigen::Vector3d& xi_0, const Eigen::Vector3d& r_1, double T,
                              const Eigen::Vector3d& xi_T, double omega) noexcept {
    // xi(0) of dcm_phase is linear in r_0 = r_1 - T v.
    const double x = omega * T, E = std::exp(-x), a = x > 1e-9 ? -std::expm1(-x) / x : 1.0;
    if (!(a < 1)) return xi_0;
    return (xi_0 - (a - E) * r_1 - E * xi_T) / (1 - a);
}

DcmReference plan_dcm(const Eigen::Ref<const Eigen::Matrix4Xd>& footholds, const Step& step, const Vrp& vrp,
                      double omega) noexcept {
    const auto over = [&](int i) {
        return vrp.over(footholds.col(i), i % 2 == 1 ? step.stance : other(step.stance));
    };
    const auto between = [&](int i) -> Eigen::Vector3d { return 0.5 * (over(i) + over(i + 1)); };
    const Eigen::Vector3d end = between(step.ahead);
    const double T_d = step.double_support, T_s = step.single_support, T_n = step.next_double_support;
    const auto after = [&](int i) -> Eigen::Vector3d { return i < step.ahead ? over(i + 1) : end; };

    if (step.ahead == 0) {
        if (step.from_rest || step.time >= T_d) return {end, Eigen::Vector3d::Zero(), end};
        return dcm_phase(over(0), end, T_d, end, omega, step.time);
    }
    // Backwards from the rest: what the DCM is where the single support i begins.
    Eigen::Vector3d xi = end;
    for (int i = step.ahead; i >= 1; --i) {
        xi = dcm_phase(over(i), after(i), T_n, xi, omega, 0).dcm; // end of the single support i
        if (i == 1 && step.time >= T_d)
            return dcm_phase(over(1), over(1), T_s, xi, omega, std::min(step.time - T_d, T_s));
        xi = dcm_phase(over(i), over(i), i == 1 ? T_s : step.next_single_support, xi, omega, 0).dcm;
    }
    const Eigen::Vector3d begin =
        step.from_rest ? vrp_from_rest(between(0), over(1), T_d, xi, omega) : over(0);
    return dcm_phase(begin, over(1), T_d, xi, omega, step.time);
}

Eigen::Vector3d follow_dcm(const Eigen::Vector3d& dcm, const DcmReference& reference, double gain,
                           double omega) noexcept {
    return dcm - reference.velocity / omega + gain / omega * (dcm - reference.dcm);
}

int support_corners(const Eigen::Ref<const Eigen::Matrix4Xd>& footholds, const Step& step, const Sole& sole,
                    Eigen::Matrix<double, 2, max_corners>& corners) noexcept {
    int count = 0;
    for (int i = step.on_both_feet() ? 0 : 1; i < 2; ++i) {
        const Eigen::Rotation2Dd R(footholds(3, i));
        for (const double x : {sole.x_min, sole.x_max})
            for (const double y : {sole.y_min, sole.y_max})
                corners.col(count++) = footholds.col(i).head<2>() + R * Eigen::Vector2d(x, y);
    }
    return count;
}

Eigen::Vector2d nearest_in_hull(const Eigen::Matrix<double, 2, max_corners>& corners, int count,
                                const Eigen::Vector2d& p) noexcept {
    // Andrew's monotone chain, counter-clockwise; then the nearest point of the edges that p is outside of.
    std::array<Eigen::Vector2d, max_corners> sorted;
    for (int i = 0; i < count; ++i) sorted[static_cast<std::size_t>(i)] = corners.col(i);
    std::sort(sorted.begin(), sorted.begin() + count, [](const auto& a, const auto& b) {
        return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
    });
    std::array<Eigen::Vector2d, 2 * max_corners> hull;
    std::size_t size = 0;
    const auto add = [&](const Eigen::Vector2d& point, std::size_t least) {
        while (size >= least + 2 && cross(hull[size - 2], hull[size - 1], point) <= 0) --size;
        hull[size++] = point;
    };
    for (int i = 0; i < count; ++i) add(sorted[static_cast<std::size_t>(i)], 0);
    const std::size_t lower = size - 1;
    for (int i = count - 2; i >= 0; --i) add(sorted[static_cast<std::size_t>(i)], lower);
    if (size > 1) --size; // the first point again

    bool inside = size > 2;
    double least = std::numeric_limits<double>::infinity();
    Eigen::Vector2d nearest = hull[0];
    for (std::size_t i = 0; i < size; ++i) {
        const Eigen::Vector2d &a = hull[i], &b = hull[(i + 1) % size];
        if (cross(a, b, p) < 0) inside = false;
        const double length = (b - a).squaredNorm();
        const double along = length > 0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0.0;
        const Eigen::Vector2d candidate = a + along * (b - a);
        if (const double distance = (p - candidate).squaredNorm(); distance < least) {
            least = distance;
            nearest = candidate;
        }
    }
    return inside ? p : nearest;
}

Adjustment adjust_step(const Eigen::Vector2d& dcm, const DcmReference& reference, const Foothold& stance,
                       const Step& step, const Sole& sole, double omega, double cost) noexcept {
    if (step.on_both_feet()) return {};
    const Eigen::Rotation2Dd R(stance[3]);
    const Eigen::Vector2d planned = reference.dcm.head<2>(), vrp = reference.vrp.head<2>();
    const Eigen::Vector2d e = R.inverse() * (dcm - planned), a = R.inverse() * (planned - vrp),
                          r = R.inverse() * (vrp - stance.head<2>());
    const double left = std::max(step.duration() - step.time, 0.0), tau = std::exp(omega * left);
    const double x = omega * step.next_double_support;
    const double gamma = x > 1e-9 ? -std::expm1(-x) / x : 1.0;
    const auto shift = [&](double later) -> Eigen::Vector2d {
        const auto beyond = [&](double value, double low, double high) {
            // A VRP at or beyond the edge of the sole leaves no room on that side.
            return value -
                   std::clamp(value, std::min((later - 1) * low, 0.0), std::max((later - 1) * high, 0.0));
        };
        const Eigen::Vector2d E = later * e + (later - tau) * a;
        return Eigen::Vector2d(beyond(E.x(), sole.x_min - r.x(), sole.x_max - r.x()),
                               beyond(E.y(), sole.y_min - r.y(), sole.y_max - r.y())) /
               gamma;
    };
    Eigen::Vector2d moved = shift(tau);
    if (moved.isZero(0) || !(cost < std::numeric_limits<double>::infinity()) || !(left > 0))
        return {R * moved, 0.0};

    const auto objective = [&](double later) {
        const double change = cost / omega * (later / tau - 1);
        return shift(later).squaredNorm() + change * change;
    };
    // Golden section search: each iteration leaves 0.618 of the interval.
    constexpr double part = 0.6180339887498949;
    double low = std::exp(omega * left / 2), high = std::exp(omega * left * 3 / 2);
    double first = high - part * (high - low), second = low + part * (high - low);
    double at_first = objective(first), at_second = objective(second);
    for (int i = 0; i < 40; ++i) {
        const bool is_left = at_first < at_second;
        (is_left ? high : low) = is_left ? second : first;
        (is_left ? second : first) = is_left ? first : second;
        (is_left ? at_second : at_first) = is_left ? at_first : at_second;
        double& fresh = is_left ? first : second;
        fresh = is_left ? high - part * (high - low) : low + part * (high - low);
        (is_left ? at_first : at_second) = objective(fresh);
    }
    const double later = (low + high) / 2;
    return {R * shift(later), std::log(later) / omega - left};
}

} // namespace bf::walking
