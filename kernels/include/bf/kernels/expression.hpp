#pragma once

#include "bf/kernels/functions.hpp"
#include "bf/kernels/guards.hpp"

/// Formulas that are known only when a block is made.
namespace bf::kernels {

/// What one instruction of an Expression does to its stack of numbers.
enum class Operation {
    number,    ///< pushes the operand
    element,   ///< pushes element i of input `operand`, i being that of the result
    fixed,     ///< pushes element `index` of input `operand`
    parameter, ///< pushes p at `operand`
    negative,
    logical_not,
    abs,
    sign,
    sqrt,
    exp,
    log,
    log10,
    sin,
    cos,
    tan,
    asin,
    acos,
    atan,
    sinh,
    cosh,
    tanh,
    asinh,
    acosh,
    atanh,
    expm1,
    log1p,
    log2,
    deg2rad,
    rad2deg,
    floor,
    ceil,
    round,
    fix, ///< of the number on top
    plus,
    minus,
    times,
    over,
    power,
    less,
    less_equal,
    greater,
    greater_equal,
    equal,
    not_equal,
    logical_and,
    logical_or,
    min,
    max,
    atan2,
    hypot,
    mod,
    rem ///< of the two on top, the upper one right
};

/// Their names: those of functions are MATLAB's.
inline constexpr const char* operation_names[] = {
    "number",  "element",       "fixed", "parameter", "negative",    "logical_not", "abs",   "sign",
    "sqrt",    "exp",           "log",   "log10",     "sin",         "cos",         "tan",   "asin",
    "acos",    "atan",          "sinh",  "cosh",      "tanh",        "asinh",       "acosh", "atanh",
    "expm1",   "log1p",         "log2",  "deg2rad",   "rad2deg",     "floor",       "ceil",  "round",
    "fix",     "plus",          "minus", "times",     "over",        "power",       "less",  "less_equal",
    "greater", "greater_equal", "equal", "not_equal", "logical_and", "logical_or",  "min",   "max",
    "atan2",   "hypot",         "mod",   "rem"};
constexpr const char* name_of(Operation operation) noexcept {
    return operation_names[static_cast<int>(operation)];
}
inline constexpr int operation_count = sizeof operation_names / sizeof operation_names[0];
static_assert(operation_count == static_cast<int>(Operation::rem) + 1);

/// The operation of one number: the arithmetic of every formula, wherever it is computed. Where an Expression
/// calls it, a call costs as much as the operation.
template <class T> [[gnu::always_inline]] inline T value_of(Operation operation, T x) noexcept {
    switch (operation) {
    case Operation::negative: return -x;
    case Operation::logical_not: return x == 0;
    case Operation::abs: return Abs::apply(x);
    case Operation::sign: return x == 0 ? T(0) : Sign::apply(x); // of -0, too
    case Operation::sqrt: return Sqrt::apply(x);
    case Operation::exp: return Exp::apply(x);
    case Operation::log: return Log::apply(x);
    case Operation::log10: return Log10::apply(x);
    case Operation::sin: return Sin::apply(x);
    case Operation::cos: return Cos::apply(x);
    case Operation::tan: return Tan::apply(x);
    case Operation::asin: return Asin::apply(x);
    case Operation::acos: return Acos::apply(x);
    case Operation::atan: return Atan::apply(x);
    case Operation::sinh: return Sinh::apply(x);
    case Operation::cosh: return Cosh::apply(x);
    case Operation::tanh: return Tanh::apply(x);
    case Operation::asinh: return Asinh::apply(x);
    case Operation::acosh: return Acosh::apply(x);
    case Operation::atanh: return Atanh::apply(x);
    case Operation::expm1: return std::expm1(opaque(x));
    case Operation::log1p: return std::log1p(opaque(x));
    case Operation::log2: return std::log2(opaque(x));
    case Operation::deg2rad: return pi<T> / 180 * x;
    case Operation::rad2deg: return 180 / pi<T> * x;
    case Operation::floor: return Floor::apply(x);
    case Operation::ceil: return Ceil::apply(x);
    case Operation::round: return Round::apply(x);
    default: return Fix::apply(x);
    }
}

/// The operation of two numbers.
template <class T> [[gnu::always_inline]] inline T value_of(Operation operation, T a, T b) noexcept {
    switch (operation) {
    case Operation::plus: return a + b;
    case Operation::minus: return a - b;
    case Operation::times: return a * b;
    case Operation::over: return a / b;
    case Operation::power: return Power::apply(a, b);
    case Operation::less: return a < b;
    case Operation::less_equal: return a <= b;
    case Operation::greater: return a > b;
    case Operation::greater_equal: return a >= b;
    case Operation::equal: return a == b;
    case Operation::not_equal: return a != b;
    case Operation::logical_and: return a != 0 && b != 0;
    case Operation::logical_or: return a != 0 || b != 0;
    case Operation::min: return minimum(b, a); // of 0 and -0 the first
    case Operation::max: return maximum(b, a);
    case Operation::atan2: return Atan2::apply(a, b);
    case Operation::hypot: return Hypot::apply(a, b);
    case Operation::mod: return modulo(a, b);
    default: return remainder(a, b);
    }
}

/// Has the operation a value in MATLAB's real numbers? A root of -1 is complex, and NaN is neither true nor
/// false. Settings and what follows from them need it; blocks compute NaN.
template <class T> bool is_defined(Operation operation, T x) noexcept {
    switch (operation) {
    case Operation::sqrt:
    case Operation::log:
    case Operation::log2:
    case Operation::log10: return !(x < 0);
    case Operation::log1p: return !(x < -1);
    case Operation::asin:
    case Operation::acos:
    case Operation::atanh: return !(absolute(x) > 1);
    case Operation::acosh: return !(x < 1);
    case Operation::logical_not: return x == x;
    default: return true;
    }
}
template <class T> bool is_defined(Operation operation, T a, T b) noexcept {
    switch (operation) {
    case Operation::power: return !(a < 0 && b != std::round(b));
    case Operation::logical_and:
    case Operation::logical_or: return a == a && b == b;
    default: return true;
    }
}

namespace detail {
/// Where the value of an operation with these operands jumps or has a corner, this number changes: of those
/// that `has_edges` names.
template <class T> std::int32_t edge_of(Operation operation, T a, T b) noexcept {
    switch (operation) {
    case Operation::floor: return counted(std::floor(a));
    case Operation::ceil: return counted(std::ceil(a));
    case Operation::round: return counted(std::round(a));
    case Operation::fix: return counted(std::trunc(a));
    case Operation::mod: return counted(std::floor(a / b));
    case Operation::rem: return counted(std::trunc(a / b));
    case Operation::atan2: return third_quadrant(a, b);
    case Operation::abs:
    case Operation::sign: return (a > 0) - (a < 0);
    default: return (a > b) - (a < b); // comparisons and extremes
    }
}
constexpr bool has_edges(Operation operation) noexcept {
    switch (operation) {
    case Operation::abs:
    case Operation::sign:
    case Operation::floor:
    case Operation::ceil:
    case Operation::round:
    case Operation::fix:
    case Operation::less:
    case Operation::less_equal:
    case Operation::greater:
    case Operation::greater_equal:
    case Operation::min:
    case Operation::max:
    case Operation::atan2:
    case Operation::mod:
    case Operation::rem: return true;
    default: return false;
    }
}
} // namespace detail

/// y_i = value of a formula over elements i of the inputs, computed in the type of p. Scalars expand; true is
/// 1, and all but 0 is true. `code` has three numbers per instruction: operation, operand, index; it leaves
/// one number on the stack and never needs more than `depth`.
struct Expression {
    static constexpr const char* name = "bf::kernels::Expression{}";
    static constexpr int depth = 32;
    template <class T> static constexpr bool accepts = is_real<T>;

