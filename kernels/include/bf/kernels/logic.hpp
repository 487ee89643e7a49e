#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// Relations and logic. y is bool (or receives 0 and 1); an operand counts as true when it is not 0.
namespace bf::kernels {

namespace detail {

/// How x compares with a promoted integer n, without rounding: something below, at or above 0, or NaN.
template <class T, class I> constexpr T compared(T x, I n) noexcept {
    using Limits = std::numeric_limits<I>;
    if (!(x >= T(Limits::min()))) return x == x ? T(-1) : x;
    if (x >= T(Limits::max() / 2 + 1) * T(2)) return T(1);
    const I part = static_cast<I>(x);
    return part > n ? T(1) : part < n ? T(-1) : x - static_cast<T>(part);
}

} // namespace detail

/// y_i = F::apply(a_i, b_i), as the numbers compare, also those of two types.
template <class F> struct Relation {
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        using TA = Element<A>;
        using TB = Element<B>;
        // 64 bits hold all integers, and double all integers and floats.
        using T = std::conditional_t<is_real<TA> == is_real<TB> && !is_real<TA>, std::int64_t,
                                     std::common_type_t<TA, TB>>;
        for (int i = 0; i < y.size(); ++i) {
            const TA left = a[pick(i, a.size())];
            const TB right = b[pick(i, b.size())];
            if constexpr (std::is_same_v<TA, TB>)
                y[i] = F::apply(left, right);
            else if constexpr (std::is_same_v<T, float> && !is_real<TB>)
                y[i] = F::apply(detail::compared(left, +right), 0.0f);
            else if constexpr (std::is_same_v<T, float>)
                y[i] = F::apply(0.0f, detail::compared(right, +left));
            else
                y[i] = F::apply(static_cast<T>(left), static_cast<T>(right));
        }
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

/// Bits of all operands joined by F from left to right, or of a single one over its elements, then inverted
/// if F::inverted. y is none of the operands.
template <class F> struct BitwiseList {
    template <class T> static constexpr bool accepts = is_integer<T>;
    template <class Y, class L> constexpr void operator()(const Y& y, const L& u) const noexcept {
        using T = Element<Y>;
        const bool over_elements = u.size() == 1;
        for (int i = 0; i < y.size(); ++i) {
            T bits = u[0][over_elements ? 0 : pick(i, u[0].size())];
            for (int k = 1; k < (over_elements ? u[0].size() : u.size()); ++k)
                bits = static_cast<T>(F::join(bits, over_elements ? u[0][k] : u[k][pick(i, u[k].size())]));
            y[i] = F::inverted ? static_cast<T>(~bits) : bits;
        }
    }
};

/// y = bits that all operands have.
struct BitAndOfList : BitwiseList<BitAndOfList> {
    static constexpr const char* name = "bf::kernels::BitAndOfList{}";
    static constexpr bool inverted = false;
    template <class T> static constexpr auto join(T a, T b) noexcept { return a & b; }
};

/// y = bits that an operand has.
struct BitOrOfList : BitwiseList<BitOrOfList> {
    static constexpr const char* name = "bf::kernels::BitOrOfList{}";
    static constexpr bool inverted = false;
    template <class T> static constexpr auto join(T a, T b) noexcept { return a | b; }
};

/// y = bits that an odd number of operands has.
struct BitXorOfList : BitwiseList<BitXorOfList> {
    static constexpr const char* name = "bf::kernels::BitXorOfList{}";
    static constexpr bool inverted = false;
    template <class T> static constexpr auto join(T a, T b) noexcept { return a ^ b; }
};

/// y = bits that not all operands have.
struct BitNandOfList : BitwiseList<BitNandOfList> {
    static constexpr const char* name = "bf::kernels::BitNandOfList{}";
    static constexpr bool inverted = true;
    template <class T> static constexpr auto join(T a, T b) noexcept { return a & b; }
};

/// y = bits that no operand has.
struct BitNorOfList : BitwiseList<BitNorOfList> {
    static constexpr const char* name = "bf::kernels::BitNorOfList{}";
    static constexpr bool inverted = true;
    template <class T> static constexpr auto join(T a, T b) noexcept { return a | b; }
};

/// y = u shifted by `places` bits, up if positive: zeros come in from below, and from above the sign's bit.
struct ShiftBits {
    static constexpr const char* name = "bf::kernels::ShiftBits{}";
    template <class T> static constexpr bool accepts = is_integer<T>;
    template <class Y, class P, class U>
    constexpr void operator()(const Y& y, const P& places, const U& u) const noexcept {
        using T = Element<Y>;
        const int n = static_cast<int>(clamp(places[0], Element<P>(-32), Element<P>(32)));
        for (int i = 0; i < y.size(); ++i) {
            const std::int64_t x = u[pick(i, u.size())]; // 64 bits hold every shift of 32 by 32
            y[i] = static_cast<T>(n < 0 ? x >> -n : x * (std::int64_t(1) << (n < 32 ? n : 32)));
        }
    }
};

/// y = lower < u < upper, ends included where closed_lower or closed_upper ≠ 0.
struct Inside {
    static constexpr const char* name = "bf::kernels::Inside{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class C, class L, class H, class U>
    constexpr void operator()(const Y& y, const C& closed, const L& lower, const H& upper,
                              const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const auto x = u[pick(i, u.size())];
            const auto low = lower[pick(i, lower.size())], high = upper[pick(i, upper.size())];
            y[i] = (x > low || (closed[0] != 0 && x == low)) && (x < high || (closed[1] != 0 && x == high));
        }
    }
};

/// y = row of a truth table: the inputs are the digits of its number, the first one the highest.
struct TruthTable {
    static constexpr const char* name = "bf::kernels::TruthTable{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class M, class U>
    constexpr void operator()(const Y& y, const M& table, const U& u) const noexcept {
        int row = 0;
        for (int i = 0; i < u.size(); ++i) row = 2 * row + (u[i] != 0);
        const int rows = 1 << u.size();
        for (int j = 0; j < y.size(); ++j) y[j] = static_cast<Element<Y>>(table[row + j * rows]);
    }
};

/// y = u ≠ previous.
struct Changed {
    static constexpr const char* name = "bf::kernels::Changed{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U>
    constexpr void operator()(const Y& y, const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = u[i] != previous[i];
    }
};

/// y = u > previous.
struct Increased {
    static constexpr const char* name = "bf::kernels::Increased{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U>
    constexpr void operator()(const Y& y, const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = u[i] > previous[i];
    }
};

/// y = u < previous.
struct Decreased {
    static constexpr const char* name = "bf::kernels::Decreased{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class X, class U>
    constexpr void operator()(const Y& y, const X& previous, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = u[i] < previous[i];
    }
};

/// Set-reset flip-flop: q = 1 by set, 0 by reset, as before by neither; both give 0 in q and nq.
struct SetReset {
    static constexpr const char* name = "bf::kernels::SetReset{}";
    template <class Q, class N, class X, class S, class R>
    constexpr void operator()(const Q& q, const N& nq, const X& before, const S& set,
                              const R& reset) const noexcept {
        q[0] = !reset[0] && (set[0] || before[0]);
        nq[0] = !set[0] && (reset[0] || !before[0]);
    }
};

/// D flip-flop: q = d where the clock rises, else as before.
struct DFlipFlop {
    static constexpr const char* name = "bf::kernels::DFlipFlop{}";
    template <class Q, class N, class X, class C, class D, class K>
    constexpr void operator()(const Q& q, const N& nq, const X& before, const C& clock_before, const D& d,
                              const K& clock) const noexcept {
        q[0] = clock[0] && !clock_before[0] ? d[0] : before[0];
        nq[0] = !q[0];
    }
};

/// J-K flip-flop: where the clock falls, j sets, k resets, both toggle; else as before.
struct JKFlipFlop {
    static constexpr const char* name = "bf::kernels::JKFlipFlop{}";
    template <class Q, class N, class X, class C, class J, class K, class L>
    constexpr void operator()(const Q& q, const N& nq, const X& before, const C& clock_before, const J& j,
                              const K& k, const L& clock) const noexcept {
        const bool old = static_cast<bool>(before[0]);
        q[0] = !clock[0] && clock_before[0] ? (old ? !k[0] : j[0]) : old;
        nq[0] = !q[0];
    }
};

} // namespace bf::kernels
