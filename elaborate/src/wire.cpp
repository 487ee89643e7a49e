// Connections become sources of inputs; signals get their names.
#include "internal_blocks.hpp"
#include "stages.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace bf::elaboration {

namespace {

/// A port that a connection may mean.
struct NamedPort {
    std::string_view name;
    int index; ///< slot of a block, or place among the ports of a subsystem
};

/// The ports of one side of a block or a subsystem, which many connections look up.
struct NamedPorts {
    std::vector<NamedPort> all;
    std::unordered_map<std::string_view, int> indices; ///< by name

    explicit NamedPorts(std::vector<NamedPort> ports) : all(std::move(ports)) {
        for (const auto& port : all) indices.emplace(port.name, port.index);
    }
    std::vector<std::string> names() const {
        std::vector<std::string> names;
        for (const auto& port : all) names.emplace_back(port.name);
        return names;
    }
};

class Wiring {
  public:
    explicit Wiring(Elaboration& elaboration) : e_(elaboration), node_drivers_(e_.diagram.nodes.size()) {}

    void run() {
        const int blocks = static_cast<int>(node_drivers_.size());
        for (int n = 0; n < blocks; ++n)
            node_drivers_[static_cast<std::size_t>(n)].resize(e_.resolution(n).slots.size());
        for (auto& scope : e_.scopes) {
            scope.inputs.resize(scope.system->inputs.size() + model::control_ports(*scope.system).size());
            scope.outputs.resize(scope.system->outputs.size());
            ports_ += scope.inputs.size() + scope.outputs.size();
        }
        for (const auto& bus : e_.buses) ports_ += bus.drivers.size();
        for (auto& scope : e_.scopes)
            if (scope.parts.empty())
                for (const auto& connection : scope.system->connections)
                    for (const auto& to : connection.to) drive(scope, connection.from, to);
        add_root_inputs();
        find_merges();
        for (auto& scope : e_.scopes) add_outlets(scope);
        for (auto& scope : e_.scopes) add_parts(scope);
        split_merges(e_, ports_);
        for (auto& scope : e_.scopes)
            for (const int n : scope.nodes)
                if (n < blocks) connect_inputs(scope, n);
        for (auto& scope : e_.scopes) connect_controls(scope);
        for (auto& scope : e_.scopes) connect_parts(scope);
        check_assignments(e_, ports_);
        for (int n = 0; n < blocks; ++n) mark_iteration(n);
        for (auto& scope : e_.scopes) name_ports(scope);
        name_single_outputs();
        check_units();
        const SignalFinder finder(e_.diagram);
        for (auto& signal : e_.model.record) named(finder, signal, e_.diagram.record);
        if (e_.model.record_all) e_.diagram.record = finder.all();
        for (const auto& panel : e_.model.plots) {
            e_.diagram.plots.push_back({panel.title, {}});
            for (const auto& signal : panel.signals) named(finder, signal, e_.diagram.plots.back().signals);
        }
    }

  private:
    using Driver = Scope::Driver;

    static std::string inside(const Scope& scope, const std::string& name) {
        return scope.path.empty() ? name : scope.path + "." + name;
    }

    /// Does the subsystem hold its outputs while it does not run?
    static bool is_conditional(const Scope& scope) {
        using enum model::Execution;
        const auto e = scope.system->execution;
        return scope.self && (e == enabled || e == triggered || e == enabled_and_triggered);
    }

    std::vector<NamedPort> slots(int node, Role role) {
        std::vector<NamedPort> ports;
        const auto& slots = e_.resolution(node).slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == role) ports.push_back({slots[i].name, static_cast<int>(i)});
        return ports;
    }
    static std::vector<NamedPort> inputs(const Scope& scope) {
        std::vector<NamedPort> ports;
        for (const auto& port : scope.system->inputs)
            ports.push_back({port.name, static_cast<int>(ports.size())});
        for (const auto control : model::control_ports(*scope.system))
            ports.push_back({control, static_cast<int>(ports.size())});
        return ports;
    }
    static std::vector<NamedPort> outputs(const Scope& scope) {
        std::vector<NamedPort> ports;
        for (const auto& port : scope.system->outputs)
            ports.push_back({port.name, static_cast<int>(ports.size())});
        return ports;
    }

