// bf export-ssp: a model of FMUs as a system of them, of which all else becomes FMUs, too.
#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/fmi/ssp.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/view/draw.hpp"
#include "export_fmu.hpp"
#include "files.hpp"
#include "ssp.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct SystemOptions {
    ModelOptions model;
    FmuOptions fmu;
    std::string output;
};

using Ends = std::map<std::string, Node::End>;

bool is_fmu(const model::Block& block) {
    return block.type == "FMI/FMU" || block.type == "FMI/ModelExchange";
}

bool has_fmus(const model::System& system) {
    return std::any_of(system.blocks.begin(), system.blocks.end(),
                       [](const auto& b) { return is_fmu(b) || (b.content() && has_fmus(*b.content())); });
}

std::string solver_name(SolverMethod its) {
    for (const auto& [name, method] : solver_methods)
        if (method == its) return std::string(name);
    return {};
}

/// Is it the block of that path, or inside of the subsystem?
bool is_in(const DiagramNode& node, const std::string& path) {
    return node.path.starts_with(path) && (node.path.size() == path.size() || node.path[path.size()] == '.');
}

/// Of its sample time, s.
double offset_of(const Diagram& diagram, const DiagramNode& node) {
    return static_cast<double>(diagram.rates[static_cast<std::size_t>(node.rate)].offset) * diagram.step;
}

/// A subsystem that is walked: where it stands, and what is seen there.
struct Scope {
    std::string path; ///< "" or "sub."
    fs::path file;    ///< the document that it stands in
    bool is_changed;  ///< a file with variables that the block replaces stands around it
    std::vector<model::Variable> variables, enumerations;
    Ends inputs; ///< what drives its own
};

class SystemExporter {
  public:
    SystemExporter(const LoadedModel& loaded, const FmuOptions& options)
        : loaded_(loaded), diagram_(loaded.diagram), options_(options), texts_(loaded.source.texts),
          model_(formats::read_yaml(loaded.source.file, texts_)), finder_(diagram_),
          is_needed_(diagram_.needed_inside_a_step()) {}

    fmi::Contents contents() {
        if (!has_fmus(model_.root)) refuse("it has no FMU; export it as one (bf export-fmu)");
        its_.name = diagram_.name;
        its_.system.name = diagram_.name;
        its_.system.is_system = true;
        its_.system.doc = model_.doc;
        Scope scope{"", loaded_.source.file, false, {}, {}, {}};
        for (const auto& input : diagram_.inputs) scope.inputs[input.path] = input.end;
        for (const auto& input : diagram_.inputs)
            add_port(its_.system, input.path, fmi::Causality::input, input.end, input.unit);
        for (const auto& output : diagram_.outputs)
            add_port(its_.system, output.path, fmi::Causality::output, output.end, output.unit);
        for (const auto& input : diagram_.inputs) {
            shown_.emplace(input.end, input.path);
            known_.insert(input.path);
        }
        walk(model_.root, scope, its_.system);
        note_experiment();
        its_.has_fmi_3 = !is_of_2_;
        fmi::Contents all = std::move(files_);
        all["SystemStructure.ssd"] = fmi::to_ssd(its_);
        if (!its_.system.parameters.empty()) all["resources/parameters.ssv"] = fmi::to_ssv(its_);
        return all;
    }
    const fmi::SystemStructure& structure() const { return its_; }
    /// Signals that the model records and the system has not: those inside of parts that became FMUs.
    std::size_t hidden_count() const { return hidden_; }

  private:
    [[noreturn]] void refuse(const std::string& what) const {
        throw CommandError("no system can be made of '" + diagram_.name + "': " + what);
    }

