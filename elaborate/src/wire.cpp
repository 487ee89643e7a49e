// Connections become sources of inputs; resources are found; signals get their names.
#include "bf/kernels/elementwise.hpp"
#include "stages.hpp"

#include <algorithm>

namespace bf::elaboration {

namespace {

/// Holds an output of a conditional subsystem while its blocks do not run.
class Outlet final : public Block {
  public:
    using Block::Block;
    AnyShape s{this};
    Input<> u{this, "u", {.shape = s, .unit = any_unit}};
    Output<> y{this, "y", {.shape = s, .unit = any_unit}};
    OutputRule rule{this, kernels::Copy{}, y, u};
};

/// A root input: whoever runs the diagram writes its output.
class RootInput final : public Block {
  public:
    explicit RootInput(const Size& declared, Type type) {
        offer(declaration(), y.index(), declared);
        offer(declaration(), y.index(), type);
    }
    Output<> y{this, "y", {.unit = any_unit}};
};

class Wiring {
  public:
    explicit Wiring(Elaboration& elaboration) : e_(elaboration) {}

    void run() {
        const std::size_t blocks = e_.diagram.nodes.size();
        for (auto& scope : e_.scopes)
            for (const auto& connection : scope.system->connections)
                for (const auto& to : connection.to) drive(scope, connection.from, to);
        add_root_inputs();
        for (auto& scope : e_.scopes) add_outlets(scope);
        for (auto& scope : e_.scopes)
            for (const auto& [name, item] : scope.items)
                if (item.node >= 0) connect_inputs(scope, std::string(name), item.node);
        for (auto& scope : e_.scopes) connect_condition(scope);
        for (auto& scope : e_.scopes) name_outputs(scope);
        for (std::size_t i = 0; i < blocks; ++i) bind_resources(static_cast<int>(i));
        check_units();
        for (auto& signal : e_.model.record) named(signal, e_.diagram.record);
        if (e_.model.record_all) e_.diagram.record = e_.diagram.match_signals("*");
        for (const auto& panel : e_.model.plots) {
            e_.diagram.plots.push_back({panel.title, {}});
            for (const auto& signal : panel.signals) named(signal, e_.diagram.plots.back().signals);
        }
    }

  private:
    static std::string key(const std::string& block, const std::string& port) { return block + "." + port; }

    std::string inside(const Scope& scope, const std::string& name) const {
        return scope.path.empty() ? name : scope.path + "." + name;
    }

    static std::vector<std::string> slot_names(const Declaration& d, Role role) {
        std::vector<std::string> names;
        for (const auto& slot : d.slots)
            if (slot.role == role) names.push_back(slot.name);
        return names;
    }
    static std::vector<std::string> port_names(const std::vector<model::Port>& ports) {
        std::vector<std::string> names;
        for (const auto& port : ports) names.push_back(port.name);
        return names;
    }

    static std::string list(const std::vector<std::string>& names) {
        std::string text;
        for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
        return text.empty() ? "none" : text;
    }

    /// The port that an endpoint means: its name, or the only one there is.
    std::optional<std::string> port_of(const Scope& scope, const model::Endpoint& end,
                                       const std::vector<std::string>& names, const char* kind) {
        const std::string path = inside(scope, end.block);
        if (end.port.empty()) {
            if (names.size() == 1) return names.front();
            e_.report.add(end.where, path,
                          "'" + end.text() + "' does not say which " + kind + " is meant: there are " +
                              std::to_string(names.size()),
                          names.empty() ? "" : std::string("write one of ") + list(names) + " after a dot");
            return std::nullopt;
        }
        if (std::find(names.begin(), names.end(), end.port) != names.end()) return end.port;
        e_.report.add(end.where, path,
                      std::string("there is no ") + kind + " '" + end.port + "'" +
                          did_you_mean(end.port, names),
                      std::string(kind) + "s: " + list(names));
        return std::nullopt;
    }

