#include "bf/model/operation.hpp"

#include "bf/model/check.hpp"
#include "bf/model/suggest.hpp"
#include "editor.hpp"
#include "identifiers.hpp"
#include "json.hpp"
#include "moved.hpp"

#include <algorithm>
#include <unordered_set>

namespace bf::model {

using namespace operations;

namespace {

template <typename Item>
void insert(std::vector<Item>& items, Item item, const std::optional<std::size_t>& index) {
    const std::size_t at = std::min(index.value_or(items.size()), items.size());
    items.insert(items.begin() + static_cast<std::ptrdiff_t>(at), std::move(item));
}

/// Moves the item at `from` to place `to`, or to the end.
template <typename Items> void reorder(Items& items, std::size_t from, std::size_t to) {
    const auto begin = items.begin(), item = begin + static_cast<std::ptrdiff_t>(from);
    to = std::min(to, items.size() - 1);
    if (from < to)
        std::rotate(item, item + 1, begin + static_cast<std::ptrdiff_t>(to) + 1);
    else
        std::rotate(begin + static_cast<std::ptrdiff_t>(to), item, item + 1);
}

/// Renames the ends that `is_it` knows.
template <typename IsIt, typename Change> void change_ends(System& system, IsIt is_it, Change change) {
    for (NamedSignal& signal : system.signals)
        if (is_it(signal.of, true)) change(signal.of);
    for (Connection& connection : system.connections) {
        if (is_it(connection.from, true)) change(connection.from);
        for (Endpoint& end : connection.to)
            if (is_it(end, false)) change(end);
    }
}

/// Gives the names of signals that are gone with them.
template <typename IsIt> std::vector<std::string> remove_ends(System& system, IsIt is_it) {
    std::vector<std::string> gone;
    std::erase_if(system.signals, [&](const NamedSignal& signal) {
        if (is_it(signal.of, true)) gone.push_back(signal.name);
        return is_it(signal.of, true);
    });
    for (Connection& connection : system.connections)
        std::erase_if(connection.to, [&](const Endpoint& end) { return is_it(end, false); });
    std::erase_if(system.connections, [&](const Connection& connection) {
        return connection.to.empty() || is_it(connection.from, true);
    });
    return gone;
}

/// A type of which set_member gives a member another value.
template <typename Member>
constexpr bool is_simple =
    std::is_same_v<Member, std::optional<Expression>> || std::is_same_v<Member, std::string> ||
    std::is_same_v<Member, bool> || std::is_enum_v<Member> || std::is_same_v<Member, std::optional<Edge>>;

/// Gives the member called `name` the value that `text` writes; false if there is no such member of a simple
/// type.
template <typename T>
bool set_member(T& target, const std::string& name, const std::optional<std::string>& text) {
    bool found = false;
    const T usual{};
    for_each_field<T>([&](const auto& field) {
        using Member = std::remove_cvref_t<decltype(target.*field.member)>;
        if (field.name != name || field.spelling || (name == "name" && !std::is_same_v<T, Model>)) return;
        Member& member = target.*field.member;
        JsonContext context;
        if constexpr (is_simple<Member>) {
            found = true;
            if (!text)
                member = usual.*field.member;
            else if constexpr (std::is_same_v<Member, std::string>)
                member = without_last_breaks(*text);
            else if constexpr (std::is_same_v<Member, bool>)
                value_from_json(*text == "true" || *text == "false" ? Json(*text == "true") : Json(*text),
                                member, context, name);
            else if constexpr (std::is_same_v<Member, std::optional<Expression>>)
                member = Expression{.text = *text, .where = member ? member->where : Location{}};
            else
                value_from_json(Json(*text), member, context, name, field.words);
        }
    });
    return found;
}

/// The members that set_member knows, as it would write them again.
template <typename T> void add_properties(const T& source, std::vector<Property>& to) {
    static const T usual{};
    for_each_field<T>([&](const auto& field) {
        using Member = std::remove_cvref_t<decltype(source.*field.member)>;
        if constexpr (is_simple<Member>) {
            if (field.spelling || (std::string_view(field.name) == "name" && !std::is_same_v<T, Model>))
                return;
            const Member& member = source.*field.member;
            Property property{.name = field.name};
            if (field.words) property.choices = *field.words;
            if constexpr (std::is_same_v<Member, bool>) property.choices = {"false", "true"};
            if (!are_equal(member, usual.*field.member, false)) {
                JsonContext context;
                if constexpr (std::is_same_v<Member, std::optional<Expression>>)
                    property.value = member->text;
                else if constexpr (std::is_same_v<Member, bool>)
                    property.value = member ? "true" : "false";
                else
                    property.value = value_to_json(member, context, field.words).template get<std::string>();
            }
            to.push_back(std::move(property));
        }
    });
}

/// These, and what else the document says there.
std::vector<std::string> names_to_set(const Model& model, const std::string& path,
                                      std::vector<std::string> names) {
    for (const auto& property : properties(model, path)) names.push_back(property.name);
    return names;
}

/// Fills in what referenced files hold, where a new reference does not say.
void read_references(System& system, const ReadReference& read) {
    for (Block& block : system.blocks) {
        if (block.reference && !block.reference->model) block.reference->model = read(block.reference->file);
        if (block.system) read_references(*block.system, read);
    }
}

/// What is wrong now and was not before.
void require_no_worse(const Model& before, const Model& after) {
    std::vector<Diagnostic> wrong = check(after);
    if (wrong.empty()) return;
    std::unordered_set<std::string> known;
    for (const Diagnostic& diagnostic : check(before)) known.insert(diagnostic.text());
    std::erase_if(wrong, [&](const Diagnostic& d) { return known.contains(d.text()); });
    if (!wrong.empty()) throw Errors(std::move(wrong));
}

} // namespace

void Editor::refuse(const Location& where, const std::string& path, std::string message,
                    std::string remedy) const {
    throw Errors({{where ? where : model_.where, path, std::move(message), std::move(remedy)}});
}

System& Editor::system_at(std::string_view path) {
    if (path.empty()) return model_.root;
    Block& block = block_at(path);
    if (block.reference)
        refuse(block.where, std::string(path), "the block stands in the file '" + block.reference->file + "'",
               "edit that file, or inline it");
    if (!block.system)
        refuse(block.where, std::string(path), "the block is no subsystem", "group blocks to have one");
    return *block.system;
}

Editor::Own Editor::find_own(std::string_view path) {
    const auto [parent, name] = split_last(path);
    System& system = system_at(parent);
    Block* block = system.find_block(name);
    const bool is_output = !block && system.find_output(name);
    if (!block && !is_output && !system.find_input(name)) {
        std::vector<std::string> known = names_of(system.blocks);
        for (const auto* ports : {&system.inputs, &system.outputs})
            for (std::string& port : names_of(*ports)) known.push_back(std::move(port));
        const Block* around = parent.empty() ? nullptr : find(std::as_const(model_), parent);
        refuse(around ? around->where : Location(), parent, "there is no block or port '" + name + "'",
               name_remedy(name, known));
    }
    return {system, parent, name, block, is_output};
}

std::pair<System*, NamedSignal*> Editor::named_signal(const std::string& path) {
    const auto [parent, name] = split_last(path);
    System& system = system_at(parent);
    const auto found = named(system.signals, name);
    return {&system, found == system.signals.end() ? nullptr : &*found};
}

Block& Editor::block_at(std::string_view path) {
    const Own own = find_own(path);
    if (!own.block) refuse({}, std::string(path), "this is a port", "name a block");
    return *own.block;
}

void Editor::require_free(const System& system, const std::string& path, const std::string& name,
                          const char* kind) const {
    const Block* block = system.find_block(name);
    const Port* port = system.find_input(name);
    if (!port) port = system.find_output(name);
    if (!is_name(name)) refuse({}, path, "'" + name + "' is no name for a " + kind, name_rule);
    if (system.is_taken(name))
        refuse(block  ? block->where
               : port ? port->where
                      : system.find_signal(name)->where,
               path, "the name '" + name + "' is taken", "use another");
}

Endpoint Editor::endpoint(const System& system, const std::string& text) {
    const std::size_t dot = text.find('.');
    if (dot != text.npos) return {.block = text.substr(0, dot), .port = text.substr(dot + 1)};
    if (system.find_block(text)) return {.block = text};
    return {.block = {}, .port = text};
}

void Editor::add_wire(System& system, const Endpoint& from, Endpoint to) {
    for (Connection& connection : system.connections)
        if (connection.from.text() == from.text()) return connection.to.push_back(std::move(to));
    system.connections.push_back({.from = {from.block, from.port}, .to = {std::move(to)}});
}

void Editor::follow(const std::function<std::vector<std::string>(const std::string&)>& change) {
    const auto all = [&](auto& items, auto member) {
        std::remove_reference_t<decltype(items)> changed;
        for (auto& item : items) {
            const std::vector<std::string> paths = change(item.*member);
            for (const std::string& path : paths) {
                const bool is_known = std::ranges::any_of(
                    changed, [&](const auto& other) { return paths.size() > 1 && other.*member == path; });
                if (is_known) continue;
                changed.push_back(item);
                changed.back().*member = path;
            }
        }
        items = std::move(changed);
    };
    all(model_.record, &Signal::path);
    for (Panel& panel : model_.plots) {
        const bool was_empty = panel.signals.empty();
        all(panel.signals, &Signal::path);
        if (panel.signals.empty() && !was_empty) panel.title.clear();
    }
    std::erase_if(model_.plots, [](const Panel& panel) { return panel.title.empty(); });
    for (Display& display : model_.layout.displays) all(display.signals, &Signal::path);
    all(model_.layout.blocks, &Placement::path);
    all(model_.layout.wires, &Bends::path);
    std::erase_if(model_.layout.notes, [&](Note& note) {
        if (note.system.empty()) return false;
        const std::vector<std::string> paths = change(note.system);
        if (!paths.empty()) note.system = paths[0];
        return paths.empty();
    });
}

void Editor::move_paths(const std::string& from, const std::string& to) {
    follow([&](const std::string& path) -> std::vector<std::string> {
        const auto rest = rest_under(path, from);
        return {rest ? to + *rest : path};
    });
}

void Editor::require_setting(const std::string& name, const Location& where, const std::string& path,
                             const std::string& remedy) const {
    if (is_of_every_block(name) || name == "block" || name == "blocks")
        refuse(where, path, "'" + name + "' is no setting", remedy);
}

void Editor::operator()(const Add& add) {
    if (is_chart(add.system)) return add_state(add);
    System& system = system_at(add.system);
    require_free(system, add.system, add.block.name, "block");
    const auto require_settings = [this](const auto& self, const Block& block,
                                         const std::string& path) -> void {
        for (const auto& s : block.settings)
            require_setting(s.name, block.where, path, "give it beside the settings");
        if (!block.system) return;
        for (const Block& inner : block.system->blocks) self(self, inner, joined(path, inner.name));
    };
    require_settings(require_settings, add.block, joined(add.system, add.block.name));
    insert(system.blocks, add.block, add.index);
    if (add.at) (*this)(Move{joined(add.system, add.block.name), *add.at});
}

void Editor::operator()(const Remove& remove) {
    if (const auto [machine, name] = split_chart(model_, remove.path); !machine.empty())
        return remove_state(machine, name);
    std::vector<std::string> gone{remove.path};
    const auto follow_removed = [&] {
        follow([&](const std::string& path) -> std::vector<std::string> {
            if (std::ranges::any_of(gone, [&](const auto& one) { return rest_under(path, one).has_value(); }))
                return {};
            return {path};
        });
    };
    if (const auto [system, signal] = named_signal(remove.path); signal) {
        system->signals.erase(system->signals.begin() + (signal - system->signals.data()));
        return follow_removed();
    }
    const auto remove_from = [&](System& system, const std::string& path, const auto& is_it) {
        for (const std::string& name : remove_ends(system, is_it)) gone.push_back(joined(path, name));
    };
    const Own own = find_own(remove.path);
    if (own.block) {
        remove_from(own.system, own.parent, [&](const Endpoint& end, bool) { return end.block == own.name; });
        std::erase_if(own.system.blocks, [&](const Block& block) { return block.name == own.name; });
    } else {
        // Inside, an input is a source; outside, it is a destination.
        remove_from(own.system, own.parent, [&](const Endpoint& end, bool is_source) {
            return end.block.empty() && end.port == own.name && is_source != own.is_output;
        });
        auto& ports = own.is_output ? own.system.outputs : own.system.inputs;
        const bool is_only = ports.size() == 1;
        std::erase_if(ports, [&](const Port& port) { return port.name == own.name; });
        rename_side(own.parent, own.name, "");
        if (!own.parent.empty()) {
            const auto [grandparent, parent] = split_last(own.parent);
            remove_from(system_at(grandparent), grandparent,
                        [&, &parent = parent](const Endpoint& end, bool is_source) {
                            return end.block == parent && is_source == own.is_output &&
                                   (end.port == own.name || (end.port.empty() && is_only));
                        });
            if (own.is_output && is_only) // the path of the subsystem meant its only output
                std::erase_if(model_.record, [&](const Signal& signal) { return signal.path == own.parent; });
        }
    }
    follow_removed();
}

void Editor::operator()(const Rename& rename) {
    if (const auto [machine, name] = split_chart(model_, rename.path); !machine.empty())
        return rename_state(machine, name, rename.name);
    if (const auto [system, signal] = named_signal(rename.path); signal) {
        if (rename.name == signal->name) return;
        const std::string parent = split_last(rename.path).first;
        require_free(*system, parent, rename.name, "signal");
        signal->name = rename.name;
        return move_paths(rename.path, joined(parent, rename.name));
    }
    const Own own = find_own(rename.path);
    if (rename.name == own.name) return;
    require_free(own.system, own.parent, rename.name, own.block ? "block" : "port");
    if (own.block) {
        own.block->name = rename.name;
        change_ends(
            own.system, [&](const Endpoint& end, bool) { return end.block == own.name; },
            [&](Endpoint& end) { end.block = rename.name; });
    } else {
        named(own.is_output ? own.system.outputs : own.system.inputs, own.name)->name = rename.name;
        change_ends(
            own.system,
            [&](const Endpoint& end, bool is_source) {
                return end.block.empty() && end.port == own.name && is_source != own.is_output;
            },
            [&](Endpoint& end) { end.port = rename.name; });
        rename_side(own.parent, own.name, rename.name);
        if (!own.parent.empty()) {
            const auto [grandparent, parent] = split_last(own.parent);
            change_ends(
                system_at(grandparent),
                [&, &parent = parent](const Endpoint& end, bool is_source) {
                    return end.block == parent && end.port == own.name && is_source == own.is_output;
                },
                [&](Endpoint& end) { end.port = rename.name; });
        }
    }
    move_paths(rename.path, joined(own.parent, rename.name));
}

void Editor::operator()(const Reorder& change) {
    const Own own = find_own(change.path);
    if (own.block) {
        auto& blocks = own.system.blocks;
        return reorder(blocks, static_cast<std::size_t>(own.block - blocks.data()), change.index);
    }
    auto& ports = own.is_output ? own.system.outputs : own.system.inputs;
    reorder(ports, static_cast<std::size_t>(named(ports, own.name) - ports.begin()), change.index);
}

void Editor::operator()(const Connect& connect) {
    if (is_chart(connect.system)) return connect_states(connect);
    System& system = system_at(connect.system);
    add_wire(system, endpoint(system, connect.from), endpoint(system, connect.to));
}

void Editor::operator()(const Disconnect& disconnect) {
    if (is_chart(disconnect.system)) return disconnect_states(disconnect);
    System& system = system_at(disconnect.system);
    bool found = false, is_fed = false;
    std::vector<std::string> known;
    for (Connection& connection : system.connections) {
        for (const Endpoint& end : connection.to) known.push_back(end.text());
        const bool is_it = disconnect.from.empty() || connection.from.text() == disconnect.from;
        const auto same = [&](const Endpoint& end) { return end.text() == disconnect.to; };
        if (is_it)
            found = std::erase_if(connection.to, same) > 0 || found;
        else
            is_fed = is_fed || std::ranges::any_of(connection.to, same);
    }
    if (!found)
        refuse({}, disconnect.system,
               "'" + disconnect.to + "' is not connected" +
                   (disconnect.from.empty() ? "" : " to '" + disconnect.from + "'"),
               name_remedy(disconnect.to, known));
    std::erase_if(system.connections, [](const Connection& connection) { return connection.to.empty(); });
    const std::string path = joined(disconnect.system, disconnect.to);
    if (!is_fed) std::erase_if(model_.layout.wires, [&](const Bends& bends) { return bends.path == path; });
}

void Editor::operator()(const NameSignal& name) {
    System& system = system_at(name.system);
    const Endpoint of = endpoint(system, name.from);
    const auto known = named(system.signals, name.name);
    if (known != system.signals.end()) {
        known->of = of;
        return;
    }
    require_free(system, name.system, name.name, "signal");
    system.signals.push_back({name.name, of});
}

void Editor::set_parameter(const Set& set, const Location& where, const System* declaring,
                           std::vector<Variable>& values, bool is_own) {
    const auto& known = declaring ? declaring->variables : values;
    const Variable* const declared = find_variable(known, set.name);
    // What nobody has read declares whatever is given to it.
    if (declaring && (!declared || !declared->fields.empty()))
        refuse(where, set.path, "there is no '" + set.name + "' to set here",
               name_remedy(set.name, names_to_set(model_, set.path, names_of(known))));
    if (!set.value && is_own)
        refuse(where, set.path, "the variable '" + set.name + "' has no value then", "remove the variable");
    if (!set.value) return remove_variable(values, set.name);
    const auto [list, name] = place_of(values, set.name, set.path, true);
    const auto found = named(*list, name);
    if (found != list->end())
        found->value = Expression{.text = *set.value, .where = found->value.where};
    else
        list->push_back({.name = name, .value = {.text = *set.value}});
}

void Editor::operator()(const Set& set) {
    const auto unknown = [&](const Location& where) {
        refuse(where, set.path, "there is no '" + set.name + "' to set here",
               name_remedy(set.name, names_to_set(model_, set.path, {})));
    };
    if (set.path.empty()) {
        if (!set_member(model_, set.name, set.value) && !set_member(model_.root, set.name, set.value))
            set_parameter(set, {}, &model_.root, model_.root.variables, true);
        return;
    }
    if (const auto [machine, name] = split_chart(model_, set.path); !machine.empty())
        return set_in_chart(machine, name, set);
    const Own own = find_own(set.path);
    if (!own.block) {
        Port& port = *named(own.is_output ? own.system.outputs : own.system.inputs, own.name);
        const bool fits = set.name != (own.is_output ? "each" : "when_disabled") &&
                          (own.is_output || set.name != "initial");
        if (!fits || !set_member(port, set.name, set.value)) unknown(port.where);
        return;
    }
    Block& block = *own.block;
    if (is_of_every_block(set.name)) {
        set_member(block, set.name, set.value);
    } else if (block.is_library_block()) {
        if (set.name == "block" && set.value && !set.value->empty()) {
            block.type = *set.value;
            return;
        }
        require_setting(set.name, block.where, set.path, "replace the block by another");
        const auto found = named(block.settings, set.name);
        if (set.value)
            model::set(block, set.name, *set.value);
        else if (found != block.settings.end())
            block.settings.erase(found);
        else
            refuse(block.where, set.path, "the block has no setting '" + set.name + "'",
                   name_remedy(set.name, names_of(block.settings)));
    } else if (block.reference) {
        if (set.name != "file") {
            set_parameter(set, block.where, block.content(), block.reference->with, false);
            if (block.reference->with.empty())
                std::erase_if(block.keys, [](const Key& key) { return key.name == "with"; });
            return;
        }
        if (!set.value || set.value->empty())
            refuse(block.where, set.path, "the block has no file then", "remove the block");
        *block.reference =
            Reference{.file = *set.value, .with = block.reference->with, .where = block.reference->where};
    } else if (!set_member(*block.system, set.name, set.value)) {
        set_parameter(set, block.where, block.system.get(), block.system->variables, true);
    }
}

void Editor::operator()(const AddPort& add) {
    System& system = system_at(add.system);
    require_free(system, add.system, add.port.name, "port");
    insert(add.is_output ? system.outputs : system.inputs, add.port, add.index);
}

std::pair<std::vector<Variable>*, std::string> Editor::place_of(std::vector<Variable>& variables,
                                                                const std::string& name,
                                                                const std::string& path, bool is_made) const {
    std::vector<Variable>* list = &variables;
    std::string rest = name;
    for (auto dot = rest.find('.'); dot != std::string::npos; dot = rest.find('.')) {
        const std::string outer = rest.substr(0, dot);
        auto structure = named(*list, outer);
        if (structure == list->end() && is_made)
            structure = list->insert(list->end(), Variable{.name = outer});
        else if (structure == list->end() || structure->fields.empty())
            refuse({}, path, "there is no struct '" + outer + "' for '" + name + "'",
                   "use a name without '.', or another one before it");
        list = &structure->fields;
        rest.erase(0, dot + 1);
    }
    return {list, rest};
}

void Editor::remove_variable(std::vector<Variable>& variables, const std::string& name) {
    const auto dot = name.find('.');
    const auto found = named(variables, name.substr(0, dot));
    if (found == variables.end()) return;
    if (dot != name.npos) remove_variable(found->fields, name.substr(dot + 1));
    if (dot == name.npos || found->fields.empty()) variables.erase(found);
}

void Editor::operator()(const SetVariable& set) {
    auto& all = system_at(set.system).variables;
    const auto [variables, name] = place_of(all, set.name, set.system, set.variable.has_value());
    const auto found = named(*variables, name);
    if (!set.variable) {
        if (found == variables->end())
            refuse({}, set.system, "there is no variable '" + set.name + "'",
                   name_remedy(name, names_of(*variables)));
        return remove_variable(all, set.name);
    }
    Variable variable = *set.variable;
    variable.name = name;
    if (found == variables->end()) {
        variables->push_back(std::move(variable));
        return;
    }
    variable.where = found->where;
    variable.comments = found->comments;
    *found = std::move(variable);
}

void Editor::operator()(const RenameVariable& rename) {
    System& system = system_at(rename.system);
    const auto variable = named(system.variables, rename.name);
    const auto enumeration = named(system.enumerations, rename.name);
    if (variable == system.variables.end() && enumeration == system.enumerations.end())
        refuse({}, rename.system, "there is no variable '" + rename.name + "'",
               name_remedy(rename.name, names_of(system.variables)));
    (variable != system.variables.end() ? *variable : *enumeration).name = rename.to;
    const auto in_expression = [&](Expression& expression) {
        if (!used_names(expression).contains(rename.name)) return;
        const auto replaced = [&](const std::string& text) {
            return replace_names(text, [&](std::string_view name) {
                return name == rename.name ? rename.to : std::string(name);
            });
        };
        expression.text = replaced(expression.text);
        expression.spelling = replaced(expression.spelling);
    };
    const std::function<void(System&)> in_system = [&](System& inner) {
        for_each_expression(inner, [&](Expression& expression) {
            if (used_names(expression).contains(rename.to))
                refuse(expression.where, rename.system,
                       "'" + rename.to + "' has a meaning in '" + expression.text + "'", "use another name");
            in_expression(expression);
        });
        for (Block& block : inner.blocks)
            if (block.system && !declares(*block.system, rename.name)) {
                if (declares(*block.system, rename.to))
                    refuse(block.where, rename.system,
                           "'" + block.name + "' declares '" + rename.to + "' itself", "use another name");
                in_system(*block.system);
            }
    };
    in_system(system);
    if (!rename.system.empty()) return;
    for_each_field<Model>([&](const auto& field) {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(model_.*field.member)>,
                                     std::optional<Expression>>)
            if (model_.*field.member) in_expression(*(model_.*field.member));
    });
}