    void note_experiment() {
        if (std::isfinite(diagram_.stop)) its_.stop = diagram_.stop;
        its_.own["step"] = number_text(diagram_.step);
        const auto& solver = diagram_.solver;
        its_.own["solver"] = solver_name(solver.method);
        if (is_adaptive(solver.method)) {
            its_.own["relative_tolerance"] = number_text(solver.relative_tolerance);
            its_.own["absolute_tolerance"] = number_text(solver.absolute_tolerance);
            if (std::isfinite(solver.max_step)) its_.own["max_step"] = number_text(solver.max_step);
        }
        if (diagram_.solves_algebraic_loops) its_.own["algebraic_loops"] = "solve";
        std::set<std::string> recorded;
        for (const auto& signal : diagram_.recorded()) {
            const auto shown = shown_.find(signal.end);
            if (shown == shown_.end()) {
                ++hidden_;
                continue;
            }
            const std::string& path = known_.contains(signal.path) ? signal.path : shown->second;
            if (recorded.insert(path).second) its_.record.push_back(path);
        }
    }

    // ---- ports

    /// A unit as systems define them, "" for one that is only a text for people.
    std::string unit_of(const std::string& unit) {
        if (unit.empty()) return "";
        try {
            const Unit parsed = detail::parse_unit(unit);
            auto& exponents = its_.units[unit];
            std::copy(parsed.si.begin(), parsed.si.end(), exponents.begin());
            return unit;
        } catch (const std::invalid_argument&) {
            return "";
        }
    }
    void add_connector(fmi::SystemElement& to, const fmi::Variable& v) {
        fmi::Connector c{v.name, v.causality, v.type, {}, v.dimensions, v.ticks};
        if (v.type == fmi::Type::enumeration) c.type.reset(); // whose items the model does not name
        if (v.type == fmi::Type::float64 || v.type == fmi::Type::float32) c.unit = unit_of(v.unit);
        to.connectors.push_back(std::move(c));
    }
    void add_port(fmi::SystemElement& to, const std::string& name, fmi::Causality causality,
                  const Node::End& end, const std::string& unit) {
        const auto& slot = diagram_.slot(end);
        add_connector(to, {.name = name,
                           .unit = unit,
                           .type = type_of(slot.type),
                           .causality = causality,
                           .dimensions = dimensions_of(slot.size.rows, slot.size.cols)});
    }
    /// The signal that an end of a connection gives.
    Node::End source(const Scope& scope, const model::Endpoint& end) const {
        if (!end.block.empty()) return finder_.find(scope.path + end.text());
        const auto found = scope.inputs.find(end.port);
        return found == scope.inputs.end() ? Node::End{} : found->second;
    }

    /// What the ports of a block are called in the system.
    struct Names {
        std::map<std::string, std::string> inputs, outputs;
    };

    // ---- elements

    void walk(const model::System& system, Scope scope, fmi::SystemElement& to) {
        const auto add = [](std::vector<model::Variable>& all, const std::vector<model::Variable>& more) {
            for (const auto& v : more) {
                std::erase_if(all, [&](const auto& outer) { return outer.name == v.name; });
                all.push_back(v);
            }
        };
        add(scope.variables, system.variables);
        add(scope.enumerations, system.enumerations);
        std::map<std::string, Names> names;
        for (const auto& block : system.blocks) {
            const std::string path = scope.path + block.name;
            if (std::none_of(diagram_.nodes.begin(), diagram_.nodes.end(),
                             [&](const auto& node) { return is_in(node, path); }))
                continue; // a variant that is left out
            fmi::SystemElement element{block.name, block.doc};
            if (is_fmu(block))
                names[block.name] = add_fmu(block, path, element);
            else if (block.content() && has_fmus(*block.content()))
                names[block.name] = add_system(block, system, scope, element);
            else
                names[block.name] = add_part(block, system, scope, element);
            to.elements.push_back(std::move(element));
        }
        connect(system, scope, names, to);
        draw(scope, to);
    }

