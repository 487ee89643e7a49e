#pragma once

#include "bf/kernels/convert.hpp"

/// Arithmetic that watches the range of its type: integers are computed exactly, operand by operand, then
/// held at the limits of the type. With stops ≠ 0 the kernels return false where that would change a result,
/// and where a real result is not finite.
namespace bf::kernels {

namespace detail {

/// x in T, nearest; `good` becomes false when that is another number or not finite.
template <class T, class W> constexpr T held(W x, bool& good) noexcept {
    if constexpr (is_real<T>) {
        good = good && x - x == 0;
        return static_cast<T>(x);
    } else {
        constexpr W low = static_cast<W>(std::numeric_limits<T>::min());
        constexpr W high = static_cast<W>(std::numeric_limits<T>::max());
        const W y = clamp(x, low, high);
        good = good && y == x;
        return static_cast<T>(y);
    }
}

/// A type in which sums and products of two T are exact; reals stay as they are.
template <class T>
using Wide =
    std::conditional_t<is_real<T>, T,
                       std::conditional_t<std::is_signed_v<T> || sizeof(T) < 4, std::int64_t, std::uint64_t>>;

} // namespace detail

/// y = ± u_0 ± u_1 …, see Sum. y is none of the operands.
struct BoundedSum {
    static constexpr const char* name = "bf::kernels::BoundedSum{}";
    static constexpr char failure[] = "the sum leaves the range of its type: scale the signals, or choose "
                                      "on_overflow: saturate";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class O, class S, class L>
    constexpr bool operator()(const Y& y, const O& stops, const S& signs, const L& u) const noexcept {
        using T = Element<Y>;
        using W = std::conditional_t<is_real<T>, T, std::int64_t>; // sums of 32 bits are exact in 64
        bool good = true;
        for (int i = 0; i < y.size(); ++i) {
            W sum = 0;
            for (int k = 0; k < u.size(); ++k) {
                const W x = static_cast<W>(u[k][pick(i, u[k].size())]);
                sum = signs[pick(k, signs.size())] < 0 ? sum - x : sum + x;
            }
            y[i] = detail::held<T>(sum, good);
        }
        return good || stops[0] == 0;
    }
};

/// y_i = K_i u_i.
struct BoundedGain {
    static constexpr const char* name = "bf::kernels::BoundedGain{}";
    static constexpr char failure[] = "the product leaves the range of its type: scale the signal, or choose "
                                      "on_overflow: saturate";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class O, class K, class U>
    constexpr bool operator()(const Y& y, const O& stops, const K& k, const U& u) const noexcept {
        using T = Element<Y>;
        using W = detail::Wide<T>;
        bool good = true;
        for (int i = 0; i < y.size(); ++i)
            y[i] = detail::held<T>(
                static_cast<W>(static_cast<W>(k[pick(i, k.size())]) * static_cast<W>(u[pick(i, u.size())])),
                good);
        return good || stops[0] == 0;
    }
};

/// y = u_0^±1 u_1^±1 …, held after each operand; see ElementProduct. y is none of the operands.
struct BoundedProduct {
    static constexpr const char* name = "bf::kernels::BoundedProduct{}";
    static constexpr char failure[] = "the product leaves the range of its type: scale the signals, look for "
                                      "a division by zero, or choose on_overflow: saturate";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class O, class E, class L>
    constexpr bool operator()(const Y& y, const O& stops, const E& exponents, const L& u) const noexcept {
        using T = Element<Y>;
        using W = detail::Wide<T>;
        bool good = true;
        for (int i = 0; i < y.size(); ++i) {
            y[i] = T(1);
            for (int k = 0; k < u.size(); ++k) {
                const T x = u[k][pick(i, u[k].size())];
                if (exponents[pick(k, exponents.size())] < 0) {
                    good = good && x != T(0);
                    // The only quotient that is too large: the smallest number by -1.
                    y[i] = !is_real<T> && std::is_signed_v<T> && x == T(-1)
                               ? detail::held<T>(static_cast<W>(W(0) - static_cast<W>(y[i])), good)
                               : divide(y[i], x);
                    if constexpr (is_real<T>) y[i] = detail::held<T>(y[i], good);
                } else {
                    y[i] = detail::held<T>(static_cast<W>(static_cast<W>(y[i]) * static_cast<W>(x)), good);
                }
            }
        }
        return good || stops[0] == 0;
    }
};

} // namespace bf::kernels
