#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

namespace bf::kernels {

/// How a real number becomes an integer: of two equally near ones `nearest` takes the upper, `away` that away
/// from zero, `convergent` the even one.
enum class Rounding { zero, nearest, floor, ceil, away, convergent };

/// What happens to a value that the integer type cannot hold.
enum class Overflow { wrap, saturate, error };

/// x rounded to an integer value of its own type.
template <class T> constexpr T rounded(T x, Rounding rounding) noexcept {
    switch (rounding) {
    case Rounding::zero: return trunc(x);
    case Rounding::floor: return floor(x);
    case Rounding::ceil: return ceil(x);
    case Rounding::away: return round(x);
    case Rounding::convergent:
    case Rounding::nearest: break;
    }
    const T below = floor(x), part = x - below;
    if (rounding == Rounding::convergent && part == T(0.5))
        return fmod(below, T(2)) == T(0) ? below : below + T(1);
    return part >= T(0.5) ? below + T(1) : below;
}

/// x as a To. Real to integer rounds, then wraps (modulo 2^bits) or saturates; NaN becomes 0, and so does ±∞
/// when wrapping. Anything to bool is x ≠ 0. Conversions to real numbers round to nearest.
template <class To, class From>
constexpr To converted(From x, Rounding rounding = Rounding::floor,
                       Overflow overflow = Overflow::wrap) noexcept {
    using Limits = std::numeric_limits<To>;
    if constexpr (std::is_same_v<To, bool>) {
        return x != From(0);
    } else if constexpr (is_real<To> || std::is_same_v<From, To>) {
        return static_cast<To>(x);
    } else if constexpr (is_real<From>) {
        const From r = rounded(x, rounding);
        if (r != r) return 0;
        if (overflow == Overflow::saturate) {
            if (r >= static_cast<From>(Limits::max())) return Limits::max();
            if (r <= static_cast<From>(Limits::min())) return Limits::min();
            return static_cast<To>(r);
        }
        if (r - r != 0) return 0; // ±∞
        const From part = fmod(r, From(4294967296));
        const auto bits = static_cast<std::uint32_t>(fabs(part));
        return static_cast<To>(part < From(0) ? 0u - bits : bits);
    } else {
        const std::int64_t wide = x;
        if (overflow == Overflow::saturate) {
            if (wide > std::int64_t(Limits::max())) return Limits::max();
            if (wide < std::int64_t(Limits::min())) return Limits::min();
        }
        return static_cast<To>(wide);
    }
}

/// Does x, once rounded, have a value of its own in To? Never so for NaN and ±∞.
template <class To, class From> constexpr bool fits(From x, Rounding rounding) noexcept {
    using Limits = std::numeric_limits<To>;
    if constexpr (is_real<From>)
        if (x - x != From(0)) return false;
    if constexpr (std::is_same_v<To, bool> || std::is_same_v<To, From> || (is_real<To> && !is_real<From>)) {
        return true;
    } else if constexpr (is_real<To>) {
        using Wide = std::common_type_t<To, From>;
        return fabs(Wide(x)) <= Wide(Limits::max());
    } else if constexpr (is_real<From>) {
        const From r = rounded(x, rounding), above = From(Limits::max() / 2 + 1) * From(2); // a power of 2
        return r >= static_cast<From>(Limits::min()) && r < above;
    } else {
        return std::int64_t(x) >= std::int64_t(Limits::min()) &&
               std::int64_t(x) <= std::int64_t(Limits::max());
    }
}

/// y_i = u_i in the element type of y, see `converted`; options = [rounding overflow], the enumerations as
/// numbers. False for Overflow::error and an element that does not fit.
struct Convert {
    static constexpr const char* name = "bf::kernels::Convert{}";
    static constexpr char failure[] = "a value does not fit the type it is converted to: bound it with a "
                                      "Saturate block, or choose on_overflow: saturate";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class O, class U>
    constexpr bool operator()(const Y& y, const O& options, const U& u) const noexcept {
        const auto rounding = static_cast<Rounding>(static_cast<int>(options[0]));
        const auto overflow = static_cast<Overflow>(static_cast<int>(options[1]));
        bool all_fit = true;
        for (int i = 0; i < y.size(); ++i) {
            const auto x = u[pick(i, u.size())];
            if (overflow == Overflow::error) all_fit = all_fit && fits<Element<Y>>(x, rounding);
            y[i] = converted<Element<Y>>(x, rounding, overflow);
        }
        return all_fit;
    }
};

} // namespace bf::kernels
