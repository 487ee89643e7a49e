#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// Element by element; every operand has the size of y or is a scalar. An operand may be the same memory as
/// y.
namespace bf::kernels {

/// A kernel that engines also compile for scalars alone, which are the most frequent signals by far.
struct Elementwise {
    static constexpr bool is_elementwise = true;
};

/// One that takes no longer for some more elements, whatever they are: engines may have it fill the last
/// register of an array.
struct Arithmetic : Elementwise {
    static constexpr bool is_arithmetic = true;
};

/// y_i = F::apply(u_i).
template <class F, class Kind = Elementwise> struct Unary : Kind {
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = static_cast<Element<Y>>(F::apply(u[pick(i, u.size())]));
    }
};

/// y_i = F::apply(a_i, b_i), computed in the type of a.
template <class F, class Kind = Elementwise> struct Binary : Kind {
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        using T = Element<A>;
        for (int i = 0; i < y.size(); ++i)
            y[i] =
                static_cast<Element<Y>>(F::apply(a[pick(i, a.size())], static_cast<T>(b[pick(i, b.size())])));
    }
};

/// y = u.
struct Copy : Unary<Copy, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Copy{}";
    static constexpr bool is_move = true;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class T> static constexpr T apply(T x) noexcept { return x; }
};

/// y_i = K_i u_i.
struct Gain : Arithmetic {
    static constexpr const char* name = "bf::kernels::Gain{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class K, class U>
    constexpr void operator()(const Y& y, const K& k, const U& u) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i)
            y[i] = multiply(static_cast<T>(k[pick(i, k.size())]), static_cast<T>(u[pick(i, u.size())]));
    }
};

/// y_i = next(first(s_0, u_0i), s_1, u_1i) and so on over the operands, where s_k says that sign k is
/// negative. y is none of the operands.
template <class Y, class S, class L, class First, class Next>
constexpr void fold(const Y& y, const S& signs, const L& u, const First& first, const Next& next) noexcept {
    const auto is_negative = [&](int k) { return signs[pick(k, signs.size())] < 0; };
    const auto element = [&](int k, int i) { return u[k][pick(i, u[k].size())]; };
    const auto element_by_element = [&] {
        for (int i = 0; i < y.size(); ++i) {
            auto folded = first(is_negative(0), element(0, i));
            for (int k = 1; k < u.size(); ++k) folded = next(folded, is_negative(k), element(k, i));
            y[i] = folded;
        }
    };
    if constexpr (is_fixed<Y>) // the compiler knows operands and signs
        element_by_element();
    else if (y.size() == 1) // one number stays in a register
        element_by_element();
    else {
        const bool is_first_minus = is_negative(0);
        const auto& a = u[0];
        int k = 1;
        // Most sums begin with two signals of one size: y is passed once for both.
        if (u.size() > 1 && a.size() == y.size() && u[1].size() == y.size()) {
            const bool is_second_minus = is_negative(1);
            const auto& b = u[1];
            for (int i = 0; i < y.size(); ++i)
                y[i] = next(first(is_first_minus, a[i]), is_second_minus, b[i]);
            k = 2;
        } else {
            for (int i = 0; i < y.size(); ++i) y[i] = first(is_first_minus, a[pick(i, a.size())]);
        }
        for (; k < u.size(); ++k) {
            const auto& x = u[k];
            const bool is_minus = is_negative(k);
            for (int i = 0; i < y.size(); ++i) y[i] = next(y[i], is_minus, x[pick(i, x.size())]);
        }
    }
}

/// y = ± u_0 ± u_1 …, from left to right; signs_k < 0 subtracts operand k. y is none of the operands.
struct Sum : Arithmetic {
    static constexpr const char* name = "bf::kernels::Sum{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class S, class L>
    constexpr void operator()(const Y& y, const S& signs, const L& u) const noexcept {
        using T = Element<Y>;
        fold(
            y, signs, u, [](bool minus, T value) { return minus ? negate(value) : value; },
            [](T sum, bool minus, T value) { return minus ? subtract(sum, value) : add(sum, value); });
    }
};

