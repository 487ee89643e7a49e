// Numbers in messages.
#pragma once

#include <cstdio>
#include <string>

namespace bf::analysis {

/// Four digits.
inline std::string short_text(double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.4g", value);
    return digits;
}

} // namespace bf::analysis
