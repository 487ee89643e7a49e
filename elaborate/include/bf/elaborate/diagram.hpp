// The elaborated model: flat, every size, type, rate and order known. Nothing is looked up by name after it.
#pragma once

#include "bf/core/context.hpp"
#include "bf/core/registry.hpp"
#include "bf/elaborate/solver_method.hpp"
#include "bf/matlab/syntax.hpp"
#include "bf/model/model.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace bf {

/// A sample time in whole base steps: hit at steps offset, offset + ticks, ... Rate 0 is the constant rate,
/// hit only once before the first step.
struct SampleRate {
    std::int64_t ticks = 1, offset = 0;
    bool is_constant = false;
    bool is_continuous = false; ///< hit in every step, and inside it by the solver
    int trigger = 0;            ///< not 0: hit whenever that condition fires, without a period
    bool operator==(const SampleRate&) const = default;
};
inline constexpr int constant_rate = 0;

/// When the blocks of a conditional subsystem run. Condition 0 is always true.
struct Condition {
    std::string path;  ///< of the subsystem
    int parent = -1;   ///< the condition around it
    Node::End enable;  ///< given: runs while any element is above 0
    Node::End trigger; ///< given: runs once when any element has such an edge
    Node::End reset;   ///< given: such an edge puts the states inside back to their initial values
    model::Edge trigger_edge = model::Edge::rising, reset_edge = model::Edge::rising;
    int rate = 1;               ///< at which these signals are looked at
    int triggered_rate = -1;    ///< of the blocks inside, where `trigger` is given
    int loop = -1;              ///< the loop around it
    bool resets_states = false; ///< on enabling
    std::vector<int> nodes;     ///< blocks directly or indirectly inside
    /// An output of the subsystem: has its initial value before the first enabling, and after disabling where
    /// it is reset.
    struct Outlet {
        Node::End end;
        std::vector<double> initial; ///< where none is given: of what `initial_from` says, else zeros
        Node::End initial_from;      ///< a constant's output or the parameter of an InitialCondition
        bool resets = false;
    };
    std::vector<Outlet> outlets;
};

/// One block of the diagram.
struct DiagramNode {
    std::string path;    ///< "controller.pd"
    std::string type;    ///< "Gain"
    std::string library; ///< the plugin that has it; empty: a standard block, or a part of a subsystem
    Arguments arguments; ///< that the block was made with
    std::unique_ptr<Block> block;
    Block::Methods methods;
    std::vector<Node::End> sources;   ///< one per slot
    std::vector<Node::End> providers; ///< one per requirement
    int rate = -1;
    int condition = 0;
    int loop = -1; ///< the loop that it stands in
    /// By slot, the names of a vector's elements, "" for one that has none; only where one has.
    std::map<int, std::vector<std::string>> element_names;
    std::string doc; ///< what the model says of the block, or else of the nearest subsystem around it
    model::Location where;
};

/// Something to run: activity `index` of a node in a phase, a whole loop, or the test of a condition.
struct Activity {
    int node = -1;
    int index = 0;
    int condition = 0; ///< tested when there is neither node nor loop
    int loop = -1;
};

/// Activities that run together: all of one rate and under one condition.
struct Segment {
    int rate = constant_rate;
    int condition = 0;
    std::vector<Activity> activities;
};

/// Activities that run several times at one place in the order: an iterating subsystem, or an algebraic loop.
struct Loop {
    enum class Kind : std::uint8_t { for_loop, while_loop, algebraic };
    Kind kind = Kind::for_loop;
    std::string path; ///< of the subsystem, or of the first block of an algebraic loop
    int parent = -1;  ///< the loop around it
    int condition = 0, rate = 1;
    bool resets_states = false;      ///< before the first iteration of each step
    int iterations = 0;              ///< of a for loop without `count`; the most of a while loop
    Node::End count;                 ///< of a for loop: how often, looked at before the first iteration
    Node::End initial, again;        ///< of a while loop: is there a first iteration, is there another one
    int decider = -1;                ///< the block in a while loop that says so
    std::vector<int> counters;       ///< blocks whose states begin anew in each step
    std::vector<Node::End> unknowns; ///< of an algebraic loop: outputs that are read before they are written
    std::vector<int> nodes;          ///< blocks directly or indirectly inside
    std::vector<Segment> outputs, updates; ///< of one iteration
};

/// What is called, in which order, at which rate.
struct Plan {
    std::vector<Segment> outputs;     ///< in sorted order
    std::vector<Segment> updates;     ///< in document order: they read only x⁻ and outputs
    std::vector<Segment> derivatives; ///< of continuous states
    std::vector<Segment> guards;      ///< zero-crossing functions of blocks of the continuous rate
    std::vector<Loop> loops;
};

/// A recorded or plotted signal, or a port of the root.
struct SignalName {
    std::string path; ///< as the model calls it: "controller.tau"
    Node::End end;
    std::string unit = {}, doc = {}; ///< of a port, where the model says them
};

/// Names of the values of a signal, of an enumeration.
struct EnumeratedSignal {
    Node::End end;
    std::vector<std::pair<double, std::string>> names;
};