/// y = u_0^±1 u_1^±1 …, from left to right; exponents_k < 0 divides by operand k. y is none of the operands.
struct ElementProduct : Arithmetic {
    static constexpr const char* name = "bf::kernels::ElementProduct{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class E, class L>
    constexpr void operator()(const Y& y, const E& exponents, const L& u) const noexcept {
        using T = Element<Y>;
        fold(
            y, exponents, u, [](bool over, T value) { return over ? divide(T(1), value) : value; },
            [](T product, bool over, T value) {
                return over ? divide(product, value) : multiply(product, value);
            });
    }
};

/// y = a + b.
struct Add : Binary<Add, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Add{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return add(a, b); }
};

/// y = a - b.
struct Subtract : Binary<Subtract, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Subtract{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return subtract(a, b); }
};

/// y = a b.
struct Multiply : Binary<Multiply, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Multiply{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return multiply(a, b); }
};

/// y = a / b; integers see `divide`.
struct Divide : Binary<Divide, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Divide{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return divide(a, b); }
};

/// y = -u.
struct Negate : Unary<Negate, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Negate{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T x) noexcept { return negate(x); }
};

/// y = |u|; the smallest signed integer wraps to itself.
struct Abs : Unary<Abs, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Abs{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T x) noexcept { return absolute(x); }
};

/// y = 1, 0 or -1 by the sign of u; NaN stays NaN.
struct Sign : Unary<Sign> {
    static constexpr const char* name = "bf::kernels::Sign{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T x) noexcept {
        return x > T(0) ? T(1) : x < T(0) ? static_cast<T>(-1) : x;
    }
};

/// y = u².
struct Square : Unary<Square, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Square{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T x) noexcept { return multiply(x, x); }
};

/// y = min(a, b), ignoring NaN.
struct Minimum : Binary<Minimum, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Minimum{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return minimum(a, b); }
};

/// y = max(a, b), ignoring NaN.
struct Maximum : Binary<Maximum, Arithmetic> {
    static constexpr const char* name = "bf::kernels::Maximum{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return maximum(a, b); }
};

/// y = a - floor(a/b) b, sign of b; a for b = 0. See `modulo` for quotients near integers.
struct Mod : Binary<Mod> {
    static constexpr const char* name = "bf::kernels::Mod{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return modulo(a, b); }
};

/// y = a - trunc(a/b) b, sign of a; NaN for b = 0, or 0 for integers. See `remainder`.
struct Rem : Binary<Rem> {
    static constexpr const char* name = "bf::kernels::Rem{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class T> static constexpr T apply(T a, T b) noexcept { return remainder(a, b); }
};

/// y_i = smallest of the operands' elements i, ignoring NaN. y is none of the operands.
struct MinimumOfList {
    static constexpr const char* name = "bf::kernels::MinimumOfList{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class L> constexpr void operator()(const Y& y, const L& u) const noexcept {
        for (int k = 0; k < u.size(); ++k)
            for (int i = 0; i < y.size(); ++i) {
                const auto x = u[k][pick(i, u[k].size())];
                y[i] = k == 0 ? x : minimum(y[i], x);
            }
    }
};

/// y_i = largest of the operands' elements i, ignoring NaN. y is none of the operands.
struct MaximumOfList {
    static constexpr const char* name = "bf::kernels::MaximumOfList{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class L> constexpr void operator()(const Y& y, const L& u) const noexcept {
        for (int k = 0; k < u.size(); ++k)
            for (int i = 0; i < y.size(); ++i) {
                const auto x = u[k][pick(i, u[k].size())];
                y[i] = k == 0 ? x : maximum(y[i], x);
            }
    }
};

} // namespace bf::kernels
