#pragma once

#include "bf/model/location.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// The document a person writes: hierarchical, named, with expressions, everything in the order of the
/// document. Nothing is evaluated here. Names of blocks, ports and variables hold no '.', so a dotted path is
/// unambiguous. A Model is a value: a copy shares only the models of referenced files, which do not change.
namespace bf::model {

struct System;
struct Model;

/// Text that explains, kept for the next writer. A line of `before` is a comment with its '#', or empty: a
/// blank line.
struct Comments {
    std::vector<std::string> before;
    std::string trailing; ///< comment on the item's own line, with the blanks in front of its '#'

    bool empty() const { return before.empty() && trailing.empty(); }
};

enum class Quotes {
    none,    ///< k: 2*pi       MATLAB expression, or the text itself where the block declares a text
    single,  ///< k: 'l_sole'   MATLAB char array, the quotes being MATLAB's own
    twofold, ///< k: "[1 2]*pi" as `none`; the quotes are there for YAML's sake
    literal, ///< k: |          lines of text, such as the code of a MATLAB Function
};

/// A value as it is written, not evaluated.
struct Expression {
    std::string text;    ///< without the quotes
    Location where = {}; ///< of its first character
    Quotes quotes = Quotes::none;
    std::string spelling =
        {}; ///< how the document spells it, where that is not `text` (nested or broken sequences)
    /// Where each row of a matrix, or each item of a list, was read from; no place: it came later. Empty
    /// where nobody knows.
    std::vector<Location> rows = {};

    bool quoted() const { return quotes != Quotes::none; }

    /// MATLAB source of the value: `text`, in quotes again if they were MATLAB's.
    std::string matlab() const;
};

/// A key of a mapping in the document, with its comments: what a writer needs to keep order and comments.
struct Key {
    std::string name;
    Comments comments = {};
    Location where = {};
};

enum class WhenDisabled { held, reset };

/// An input or output of a subsystem. What is not declared is inherited from what is connected.
struct Port {
    std::string name;
    std::optional<Expression> shape = {}; ///< `[3 1]` a matrix, `3` a 1-D signal
    std::string type = {};                ///< `double`, `single`, `int32`, `boolean`, ...
    std::string unit = {};
    std::string doc = {};
    WhenDisabled when_disabled = WhenDisabled::held; ///< outputs of enabled subsystems
    bool each = false; ///< inputs of `for_each` subsystems: every iteration sees its own part
    std::optional<Expression> initial = {}; ///< outputs: value before the first enabling
    Comments comments = {};
    Location where = {};
};

/// One end of a connection. Empty `block`: a port of the surrounding subsystem itself. Empty `port`: the only
/// output or input the block has.
struct Endpoint {
    std::string block;
    std::string port = {};
    Comments comments = {};
    Location where = {};

    /// `block.port`, or the one of both that there is.
    std::string text() const;
};

/// From one output to one or several inputs.
struct Connection {
    Endpoint from;
    std::vector<Endpoint> to;
    Comments comments = {};
    Location where = {};
};

/// A name of a signal, which stands at its wires: the signal is recorded, plotted and found by it, too.
struct NamedSignal {
    std::string name;
    Endpoint of; ///< where it comes from, as connections write it
    Comments comments = {};
    Location where = {};
};

/// The value of a block's argument or parameter.
struct Setting {
    std::string name;
    Expression value;
    Location where = {};
};

/// A named value; with `fields` it is a struct, and what is declared of one value is unused.
struct Variable {
    std::string name;
    Expression value = {};
    std::optional<Expression> minimum = {}, above = {}, maximum = {}; ///< of every element
    std::string unit = {}, doc = {};
    std::vector<Variable> fields = {};
    Comments comments = {};
    Location where = {};
};

/// The content of a block that another model file holds; `with` overrides variables of that model, evaluated
/// where the block stands.
struct Reference {
    std::string file; ///< as written: relative to the referring file
    std::vector<Variable> with = {};
    std::shared_ptr<const Model> model = {}; ///< what the reader found there
    Location where = {};
};

/// The content of a subsystem, which its block owns: copied with it. Null in other blocks.
class OwnSystem {
  public:
    OwnSystem() = default;
    OwnSystem(std::unique_ptr<System> system);
    OwnSystem(const OwnSystem& other);
    OwnSystem(OwnSystem&& other) noexcept;
    OwnSystem& operator=(OwnSystem other) noexcept;
    ~OwnSystem();

