#pragma once

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>

/// What values a parameter may have, and the words for one that it may not; nothing here allocates. Whoever
/// sets parameters asks here.
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

/// The numbers that an element type holds. A real type holds infinities too and rounds to its nearest number
/// what lies between two of them; nothing stands for NaN.
struct Range {
    double least, most; ///< finite numbers
    bool is_whole;      ///< an integer type or bool

    constexpr bool holds(double x) const noexcept {
        const bool is_inside = x >= least && x <= most;
        if (is_whole) return is_inside && x == static_cast<double>(static_cast<long long>(x));
        return is_inside || (x != 0 && x == x + x);
    }
};
template <class T> constexpr Range range_of() noexcept {
    using Type = std::numeric_limits<T>;
    return {static_cast<double>(Type::lowest()), static_cast<double>(Type::max()), Type::is_integer};
}

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

/// Writes "0 or 1", "a whole number from -128 to 127", "a number".
inline void describe(const Range& range, char* text, std::size_t size) noexcept {
    const detail::NumberText least(range.least), most(range.most);
    if (!range.is_whole)
        std::snprintf(text, size, range.most > 1e300 ? "a number" : "a number of at most %s in magnitude",
                      most.text);
    else if (range.most == 1)
        std::snprintf(text, size, "0 or 1");
    else
        std::snprintf(text, size, "a whole number from %s to %s", least.text, most.text);
}

namespace detail {
inline bool is_good(const Limits& limits, double x) noexcept { return limits.allow(x); }
inline bool is_good(const Range& range, double x) noexcept { return range.holds(x); }
} // namespace detail

/// Looks for the first of value(0), ..., value(count - 1) that is outside of the limits or the range, and
/// writes what is wrong with it: "must be greater than 0, but is -1", or "..., but element 2 is -1" where
/// there are several. False: none is, and nothing is written.
template <class Bounds, class F>
bool find_outside(const Bounds& bounds, int count, F&& value, char* text, std::size_t size) noexcept {
    for (int i = 0; i < count; ++i) {
        const double x = value(i);
        if (detail::is_good(bounds, x)) continue;
        char wanted[96];
        describe(bounds, wanted, sizeof wanted);
        const detail::NumberText found(x);
        if (count == 1)
            std::snprintf(text, size, "must be %s, but is %s", wanted, found.text);
        else
            std::snprintf(text, size, "must be %s, but element %d is %s", wanted, i + 1, found.text);
        return true;
    }
    return false;
}

/// Are there neither `wanted` values nor one for all? Then writes "parameter 'c.value' has 2 elements, not
/// 3".
inline bool is_wrong_count(const char* what, const char* path, int wanted, int count, char* text,
                           std::size_t size) noexcept {
    if (count == wanted || count == 1) return false;
    std::snprintf(text, size, "%s '%.190s' has %d elements, not %d", what, path, wanted, count);
    return true;
}

/// Ends a change of parameters, whose new values are in place. `check` and then `recompute`, which computes
/// what follows from parameters alone, say what is wrong, or null; if something is, `restore` puts back the
/// old values, which were right, and all follows from them again.
template <class Check, class Recompute, class Restore>
const char* keep_or_restore(Check&& check, Recompute&& recompute, Restore&& restore) noexcept {
    const char* wrong = check();
    if (!wrong) wrong = recompute();
    if (!wrong) return nullptr;
    restore();
    recompute();
    return wrong;
}

/// Looks for the first of value(0), ..., value(count - 1) that is below its element of another parameter,
/// where a single element of either expands, and writes what is wrong with it: "parameter 'p.upper' must be
/// at least 'lower', but 1 is below 2". False: none is, and nothing is written.
template <class F, class G>
bool find_below(const char* path, int count, F&& value, const char* least_name, int least_count, G&& least,
                char* text, std::size_t size) noexcept {
    const int all = count > least_count ? count : least_count;
    for (int i = 0; i < all; ++i) {
        const double x = value(count == 1 ? 0 : i), low = least(least_count == 1 ? 0 : i);
        if (!(x < low)) continue;
        char element[32] = "";
        if (all > 1) std::snprintf(element, sizeof element, " (element %d)", i + 1);
        std::snprintf(text, size, "parameter '%.120s' must be at least '%.40s', but %s is below %s%s", path,
                      least_name, detail::NumberText(x).text, detail::NumberText(low).text, element);
        return true;
    }
    return false;
}

} // namespace bf::kernels
