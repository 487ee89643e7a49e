#include "item.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"
#include "bf/view/image.hpp"
#include "sketch.hpp"
#include "symbol.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace bf::editor {

namespace {

constexpr double widest_port = 110; ///< of the name of a port in a block
constexpr double name_below = 14;   ///< from a block to the base line of its name
constexpr double sign = 12, sign_in_circle = 11, icon_letter = 12;

std::string sentence(const std::string& text) { return text.substr(0, text.find('\n')); }

/// The side that is `side` of a block which is mirrored, then rotated.
Side turned(Side side, const model::Placement& drawn) {
    static constexpr Side clockwise[] = {Side::top, Side::bottom, Side::right,
                                         Side::left}; // in the order of Side
    if (drawn.flipped && (side == Side::left || side == Side::right))
        side = side == Side::left ? Side::right : Side::left;
    for (int i = 0; i < static_cast<int>(drawn.rotated); ++i) side = clockwise[static_cast<int>(side)];
    return side;
}

bool is_odd(model::Rotation rotation) { return static_cast<int>(rotation) % 2 == 1; }

/// The ports of an item, in the order of inputs, outputs and control ports, each with its side.
struct Pins {
    struct Pin {
        std::string name;
        bool is_output;
        Side side;
    };
    std::vector<Pin> all;

