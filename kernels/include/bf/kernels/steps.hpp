// Time in steps.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace bf::kernels {

/// How many of the steps at 0, period, 2 period, ... [s] stand before `time` [s]. Both numbers are rounded:
/// 2.1 / 0.7 is a little more than 3.
inline std::int64_t steps_before(double time, double period) noexcept {
    const double count = ceil(time / period * (1 - 4 * std::numeric_limits<double>::epsilon()));
    return count < 9e18 ? static_cast<std::int64_t>(count) : std::numeric_limits<std::int64_t>::max();
}

} // namespace bf::kernels
