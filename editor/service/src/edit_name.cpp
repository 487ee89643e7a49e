#include "edit_name.hpp"

#include "bf/model/edit.hpp"
#include "inspect.hpp"

#include <algorithm>
#include <array>

namespace bf::service {

namespace {

bool is_of_drawing(const std::string& kind) {
    constexpr std::array kinds{"move",  "resize",   "flip",   "rotate", "place_port", "bend",
                               "label", "annotate", "record", "plot",   "watch"};
    return std::ranges::find(kinds, kind) != kinds.end();
}

std::string name_of(const Json& operation) {
    const auto text = [](const Json& of, const char* key) {
        const auto at = of.find(key);
        return at != of.end() && at->is_string() ? at->get<std::string>() : std::string();
    };
    std::string kind = text(operation, "do");
    const auto within = [&](const std::string& name) {
        const std::string system = text(operation, kind == "set" ? "path" : "system");
        return system.empty() || name.empty() ? system + name : model::joined(system, name);
    };
    if (kind == "set" || kind == "set_variable") {
        const std::string what = within(text(operation, "name"));
        const auto variable = operation.find("variable");
        const std::string value = kind == "set" ? text(operation, "value")
                                  : variable != operation.end() && variable->is_object()
                                      ? text(*variable, "value")
                                      : "";
        return value.empty() ? "remove " + what : what + " = " + shortened(value);
    }
    if (kind == "connect" || kind == "disconnect")
        return kind + " " + text(operation, "from") + " → " + text(operation, "to");
    std::string what = text(operation, "path");
    for (const char* key : {"block", "port"})
        if (const auto made = operation.find(key); made != operation.end() && made->is_object())
            what = within(text(*made, "name"));
    if (what.empty()) what = within(text(operation, "name"));
    std::replace(kind.begin(), kind.end(), '_', ' ');
    return kind + (what.empty() ? "" : " " + what);
}

} // namespace

std::vector<EditPart> parts_of(const Json& operation) {
    const std::string kind = operation.value("do", "");
    if (kind != "batch") return {{name_of(operation), is_of_drawing(kind)}};
    std::vector<EditPart> all;
    for (const Json& part : operation.at("operations"))
        for (EditPart& one : parts_of(part)) all.push_back(std::move(one));
    return all;
}

void EditNames::add(std::int64_t revision, std::vector<EditPart> parts) {
    all_.push_back({revision, std::move(parts)});
}

std::string EditNames::since(std::int64_t before) const {
    std::string first;
    int more = -1;
    for (const Edit& edit : all_) {
        if (edit.revision <= before) continue;
        for (const EditPart& part : edit.parts)
            if (!part.is_of_drawing && ++more == 0) first = part.name;
    }
    return (first.empty() ? "edit" : first) + (more > 0 ? " and " + std::to_string(more) + " more" : "");
}

} // namespace bf::service
