#include "bf/model/check.hpp"

#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/model/suggest.hpp"
#include "editor.hpp"
#include "identifiers.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

namespace bf::model {
namespace {

constexpr std::size_t most_fields = 10000;

class Checker {
  public:
    std::vector<Diagnostic> found;

    void check_model(const Model& model);

  private:
    void check_system(const System& system, const std::string& path, int depth);
    void check_block(const Block& block, const std::string& path, int depth);
    void check_overrides(const Reference& reference, const std::string& path);
    void check_ports(const System& system, const std::string& path);
    void check_connections(const System& system, const std::string& path);
    void check_signal(const Model& model, const Signal& signal);
    void check_layout(const Layout& layout);
    void check_extent(const Location& where, const std::string& path, const std::string& what,
                      const Point& at, const std::optional<Point>& size = {});

    template <typename Items>
    void check_unique(const Items& items, const std::string& kind, const std::string& path);
    void check_variables(const std::vector<Variable>& variables, const std::string& path);

    void report(const Location& where, const std::string& path, std::string message, std::string remedy) {
        found.push_back({where, path, std::move(message), std::move(remedy)});
    }

    /// What was probably meant, of the candidates that `known` lists.
    template <typename Known> std::string suggestion(std::string_view word, Known&& known) {
        return suggestions_.take() ? name_remedy(word, known()) : std::string();
    }

    /// What a subsystem has under which name. Made once for each, as each of its connections asks.
    struct Content {
        std::unordered_map<std::string_view, const Block*> blocks;
        std::unordered_set<std::string_view> inputs, outputs, signals; ///< inputs: with the control ports
    };
    const Content& content_of(const System& system);

    /// Whether the endpoint exists; reports if not. `source` tells which end of a connection it is.
    bool check_end(const System& system, const Endpoint& end, bool source, const std::string& path);