    Names add_fmu(const model::Block& block, const std::string& path, fmi::SystemElement& element) {
        const auto n = diagram_.find_node(path);
        const auto& node = diagram_.nodes[static_cast<std::size_t>(n)];
        const auto kind = block.type == "FMI/FMU" ? fmi::Kind::co_simulation : fmi::Kind::model_exchange;
        for (const auto& [argument, value] : node.arguments)
            if (argument == "structure" && !value.texts.empty())
                refuse("'" + path +
                       "' gives structural parameters of its FMU values, which a system does not hold here; "
                       "export an FMU with these sizes");
        const std::string name = fmu_name(node);
        const fs::path file = fmi::find_fmu(name);
        const auto description = fmi::description_of(file);
        is_of_2_ = is_of_2_ && description.version == 2;
        auto& source = sources_[name];
        if (source.empty()) {
            // Those of a system that was read are in its folder of resources already.
            source = name.starts_with("resources/") ? name : "resources/" + name;
            while (files_.contains(source)) source += '_';
            files_[source] = read_text_file(file);
        }
        element.source = source;
        element.kind = kind;
        const auto& rate = diagram_.rates[static_cast<std::size_t>(node.rate)];
        if (kind == fmi::Kind::co_simulation && (rate.ticks != 1 || rate.offset != 0)) {
            element.own["period"] = number_text(diagram_.period(node.rate));
            if (rate.offset != 0) element.own["offset"] = number_text(offset_of(diagram_, node));
        }
        const auto block_names = fmi::block_names(description, kind);
        const auto& resolution = node.block->resolution();
        Names names;
        for (std::size_t i = 0; i < block_names.size(); ++i) {
            const auto& v = description.variables[i];
            if (v.ticks && v.causality == fmi::Causality::input) add_connector(element, v);
            if (block_names[i].empty()) continue;
            if (v.causality == fmi::Causality::parameter) {
                const int slot = resolution.find(block_names[i], bf::Role::parameter);
                add_parameter(path, v, resolution.slots[static_cast<std::size_t>(slot)]);
                continue;
            }
            const bool is_input = v.causality == fmi::Causality::input;
            (is_input ? names.inputs : names.outputs)[block_names[i]] = v.name;
            add_connector(element, v);
            for (const int clock : v.clocks)
                element.connectors.back().clocks.push_back(
                    description.variables[static_cast<std::size_t>(clock)].name);
            if (!is_input) show({n, resolution.find(block_names[i], bf::Role::output)}, path, block_names[i]);
        }
        if (names.outputs.size() == 1) known_.insert(path);
        return names;
    }

    /// A value that is another one than the FMU has by itself.
    void add_parameter(const std::string& path, const fmi::Variable& v, const Slot& slot) {
        fmi::ParameterValue p{path + "." + v.name,
                              v.type == fmi::Type::enumeration ? fmi::Type::int32 : v.type};
        p.unit = v.type == fmi::Type::float64 || v.type == fmi::Type::float32 ? unit_of(v.unit) : "";
        p.dimensions = v.dimensions;
        for (int i = 0; i < v.count(); ++i) {
            const int place = slot.initial.size() == 1 ? 0 : fmi::column_by_column(i, v.rows(), v.cols());
            p.values.push_back(slot.initial[static_cast<std::size_t>(place)]);
        }
        if (p.values != v.start) its_.system.parameters.push_back(std::move(p));
    }

    Names add_system(const model::Block& block, const model::System& around, const Scope& scope,
                     fmi::SystemElement& element) {
        const model::System& system = *block.content();
        const std::string path = scope.path + block.name;
        if (system.execution != model::Execution::plain && system.execution != model::Execution::atomic)
            refuse("the subsystem '" + path +
                   "' has FMUs and runs under a condition or several times, which systems have not; take its "
                   "FMUs out of it");
        element.is_system = true;
        Scope inner{path + ".", scope.file, scope.is_changed, scope.variables, scope.enumerations, {}};
        if (block.reference) {
            inner.file = (scope.file.parent_path() / block.reference->file).lexically_normal();
            inner.is_changed = inner.is_changed || !block.reference->with.empty();
            inner.variables.clear(), inner.enumerations.clear(); // a file knows its own alone
        }
        Names names;
        for (const auto& port : system.inputs) {
            const auto end = driver(around, scope, block.name, port.name, system.inputs.size() == 1);
            names.inputs[port.name] = port.name;
            if (end.node < 0) continue;
            inner.inputs[port.name] = end;
            add_port(element, port.name, fmi::Causality::input, end, port.unit);
        }
        for (const auto& port : system.outputs) {
            const auto end = finder_.find(path + "." + port.name);
            names.outputs[port.name] = port.name;
            if (end.node < 0) continue;
            add_port(element, port.name, fmi::Causality::output, end, port.unit);
            known_.insert(path + "." + port.name);
        }
        if (system.outputs.size() == 1) known_.insert(path);
        walk(system, inner, element);
        return names;
    }

