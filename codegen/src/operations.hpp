// The operations of formulas on symbols.
#pragma once

#include "bf/kernels/expression.hpp"
#include "symbol.hpp"

namespace bf::codegen {

inline Symbol symbol_of(Term t) { return Symbol(term(std::move(t))); }

/// The number that a truth value is, and back.
inline Symbol number_of(TermPtr truth, const Symbol& like) {
    return symbol_of({.kind = Term::Kind::conversion, .of = {std::move(truth)}, .type = like.term()->type});
}
inline TermPtr comparison(const char* op, const Symbol& x, const Symbol& y) {
    return term(
        {.kind = Term::Kind::comparison, .op = op, .of = {x.term(), y.term()}, .type = Type::boolean});
}
inline TermPtr truth_of(const Symbol& x) {
    const TermPtr& t = x.term();
    const bool was_truth = t->kind == Term::Kind::conversion && t->of[0]->type == Type::boolean;
    return was_truth ? t->of[0] : comparison("!=", x, 0);
}

} // namespace bf::codegen

namespace bf::kernels {

template <>
inline codegen::Symbol value_of<codegen::Symbol>(Operation operation, codegen::Symbol x) noexcept {
    switch (operation) {
    case Operation::negative: return -x;
    case Operation::logical_not: return codegen::number_of(codegen::comparison("==", x, 0), x);
    case Operation::abs: return absolute(x);
    default: return codegen::Symbol::call(name_of(operation), {x});
    }
}

template <>
inline codegen::Symbol value_of<codegen::Symbol>(Operation operation, codegen::Symbol a,
                                                 codegen::Symbol b) noexcept {
    using Kind = codegen::Term::Kind;
    const auto compared = [&](const char* op) {
        return codegen::number_of(codegen::comparison(op, a, b), a);
    };
    const auto joined = [&](Kind kind) {
        return codegen::number_of(
            codegen::term(
                {.kind = kind, .of = {codegen::truth_of(a), codegen::truth_of(b)}, .type = Type::boolean}),
            a);
    };
    switch (operation) {
    case Operation::plus: return a + b;
    case Operation::minus: return a - b;
    case Operation::times: return a * b;
    case Operation::over: return a / b;
    case Operation::less: return compared("<");
    case Operation::less_equal: return compared("<=");
    case Operation::greater: return compared(">");
    case Operation::greater_equal: return compared(">=");
    case Operation::equal: return compared("==");
    case Operation::not_equal: return compared("!=");
    case Operation::logical_and: return joined(Kind::conjunction);
    case Operation::logical_or: return joined(Kind::disjunction);
    case Operation::min: return minimum(b, a); // of 0 and -0 the first
    case Operation::max: return maximum(b, a);
    case Operation::mod: return modulo(a, b);
    case Operation::rem: return remainder(a, b);
    default: return codegen::Symbol::call(name_of(operation), {a, b});
    }
}

} // namespace bf::kernels
