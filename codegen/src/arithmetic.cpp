#include "arithmetic.hpp"

#include "bf/kernels/continuous.hpp"
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/limits.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/pid.hpp"
#include "bf/kernels/reduce.hpp"
#include "bf/kernels/routing.hpp"
#include "bf/kernels/sources.hpp"
#include "names.hpp"
#include "symbol.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

namespace bf::codegen {

namespace {

using TermKind = Term::Kind;

/// What a person still reads as one equation.
constexpr std::size_t longest_text = 400, longest_key = 4000, most_conditions = 12;
constexpr int most_lines = 8;

bool is_whole(Type type) { return type != Type::float64 && type != Type::float32; }
bool is_unsigned(Type type) {
    return type == Type::uint8 || type == Type::uint16 || type == Type::uint32 || type == Type::boolean;
}
bool is_number(const TermPtr& t, double value) { return t->kind == TermKind::number && t->value == value; }

} // namespace

TermPtr term(Term t) {
    t.key = std::to_string(static_cast<int>(t.kind)) + t.op;
    for (const auto& x : t.of) {
        if (!t.trace) t.trace = x->trace;
        t.key += "(" + x->key + ")";
    }
    if (t.argument >= 0) t.key += std::to_string(t.argument) + "." + std::to_string(t.index);
    if (t.kind == TermKind::number)
        t.key += literal(t.value, Type::float64) + (t.type ? std::string(name(*t.type)) : "");
    if (t.key.size() > longest_key && t.trace) t.trace->has_failed = true;
    return std::make_shared<const Term>(std::move(t));
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

Symbol::operator int() const {
    if (term_->kind != TermKind::number && term_->trace) term_->trace->has_failed = true;
    return static_cast<int>(term_->value);
}

Symbol operator-(const Symbol& x) {
    if (x.term()->kind == TermKind::number && !x.term()->type) return Symbol(-x.term()->value);
    if (x.term()->type && is_whole(*x.term()->type) && x.term()->trace) x.term()->trace->has_failed = true;
    return Symbol(codegen::term({.kind = TermKind::negative, .of = {x.term()}, .type = x.term()->type}));
}

Symbol Symbol::binary(const char* op, const Symbol& x, const Symbol& y) {
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
    Trace* const trace = trace_of(a, b);
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

namespace {

// ---- one term of all runs

TermPtr opposite(const TermPtr& x) {
    if (x->kind == TermKind::number) return number_term(x->value == 0 ? 1 : 0);
    if (x->kind == TermKind::negation) return x->of[0];
    return term({.kind = TermKind::negation, .of = {x}, .type = Type::boolean});
}
/// The first operand of the kernel that a term is of.
int first_argument(const TermPtr& x) {
    int first = x->argument >= 0 ? x->argument : std::numeric_limits<int>::max();
    for (const auto& y : x->of) first = std::min(first, first_argument(y));
    return first;
}
/// Truth values in the order of the kernel's operands; runs ask for them in an order of their own.
TermPtr joined(TermKind kind, const TermPtr& x, const TermPtr& y) {
    std::vector<TermPtr> of;
    for (const auto& one : {x, y})
        if (one->kind == kind && kind != TermKind::difference)
            of.insert(of.end(), one->of.begin(), one->of.end());
        else
            of.push_back(one);
    std::stable_sort(of.begin(), of.end(),
                     [](const auto& a, const auto& b) { return first_argument(a) < first_argument(b); });
    bool is_opposite = false;
    if (kind == TermKind::difference)
        for (auto& one : of)
            if (one->kind == TermKind::negation) {
                one = TermPtr(one)->of[0];
                is_opposite = !is_opposite;
            }
    const TermPtr result = term({.kind = kind, .of = std::move(of), .type = Type::boolean});
    return is_opposite ? opposite(result) : result;
}

/// condition ? x : y. Of truth values it is what people write.
TermPtr choice(const TermPtr& condition, const TermPtr& x, const TermPtr& y, bool is_truth) {
    if (x->key == y->key) return x;
    if (is_truth) {
        if (is_number(x, 1)) return is_number(y, 0) ? condition : joined(TermKind::disjunction, condition, y);
        if (is_number(y, 0)) return joined(TermKind::conjunction, condition, x);
        if (is_number(x, 0))
            return is_number(y, 1) ? opposite(condition)
                                   : joined(TermKind::conjunction, opposite(condition), y);
        if (is_number(y, 1)) return joined(TermKind::disjunction, opposite(condition), x);
        if (opposite(x)->key == y->key) return joined(TermKind::difference, condition, y);
    }
    if (y->kind == TermKind::choice && y->of[1]->key == x->key)
        return choice(joined(TermKind::disjunction, condition, y->of[0]), x, y->of[2], is_truth);
    if (x->kind == TermKind::choice && x->of[2]->key == y->key)
        return choice(joined(TermKind::conjunction, condition, x->of[0]), x->of[1], y, is_truth);
    return term({.kind = TermKind::choice, .of = {condition, x, y}, .type = x->type ? x->type : y->type});
}

bool is_itself(const TermPtr& x, int argument, int index) {
    return x->kind == TermKind::element && x->argument == argument && x->index == index;
}
bool depends_on(const TermPtr& x, int argument) {
    return x->argument == argument ||
           std::any_of(x->of.begin(), x->of.end(), [&](const auto& y) { return depends_on(y, argument); });
}

/// Can the term be assigned to an element of that type, without a conversion that is not written?
bool fits(const TermPtr& x, Type type) {
    switch (x->kind) {
    case TermKind::choice: return fits(x->of[1], type) && fits(x->of[2], type);
    case TermKind::number:
        return (!x->type || *x->type == type) &&
               (type != Type::boolean || is_number(x, 0) || is_number(x, 1));
    default: return !x->type || *x->type == type;
    }
}

// ---- C++

/// How tightly a text holds together, as C++ reads it.
enum Level { chosen = 1, either, both, equality, order, sum, product, sign, whole };

struct Text {
    std::string text;
    Level level = whole;
    std::string at(Level least) const { return level >= least ? text : "(" + text + ")"; }
};

class EquationPrinter {
  public:
    /// With `loop` ≥ 0 an element of that index is written as [i].
    EquationPrinter(const std::vector<Argument>& arguments, int loop) : arguments_(arguments), loop_(loop) {}

    std::string element(int argument, int index) const {
        const auto& a = arguments_[static_cast<std::size_t>(argument)];
        if (!a.is_array) return a.text;
        return a.text + "[" + (index == loop_ ? "i" : number(index)) + "]";
    }

    Text operator()(const TermPtr& x, Type type) const {
        if (x->type) type = *x->type;
        switch (x->kind) {
        case TermKind::number: {
            if (!x->op.empty()) return {x->op};
            const std::string text = literal(x->value, type);
            return {text, text[0] == '-' ? sign : whole};
        }
        case TermKind::element: return {element(x->argument, x->index)};
        case TermKind::negative: return {"-" + (*this)(x->of[0], type).at(whole), sign};
        case TermKind::arithmetic: {
            const Level level = x->op == "+" || x->op == "-" ? sum : product;
            const Text right = (*this)(x->of[1], type);
            return {(*this)(x->of[0], type).at(level) + " " + x->op + " " +
                        (right.level == sign ? right.at(whole) : right.at(Level(level + 1))),
                    level};
        }
        case TermKind::call: {
            std::string list;
            for (const auto& one : x->of) {
                std::string text = (*this)(one, type).text;
                if (one->kind == TermKind::number && is_whole(type))
                    text = std::string(cpp_name(type)) + "(" + text + ")";
                list += (list.empty() ? "" : ", ") + text;
            }
            return {"math::" + x->op + "(" + list + ")"};
        }
        case TermKind::comparison: return compared(x, x->op);
        case TermKind::negation:
            if (x->of[0]->kind == TermKind::difference) return differing(x->of[0], " == ");
            if (x->of[0]->kind == TermKind::comparison && x->of[0]->op == "!=")
                return compared(x->of[0], "==");
            return {"!" + (*this)(x->of[0], type).at(whole), sign};
        case TermKind::conjunction: return {joined(x, " && "), both};
        case TermKind::disjunction: return {joined(x, " || "), either};
        case TermKind::difference: return differing(x, " != ");
        case TermKind::choice:
            return {(*this)(x->of[0], Type::boolean).at(either) + " ? " + (*this)(x->of[1], type).at(either) +
                        " : " + (*this)(x->of[2], type).text,
                    chosen};
        }
        return {};
    }

  private:
    Text compared(const TermPtr& x, const std::string& op) const {
        const Type type = x->of[0]->type ? *x->of[0]->type : x->of[1]->type ? *x->of[1]->type : Type::float64;
        return {(*this)(x->of[0], type).at(sum) + " " + op + " " + (*this)(x->of[1], type).at(sum),
                op == "==" || op == "!=" ? equality : order};
    }
    Text differing(const TermPtr& x, const char* op) const {
        return {(*this)(x->of[0], Type::boolean).at(sign) + op + (*this)(x->of[1], Type::boolean).at(sign),
                equality};
    }
    std::string joined(const TermPtr& x, const char* op) const {
        std::string text;
        for (const auto& one : x->of)
            text += (text.empty() ? "" : op) + (*this)(one, Type::boolean).at(equality);
        return text;
    }

    const std::vector<Argument>& arguments_;
    int loop_;
};

// ---- the kernels

using SymbolView = kernels::View<Symbol>;
using SymbolList = kernels::ListView<Symbol>;
enum class List { none, first, last };

struct TracedKernel {
    std::string_view name;
    int operands; ///< a list counts as one
    List list;
    /// False where the kernel says that its operands are wrong.
    bool (*run)(const SymbolView* views, const SymbolList& list);
};

template <List list, std::size_t i, std::size_t count>
decltype(auto) operand(const SymbolView* views, const SymbolList& its) {
    if constexpr ((list == List::first && i == 0) || (list == List::last && i + 1 == count))
        return (its);
    else
        return (views[i - (list == List::first ? 1 : 0)]);
}
template <class K, List list, std::size_t... i> constexpr bool takes(std::index_sequence<i...>) {
    return std::is_invocable_v<const K&,
                               decltype(operand<list, i, sizeof...(i)>(
                                   std::declval<const SymbolView*>(), std::declval<const SymbolList&>()))...>;
}
template <class K, List list, std::size_t count = 1> constexpr TracedKernel kernel() {
    if constexpr (!takes<K, list>(std::make_index_sequence<count>{}))
        return kernel<K, list, count + 1>();
    else
        return {
            K::name, static_cast<int>(count), list, [](const SymbolView* views, const SymbolList& its) {
                return [&]<std::size_t... i>(std::index_sequence<i...>) {
                    if constexpr (std::is_same_v<decltype(K{}(operand<list, i, count>(views, its)...)), bool>)
                        return K{}(operand<list, i, count>(views, its)...);
                    K{}(operand<list, i, count>(views, its)...);
                    return true;
                }
                (std::make_index_sequence<count>{});
            }};
}
template <List list, class... K> constexpr std::array<TracedKernel, sizeof...(K)> kernels_of() {
    return {kernel<K, list>()...};
}

namespace k = kernels;
constexpr auto plain =
    kernels_of<List::none, k::Copy, k::Gain, k::Add, k::Subtract, k::Multiply, k::Divide, k::Negate, k::Abs,
               k::Sign, k::Square, k::Minimum, k::Maximum, k::Mod, k::Rem, k::Sqrt, k::SignedSqrt,
               k::ReciprocalSqrt, k::Reciprocal, k::Exp, k::Log, k::Log10, k::Pow10, k::Sin, k::Cos, k::Tan,
               k::Asin, k::Acos, k::Atan, k::Sinh, k::Cosh, k::Tanh, k::Asinh, k::Acosh, k::Atanh, k::Floor,
               k::Ceil, k::Round, k::Fix, k::Power, k::Atan2, k::Hypot, k::Polynomial, k::Saturate,
               k::DeadZone, k::RateLimit, k::RelayMode, k::ShownMode, k::Choose, k::Backlash, k::Friction,
               k::WrapToZero, k::HitCrossing, k::Accumulate, k::AccumulateHalf, k::RisingEdge, k::FallingEdge,
               k::EitherEdge, k::LevelReset, k::Difference, k::FilterOutput, k::FilterUpdate, k::Shift,
               k::Step, k::Ramp, k::SineWave, k::LimitedRate, k::LimitReached, k::Lag, k::CompanionOutput,
               k::CompanionRate, k::DifferenceQuotient, k::Equal, k::NotEqual, k::Less, k::LessEqual,
               k::Greater, k::GreaterEqual, k::Not, k::All, k::Any, k::Inside, k::Changed, k::Increased,
               k::Decreased, k::SetReset, k::DFlipFlop, k::Advance, k::SumOfElements, k::ProductOfElements,
               k::MinimumOfElements, k::MaximumOfElements, k::Dot, k::Cross, k::PartOf>();
constexpr auto of_lists =
    kernels_of<List::last, k::Sum, k::ElementProduct, k::MinimumOfList, k::MaximumOfList, k::And, k::Or,
               k::Nand, k::Nor, k::Xor, k::Xnor, k::Concatenate>();
constexpr auto to_lists = kernels_of<List::first, k::Split>();

const TracedKernel* find(std::string_view name) {
    const TracedKernel* found = nullptr;
    const auto look = [&](const auto& all) {
        for (const auto& one : all)
            if (one.name == name) found = &one;
    };
    look(plain);
    look(of_lists);
    look(to_lists);
    return found;
}

/// All runs of one kernel on the symbols of its operands.
class Runs {
  public:
    Runs(const TracedKernel& kernel, const std::vector<Argument>& arguments, int list_from, int list_size)
        : kernel_(kernel), arguments_(arguments), list_from_(list_from), list_size_(list_size) {}

    /// The terms of all elements of all arguments, those that were not written standing for themselves.
    /// Nothing if the kernel is more than arithmetic.
    std::optional<std::vector<std::vector<TermPtr>>> operator()(std::vector<bool> path = {}) {
        Trace trace{.path = path};
        std::vector<std::vector<Symbol>> cells;
        std::vector<SymbolView> views, list;
        for (std::size_t a = 0; a < arguments_.size(); ++a) {
            const auto& argument = arguments_[a];
            cells.emplace_back();
            for (int e = 0; e < argument.size.count(); ++e)
                cells.back().push_back(Symbol(symbol(static_cast<int>(a), e, &trace)));
        }
        for (std::size_t a = 0; a < arguments_.size(); ++a) {
            const bool is_listed = static_cast<int>(a) >= list_from_ &&
                                   static_cast<int>(a) < list_from_ + list_size_ && list_from_ >= 0;
            (is_listed ? list : views)
                .emplace_back(cells[a].data(), arguments_[a].size.rows, arguments_[a].size.cols);
        }
        const bool is_right =
            kernel_.run(views.data(), SymbolList(list.data(), static_cast<int>(list.size())));
        if (!is_right || trace.has_failed || ++count_ > 600) return {};
        std::vector<std::vector<TermPtr>> terms;
        if (trace.conditions.size() == path.size()) {
            for (std::size_t a = 0; a < arguments_.size(); ++a) {
                terms.emplace_back();
                for (std::size_t e = 0; e < cells[a].size(); ++e) terms[a].push_back(cells[a][e].term());
            }
            return terms;
        }
        const TermPtr condition = trace.conditions[path.size()];
        path.push_back(true);
        auto one = (*this)(path);
        path.back() = false;
        const auto other = (*this)(path);
        if (!one || !other) return {};
        for (std::size_t a = 0; a < arguments_.size(); ++a)
            for (std::size_t e = 0; e < (*one)[a].size(); ++e)
                (*one)[a][e] =
                    choice(condition, (*one)[a][e], (*other)[a][e], arguments_[a].type == Type::boolean);
        return one;
    }

  private:
    TermPtr symbol(int a, int e, Trace* trace) const {
        const auto& argument = arguments_[static_cast<std::size_t>(a)];
        if (!argument.values.empty())
            return term({.kind = TermKind::number,
                         .op = argument.text,
                         .type = argument.type,
                         .value = argument.values[static_cast<std::size_t>(e)],
                         .trace = trace});
        // Two inputs may be wired to one signal; then they are one symbol, which equals itself.
        const auto same = std::find_if(arguments_.begin(), arguments_.end(), [&](const Argument& other) {
            return !other.is_written && !argument.is_written && other.values.empty() &&
                   other.text == argument.text && other.is_array == argument.is_array;
        });
        const auto at = same == arguments_.end() ? a : static_cast<int>(same - arguments_.begin());
        return term(
            {.kind = TermKind::element, .type = argument.type, .argument = at, .index = e, .trace = trace});
    }

    const TracedKernel& kernel_;
    const std::vector<Argument>& arguments_;
    int list_from_, list_size_, count_ = 0;
};

} // namespace

std::optional<std::vector<std::string>> arithmetic(std::string_view name,
                                                   const std::vector<Argument>& arguments, int list_from,
                                                   int list_size) {
    const TracedKernel* const kernel = find(name);
    const int operands = static_cast<int>(arguments.size()) - (list_from >= 0 ? list_size - 1 : 0);
    if (!kernel || operands != kernel->operands || (kernel->list != List::none) != (list_from >= 0))
        return {};
    const auto terms = Runs(*kernel, arguments, list_from, list_size)();
    if (!terms) return {};
    std::vector<std::string> lines;
    for (int a = 0; a < static_cast<int>(arguments.size()); ++a) {
        const auto& target = arguments[static_cast<std::size_t>(a)];
        const auto& its = (*terms)[static_cast<std::size_t>(a)];
        const int count = target.size.count();
        const auto is_kept = [&](int e) { return is_itself(its[static_cast<std::size_t>(e)], a, e); };
        const auto line = [&](int e, int loop) {
            const EquationPrinter print(arguments, loop);
            return print.element(a, e) + " = " + print(its[static_cast<std::size_t>(e)], target.type).text +
                   ";";
        };
        if (!target.is_written || count == 0 || is_kept(0)) continue; // a rule may read its own outputs
        bool is_uniform = count > 1;
        for (int e = 0; e < count; ++e) {
            if (is_kept(e) || !fits(its[static_cast<std::size_t>(e)], target.type)) return {};
            is_uniform = is_uniform && line(e, e) == line(0, 0);
        }
        // Its old value would have to outlive the line.
        for (const auto& others : *terms)
            for (const auto& one : others)
                if (depends_on(one, a)) return {};
        if (is_uniform)
            lines.push_back("for (int i = 0; i < " + number(count) + "; ++i) " + line(0, 0));
        else
            for (int e = 0; e < count; ++e) lines.push_back(line(e, -1));
    }
    if (lines.empty() || static_cast<int>(lines.size()) > most_lines) return {};
    for (const auto& line : lines)
        if (line.size() > longest_text) return {};
    return lines;
}

} // namespace bf::codegen