    const Scope::Item* item_of(const Scope& scope, const model::Endpoint& end) {
        const auto found = scope.items.find(end.block);
        if (found != scope.items.end()) return &found->second;
        if (!scope.system->find_block(
                end.block)) { // a block that exists but could not be made was reported before
            std::vector<std::string> names;
            for (const auto& block : scope.system->blocks) names.push_back(block.name);
            e_.report.add(end.where, scope.path,
                          "there is no block '" + end.block + "' here" + did_you_mean(end.block, names));
        }
        return nullptr;
    }

    void drive(Scope& scope, const model::Endpoint& from, const model::Endpoint& to) {
        std::string target;
        if (to.block.empty()) {
            const auto port = port_of(scope, to, port_names(scope.system->outputs), "output");
            if (!port) return;
            target = key("", *port);
        } else {
            const auto* item = item_of(scope, to);
            if (!item) return;
            std::vector<std::string> names;
            if (item->scope) {
                names = port_names(item->scope->system->inputs);
                if (item->scope->system->execution == model::Execution::enabled)
                    names.emplace_back(model::enable_port);
            } else {
                names = slot_names(e_.declaration(item->node), Role::input);
            }
            const auto port = port_of(scope, to, names, "input");
            if (!port) return;
            target = key(to.block, *port);
        }
        const auto [known, is_new] = scope.drivers.try_emplace(target, Scope::Driver{&from, &to});
        if (!is_new)
            e_.report.add(to.where, inside(scope, to.block),
                          "'" + to.text() + "' is driven twice: by '" + known->second.from->text() +
                              "' and by '" + from.text() + "'",
                          "remove one of the connections");
    }

    /// The output that drives a port; node -1 when nothing does.
    Node::End source(Scope& scope, const std::string& target, int depth = 0) {
        const auto found = scope.drivers.find(target);
        if (found == scope.drivers.end()) return {};
        const model::Endpoint& from = *found->second.from;
        if (depth > 1000) {
            e_.report.add(from.where, scope.path,
                          "subsystem ports are connected in a circle without any block");
            return {};
        }
        if (from.block.empty()) {
            const auto port =
                port_of(scope, from, port_names(scope.system->inputs), "input of the subsystem");
            if (!port) return failed();
            if (scope.parent) return source(*scope.parent, key(scope.self->name, *port), depth + 1);
            for (const auto& input : e_.diagram.inputs)
                if (input.path == *port) return input.end;
            return failed();
        }
        const auto* item = item_of(scope, from);
        if (!item) return failed();
        if (item->node >= 0) {
            const auto port =
                port_of(scope, from, slot_names(e_.declaration(item->node), Role::output), "output");
            if (!port) return failed();
            return {item->node, e_.declaration(item->node).find(*port, Role::output)};
        }
        const auto port = port_of(scope, from, port_names(item->scope->system->outputs), "output");
        if (!port) return failed();
        return output_of(*item->scope, *port, depth);
    }

    Node::End output_of(Scope& scope, const std::string& port, int depth = 0) {
        for (const auto& [outlet, node] : scope.copies)
            if (outlet->name == port) return {node, 1};
        return source(scope, key("", port), depth + 1);
    }

    /// Marks a wire whose error is reported already.
    static Node::End failed() { return {-2, -1}; }

    int add_internal(std::unique_ptr<Block> block, std::string path, const char* type, const Scope& scope,
                     int condition) {
        DiagramNode node;
        node.sources.resize(block->declaration().slots.size());
        node.block = std::move(block);
        node.path = std::move(path);
        node.type = type;
        node.condition = condition;
        node.where = scope.self ? scope.self->where : e_.model.where;
        e_.node_periods.push_back(scope.period);
        e_.node_offsets.push_back(scope.offset);
        e_.diagram.nodes.push_back(std::move(node));
        return static_cast<int>(e_.diagram.nodes.size()) - 1;
    }

