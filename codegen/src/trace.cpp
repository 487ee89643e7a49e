#include "trace.hpp"

#include "bf/core/named_kernels.hpp"
#include "operations.hpp"

#include <algorithm>

namespace bf::codegen {

namespace {

constexpr int most_runs = 600;

// ---- one term of all runs

TermPtr opposite(const TermPtr& x) {
    if (x->kind == TermKind::number) return number_term(x->value == 0 ? 1 : 0);
    if (x->kind == TermKind::negation) return x->of[0];
    return term({.kind = TermKind::negation, .of = {x}, .type = Type::boolean});
}
/// Truth values in the order of the kernel's operands; runs ask for them in an order of their own.
TermPtr joined(TermKind kind, const TermPtr& x, const TermPtr& y) {
    std::vector<TermPtr> of;
    for (const auto& one : {x, y})
        if (one->kind == kind && kind != TermKind::difference)
            of.insert(of.end(), one->of.begin(), one->of.end());
        else
            of.push_back(one);
    std::stable_sort(of.begin(), of.end(), [](const auto& a, const auto& b) { return a->first < b->first; });
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

// ---- the kernels

namespace k = kernels;

template <class K> constexpr std::string_view failure_text() {
    if constexpr (requires { K::failure; })
        return K::failure;
    else
        return "the result is not defined for these inputs";
}
template <class K, class... Of> constexpr bool is_one_of = (std::is_same_v<K, Of> || ...);
/// Kernels with options, which are constants.
template <class K>
constexpr bool is_alike =
    is_one_of<K, kernels::Saturate, kernels::DeadZone, kernels::Quantize, kernels::RateLimit,
              kernels::RelayMode, kernels::ShownMode, kernels::Choose, kernels::Backlash, kernels::Friction,
              kernels::WrapToZero, kernels::HitCrossing, kernels::Accumulate, kernels::AccumulateHalf,
              kernels::RisingEdge, kernels::FallingEdge, kernels::EitherEdge, kernels::LevelReset,
              kernels::Difference, kernels::Equal, kernels::NotEqual, kernels::Less, kernels::LessEqual,
              kernels::Greater, kernels::GreaterEqual, kernels::Not, kernels::Inside, kernels::Changed,
              kernels::Increased, kernels::Decreased, kernels::LimitedRate, kernels::LimitReached,
              kernels::Pid, kernels::StoppedState, kernels::StoppedSide, kernels::BegunState,
              kernels::SwitchedMode>;
template <class K> constexpr Elements elements_of_kernel() {
    if constexpr (requires { K::is_elementwise; })
        return Elements::of_all;
    else
        return is_alike<K> ? Elements::of_all_but_constants : Elements::differ;
}
/// What else is known of a kernel.
struct Properties {
    Elements elements = Elements::differ;
    std::string_view failure;
};
Properties properties_of(std::string_view name) {
    Properties found;
    for_each_named_kernel([&]<class K>(K) {
        if (name == K::name) found = {elements_of_kernel<K>(), failure_text<K>()};
    });
    return found;
}

/// All runs of one kernel on the symbols of its operands.
class Runs {
  public:
    /// `computed_in` is the type into which the kernel converts each operand, if it does.
    Runs(const NamedKernel<Symbol>& kernel, const std::vector<Argument>& arguments, int list_from,
         int list_size, std::vector<std::optional<Type>> computed_in, std::size_t most_terms)
        : kernel_(kernel), arguments_(arguments), list_from_(list_from), list_size_(list_size),
          computed_in_(std::move(computed_in)), most_terms_(most_terms) {}

    /// With these answers to the first conditions.
    std::optional<Traced> operator()(std::vector<bool> path = {}) {
        Trace trace{.most_terms = most_terms_, .path = path};
        std::vector<std::vector<Symbol>> cells;
        std::vector<kernels::View<Symbol>> views, list;
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
        const bool is_right = kernel_.run(views.data(), {list.data(), static_cast<int>(list.size())});
        if (trace.has_failed || ++count_ > most_runs) return {};
        if (trace.conditions.size() == path.size()) {
            Traced traced{{}, number_term(is_right ? 0 : 1)};
            for (const auto& its : cells) {
                traced.terms.emplace_back();
                for (const auto& cell : its) traced.terms.back().push_back(cell.term());
            }
            return traced;
        }
        const TermPtr condition = trace.conditions[path.size()];
        path.push_back(true);
        auto one = (*this)(path);
        path.back() = false;
        const auto other = (*this)(path);
        if (!one || !other) return {};
        for (std::size_t a = 0; a < arguments_.size(); ++a)
            for (std::size_t e = 0; e < one->terms[a].size(); ++e) {
                TermPtr& term = one->terms[a][e];
                if (is_number(one->fails, 1)) // what it wrote before means nothing
                    term = other->terms[a][e];
                else if (!is_number(other->fails, 1))
                    term = choice(condition, term, other->terms[a][e], arguments_[a].type == Type::boolean);
            }
        one->fails = choice(condition, one->fails, other->fails, true);
        return one;
    }

  private:
    TermPtr symbol(int a, int e, Trace* trace) const {
        const auto& argument = arguments_[static_cast<std::size_t>(a)];
        const auto& type = computed_in_[static_cast<std::size_t>(a)];
        if (!argument.values.empty())
            return term({.kind = TermKind::number,
                         .op = type ? "" : argument.text,
                         .type = type.value_or(argument.type),
                         .value = argument.values[static_cast<std::size_t>(e)],
                         .trace = trace});
        // Two inputs may be wired to one signal; then they are one symbol, which equals itself.
        const auto same = std::find_if(arguments_.begin(), arguments_.end(), [&](const Argument& other) {
            return !other.is_written && !argument.is_written && other.values.empty() &&
                   other.text == argument.text && other.is_array == argument.is_array;
        });
        const auto at = same == arguments_.end() ? a : static_cast<int>(same - arguments_.begin());
        const TermPtr element = term(
            {.kind = TermKind::element, .type = argument.type, .argument = at, .index = e, .trace = trace});
        return argument.is_written || !type ? element : converted(element, *type);
    }

    const NamedKernel<Symbol>& kernel_;
    const std::vector<Argument>& arguments_;
    int list_from_, list_size_, count_ = 0;
    std::vector<std::optional<Type>> computed_in_;
    std::size_t most_terms_;
};

template <class... K> bool is_any(std::string_view name) { return ((name == K::name) || ...); }

/// By operand, where the kernel converts it before it computes.
std::vector<std::optional<Type>> types_of_computation(std::string_view name,
                                                      const std::vector<Argument>& arguments) {
    std::vector<std::optional<Type>> types(arguments.size());
    // A formula computes in the type of p, which is its third operand.
    if (name == k::Expression::name) types.assign(arguments.size(), arguments[2].type);
    // A double holds what it is compared with.
    if (is_any<k::Equal, k::NotEqual, k::Less, k::LessEqual, k::Greater, k::GreaterEqual>(name) &&
        arguments[1].values.empty() && arguments[2].values.empty() &&
        (arguments[1].type == Type::float64 || arguments[2].type == Type::float64))
        types.assign(arguments.size(), Type::float64);
    if (is_any<k::Margin, k::StopMargins>(name)) types.assign(arguments.size(), arguments[0].type);
    // The period, in a model of another type.
    if (is_any<k::Accumulate, k::AccumulateHalf, k::Difference, k::RateLimit>(name))
        for (std::size_t a = 0; a < arguments.size(); ++a)
            if (!arguments[a].values.empty() && arguments[a].type != arguments[0].type)
                types[a] = arguments[0].type;
    if (name.starts_with("bf::kernels::Check<")) types.back() = arguments[0].type;
    return types;
}

} // namespace

namespace {
/// Charts with states in states go more ways than equations have room for.
bool has_hierarchy(std::string_view kernel, const std::vector<Argument>& arguments) {
    if (kernel == k::Chart::name) return true;
    if (kernel != k::StateMachine::name && kernel != k::ChartUpdate::name) return false;
    return std::none_of(arguments.begin(), arguments.end(), [](const Argument& a) {
        return a.values.size() > k::chart::chart_head_size && a.values[k::chart::chart_is_flat] != 0;
    });
}
} // namespace

std::optional<Traced> trace(std::string_view name, const std::vector<Argument>& arguments, int list_from,
                            int list_size, std::size_t most_terms) {
    const auto* const kernel = find_kernel<Symbol>(name);
    const int operands = static_cast<int>(arguments.size()) - (list_from >= 0 ? list_size - 1 : 0);
    if (has_hierarchy(name, arguments)) return {};
    if (!kernel || operands != kernel->operands || (kernel->list != ListOperand::none) != (list_from >= 0))
        return {};
    const bool is_single = std::any_of(arguments.begin(), arguments.end(),
                                       [](const Argument& a) { return a.type == Type::float32; });
    begin_terms(is_single ? Type::float32 : Type::float64);
    const bool is_formula = name == k::Expression::name;
    auto traced =
        Runs(*kernel, arguments, list_from, list_size, types_of_computation(name, arguments), most_terms)();
    for (std::size_t a = 0; traced && a < arguments.size(); ++a)
        for (auto& one : traced->terms[a]) {
            // What a kernel only copies may become another type.
            const bool is_copy = one->kind == TermKind::element && one->argument != static_cast<int>(a);
            if (arguments[a].is_written && (is_formula || is_copy)) one = converted(one, arguments[a].type);
        }
    return traced;
}

Elements elements_of(std::string_view name) { return properties_of(name).elements; }
std::string_view failure_of(std::string_view name) { return properties_of(name).failure; }

} // namespace bf::codegen