    /// What a bus block shows to the one side: the names of its signals, or the bus itself as the last input.
    static std::vector<NamedPort> bus_ports(const Bus& bus, Role role) {
        std::vector<NamedPort> ports;
        const bool has_names = (role == Role::input) == (bus.kind != Bus::Kind::selector);
        if (has_names)
            for (const auto& name : bus.names)
                ports.push_back({last_name(name), static_cast<int>(ports.size())});
        if (!has_names || (role == Role::input && bus.kind == Bus::Kind::assignment))
            ports.push_back({"bus", static_cast<int>(bus.names.size())});
        return ports;
    }

    const NamedPorts& ports_of(const Scope::Item& item, Role role) {
        const std::tuple key{static_cast<const Scope*>(item.scope), item.node, item.bus, role};
        const auto known = named_ports_.find(key);
        if (known != named_ports_.end()) return known->second;
        return named_ports_
            .emplace(key, item.bus >= 0 ? bus_ports(e_.buses[static_cast<std::size_t>(item.bus)], role)
                          : item.scope  ? role == Role::input ? inputs(*item.scope) : outputs(*item.scope)
                                        : slots(item.node, role))
            .first->second;
    }
    /// Those of the subsystem itself, as its content sees them.
    const NamedPorts& ports_of(const Scope& scope, Role role) {
        Scope::Item item;
        item.scope = const_cast<Scope*>(&scope);
        return ports_of(item, role);
    }

    /// Index of the port that an endpoint means: its name, or the only one there is; -1 after a report.
    int port_of(const Scope& scope, const model::Endpoint& end, const NamedPorts& ports,
                const std::string& kind) {
        if (end.port.empty() && ports.all.size() == 1) return ports.all.front().index;
        if (const auto found = ports.indices.find(end.port); found != ports.indices.end())
            return found->second;
        const auto list = [&] {
            return name_list(ports.all, [](const NamedPort& port) { return std::string(port.name); });
        };
        const std::string path = inside(scope, end.block);
        if (!end.port.empty()) {
            auto meant = e_.report.meant(
                end.port, [&] { return ports.names(); },
                [&](const std::string& name) {
                    return joined_by(scope, end, model::Endpoint{end.block, name});
                });
            e_.report.add(end.where, path, "there is no " + kind + " '" + end.port + "'" + meant.text,
                          kind + "s: " + (ports.all.empty() ? "none" : list()), std::move(meant.fixes));
        } else if (ports.all.empty())
            e_.report.add(end.where, path, "'" + end.text() + "' has no " + kind, "remove the connection");
        else
            e_.report.add(end.where, path,
                          "'" + end.text() + "' does not say which " + kind + " is meant: there are " +
                              std::to_string(ports.all.size()),
                          "write one of " + list() + " after a dot");
        return -1;
    }

    /// The wire that is being joined, or the signal that is being named, with another end in place of `end`.
    model::Fix joined_by(const Scope& scope, const model::Endpoint& end, const model::Endpoint& other) const {
        if (named_) return named_anew(scope.path, *named_, other);
        const auto text = [&](const model::Endpoint& own) { return (&own == &end ? other : own).text(); };
        return rewired(scope.path, *from_, *to_, text(*from_), text(*to_));
    }

    const Scope::Item* item_of(const Scope& scope, const model::Endpoint& end) {
        const auto found = scope.items.find(end.block);
        // The connections of a block that is left out are too; one that could not be made was reported.
        if (found != scope.items.end()) return found->second.is_made() ? &found->second : nullptr;
        const auto names = [&] {
            std::vector<std::string> known;
            for (const auto& block : scope.system->blocks) known.push_back(block.name);
            return known;
        };
        auto meant = e_.report.meant(end.block, names, [&](const std::string& name) {
            return joined_by(scope, end, model::Endpoint{name, end.port});
        });
        e_.report.add(end.where, scope.path, "there is no block '" + end.block + "' here" + meant.text, "",
                      std::move(meant.fixes));
        return nullptr;
    }