void Editor::operator()(const Patch& patch) { apply_patch(model_, patch); }

void Editor::operator()(const Batch& batch) {
    for (const Operation& operation : batch.operations) std::visit(*this, operation);
}

namespace {

/// Those of a system that act as it is executed, and those that the document gives; `is_block`: it is, or may
/// be, a subsystem of a model, which alone is executed in other ways.
void add_properties_of(const System& system, bool is_block, std::vector<Property>& to) {
    const Execution e = system.execution;
    const bool is_triggered = e == Execution::triggered || e == Execution::enabled_and_triggered;
    const bool is_counted = e == Execution::for_loop || e == Execution::for_each;
    std::vector<Property> all;
    add_properties(system, all);
    std::erase_if(all, [&](const Property& p) {
        const bool acts = p.name == "states"       ? e != Execution::plain && e != Execution::atomic
                          : p.name == "trigger"    ? is_triggered
                          : p.name == "iterations" ? is_counted
                          : p.name == "reset"      ? e != Execution::for_each
                                                   : true;
        return !p.value && !(is_block && acts);
    });
    to.insert(to.end(), all.begin(), all.end());
}

} // namespace

std::vector<Property> properties(const Model& model, const std::string& path) {
    std::vector<Property> all;
    if (path.empty()) {
        add_properties(model, all);
        add_properties_of(model.root, !model.root.inputs.empty() || !model.root.outputs.empty(), all);
        return all;
    }
    if (const auto [machine, name] = split_chart(model, path); !machine.empty())
        return chart_properties(*find(model, machine), name);
    const auto [parent, name] = split_last(path);
    const System* const system = find_system(model, parent);
    const Block* const block = system ? system->find_block(name) : nullptr;
    if (block) {
        add_properties(*block, all);
        std::erase_if(all, [](const Property& p) { return !is_of_every_block(p.name); });
        if (block->reference)
            all.push_back({"file", block->reference->file});
        else if (block->system)
            add_properties_of(*block->system, true, all);
        return all;
    }
    const Port* const output = system ? system->find_output(name) : nullptr;
    const Port* const port = output ? output : system ? system->find_input(name) : nullptr;
    if (!port)
        throw Errors({{{}, path, "there is no block or port of that path", "look at the model's blocks"}});
    add_properties(*port, all);
    std::erase_if(all, [&](const Property& p) {
        return p.name == (output ? "each" : "when_disabled") || (!output && p.name == "initial");
    });
    return all;
}

