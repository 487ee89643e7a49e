#include "bf/run/run.hpp"
#include "reduced.hpp"
#include "root.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bf::analysis {

namespace {

constexpr double pi = std::numbers::pi, infinity = std::numeric_limits<double>::infinity();
constexpr double degrees = 180 / pi;

struct Point {
    double omega;
    Complex value;
};

/// A sampled system has its frequencies below half of that of its samples.
void keep_below_samples(double& low, double& high, double period) {
    if (period == 0) return;
    high = pi / period;
    low = std::min(low, high / 1000);
}

/// From -1, where a loop would be at its limit of stability.
double distance(const Complex& L) { return std::abs(1.0 + L); }

/// Frequencies at which these roots act [rad/s].
std::vector<double> sizes(const std::vector<Complex>& roots, double period) {
    std::vector<double> all;
    for (const auto& root : roots) {
        const Complex s = in_s(root, period);
        for (const double w : {std::abs(s), std::abs(s.imag())})
            if (std::isfinite(w) && w > 1e-12 * (1 + std::abs(s))) all.push_back(w);
    }
    return all;
}

/// From a decade below the roots to one above, and on to where L is on the same side of 1 as at 0 and at
/// infinite frequency: a gain crossover may lie far beyond all poles and zeros.
std::pair<double, double> range(const Reduced& L, const std::vector<double>& roots) {
    constexpr int most_decades = 20;
    const auto [least, most] = std::minmax_element(roots.begin(), roots.end());
    double low = roots.empty() ? 0.1 : *least / 10, high = roots.empty() ? 10 : *most * 10;
    const auto size = [&](double w) { return std::abs(L(w)); };
    keep_below_samples(low, high, L.period());
    for (int i = 0; i < most_decades && L.period() == 0 && (size(high) > 1) != (std::abs(L.direct()) > 1);
         ++i)
        high *= 10;
    const double at_0 = size(0);
    for (int i = 0; i < most_decades && (size(low) > 1) != (at_0 > 1); ++i) low /= 10;
    return {low, high};
}

/// L so densely that from point to point it moves by a small part of its distance from -1: begins with even
/// steps and all places at which roots act, however sharp their resonance is.
std::vector<Point> trace(const Reduced& L, const std::vector<Complex>& closed_poles) {
    constexpr int per_decade = 60;
    constexpr std::size_t most_points = 100000;
    constexpr double part = 0.2, nearest = 0.02, closest = 1e-10;
    auto grid = sizes(closed_poles, L.period());
    for (const auto& roots : {L.poles(), L.zeros()})
        for (const double w : sizes(roots, L.period())) grid.push_back(w);
    const auto [low, high] = range(L, grid);
    grid.erase(std::remove_if(grid.begin(), grid.end(), [high = high](double w) { return w > high; }),
               grid.end());
    for (const double w : logarithmic(low, high, 2 + static_cast<int>(per_decade * std::log10(high / low))))
        grid.push_back(w);
    // At π/T itself L is real: a crossover shortly below is seen by what L is just before.
    if (L.period() > 0) grid.push_back(high * (1 - 1e-6));
    std::sort(grid.begin(), grid.end());
    std::vector<Point> curve{{low, L(low)}};
    const auto add = [&](const auto& self, const Point& b) -> void {
        const Point a = curve.back();
        const double least = std::min(distance(a.value), distance(b.value));
        if (!(std::abs(b.value - a.value) <= part * std::max(least, nearest)) &&
            b.omega > a.omega * (1 + closest) && curve.size() < most_points) {
            const double middle = std::sqrt(a.omega * b.omega);
            self(self, {middle, L(middle)});
            self(self, b);
        } else {
            curve.push_back(b);
        }
    };
    for (const double w : grid)
        if (w > curve.back().omega) add(add, {w, L(w)});
    return curve;
}

/// Calls see(i, ω) at those local minima of f(L), near the point i, that may lie below the level: by
/// reference, as `see` may lower it to what it saw, so that fewer are worth a look.
template <class F, class See>
void minima(const Reduced& L, const std::vector<Point>& curve, F&& f, const double& level, See&& see) {
    for (std::size_t i = 1; i + 1 < curve.size(); ++i) {
        const double before = f(curve[i - 1].value), now = f(curve[i].value), after = f(curve[i + 1].value);
        if (now <= before && now <= after && now - level < before + after - 2 * now)
            see(i, find_least([&](double w) { return f(L(w)); }, curve[i - 1].omega, curve[i + 1].omega));
    }
}

/// Calls see(ω) wherever f(L) changes its sign, also there and back within a step.
template <class F, class See>
void crossings(const Reduced& L, const std::vector<Point>& curve, F&& f, See&& see) {
    const auto at = [&](double w) { return f(L(w)); };
    for (std::size_t i = 1; i < curve.size(); ++i)
        if ((f(curve[i - 1].value) > 0) != (f(curve[i].value) > 0))
            see(find_root(at, curve[i - 1].omega, curve[i].omega));
    for (const double sign : {1.0, -1.0})
        minima(
            L, curve, [&](const Complex& value) { return sign * f(value); }, 0,
            [&](std::size_t i, double w) {
                if (!(sign * f(curve[i].value) > 0 && sign * at(w) < 0)) return;
                see(find_root(at, curve[i - 1].omega, w));
                see(find_root(at, w, curve[i + 1].omega));
            });
}

/// |L| - 1, and the imaginary part of L: 0 where they are but for rounding.
double above_one(const Complex& L) {
    const double above = std::abs(L) - 1;
    return std::abs(above) < 1e-13 ? 0 : above;
}
double above_axis(const Complex& L) { return std::abs(L.imag()) < 1e-13 * std::abs(L) ? 0 : L.imag(); }

/// Where |L| = 1, and where L is negative real and its absolute value neither infinite nor 0 but for
/// rounding.
struct Crossovers {
    std::vector<double> gain, phase;
};

bool is_crossover(double L, double largest) { return L < -1e-9 * std::min(1.0, largest) && L > -1e9; }

double largest(const std::vector<Point>& curve) {
    double most = 0;
    for (const auto& point : curve) most = std::max(most, std::abs(point.value));
    return most;
}

Crossovers crossovers(const Reduced& L, const std::vector<Point>& curve) {
    Crossovers all;
    crossings(L, curve, above_one, [&](double w) { all.gain.push_back(w); });
    crossings(L, curve, above_axis, [&, most = largest(curve)](double w) {
        if (is_crossover(L(w).real(), most)) all.phase.push_back(w);
    });
    return all;
}

} // namespace