    Pins(const PortNames& ports, const model::Placement& drawn, bool is_circle) {
        const auto add = [&](const std::vector<std::string>& names, bool is_output, Side usual) {
            for (const auto& name : names) {
                // A sum in a circle has its second input from below.
                const bool is_below = is_circle && !is_output && all.size() == 1;
                const auto given = std::ranges::find(drawn.sides, name, &model::PortSide::port);
                all.push_back({name, is_output,
                               given != drawn.sides.end() ? given->side
                                                          : turned(is_below ? Side::bottom : usual, drawn)});
            }
        };
        add(ports.inputs, false, Side::left);
        add(ports.outputs, true, Side::right);
        add(ports.controls, false, Side::top);
    }
    double count(Side side) const { return static_cast<double>(std::ranges::count(all, side, &Pin::side)); }
    /// Of those on the left or the right, or on the top or the bottom, whichever has more.
    double rows() const { return std::max(count(Side::left), count(Side::right)); }
    double columns() const { return std::max(count(Side::top), count(Side::bottom)); }
    double names_width(Side side) const {
        double width = 0;
        for (const auto& pin : all)
            if (pin.side == side)
                width =
                    std::max(width, text_width(fitted(pin.name, small_letter, widest_port), small_letter));
        return width;
    }
};

/// The size that the document gives, or this one.
void resize(Item& item, const model::Placement& drawn, double width, double height) {
    item.box.width = drawn.size ? std::clamp(drawn.size->x, std::min(width, 20.0), 2000.0) : width;
    item.box.height = drawn.size ? std::clamp(drawn.size->y, std::min(height, 20.0), 2000.0) : height;
}

Shape port_text(const Point& at, Side side, const std::string& text, Style style, double size,
                double beside) {
    const bool is_level = side == Side::left || side == Side::right;
    const double x = side == Side::left    ? beside
                     : side == Side::right ? -beside
                                           : 0,
                 y = is_level            ? size / 3
                     : side == Side::top ? beside + 2 * size / 3
                                         : 1 - beside;
    return {Shape::Kind::text,
            style,
            {{at.x + x, at.y + y}},
            text,
            size,
            side == Side::left    ? Align::start
            : side == Side::right ? Align::end
                                  : Align::middle};
}

void add_pins(Item& item, const Pins& pins) {
    const double w = item.box.width, h = item.box.height;
    // Names at the top or at the bottom need room of their own.
    const double names = item.names_ports && item.element.kind == Element::Kind::subsystem ? 6 : 0;
    const double middle =
        h / 2 + (pins.count(Side::top) > 0 ? names : 0) - (pins.count(Side::bottom) > 0 ? names : 0);
    std::map<Side, double> used;
    for (const auto& [name, is_output, side] : pins.all) {
        const double i = used[side]++, count = pins.count(side);
        const double gap = std::min(port_gap, (h - 8) / count);
        const Point at = side == Side::left || side == Side::right
                             ? Point{side == Side::left ? 0 : w, middle + (i - (count - 1) / 2) * gap}
                             : Point{w * (i + 1) / (count + 1), side == Side::top ? 0 : h};
        item.box.pins.push_back({at, side});
        item.element.ports.push_back({name, is_output, false, at, {}});
        if (item.names_ports)
            item.element.shapes.push_back(
                port_text(at, side, fitted(name, small_letter, widest_port), Style::port, small_letter, 7));
    }
}

/// Where a point of a square around the middle comes to lie with the ports.
Point turned(Point p, const model::Placement& drawn) {
    if (drawn.flipped) p.x = -p.x;
    for (int i = 0; i < static_cast<int>(drawn.rotated); ++i) p = {-p.y, p.x};
    return p;
}

/// Makes room for the names of ports beside what the symbol shows.
void widen(Item& item, const Pins& pins) {
    const double left = pins.names_width(Side::left), right = pins.names_width(Side::right);
    const double wider = std::ceil((item.box.width + left + right + 10) / 10) * 10;
    for (auto& shape : item.element.shapes)
        for (Point& point : shape.points)
            if (shape.style == Style::body)
                point.x = point.x > 0 ? wider : 0;
            else
                point.x += (wider - item.box.width) / 2 + (left - right) / 2;
    item.box.width = wider;
}

/// "2", "[1 0.5]"
std::string row_text(const std::vector<double>& row) {
    std::string text;
    for (const double x : row) text += (text.empty() ? "" : " ") + number_text(x);
    return row.size() == 1 ? text : "[" + text + "]";
}

void library_symbol(Item& item, const model::Block& block, const DiagramNode* node, const PortNames& ports,
                    const model::Placement& drawn) {
    const SettingText text = [&](const std::string& name) -> std::string {
        if (const model::Setting* setting = block.find_setting(name)) return setting->value.matlab();
        if (!node) return "";
        for (const auto& argument : node->block->declaration().arguments)
            if (argument.name == name) {
                if (argument.initial.kind == Value::Kind::text) return argument.initial.text;
                return argument.initial.rows == 1 ? row_text(argument.initial.data) : "";
            }
        for (const auto& slot : node->block->declaration().slots)
            if (slot.name == name && slot.role == Role::parameter && slot.initial.size() == 1)
                return number_text(slot.initial[0]);
        return "";
    };
    Symbol symbol = symbol_of(block.type, std::max(ports.inputs.size(), ports.outputs.size()), text);
    item.is_circle = symbol.outline == Symbol::Outline::circle;
    const Pins pins(ports, drawn, item.is_circle && ports.inputs.size() == 2);
    const Point natural{symbol.width, symbol.height};
    if (is_odd(drawn.rotated) && (symbol.outline == Symbol::Outline::bar || !symbol.signs.empty()))
        std::swap(symbol.width, symbol.height);
    const bool is_tight = item.is_circle || symbol.outline == Symbol::Outline::bar;
    resize(item, drawn, is_tight ? symbol.width : std::max(symbol.width, pins.columns() * port_gap + 10),
           is_tight ? symbol.height : std::max(symbol.height, pins.rows() * port_gap + 10));
    const double w = item.box.width, h = item.box.height;
    item.element.shapes = outline_shapes(symbol.outline, w, h, turned(Side::right, drawn));
    // What the symbol shows stands in the middle of a block that was made larger, and where its outline is
    // wide.
    const Point wide = turned(symbol.middle, drawn);
    for (Shape& shape : symbol.shapes) {
        for (Point& point : shape.points) {
            Point from{point.x - natural.x / 2 - symbol.middle.x, point.y - natural.y / 2 - symbol.middle.y};
            if (symbol.follows_signals && shape.kind != Shape::Kind::text) from = turned(from, drawn);
            point = {w / 2 + wide.x + from.x, h / 2 + wide.y + from.y};
        }
        item.element.shapes.push_back(std::move(shape));
    }
    // Of a plugin's blocks nobody knows the ports by heart.
    item.names_ports =
        block.type.find('/') != std::string::npos && ports.inputs.size() + ports.outputs.size() > 2;
    if (item.names_ports && !drawn.size) widen(item, pins);
    add_pins(item, pins);
    for (std::size_t i = 0; i < std::min(symbol.signs.size(), ports.inputs.size()); ++i)
        item.element.shapes.push_back(port_text(item.box.pins[i].at, item.box.pins[i].side, symbol.signs[i],
                                                Style::value, item.is_circle ? sign_in_circle : sign, 5));
    std::string title = block.name + ", " + last_name(block.type);
    for (const auto& setting : block.settings)
        title += ", " + setting.name + " = " + fitted(setting.value.matlab(), letter, 200);
    item.element.title = title;
}

double icon_width(const std::string& icon) {
    constexpr double widest = 120, image = 60;
    if (!image_type(icon).empty()) return image;
    double width = 0;
    std::istringstream all(icon);
    for (std::string line; std::getline(all, line);) width = std::max(width, text_width(line, icon_letter));
    return std::min(width, widest);
}

/// Between the names of the ports a text or an image (its file as the document writes it), else a sketch of
/// what is inside.
void add_icon(Item& item, const model::System& content, const Pins& pins) {
    const double beside = 11, left = pins.names_width(Side::left) + beside,
                 top = pins.count(Side::top) > 0 ? 18 : beside,
                 right = item.box.width - pins.names_width(Side::right) - beside,
                 bottom = item.box.height - (pins.count(Side::bottom) > 0 ? 18 : beside);
    const std::string& icon = content.icon;
    if (icon.empty()) {
        const auto sketch = sketch_of(content, {left, top, right - left, bottom - top});
        item.element.shapes.insert(item.element.shapes.end(), sketch.begin(), sketch.end());
        return;
    }
    if (!image_type(icon).empty()) {
        item.element.shapes.push_back(
            {Shape::Kind::image, Style::symbol, {{left, top}, {right, bottom}}, icon});
        return;
    }
    std::istringstream all(icon);
    std::vector<std::string> lines;
    for (std::string line; std::getline(all, line);) lines.push_back(fitted(line, icon_letter, right - left));
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const double below =
            (static_cast<double>(i) - static_cast<double>(lines.size()) / 2 + 0.76) * 1.3 * icon_letter;
        item.element.shapes.push_back({Shape::Kind::text,
                                       Style::value,
                                       {{(left + right) / 2, (top + bottom) / 2 + below}},
                                       lines[i],
                                       icon_letter,
                                       Align::middle});
    }
}

