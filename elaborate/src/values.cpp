// From text in the model to values for blocks.
#include "stages.hpp"

#include "bf/model/listed.hpp"

#include <algorithm>
#include <cmath>

namespace bf::elaboration {

namespace {

Type element_type(matlab::Class type) {
    switch (type) {
    case matlab::Class::Single: return Type::float32;
    case matlab::Class::Int8: return Type::int8;
    case matlab::Class::Int16: return Type::int16;
    case matlab::Class::Int32: return Type::int32;
    case matlab::Class::Uint8: return Type::uint8;
    case matlab::Class::Uint16: return Type::uint16;
    case matlab::Class::Uint32: return Type::uint32;
    case matlab::Class::Logical: return Type::boolean;
    default: return Type::float64;
    }
}

std::string trimmed(std::string_view text) {
    const auto begin = text.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) return {};
    text = text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
    if (text.size() >= 2 && (text.front() == '\'' || text.front() == '"') && text.back() == text.front())
        text = text.substr(1, text.size() - 2);
    return std::string(text);
}

} // namespace

Elaboration::Part Elaboration::part_of(std::string path) const {
    for (std::string head = path;;) {
        if (const auto found = variable_numbers.find(head); found != variable_numbers.end())
            return {found->second, path, path.size() - head.size()};
        if (const auto same = same_structs.find(head); same != same_structs.end()) {
            head = path = same->second + path.substr(head.size());
            continue;
        }
        const auto dot = head.rfind('.');
        if (dot == std::string::npos) return {-1, path, 0};
        head.resize(dot);
    }
}

void Elaboration::define(Definition definition, const Variables& variables) {
    using Kind = Definition::Kind;
    std::unordered_set<std::string> used; // a name stands for one variable
    const auto use = [&](const std::string& name, int variable) {
        if (used.insert(name).second) definition.uses.emplace_back(name, variable);
    };
    bool is_copy = false;
    if (definition.expression)
        for (const std::string& name : matlab::free_names(*definition.expression)) {
            const auto its_path = variables.path_of(name);
            if (!its_path) continue; // a function
            const auto [variable, path, rest] = part_of(*its_path);
            if (variable >= 0) {
                use(name.substr(0, name.size() - rest), variable);
                continue;
            }
            // A whole struct.
            for (auto at = variable_numbers.lower_bound(path + ".");
                 at != variable_numbers.end() && at->first.starts_with(path + "."); ++at)
                use(name + at->first.substr(path.size()), at->second);
            if (definition.kind == Kind::variable && definition.value.is_struct() &&
                dotted_name(*definition.expression) == name) {
                same_structs[definition.path] = path;
                is_copy = true;
            }
        }
    const bool is_variable = definition.kind == Kind::variable || definition.kind == Kind::constant;
    if (is_copy || (!is_variable && definition.uses.empty())) return;
    if (is_variable) variable_numbers[definition.path] = static_cast<int>(diagram.definitions.size());
    diagram.definitions.push_back(std::move(definition));
}

bool Elaboration::uses_unknown(const matlab::Expression& expression, const Variables& variables) const {
    if (unknown_variables.empty()) return false;
    for (const std::string& name : matlab::free_names(expression)) {
        const auto path = variables.path_of(name);
        if (!path) continue; // a function
        for (std::size_t end = path->find('.'); end != std::string::npos; end = path->find('.', end + 1))
            if (unknown_variables.contains(path->substr(0, end))) return true;
        const auto under = unknown_variables.lower_bound(*path);
        if (under != unknown_variables.end() && rest_under(*under, *path)) return true;
    }
    return false;
}

std::optional<matlab::Value> Elaboration::evaluate(const model::Expression& expression,
                                                   const Variables& variables, const std::string& path,
                                                   Definition::Kind kind, const char* what) {
    const bool is_variable = kind == Definition::Kind::variable;
    if (expression.quotes == model::Quotes::none)
        if (const auto number = matlab::plain_number(expression.text)) {
            if (is_variable) define({kind, path, {}, {}, matlab::Value(*number), {}, {}}, variables);
            return matlab::Value(*number);
        }
    const auto& where = expression.where;
    try {
        const auto parsed = matlab::parse_expression(
            expression.matlab(), {where.file ? *where.file : std::string(), where.line, where.column});
        if (uses_unknown(*parsed, variables)) return std::nullopt;
        matlab::Value value = matlab::evaluate(*parsed, variables, &suggestions);
        define({kind, *what ? path + "." + what : path, parsed, expression.text, value, {}, {}}, variables);
        return value;
    } catch (const matlab::Error& error) {
        model::Location at = where;
        if (where.line > 0 && error.located())
            at = {where.file, error.location().line, error.location().column};
        const std::string letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_ ./-";
        const bool may_be_text = is_variable && expression.quotes == model::Quotes::none &&
                                 expression.text.find_first_not_of(letters) == std::string::npos;
        report.add(
            {at,
             path,
             "'" + expression.text + "': " + error.message(),
             may_be_text ? "if it is a text, give it quotes of its own: \"'" + expression.text + "'\"" : "",
             {},
             false,
             is_variable ? path : ""});
        return std::nullopt;
    }
}

