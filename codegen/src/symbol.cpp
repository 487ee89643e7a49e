#include "symbol.hpp"

#include "names.hpp"

#include <algorithm>
#include <cassert>
#include <limits>
#include <unordered_map>

namespace bf::codegen {

namespace {

/// Each condition doubles the runs of a kernel.
constexpr std::size_t most_conditions = 12;

bool is_unsigned(Type type) {
    return type == Type::uint8 || type == Type::uint16 || type == Type::uint32 || type == Type::boolean;
}

/// A term's number, by what it is and the numbers of what it is of: a text of its own would be as long as all
/// that lies below, however often parts of it are the same.
std::unordered_map<std::string, std::size_t>& numbers_of_terms() {
    static thread_local std::unordered_map<std::string, std::size_t> numbers;
    return numbers;
}

Type& type_of_reals() {
    thread_local Type type = Type::float64;
    return type;
}

} // namespace

void begin_terms(Type real) {
    numbers_of_terms().clear();
    type_of_reals() = real;
}
Type real_type() { return type_of_reals(); }

namespace {
/// The run of a kernel that is under way: what it compares may follow from constants alone.
Trace*& running() {
    thread_local Trace* trace = nullptr;
    return trace;
}
} // namespace

TermPtr term(Term t) {
    if (t.argument >= 0) running() = t.trace;
    std::string text = std::to_string(static_cast<int>(t.kind)) + t.op;
    if (t.kind == TermKind::conversion && t.type) text += name(*t.type);
    for (const auto& x : t.of) {
        if (!t.trace) t.trace = x->trace;
        text += "(" + x->key + ")";
        t.size = std::min(t.size + x->size, std::size_t{1} << 40);
        t.first = std::min(t.first, x->first);
    }
    if (t.argument >= 0) {
        text += std::to_string(t.argument) + "." + std::to_string(t.index);
        t.first = t.argument;
    }
    if (t.kind == TermKind::number) // which may be older than the others
        t.key = literal(t.value, Type::float64) + (t.type ? std::string(name(*t.type)) : "") + t.op + "#";
    else
        t.key = std::to_string(numbers_of_terms().try_emplace(text, numbers_of_terms().size()).first->second);
    if (t.trace && t.size > t.trace->most_terms) t.trace->has_failed = true;
    return std::make_shared<const Term>(std::move(t));
}

TermPtr converted(const TermPtr& x, Type type) {
    if (!x->type || *x->type == type) return x;
    return term({.kind = TermKind::conversion, .of = {x}, .type = type});
}

TermPtr number_term(double value) { return term({.kind = TermKind::number, .value = value}); }

bool Trace::decide(const TermPtr& condition) {
    if (const auto known = answers.find(condition->key); known != answers.end()) return known->second;
    if (conditions.size() >= most_conditions) has_failed = true;
    if (has_failed) return false;
    const bool answer = conditions.size() >= path.size() || path[conditions.size()];
    conditions.push_back(condition);
    answers.emplace(condition->key, answer);
    return answer;
}

namespace {

Trace* trace_of(const TermPtr& x, const TermPtr& y) { return x->trace ? x->trace : y->trace; }

/// The type in which two terms meet; what kernels convert on their way is not written, so both have the same.
std::optional<Type> common_type(const TermPtr& x, const TermPtr& y) {
    if (x->type && y->type && *x->type != *y->type)
        if (Trace* trace = trace_of(x, y)) trace->has_failed = true;
    return x->type ? x->type : y->type;
}

/// A constant that the type of what it is compared with holds exactly; there it is a literal of that type.
TermPtr as_literal(const TermPtr& constant, const TermPtr& other) {
    if (constant->kind != TermKind::number || other->kind == TermKind::number || !other->type)
        return constant;
    const bool is_held = with_type(*other->type, [&](auto t) {
        using T = typename decltype(t)::type;
        return kernels::range_of<T>().holds(constant->value) &&
               (is_whole(*other->type) ||
                static_cast<double>(static_cast<T>(constant->value)) == constant->value);
    });
    return is_held ? number_term(constant->value) : constant;
}

} // namespace

Symbol::Symbol(double number) : term_(number_term(number)) {}
Symbol::Symbol(TermPtr t) : term_(std::move(t)) {}
Symbol::Symbol(const Symbol& x) = default;
Symbol::Symbol(Symbol&& x) noexcept = default;
Symbol& Symbol::operator=(const Symbol& x) = default;
Symbol& Symbol::operator=(Symbol&& x) noexcept = default;
Symbol::~Symbol() = default;

Symbol::operator int() const {
    if (term_->kind == TermKind::number) return static_cast<int>(term_->value);
    constexpr int first_few = 10;
    for (int i = 0; i < first_few; ++i)
        if (*this == Symbol(i)) return i;
    if (term_->trace) term_->trace->has_failed = true;
    return 0;
}

Symbol Symbol::exact(const char* function, double (*f)(double), const Symbol& x) {
    return x.term_->kind == TermKind::number ? Symbol(f(x.term_->value)) : call(function, {x});
}

Symbol operator-(const Symbol& x) {
    if (x.term()->kind == TermKind::number && !x.term()->type) return Symbol(-x.term()->value);
    if (x.term()->type && is_whole(*x.term()->type) && x.term()->trace) x.term()->trace->has_failed = true;
    return Symbol(codegen::term({.kind = TermKind::negative, .of = {x.term()}, .type = x.term()->type}));
}

Symbol Symbol::binary(const char* op, const Symbol& x, const Symbol& y) {
    const auto is_small = [](const TermPtr& t) {
        return t->kind == TermKind::number && t->op.empty() && t->value == std::trunc(t->value) &&
               std::abs(t->value) < 1 << 20;
    };
    if (is_small(x.term_) && is_small(y.term_) && *op != '/') { // exact in every type
        const double a = x.term_->value, b = y.term_->value;
        return Symbol(*op == '+' ? a + b : *op == '-' ? a - b : a * b);
    }
    const auto type = common_type(x.term_, y.term_);
    if (type && is_whole(*type)) // C++ computes these in another type
        if (Trace* trace = trace_of(x.term_, y.term_)) trace->has_failed = true;
    return Symbol(
        codegen::term({.kind = TermKind::arithmetic, .op = op, .of = {x.term_, y.term_}, .type = type}));
}

bool Symbol::compared(const char* op, const Symbol& x, const Symbol& y) {
    const std::string o = op;
    const TermPtr a = as_literal(x.term_, y.term_), b = as_literal(y.term_, x.term_);
    if (a->kind == TermKind::number && b->kind == TermKind::number)
        return o == "<"    ? a->value < b->value
               : o == ">"  ? a->value > b->value
               : o == "<=" ? a->value <= b->value
               : o == ">=" ? a->value >= b->value
                           : a->value != b->value;
    Trace* const trace = trace_of(a, b) ? trace_of(a, b) : running();
    assert(trace && "kernels compare operands");
    const auto type = common_type(a, b);
    if (type && is_whole(*type) && a->key == b->key)
        return o == "<=" || o == ">="; // only NaN differs from itself
    if (type && is_unsigned(*type) && is_number(b, 0)) {
        if (o == "<") return false;
        if (o == ">=") return true;
        if (*type == Type::boolean) return trace->decide(a) == (o == ">" || o == "!=");
    }
    return trace->decide(
        codegen::term({.kind = TermKind::comparison, .op = o, .of = {a, b}, .type = Type::boolean}));
}

Symbol Symbol::call(const char* function, std::initializer_list<Symbol> x) {
    const std::string f = function;
    std::vector<TermPtr> of;
    std::optional<Type> type;
    for (const auto& one : x) {
        if (!of.empty()) common_type(of.front(), one.term_);
        if (!type) type = one.term_->type;
        of.push_back(one.term_);
    }
    if (!type || !is_whole(*type)) {
        if (f == "add") return binary("+", Symbol(of[0]), Symbol(of[1]));
        if (f == "subtract") return binary("-", Symbol(of[0]), Symbol(of[1]));
        if (f == "multiply") return binary("*", Symbol(of[0]), Symbol(of[1]));
        if (f == "divide") return binary("/", Symbol(of[0]), Symbol(of[1]));
        if (f == "negate") return -Symbol(of[0]);
    }
    return Symbol(codegen::term({.kind = TermKind::call, .op = f, .of = std::move(of), .type = type}));
}

} // namespace bf::codegen
