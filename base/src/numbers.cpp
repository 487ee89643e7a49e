#include "bf/base/numbers.hpp"

#if !defined(__cpp_lib_to_chars)
#include <cmath>
#include <cstdlib>
#include <locale.h>
#endif

namespace bf {
namespace {

template <class T> std::string shortest(T x) {
    char text[40];
    return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

} // namespace

std::string number_text(double x) { return shortest(x); }
std::string number_text(float x) { return shortest(x); }

#if defined(__cpp_lib_to_chars)

std::from_chars_result read_number(const char* first, const char* last, double& value) {
    return std::from_chars(first, last, value);
}

#else

std::from_chars_result read_number(const char* first, const char* last, double& value) {
    static const locale_t c = newlocale(LC_ALL_MASK, "C", nullptr);
    // strtod also reads what std::from_chars does not: blanks and a plus in front, and hexadecimal numbers.
    const char* digits = first != last && *first == '-' ? first + 1 : first;
    const bool begins =
        digits != last && (*digits == '.' || *digits == 'i' || *digits == 'I' || *digits == 'n' ||
                           *digits == 'N' || (*digits >= '0' && *digits <= '9'));
    if (!begins) return {first, std::errc::invalid_argument};
    if (last - digits > 1 && digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')) {
        value = digits == first ? 0.0 : -0.0;
        return {digits + 1, std::errc()};
    }
    const std::string text(first, last);
    char* end = nullptr;
    const double x = strtod_l(text.c_str(), &end, c);
    if (end == text.c_str()) return {first, std::errc::invalid_argument};
    const char* stop = first + (end - text.c_str());
    const bool is_out_of_range =
        (std::isinf(x) && *digits != 'i' && *digits != 'I') ||
        (x == 0 && text.find_first_of("123456789") < static_cast<std::size_t>(end - text.c_str()) &&
         text.find_first_of("123456789") < text.find_first_of("eE"));
    if (is_out_of_range) return {stop, std::errc::result_out_of_range};
    value = x;
    return {stop, std::errc()};
}

#endif

} // namespace bf