    void add_root_inputs() {
        Scope& root = e_.root();
        for (const auto& port : root.system->inputs) {
            Size size;
            if (port.shape) {
                if (const auto shape = e_.evaluate(*port.shape, root.variables, port.name)) {
                    const auto dims = shape->matrix();
                    if (dims.size() == 1)
                        size = {static_cast<int>(dims(0)), 1, false};
                    else if (dims.size() == 2)
                        size = {static_cast<int>(dims(0)), static_cast<int>(dims(1)), true};
                    else
                        e_.report.add(port.shape->where, port.name,
                                      "a shape has one or two lengths, not " + shape->describe());
                }
            }
            const auto type = port.type.empty() ? Type::float64 : type_from_name(port.type);
            if (!type)
                e_.report.add(port.where, port.name, "there is no type '" + port.type + "'",
                              "types: double, single, int8, ..., uint32, boolean");
            const int node = add_internal(std::make_unique<RootInput>(size, type.value_or(Type::float64)),
                                          port.name, "Inport", root, 0);
            e_.diagram.inputs.push_back({port.name, {node, 0}});
        }
    }

    void add_outlets(Scope& scope) {
        if (scope.system->execution != model::Execution::enabled || !scope.self) return;
        for (const auto& port : scope.system->outputs) {
            const int node = add_internal(std::make_unique<Outlet>(), inside(scope, port.name), "Outport",
                                          scope, scope.condition);
            scope.copies.emplace_back(&port, node);
            scope.nodes.push_back(node);
            Condition::Outlet outlet{{node, 1}, {}, port.when_disabled == model::WhenDisabled::reset};
            if (port.initial)
                if (const auto value = e_.evaluate(*port.initial, scope.variables, inside(scope, port.name));
                    value && value->is_array())
                    outlet.initial.assign(value->data(), value->data() + value->numel());
            e_.diagram.conditions[static_cast<std::size_t>(scope.condition)].outlets.push_back(
                std::move(outlet));
        }
    }

    void connect_inputs(Scope& scope, const std::string& name, int index) {
        DiagramNode& node = e_.node(index);
        const auto& slots = node.block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role != Role::input) continue;
            const auto from = source(scope, key(name, slots[i].name));
            if (from.node >= 0)
                node.sources[i] = from;
            else if (from.node == -1 && !slots[i].optional)
                e_.report.add(node.where, node.path, "input '" + slots[i].name + "' is not connected",
                              "connect a signal to it");
        }
    }

    void connect_condition(Scope& scope) {
        if (scope.system->execution == model::Execution::enabled && scope.parent) {
            auto& condition = e_.diagram.conditions[static_cast<std::size_t>(scope.condition)];
            condition.enable = source(*scope.parent, key(scope.self->name, std::string(model::enable_port)));
            if (condition.enable.node == -1)
                e_.report.add(scope.self->where, scope.path,
                              "the enabled subsystem's input 'enable' is not connected",
                              "connect a signal to it; the subsystem runs while any element is above 0");
            for (const auto& [port, node] : scope.copies) {
                const auto from = source(scope, key("", port->name));
                if (from.node >= 0)
                    e_.node(node).sources[0] = from;
                else if (from.node == -1)
                    e_.report.add(port->where, inside(scope, port->name),
                                  "the subsystem's output is not connected",
                                  "connect a block's output to it");
            }
        }
        for (int c = scope.condition; c > 0; c = e_.diagram.conditions[static_cast<std::size_t>(c)].parent)
            for (const int node : scope.nodes)
                e_.diagram.conditions[static_cast<std::size_t>(c)].nodes.push_back(node);
    }

    void name_outputs(Scope& scope) {
        for (const auto& port : scope.system->outputs) {
            const auto end = output_of(scope, port.name);
            if (end.node >= 0) {
                e_.diagram.aliases.push_back({inside(scope, port.name), end});
                if (!scope.parent) e_.diagram.outputs.push_back({port.name, end});
            } else if (end.node == -1 && scope.system->execution != model::Execution::enabled) {
                e_.report.add(port.where, inside(scope, port.name), "the subsystem's output is not connected",
                              "connect a block's output to it");
            }
        }
    }