    Driver driver(const Scope& scope, const model::Endpoint& from) {
        Driver driver{&from, {}, -1};
        if (from.block.empty()) {
            driver.port = port_of(scope, from, ports_of(scope, Role::input), "input of the subsystem");
        } else if (const auto* item = item_of(scope, from)) {
            driver.item = *item;
            driver.port = port_of(scope, from, ports_of(*item, Role::output), "output");
        }
        return driver;
    }

    void drive(Scope& scope, const model::Endpoint& from, const model::Endpoint& to) {
        if (scope.left_out.contains(from.block)) return;
        from_ = &from;
        to_ = &to;
        const Driver source = driver(scope, from);
        Driver* target = nullptr;
        if (to.block.empty()) {
            const int port = port_of(scope, to, ports_of(scope, Role::output), "output of the subsystem");
            if (port >= 0) target = &scope.outputs[static_cast<std::size_t>(port)];
        } else if (const auto* item = item_of(scope, to)) {
            const int port = port_of(scope, to, ports_of(*item, Role::input), "input");
            if (port >= 0)
                target = &(item->scope      ? item->scope->inputs
                           : item->bus >= 0 ? e_.buses[static_cast<std::size_t>(item->bus)].drivers
                                            : node_drivers_[static_cast<std::size_t>(
                                                  item->node)])[static_cast<std::size_t>(port)];
            else if (item->node >= 0)
                misspelled_.insert(item->node);
        }
        if (!target) return;
        if (target->from)
            e_.report.add(to.where, inside(scope, to.block),
                          "'" + to.text() + "' is driven twice: by '" + target->from->text() + "' and by '" +
                              from.text() + "'",
                          "remove one of the connections");
        else
            *target = source;
    }

    /// Marks a wire whose error is reported already; {} stands for no wire.
    static Node::End failed() { return {-2, -1}; }

    /// Follows a wire that stands in `scope` through the ports of subsystems and through buses to the block
    /// that drives it. `element`: which signal of a bus is meant, "" for a wire that is no bus.
    Node::End resolve(const Scope* scope, const Driver* driver, bool may_be_bus = false,
                      std::string element = {}) {
        open_ = {};
        for (std::size_t hops = 0; hops <= ports_; ++hops) {
            if (!driver->from) return {};
            if (driver->port < 0) return failed();
            const auto port = static_cast<std::size_t>(driver->port);
            if (driver->item.bus >= 0) {
                const Bus& bus = e_.buses[static_cast<std::size_t>(driver->item.bus)];
                if (may_be_bus && element.empty() && bus.kind != Bus::Kind::selector) return failed();
                driver = through(bus, *scope, *driver, element);
                if (!driver) return failed();
                scope = bus.scope;
                continue;
            }
            if (const auto merge = e_.merges.find(driver->item.node);
                merge != e_.merges.end() && !merge->second.signals.empty()) {
                const auto& signals = merge->second.signals;
                if (const auto found = signals.find(element); found != signals.end()) return found->second;
                std::vector<std::string> names;
                for (const auto& signal : signals) names.push_back(signal.first);
                if (!element.empty())
                    report_missing(e_, driver->from->where, scope->path, element, names);
                else if (!may_be_bus)
                    report_bus(*driver, *scope, names);
                return failed();
            }
            const Scope* inner = driver->item.scope;
            if (inner && !element.empty())
                if (const auto held = inner->bus_outlets.find({port, element});
                    held != inner->bus_outlets.end())
                    return held->second;
            const bool is_held = inner && !inner->outlets.empty() && inner->outlets[port].node >= 0;
            const bool ends = driver->item.node >= 0 || is_held || (!inner && !scope->parent);
            if (ends && !element.empty()) {
                e_.report.add(driver->from->where, scope->path,
                              "'" + driver->from->text() + "' is no bus, so it has no signal '" + element +
                                  "'",
                              "connect a BusCreator");
                return failed();
            }
            if (driver->item.node >= 0) return {driver->item.node, driver->port};
            if (inner) {
                if (is_held) return inner->outlets[port];
                scope = inner->parts.empty() ? inner : inner->parts.front();
                driver = &scope->outputs[port];
                if (!driver->from) return failed(); // name_ports reports it
            } else if (scope->parent) {
                driver = &scope->inputs[port];
                if (!driver->from) open_ = {scope, port};
                scope = scope->parent;
            } else {
                return e_.diagram.inputs[port].end;
            }
        }
        if (!std::exchange(is_circle_reported_, true))
            e_.report.add(driver->from->where, scope->path,
                          "ports of subsystems are connected in a circle without any block",
                          "connect one of them to the block that is to drive it");
        return failed();
    }