    /// What drives an input of a block; nothing: node -1.
    Node::End driver(const model::System& system, const Scope& scope, const std::string& block,
                     const std::string& port, bool is_only) const {
        for (const auto& connection : system.connections)
            for (const auto& to : connection.to)
                if (to.block == block && (to.port == port || (to.port.empty() && is_only)))
                    return source(scope, connection.from);
        return {};
    }

    // ---- parts that become FMUs

    struct PartPort {
        std::string name, outside; ///< of the block, of the model of the part
        bool is_input;
    };

    Names add_part(const model::Block& block, const model::System& around, const Scope& scope,
                   fmi::SystemElement& element) {
        const std::string path = scope.path + block.name;
        if (scope.is_changed)
            refuse("'" + path +
                   "' is no FMU and stands in a file whose variables are replaced (with); put it into an "
                   "FMU, or write the values into the file");
        std::vector<PartPort> ports;
        const auto add = [&](const std::string& port, bool is_input) {
            ports.push_back({port, port == block.name ? port + "_" : port, is_input});
        };
        const int n = diagram_.find_node(path);
        if (const auto* system = block.content()) {
            for (const auto& port : system->inputs) add(port.name, true);
            for (const auto control : model::control_ports(*system)) add(std::string(control), true);
            for (const auto& port : system->outputs) add(port.name, false);
        } else if (n >= 0) {
            for (const auto& slot : diagram_.nodes[static_cast<std::size_t>(n)].block->declaration().slots)
                if (slot.role == bf::Role::input || slot.role == bf::Role::output)
                    add(slot.name, slot.role == bf::Role::input);
        } else {
            refuse("'" + path + "' cannot become an FMU by itself; put it into a subsystem");
        }

        model::Model part = model_of_part(scope, block);
        if (n >= 0) give_period(part.root.blocks.front(), diagram_.nodes[static_cast<std::size_t>(n)]);
        const auto inputs =
            std::count_if(ports.begin(), ports.end(), [](const auto& p) { return p.is_input; });
        std::erase_if(ports, [&](const PartPort& port) {
            const auto end = port.is_input ? driver(around, scope, block.name, port.name, inputs == 1)
                                           : finder_.find(path + "." + port.name);
            if (end.node < 0) return true;
            const model::Endpoint own{{}, port.outside}, its{block.name, port.name};
            if (port.is_input) {
                part.root.inputs.push_back(port_of(port.outside, end));
                part.root.connections.push_back({own, {its}});
            } else {
                part.root.outputs.push_back({.name = port.outside});
                part.root.connections.push_back({its, {own}});
            }
            return false;
        });
        const bool is_of_solver = runs_in_solver(path);
        if (is_of_solver && !has_continuous_states(path)) make_continuous(part);
        const MadeFmu fmu = made(part, scope, path);
        std::string file = "resources/" + escape::file_name(path) + ".fmu";
        while (files_.contains(file)) file.insert(file.size() - 4, "_");
        const fmi::TemporaryFolder folder("part");
        fmi::write_archive(fmu.contents, folder.path() / "part.fmu");
        files_[file] = read_text_file(folder.path() / "part.fmu");
        element.source = file;
        element.kind = is_of_solver ? fmi::Kind::model_exchange : fmi::Kind::co_simulation;

        Names names;
        const auto& variables = fmu.description.variables;
        const auto block_names = fmi::block_names(fmu.description, *element.kind);
        for (const auto& port : ports) {
            const std::string name = fmi::structured_name(port.outside);
            const auto v = std::find_if(variables.begin(), variables.end(),
                                        [&](const auto& its) { return its.name == name; });
            if (v == variables.end())
                refuse("'" + path + "." + port.name + "' is an array, which FMI 2.0 has not; take --fmi 3");
            (port.is_input ? names.inputs : names.outputs)[port.name] = name;
            add_connector(element, *v);
            if (!port.is_input)
                show(finder_.find(path + "." + port.name), path,
                     block_names[static_cast<std::size_t>(v - variables.begin())]);
        }
        if (names.outputs.size() == 1) known_.insert(path);
        return names;
    }