Patch edit(Model& model, const Operation& operation, const ReadReference& read) {
    Model after = model;
    const std::vector<std::string> paths = mark_blocks(after);
    std::visit(Editor(after), operation);
    std::vector<Moved> moved = moved_blocks(after, paths);
    if (const auto* const patch = std::get_if<Patch>(&operation)) moved = patch->moved;
    if (read) read_references(after.root, read);
    require_no_worse(model, after);
    Patch back = difference(after, model);
    back.moved = reversed(std::move(moved));
    model = std::move(after);
    return back;
}

bool History::edit(Model& model, const Operation& operation, const ReadReference& read) {
    Patch back = model::edit(model, operation, read);
    moved_ = reversed(back.moved);
    if (back.changes.empty() && back.moved.empty()) return false;
    done_.emplace_back(std::move(back));
    undone_.clear();
    return true;
}

void History::replace(Model& model, Model other) {
    done_.emplace_back(std::exchange(model, std::move(other)));
    undone_.clear();
    moved_.reset();
}

bool History::step(Model& model, std::vector<Step>& from, std::vector<Step>& to) {
    if (from.empty()) return false;
    if (auto* const patch = std::get_if<Patch>(&from.back())) {
        // What was there once may be there again, also where files that it refers to have become others
        // since.
        Model after = model;
        Editor editor(after);
        editor(*patch);
        Patch back = difference(after, model);
        back.moved = reversed(patch->moved);
        moved_ = patch->moved;
        to.emplace_back(std::move(back));
        model = std::move(after);
    } else {
        to.emplace_back(std::exchange(model, std::move(std::get<Model>(from.back()))));
        moved_.reset();
    }
    from.pop_back();
    return true;
}

} // namespace bf::model