    /// A bus is read as if it were a signal.
    void report_bus(const Driver& wire, const Scope& scope, const std::vector<std::string>& names) {
        e_.report.add(wire.from->where, scope.path,
                      "'" + wire.from->text() + "' is a bus of " + name_list(names),
                      "take a signal out of it with a BusSelector");
    }

    void find_merges() {
        for (auto& scope : e_.scopes)
            for (const int n : scope.nodes) {
                if (!e_.node(n).block->declaration().traits.merges) continue;
                MergedBus merge{&scope, {}, {}};
                for (const auto& input : slots(n, Role::input))
                    merge.drivers.push_back(
                        node_drivers_[static_cast<std::size_t>(n)][static_cast<std::size_t>(input.index)]);
                ports_ += merge.drivers.size();
                e_.merges.emplace(n, std::move(merge));
            }
    }
    void connect_merge(const MergedBus& merge, int first) {
        const auto inputs = slots(first, Role::input);
        for (const auto& [element, end] : merge.signals)
            for (std::size_t i = 0; i < inputs.size(); ++i)
                if (const auto from = resolve(merge.scope, &merge.drivers[i], false, element); from.node >= 0)
                    e_.node(end.node).sources[static_cast<std::size_t>(inputs[i].index)] = from;
                else if (from.node == -1)
                    report_open(e_.node(end.node), std::string(inputs[i].name));
    }

    /// The input of a bus block that its output comes from; null after a report. Takes the bus block's own
    /// name off the element, or puts a selector's in front.
    const Driver* through(const Bus& bus, const Scope& scope, const Driver& wire, std::string& element) {
        const auto port = static_cast<std::size_t>(wire.port);
        if (bus.kind == Bus::Kind::selector) {
            element = element.empty() ? bus.names[port] : bus.names[port] + "." + element;
            return &bus.drivers.back();
        }
        if (element.empty()) {
            report_bus(wire, scope, bus.names);
            return nullptr;
        }
        if (const auto* driver = bus.find(element)) return driver;
        if (bus.kind == Bus::Kind::assignment) return &bus.drivers.back();
        report_missing(e_, bus.where, bus.path, element.substr(0, element.find('.')), bus.names);
        return nullptr;
    }

    Node::End output_of(const Scope& scope, std::size_t port) {
        return scope.outlets.empty() ? resolve(&scope, &scope.outputs[port], true) : scope.outlets[port];
    }

    int add_internal(std::unique_ptr<Block> block, const model::Port& port, const char* type,
                     const Scope& scope) {
        DiagramNode node;
        node.sources.resize(block->resolution().slots.size());
        node.block = std::move(block);
        node.path = inside(scope, port.name);
        node.type = type;
        node.condition = scope.condition;
        node.loop = scope.loop;
        node.where = port.where ? port.where : scope.self ? scope.self->where : e_.model.where;
        e_.sample_times.push_back(scope.sample_time);
        e_.diagram.nodes.push_back(std::move(node));
        return static_cast<int>(e_.diagram.nodes.size()) - 1;
    }

