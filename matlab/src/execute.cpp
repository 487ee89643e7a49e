#include "state.hpp"

#include <algorithm>

namespace bf::matlab {
namespace {

bool is_undefined(const Value& value) {
    return value.type() == Class::Double && value.rows() == 0 && value.cols() == 0;
}

bool is_first(const std::vector<Selection>& at) {
    return std::ranges::all_of(at, [](const Selection& s) { return s.positions == std::vector<Index>{0}; });
}

/// Whether a case of `switch` matches: equal text, equal numbers, or any element of a cell.
bool matches(const Value& value, const Value& wanted) {
    if (wanted.is_cell()) {
        for (Index i = 0; i < wanted.numel(); ++i)
            if (matches(value, wanted.at(i))) return true;
        return false;
    }
    if (value.is_text() || wanted.is_text())
        return value.is_text() && wanted.is_text() && value.text() == wanted.text();
    return value.is_array() && wanted.is_array() && value.is_scalar() && wanted.is_scalar() &&
           value.scalar() == wanted.scalar();
}

} // namespace

Interpreter::State::Flow Interpreter::State::execute(const Block& block) {
    for (const Statement& statement : block)
        if (const Flow flow = execute(statement); flow != Flow::Next) return flow;
    return Flow::Next;
}

Interpreter::State::Flow Interpreter::State::execute(const Statement& statement) {
    try {
        budget.spend(interpreted_step);
        return execute_statement(statement);
    } catch (const Error& error) {
        if (error.located()) throw;
        throw Error(error.message(), statement.span);
    }
}

Interpreter::State::Flow Interpreter::State::execute_statement(const Statement& s) {
    switch (s.kind) {
    case StatementKind::Evaluate: {
        std::vector<Value> values = evaluate_many(*s.value, 0);
        if (!values.empty() && s.value->kind != Kind::Name) variables().set("ans", std::move(values[0]));
        return Flow::Next;
    }
    case StatementKind::Assign: execute_assign(s); return Flow::Next;
    case StatementKind::If:
        for (const Branch& branch : s.branches)
            if (!branch.condition || evaluate(*branch.condition).truth()) return execute(branch.body);
        return Flow::Next;
    case StatementKind::While:
        while (evaluate(*s.branches[0].condition).truth()) {
            const Flow flow = execute(s.branches[0].body);
            if (flow == Flow::Break) break;
            if (flow == Flow::Return) return flow;
        }
        return Flow::Next;
    case StatementKind::For: return execute_for(s);
    case StatementKind::Switch: return execute_switch(s);
    case StatementKind::Break: return Flow::Break;
    case StatementKind::Continue: return Flow::Continue;
    case StatementKind::Return: return Flow::Return;
    case StatementKind::Persistent: execute_persistent(s); return Flow::Next;
    case StatementKind::Command: execute_command(s); return Flow::Next;
    }
    return Flow::Next;
}

Interpreter::State::Flow Interpreter::State::execute_for(const Statement& s) {
    const Value values = evaluate(*s.branches[0].condition);
    const bool is_list = values.is_array() || values.is_cell();
    const Index count = !is_list ? 1 : values.rows() == 0 ? 0 : values.cols();
    for (Index j = 0; j < count; ++j) {
        budget.spend(interpreted_step);
        Value element = values;
        if (values.is_array() && values.rows() == 1) {
            element = Value::array(values.type(), 1, 1, {values[j]});
        } else if (is_list) {
            const std::vector<Selection> column{select_all(values.rows(), budget),
                                                select(j + 1, count, budget)};
            element = index(values, column, budget);
        }
        assign(*s.targets[0], std::move(element), false);
        const Flow flow = execute(s.branches[0].body);
        if (flow == Flow::Break) break;
        if (flow == Flow::Return) return flow;
    }
    return Flow::Next;
}

Interpreter::State::Flow Interpreter::State::execute_switch(const Statement& s) {
    const Value value = evaluate(*s.value);
    for (const Branch& branch : s.branches)
        if (!branch.condition || matches(value, evaluate(*branch.condition))) return execute(branch.body);
    return Flow::Next;
}

void Interpreter::State::execute_assign(const Statement& s) {
    if (s.targets.size() == 1) {
        const Expression& target = *s.targets[0];
        const bool deletes =
            s.value->kind == Kind::Matrix && s.value->parts.empty() && target.kind == Kind::Index;
        assign(target, evaluate(*s.value), deletes);
        return;
    }
    std::vector<Value> values = evaluate_many(*s.value, int(s.targets.size()));
    if (values.size() < s.targets.size())
        throw Error("the right side gives " + std::to_string(values.size()) + " values for " +
                    std::to_string(s.targets.size()) + " variables");
    for (std::size_t i = 0; i < s.targets.size(); ++i) assign(*s.targets[i], std::move(values[i]), false);
}

void Interpreter::State::execute_persistent(const Statement& s) {
    if (!frame_->function) throw Error("'persistent' belongs into a function");
    if (!persistent_.contains(frame_->function)) kept_.push_back(frame_->program);
    for (const std::string& word : s.words) {
        if (std::ranges::find(frame_->persistent, word) != frame_->persistent.end()) continue;
        variables().set(word, persistent_[frame_->function][word]);
        frame_->persistent.push_back(word);
    }
}

void Interpreter::State::execute_command(const Statement& s) {
    const std::vector<std::string>& words = s.words;
    const auto given = [&](const std::string& word) {
        return std::find(words.begin() + 1, words.end(), word) != words.end();
    };
    if (words[0] == "import") {
        for (std::size_t i = 1; i < words.size(); ++i)
            if (words[i].ends_with(".*")) frame_->imports.push_back(words[i].substr(0, words[i].size() - 2));
    } else if (words[0] == "clear" || words[0] == "clearvars") {
        const bool except = given("-except");
        const bool all = words.size() == 1 || given("all") || given("variables") || given("-all");
        if (all && !except) return variables().clear();
        std::vector<std::string> names;
        for (const auto& entry : variables()) names.push_back(entry.first);
        for (const std::string& name : names)
            if (given(name) != except) variables().erase(name);
    }
    // the others (clc, close, hold, ...) concern a display
}

void Interpreter::State::assign(const Expression& target, Value value, bool deletes) {
    if (target.kind == Kind::Ignored) return;
    if (target.kind == Kind::Name) return variables().set(target.name, std::move(value));

    std::vector<const Expression*> chain; // from the variable outwards
    const Expression* root = &target;
    for (; root->kind != Kind::Name; root = root->parts[0].get()) chain.insert(chain.begin(), root);
    const Value* variable = variables().find(root->name);
    const bool existed = variable != nullptr;

    // all indices are evaluated before anything changes: they may use the variable itself
    std::vector<Access> path;
    {
        Value current = existed ? *variable : Value();
        for (std::size_t i = 0; i < chain.size(); ++i) {
            const bool last = i + 1 == chain.size();
            path.push_back(access(*chain[i], current, last));
            const Access& step = path.back();
            Value next;
            if (step.kind == Kind::Field && current.is_struct()) {
                if (const Value* field = current.find_field(step.field)) next = *field;
            } else if (step.kind == Kind::CellIndex && current.is_cell() && !last) {
                bool inside = true;
                for (std::size_t k = 0; k < step.at.size(); ++k)
                    inside = inside && step.at[k].largest <= (step.at.size() == 1 ? current.numel()
                                                              : k == 0            ? current.rows()
                                                                                  : current.cols());
                if (inside) {
                    const Value selected = index(current, step.at, budget);
                    if (selected.numel() == 1) next = selected.at(0);
                }
            } else if (step.kind == Kind::Index) {
                next = current;
            }
            current = std::move(next);
        }
    }
    Value base = variables().take(root->name);
    try {
        store(base, path, 0, value, deletes);
    } catch (...) {
        existed ? variables().set(root->name, std::move(base)) : variables().erase(root->name);
        throw;
    }
    variables().set(root->name, std::move(base));
}

Interpreter::State::Access Interpreter::State::access(const Expression& e, const Value& base, bool last) {
    if (e.kind == Kind::Field || e.kind == Kind::DynamicField) return {Kind::Field, field_name(e), {}};
    Access step{e.kind, "", evaluate_selections(e, base)};
    if (step.at.empty()) throw Error("an indexed assignment needs an index");
    for (std::size_t k = 2; k < step.at.size(); ++k)
        if (step.at[k].positions != std::vector<Index>{0})
            throw Error("arrays have two dimensions; index " + std::to_string(k + 1) + " must be 1");
    if (e.kind == Kind::Index && !last && !is_first(step.at))
        throw Error("arrays of structs are not supported; use a cell array, c{i}.field");
    return step;
}

/// path[i..] of base becomes value. What is moved out of `base` is put back when an error occurs.
void Interpreter::State::store(Value& base, const std::vector<Access>& path, std::size_t i, Value& value,
                               bool deletes) {
    if (i == path.size()) {
        base = std::move(value);
        return;
    }
    const Access& step = path[i];
    const bool last = i + 1 == path.size();
    if (step.kind == Kind::Field) {
        if (is_undefined(base)) base = Value::structure();
        if (!base.is_struct())
            throw Error("a " + std::string(base.type_name()) + " has no fields, so '" + step.field +
                        "' cannot be assigned");
        const bool existed = base.find_field(step.field) != nullptr;
        Value field = base.take_field(step.field);
        try {
            store(field, path, i + 1, value, deletes);
            base.set_field(step.field, field);
        } catch (...) {
            existed ? base.set_field(step.field, std::move(field)) : base.erase_field(step.field);
            throw;
        }
    } else if (step.kind == Kind::CellIndex) {
        if (is_undefined(base)) base = Value::cell(0, 0);
        if (!base.is_cell())
            throw Error("'{}' indexes cell arrays only, this is a " + std::string(base.type_name()));
        for (const Selection& s : step.at)
            if (s.positions.size() != 1) throw Error("'{}' on the left of '=' must select one element");
        if (last) return assign_index(base, step.at, Value::cell(1, 1, {std::move(value)}), budget);
        const bool linear = step.at.size() == 1;
        const auto fits = [&] {
            return linear ? step.at[0].largest <= base.numel()
                          : step.at[0].largest <= base.rows() && step.at[1].largest <= base.cols();
        };
        if (!fits()) assign_index(base, step.at, Value::cell(1, 1), budget);
        const Index at = linear ? step.at[0].positions[0]
                                : step.at[0].positions[0] + step.at[1].positions[0] * base.rows();
        Value element = base.take_at(at);
        try {
            store(element, path, i + 1, value, deletes);
            base.set_at(at, element);
        } catch (...) {
            base.set_at(at, std::move(element));
            throw;
        }
    } else if (!last) {
        store(base, path, i + 1, value, deletes); // element 1 of a struct is the struct
    } else if (deletes) {
        delete_index(base, step.at, budget);
    } else if (value.is_struct() && (base.is_struct() || is_undefined(base))) {
        if (!is_first(step.at))
            throw Error("arrays of structs are not supported; use a cell array, c{i} = s");
        base = std::move(value);
    } else {
        assign_index(base, step.at, value, budget);
    }
}

} // namespace bf::matlab