std::optional<double> Elaboration::evaluate_scalar(const model::Expression& expression,
                                                   const Variables& variables, const std::string& path,
                                                   const char* what) {
    const auto value = evaluate(expression, variables, path, Definition::Kind::structure, what);
    if (!value) return std::nullopt;
    if (!value->is_array() || value->is_text() || !value->is_scalar() || !std::isfinite(value->scalar())) {
        report.add(expression.where, path,
                   "'" + std::string(what) + "' must be a finite number, not " + value->describe());
        return std::nullopt;
    }
    return value->scalar();
}

Elaboration::Declared Elaboration::declared_port(const Scope& scope, const model::Port& port,
                                                 const std::string& path) {
    Declared declared{{}, &port, path, {}, {}, nullptr};
    if (port.shape)
        if (const auto shape = evaluate(*port.shape, scope.variables, path)) {
            const auto is_length = [&](matlab::Index i) {
                const double n = (*shape)[i];
                return n >= 1 && n <= 1e6 && n == std::floor(n);
            };
            const auto n = shape->is_array() ? shape->numel() : 0;
            if (n == 1 && is_length(0))
                declared.size = {static_cast<int>((*shape)[0]), 1, false};
            else if (n == 2 && is_length(0) && is_length(1))
                declared.size = {static_cast<int>((*shape)[0]), static_cast<int>((*shape)[1]), true};
            else
                report.add(port.shape->where, path, "'shape' is " + shape->describe(),
                           "give the length of a 1-D signal, or [rows columns] of a matrix");
        }
    if (port.type.empty()) return declared;
    declared.type = type_from_name(port.type);
    for (const Scope* s = &scope; s && !declared.type; s = s->parent)
        for (const auto& enumeration : s->system->enumerations)
            if (enumeration.name == port.type) {
                declared.type = Type::int32;
                declared.enumeration = s->variables.find(port.type);
            }
    if (!declared.type)
        report.add(port.where, path, "there is no type '" + port.type + "'",
                   "types: double, single, int8, uint8, int16, uint16, int32, uint32, boolean, and the "
                   "enumerations of the model");
    return declared;
}

std::optional<Value> to_value(const matlab::Value& value) {
    if (value.is_text()) return Value(value.text());
    if (value.is_cell()) {
        std::vector<std::string> texts;
        for (matlab::Index i = 0; i < value.numel(); ++i) {
            if (!value.at(i).is_text()) return std::nullopt;
            texts.push_back(value.at(i).text());
        }
        return Value(std::move(texts));
    }
    if (!value.is_array()) return std::nullopt;
    Value converted;
    converted.type = element_type(value.type());
    converted.rows = static_cast<int>(value.rows());
    converted.cols = static_cast<int>(value.cols());
    if (!value.is_empty()) converted.data.assign(value.data(), value.data() + value.numel());
    return converted;
}

std::optional<Value> text_setting(Elaboration& e, const Scope& scope, const model::Setting& setting,
                                  bool is_list, const std::string& path) {
    const auto& expression = setting.value;
    const std::string text = trimmed(expression.text);
    if (expression.quotes == model::Quotes::single || expression.quotes == model::Quotes::literal)
        return Value(expression.text);
    // A variable (or a field of one) that holds text goes before its own name; braces make a cell array.
    const std::string head = text.substr(0, text.find_first_of(".({[ "));
    const bool is_cell = is_list && text.starts_with('{');
    if (is_cell || (!head.empty() && scope.variables.contains(head))) {
        const auto value = e.evaluate(expression, scope.variables, path + "." + setting.name);
        return value ? to_value(*value) : std::nullopt;
    }
    if (!is_list) return Value(text);
    std::vector<std::string> items;
    for (auto& item : model::listed_texts(expression.text)) items.push_back(std::move(item.text));
    return Value(std::move(items));
}

} // namespace bf::elaboration
