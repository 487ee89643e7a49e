// Physical units, checked by the compiler.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string_view>

namespace bf {

/// A unit as exponents of the eight base units of FMI 3.0 (§2.4.4): kg m s A K mol cd rad.
struct Unit {
    enum class Kind : std::uint8_t { exact, any, mixed };

    std::string_view text = "1";
    std::array<std::int8_t, 8> si{};
    Kind kind = Kind::exact;

    /// Same quantity, however spelled: unit<"kg.m2/s2"> == unit<"Nm">.
    constexpr bool operator==(const Unit& other) const { return si == other.si && kind == other.kind; }
    /// May a signal of this unit be wired to a port of the other one?
    constexpr bool agrees_with(const Unit& other) const {
        return kind != Kind::exact || other.kind != Kind::exact || si == other.si;
    }
};

namespace detail {

template <std::size_t N> struct FixedString {
    char chars[N]{};
    constexpr FixedString(const char (&text)[N]) { std::copy_n(text, N, chars); }
};

/// Parses "kg.m2/s2": names joined by '.', everything after '/' divides. Throws for an unknown name, which
/// in a constant expression is a compile error.
constexpr Unit parse_unit(std::string_view text) {
    constexpr std::string_view base[] = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"};
    struct Derived {
        std::string_view name;
        std::array<std::int8_t, 8> si;
    };
    constexpr Derived derived[] = {{"N", {1, 1, -2}},     {"Nm", {1, 2, -2}},   {"Hz", {0, 0, -1}},
                                   {"J", {1, 2, -2}},     {"W", {1, 2, -3}},    {"Pa", {1, -1, -2}},
                                   {"V", {1, 2, -3, -1}}, {"C", {0, 0, 1, 1}},  {"Ohm", {1, 2, -3, -2}},
                                   {"H", {1, 2, -2, -2}}, {"F", {-1, -2, 4, 2}}};
    Unit unit{text, {}};
    int sign = +1;
    for (std::size_t i = 0; i < text.size();) {
        if (text[i] == '.' || text[i] == '1') {
            ++i;
            continue;
        }
        if (text[i] == '/') {
            sign = -1;
            ++i;
            continue;
        }
        std::size_t end = i;
        while (end < text.size() &&
               ((text[end] >= 'A' && text[end] <= 'Z') || (text[end] >= 'a' && text[end] <= 'z')))
            ++end;
        const std::string_view name = text.substr(i, end - i);
        const int exponent =
            end < text.size() && text[end] >= '2' && text[end] <= '9' ? text[end++] - '0' : 1;
        bool known = false;
        for (std::size_t b = 0; b < 8; ++b)
            if (name == base[b]) {
                unit.si[b] = static_cast<std::int8_t>(unit.si[b] + sign * exponent);
                known = true;
            }
        for (const auto& d : derived)
            if (!known && name == d.name) {
                for (std::size_t b = 0; b < 8; ++b)
                    unit.si[b] = static_cast<std::int8_t>(unit.si[b] + sign * exponent * d.si[b]);
                known = true;
            }
        if (!known) throw std::invalid_argument("unknown unit");
        i = end;
    }
    return unit;
}

} // namespace detail

/// unit<"rad/s">. A misspelled unit does not compile.
template <detail::FixedString text>
inline constexpr Unit unit = detail::parse_unit(std::string_view(text.chars));

inline constexpr Unit any_unit{"any", {}, Unit::Kind::any};        ///< taken from whatever is wired
inline constexpr Unit mixed_units{"mixed", {}, Unit::Kind::mixed}; ///< elements differ; the doc says how

} // namespace bf
