// Numbers as people write them, the same for every door: values of parameters and inputs, numbers in files
// and options. Generated programs have this header too: C++17 and POSIX.
#pragma once

#include <cmath>
#include <cstdlib>
#include <limits>
#include <locale.h>
#include <string>

namespace bf {

/// Reads the number that the whole text is, whatever the locale: digits with a point and an exponent of ten
/// after e, E, d or D, a sign before them, Inf or inf, and NaN or nan, which whoever takes the value refuses.
/// Empty, or what is wrong: what fits no double is not taken for an infinity.
inline std::string read_value(const std::string& text, double& value) {
    const bool is_signed = !text.empty() && (text[0] == '-' || text[0] == '+');
    std::string plain = text.substr(is_signed);
    std::size_t at = 0;
    const auto skip_digits = [&] {
        const std::size_t begin = at;
        while (at < plain.size() && plain[at] >= '0' && plain[at] <= '9') ++at;
        return at - begin;
    };
    if (plain == "Inf" || plain == "inf") {
        value = std::numeric_limits<double>::infinity();
    } else if (plain == "NaN" || plain == "nan") {
        value = std::numeric_limits<double>::quiet_NaN();
    } else {
        std::size_t digits = skip_digits();
        if (at < plain.size() && plain[at] == '.') {
            ++at;
            digits += skip_digits();
        }
        bool is_number = digits > 0;
        if (is_number && at < plain.size() && std::string("eEdD").find(plain[at]) != std::string::npos) {
            plain[at++] = 'e';
            if (at < plain.size() && (plain[at] == '-' || plain[at] == '+')) ++at;
            is_number = skip_digits() > 0;
        }
        if (!is_number || at != plain.size()) return "'" + text + "' is no number";
        static const locale_t c = ::newlocale(LC_ALL_MASK, "C", nullptr);
        value = ::strtod_l(plain.c_str(), nullptr, c);
        if (std::isinf(value))
            return "'" + text + "' is beyond the largest number, 1.8e308; write Inf for infinity";
    }
    if (is_signed && text[0] == '-') value = -value;
    return "";
}

} // namespace bf