    explicit operator bool() const { return system_ != nullptr; }
    System* get() { return system_.get(); }
    const System* get() const { return system_.get(); }
    System& operator*() { return *system_; }
    const System& operator*() const { return *system_; }
    System* operator->() { return system_.get(); }
    const System* operator->() const { return system_.get(); }

  private:
    std::unique_ptr<System> system_;
};

/// A block of a library (`type`), a subsystem (`system`), or a subsystem in its own file (`reference`):
/// exactly one of the three.
struct Block {
    std::string name;
    std::string type = {}; ///< "Gain" or "WholeBodyToolbox/MassMatrix"
    OwnSystem system = {};
    std::optional<Reference> reference = {};
    std::vector<Setting> settings = {}; ///< of a block of a library
    std::string doc = {};
    std::optional<Expression> period = {}; ///< sample time in s; makes a subsystem atomic
    std::optional<Expression> offset = {}; ///< of the sample times, in s
    std::optional<Expression> when =
        {};                     ///< a variant: where it is false, the block and its connections are left out
    std::vector<Key> keys = {}; ///< order and comments of the keys in the document
    Comments comments = {};
    Location where = {};
    Location type_where = {};
    int mark = 0; ///< finds it again while an operation is under way; no part of the document
    std::map<std::string, int> state_marks = {}; ///< the same of the states of a chart

    bool is_subsystem() const { return !is_library_block(); }
    bool is_library_block() const { return !type.empty(); }

    /// The subsystem's content, wherever it stands; null for a block of a library or an unread file.
    const System* content() const;

    const Setting* find_setting(std::string_view setting) const;
};

enum class Execution {
    plain,     ///< written `virtual`: a drawing aid only; its blocks are sorted among those around it
    atomic,    ///< runs as one block
    enabled,   ///< atomic, and runs while its extra input `enable` is above 0
    triggered, ///< runs once when its extra input `trigger` has an edge
    enabled_and_triggered, ///< runs once at an edge of `trigger` while `enable` is above 0
    for_loop,              ///< written `for`: runs `iterations` times in a step
    while_loop,            ///< written `while`: runs again in the same step while its block `While` says so
    for_each               ///< once for each part of its inputs, with states of its own for each
};

enum class States { held, reset }; ///< on enabling; of loops: at the beginning of each step

/// Which change of a control signal counts: from <= 0 to > 0, back, or both; `level`: every look that finds
/// it above 0.
enum class Edge { rising, falling, either, level };

/// Blocks and their connections, with inputs and outputs to the outside.
struct System {
    Execution execution = Execution::plain;
    States states = States::held;
    Edge trigger = Edge::rising; ///< of triggered subsystems; `level` is written `function_call`
    std::optional<Edge> reset =
        {}; ///< given: an extra input `reset` puts states back to their initial values
    std::optional<Expression> iterations = {}; ///< of `for` (else an extra input) and `for_each`
    std::string icon = {};    ///< a text on its block, or the file of an image, as `Note::image`
    std::vector<Port> inputs; ///< without the control ports, which it may have besides
    std::vector<Port> outputs;
    std::vector<Variable>
        enumerations; ///< each a struct of whole numbers; a field without a value counts on, from 0
    std::vector<Variable> variables; ///< seen by this system and all inside it; each may use those before it
    std::vector<Block> blocks;
    std::vector<Connection> connections;
    std::vector<NamedSignal> signals;

    const Block* find_block(std::string_view block) const;
    Block* find_block(std::string_view block);
    const Port* find_input(std::string_view port) const;
    const Port* find_output(std::string_view port) const;
    const NamedSignal* find_signal(std::string_view signal) const;
    /// Whether a block, a port or a signal has this name.
    bool is_taken(std::string_view name) const;
};

/// Names of the extra inputs that control when a subsystem runs, after its own inputs.
inline constexpr std::string_view enable_port = "enable", trigger_port = "trigger", reset_port = "reset",
                                  iterations_port = "iterations";
std::vector<std::string_view> control_ports(const System& system);

/// A path to signals: `plant.y`, `controller.pd.tau`, `plant` (its only output), `controller.error` (a named
/// signal), `controller.*`.
struct Signal {
    std::string path;
    Comments comments = {};
    Location where = {};
};

/// A panel of the plot that `bf plot` draws.
struct Panel {
    std::string title;
    std::vector<Signal> signals;
    Comments comments = {};
    Location where = {};
};

/// The name of a plugin to load.
struct Plugin {
    std::string name;
    Comments comments = {};
    Location where = {};
};

/// A point of the drawing, or a width and height; x grows to the right, y downwards.
struct Point {
    double x = 0, y = 0;

