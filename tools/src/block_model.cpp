#include "block_model.hpp"

#include <algorithm>

namespace bf::tools {

namespace {

bool is_of_model(const std::string& name) {
    for (const char* its : {"step", "stop", "solver", "relative_tolerance", "absolute_tolerance", "max_step"})
        if (name == its) return true;
    return false;
}

/// Without places, as no file says it.
[[noreturn]] void refuse(const ExaminedModel& model) {
    auto diagnostics = model.diagnostics;
    for (auto& one : diagnostics) one.where = {};
    throw model::Errors(std::move(diagnostics));
}

} // namespace

LoadedModel block_as_model(const ModelOptions& options) {
    const std::string& type = options.file;
    const auto defaults = make_registry()->find(type).make({});
    const auto& arguments = defaults->declaration().arguments;

    model::Model model;
    const auto slash = type.find('/');
    model.name = type.substr(slash == std::string::npos ? 0 : slash + 1);
    model.step = model::Expression{"0.01"};
    model.solver = model::Expression{"rk4"};
    if (slash != std::string::npos) model.plugins.push_back({type.substr(0, slash)});
    model.root.blocks.emplace_back();
    auto& block = model.root.blocks.back();
    block.name = model.name;
    block.type = type;

    // Arguments decide which ports there are; a value of another name is a port's shape or a parameter.
    std::vector<Override> of_model, others;
    for (const auto& given : options.overrides()) {
        const auto is_it = [&](const auto& argument) { return argument.name == given.name; };
        if (is_of_model(given.name))
            of_model.push_back(given);
        else if (std::ranges::any_of(arguments, is_it))
            block.settings.push_back({given.name, model::Expression{given.text}});
        else
            others.push_back(given);
    }
    const std::filesystem::path file = std::filesystem::absolute(model.name + ".yaml");
    const auto alone = examine(model, file);
    if (alone.diagram.nodes.empty()) refuse(alone);
    for (const auto& slot : alone.diagram.nodes.front().block->resolution().slots)
        for (const auto& [role, ports] :
             {std::pair{Role::input, &model.root.inputs}, std::pair{Role::output, &model.root.outputs}})
            if (slot.role == role) {
                ports->push_back({slot.name});
                const model::Endpoint inner{block.name, slot.name}, outer{slot.name};
                if (role == Role::input)
                    model.root.connections.push_back({outer, {inner}});
                else
                    model.root.connections.push_back({inner, {outer}});
            }
    for (const auto& given : others) {
        const auto port = std::ranges::find(model.root.inputs, given.name, &model::Port::name);
        if (port != model.root.inputs.end())
            port->shape = model::Expression{given.text};
        else
            block.settings.push_back({given.name, model::Expression{given.text}});
    }
    auto found = examine(model, file, of_model);
    if (!found.diagnostics.empty()) refuse(found);
    return found;
}

} // namespace bf::tools
