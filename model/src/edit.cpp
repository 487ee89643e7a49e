#include "bf/model/edit.hpp"

#include "bf/model/chart.hpp"
#include "editor.hpp"

#include <algorithm>

namespace bf::model {
namespace {

void walk_system(const System& system, const std::string& prefix,
                 const std::function<void(const std::string&, const Block&)>& visit) {
    for (const Block& block : system.blocks) {
        const std::string path = prefix + block.name;
        visit(path, block);
        if (const System* content = block.content()) walk_system(*content, path + ".", visit);
    }
}

} // namespace

std::string joined(std::string_view system, std::string_view name) {
    return system.empty() ? std::string(name) : std::string(system) + "." + std::string(name);
}

std::pair<std::string, std::string> split_last(std::string_view path) {
    const std::size_t dot = path.rfind('.');
    if (dot == path.npos) return {"", std::string(path)};
    return {std::string(path.substr(0, dot)), std::string(path.substr(dot + 1))};
}

const Block* find(const Model& model, std::string_view path) {
    const System* system = &model.root;
    while (system) {
        const std::size_t dot = path.find('.');
        const Block* block = system->find_block(path.substr(0, dot));
        if (!block || dot == path.npos) return block;
        system = block->content();
        path.remove_prefix(dot + 1);
    }
    return nullptr;
}

Block* find(Model& model, std::string_view path) {
    const auto [parent, name] = split_last(path);
    System* system = find_system(model, parent);
    return system ? system->find_block(name) : nullptr;
}

const System* find_system(const Model& model, std::string_view path) {
    if (path.empty()) return &model.root;
    const Block* block = find(model, path);
    return block ? block->content() : nullptr;
}

System* find_system(Model& model, std::string_view path) {
    if (path.empty()) return &model.root;
    Block* block = find(model, path);
    return block ? block->system.get() : nullptr;
}

std::vector<std::string> systems_with_wire(const Model& model, const std::string& path) {
    std::vector<std::string> systems;
    const std::string around = split_last(path).first;
    for (const std::string& system : {around, split_last(around).first}) {
        const System* const content = find_system(model, system);
        if (!content || (!systems.empty() && systems.back() == system)) continue;
        const std::string end = system.empty() ? path : path.substr(system.size() + 1);
        const bool leads = std::ranges::any_of(content->connections, [&](const Connection& connection) {
            return std::ranges::find(connection.to, end, &Endpoint::text) != connection.to.end();
        });
        if (leads) systems.push_back(system);
    }
    if (const auto [machine, name] = split_chart(model, path); !machine.empty()) {
        const auto chart = chart_of(*find(model, machine));
        bool leads = !chart; // which transitions there are, its evaluation tells
        for (std::size_t i = 0; chart && i < chart->transitions.size(); ++i)
            leads |= chart->name_of(i) == name;
        if (leads) systems.push_back(machine);
    }
    return systems;
}

const Variable* find_variable(const std::vector<Variable>& variables, std::string_view name) {
    const std::size_t dot = name.find('.');
    const auto found = std::ranges::find(variables, name.substr(0, dot), &Variable::name);
    if (found == variables.end()) return nullptr;
    return dot == name.npos ? &*found : find_variable(found->fields, name.substr(dot + 1));
}

void walk(const Model& model, const std::function<void(const std::string&, const Block&)>& visit) {
    walk_system(model.root, "", visit);
}

void set(Block& block, std::string_view setting, std::string value) {
    for (Setting& known : block.settings) {
        if (known.name != setting) continue;
        const bool is_code = known.value.quotes == Quotes::literal; // which stays on lines of its own
        known.value = {.text = std::move(value),
                       .where = known.value.where,
                       .quotes = is_code ? Quotes::literal : Quotes::none};
        return;
    }
    block.settings.push_back({.name = std::string(setting), .value = {.text = std::move(value)}});
}

} // namespace bf::model