Complex frequency_response(const LinearSystem& system, int output, int input, double omega) {
    return Reduced(system, output, input)(omega);
}

std::vector<double> logarithmic(double low, double high, int count) {
    std::vector<double> all{low};
    for (int i = 1; i < count; ++i)
        all.push_back(low * std::pow(high / low, static_cast<double>(i) / (count - 1)));
    return all;
}

std::vector<double> frequencies(const LinearSystem& system, int output, int input, int count, bool of_loop) {
    const Reduced G(system, output, input);
    double low = infinity, high = 0;
    const auto see = [&](double w) {
        low = std::min(low, w);
        high = std::max(high, w);
    };
    for (const auto& roots : {G.poles(), G.zeros()})
        for (const auto& root : roots) {
            const double w = std::abs(in_s(root, system.period));
            if (std::isfinite(w) && w > 1e-8) see(w);
        }
    if (high == 0) see(system.period > 0 ? 0.1 / system.period : 1);
    low = std::max(low, high * 1e-7);
    if (of_loop) {
        const auto places = crossovers(G, trace(G, {}));
        for (const double w : places.gain) see(w);
        for (const double w : places.phase) see(w);
    }
    low = std::pow(10, std::floor(std::log10(low) - 1));
    high = std::pow(10, std::ceil(std::log10(high) + 1));
    keep_below_samples(low, high, system.period);
    return logarithmic(low, high, count);
}