    /// The signal has this path in the system's model, too.
    void show(const Node::End& end, const std::string& block, const std::string& port) {
        shown_.emplace(end, block + "." + port);
        known_.insert(block + "." + port);
    }

    model::Model model_of_part(const Scope& scope, const model::Block& block) const {
        model::Model part{.name = block.name};
        part.step = model::Expression{number_text(diagram_.step)};
        const auto method = diagram_.solver.method; // which is that of co-simulation alone
        part.solver = model::Expression{solver_name(is_adaptive(method) ? SolverMethod::rk4 : method)};
        if (diagram_.solves_algebraic_loops) part.algebraic_loops = model::AlgebraicLoops::solve;
        for (const auto& plugin : model_.plugins)
            if (plugin.name != "FMI") part.plugins.push_back({plugin.name});
        part.root.variables = scope.variables;
        part.root.enumerations = scope.enumerations;
        part.root.blocks.push_back(block);
        part.root.blocks.front().when.reset();
        return part;
    }

    model::Port port_of(const std::string& name, const Node::End& end) const {
        const auto& slot = diagram_.slot(end);
        const auto [rows, cols, is_matrix] = slot.size;
        model::Port port{.name = name, .type = bf::name(slot.type)};
        if (is_matrix)
            port.shape = {.text = "[" + std::to_string(rows) + " " + std::to_string(cols) + "]"};
        else if (rows != 1)
            port.shape = {.text = std::to_string(rows)};
        return port;
    }

    /// The sample time that the block has from its surroundings.
    void give_period(model::Block& block, const DiagramNode& node) const {
        const auto& rate = diagram_.rates[static_cast<std::size_t>(node.rate)];
        if (block.period || rate.is_constant || rate.is_continuous || rate.trigger != 0) return;
        if (rate.ticks == 1 && rate.offset == 0) return;
        block.period = model::Expression{number_text(diagram_.period(node.rate))};
        if (rate.offset != 0) block.offset = model::Expression{number_text(offset_of(diagram_, node))};
    }

    /// Of the changes of the command those that concern the part.
    std::vector<Override> overrides(const model::Model& part, const std::string& prefix) const {
        std::vector<Override> all;
        for (const auto& [name, text] : loaded_.source.overrides) {
            if (!name.starts_with(prefix)) continue;
            const std::string rest = name.substr(prefix.size()), first = rest.substr(0, rest.find('.'));
            const bool is_block = first == part.root.blocks.front().name && first != rest;
            const bool is_variable = std::any_of(part.root.variables.begin(), part.root.variables.end(),
                                                 [&](const auto& v) { return v.name == first; });
            if (is_block || is_variable) all.push_back({rest, text, {}});
        }
        return all;
    }

    MadeFmu made(const model::Model& part, const Scope& scope, const std::string& path) {
        try {
            // Variables of outer systems keep what the command makes of them.
            auto changes = overrides(part, "");
            if (!scope.path.empty())
                for (auto& change : overrides(part, scope.path)) changes.push_back(std::move(change));
            std::vector<FmuVariant> loaded;
            loaded.push_back({load(part, scope.file, changes), {}});
            compare(loaded.front().loaded.diagram, scope.path, path);
            is_of_2_ = is_of_2_ && options_.version == 2;
            return make_fmu(loaded, options_);
        } catch (const codegen::GenerationError& error) {
            refuse("'" + path + "' is no FMU, and cannot become one: " + error.what());
        } catch (const model::Errors& errors) {
            refuse("'" + path + "' is no FMU, and cannot become one by itself:\n" + errors.what());
        }
    }

