#include "bf/base/step_measures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bf {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double band = 0.02; // of settling

} // namespace

StepMeasures measure_step(const std::vector<double>& time, const std::vector<double>& value, double final,
                          bool is_sampled) {
    double largest = 0;
    for (const double y : value) largest = std::max(largest, std::abs(y));
    const bool is_relative = std::abs(final) > 1e-9 * largest;
    const auto settling_time = [&] {
        const double width = band * (is_relative ? std::abs(final) : largest);
        for (std::size_t i = value.size(); i-- > 0;) {
            const double outside = std::abs(value[i] - final) - width;
            if (outside <= 0) continue;
            if (!(outside > 0) || i + 1 == value.size()) return nan;
            // On the line to the next sample, which may lie on the other side of the final value.
            const double side = value[i] < final ? -1 : 1;
            const double share = is_sampled ? 1 : outside / (side * (value[i] - value[i + 1]));
            return time[i] + std::min(share, 1.0) * (time[i + 1] - time[i]);
        }
        return 0.0;
    };
    const auto reaches = [&](double share) {
        for (std::size_t i = 0; i < value.size(); ++i)
            if (is_relative && value[i] / final >= share) {
                if (i == 0 || is_sampled) return time[i];
                const double a = value[i - 1] / final, b = value[i] / final;
                return time[i - 1] + (share - a) / (b - a) * (time[i] - time[i - 1]);
            }
        return nan;
    };
    const double sign = final < 0 ? -1 : 1;
    const auto is_less = [sign](double a, double b) { return sign * a < sign * b; };
    const auto top = std::max_element(value.begin(), value.end(), is_less) - value.begin();
    const auto bottom = std::min_element(value.begin(), value.end(), is_less) - value.begin();
    StepMeasures found;
    const auto at = [](const std::vector<double>& all, auto i) { return all[static_cast<std::size_t>(i)]; };
    found.peak = at(value, top);
    found.peak_time = at(time, top);
    found.overshoot = is_relative ? std::max(0.0, 100 * (found.peak - final) / final) : nan;
    found.undershoot = is_relative ? std::max(0.0, -100 * at(value, bottom) / final) : nan;
    found.undershoot_time = at(time, bottom);
    found.rise_time = reaches(0.9) - reaches(0.1);
    found.settling_time = settling_time();
    return found;
}

} // namespace bf
