#include "bf/elaborate/tuning.hpp"

#include "bf/core/resolve.hpp"
#include "bf/matlab/formula.hpp"

#include <algorithm>
#include <cmath>

namespace bf {

using Kind = Definition::Kind;

namespace {

std::string why_not_a_number(const matlab::Value& value) {
    if (value.is_struct() || value.is_cell() || value.is_text() || !value.is_array())
        return "it is a " + std::string(value.is_text() ? "text" : value.type_name());
    if (value.type() != matlab::Class::Double && !value.is_logical())
        return "it is of type " + std::string(value.type_name());
    return value.is_empty() ? "it is empty" : "";
}

matlab::Value with_field(const matlab::Value* whole, const std::string& path, const matlab::Value& value) {
    if (path.empty()) return value;
    const auto dot = path.find('.');
    const std::string name = path.substr(0, dot);
    matlab::Value result = whole && whole->is_struct() ? *whole : matlab::Value::structure();
    const matlab::Value* field = result.find_field(name);
    const matlab::Value inner =
        with_field(field, dot == std::string::npos ? std::string() : path.substr(dot + 1), value);
    result.set_field(name, inner);
    return result;
}

} // namespace

std::vector<std::string> fixed_definitions(const Diagram& diagram, std::vector<std::string> reasons) {
    const auto& all = diagram.definitions;
    reasons.resize(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (!reasons[i].empty()) continue;
        if (all[i].kind == Kind::constant) reasons[i] = "the model sets it";
        if (all[i].kind == Kind::structure) reasons[i] = "it is fixed when the model is elaborated";
        if (all[i].kind == Kind::variable) reasons[i] = why_not_a_number(all[i].value);
    }
    // What uses a variable comes after it.
    for (std::size_t i = all.size(); i-- > 0;) {
        if (reasons[i].empty()) continue;
        for (const auto& [name, used] : all[i].uses)
            if (auto& reason = reasons[static_cast<std::size_t>(used)]; reason.empty())
                reason = "'" + all[i].path + "' follows from it: " + reasons[i];
    }
    return reasons;
}

matlab::Workspace variables_of(const Definition& definition, const std::vector<matlab::Value>& values) {
    matlab::Workspace workspace;
    for (const auto& [name, used] : definition.uses) {
        const auto dot = name.find('.');
        const std::string root = name.substr(0, dot);
        workspace.set(root, with_field(workspace.find(root),
                                       dot == std::string::npos ? std::string() : name.substr(dot + 1),
                                       values[static_cast<std::size_t>(used)]));
    }
    return workspace;
}

Tuning::Tuning(const Diagram& diagram) : diagram_(diagram), fixed_(fixed_definitions(diagram)) {
    for (const auto& definition : diagram.definitions) state_.values.push_back(definition.value);
    state_.is_given.resize(diagram.definitions.size());
}

std::vector<Tuning::Variable> Tuning::variables() const {
    std::vector<Variable> variables;
    for (std::size_t i = 0; i < fixed_.size(); ++i) {
        const auto& definition = diagram_.definitions[i];
        const matlab::Value& value = state_.values[i];
        if (definition.kind != Kind::variable || !why_not_a_number(value).empty()) continue;
        variables.push_back({definition.path,
                             fixed_[i],
                             {value.data(), value.data() + value.numel()},
                             static_cast<int>(value.rows()),
                             static_cast<int>(value.cols()),
                             value.is_logical(),
                             definition.limits,
                             definition.unit,
                             definition.about()});
    }
    return variables;
}

int Tuning::number_of(const std::string& name) const {
    for (std::size_t i = 0; i < diagram_.definitions.size(); ++i)
        if (diagram_.definitions[i].kind == Kind::variable && diagram_.definitions[i].path == name)
            return static_cast<int>(i);
    return -1;
}

void Tuning::check_limits(std::size_t number, const std::vector<double>& values) const {
    const auto& definition = diagram_.definitions[number];
    std::string wrong;
    if (definition.kind == Kind::parameter)
        wrong = outside_limits(diagram_.slot(definition.end), values, definition.path);
    else if (wrong = outside(definition.limits, values); !wrong.empty())
        wrong = "variable '" + definition.path + "' " + wrong;
    if (!wrong.empty()) throw TuningError(wrong);
}

NamedValues Tuning::change(State& state, const NamedValues& changes) const {
    const auto& all = diagram_.definitions;
    NamedValues result;
    std::vector<char> is_stale(all.size());
    for (const auto& [name, values] : changes) {
        const int number = number_of(name);
        if (number < 0) { // a parameter: what it followed from no longer matters
            for (std::size_t i = 0; i < all.size(); ++i)
                if (all[i].kind == Kind::parameter && all[i].path == name) state.is_given[i] = true;
            result.emplace_back(name, values);
            continue;
        }
        const auto i = static_cast<std::size_t>(number);
        if (!fixed_[i].empty())
            throw TuningError("variable '" + name + "' cannot change in a run: " + fixed_[i]);
        matlab::Value& value = state.values[i];
        if (static_cast<matlab::Index>(values.size()) != value.numel())
            throw TuningError("variable '" + name + "' has " + std::to_string(value.numel()) +
                              " elements, not " + std::to_string(values.size()));
        if (value.is_logical())
            if (const auto wrong = outside(Type::boolean, values); !wrong.empty())
                throw TuningError("variable '" + name + "' " + wrong);
        check_limits(i, values);
        value = matlab::Value::array(value.type(), value.rows(), value.cols(), values);
        state.is_given[i] = is_stale[i] = true;
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
        const auto& definition = all[i];
        const bool follows =
            std::any_of(definition.uses.begin(), definition.uses.end(),
                        [&](const auto& use) { return is_stale[static_cast<std::size_t>(use.second)] != 0; });
        if (!follows || state.is_given[i]) continue;
        const std::string what = "'" + definition.path + "', which follows, ";
        matlab::Value value;
        try {
            value = matlab::evaluate(*definition.expression, variables_of(definition, state.values));
        } catch (const matlab::Error& error) {
            throw TuningError(what + "has no value: " + error.message());
        }
        const matlab::Value& before = state.values[i];
        if (value.type() != before.type() || value.rows() != before.rows() || value.cols() != before.cols())
            throw TuningError(what + "would become a " + value.size_text() + " " +
                              std::string(value.type_name()) + "; it is a " + before.size_text() + " " +
                              std::string(before.type_name()));
        std::vector<double> numbers(value.data(), value.data() + value.numel());
        state.values[i] = std::move(value);
        is_stale[i] = true;
        check_limits(i, numbers);
        if (definition.kind != Kind::parameter) continue;
        result.emplace_back(definition.path, std::move(numbers));
    }
    return result;
}

NamedValues Tuning::follow(const NamedValues& changes) const {
    State state = state_;
    return change(state, changes);
}

void Tuning::accept(const NamedValues& changes) { change(state_, changes); }

std::vector<double> Tuning::save() const {
    std::vector<double> all;
    for (std::size_t i = 0; i < state_.values.size(); ++i) {
        all.push_back(state_.is_given[i]);
        const matlab::Value& value = state_.values[i];
        if (state_.is_given[i] && diagram_.definitions[i].kind == Kind::variable)
            all.insert(all.end(), value.data(), value.data() + value.numel());
    }
    return all;
}

void Tuning::restore(std::span<const double> saved) {
    Tuning fresh(diagram_);
    NamedValues given;
    for (const Definition& definition : diagram_.definitions) {
        const bool is_given = !saved.empty() && saved[0] != 0;
        const auto count = static_cast<std::size_t>(
            is_given && definition.kind == Kind::variable ? definition.value.numel() : 0);
        if (saved.size() < 1 + count) throw TuningError("other variables were changed than the model has");
        if (is_given)
            given.emplace_back(
                definition.path,
                std::vector(saved.begin() + 1, saved.begin() + 1 + static_cast<std::ptrdiff_t>(count)));
        saved = saved.subspan(1 + count);
    }
    if (!saved.empty()) throw TuningError("other variables were changed than the model has");
    fresh.accept(given);
    state_ = std::move(fresh.state_);
}

} // namespace bf
