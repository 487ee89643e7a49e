#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

namespace bf::kernels {

/// How a real number becomes an integer: `nearest` takes halves up, `away` takes them away from zero.
enum class Rounding { zero, nearest, floor, ceil, away };

/// What happens to a value that the integer type cannot hold.
enum class Overflow { wrap, saturate };

/// x rounded to an integer value of its own type.
template <class T> constexpr T rounded(T x, Rounding rounding) noexcept {
    switch (rounding) {
    case Rounding::zero: return std::trunc(x);
    case Rounding::floor: return std::floor(x);
    case Rounding::ceil: return std::ceil(x);
    case Rounding::away: return std::round(x);
    case Rounding::nearest: break;
    }
    const T below = std::floor(x);
    return x - below >= T(0.5) ? below + T(1) : below;
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
        const double r = rounded(static_cast<double>(x), rounding);
        if (r != r) return 0;
        if (overflow == Overflow::saturate) {
            if (r >= static_cast<double>(Limits::max())) return Limits::max();
            if (r <= static_cast<double>(Limits::min())) return Limits::min();
            return static_cast<To>(r);
        }
        if (r - r != 0) return 0; // ±∞
        return static_cast<To>(static_cast<std::int64_t>(std::fmod(r, 4294967296.0)));
    } else {
        const std::int64_t wide = x;
        if (overflow == Overflow::saturate) {
            if (wide > std::int64_t(Limits::max())) return Limits::max();
            if (wide < std::int64_t(Limits::min())) return Limits::min();
        }
        return static_cast<To>(wide);
    }
}

/// y_i = u_i in the element type of y; see `converted`.
template <Rounding R = Rounding::floor, Overflow O = Overflow::wrap> struct Convert {
    static constexpr const char* name =
        O == Overflow::wrap
            ? (R == Rounding::zero      ? "bf::kernels::Convert<bf::kernels::Rounding::zero>{}"
               : R == Rounding::nearest ? "bf::kernels::Convert<bf::kernels::Rounding::nearest>{}"
               : R == Rounding::floor   ? "bf::kernels::Convert<bf::kernels::Rounding::floor>{}"
               : R == Rounding::ceil    ? "bf::kernels::Convert<bf::kernels::Rounding::ceil>{}"
                                        : "bf::kernels::Convert<bf::kernels::Rounding::away>{}")
            : (R == Rounding::zero      ? "bf::kernels::Convert<bf::kernels::Rounding::zero, "
                                          "bf::kernels::Overflow::saturate>{}"
               : R == Rounding::nearest ? "bf::kernels::Convert<bf::kernels::Rounding::nearest, "
                                          "bf::kernels::Overflow::saturate>{}"
               : R == Rounding::floor   ? "bf::kernels::Convert<bf::kernels::Rounding::floor, "
                                          "bf::kernels::Overflow::saturate>{}"
               : R == Rounding::ceil    ? "bf::kernels::Convert<bf::kernels::Rounding::ceil, "
                                          "bf::kernels::Overflow::saturate>{}"
                                        : "bf::kernels::Convert<bf::kernels::Rounding::away, "
                                          "bf::kernels::Overflow::saturate>{}");
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = converted<Element<Y>>(u[pick(i, u.size())], R, O);
    }
};

} // namespace bf::kernels