    /// Blocks must run as often as they do in the model, with the types and sizes that they have there.
    void compare(const Diagram& part, const std::string& prefix, const std::string& path) const {
        for (const auto& node : diagram_.nodes) {
            if (!is_in(node, path)) continue;
            const auto& rate = diagram_.rates[static_cast<std::size_t>(node.rate)];
            const int n = part.find_node(node.path.substr(prefix.size()));
            if (n < 0) continue;
            const auto& slots = part.nodes[static_cast<std::size_t>(n)].block->resolution().slots;
            for (const Slot& slot : node.block->resolution().slots) {
                const auto own = std::find_if(slots.begin(), slots.end(), [&](const Slot& other) {
                    return other.name == slot.name && other.role == slot.role;
                });
                if (own != slots.end() && (own->type != slot.type || own->size != slot.size))
                    refuse("'" + node.path + "." + slot.name + "' is a " + slot.size.text() + " of type " +
                           bf::name(slot.type) + " by the wires around it, and by itself a " +
                           own->size.text() + " of type " + bf::name(own->type) +
                           "; give it a value of that type and size, or put a Convert behind it");
            }
            if (rate.is_constant || rate.trigger != 0) continue;
            const auto& its = part.nodes[static_cast<std::size_t>(n)];
            const bool is_needed = is_needed_[static_cast<std::size_t>(&node - diagram_.nodes.data())] != 0;
            const bool is_same =
                rate.is_continuous
                    ? part.rates[static_cast<std::size_t>(its.rate)].is_continuous || !is_needed
                    : part.period(its.rate) == diagram_.period(node.rate) &&
                          offset_of(part, its) == offset_of(diagram_, node);
            if (!is_same)
                refuse("'" + node.path + "' has its sample time from outside of '" + path +
                       "', which becomes an FMU; give it a period");
        }
    }