    std::unordered_map<const System*, Content> contents_;
    Suggestions suggestions_;
};

const Checker::Content& Checker::content_of(const System& system) {
    const auto [known, is_new] = contents_.try_emplace(&system);
    Content& content = known->second;
    if (!is_new) return content;
    for (const Block& block : system.blocks) content.blocks.try_emplace(block.name, &block);
    for (const Port& port : system.inputs) content.inputs.insert(port.name);
    for (const std::string_view control : control_ports(system)) content.inputs.insert(control);
    for (const Port& port : system.outputs) content.outputs.insert(port.name);
    for (const NamedSignal& signal : system.signals) content.signals.insert(signal.name);
    return content;
}

template <typename Items>
void Checker::check_unique(const Items& items, const std::string& kind, const std::string& path) {
    std::unordered_map<std::string_view, const Location*> seen;
    for (const auto& item : items) {
        if (!is_name(item.name))
            report(item.where, path, "'" + item.name + "' is no name for a " + kind, name_rule);
        const auto [first, is_new] = seen.try_emplace(item.name, &item.where);
        if (is_new) continue;
        const std::string place = first->second->text();
        report(item.where, path, "a second " + kind + " '" + item.name + "'",
               "rename one of them" + (place.empty() ? "" : "; the first is at " + place));
    }
}

void Checker::check_variables(const std::vector<Variable>& variables, const std::string& path) {
    std::unordered_set<std::string_view> seen;
    for (const Variable& variable : variables) {
        if (!is_identifier(variable.name))
            report(variable.where, path, "'" + variable.name + "' is no name for a variable",
                   "use a letter followed by letters, digits and '_'");
        if (!seen.insert(variable.name).second)
            report(variable.where, path, "a second variable '" + variable.name + "'", "rename one of them");
        if (variable.fields.size() > most_fields) // each is looked for among all
            report(variable.where, path,
                   "the struct '" + variable.name + "' has " + std::to_string(variable.fields.size()) +
                       " fields",
                   "give it at most " + std::to_string(most_fields) + ", or use a matrix");
        check_variables(variable.fields, path);
    }
}

void Checker::check_ports(const System& system, const std::string& path) {
    check_unique(system.inputs, "input", path);
    check_unique(system.outputs, "output", path);
    check_unique(system.signals, "signal", path);
    for (const auto* ports : {&system.inputs, &system.outputs})
        for (const Port& port : *ports)
            if (content_of(system).blocks.contains(port.name))
                report(port.where, path, "'" + port.name + "' names both a block and a port of the subsystem",
                       "rename one of them, so that connections are clear");
    for (const NamedSignal& signal : system.signals) {
        const auto& [blocks, inputs, outputs, signals] = content_of(system);
        if (blocks.contains(signal.name) || inputs.contains(signal.name) || outputs.contains(signal.name))
            report(signal.where, path, "'" + signal.name + "' names a signal and something else",
                   "rename one of them, so that paths are clear");
        check_end(system, signal.of, true, path);
    }
    for (const std::string_view control : control_ports(system))
        if (const Port* port = system.find_input(control))
            report(port->where, path, "the subsystem has its input '" + port->name + "' already",
                   "remove it from `inputs`");
    if (system.execution == Execution::for_each && !system.iterations)
        report({}, path, "a for_each subsystem needs `iterations`", "give the number of parts");
    if (system.execution == Execution::for_each && system.reset)
        report({}, path, "a for_each subsystem has no `reset`", "put a subsystem with `reset` into it");
}

bool Checker::check_end(const System& system, const Endpoint& end, bool source, const std::string& path) {
    const std::string name = end.text(), kind = source ? "output" : "input";
    if (end.block.empty()) {
        const auto& [blocks, inputs, outputs, signals] = content_of(system);
        if ((source ? inputs : outputs).contains(end.port)) return true;
        if ((source ? outputs : inputs).contains(end.port)) {
            report(end.where, path,
                   "'" + name + "' is an " + kind + " of this subsystem, which inside it is no " +
                       (source ? "source" : "destination"),
                   source ? "connect what computes it" : "connect what is to receive it");
            return false;
        }
        report(end.where, path, "there is no '" + name + "' to connect", suggestion(end.port, [&] {
                   std::vector<std::string> known = names_of(system.blocks);
                   for (std::string& port : names_of(source ? system.inputs : system.outputs))
                       known.push_back(port);
                   return known;
               }));
        return false;
    }
    const auto& blocks = content_of(system).blocks;
    const auto block = blocks.find(end.block);
    if (block == blocks.end()) {
        report(end.where, path, "there is no block '" + end.block + "' to connect '" + name + "'",
               suggestion(end.block, [&] { return names_of(system.blocks); }));
        return false;
    }
    const System* content = block->second->content();
    if (!content) return true; // ports of a library block are its declaration's matter
    const auto& ports = source ? content_of(*content).outputs : content_of(*content).inputs;
    if (end.port.empty() ? ports.size() == 1 : ports.contains(end.port)) return true;
    const auto known = [&] {
        std::vector<std::string> names = names_of(source ? content->outputs : content->inputs);
        if (!source)
            for (const std::string_view control : control_ports(*content)) names.emplace_back(control);
        return names;
    };
    if (!end.port.empty())
        report(end.where, path, "subsystem '" + end.block + "' has no " + kind + " '" + end.port + "'",
               suggestion(end.port, known));
    else if (ports.empty())
        report(end.where, path, "subsystem '" + end.block + "' has no " + kind,
               "declare it in the `" + kind + "s` of '" + end.block + "'");
    else
        report(end.where, path, "subsystem '" + end.block + "' has several " + kind + "s",
               "name the one that is meant: '" + end.block + "." + known()[0] + "'");
    return false;
}

void Checker::check_connections(const System& system, const std::string& path) {
    std::unordered_map<std::string, const Endpoint*> fed;
    const auto is_variant = [&](const Endpoint& end) {
        const auto& blocks = content_of(system).blocks;
        const auto block = blocks.find(end.block);
        return block != blocks.end() && block->second->when;
    };
    for (const Connection& connection : system.connections) {
        check_end(system, connection.from, true, path);
        if (connection.to.empty())
            report(connection.where, path, "'" + connection.from.text() + "' is connected to nothing",
                   "name a destination, or remove the connection");
        for (const Endpoint& end : connection.to) {
            if (!check_end(system, end, false, path) || is_variant(connection.from)) continue;
            const auto [first, is_new] = fed.try_emplace(end.text(), &end);
            if (is_new) continue;
            const std::string place = first->second->where.text();
            report(end.where, path, "'" + end.text() + "' is connected twice",
                   "an input has one source" + (place.empty() ? "" : "; the first is at " + place));
        }
    }
}

void Checker::check_overrides(const Reference& reference, const std::string& path) {
    check_variables(reference.with, path);
    if (!reference.model) return;
    const auto& variables = reference.model->root.variables;
    std::unordered_set<std::string_view> known;
    for (const Variable& variable : variables) known.insert(variable.name);
    for (const Variable& variable : reference.with)
        if (!known.contains(variable.name))
            report(variable.where, path,
                   "'" + reference.file + "' has no variable '" + variable.name + "' to override",
                   suggestion(variable.name, [&] { return names_of(variables); }));
}

void Checker::check_block(const Block& block, const std::string& path, int depth) {
    if (block.is_library_block() + bool(block.system) + bool(block.reference) != 1)
        report(block.where, path, "the block is neither of a library, nor a subsystem, nor in a file",
               "give it exactly one of `block`, `blocks` and `file`");
    if (block.offset && !block.period)
        report(block.offset->where, path, "`offset` without `period`",
               "an offset shifts a sample time: give both");
    check_unique(block.settings, "setting", path);
    if (block.reference) check_overrides(*block.reference, path);
    if (!block.system) return;
    if (depth < max_depth) return check_system(*block.system, path, depth + 1);
    report(block.where, path, "subsystems are nested more than " + std::to_string(max_depth) + " deep",
           "flatten the model");
}

void Checker::check_system(const System& system, const std::string& path, int depth) {
    check_unique(system.blocks, "block", path);
    check_ports(system, path);
    check_variables(system.enumerations, path);
    check_variables(system.variables, path);
    std::unordered_map<std::string_view, const Variable*> variables;
    for (const Variable& variable : system.variables) variables.try_emplace(variable.name, &variable);
    for (const Variable& enumeration : system.enumerations) {
        if (enumeration.fields.empty())
            report(enumeration.where, path, "the enumeration '" + enumeration.name + "' has no values",
                   "list their names, e.g. [idle, walk]");
        if (const auto variable = variables.find(enumeration.name); variable != variables.end())
            report(variable->second->where, path,
                   "'" + enumeration.name + "' names both a variable and an enumeration",
                   "rename one of them");
    }
    check_connections(system, path);
    for (const Block& block : system.blocks)
        check_block(block, path.empty() ? block.name : path + "." + block.name, depth);
}

void Checker::check_signal(const Model& model, const Signal& signal) {
    const System* system = &model.root;
    std::string_view rest = signal.path;
    while (system) {
        const std::string_view name = rest.substr(0, rest.find('.'));
        const bool is_last = name.size() == rest.size();
        if (name.find('*') != name.npos) return; // what it matches depends on the blocks' declarations
        const auto& [blocks, inputs, outputs, signals] = content_of(*system);
        if (is_last && signals.contains(name)) return;
        if (outputs.contains(name)) return; // with more after it a signal of a bus: its wiring tells
        if (is_last && inputs.contains(name)) return;
        const auto named = blocks.find(name);
        if (named == blocks.end()) {
            if (signal.path == "all")
                return report(signal.where, "", "there is no signal 'all'",
                              "every signal is recorded by `record: all`, without brackets");
            return report(signal.where, "", "there is no signal '" + signal.path + "'", suggestion(name, [&] {
                              std::vector<std::string> known = names_of(system->blocks);
                              for (std::string& port : names_of(system->outputs)) known.push_back(port);
                              for (std::string& one : names_of(system->signals)) known.push_back(one);
                              return known;
                          }));
        }
        const Block* block = named->second;
        if (is_last || (block->reference && !block->reference->model)) return; // nobody read that file
        rest.remove_prefix(name.size() + 1);
        system = block->content(); // none of a library's block, whose declaration tells
    }
}

void Checker::check_extent(const Location& where, const std::string& path, const std::string& what,
                           const Point& at, const std::optional<Point>& size) {
    if (!is_drawable(at))
        report(where, path, what + " is drawn at [" + number_text(at.x) + ", " + number_text(at.y) + "]",
               coordinate_rule());
    if (size && !(is_drawable(*size) && size->x > 0 && size->y > 0))
        report(where, path,
               what + " is drawn " + number_text(size->x) + " wide and " + number_text(size->y) + " high",
               "sizes are greater than 0 and at most " + std::to_string(max_coordinate));
}

void Checker::check_layout(const Layout& layout) {
    for (const Placement& drawn : layout.blocks)
        check_extent(drawn.where, drawn.path, "it", drawn.at, drawn.size);
    for (const Bends& bends : layout.wires)
        for (const Point& corner : bends.points)
            check_extent(bends.where, bends.path, "a corner of the wire", corner);
    for (const Note& note : layout.notes)
        check_extent(note.where, note.system, "the note '" + note.name + "'", note.at, note.size);
}

void Checker::check_model(const Model& model) {
    check_system(model.root, "", 0);
    check_unique(model.plugins, "plugin", "");
    for (const auto& plugin : model.plugins)
        if (plugin.name.find('/') != std::string::npos) // its code would run before anybody agreed
            report(plugin.where, "", "the plugin '" + plugin.name + "' is a path",
                   "give its name only, and its folder as `bf --plugin-path FOLDER` or in "
                   "BLOCKFACTORY_PLUGIN_PATH");
    for (const Signal& signal : model.record) check_signal(model, signal);
    for (const Panel& panel : model.plots)
        for (const Signal& signal : panel.signals) check_signal(model, signal);
    check_layout(model.layout);
}

} // namespace

bool is_name(std::string_view name) {
    const bool plain = std::ranges::none_of(
        name, [](unsigned char c) { return c < 0x20 || c == 0x7f || c == '.' || c == '*'; });
    return plain && !name.empty() && name.size() <= 200 && name.front() != ' ' && name.back() != ' ';
}

bool is_drawable(const Point& at) {
    return std::abs(at.x) <= max_coordinate && std::abs(at.y) <= max_coordinate; // no NaN is
}

std::string coordinate_rule() {
    const std::string limit = std::to_string(max_coordinate);
    return "coordinates lie between -" + limit + " and " + limit;
}

std::vector<Diagnostic> check(const Model& model) {
    Checker checker;
    checker.check_model(model);
    std::ranges::stable_sort(checker.found, {},
                             [](const Diagnostic& d) { return std::pair(d.where.line, d.where.column); });
    return std::move(checker.found);
}

} // namespace bf::model
