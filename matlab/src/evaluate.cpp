#include "state.hpp"

#include <algorithm>

namespace bf::matlab {
namespace {

/// The node at the far left of a chain of indices and fields.
const Expression& root_of(const Expression& e) {
    const Expression* root = &e;
    while (root->kind == Kind::Index || root->kind == Kind::CellIndex || root->kind == Kind::Field ||
           root->kind == Kind::DynamicField)
        root = root->parts[0].get();
    return *root;
}

/// Calls f for each name in `e` that no parameter of a lambda binds.
template <typename F> void visit_names(const Expression& e, std::vector<std::string>& bound, F&& f) {
    if (e.kind == Kind::Name && std::ranges::find(bound, e.name) == bound.end()) f(e.name);
    const std::size_t before = bound.size();
    bound.insert(bound.end(), e.parameters.begin(), e.parameters.end());
    for (const ExpressionPtr& part : e.parts) visit_names(*part, bound, f);
    bound.resize(before);
}

} // namespace

std::string dotted_name(const Expression& e) {
    if (e.kind == Kind::Name) return e.name;
    if (e.kind != Kind::Field) return "";
    const std::string base = dotted_name(*e.parts[0]);
    return base.empty() ? "" : base + "." + e.name;
}

std::vector<std::string> free_variables(const Expression& expression, const Workspace& variables) {
    std::vector<std::string> names, bound;
    visit_names(expression, bound, [&](const std::string& name) {
        const bool is_function = is_builtin(name) && !variables.contains(name);
        if (!is_function && std::ranges::find(names, name) == names.end()) names.push_back(name);
    });
    return names;
}

Value Interpreter::State::evaluate(const Expression& e) {
    if (e.kind == Kind::Literal) return e.value;
    try {
        const Level level(*this);
        budget.spend(interpreted_step);
        return evaluate_kind(e);
    } catch (const Error& error) {
        if (error.located()) throw;
        throw Error(error.message(), e.span);
    }
}

Value Interpreter::State::evaluate_kind(const Expression& e) {
    switch (e.kind) {
    case Kind::Literal: return e.value;
    case Kind::Unary: return unary(e.op, evaluate(*e.parts[0]), budget);
    case Kind::Binary: {
        if (e.op == Operator::AndAlso || e.op == Operator::OrElse) return evaluate_short_circuit(e);
        const Value left = evaluate(*e.parts[0]);
        return binary(e.op, left, evaluate(*e.parts[1]), budget);
    }
    case Kind::Range: return evaluate_range(e);
    case Kind::End: return evaluate_end(e);
    case Kind::Matrix: return evaluate_matrix(e);
    case Kind::Cell: return evaluate_cell(e);
    case Kind::Handle: {
        auto closure = std::make_shared<Closure>();
        closure->name = e.name;
        closure->program = frame_->program;
        return Value(std::shared_ptr<const Closure>(std::move(closure)));
    }
    case Kind::Lambda: return evaluate_lambda(e);
    default: break;
    }
    std::vector<Value> values = evaluate_chain(e, 1);
    if (values.empty()) throw Error("this gives no value");
    if (values.size() > 1 && e.kind == Kind::CellIndex)
        throw Error("'{}' selects " + std::to_string(values.size()) + " elements where one is needed");
    return std::move(values[0]);
}

std::vector<Value> Interpreter::State::evaluate_many(const Expression& e, int outputs) {
    if (e.kind != Kind::Name && e.kind != Kind::Index && e.kind != Kind::CellIndex && e.kind != Kind::Field)
        return {evaluate(e)};
    try {
        const Level level(*this);
        budget.spend(interpreted_step);
        return evaluate_chain(e, outputs);
    } catch (const Error& error) {
        if (error.located()) throw;
        throw Error(error.message(), e.span);
    }
}

Value Interpreter::State::evaluate_range(const Expression& e) {
    const Value first = evaluate(*e.parts[0]);
    const Value middle = evaluate(*e.parts[1]);
    if (e.parts.size() == 2) return range(first, 1, middle, budget);
    return range(first, middle, evaluate(*e.parts[2]), budget);
}

Value Interpreter::State::evaluate_short_circuit(const Expression& e) {
    const bool is_and = e.op == Operator::AndAlso;
    if (evaluate(*e.parts[0]).truth() != is_and) return !is_and;
    return evaluate(*e.parts[1]).truth();
}

Value Interpreter::State::evaluate_end(const Expression&) const {
    if (index_ == nullptr) throw Error("'end' stands for the last index only when a variable is indexed");
    const Value& base = index_->base;
    if (index_->count == 1) return base.numel();
    return index_->position == 0 ? base.rows() : index_->position == 1 ? base.cols() : Index(1);
}

Value Interpreter::State::evaluate_matrix(const Expression& e) {
    std::vector<Value> rows;
    rows.reserve(e.parts.size());
    for (const ExpressionPtr& row : e.parts)
        rows.push_back(concatenate_columns(evaluate_list(*row, 0), budget));
    if (rows.empty()) return {};
    return concatenate_rows(rows, budget);
}

Value Interpreter::State::evaluate_cell(const Expression& e) {
    std::vector<Value> rows;
    rows.reserve(e.parts.size());
    for (const ExpressionPtr& row : e.parts) {
        std::vector<Value> elements = evaluate_list(*row, 0);
        const auto n = static_cast<Index>(elements.size());
        budget.allocate(1, double(n));
        if (n > 0) rows.push_back(Value::cell(1, n, std::move(elements)));
    }
    if (rows.empty()) return Value::cell(0, 0);
    return concatenate_rows(rows, budget);
}

Value Interpreter::State::evaluate_lambda(const Expression& e) {
    auto closure = std::make_shared<Closure>();
    closure->lambda = std::make_shared<const Expression>(e);
    closure->program = frame_->program;
    std::vector<std::string> bound;
    visit_names(e, bound, [&](const std::string& name) {
        const Value* value = frame_->variables->find(name);
        const auto known = std::ranges::find(closure->captured, name, &Value::Fields::value_type::first);
        if (value != nullptr && known == closure->captured.end())
            closure->captured.emplace_back(name, *value);
    });
    return Value(std::shared_ptr<const Closure>(std::move(closure)));
}

bool Interpreter::State::is_variable(const Expression& root) const {
    return root.kind != Kind::Name || frame_->variables->contains(root.name);
}

std::string Interpreter::State::field_name(const Expression& e) {
    return e.kind == Kind::Field ? e.name : evaluate(*e.parts[1]).text();
}

/// The arguments or elements from part `first` on; `c{:}` counts as many.
std::vector<Value> Interpreter::State::evaluate_list(const Expression& e, std::size_t first) {
    std::vector<Value> values;
    values.reserve(e.parts.size() - first);
    for (std::size_t i = first; i < e.parts.size(); ++i) {
        const Expression& part = *e.parts[i];
        if (part.kind == Kind::CellIndex) {
            std::ranges::move(evaluate_many(part, 1), std::back_inserter(values));
        } else {
            values.push_back(part.kind == Kind::Colon ? Value(":") : evaluate(part));
        }
    }
    return values;
}

std::vector<Selection> Interpreter::State::evaluate_selections(const Expression& e, const Value& base) {
    const std::size_t count = e.parts.size() - 1;
    std::vector<Selection> selections;
    selections.reserve(count);
    for (std::size_t k = 0; k < count; ++k) {
        const Expression& part = *e.parts[k + 1];
        const Index extent = count == 1 ? base.numel() : k == 0 ? base.rows() : k == 1 ? base.cols() : 1;
        if (part.kind == Kind::Colon) {
            selections.push_back(select_all(extent, budget));
            continue;
        }
        const IndexContext context{base, k, count};
        struct Restore {
            const IndexContext*& variable;
            const IndexContext* before;
            ~Restore() { variable = before; }
        } const restore{index_, std::exchange(index_, &context)};
        if (part.kind == Kind::CellIndex) { // c{:} as indices
            for (const Value& value : evaluate_many(part, 1))
                selections.push_back(select(value, extent, budget));
        } else {
            selections.push_back(select(evaluate(part), extent, budget));
        }
    }
    return selections;
}

std::vector<Value> Interpreter::State::evaluate_chain(const Expression& e, int outputs) {
    if (e.kind == Kind::Name) {
        if (const Value* value = frame_->variables->find(e.name)) return {*value};
        return call_named(e.name, {}, outputs);
    }
    const bool is_field = e.kind == Kind::Field;
    if ((is_field || e.kind == Kind::Index) && !is_variable(root_of(e))) {
        const std::string name = dotted_name(is_field ? e : *e.parts[0]);
        const bool root_is_function = is_field && is_function(root_of(e).name) && !is_function(name);
        if (!name.empty() && !root_is_function)
            return call_named(name, is_field ? std::vector<Value>() : evaluate_list(e, 1), outputs);
    }
    const Value base = evaluate(*e.parts[0]);
    if (is_field || e.kind == Kind::DynamicField) return {base.field(field_name(e), &suggestions)};
    if (e.kind == Kind::Index) {
        if (base.is_function()) return apply(base, evaluate_list(e, 1), outputs);
        return {index(base, evaluate_selections(e, base), budget)};
    }
    if (!base.is_cell())
        throw Error("'{}' indexes cell arrays only, this is a " + base.size_text() + " " +
                    std::string(base.type_name()));
    const Value selected = index(base, evaluate_selections(e, base), budget);
    std::vector<Value> values;
    values.reserve(selected.numel());
    for (Index i = 0; i < selected.numel(); ++i) values.push_back(selected.at(i));
    return values;
}

} // namespace bf::matlab
