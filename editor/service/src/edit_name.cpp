#include "edit_name.hpp"

#include "bf/model/edit.hpp"
#include "inspect.hpp"

#include <algorithm>

namespace bf::service {

std::string edit_name(const Json& operation) {
    const auto text = [](const Json& of, const char* key) {
        const auto at = of.find(key);
        return at != of.end() && at->is_string() ? at->get<std::string>() : std::string();
    };
    std::string kind = text(operation, "do");
    const auto within = [&](const std::string& name) {
        const std::string system = text(operation, kind == "set" ? "path" : "system");
        return system.empty() || name.empty() ? system + name : model::joined(system, name);
    };
    if (kind == "batch") {
        const Json& parts = operation.at("operations");
        const std::size_t more = parts.size() - 1;
        if (parts.empty()) return "edit";
        return edit_name(parts[0]) + (more > 0 ? " and " + std::to_string(more) + " more" : "");
    }
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

} // namespace bf::service
