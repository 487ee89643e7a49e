// The stages of elaboration and what they share.
#pragma once

#include "bf/base/names.hpp"
#include "bf/core/resolve.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/matlab/formula.hpp"
#include "fixes.hpp"

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace bf::elaboration {

/// Collects what is wrong, each thing once.
class Report {
  public:
    void add(const model::Location& where, std::string path, std::string message, std::string remedy = {},
             std::vector<model::Fix> fixes = {}) {
        add({where, std::move(path), std::move(message), std::move(remedy), std::move(fixes)});
    }
    /// A port has no wire.
    void add_open(const model::Location& where, std::string path, std::string message,
                  std::string remedy = "connect a signal to it") {
        add({where, std::move(path), std::move(message), std::move(remedy), {}, true});
    }
    void add(model::Diagnostic diagnostic) {
        if (known_.insert(diagnostic.text()).second) diagnostics_.push_back(std::move(diagnostic));
    }
    bool is_empty() const { return diagnostics_.empty(); }
    /// "; did you mean 'a'?", of the names that `known` lists, or nothing; and what `fix` makes of each.
    struct Meant {
        std::string text;
        std::vector<model::Fix> fixes;
    };
    template <class Known, class MakeFix>
    Meant meant(const std::string& name, Known&& known, const MakeFix& fix) {
        if (!suggestions_.take()) return {};
        const std::vector<std::string> names = known();
        Meant found{did_you_mean(name, names), {}};
        for (const std::string& one : similar(name, names)) found.fixes.push_back(fix(one));
        return found;
    }
    template <class Known> std::string suggestion(const std::string& name, Known&& known) {
        return suggestions_.take() ? did_you_mean(name, known()) : std::string();
    }
    /// In the order of the document; what stands in no file comes last.
    std::vector<model::Diagnostic> take();
    void throw_if_any();

  private:
    std::vector<model::Diagnostic> diagnostics_;
    std::unordered_set<std::string> known_;
    Suggestions suggestions_;
};

/// Where a message of a block is about that names a row of a setting, as "'transitions', row 2" does: where
/// the document has that row, or else the block.
model::Location place_of_row(const model::Block& block, const std::string& message);

/// The variables of one scope, with the paths by which definitions know them.
struct Variables : matlab::Workspace {
    explicit Variables(const Variables* enclosing = nullptr) : Workspace(enclosing), around(enclosing) {}
    const Variables* around;
    std::unordered_map<std::string, std::string> paths;
    /// Of a variable, or of a part of one, as "Gain.Kp"; nothing when neither this nor an enclosing scope has
    /// it.
    std::optional<std::string> path_of(const std::string& name) const {
        const std::string root = name.substr(0, name.find('.'));
        for (const Variables* scope = this; scope; scope = scope->around)
            if (const auto found = scope->paths.find(root); found != scope->paths.end())
                return found->second + name.substr(root.size());
        return std::nullopt;
    }
};

/// What a block names as its sample time, or the subsystem around it.
struct SampleTime {
    std::optional<double> period, offset; ///< s, where given
    const model::Block* given_by = nullptr;
    std::string path; ///< of that block
};

/// One subsystem of the model while it is being dissolved.
struct Scope {
    const model::System* system = nullptr;
    const model::Block* self = nullptr; ///< the block that holds it; null for the root
    Scope* parent = nullptr;
    std::string path;
    Variables variables;
    int condition = 0, loop = -1;
    SampleTime sample_time;
    std::vector<int> nodes; ///< blocks that stand directly in it

    /// What a name in this subsystem stands for; nothing where the block is left out, or cannot be made.
    struct Item {
        int node = -1;
        Scope* scope = nullptr;
        int bus = -1; ///< a block that only groups signals
        bool is_made() const { return node >= 0 || scope || bus >= 0; }
    };
    std::unordered_map<std::string_view, Item> items;
    std::unordered_set<std::string_view> left_out; ///< blocks whose `when` is false
    /// Where a connection comes from: an output of a block, of a subsystem, or an input of the surrounding
    /// one.
    struct Driver {
        const model::Endpoint* from = nullptr; ///< null: not connected
        Item item;                             ///< neither node nor scope: the surrounding subsystem
        int port = -1; ///< slot of the node or index of the port; -1: there is none, which is reported
    };
    std::vector<Driver> inputs;     ///< one per port, then the control ports; they stand in the parent
    std::vector<Driver> outputs;    ///< one per port
    std::vector<Node::End> outlets; ///< what holds each output of a conditional or for_each subsystem
    /// Of a bus that leaves a conditional subsystem: what holds each of its signals, by port and path.
    std::map<std::pair<std::size_t, std::string>, Node::End> bus_outlets;
    std::vector<Scope*> parts; ///< of a for_each subsystem: its iterations, which have the blocks

    explicit Scope(const Variables* enclosing) : variables(enclosing) {}
};

/// The name of a bus's signal within the bus that it stands in: a BusSelector's or BusAssignment's port.
inline std::string_view last_name(std::string_view path) { return path.substr(path.rfind('.') + 1); }

/// A Merge, and what it becomes where its inputs are buses: one Merge for each of their signals.
struct MergedBus {
    Scope* scope;
    std::vector<Scope::Driver> drivers; ///< of its inputs
    std::map<std::string, Node::End> signals;
};

/// A block that groups signals, or takes them apart: it is gone after wiring.
struct Bus {
    enum class Kind : std::uint8_t { creator, selector, assignment };
    Kind kind;
    std::string path;
    Scope* scope;
    std::vector<std::string>
        names; ///< of a creator's or assignment's signals; of a selector the paths it takes out
    std::vector<Scope::Driver>
        drivers; ///< of the inputs: those of `names`, and after them `bus` where there is one
    model::Location where;
    std::unordered_map<std::string, std::size_t> places = {}; ///< of the names

    /// The driver of the signal that `path` is, or begins with; it is left with what follows. Null: there is
    /// none.
    const Scope::Driver* find(std::string& path) const;
};

/// The state that the stages hand on.
struct Elaboration {
    const model::Model& model;
    Registry& registry;
    const ElaborateOptions& options;
    Report report = {};
    Suggestions suggestions = {}; ///< of names in expressions
    Diagram diagram = {};
    std::deque<Scope> scopes = {};                 ///< stable addresses
    std::unordered_set<std::string> left_out = {}; ///< paths of blocks whose `when` is false
    std::vector<Bus> buses = {};
    std::map<int, MergedBus> merges = {};      ///< by their node
    std::vector<SampleTime> sample_times = {}; ///< by node
    /// Where the value of a parameter is written, by node and slot.
    std::map<std::pair<int, int>, model::Location> written_parameters = {};

    /// What the document says about the signal at a subsystem's port.
    struct Declared {
        Node::End end;
        const model::Port* port;
        std::string path;
        std::optional<Size> size;
        std::optional<Type> type;
        const matlab::Value* enumeration = nullptr; ///< the struct of its names
    };
    std::vector<Declared> declared = {};

    Scope& root() { return scopes.front(); }
    DiagramNode& node(int i) { return diagram.nodes[static_cast<std::size_t>(i)]; }
    Resolution& resolution(int i) { return node(i).block->resolution(); }

    /// The value of an expression, noted among the diagram's definitions under that path, and `what` of it.
    std::optional<matlab::Value> evaluate(const model::Expression& expression, const Variables& variables,
                                          const std::string& path,
                                          Definition::Kind kind = Definition::Kind::structure,
                                          const char* what = "");
    void define(Definition definition, const Variables& variables);
    /// What a path of a variable, or of a part of one, stands for.
    struct Part {
        int variable;     ///< that it is or belongs to; -1: none, or a struct of several
        std::string path; ///< in the original, where the struct is a copy
        std::size_t rest; ///< characters behind the variable's own path; 0: it is the whole variable
    };
    Part part_of(std::string path) const;
    std::map<std::string, int> variable_numbers = {};               ///< among the definitions, by path
    std::unordered_map<std::string, std::string> same_structs = {}; ///< a struct's path by that of its copy
    /// Paths of variables whose value is a mistake, which is reported: expressions that use them are no
    /// others.
    std::set<std::string> unknown_variables = {};
    bool uses_unknown(const matlab::Expression& expression, const Variables& variables) const;

    /// Size and type that a port declares; wrong ones are reported.
    Declared declared_port(const Scope& scope, const model::Port& port, const std::string& path);
    std::optional<double> evaluate_scalar(const model::Expression& expression, const Variables& variables,
                                          const std::string& path, const char* what);
};

/// The core value of a MATLAB value; nothing when blocks know no such value (struct, handle).
std::optional<Value> to_value(const matlab::Value& value);
/// The value of a setting whose argument is a text or a list of texts.
std::optional<Value> text_setting(Elaboration& e, const Scope& scope, const model::Setting& setting,
                                  bool is_list, const std::string& path);

/// The paths of the signals that a wire in `scope` carries, {""} if it is no bus. It is followed through
/// `hops` ports. Where `below` names a signal of the bus, those of that signal.
std::vector<std::string> signals_of(const Elaboration& e, const Scope& scope, const Scope::Driver& wire,
                                    std::size_t hops, std::string below = {});
/// Where inputs of a Merge are buses, it merges their first signal and others like it the rest.
void split_merges(Elaboration& e, std::size_t hops);
/// Reports that a bus has only the signals `known`.
void report_missing(Elaboration& e, const model::Location& where, const std::string& path,
                    const std::string& name, const std::vector<std::string>& known);
/// What a BusAssignment replaces must be there.
void check_assignments(Elaboration& e, std::size_t hops);

void flatten(Elaboration& e);        ///< scopes, nodes with arguments and parameters
void bind_resources(Elaboration& e); ///< what blocks provide to each other
void wire(Elaboration& e);           ///< sources of inputs, conditions, named signals
void infer_shapes(Elaboration& e);   ///< sizes and types
void check_claims(Elaboration& e);   ///< what several blocks would set outside
void name_elements(Elaboration& e);  ///< names of the elements of vectors
void assign_rates(Elaboration& e);   ///< sample times
void sort(Elaboration& e);           ///< the plan

} // namespace bf::elaboration