void subsystem_symbol(Item& item, const model::Block& block, const PortNames& ports,
                      const model::Placement& drawn) {
    const Pins pins(ports, drawn, false);
    item.names_ports = true;
    const double middle = std::max(18.0, icon_width(block.content() ? block.content()->icon : ""));
    resize(item, drawn,
           std::max(
               {80.0,
                std::ceil((pins.names_width(Side::left) + pins.names_width(Side::right) + middle + 16) / 10) *
                    10,
                50.0 * pins.columns()}),
           std::max(50.0, pins.rows() * port_gap + 10) + 12 * (pins.count(Side::top) > 0) +
               12 * (pins.count(Side::bottom) > 0));
    const double w = item.box.width, h = item.box.height;
    item.element.shapes = outline_shapes(Symbol::Outline::rectangle, w, h, Side::right);
    // A second line inside says that there is more inside.
    item.element.shapes.push_back(
        {Shape::Kind::line, Style::symbol, {{3, 3}, {w - 3, 3}, {w - 3, h - 3}, {3, h - 3}, {3, 3}}});
    if (block.content()) add_icon(item, *block.content(), pins);
    static const std::map<model::Execution, const char*> kinds = {{model::Execution::for_loop, "for"},
                                                                  {model::Execution::while_loop, "while"},
                                                                  {model::Execution::for_each, "each"}};
    if (const auto kind = kinds.find(block.content() ? block.content()->execution : model::Execution::plain);
        kind != kinds.end())
        item.element.shapes.push_back(
            {Shape::Kind::text, Style::value, {{w / 2, h - 8}}, kind->second, small_letter, Align::middle});
    item.element.title =
        block.name + ", subsystem" + (block.reference ? " in the file " + block.reference->file : "");
    add_pins(item, pins);
}

} // namespace