    void add_root_inputs() {
        for (const Scope& root = e_.root(); const auto& port : root.system->inputs) {
            auto& declared = e_.declared.emplace_back(e_.declared_port(root, port, port.name));
            const int node = add_internal(std::make_unique<RootInput>(declared), port, "Inport", root);
            declared.end = {node, 0};
            e_.diagram.inputs.push_back({port.name, {node, 0}, port.unit, port.doc});
            declare_unit(port, port.name, {node, 0});
        }
    }

    void add_root_output(const model::Port& port, const Node::End& end) {
        e_.diagram.outputs.push_back({port.name, end, port.unit, port.doc});
    }

    void add_outlets(Scope& scope) {
        if (!is_conditional(scope)) return;
        add_outlets(scope, scope, [&](const model::Port& port) {
            const int node = add_internal(std::make_unique<Hold>(), port, "Outport", scope);
            scope.nodes.push_back(node);
            Condition::Outlet outlet{{node, 1}, {}, {}, port.when_disabled == model::WhenDisabled::reset};
            if (port.initial) read_initial(scope, port, outlet);
            e_.diagram.conditions[static_cast<std::size_t>(scope.condition)].outlets.push_back(
                std::move(outlet));
            return Node::End{node, 1};
        });
    }

    /// The blocks that share out the inputs of a for_each subsystem, and join its outputs.
    void add_parts(Scope& front) {
        const int count = static_cast<int>(front.parts.size());
        if (count == 0) return;
        static const model::Endpoint through_front;
        for (int i = 0; i < count; ++i) {
            Scope& part = *front.parts[static_cast<std::size_t>(i)];
            for (std::size_t p = 0; p < front.system->inputs.size(); ++p) {
                const auto& port = front.system->inputs[p];
                part.inputs[p] = {&through_front, {}, static_cast<int>(p)};
                if (!port.each || !front.inputs[p].from) continue;
                const int node = add_internal(std::make_unique<Part>(i, count), port, "Part", part);
                part.inputs[p] = {&through_front, {node}, 1};
                parts_.push_back({node, &front, p});
            }
        }
        const Scope& first = *front.parts.front();
        add_outlets(front, first, [&](const model::Port& port) {
            const int node = add_internal(std::make_unique<Join>(count), port, "Join", front);
            return Node::End{node, count};
        });
    }

    /// What holds or joins each output of a subsystem, of a bus each of its signals. `inner` has its wires.
    template <class Make> void add_outlets(Scope& scope, const Scope& inner, const Make& make) {
        for (std::size_t i = 0; i < scope.outputs.size(); ++i) {
            scope.outlets.push_back(failed()); // of a bus
            for (const auto& element : signals_of(e_, inner, inner.outputs[i], ports_)) {
                model::Port port = scope.system->outputs[i];
                if (!element.empty()) port.name += "." + element;
                (element.empty() ? scope.outlets.back() : scope.bus_outlets[{i, element}]) = make(port);
            }
        }
    }

    void connect_parts(Scope& front) {
        for (const auto& [node, its_front, port] : parts_)
            if (its_front == &front)
                if (const auto from = resolve(front.parent, &front.inputs[port]); from.node >= 0)
                    e_.node(node).sources[0] = from;
        for (std::size_t i = 0; i < front.parts.size(); ++i) {
            const auto join = [&](const Node::End& outlet, std::size_t p, const std::string& element) {
                if (outlet.node < 0) return;
                if (const auto from = resolve(front.parts[i], &front.parts[i]->outputs[p], false, element);
                    from.node >= 0)
                    e_.node(outlet.node).sources[i] = from;
            };
            for (std::size_t p = 0; p < front.outlets.size(); ++p) join(front.outlets[p], p, "");
            for (const auto& [signal, end] : front.bus_outlets) join(end, signal.first, signal.second);
        }
    }

