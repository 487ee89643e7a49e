// Numbers as text, the same in every locale and with every C++ library.
#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>

namespace bf {

/// The shortest text that reads back as the same number: `0.1`, `-0`, `1e+23`, `inf`, `nan`.
std::string number_text(double x);
std::string number_text(float x);

/// As std::from_chars reads a number of its general format from the beginning of [first, last): where it
/// ends, and std::errc::invalid_argument where none begins, std::errc::result_out_of_range where it fits no
/// double. libc++ has that function for whole numbers only.
std::from_chars_result read_number(const char* first, const char* last, double& value);

inline std::from_chars_result read_number(const char* first, const char* last, std::integral auto& value) {
    return std::from_chars(first, last, value);
}

/// The number that the whole text is; nothing if it is none or does not fit.
template <class T = double> std::optional<T> number_of(std::string_view text) {
    T value{};
    const char* const last = text.data() + text.size();
    const auto [end, error] = read_number(text.data(), last, value);
    return error == std::errc() && end == last ? std::optional(value) : std::nullopt;
}

} // namespace bf
