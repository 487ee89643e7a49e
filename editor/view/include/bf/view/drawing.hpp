// What is drawn of one subsystem: a display list. The editor's page paints it on a canvas, `bf draw` writes
// it as SVG; hit tests, tool tips and what a screen reader says come from the same list.
#pragma once

#include "bf/model/model.hpp"

#include <optional>
#include <string>
#include <vector>

/// Coordinates are pixels at 100 %: x grows to the right, y downwards.
namespace bf::editor {

using model::Point;

struct Rectangle {
    double x = 0, y = 0, width = 0, height = 0;
};

/// What a shape stands for; a theme gives it colours, widths and fonts.
enum class Style {
    body,      ///< a block's outline, filled
    symbol,    ///< a line inside of a block
    value,     ///< text inside of a block
    name,      ///< a block's name, beneath it
    port,      ///< the name of a port inside of a subsystem's block, or a line of its sketch
    open,      ///< a port without a wire
    wire,      ///< a line of a connection
    branch,    ///< the dot where a connection divides
    label,     ///< name, size, type, rate or unit beside a wire
    note,      ///< a text of the document's layout
    highlight, ///< what is wrong: around a block, along a wire
    added,     ///< in a comparison, around or along what the earlier model lacks
    removed,   ///< what the later model lacks
    changed
};

enum class Align { start, middle, end };

struct Shape {
    enum class Kind {
        polygon, ///< closed
        line,    ///< open, straight from point to point
        curve,   ///< cubic Bézier: a point, then three for each piece
        ellipse, ///< in the rectangle of two corners
        text,    ///< one line at a point: of its base line, by `align` its start, middle or end
        image    ///< as large as fits into the rectangle of two corners; its text is the path of the file
    };
    Kind kind = Kind::polygon;
    Style style = Style::body;
    std::vector<Point> points;
    std::string text = {};
    double size = 0; ///< height of letters, of a text
    Align align = Align::start;
};

/// Where a wire may end.
struct Port {
    std::string name; ///< as the block calls it: "u1"
    bool is_output = false;
    bool is_wired = false;
    Point at;
    std::string about = {}; ///< what is known: "3x1 double, rad, every 10 ms"
    int signal = -1;        ///< its number in `Drawing::signals`; -1: it has no wire and is no source
};

/// An entry of `record`, or of a plot, by which a signal is kept.
struct Kept {
    std::string plot = {}; ///< its title; empty: `record`
    std::string entry; ///< as the document has it, "pd.y"; empty: a pattern or `all` means this signal, too
};

/// What wires and ports carry.
struct DrawnSignal {
    std::string path;      ///< that `record` and `plots` may call it by: "controller.pd"
    std::string name = {}; ///< that the model gives it, with its path: "controller.error"
    std::vector<Kept> kept = {};
};

/// What is wrong, with the text of `bf check`.
struct Mark {
    std::string message, remedy;
    std::vector<model::Fix> fixes = {};
};

/// Something that is chosen, moved or read as one.
struct Element {
    enum class Kind {
        block,     ///< of a library
        subsystem, ///< or the file it stands in
        chart,     ///< a state machine, which has states inside
        state,
        input, ///< of the drawn subsystem, seen from inside
        output,
        wire, ///< from one output to one input; in a chart, a transition
        note
    };
    Kind kind = Kind::block;
    /// "controller.pd"; of a wire that of the input it leads to: "controller.pd.q", of a transition the state
    /// that it leads to and the number of its row: "machine.lift.4".
    std::string path;
    std::string from = {}; ///< of a wire, as the document writes its ends: "error", "pd.q"
    std::string to = {};
    std::vector<Point> corners = {}; ///< of a wire: from its output to its input, with both; none of labels
    bool as_labels = false;          ///< of a wire: a label at each end stands for it
    int signal = -1;                 ///< of a wire, its number in `Drawing::signals`
    Rectangle bounds;
    std::vector<Shape> shapes; ///< from the back to the front
    std::vector<Port> ports = {};
    std::string title = {};       ///< what it is, in words: "pd, Gain, K = Gain.Kp"
    std::string description = {}; ///< what the model or the library says of it
    std::string image = {};       ///< of a note, the file of its image as the document writes it
    std::vector<Mark> marks = {};
    std::optional<int> rate = {};  ///< its number in `Drawing::rates`
    std::optional<int> state = {}; ///< of a state its number, of a transition that of the state it leaves
    bool has_inside = false;       ///< of a state: are there states inside, which are drawn by its path?
};

struct Drawing {
    std::string system;            ///< path of the subsystem or state machine, empty for the model itself
    Rectangle bounds;              ///< of all elements
    std::vector<Element> elements; ///< from the back to the front: wires, blocks, notes
    std::vector<DrawnSignal> signals = {};
    std::vector<std::string> rates = {}; ///< "constant", "continuous", "every 10 ms"
    std::string active = {};             ///< of a chart: the signal of its active states
};

} // namespace bf::editor