    /// Blocks that a loop looks at: Iteration has its number, While decides whether there is another.
    void mark_iteration(int n) {
        const DiagramNode& node = e_.node(n);
        const Declaration& d = node.block->declaration();
        const Traits& traits = d.traits;
        const bool is_while = traits.again >= 0;
        if (!traits.counts && !is_while) return;
        auto* loop = node.loop < 0 ? nullptr : &e_.diagram.plan.loops[static_cast<std::size_t>(node.loop)];
        if (!loop || (is_while && loop->kind != Loop::Kind::while_loop)) {
            e_.report.add(node.where, node.path,
                          node.type + (is_while ? " stands in no while subsystem" : " stands in no loop"),
                          is_while ? "put it into a subsystem with `execution: while`"
                                   : "put it into a subsystem with `execution: for` or `while`");
            return;
        }
        if (traits.counts) {
            loop->counters.push_back(n);
            return;
        }
        if (loop->decider >= 0)
            e_.report.add(node.where, node.path, "the subsystem has a second " + node.type,
                          "keep one of them");
        loop->decider = n;
        loop->again = node.sources[static_cast<std::size_t>(traits.again)];
        loop->initial = node.sources[static_cast<std::size_t>(traits.begin)];
        loop->iterations = static_cast<int>(
            node.block->resolution().slots[static_cast<std::size_t>(traits.most)].initial.at(0));
    }

    void read_initial(const Scope& scope, const model::Port& port, Condition::Outlet& outlet) {
        const std::string path = inside(scope, port.name);
        const auto value = e_.evaluate(*port.initial, scope.variables, path);
        if (!value) return;
        if (!value->is_array())
            e_.report.add(port.initial->where, path, "'initial' is " + value->describe(),
                          "give a number, a vector or a matrix");
        else if (!value->is_empty()) // [] inherits, as if nothing were given
            outlet.initial.assign(value->data(), value->data() + value->numel());
    }

