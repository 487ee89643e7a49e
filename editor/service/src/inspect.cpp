#include "inspect.hpp"

#include "bf/elaborate/solver_method.hpp"
#include "bf/library/declared.hpp"
#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "bf/view/draw.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

namespace bf::service {

std::string shortened(std::string text) {
    constexpr std::size_t most = 200;
    if (text.size() > most) text = text.substr(0, most) + "…";
    return text;
}

namespace {

/// What elaboration knows of the settings of a block or the properties of a system.
std::map<std::string, std::string> values_under(const Diagram& diagram, const std::string& path) {
    std::map<std::string, std::string> values;
    const std::string prefix = path.empty() ? "" : path + ".";
    for (const auto& definition : diagram.definitions)
        if (definition.kind != Definition::Kind::variable && definition.path.starts_with(prefix))
            values[definition.path.substr(prefix.size())] = shortened(definition.value.to_text());
    return values;
}

template <class Field> void note_limits(const Limits& limits, Field& field) {
    const double least = std::max(limits.minimum, limits.above);
    if (std::isfinite(least)) field.least = least;
    if (std::isfinite(limits.maximum)) field.greatest = limits.maximum;
}

/// The variables of a system are its parameters; of one in a file of its own with the values that the block
/// gives.
void add_parameters(const model::System& system, const model::Reference* reference, const std::string& path,
                    const Diagram& diagram, Inspection& seen) {
    for (auto& v : variables_of(system, path, diagram).variables) {
        SettingField field{v.name, FieldRole::parameter, {}, {}, v.value, v.unit, v.doc};
        if (!v.limits.empty()) field.doc += (field.doc.empty() ? "" : "; ") + v.limits;
        field.least = v.least;
        field.greatest = v.greatest;
        if (reference) {
            if (const model::Variable* given = model::find_variable(reference->with, v.name))
                field.text = given->value.matlab();
            field.initial = v.text;
        } else {
            field.text = v.text;
        }
        seen.fields.push_back(std::move(field));
    }
}

/// Of a transition.
void name_conditions(const std::vector<std::string>& conditions, SettingField& field) {
    field.choices = {"0"};
    field.names = {"none"};
    for (std::size_t i = 0; i < conditions.size(); ++i) {
        field.choices.push_back(std::to_string(i + 1));
        field.names.push_back(conditions[i]);
    }
}

} // namespace

Parameters parameters_of(Registry& registry, const model::Model& m, const Diagram& diagram) {
    Parameters all;
    const auto add = [&](Inspection seen) {
        std::erase_if(seen.fields,
                      [](const SettingField& field) { return field.role != FieldRole::parameter; });
        if (!seen.fields.empty()) all.blocks.push_back(std::move(seen));
    };
    add(inspected(registry, m, diagram, ""));
    model::walk(
        m, [&](const std::string& path, const model::Block&) { add(inspected(registry, m, diagram, path)); });
    return all;
}

Inspection inspected(Registry& registry, const model::Model& m, const Diagram& diagram,
                     const std::string& path) {
    const model::Block* block = path.empty() ? nullptr : model::find(m, path);
    Inspection seen;
    seen.path = path;
    seen.title = path.empty() ? m.name : model::split_last(path).second;
    const auto values = values_under(diagram, path);
    const auto value = [&](const std::string& name) {
        const auto found = values.find(name);
        return found == values.end() ? std::string() : found->second;
    };
    if (block && block->is_library_block()) {
        seen.type = block->type;
        const auto text = [&](const std::string& name) -> std::optional<std::string> {
            const model::Setting* setting = block->find_setting(name);
            return setting ? std::optional(setting->value.matlab()) : std::nullopt;
        };
        try {
            const Declared what = declared(registry.find(block->type));
            seen.doc = what.doc;
            for (const auto& a : what.arguments)
                seen.fields.push_back({a.name, FieldRole::argument, text(a.name), a.initial, value(a.name),
                                       "", with_limits(a.doc, a.limits), a.choices});
            for (const auto& q : what.quantities)
                if (q.role == Role::parameter) {
                    seen.fields.push_back({q.name, FieldRole::parameter, text(q.name), q.initial,
                                           value(q.name), q.unit == "any" ? "" : q.unit,
                                           with_limits(q.doc, q.limits, q.at_least)});
                    note_limits(q.limits, seen.fields.back());
                    seen.fields.back().is_whole = q.type.find("int") != q.type.npos; // "uint8", "int32"
                }
        } catch (const std::exception& error) {
            seen.doc = error.what();
        }
        for (const auto& setting : block->settings) // also those that nothing declares
            if (std::ranges::find(seen.fields, setting.name, &SettingField::name) == seen.fields.end())
                seen.fields.push_back({setting.name, FieldRole::argument, setting.value.matlab()});
    }
    if (path.empty()) add_parameters(m.root, nullptr, path, diagram, seen);
    if (block && block->content()) {
        const model::Reference* const reference = block->reference ? &*block->reference : nullptr;
        add_parameters(*block->content(), reference, path, diagram, seen);
        seen.doc = block->doc.empty() && reference ? reference->model->doc : block->doc;
    }
    for (auto& property : model::properties(m, path)) {
        if (path.empty() && property.name == "solver")
            for (const auto& [name, method] : solver_methods) property.choices.emplace_back(name);
        seen.fields.push_back({.name = property.name,
                               .role = FieldRole::property,
                               .text = property.value,
                               .value = value(property.name),
                               .choices = std::move(property.choices)});
        if (const auto machine = model::split_chart(m, path).first;
            !machine.empty() && property.name == "condition")
            name_conditions(editor::conditions_of(m, machine, diagram), seen.fields.back());
    }
    return seen;
}

namespace {

/// What names each variable, by the number of its definition.
std::map<int, std::vector<std::string>> users_in(const Diagram& diagram) {
    std::map<int, std::vector<std::string>> users;
    for (const auto& definition : diagram.definitions)
        for (const auto& [name, variable] : definition.uses) {
            const bool is_variable = definition.kind == Definition::Kind::variable;
            const std::string user = is_variable ? definition.path : model::split_last(definition.path).first;
            auto& known = users[variable];
            if (std::ranges::find(known, user) == known.end()) known.push_back(user);
        }
    return users;
}

} // namespace

Variables variables_of(const model::System& system, const std::string& path, const Diagram& diagram,
                       const std::vector<model::Diagnostic>& diagnostics) {
    std::map<std::string, std::string> mistakes;
    for (const auto& d : diagnostics)
        if (!d.variable.empty()) mistakes[d.variable] += d.message + "\n";
    std::map<std::string, const Definition*> known;
    for (const auto& definition : diagram.definitions)
        if (definition.kind == Definition::Kind::variable) known[definition.path] = &definition;
    const auto users = users_in(diagram);
    Variables found;
    const auto add = [&](const auto& self, const std::vector<model::Variable>& list,
                         const std::string& prefix) -> void {
        for (const auto& variable : list) {
            if (!variable.fields.empty()) {
                self(self, variable.fields, prefix + variable.name + ".");
                continue;
            }
            VariableField field;
            field.system = path;
            field.name = prefix + variable.name;
            field.text = variable.value.matlab();
            field.unit = variable.unit;
            field.doc = variable.doc;
            if (variable.minimum) field.minimum = variable.minimum->matlab();
            if (variable.above) field.above = variable.above->matlab();
            if (variable.maximum) field.maximum = variable.maximum->matlab();
            const std::string whole = model::joined(path, field.name);
            if (const auto wrong = mistakes.find(whole); wrong != mistakes.end())
                field.mistake = wrong->second.substr(0, wrong->second.size() - 1);
            const auto definition = known.find(whole);
            if (definition != known.end()) {
                field.value = shortened(definition->second->value.to_text());
                field.limits = text_of(definition->second->limits);
                note_limits(definition->second->limits, field);
                const auto number = static_cast<int>(definition->second - diagram.definitions.data());
                if (const auto used = users.find(number); used != users.end()) field.used_by = used->second;
            }
            found.variables.push_back(std::move(field));
        }
    };
    add(add, system.variables, "");
    return found;
}

Variables variables_seen_in(const std::string& path, const model::Model& model, const Diagram& diagram,
                            const std::vector<model::Diagnostic>& diagnostics) {
    Variables all;
    std::set<std::string> hidden; // by those of inner subsystems
    const auto head = [](const VariableField& field) { return field.name.substr(0, field.name.find('.')); };
    for (std::string at = path;; at = model::split_last(at).first) {
        const model::System* system = model::find_system(model, at);
        if (!system) throw std::runtime_error("there is no subsystem '" + at + "'");
        for (auto& variable : variables_of(*system, at, diagram, diagnostics).variables)
            if (!hidden.contains(head(variable))) all.variables.push_back(std::move(variable));
        if (at.empty()) return all;
        for (const auto& variable : all.variables) hidden.insert(head(variable));
    }
}

} // namespace bf::service