    template <class Y, class C, class P, class L>
    void operator()(const Y& y, const C& code, const P& p, const L& u) const noexcept {
        for (int i = 0; i < y.size(); ++i)
            y[i] = static_cast<Element<Y>>(value(code, p, u, i, [](Operation, auto, auto) {}));
    }

    /// Of elements i; `see` is told the operation and operands of each instruction that has some.
    template <class C, class P, class L, class See>
    static Element<P> value(const C& code, const P& p, const L& u, int i, const See& see) noexcept {
        using Number = Element<P>;
        Number stack[depth];
        stack[0] = 0;
        int top = -1;
        for (int k = 0; k < code.size(); k += 3) {
            const auto operation = static_cast<Operation>(static_cast<int>(code[k]));
            const int operand = static_cast<int>(code[k + 1]);
            if (operation == Operation::number)
                stack[++top] = code[k + 1];
            else if (operation == Operation::element)
                stack[++top] = static_cast<Number>(u[operand][pick(i, u[operand].size())]);
            else if (operation == Operation::fixed)
                stack[++top] = static_cast<Number>(u[operand][static_cast<int>(code[k + 2])]);
            else if (operation == Operation::parameter)
                stack[++top] = p[operand];
            else if (operation < Operation::plus) {
                see(operation, stack[top], Number(0));
                stack[top] = value_of(operation, stack[top]);
            } else {
                --top;
                see(operation, stack[top], stack[top + 1]);
                stack[top] = value_of(operation, stack[top], stack[top + 1]);
            }
        }
        return stack[0];
    }
};

/// g has a column for each element of the formula's value and a row for each operation in it that jumps or
/// has a corner: which changes there.
struct ExpressionEdges {
    static constexpr const char* name = "bf::kernels::ExpressionEdges{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class G, class C, class P, class L>
    void operator()(const G& g, const C& code, const P& p, const L& u) const noexcept {
        int next = 0;
        for (int i = 0; i < g.cols; ++i)
            Expression::value(code, p, u, i, [&](Operation operation, auto a, auto b) {
                if (detail::has_edges(operation)) g[next++] = detail::edge_of(operation, a, b);
            });
    }
};

} // namespace bf::kernels