struct PlotPanel {
    std::string title;
    std::vector<SignalName> signals;
};

/// A place of the model where an expression gives a value: together they say what follows from which
/// variable.
struct Definition {
    enum class Kind : std::uint8_t {
        variable,
        constant,  ///< a variable that the model itself sets: the number of an iteration
        parameter, ///< of a block; only where it uses variables
        structure  ///< all else that uses variables, fixed from elaboration on: an argument, a period
    };
    Kind kind = Kind::structure;
    std::string path;                 ///< "Gain.Kp", "controller.pd.K", "controller.period"
    matlab::ExpressionPtr expression; ///< null: a number
    std::string text;                 ///< of the expression
    matlab::Value value;
    /// The variables that the expression names, with the name that each has there; earlier definitions.
    std::vector<std::pair<std::string, int>> uses;
    Node::End end = {}; ///< of a parameter
    Limits limits = {}; ///< of a variable, as the next ones
    std::string unit = {}, doc = {};
    /// For lists, in one line: "of the cart; = 2*w" has the doc and what the variable follows from.
    std::string about() const;
};

struct Diagram {
    std::string name;
    double step = 0; ///< base period [s]
    double stop = 0; ///< duration [s]; infinite when the model names none
    std::vector<DiagramNode> nodes;
    std::vector<SampleRate> rates;
    SolverSettings solver;               ///< of continuous states
    bool solves_algebraic_loops = false; ///< else they are errors
    bool refuses_non_finite = false;     ///< NaN or infinity in an output ends the run
    std::vector<Condition> conditions;
    std::vector<SignalName> inputs, outputs; ///< of the root; the end of an input is the port's own memory
    std::vector<SignalName> record;
    std::vector<PlotPanel> plots;
    std::vector<EnumeratedSignal> enumerated; ///< of signals whose port names an enumeration as its type
    std::vector<SignalName> aliases;          ///< outputs of subsystems and named signals
    Plan plan;
    std::vector<Definition> definitions; ///< in the order in which they were evaluated

    /// Seconds between two hits of a rate.
    double period(int rate) const {
        return static_cast<double>(rates[static_cast<std::size_t>(rate)].ticks) * step;
    }
    /// The nodes as the memory of a run needs them; clock i belongs to rate i.
    std::vector<Node> context_nodes() const;
    /// "block.port", a subsystem's output, or a block with one output. Node -1 when there is none.
    Node::End find_signal(const std::string& path) const;
    /// Every output of every block, then the outputs of subsystems.
    std::vector<SignalName> signals() const;
    /// What the model records and plots, or all signals if it names none.
    std::vector<SignalName> recorded() const;
    /// What blocks report of a run: each by the name of its block, where that reports one thing, else with
    /// the quantity's behind it.
    std::vector<SignalName> checks() const;
    /// For each node, whether derivatives, guards or conditions depend on its outputs: a solver asks for no
    /// others inside a step.
    std::vector<char> needed_inside_a_step() const;
    /// All signals matching a path in which '*' stands for any text ("a.b.*"), or a plain path as above; in
    /// document order.
    std::vector<SignalName> match_signals(const std::string& pattern) const;
    /// The node of that path, or -1.
    int find_node(const std::string& path) const;
    /// "block.parameter"; node -1 when there is none.
    Node::End find_parameter(const std::string& path) const;
    const Slot& slot(const Node::End& end) const {
        return nodes[static_cast<std::size_t>(end.node)].block->resolution().slots[static_cast<std::size_t>(
            end.slot)];
    }
    std::string end_path(const Node::End& end) const {
        return nodes[static_cast<std::size_t>(end.node)].path + "." + slot(end).name;
    }
    /// Of each element, "" for one without; none at all: empty.
    const std::vector<std::string>& element_names(const Node::End& end) const;
    /// The same as text, a line each.
    std::string element_lines(const Node::End& end) const;
    /// What stands behind the signal's name for element i, from 0: "[l_knee]", or "[4]".
    std::string element_text(const Node::End& end, int i) const;
};

/// Finds many signals of a diagram, which outlives it and stays as it is: each without looking through all.
class SignalFinder {
  public:
    explicit SignalFinder(const Diagram& diagram);
    SignalFinder(const SignalFinder&) = delete;
    SignalFinder& operator=(const SignalFinder&) = delete;

    /// As Diagram::match_signals and Diagram::find_signal.
    std::vector<SignalName> match(const std::string& pattern) const;
    Node::End find(const std::string& path) const;
    /// As Diagram::signals.
    const std::vector<SignalName>& all() const { return all_; }

  private:
    const std::unordered_map<std::string, Node::End>& hidden() const;

    const Diagram& diagram_;
    std::vector<SignalName> all_;
    /// Among them, by path, and by what stands before the last dot of it.
    std::unordered_map<std::string_view, std::vector<std::size_t>> by_path_, by_parent_;
    /// An input, or a sink of one, is seen through what drives it; a state through its memory. Made when it
    /// is first asked for, as most names are those of signals.
    mutable std::optional<std::unordered_map<std::string, Node::End>> hidden_;
};

} // namespace bf
