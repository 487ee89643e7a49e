// Operations that move blocks between subsystems and files.
#include "editor.hpp"
#include "identifiers.hpp"
#include "moved.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

namespace bf::model {

using namespace operations;

namespace {

/// Moves files of references from the folder of one model file to that of another: `change` gives the new
/// path.
void change_files(System& system, const std::function<std::string(const std::string&)>& change) {
    for (Block& block : system.blocks) {
        if (block.reference) block.reference->file = change(block.reference->file);
        if (block.system) change_files(*block.system, change);
    }
}

/// What overrides a declared variable, of a struct field by field; limits, unit and doc stay those of the
/// declaration.
void override_variable(Variable& declared, const Variable& with) {
    declared.value = with.value;
    if (with.fields.empty()) declared.fields.clear();
    for (const Variable& field : with.fields)
        if (const auto known = named(declared.fields, field.name); known != declared.fields.end())
            override_variable(*known, field);
        else
            declared.fields.push_back(field);
}

} // namespace

void Editor::operator()(const Group& group) {
    System& outer = system_at(group.system);
    std::set<std::string> names;
    std::size_t first = outer.blocks.size();
    for (const std::string& name : group.blocks) {
        const Block& block = block_at(joined(group.system, name));
        if (!names.insert(name).second)
            refuse(block.where, group.system, "'" + name + "' is named twice", "");
        first = std::min(first, static_cast<std::size_t>(&block - outer.blocks.data()));
    }
    if (names.empty()) refuse({}, group.system, "there are no blocks to group", "name some");
    if (!names.contains(group.name)) require_free(outer, group.system, group.name, "block");

    Block made{.name = group.name, .system = std::make_unique<System>()};
    System& inner = *made.system;
    std::vector<Block> rest;
    for (Block& block : outer.blocks)
        (names.contains(block.name) ? inner.blocks : rest).push_back(std::move(block));
    outer.blocks = std::move(rest);
    std::set<std::string> moved = names; // of which paths follow
    for (const NamedSignal& signal : outer.signals)
        if (names.contains(signal.of.block)) {
            inner.signals.push_back(signal);
            moved.insert(signal.name);
        }
    std::erase_if(outer.signals, [&](const NamedSignal& s) { return names.contains(s.of.block); });

    // A port for each source, whose wires cross the border.
    const auto new_port = [&](std::vector<Port>& ports, const std::string& wish) {
        std::string name = wish;
        for (int number = 2; inner.is_taken(name); ++number) name = wish + std::to_string(number);
        ports.push_back({.name = name});
        return Endpoint{.block = {}, .port = name};
    };
    std::vector<Connection> outside;
    for (Connection& connection : outer.connections) {
        const bool from_inside = names.contains(connection.from.block);
        std::vector<Endpoint> inside_ends, outside_ends;
        for (Endpoint& end : connection.to)
            (names.contains(end.block) ? inside_ends : outside_ends).push_back(std::move(end));
        const auto& source = connection.from;
        if (from_inside) {
            Connection kept = connection;
            kept.to = std::move(inside_ends);
            if (!outside_ends.empty()) {
                const Endpoint port = new_port(inner.outputs, source.port.empty() ? "y" : source.port);
                kept.to.push_back(port);
                outside.push_back(
                    {.from = {.block = group.name, .port = port.port}, .to = std::move(outside_ends)});
            }
            inner.connections.push_back(std::move(kept));
        } else if (!inside_ends.empty()) {
            const std::string wish = inside_ends[0].port.empty() ? "u" : inside_ends[0].port;
            const Endpoint port = new_port(inner.inputs, wish);
            inner.connections.push_back({.from = port, .to = std::move(inside_ends)});
            connection.to = std::move(outside_ends);
            connection.to.push_back({.block = group.name, .port = port.port});
            outside.push_back(std::move(connection));
        } else {
            connection.to = std::move(outside_ends);
            outside.push_back(std::move(connection));
        }
    }
    outer.connections = std::move(outside);
    const std::size_t place = std::min(first, outer.blocks.size());
    outer.blocks.insert(outer.blocks.begin() + static_cast<std::ptrdiff_t>(place), std::move(made));

    const std::string path = joined(group.system, group.name);
    std::optional<Point> at;
    for (const Placement& drawn : model_.layout.blocks)
        for (const std::string& name : names)
            if (!at && drawn.path == joined(group.system, name)) at = drawn.at;
    follow([&](const std::string& old) -> std::vector<std::string> {
        const auto rest_of = rest_under(old, group.system);
        if (!group.system.empty() && (!rest_of || rest_of->empty())) return {old};
        const std::string below = group.system.empty() ? old : rest_of->substr(1);
        const std::string name = below.substr(0, below.find('.'));
        return {moved.contains(name) ? joined(path, below) : old};
    });
    if (at) model_.layout.blocks.push_back({.path = path, .at = *at});
}

void Editor::operator()(const Dissolve& dissolve) {
    const auto [parent, name] = split_last(dissolve.path);
    block_at(dissolve.path); // the model itself is none
    System& inner_place = system_at(dissolve.path);
    System& outer = system_at(parent);
    const std::size_t place = static_cast<std::size_t>(outer.find_block(name) - outer.blocks.data());
    const Block& old = outer.blocks[place];
    const auto keep = [&](const std::string& what, const std::string& remedy) {
        refuse(old.where, dissolve.path, "the subsystem " + what + ", which would be lost", remedy);
    };
    if (inner_place.execution != Execution::plain || old.period || old.offset || inner_place.reset)
        keep("decides when its blocks run",
             "make it virtual first: set `execution`, `period`, `offset`, `reset`");
    if (old.when) keep("is a variant", "remove its `when` first");
    if (!inner_place.variables.empty() || !inner_place.enumerations.empty())
        keep("has variables", "declare them outside first");
    for (const auto* ports : {&inner_place.inputs, &inner_place.outputs})
        for (const Port& port : *ports)
            if (port.shape || !port.type.empty() || port.initial || port.when_disabled != WhenDisabled::held)
                refuse(port.where, dissolve.path,
                       "the port '" + port.name + "' declares a shape or type, which would be lost",
                       "clear it first");

    System inner = std::move(inner_place);
    outer.blocks.erase(outer.blocks.begin() + static_cast<std::ptrdiff_t>(place));

    std::map<std::string, std::string> new_names, new_signals;
    const auto choose = [&, &name = name](const std::string& old_name, auto& chosen) {
        const auto taken = [&](const std::string& wish) {
            const auto is_wish = [&](const auto& names) { return names.second == wish; };
            return outer.is_taken(wish) ||
                   (wish != old_name && (inner.find_block(wish) || inner.find_signal(wish))) ||
                   std::ranges::any_of(new_names, is_wish) || std::ranges::any_of(new_signals, is_wish);
        };
        std::string wish = taken(old_name) ? name + "_" + old_name : old_name;
        while (taken(wish)) wish += "_";
        chosen[old_name] = wish;
    };
    for (const Block& block : inner.blocks) choose(block.name, new_names);
    for (const NamedSignal& signal : inner.signals) choose(signal.name, new_signals);
    for (Connection& connection : inner.connections) {
        const auto rename = [&](Endpoint& end) {
            if (!end.block.empty()) end.block = new_names.at(end.block);
        };
        rename(connection.from);
        for (Endpoint& end : connection.to) rename(end);
    }
    for (NamedSignal& signal : inner.signals)
        if (!signal.of.block.empty()) signal.of.block = new_names.at(signal.of.block);
    for (std::size_t i = 0; i < inner.blocks.size(); ++i) {
        inner.blocks[i].name = new_names[inner.blocks[i].name];
        outer.blocks.insert(outer.blocks.begin() + static_cast<std::ptrdiff_t>(place + i), inner.blocks[i]);
    }

    // A wire through a port is joined: its source outside (inside) and its destinations on the other side.
    const auto port_of = [&, &name = name](const Endpoint& end,
                                           const std::vector<Port>& ports) -> std::optional<std::string> {
        if (end.block != name) return {};
        return end.port.empty() && ports.size() == 1 ? ports[0].name : end.port;
    };
    const auto source_of_output = [&](const std::string& port) -> const Endpoint* {
        for (const Connection& connection : inner.connections)
            for (const Endpoint& end : connection.to)
                if (end.block.empty() && end.port == port) return &connection.from;
        return nullptr;
    };
    const std::vector<Connection> old_wires = std::move(outer.connections);
    outer.connections.clear();
    // What feeds an end outside, through ports that lead straight through; nothing if that is a ring.
    const std::function<std::optional<Endpoint>(Endpoint, int)> source =
        [&](Endpoint from, int hops) -> std::optional<Endpoint> {
        const auto output = port_of(from, inner.outputs);
        if (!output) return from;
        const Endpoint* inside = source_of_output(*output);
        if (!inside || hops == 0) return {};
        if (!inside->block.empty()) return Endpoint{inside->block, inside->port};
        for (const Connection& wire : old_wires)
            for (const Endpoint& end : wire.to)
                if (port_of(end, inner.inputs) == inside->port) return source(wire.from, hops - 1);
        return {};
    };
    const int most_hops = static_cast<int>(inner.inputs.size()) + 1;
    for (const Connection& wire : old_wires) {
        const auto from = source(wire.from, most_hops);
        if (!from) continue;
        const bool is_same = from->text() == wire.from.text();
        for (const Endpoint& end : wire.to) {
            const auto input = port_of(end, inner.inputs);
            std::vector<Endpoint> ends;
            if (!input) ends.push_back(end);
            for (const Connection& inside : inner.connections)
                if (input && inside.from.block.empty() && inside.from.port == *input)
                    for (const Endpoint& to : inside.to)
                        if (!to.block.empty()) ends.push_back(to);
            for (Endpoint& to : ends) {
                const std::size_t before = outer.connections.size();
                add_wire(outer, *from, std::move(to));
                if (is_same && outer.connections.size() > before) {
                    outer.connections.back().from = wire.from;
                    outer.connections.back().comments = wire.comments;
                    outer.connections.back().where = wire.where;
                }
            }
        }
    }
    for (const Connection& wire : inner.connections) {
        if (wire.from.block.empty()) continue;
        for (const Endpoint& to : wire.to) {
            if (to.block.empty()) continue;
            const std::size_t before = outer.connections.size();
            add_wire(outer, wire.from, to);
            if (outer.connections.size() > before) {
                outer.connections.back().comments = wire.comments;
                outer.connections.back().where = wire.where;
            }
        }
    }

    // Names of signals at a port are those of what drives it, and gone where nothing does.
    std::erase_if(outer.signals, [&](NamedSignal& signal) {
        const auto from = source(signal.of, most_hops);
        if (from) signal.of = *from;
        return !from;
    });
    for (NamedSignal signal : inner.signals) {
        signal.name = new_signals.at(signal.name);
        std::optional<Endpoint> from = signal.of;
        if (signal.of.block.empty()) {
            from.reset();
            for (const Connection& wire : old_wires)
                for (const Endpoint& end : wire.to)
                    if (port_of(end, inner.inputs) == signal.of.port) from = source(wire.from, most_hops);
        }
        if (!from) continue;
        signal.of = *from;
        outer.signals.push_back(std::move(signal));
    }

    // What was drawn for the subsystem itself and its ports is drawn no more.
    const auto is_border = [&](const std::string& path) {
        const auto rest = rest_under(path, dissolve.path);
        const std::string port = rest && !rest->empty() ? rest->substr(1) : "";
        return rest && (rest->empty() || inner.find_input(port) || inner.find_output(port));
    };
    std::erase_if(model_.layout.blocks, [&](const Placement& drawn) { return is_border(drawn.path); });
    std::erase_if(model_.layout.wires, [&](const Bends& bends) { return is_border(bends.path); });
    for (Note& note : model_.layout.notes)
        if (note.system == dissolve.path) note.system = parent;

    const auto output_path = [&, &name = name,
                              &parent = parent](const std::string& port) -> std::vector<std::string> {
        const auto from = source({.block = name, .port = port}, most_hops);
        if (!from) return {};
        return {joined(parent, from->text())};
    };
    follow([&, &parent = parent](const std::string& path) -> std::vector<std::string> {
        const auto rest = rest_under(path, dissolve.path);
        if (!rest) return {path};
        if (rest->empty())
            return inner.outputs.size() == 1 ? output_path(inner.outputs[0].name)
                                             : std::vector<std::string>();
        const std::string below = rest->substr(1), head = below.substr(0, below.find('.'));
        if (const auto block = new_names.find(head); block != new_names.end())
            return {joined(parent, block->second + below.substr(head.size()))};
        if (const auto signal = new_signals.find(head);
            signal != new_signals.end() && outer.find_signal(signal->second))
            return {joined(parent, signal->second)};
        if (inner.find_output(head)) {
            std::vector<std::string> paths = output_path(head);
            for (std::string& each : paths) each += below.substr(head.size()); // an element of a bus
            return paths;
        }
        std::vector<std::string> all;
        if (below == "*")
            for (const auto& [inside, outside] : new_names) all.push_back(joined(parent, outside + ".*"));
        return all;
    });
}

void Editor::operator()(const Inline& inlined) {
    Block& block = block_at(inlined.path);
    if (!block.reference)
        refuse(block.where, inlined.path, "the block is in this file already", "name a block with `file`");
    const Reference reference = *block.reference;
    if (!reference.model)
        refuse(reference.where, inlined.path, "'" + reference.file + "' has not been read", "check the path");
    const Model& content = *reference.model;
    System system = content.root;
    for (const Variable& with : reference.with)
        for (std::size_t i = 0; i < system.variables.size(); ++i) {
            if (system.variables[i].name != with.name) continue;
            Variable copy = with;
            for_each_expression(copy, [&](Expression& expression) {
                for (const std::string& name : used_names(expression)) {
                    const bool is_hidden =
                        std::ranges::any_of(system.enumerations,
                                            [&](const Variable& v) { return v.name == name; }) ||
                        std::any_of(system.variables.begin(),
                                    system.variables.begin() + static_cast<std::ptrdiff_t>(i),
                                    [&](const Variable& v) { return v.name == name; });
                    if (is_hidden)
                        refuse(with.where, inlined.path,
                               "'" + with.name + "' is overridden with '" + expression.text + "', and '" +
                                   name + "' means something else in '" + reference.file + "'",
                               "rename one of the two variables");
                }
            });
            override_variable(system.variables[i], with);
        }
    const std::filesystem::path folder = std::filesystem::path(reference.file).parent_path();
    change_files(system, [&](const std::string& file) {
        return folder.empty() || std::filesystem::path(file).is_absolute()
                   ? file
                   : (folder / file).lexically_normal().string();
    });
    for (const Plugin& plugin : content.plugins)
        if (std::ranges::none_of(model_.plugins, [&](const Plugin& p) { return p.name == plugin.name; }))
            model_.plugins.push_back(plugin);
    if (block.doc.empty()) block.doc = content.doc;
    block.system = std::make_unique<System>(std::move(system));
    block.reference.reset();
    for (Placement drawn : content.layout.blocks) {
        drawn.path = joined(inlined.path, drawn.path);
        model_.layout.blocks.push_back(std::move(drawn));
    }
    for (Bends bends : content.layout.wires) {
        bends.path = joined(inlined.path, bends.path);
        if (std::ranges::find(model_.layout.wires, bends.path, &Bends::path) == model_.layout.wires.end())
            model_.layout.wires.push_back(std::move(bends));
    }
    for (Note note : content.layout.notes) {
        note.system = joined(inlined.path, note.system);
        if (note.system.ends_with('.')) note.system.pop_back();
        for (const std::string name = note.name; std::ranges::any_of(
                 model_.layout.notes, [&](const Note& known) { return known.name == note.name; });)
            note.name += "_";
        model_.layout.notes.push_back(std::move(note));
    }
}

void Editor::operator()(const Extract& extract) {
    Block& block = block_at(extract.path);
    System system = system_at(extract.path);
    take_marks_away(system);
    if (extract.file.empty())
        refuse(block.where, extract.path, "there is no file to extract to", "give `file`");
    const std::filesystem::path folder = std::filesystem::path(extract.file).parent_path();
    change_files(system, [&](const std::string& file) {
        return folder.empty() || std::filesystem::path(file).is_absolute()
                   ? file
                   : std::filesystem::path(file).lexically_relative(folder).string();
    });
    auto made = std::make_shared<Model>(Model{.name = block.name, .root = std::move(system)});
    made->plugins = model_.plugins;
    const auto move_under = [&](auto& from, auto& to, auto member) {
        std::erase_if(from, [&](auto& item) {
            const auto rest = rest_under(item.*member, extract.path);
            const bool is_note = std::is_same_v<std::remove_cvref_t<decltype(item)>, Note>;
            if (!rest || (rest->empty() && !is_note)) return false;
            to.push_back(item);
            to.back().*member = rest->empty() ? "" : rest->substr(1);
            return true;
        });
    };
    move_under(model_.layout.blocks, made->layout.blocks, &Placement::path);
    // A wire to the block itself has a path under it too, but leads to one of its inputs.
    std::vector<Bends> inner_wires;
    move_under(model_.layout.wires, inner_wires, &Bends::path);
    for (Bends& bends : inner_wires) {
        const bool is_outside = made->root.find_input(bends.path) != nullptr;
        if (is_outside) bends.path = joined(extract.path, bends.path);
        (is_outside ? model_.layout.wires : made->layout.wires).push_back(std::move(bends));
    }
    move_under(model_.layout.notes, made->layout.notes, &Note::system);
    block.system = {};
    block.reference = Reference{.file = extract.file, .model = std::move(made)};
}

} // namespace bf::model