    bool has_continuous_states(const std::string& path) const {
        return std::any_of(diagram_.nodes.begin(), diagram_.nodes.end(), [&](const auto& node) {
            const auto& slots = node.block->declaration().slots;
            return is_in(node, path) && std::any_of(slots.begin(), slots.end(), [](const auto& s) {
                       return s.role == bf::Role::continuous_state;
                   });
        });
    }
    /// Does the solver ask for it inside of a step?
    bool runs_in_solver(const std::string& path) const {
        for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
            const auto& node = diagram_.nodes[n];
            if (is_in(node, path) && is_needed_[n] &&
                diagram_.rates[static_cast<std::size_t>(node.rate)].is_continuous)
                return true;
        }
        return has_continuous_states(path);
    }
    /// Without continuous states a model computes in its own steps alone. One that stays 0 lets it compute
    /// whenever the solver asks.
    static void make_continuous(model::Model& part) {
        std::string state = "continuous", input = "zero";
        while (part.root.is_taken(state)) state += '_';
        while (part.root.is_taken(input)) input += '_';
        model::Block zero{.name = input, .type = "Constant"};
        zero.settings.push_back({"value", {.text = "0"}});
        part.root.blocks.push_back(std::move(zero));
        part.root.blocks.push_back({.name = state, .type = "Integrator"});
        part.root.connections.push_back({{input}, {{state}}});
    }

    // ---- connections and drawing

    void connect(const model::System& system, const Scope& scope, const std::map<std::string, Names>& names,
                 fmi::SystemElement& to) {
        /// The name of a port, which a connection leaves out where it is the only one; none: "".
        const auto resolve = [&](const model::Endpoint& end, bool is_source) -> std::string {
            if (end.block.empty()) return end.port;
            const auto found = names.find(end.block);
            if (found == names.end()) return "";
            const auto& all = is_source ? found->second.outputs : found->second.inputs;
            if (end.port.empty()) return all.size() == 1 ? all.begin()->second : "";
            const auto port = all.find(end.port);
            return port == all.end() ? "" : port->second;
        };
        for (const auto& connection : system.connections)
            for (const auto& end : connection.to) {
                const auto is_left_out = [&](const model::Endpoint& e) {
                    return !e.block.empty() && !names.contains(e.block);
                };
                if (is_left_out(connection.from) || is_left_out(end)) continue;
                fmi::Wire wire{connection.from.block, resolve(connection.from, true), end.block,
                               resolve(end, false)};
                if (wire.from.empty() || wire.to.empty())
                    refuse("the connection from '" + scope.path + connection.from.text() + "' to '" +
                           scope.path + end.text() + "' is none of signals");
                for (const auto& bends : model_.layout.wires)
                    if (bends.path == scope.path + end.text() && !bends.as_labels)
                        for (const auto& p : bends.points) {
                            wire.xs.push_back(p.x / pixels_per_millimetre);
                            wire.ys.push_back(-p.y / pixels_per_millimetre);
                        }
                to.wires.push_back(std::move(wire));
            }
    }

    void draw(const Scope& scope, fmi::SystemElement& to) const {
        std::string system = scope.path;
        if (!system.empty()) system.pop_back();
        const auto drawing = editor::draw(model_, system, diagram_, {}, {});
        for (const auto& drawn : drawing.elements) {
            if (drawn.kind != editor::Element::Kind::block &&
                drawn.kind != editor::Element::Kind::subsystem && drawn.kind != editor::Element::Kind::chart)
                continue;
            for (auto& element : to.elements) {
                if (scope.path + element.name != drawn.path) continue;
                const auto& layout = model_.layout.blocks;
                const auto given = std::find_if(layout.begin(), layout.end(),
                                                [&](const auto& p) { return p.path == drawn.path; });
                const auto [x, y, width, height] = drawn.bounds;
                const int turns = given == layout.end() ? 0 : static_cast<int>(given->rotated);
                const bool is_odd = turns % 2 == 1, is_flipped = given != layout.end() && given->flipped;
                // A block of an FMU has room for its ports, however thin the block was that became one.
                const double w = std::max(is_odd ? height : width, 20.0) / pixels_per_millimetre,
                             h = std::max(is_odd ? width : height, 20.0) / pixels_per_millimetre;
                const double cx = (x + width / 2) / pixels_per_millimetre,
                             cy = -(y + height / 2) / pixels_per_millimetre;
                fmi::Place place{cx - w / 2, cy - h / 2, cx + w / 2, cy + h / 2,
                                 turns == 0 ? 0.0 : 360.0 - 90 * turns};
                if (is_flipped) std::swap(place.x1, place.x2);
                element.place = place;
            }
        }
    }

    const LoadedModel& loaded_;
    const Diagram& diagram_;
    const FmuOptions& options_;
    formats::Files texts_;
    model::Model model_;
    SignalFinder finder_;
    std::vector<char> is_needed_;
    fmi::SystemStructure its_;
    fmi::Contents files_;
    struct EndLess {
        bool operator()(const Node::End& a, const Node::End& b) const {
            return std::pair(a.node, a.slot) < std::pair(b.node, b.slot);
        }
    };
    std::map<Node::End, std::string, EndLess>
        shown_;                                  ///< signals that the system has, as its model calls them
    std::set<std::string> known_;                ///< paths of signals that the system's model has, too
    std::map<std::string, std::string> sources_; ///< of FMUs in the package, by what the model calls them
    bool is_of_2_ = true;                        ///< are all FMUs of FMI 2.0?
    std::size_t hidden_ = 0;
};

void execute(const SystemOptions& options) {
    const LoadedModel loaded = load_model(options.model);
    const std::string output =
        !options.output.empty() ? options.output : fs::path(options.model.file).stem().string() + ".ssp";
    refuse_overwriting({{"-o", output}}, {options.model.file});
    SystemExporter exporter(loaded, options.fmu);
    fmi::write_archive(exporter.contents(), output);
    std::string hidden;
    if (exporter.hidden_count() > 0)
        hidden = "; " + std::to_string(exporter.hidden_count()) + " recorded signals are inside of FMUs now";
    std::printf("%s: a system of %zu elements%s\n", output.c_str(),
                exporter.structure().system.elements.size(), hidden.c_str());
}

} // namespace

void add_export_ssp(CLI::App& app) {
    auto* command = app.add_subcommand("export-ssp", "write a model of FMUs as a system of them (SSP)");
    auto options = std::make_shared<SystemOptions>();
    options->model.add_to(*command);
    command->add_option("-o,--output", options->output, "file; otherwise MODEL.ssp in this folder")
        ->type_name("FILE");
    options->fmu.add_to(*command);
    command->footer("Blocks and subsystems without FMUs become FMUs. Example: bf export-ssp wrapper.yaml "
                    "--plugin-path fmus");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