Response response(const LinearSystem& system, int output, int input, const std::vector<double>& omega) {
    const Reduced G(system, output, input);
    Response all;
    double turns = 0;
    for (const double w : omega) {
        const Complex value = G(w);
        double phase = std::arg(value) * degrees;
        // K/(jω)^k begins at -90 k degrees, and at 180 less where K is negative.
        if (all.phase.empty() && w > 0) {
            const double k = std::round(std::log10(std::abs(G(w / 10) / value)));
            if (std::isfinite(k)) phase += 360 * std::round((-90 * k - 45 - phase) / 360);
        }
        if (!all.phase.empty()) turns = std::round((all.phase.back() - phase) / 360);
        all.omega.push_back(w);
        all.value.push_back(value);
        all.magnitude.push_back(20 * std::log10(std::abs(value)));
        all.phase.push_back(phase + 360 * turns);
    }
    return all;
}

Margins margins(const LinearSystem& loop, int output, int input) {
    const auto closed_poles = poles(closed(loop, output, input));
    const Reduced L(loop, output, input);
    const auto curve = trace(L, closed_poles);
    const auto places = crossovers(L, curve);
    const double most = largest(curve);
    if (most == 0)
        throw RunError("there is no loop: what is added to '" +
                       loop.inputs.at(static_cast<std::size_t>(input)) + "' does not come back");
    Margins found;
    found.is_stable = loop.is_stable_uncut.value_or(are_stable(closed_poles, loop.period));
    const auto see_distance = [&](const Complex& value) {
        found.modulus = std::min(found.modulus, distance(value));
    };
    const auto see_real = [&](double w, double value) {
        see_distance(value);
        if (!is_crossover(value, most)) return;
        const double k = -1 / value;
        if (k > 1 && k < found.gain) {
            found.gain = k;
            found.phase_crossover = w;
        } else if (k < 1 && k > found.gain_reduction) {
            found.gain_reduction = k;
            found.reduction_crossover = w;
        }
    };
    for (const double w : places.phase) see_real(w, L(w).real());
    // At 0, where no pole is, L is real; so it is far above all poles, and at half of the samples' frequency.
    const double at_0 = L(0).real(), last = loop.period > 0 ? pi / loop.period : infinity;
    see_real(0, at_0);
    see_real(last, loop.period > 0 ? L(last).real() : L.direct());
    for (const double w : places.gain) {
        const Complex value = L(w);
        see_distance(value);
        const double angle = std::arg(-value) * degrees; // from -1
        const double lag = angle < 0 ? angle + 360 : angle;
        found.delay = std::min(found.delay, lag / degrees / w);
        if (std::abs(angle) < std::abs(found.phase)) {
            found.phase = angle;
            found.gain_crossover = w;
        }
    }
    for (const auto& point : curve) see_distance(point.value);
    minima(L, curve, distance, found.modulus, [&](std::size_t, double w) { see_distance(L(w)); });
    const auto closed_gain = [](const Complex& value) {
        return std::abs(value) > 1 ? 1 / std::abs(1.0 + 1.0 / value) : std::abs(value / (1.0 + value));
    };
    const double limit =
        closed_gain(std::isinf(at_0) ? L(1e-6 * curve.front().omega) : at_0) / std::numbers::sqrt2;
    const auto above = [&](const Complex& value) { return closed_gain(value) - limit; };
    for (std::size_t i = 1; i < curve.size() && limit > 1e-9 && std::isfinite(limit); ++i)
        if (above(curve[i - 1].value) > 0 && above(curve[i].value) <= 0) {
            found.bandwidth =
                find_root([&](double w) { return above(L(w)); }, curve[i - 1].omega, curve[i].omega);
            break;
        }
    return found;
}

} // namespace bf::analysis