std::string last_name(const std::string& path) { return model::split_last(path).second; }

Item port_item(const model::Port& port, bool is_output, const model::Placement& drawn) {
    Item item;
    item.element.kind = is_output ? Element::Kind::output : Element::Kind::input;
    item.element.title = port.name + (is_output ? ", output" : ", input");
    item.element.description = port.doc;
    item.shows_name = false;
    item.box.height = 20;
    item.box.width = std::max(40.0, std::ceil((text_width(port.name, letter) + 20) / 10) * 10);
    item.element.shapes = outline_shapes(Symbol::Outline::pill, item.box.width, item.box.height, Side::right);
    item.element.shapes.push_back(
        {Shape::Kind::text, Style::value, {{item.box.width / 2, 14}}, port.name, letter, Align::middle});
    PortNames ports;
    (is_output ? ports.inputs : ports.outputs).emplace_back();
    add_pins(item, Pins(ports, drawn, false));
    return item;
}

namespace {

/// Harel's marks: two states for states inside, a line between regions, H for a history, a second outline
/// for a final state, a dot for a junction.
void mark_kind(std::vector<Shape>& shapes, StateKind kind, double w, double h) {
    const auto box = [&](double x, double y, double width, double height) {
        shapes.push_back({Shape::Kind::line,
                          Style::symbol,
                          {{x, y}, {x + width, y}, {x + width, y + height}, {x, y + height}, {x, y}}});
    };
    switch (kind) {
    case StateKind::with_states:
        box(w - 24, h - 11, 7, 5);
        box(w - 13, h - 11, 7, 5);
        shapes.push_back({Shape::Kind::line, Style::symbol, {{w - 17, h - 8.5}, {w - 13, h - 8.5}}});
        break;
    case StateKind::with_regions:
        box(w - 20, h - 12, 14, 7);
        shapes.push_back({Shape::Kind::line, Style::symbol, {{w - 13, h - 12}, {w - 13, h - 5}}});
        break;
    case StateKind::shallow_history:
    case StateKind::deep_history:
        shapes.push_back({Shape::Kind::ellipse, Style::symbol, {{w - 19, 4}, {w - 5, 18}}});
        shapes.push_back({Shape::Kind::text,
                          Style::value,
                          {{w - 12, 14}},
                          kind == StateKind::deep_history ? "H*" : "H",
                          small_letter,
                          Align::middle});
        break;
    case StateKind::final: box(5, 5, w - 10, h - 10); break;
    case StateKind::junction:
        shapes.push_back({Shape::Kind::ellipse, Style::branch, {{w - 13, 6}, {w - 7, 12}}});
        break;
    case StateKind::plain: break;
    }
}

} // namespace

