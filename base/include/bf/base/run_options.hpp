// What programs that run a model take as values of their options: `bf run` and generated ones. C++17.
#pragma once

#include "bf/base/value_text.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

namespace bf {

/// The numbers that an option takes.
struct OptionRange {
    double least, most;
    bool is_whole = false;
};

constexpr OptionRange watchdog_range{0, 1e9};                                 ///< s
constexpr OptionRange priority_range{0, 99, true};                            ///< of SCHED_FIFO
constexpr OptionRange processor_range{0, 1 << 20, true};                      ///< their numbers
constexpr OptionRange stop_range{0, std::numeric_limits<double>::infinity()}; ///< s

/// Reads the value of an option. Empty, or what is wrong.
inline std::string read_option(const std::string& text, const OptionRange& range, double& value) {
    if (std::string wrong = read_value(text, value); !wrong.empty()) return wrong;
    if (value >= range.least && value <= range.most && (!range.is_whole || value == std::floor(value)))
        return "";
    char limits[120];
    std::snprintf(limits, sizeof limits, " not in range [%.15g - %.15g]%s", range.least, range.most,
                  range.is_whole ? " of whole numbers" : "");
    return "Value " + text + limits;
}

/// Why an option that names something takes no empty text, as of a shell's variable that is not set.
constexpr const char* empty_option = "the value is empty; give one, or leave the option out";

/// The longest step of a model, s.
constexpr double longest_step = 1e9;

/// As many steps have numbers that a double tells from each other.
constexpr double most_steps = 9007199254740992;

/// Empty, or why a run of `stop` s has no steps of `step` s.
inline std::string check_stop(double stop, double step) {
    if (!std::isfinite(stop) || stop / step <= most_steps) return "";
    char text[160];
    std::snprintf(text, sizeof text, "a run of %.15g s has more than 2^53 steps of %.15g s", stop, step);
    return text;
}

} // namespace bf
