#pragma once

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>

/// What values a parameter may have, and the words for one that it may not; nothing here allocates.
namespace bf::kernels {

/// Bounds of every element of a quantity; those that are infinite are none.
struct Limits {
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    double minimum = -infinity; ///< x ≥ minimum
    double above = -infinity;   ///< x > above
    double maximum = infinity;  ///< x ≤ maximum

    constexpr bool are_given() const noexcept {
        return minimum > -infinity || above > -infinity || maximum < infinity;
    }
    /// NaN lies within no limits.
    constexpr bool allow(double x) const noexcept {
        return !are_given() || (x >= minimum && (x > above || above == -infinity) && x <= maximum);
    }
};

namespace detail {
/// The fewest digits that read back as the same number.
struct NumberText {
    char text[32];
    explicit NumberText(double x) noexcept {
        if (x != x) {
            std::snprintf(text, sizeof text, "NaN");
            return;
        }
        for (int digits = 15; digits <= 17; ++digits) {
            std::snprintf(text, sizeof text, "%.*g", digits, x);
            if (std::strtod(text, nullptr) == x) break;
        }
    }
};
} // namespace detail

/// Writes "greater than 0", "from 0 to 1", or nothing where everything is allowed.
inline void describe(const Limits& limits, char* text, std::size_t size) noexcept {
    const bool has_least = limits.minimum > -Limits::infinity && limits.minimum > limits.above;
    const bool has_above = !has_least && limits.above > -Limits::infinity;
    const bool has_most = limits.maximum < Limits::infinity;
    const detail::NumberText least(has_above ? limits.above : limits.minimum), most(limits.maximum);
    if (has_above)
        std::snprintf(text, size, has_most ? "greater than %s and at most %s" : "greater than %s", least.text,
                      most.text);
    else if (has_least)
        std::snprintf(text, size, has_most ? "from %s to %s" : "at least %s", least.text, most.text);
    else if (has_most)
        std::snprintf(text, size, "at most %s", most.text);
    else if (size > 0)
        text[0] = '\0';
}

/// Looks for the first of value(0), ..., value(count - 1) that is not allowed, and writes what is wrong with
/// it: "must be greater than 0, but is -1", or "..., but element 2 is -1" where there are several. False:
/// all are allowed, and nothing is written.
template <class F>
bool find_outside(const Limits& limits, int count, F&& value, char* text, std::size_t size) noexcept {
    for (int i = 0; i < count; ++i) {
        const double x = value(i);
        if (limits.allow(x)) continue;
        char wanted[96];
        describe(limits, wanted, sizeof wanted);
        const detail::NumberText found(x);
        if (count == 1)
            std::snprintf(text, size, "must be %s, but is %s", wanted, found.text);
        else
            std::snprintf(text, size, "must be %s, but element %d is %s", wanted, i + 1, found.text);
        return true;
    }
    return false;
}

} // namespace bf::kernels