Item state_item(const std::string& name, StateKind kind, bool is_initial, std::size_t inputs,
                std::size_t outputs, const model::Placement& drawn) {
    constexpr const char* words[] = {
        "state",   "state with states inside", "state with regions", "final state", "history", "deep history",
        "junction"};
    Item item;
    item.element.kind = Element::Kind::state;
    item.element.has_inside = kind == StateKind::with_states || kind == StateKind::with_regions;
    item.element.title = name + (is_initial ? ", first " : ", ") + words[static_cast<int>(kind)];
    item.shows_name = false;
    const Pins pins({std::vector<std::string>(inputs), std::vector<std::string>(outputs), {}}, drawn, false);
    // Whatever transitions it has, so that it stays where it is while they are drawn.
    const double room = kind == StateKind::plain ? 30 : 50; // beside the name
    resize(item, drawn, std::max(60.0, std::ceil((text_width(name, letter) + room) / 10) * 10), 50);
    const double w = item.box.width, h = item.box.height;
    item.element.shapes = outline_shapes(Symbol::Outline::rounded, w, h, Side::right);
    mark_kind(item.element.shapes, kind, w, h);
    item.element.shapes.push_back(
        {Shape::Kind::text, Style::value, {{w / 2, h / 2 + 4}}, name, letter, Align::middle});
    if (is_initial) { // a dot with an arrow
        constexpr double x = 15, r = 3, above = 18;
        item.element.shapes.push_back({Shape::Kind::line, Style::symbol, {{x, -above + r}, {x, 0}}});
        item.element.shapes.push_back(
            {Shape::Kind::ellipse, Style::branch, {{x - r, -above}, {x + r, -above + 2 * r}}});
        item.element.shapes.push_back(
            {Shape::Kind::polygon, Style::branch, {{x, 0}, {x - 3, -7}, {x + 3, -7}}});
    }
    add_pins(item, pins);
    item.element.ports = {{"to", false, false, {0, h / 2}, {}}, {"from", true, false, {w, h / 2}, {}}};
    return item;
}

Item block_item(const model::Block& block, const DiagramNode* node, const PortNames& ports,
                const model::Placement& drawn) {
    Item item;
    if (block.is_subsystem()) {
        item.element.kind = Element::Kind::subsystem;
        subsystem_symbol(item, block, ports, drawn);
    } else {
        if (model::has_chart(block)) item.element.kind = Element::Kind::chart;
        library_symbol(item, block, node, ports, drawn);
    }
    item.element.description = sentence(block.doc.empty() && node ? node->doc : block.doc);
    if (node && node->rate >= 0) item.element.rate = node->rate;
    return item;
}

Element finished(const Item& item) {
    Element element = item.element;
    const double w = item.box.width, h = item.box.height;
    element.bounds = {item.at.x, item.at.y, w, h};
    if (item.shows_name) { // above a circle, where no wire comes in
        const Point at{w / 2, item.is_circle ? -5 : h + name_below};
        element.shapes.push_back({Shape::Kind::text,
                                  Style::name,
                                  {at},
                                  fitted(last_name(element.path), letter, std::max(w + 60, 110.0)),
                                  letter,
                                  Align::middle});
    }
    for (auto& shape : element.shapes)
        for (Point& point : shape.points) point = {point.x + item.at.x, point.y + item.at.y};
    for (auto& port : element.ports) port.at = {port.at.x + item.at.x, port.at.y + item.at.y};
    return element;
}

Element noted(const model::Note& note, const Point& at) {
    Element element;
    element.kind = Element::Kind::note;
    element.path = note.name;
    element.title = "note: " + note.text;
    if (!note.image.empty()) {
        const Point size = note.size.value_or(Point{160, 120});
        element.title = "image: " + note.text;
        element.image = note.image;
        element.bounds = {at.x, at.y, size.x, size.y};
        element.shapes = {
            {Shape::Kind::image, Style::note, {at, {at.x + size.x, at.y + size.y}}, note.image}};
        return element;
    }
    constexpr double line_height = 16;
    double width = 0, y = at.y;
    for (std::size_t begin = 0; begin <= note.text.size();) {
        const std::size_t end = std::min(note.text.find('\n', begin), note.text.size());
        const std::string line = note.text.substr(begin, end - begin);
        y += line_height;
        element.shapes.push_back(
            {Shape::Kind::text, Style::note, {{at.x, y - 4}}, line, letter + 1, Align::start});
        width = std::max(width, text_width(line, letter + 1));
        begin = end + 1;
    }
    element.bounds = {at.x, at.y, width, y - at.y};
    return element;
}

} // namespace bf::editor
