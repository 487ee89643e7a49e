// What the C++20 library of emscripten 3.1.6 lacks of what the core uses: algorithms on ranges, numbers as
// text. Every source that is compiled to WebAssembly includes it first; a newer library has all of it.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iterator>

#if _LIBCPP_VERSION < 14000

namespace std {

namespace ranges {

template <class Predicate, class Projection> constexpr auto projected(Predicate& predicate, Projection& by) {
    return [&](auto&& x) -> bool { return std::invoke(predicate, std::invoke(by, x)); };
}
template <class Compare, class Projection> constexpr auto compared(Compare& compare, Projection& by) {
    return [&](auto&& a, auto&& b) -> bool {
        return std::invoke(compare, std::invoke(by, a), std::invoke(by, b));
    };
}
template <class T, class Projection> constexpr auto equals(const T& value, Projection& by) {
    return [&](auto&& x) -> bool { return std::invoke(by, x) == value; };
}

template <class R, class T, class P = identity> constexpr auto find(R&& r, const T& value, P by = {}) {
    return std::find_if(std::begin(r), std::end(r), equals(value, by));
}
template <class R, class T, class P = identity> constexpr auto count(R&& r, const T& value, P by = {}) {
    return std::count_if(std::begin(r), std::end(r), equals(value, by));
}
template <class R, class F, class P = identity> constexpr auto find_if(R&& r, F is, P by = {}) {
    return std::find_if(std::begin(r), std::end(r), projected(is, by));
}
template <class R, class F, class P = identity> constexpr auto count_if(R&& r, F is, P by = {}) {
    return std::count_if(std::begin(r), std::end(r), projected(is, by));
}
template <class R, class F, class P = identity> constexpr bool any_of(R&& r, F is, P by = {}) {
    return std::any_of(std::begin(r), std::end(r), projected(is, by));
}
template <class R, class F, class P = identity> constexpr bool all_of(R&& r, F is, P by = {}) {
    return std::all_of(std::begin(r), std::end(r), projected(is, by));
}
template <class R, class F, class P = identity> constexpr bool none_of(R&& r, F is, P by = {}) {
    return std::none_of(std::begin(r), std::end(r), projected(is, by));
}
template <class A, class B, class F = equal_to, class P = identity, class Q = identity>
constexpr bool equal(A&& a, B&& b, F is_same = {}, P of_a = {}, Q of_b = {}) {
    return std::equal(std::begin(a), std::end(a), std::begin(b), std::end(b),
                      [&](auto&& x, auto&& y) -> bool {
                          return std::invoke(is_same, std::invoke(of_a, x), std::invoke(of_b, y));
                      });
}
template <class R, class C = less, class P = identity> constexpr void sort(R&& r, C compare = {}, P by = {}) {
    std::sort(std::begin(r), std::end(r), compared(compare, by));
}
template <class R, class C = less, class P = identity> void stable_sort(R&& r, C compare = {}, P by = {}) {
    std::stable_sort(std::begin(r), std::end(r), compared(compare, by));
}
template <class R, class C = less, class P = identity>
constexpr auto max_element(R&& r, C compare = {}, P by = {}) {
    return std::max_element(std::begin(r), std::end(r), compared(compare, by));
}
template <class T> struct min_max_result { T min, max; };
template <class R, class C = less, class P = identity>
constexpr auto minmax(R&& r, C compare = {}, P by = {}) {
    const auto [min, max] = std::minmax_element(std::begin(r), std::end(r), compared(compare, by));
    return min_max_result<iter_value_t<decltype(std::begin(r))>>{*min, *max};
}
template <class R, class T, class C = less, class P = identity>
constexpr auto lower_bound(R&& r, const T& value, C compare = {}, P by = {}) {
    return std::lower_bound(std::begin(r), std::end(r), value, [&](auto&& x, auto&& v) -> bool {
        return std::invoke(compare, std::invoke(by, x), v);
    });
}
template <class R, class T, class C = less, class P = identity>
constexpr auto upper_bound(R&& r, const T& value, C compare = {}, P by = {}) {
    return std::upper_bound(std::begin(r), std::end(r), value, [&](auto&& v, auto&& x) -> bool {
        return std::invoke(compare, v, std::invoke(by, x));
    });
}
template <class R> constexpr void reverse(R&& r) { std::reverse(std::begin(r), std::end(r)); }
template <class R, class Out> constexpr void move(R&& r, Out to) {
    std::move(std::begin(r), std::end(r), to);
}
template <class R, class Out, class F> constexpr void transform(R&& r, Out to, F made) {
    std::transform(std::begin(r), std::end(r), to, [&](auto&& x) { return std::invoke(made, x); });
}

} // namespace ranges

/// The fewest digits that read as the same number: without an exponent where that is no longer.
template <class T>
requires is_floating_point_v<T> to_chars_result to_chars(char* first, char* last, T x) {
    char text[400];
    if (!isfinite(x)) {
        snprintf(text, sizeof text, "%s%s", signbit(x) ? "-" : "", isnan(x) ? "nan" : "inf");
    } else {
        int digits = 0;
        do snprintf(text, sizeof text, "%.*e", digits, static_cast<double>(x));
        while (static_cast<T>(is_same_v<T, float> ? strtof(text, nullptr) : strtod(text, nullptr)) != x &&
               ++digits < 17);
        const int exponent = atoi(strchr(text, 'e') + 1);
        char fixed[400];
        snprintf(fixed, sizeof fixed, "%.*f", max(0, digits - exponent), static_cast<double>(x));
        if (strlen(fixed) <= strlen(text)) strcpy(text, fixed);
    }
    const auto size = static_cast<ptrdiff_t>(strlen(text));
    if (size > last - first) return {last, errc::value_too_large};
    return {copy_n(text, size, first), errc()};
}

} // namespace std

#endif