    /// The nearest enclosing subsystem that offers the resource; several at the same level are an error.
    Node::End provider(Scope* scope, int user, const std::string& type, std::string& found_twice) {
        for (; scope; scope = scope->parent) {
            Node::End found;
            for (const int candidate : scope->nodes) {
                if (candidate == user) continue;
                const auto& provisions = e_.declaration(candidate).provisions;
                for (std::size_t p = 0; p < provisions.size(); ++p) {
                    if (provisions[p].type != type) continue;
                    if (found.node >= 0)
                        found_twice = e_.node(found.node).path + " and " + e_.node(candidate).path;
                    else
                        found = {candidate, static_cast<int>(p)};
                }
            }
            if (found.node >= 0) return found;
        }
        return {};
    }

    Scope* scope_of(int node) {
        if (node_scopes_.empty()) {
            node_scopes_.resize(e_.diagram.nodes.size(), nullptr);
            for (auto& scope : e_.scopes)
                for (const int n : scope.nodes) node_scopes_[static_cast<std::size_t>(n)] = &scope;
        }
        return node_scopes_[static_cast<std::size_t>(node)];
    }

    /// Binds what a block requires, and then makes what it provides.
    void bind_resources(int index, int depth = 0) {
        DiagramNode& node = e_.node(index);
        auto& d = node.block->declaration();
        if (depth > 100) {
            e_.report.add(node.where, node.path, "resources need each other in a circle");
            return;
        }
        bool is_complete = true;
        for (std::size_t r = 0; r < d.requirements.size(); ++r) {
            auto& requirement = d.requirements[r];
            if (requirement.is_bound) continue;
            std::string found_twice;
            const auto from = provider(scope_of(index), index, requirement.type, found_twice);
            if (!found_twice.empty())
                e_.report.add(node.where, node.path,
                              "finds more than one " + requirement.type + " around it: " + found_twice,
                              "keep one of them in this subsystem");
            if (from.node < 0) {
                e_.report.add(node.where, node.path,
                              "needs a " + requirement.type + ", and no enclosing subsystem has one",
                              "add a block that provides it beside this block or in a subsystem around it");
                is_complete = false;
                continue;
            }
            bind_resources(from.node, depth + 1);
            const auto& made = e_.declaration(from.node).provisions[static_cast<std::size_t>(from.slot)].made;
            if (!made) {
                is_complete = false;
                continue;
            }
            requirement.bind(made);
            requirement.is_bound = true;
            node.providers[r] = from;
        }
        if (!is_complete) return;
        for (auto& provision : d.provisions) {
            if (provision.made || failed_.contains(index)) continue;
            try {
                provision.made = provision.make();
            } catch (const std::exception& error) {
                failed_[index] = true;
                e_.report.add(node.where, node.path, error.what());
            }
        }
    }

    void check_units() {
        for (const auto& node : e_.diagram.nodes)
            for (std::size_t i = 0; i < node.sources.size(); ++i) {
                if (node.sources[i].node < 0) continue;
                const Slot& to = node.block->declaration().slots[i];
                const Slot& from = e_.diagram.slot(node.sources[i]);
                // "1" is also what a source without a unit of its own says.
                const Unit none;
                if (to.unit == none || from.unit == none || from.unit.agrees_with(to.unit)) continue;
                e_.report.add(node.where, node.path,
                              "input '" + to.name + "' is in " + std::string(to.unit.text) +
                                  ", but is wired to " + e_.diagram.end_path(node.sources[i]) + " in " +
                                  std::string(from.unit.text),
                              "convert the signal, e.g. with a Gain");
            }
    }

    void named(const model::Signal& signal, std::vector<SignalName>& to) {
        auto found = e_.diagram.match_signals(signal.path);
        if (found.empty()) {
            std::vector<std::string> names;
            for (const auto& known : e_.diagram.match_signals("*")) names.push_back(known.path);
            e_.report.add(signal.where, "",
                          "there is no signal '" + signal.path + "'" + did_you_mean(signal.path, names),
                          "signals are called block.port, with the subsystems before them");
        }
        to.insert(to.end(), found.begin(), found.end());
    }

    Elaboration& e_;
    std::vector<Scope*> node_scopes_;
    std::unordered_map<int, bool> failed_;
};

} // namespace

void wire(Elaboration& e) { Wiring(e).run(); }

} // namespace bf::elaboration