    bool operator==(const Point&) const = default;
};

enum class Side { left, right, top, bottom };

/// The side of its block on which a port is drawn.
struct PortSide {
    std::string port;
    Side side = Side::left;
};

enum class Rotation { none, quarter, half, three_quarters }; ///< clockwise

/// Where a block, or a subsystem's own port, is drawn: its upper left corner. Ports stand on the sides that
/// `sides` gives them; others have inputs on the left, outputs on the right and control ports at the top,
/// mirrored, then rotated.
struct Placement {
    std::string path; ///< `controller.pd`; `controller.tau` is the port inside of the subsystem
    Point at = {};
    std::optional<Point> size = {}; ///< as the editor likes, if not given
    bool flipped = false;           ///< inputs on the right
    Rotation rotated = Rotation::none;
    std::vector<PortSide> sides = {};
    Comments comments = {};
    Location where = {};
};

/// The corners of a wire, in order, or labels instead of the wire.
struct Bends {
    std::string path; ///< of the end that the wire leads to: `controller.pd.q`
    std::vector<Point> points = {};
    bool as_labels = false; ///< its source and its end have a label each; it has no corners
    Comments comments = {};
    Location where = {};
};

/// A text on the drawing of a subsystem, or an image.
struct Note {
    std::string name = {};
    std::string text = {};
    std::string image = {};  ///< PNG or SVG file, relative to the model's, which the text describes
    std::string system = {}; ///< path of the subsystem; empty: the model itself
    Point at = {};
    std::optional<Point> size = {};
    Comments comments = {};
    Location where = {};
};

enum class Shows { lines, xy, bars, heat_map, numbers, states };

/// A panel of the editor in which runs are watched. It stands for the plot of that title, if there is one.
struct Display {
    std::string name;
    Shows shows = Shows::lines;
    std::vector<Signal> signals = {}; ///< of `xy` the first is what the others are drawn against
    Comments comments = {};
    Location where = {};
};

/// How the model is drawn, and its runs are watched; without meaning for what it computes. Entries of what is
/// not there are allowed, and wires to one input (of variants) share their bends.
struct Layout {
    std::vector<Placement> blocks;
    std::vector<Bends> wires;
    std::vector<Note> notes;
    std::vector<Display> displays = {};
    std::vector<Key> keys = {};

    bool empty() const { return blocks.empty() && wires.empty() && notes.empty() && displays.empty(); }
};

enum class AlgebraicLoops { error, solve };
enum class RateTransitions { allowed, checked, inserted };
enum class NonFinite { allowed, error };

/// A whole document.
struct Model {
    std::string name;
    std::string doc = {};
    System root = {};
    std::optional<Expression> step = {};   ///< base period, s
    std::optional<Expression> stop = {};   ///< duration, s
    std::optional<Expression> solver = {}; ///< of continuous states: a method's name
    std::optional<Expression> relative_tolerance = {}, absolute_tolerance = {}; ///< of adaptive solvers
    std::optional<Expression> max_step = {};                                    ///< of adaptive solvers, s
    AlgebraicLoops algebraic_loops = AlgebraicLoops::error;
    RateTransitions rate_transitions = RateTransitions::allowed;
    NonFinite non_finite = NonFinite::allowed; ///< NaN and infinity in the output of a block
    std::vector<Plugin> plugins = {};
    bool record_all = false;
    std::vector<Signal> record = {};
    std::vector<Panel> plots = {};
    Layout layout = {};
    std::vector<Key> keys = {};
    std::vector<std::string> end = {}; ///< comments after the last item
    Location where = {};
    std::shared_ptr<const std::string> source = {}; ///< the text it was read from, to which places refer
};

/// Whether both say the same in the same order. How a file spells it (places, comments, order of keys, quotes
/// and line breaks of expressions) does not count; referenced models are equal if they are one object or
/// equal themselves.
bool operator==(const Model& a, const Model& b);
bool operator==(const System& a, const System& b);
bool operator==(const Block& a, const Block& b);

} // namespace bf::model
