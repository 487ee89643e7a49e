#include "evaluate.hpp"

#include "bf/matlab/error.hpp"
#include "bf/matlab/formula.hpp"
#include "bf/model/edit.hpp"
#include "inspect.hpp"

#include <deque>
#include <unordered_map>

namespace bf::service {

namespace {

using Known = std::unordered_map<std::string, const matlab::Value*>;

/// The value of a variable: a struct of those of its fields; none where it is not known.
std::optional<matlab::Value> value_of(const model::Variable& variable, const std::string& path,
                                      const Known& known) {
    if (const auto found = known.find(path); found != known.end()) return *found->second;
    if (variable.fields.empty()) return {};
    matlab::Value::Fields fields;
    for (const auto& field : variable.fields)
        if (auto value = value_of(field, path + "." + field.name, known))
            fields.emplace_back(field.name, std::move(*value));
    return matlab::Value::structure(std::move(fields));
}

/// Its members count on from 0, or from the last one that has a value.
matlab::Value value_of(const model::Variable& enumeration) {
    matlab::Value::Fields members;
    double next = 0;
    for (const auto& member : enumeration.fields) {
        next = matlab::plain_number(member.value.text).value_or(next);
        members.emplace_back(member.name, matlab::Value(next++));
    }
    return matlab::Value::structure(std::move(members));
}

} // namespace

Evaluated evaluated(const model::Model& model, const Diagram& diagram, const std::string& system,
                    const std::string& text) {
    Known known;
    for (const auto& definition : diagram.definitions)
        if (definition.kind == Definition::Kind::variable || definition.kind == Definition::Kind::constant)
            known.emplace(definition.path, &definition.value);
    std::deque<matlab::Workspace> scopes; // each refers to the one around it
    for (std::size_t end = 0;;) {
        const std::string path = system.substr(0, end);
        const model::System* content = model::find_system(model, path);
        const matlab::Workspace* around = scopes.empty() ? nullptr : &scopes.back();
        matlab::Workspace& scope = scopes.emplace_back(around);
        if (content) {
            for (const auto& enumeration : content->enumerations)
                scope.set(enumeration.name, value_of(enumeration));
            for (const auto& variable : content->variables)
                if (auto value = value_of(variable, model::joined(path, variable.name), known))
                    scope.set(variable.name, std::move(*value));
        }
        if (end >= system.size()) break;
        end = std::min(system.find('.', end + 1), system.size());
    }
    try {
        return {shortened(matlab::evaluate(text, scopes.back()).to_text()), ""};
    } catch (const matlab::Error& error) {
        return {"", error.message()};
    }
}

} // namespace bf::service
