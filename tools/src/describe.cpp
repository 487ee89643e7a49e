// bf describe: which blocks exist and what they declare.
#include "session.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

namespace bf::tools {

namespace {

std::string extent_text(const Declaration& d, const Extent& e) {
    if (e.dim < 0) return std::to_string(e.plus);
    const std::string name = d.dims[static_cast<std::size_t>(e.dim)].name;
    return e.plus ? name + (e.plus > 0 ? "+" : "") + std::to_string(e.plus) : name;
}

std::string shape_text(const Declaration& d, const Slot& slot) {
    if (slot.shape.symbol >= 0) return "any size";
    const std::string rows = extent_text(d, slot.shape.rows);
    if (slot.shape.is_matrix) return rows + " x " + extent_text(d, slot.shape.cols);
    return rows == "1" ? "scalar" : "[" + rows + "]";
}

std::string type_text(const Slot& slot) { return slot.type_symbol < 0 ? name(slot.type) : "any type"; }

std::string value_text(const Value& v) {
    if (v.kind == Value::Kind::text) return "'" + v.text + "'";
    if (v.kind == Value::Kind::texts) return v.texts.empty() ? "{}" : v.describe();
    std::string text;
    for (int i = 0; i < v.rows; ++i)
        for (int j = 0; j < v.cols; ++j)
            text += (j ? " " : i ? "; " : "") + (v.type == Type::boolean ? std::string(v.data[static_cast<std::size_t>(i + j * v.rows)] != 0 ? "true" : "false") : number(v.data[static_cast<std::size_t>(i + j * v.rows)]));
    return v.data.size() == 1 ? text : "[" + text + "]";
}

std::string first_sentence(const std::string& doc) {
    const auto end = doc.find_first_of(".\n");
    return doc.substr(0, end == std::string::npos ? end : end + 1);
}

nlohmann::ordered_json to_json(const BlockClass& type) {
    const auto block = type.make({});
    const auto& d = block->declaration();
    nlohmann::ordered_json json{{"name", type.qualified_name()}, {"group", type.group}, {"doc", type.doc}};
    for (const auto& a : d.arguments) {
        nlohmann::ordered_json argument{{"name", a.name}, {"doc", a.doc}, {"default", value_text(a.initial)}};
        if (!a.choices.empty()) argument["choices"] = a.choices;
        json["arguments"].push_back(std::move(argument));
    }
    for (const auto& s : d.slots) {
        nlohmann::ordered_json slot{{"name", s.name}, {"role", name(s.role)}, {"type", type_text(s)}, {"size", shape_text(d, s)}, {"unit", std::string(s.unit.text)}, {"doc", s.doc}};
        if (s.role == Role::parameter) slot["default"] = s.initial;
        json["quantities"].push_back(std::move(slot));
    }
    return json;
}

void print(const BlockClass& type) {
    const auto block = type.make({});
    const auto& d = block->declaration();
    std::printf("%s\n  %s\n", type.qualified_name().c_str(), type.doc.c_str());
    if (!d.arguments.empty()) std::printf("\n  arguments (fixed when the block is made)\n");
    for (const auto& a : d.arguments) {
        std::string choices;
        for (const auto& c : a.choices) choices += (choices.empty() ? "; one of " : ", ") + c;
        std::printf("    %-22s = %-14s %s%s\n", a.name.c_str(), value_text(a.initial).c_str(), a.doc.c_str(), choices.c_str());
    }
    for (const Role role : {Role::input, Role::output, Role::parameter, Role::discrete_state, Role::continuous_state}) {
        bool is_first = true;
        for (const auto& s : d.slots) {
            if (s.role != role) continue;
            if (is_first) std::printf("\n  %ss\n", name(role));
            is_first = false;
            std::printf("    %-22s %-10s %-9s %-8s %s\n", s.name.c_str(), shape_text(d, s).c_str(), type_text(s).c_str(), std::string(s.unit.text).c_str(), s.doc.c_str());
        }
    }
    for (const auto& r : d.requirements) std::printf("\n  needs a %s around it: %s\n", r.type.c_str(), r.doc.c_str());
    for (const auto& p : d.provisions) std::printf("\n  provides a %s\n", p.type.c_str());
}

void execute(const std::string& what, bool as_json) {
    auto registry = make_registry();
    for (const auto& plugin : registry->available_plugins()) registry->load_plugin(plugin);
    const bool is_library = [&] {
        for (const auto& type : registry->classes())
            if (type->library == what) return true;
        return what.empty();
    }();
    if (!is_library) {
        const BlockClass& type = registry->find(what);
        if (as_json) std::printf("%s\n", to_json(type).dump(2).c_str());
        else print(type);
        return;
    }
    std::map<std::pair<std::string, std::string>, std::vector<const BlockClass*>> groups;
    for (const auto& type : registry->classes())
        if (what.empty() || type->library == what) groups[{type->library, type->group}].push_back(type.get());
    if (as_json) {
        auto list = nlohmann::ordered_json::array();
        for (const auto& [group, types] : groups)
            for (const auto* type : types) list.push_back(to_json(*type));
        std::printf("%s\n", list.dump(2).c_str());
        return;
    }
    for (const auto& [group, types] : groups) {
        std::printf("%s%s%s\n", group.first.empty() ? "standard" : group.first.c_str(), " / ", group.second.c_str());
        for (const auto* type : types) std::printf("  %-32s %s\n", type->name.c_str(), first_sentence(type->doc).c_str());
        std::printf("\n");
    }
}

} // namespace

void add_describe(CLI::App& app) {
    auto* command = app.add_subcommand("describe", "which blocks exist and what they declare");
    auto what = std::make_shared<std::string>();
    auto as_json = std::make_shared<bool>(false);
    command->add_option("what", *what, "a library, or a block as LIBRARY/BLOCK; nothing: everything");
    command->add_flag("--json", *as_json, "print as JSON");
    command->footer("Example: bf describe WholeBodyToolbox/MassMatrix");
    command->callback([what, as_json] { execute(*what, *as_json); });
}

} // namespace bf::tools
