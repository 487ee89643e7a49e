#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

/// Arithmetic of single numbers. Real numbers follow IEEE 754; integers wrap around (two's complement), and
/// their quotient is rounded toward minus infinity, as in Simulink's defaults.
namespace bf::kernels {

// Kernels call these by their plain names, so that they find those of other kinds of numbers too.
using std::ceil;
using std::cos;
using std::fabs;
using std::floor;
using std::fmod;
using std::pow;
using std::round;
using std::sin;
using std::sqrt;
using std::trunc;

template <class T> inline constexpr bool is_real = std::is_floating_point_v<T>;
template <class T> inline constexpr bool is_integer = std::is_integral_v<T> && !std::is_same_v<T, bool>;
/// double, float and the integers, not bool.
template <class T> inline constexpr bool is_number = is_real<T> || is_integer<T>;
/// Numbers and bool.
template <class T> inline constexpr bool is_any = is_number<T> || std::is_same_v<T, bool>;

template <class T> inline constexpr T pi = T(3.14159265358979323846);

/// x, unknown to the optimiser: it cannot fold or replace a call of <cmath> by its own arithmetic, so every
/// build asks the same library. Exact functions (sqrt, floor, fmod) do not need it.
template <class T> inline T opaque(T x) noexcept {
#if defined(__GNUC__) && defined(__x86_64__)
    __asm__("" : "+x"(x)); // stays in its register
    return x;
#elif defined(__GNUC__) && defined(__aarch64__)
    __asm__("" : "+w"(x));
    return x;
#else
    volatile T hidden = x;
    return hidden;
#endif
}

namespace detail {
// The low 32 bits of sum, difference and product do not depend on signs, so unsigned arithmetic wraps.
template <class T> constexpr T wrapped(std::uint32_t bits) noexcept { return static_cast<T>(bits); }
template <class T> constexpr std::uint32_t bits(T x) noexcept { return static_cast<std::uint32_t>(x); }
} // namespace detail

template <class T> constexpr T add(T a, T b) noexcept {
    if constexpr (is_real<T>)
        return a + b;
    else
        return detail::wrapped<T>(detail::bits(a) + detail::bits(b));
}

template <class T> constexpr T subtract(T a, T b) noexcept {
    if constexpr (is_real<T>)
        return a - b;
    else
        return detail::wrapped<T>(detail::bits(a) - detail::bits(b));
}

template <class T> constexpr T negate(T a) noexcept {
    if constexpr (is_real<T>)
        return -a;
    else
        return detail::wrapped<T>(0u - detail::bits(a));
}

template <class T> constexpr T multiply(T a, T b) noexcept {
    if constexpr (is_real<T>)
        return a * b;
    else
        return detail::wrapped<T>(detail::bits(a) * detail::bits(b));
}

/// a / b. Integers: x/0 is the largest or, for x < 0, the smallest value of the type; 0/0 = 0.
template <class T> constexpr T divide(T a, T b) noexcept {
    if constexpr (is_real<T>) {
        return a / b;
    } else {
        if (b == 0)
            return a == 0 ? T(0) : a > 0 ? std::numeric_limits<T>::max() : std::numeric_limits<T>::min();
        const std::int64_t n = a, d = b, q = n / d;
        return static_cast<T>(n % d != 0 && (n < 0) != (d < 0) ? q - 1 : q);
    }
}

/// x to the power e. Exponents which compilers may expand on their own are expanded here, for every compiler.
template <class T> inline T power(T x, T e) noexcept {
    if (e == T(1)) return x;
    if (e == T(2)) return x * x;
    if (e == T(-1)) return T(1) / x;
    return pow(opaque(x), opaque(e));
}

/// Larger of both; NaN only if both are.
template <class T> constexpr T maximum(T a, T b) noexcept { return a > b || b != b ? a : b; }

/// Smaller of both; NaN only if both are.
template <class T> constexpr T minimum(T a, T b) noexcept { return a < b || b != b ? a : b; }

/// x held between the limits; NaN stays NaN.
template <class T> constexpr T clamp(T x, T lower, T upper) noexcept {
    return x > upper ? upper : x < lower ? lower : x;
}

template <class T> constexpr T absolute(T x) noexcept {
    if constexpr (is_real<T>)
        return fabs(x);
    else if constexpr (std::is_signed_v<T>)
        return x < 0 ? negate(x) : x;
    else
        return x;
}

/// Remainder with the sign of the dividend, x - trunc(x/y) y; rem(x, 0) is NaN, or 0 for integers. As in
/// MATLAB and Simulink, a fractional y whose quotient x/y is an integer but for rounding leaves 0: 0.1 is no
/// binary number, and rem(0.3, 0.1) would be 0.1 less a little.
template <class T> constexpr T remainder(T x, T y) noexcept {
    if constexpr (is_real<T>) {
        const T r = fmod(x, y);
        if (r == T(0) || y == floor(y)) return r;
        const T quotient = fabs(x / y);
        const bool is_whole = fabs(quotient - round(quotient)) < std::numeric_limits<T>::epsilon() * quotient;
        return is_whole ? T(0) : r;
    } else {
        return y == T(0) ? T(0) : static_cast<T>(std::int64_t(x) % std::int64_t(y));
    }
}

/// Remainder with the sign of the divisor, x - floor(x/y) y, rounded as `remainder`; mod(x, 0) = x.
template <class T> constexpr T modulo(T x, T y) noexcept {
    if (y == T(0)) return x;
    if constexpr (is_real<T>) {
        const T r = remainder(x, y);
        return r != T(0) && (r < T(0)) != (y < T(0)) ? r + y : r;
    } else {
        const std::int64_t r = std::int64_t(x) % std::int64_t(y);
        return static_cast<T>(r != 0 && (r < 0) != (std::int64_t(y) < 0) ? r + std::int64_t(y) : r);
    }
}

namespace detail {
/// What a zero-crossing function counts, less what does not fit into its type; 0 for NaN and infinities.
template <class T> constexpr std::int32_t counted(T number) noexcept {
    if constexpr (is_real<T>) {
        const T rest = fmod(number, T(1 << 30));
        return rest == rest ? static_cast<std::int32_t>(rest) : 0;
    } else {
        return static_cast<std::int32_t>(number % (1 << 30));
    }
}
/// x without its fraction: of integers the value, in 64 bits.
template <class T> constexpr auto whole(T x) noexcept {
    if constexpr (is_real<T>)
        return trunc(x);
    else
        return static_cast<std::int64_t>(x);
}
} // namespace detail

} // namespace bf::kernels