    void connect_inputs(const Scope& scope, int index) {
        if (const auto merge = e_.merges.find(index);
            merge != e_.merges.end() && !merge->second.signals.empty())
            return connect_merge(merge->second, index);
        DiagramNode& node = e_.node(index);
        const auto& slots = node.block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role != Role::input) continue;
            const auto from = resolve(&scope, &node_drivers_[static_cast<std::size_t>(index)][i]);
            if (from.node >= 0)
                node.sources[i] = from;
            else if (from.node == -1 && !misspelled_.contains(index) && node.block->resolution().is_bound() &&
                     node.block->needs(static_cast<int>(i)))
                report_open(node, slots[i].name);
        }
    }

    /// The input is open, or the one of a subsystem around it; of that many blocks may read.
    void report_open(const DiagramNode& node, const std::string& input) {
        const auto [scope, port] = open_;
        if (!scope)
            e_.report.add_open(node.where, node.path, "input '" + input + "' is not connected");
        else if (reported_.insert(&scope->inputs[port]).second)
            e_.report.add_open(scope->self->where, scope->path,
                               "the subsystem's input '" + scope->system->inputs[port].name +
                                   "' is not connected");
    }

    void connect_controls(const Scope& scope) {
        const auto controls = model::control_ports(*scope.system);
        auto& condition = e_.diagram.conditions[static_cast<std::size_t>(scope.condition)];
        for (std::size_t i = 0; scope.self && scope.parts.empty() && i < controls.size(); ++i) {
            const auto end = resolve(scope.parent, &scope.inputs[scope.system->inputs.size() + i]);
            if (end.node == -1)
                e_.report.add_open(scope.self->where, scope.path,
                                   "the subsystem's input '" + std::string(controls[i]) +
                                       "' is not connected",
                                   "connect a signal to it; " + meaning(controls[i]));
            if (controls[i] == model::iterations_port)
                e_.diagram.plan.loops[static_cast<std::size_t>(scope.loop)].count = end;
            else
                (controls[i] == model::enable_port    ? condition.enable
                 : controls[i] == model::trigger_port ? condition.trigger
                                                      : condition.reset) = end;
        }
        if (is_conditional(scope))
            for (std::size_t i = 0; i < scope.outlets.size(); ++i)
                if (scope.outlets[i].node >= 0)
                    if (const auto from = resolve(&scope, &scope.outputs[i]); from.node >= 0)
                        e_.node(scope.outlets[i].node).sources[0] = from;
        for (const auto& [signal, end] : scope.bus_outlets) // those of a for_each subsystem have no wire yet
            if (const auto from = resolve(&scope, &scope.outputs[signal.first], false, signal.second);
                from.node >= 0)
                e_.node(end.node).sources[0] = from;
        for (int c = scope.condition; c > 0; c = e_.diagram.conditions[static_cast<std::size_t>(c)].parent)
            for (const int node : scope.nodes)
                e_.diagram.conditions[static_cast<std::size_t>(c)].nodes.push_back(node);
        for (int l = scope.loop; l >= 0; l = e_.diagram.plan.loops[static_cast<std::size_t>(l)].parent)
            for (const int node : scope.nodes)
                e_.diagram.plan.loops[static_cast<std::size_t>(l)].nodes.push_back(node);
    }

    static std::string meaning(std::string_view control) {
        if (control == model::enable_port) return "the subsystem runs while any element is above 0";
        if (control == model::trigger_port) return "the subsystem runs when any element has an edge";
        if (control == model::reset_port) return "an edge puts states back to their initial values";
        return "it says how often the subsystem runs in a step, or give `iterations: N`";
    }

    /// Names outputs of subsystems and signals, and keeps what ports declare for the inference.
    void name_ports(const Scope& scope) {
        const auto declare = [&](const model::Port& port, const Node::End& end) {
            declare_unit(port, inside(scope, port.name), end);
            if (!port.shape && port.type.empty()) return;
            e_.declared.push_back(e_.declared_port(scope, port, inside(scope, port.name)));
            e_.declared.back().end = end;
        };
        if (scope.parent)
            for (std::size_t i = 0; i < scope.system->inputs.size(); ++i)
                declare(scope.system->inputs[i], resolve(scope.parent, &scope.inputs[i], true));
        for (std::size_t i = 0; i < scope.outputs.size(); ++i) {
            const auto& port = scope.system->outputs[i];
            if (!scope.outputs[i].from && scope.parts.empty())
                e_.report.add_open(port.where, inside(scope, port.name),
                                   "the subsystem's output is not connected",
                                   "connect a block's output to it");
            const auto end = output_of(scope, i); // -2 for a bus, which has no memory of its own
            declare(port, end);
            if (end.node < 0) continue;
            e_.diagram.aliases.push_back({inside(scope, port.name), end});
            if (!scope.parent) add_root_output(port, end);
        }
        for (const auto& [signal, end] : scope.bus_outlets)
            e_.diagram.aliases.push_back({e_.node(end.node).path, end});
        for (const auto& signal : scope.system->signals) {
            if (!scope.parts.empty() || scope.left_out.contains(signal.of.block)) continue;
            named_ = &signal;
            const Driver source = driver(scope, signal.of);
            if (const auto end = resolve(&scope, &source, true); end.node >= 0)
                e_.diagram.aliases.push_back({inside(scope, signal.name), end});
        }
    }

    /// A subsystem's path means its only output, also where its signals have names beside that.
    void name_single_outputs() {
        std::set<const Scope*> named;
        for (auto& scope : e_.scopes)
            for (const Scope* s = &scope; !scope.system->signals.empty() && s->parent; s = s->parent)
                if (s->outputs.size() == 1 && named.insert(s).second)
                    if (const auto end = output_of(*s, 0); end.node >= 0)
                        e_.diagram.aliases.push_back({s->path, end});
    }

    // "1" is also what a source without a unit of its own says.
    static constexpr bool are_opposed(const Unit& one, const Unit& other) {
        return !(one == Unit()) && !(other == Unit()) && !one.agrees_with(other);
    }

    /// Ports of systems have the unit of the signal behind them. One of unknown units is a text for people.
    void declare_unit(const model::Port& port, const std::string& path, const Node::End& end) {
        if (port.unit.empty() || end.node < 0) return;
        Unit unit;
        try {
            unit = bf::detail::parse_unit(port.unit);
        } catch (const std::invalid_argument&) {
            return;
        }
        const auto oppose = [&](const std::string& what, const Unit& other) {
            e_.report.add(port.where, path,
                          "the port is in " + port.unit + ", but " + what + " in " + std::string(other.text),
                          "convert the signal, e.g. with a Gain, or correct the unit");
        };
        if (const Unit& own = e_.diagram.slot(end).unit; are_opposed(unit, own))
            return oppose("its signal " + e_.diagram.end_path(end) + " is", own);
        const auto [first, is_first] = port_units_.try_emplace({end.node, end.slot}, path, unit);
        if (!is_first && are_opposed(unit, first->second.second))
            oppose("the same signal is at " + first->second.first, first->second.second);
    }

    void check_units() {
        for (const auto& node : e_.diagram.nodes)
            for (std::size_t i = 0; i < node.sources.size(); ++i) {
                const auto& source = node.sources[i];
                if (source.node < 0) continue;
                const Slot& to = node.block->resolution().slots[i];
                Unit from = e_.diagram.slot(source).unit;
                std::string name = e_.diagram.end_path(source);
                const auto declared = port_units_.find({source.node, source.slot});
                if (declared != port_units_.end() && !are_opposed(to.unit, from))
                    std::tie(name, from) = declared->second;
                if (!are_opposed(to.unit, from)) continue;
                e_.report.add(node.where, node.path,
                              "input '" + to.name + "' is in " + std::string(to.unit.text) +
                                  ", but is wired to " + name + " in " + std::string(from.text),
                              "convert the signal, e.g. with a Gain");
            }
    }

    /// Is it in a block whose `when` is false? Then it is left out with it.
    bool is_left_out(const std::string& signal) const {
        for (std::size_t dot = 0; dot < signal.size();) {
            dot = std::min(signal.find('.', dot + 1), signal.size());
            if (e_.left_out.contains(signal.substr(0, dot))) return true;
        }
        return false;
    }

    void named(const SignalFinder& finder, const model::Signal& signal, std::vector<SignalName>& to) {
        auto found = finder.match(signal.path);
        if (found.empty() && !is_left_out(signal.path)) {
            const auto names = [](const std::vector<SignalName>& signals) {
                std::vector<std::string> known;
                for (const auto& one : signals) known.push_back(one.path);
                return known;
            };
            auto meant = e_.report.meant(
                signal.path, [&] { return names(finder.all()); },
                [&](const std::string& name) { return renamed_signal(e_.model, signal.path, name); });
            const auto parts = names(finder.match(signal.path + ".*"));
            e_.report.add(signal.where, "", "there is no signal '" + signal.path + "'" + meant.text,
                          parts.empty()
                              ? "signals are called block.port, with the subsystems before them"
                              : "take one of " + name_list(parts) + ", or all by '" + signal.path + ".*'",
                          std::move(meant.fixes));
        }
        to.insert(to.end(), found.begin(), found.end());
    }

    Elaboration& e_;
    const model::Endpoint *from_ = nullptr, *to_ = nullptr; ///< of the wire that is being joined
    const model::NamedSignal* named_ = nullptr;             ///< whose source is looked for, after all wires
    std::vector<std::vector<Driver>> node_drivers_;         ///< per slot of each block
    std::map<std::tuple<const Scope*, int, int, Role>, NamedPorts> named_ports_; ///< scope, node, bus, side
    std::unordered_set<int> misspelled_; ///< blocks of which a connection names an input that is not there
    std::pair<const Scope*, std::size_t> open_; ///< a subsystem's input at which `resolve` ended last
    std::unordered_set<const Driver*> reported_;
    /// By signal, the first port that declares one: its path and unit.
    std::map<std::pair<int, int>, std::pair<std::string, Unit>> port_units_;
    bool is_circle_reported_ = false;
    std::size_t ports_ = 0; ///< of all subsystems and buses
    struct PartOfInput {
        int node;
        Scope* front;
        std::size_t port;
    };
    std::vector<PartOfInput> parts_;
};

} // namespace

void wire(Elaboration& e) { Wiring(e).run(); }

} // namespace bf::elaboration
