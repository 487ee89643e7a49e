#include "bf/model/edit.hpp"

#include "bf/model/check.hpp"

#include <stdexcept>

namespace bf::model {
namespace {

/// Splits `path` at its last dot: "a.b.c" -> ("a.b", "c"), "a" -> ("", "a").
std::pair<std::string_view, std::string_view> split_last(std::string_view path) {
    const std::size_t dot = path.rfind('.');
    if (dot == path.npos) return {{}, path};
    return {path.substr(0, dot), path.substr(dot + 1)};
}

void walk_system(const System& system, const std::string& prefix,
                 const std::function<void(const std::string&, const Block&)>& visit) {
    for (const Block& block : system.blocks) {
        const std::string path = prefix + block.name;
        visit(path, block);
        if (const System* content = block.content()) walk_system(*content, path + ".", visit);
    }
}

System* find_system(Model& model, std::string_view path) {
    if (path.empty()) return &model.root;
    Block* block = find(model, path);
    return block ? block->system.get() : nullptr;
}

} // namespace

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

void walk(const Model& model, const std::function<void(const std::string&, const Block&)>& visit) {
    walk_system(model.root, "", visit);
}

void set(Block& block, std::string_view setting, std::string value) {
    for (Setting& known : block.settings) {
        if (known.name != setting) continue;
        known.value = {.text = std::move(value), .where = known.value.where};
        return;
    }
    block.settings.push_back({.name = std::string(setting), .value = {.text = std::move(value)}});
}

void rename(Model& model, std::string_view path, std::string_view name) {
    const auto [parent, old_view] = split_last(path);
    const std::string old(old_view), old_path(path), to(name);
    System* system = find_system(model, parent);
    Block* block = system ? system->find_block(old) : nullptr;
    if (!block) throw std::invalid_argument("rename: no block '" + old_path + "' in this document");
    if (!is_name(to)) throw std::invalid_argument("rename: '" + to + "' is no name for a block");
    if (to == old) return;
    if (system->find_block(to) || system->find_input(to) || system->find_output(to))
        throw std::invalid_argument("rename: '" + old_path + "' cannot be '" + to + "', which is taken");

    block->name = to;
    for (Connection& connection : system->connections) {
        if (connection.from.block == old) connection.from.block = to;
        for (Endpoint& end : connection.to)
            if (end.block == old) end.block = to;
    }
    const std::string new_path = parent.empty() ? to : std::string(parent) + "." + to;
    auto follow = [&](std::vector<Signal>& signals) {
        for (Signal& signal : signals)
            if (signal.path == old_path || signal.path.starts_with(old_path + "."))
                signal.path = new_path + signal.path.substr(old_path.size());
    };
    follow(model.record);
    for (Panel& panel : model.plots) follow(panel.signals);
}

} // namespace bf::model
