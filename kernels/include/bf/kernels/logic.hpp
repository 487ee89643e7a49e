#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// Relations and logic. y is bool (or receives 0 and 1); an operand counts as true when it is not 0.
namespace bf::kernels {

/// y_i = F::apply(a_i, b_i); operands of two types are compared as double, which holds every integer of 32
/// bits.
template <class F> struct Relation {
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        using T = std::conditional_t<std::is_same_v<Element<A>, Element<B>>, Element<A>, double>;
        for (int i = 0; i < y.size(); ++i)
            y[i] = F::apply(static_cast<T>(a[pick(i, a.size())]), static_cast<T>(b[pick(i, b.size())]));
    }
};

/// y = (a = b).
struct Equal : Relation<Equal> {
    static constexpr const char* name = "bf::kernels::Equal{}";
    template <class T> static constexpr bool apply(T a, T b) noexcept { return a == b; }
};

/// y = (a ≠ b).
struct NotEqual : Relation<NotEqual> {
    static constexpr const char* name = "bf::kernels::NotEqual{}";
    template <class T> static constexpr bool apply(T a, T b) noexcept { return a != b; }
};

/// y = (a < b).
struct Less : Relation<Less> {
    static constexpr const char* name = "bf::kernels::Less{}";
    template <class T> static constexpr bool apply(T a, T b) noexcept { return a < b; }
};

/// y = (a ≤ b).
struct LessEqual : Relation<LessEqual> {
    static constexpr const char* name = "bf::kernels::LessEqual{}";
    template <class T> static constexpr bool apply(T a, T b) noexcept { return a <= b; }
};

/// y = (a > b).
struct Greater : Relation<Greater> {
    static constexpr const char* name = "bf::kernels::Greater{}";
    template <class T> static constexpr bool apply(T a, T b) noexcept { return a > b; }
};

/// y = (a ≥ b).
struct GreaterEqual : Relation<GreaterEqual> {
    static constexpr const char* name = "bf::kernels::GreaterEqual{}";
    template <class T> static constexpr bool apply(T a, T b) noexcept { return a >= b; }
};

/// Joins truth values from left to right. Several operands are joined element by element, scalars expanding;
/// a single operand is joined over its elements into the scalar y. y is none of the operands.
template <class F> struct Logic {
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class L> constexpr void operator()(const Y& y, const L& u) const noexcept {
        if (u.size() == 1) {
            bool value = F::start;
            for (int i = 0; i < u[0].size(); ++i) value = F::join(value, u[0][i] != 0);
            y[0] = F::inverted != value;
            return;
        }
        for (int i = 0; i < y.size(); ++i) {
            bool value = F::start;
            for (int k = 0; k < u.size(); ++k) value = F::join(value, u[k][pick(i, u[k].size())] != 0);
            y[i] = F::inverted != value;
        }
    }
};

/// y = all operands are true.
struct And : Logic<And> {
    static constexpr const char* name = "bf::kernels::And{}";
    static constexpr bool start = true, inverted = false;
    static constexpr bool join(bool a, bool b) noexcept { return a && b; }
};

/// y = an operand is true.
struct Or : Logic<Or> {
    static constexpr const char* name = "bf::kernels::Or{}";
    static constexpr bool start = false, inverted = false;
    static constexpr bool join(bool a, bool b) noexcept { return a || b; }
};

/// y = not all operands are true.
struct Nand : Logic<Nand> {
    static constexpr const char* name = "bf::kernels::Nand{}";
    static constexpr bool start = true, inverted = true;
    static constexpr bool join(bool a, bool b) noexcept { return a && b; }
};

/// y = no operand is true.
struct Nor : Logic<Nor> {
    static constexpr const char* name = "bf::kernels::Nor{}";
    static constexpr bool start = false, inverted = true;
    static constexpr bool join(bool a, bool b) noexcept { return a || b; }
};

/// y = an odd number of operands is true.
struct Xor : Logic<Xor> {
    static constexpr const char* name = "bf::kernels::Xor{}";
    static constexpr bool start = false, inverted = false;
    static constexpr bool join(bool a, bool b) noexcept { return a != b; }
};

/// y = an even number of operands is true.
struct Xnor : Logic<Xnor> {
    static constexpr const char* name = "bf::kernels::Xnor{}";
    static constexpr bool start = false, inverted = true;
    static constexpr bool join(bool a, bool b) noexcept { return a != b; }
};

/// y_i = (u_i = 0).
struct Not {
    static constexpr const char* name = "bf::kernels::Not{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = u[pick(i, u.size())] == 0;
    }
};

/// y = every element of u is true: what an assertion asks.
struct All {
    static constexpr const char* name = "bf::kernels::All{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        bool value = true;
        for (int i = 0; i < u.size(); ++i) value = value && u[i] != 0;
        y[0] = value;
    }
};

/// y = some element of u is true.
struct Any {
    static constexpr const char* name = "bf::kernels::Any{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        bool value = false;
        for (int i = 0; i < u.size(); ++i) value = value || u[i] != 0;
        y[0] = value;
    }
};

/// y = some element of u is above 0: what an enabled subsystem asks.
struct AnyPositive {
    static constexpr const char* name = "bf::kernels::AnyPositive{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        bool value = false;
        for (int i = 0; i < u.size(); ++i) value = value || u[i] > 0;
        y[0] = value;
    }
};

/// y_i = F::apply(a_i, b_i) on the bits of integers.
template <class F> struct Bitwise {
    template <class T> static constexpr bool accepts = is_integer<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        using T = Element<Y>;
        for (int i = 0; i < y.size(); ++i)
            y[i] = static_cast<T>(
                F::apply(static_cast<T>(a[pick(i, a.size())]), static_cast<T>(b[pick(i, b.size())])));
    }
};

/// y = bits of a and b.
struct BitAnd : Bitwise<BitAnd> {
    static constexpr const char* name = "bf::kernels::BitAnd{}";
    template <class T> static constexpr auto apply(T a, T b) noexcept { return a & b; }
};

/// y = bits of a or b.
struct BitOr : Bitwise<BitOr> {
    static constexpr const char* name = "bf::kernels::BitOr{}";
    template <class T> static constexpr auto apply(T a, T b) noexcept { return a | b; }
};

/// y = bits of either a or b.
struct BitXor : Bitwise<BitXor> {
    static constexpr const char* name = "bf::kernels::BitXor{}";
    template <class T> static constexpr auto apply(T a, T b) noexcept { return a ^ b; }
};

/// y = every bit of u inverted.
struct BitNot {
    static constexpr const char* name = "bf::kernels::BitNot{}";
    template <class T> static constexpr bool accepts = is_integer<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = static_cast<Element<Y>>(~u[pick(i, u.size())]);
    }
};

} // namespace bf::kernels
