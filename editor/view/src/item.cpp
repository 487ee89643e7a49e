#include "item.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/edit.hpp"
#include "symbol.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace bf::editor {

namespace {

constexpr double port_gap = 20;
constexpr double widest_port = 110; ///< of the name of a port in a block
constexpr double name_below = 14;   ///< from a block to the base line of its name

std::string sentence(const std::string& text) { return text.substr(0, text.find('\n')); }

double names_width(const std::vector<std::string>& names) {
    double width = 0;
    for (const auto& name : names)
        width = std::max(width, text_width(fitted(name, small_letter, widest_port), small_letter));
    return width;
}

/// The size that the document gives, or this one.
void resize(Item& item, const std::optional<Point>& size, double width, double height) {
    item.box.width = size ? std::clamp(size->x, std::min(width, 20.0), 2000.0) : width;
    item.box.height = size ? std::clamp(size->y, std::min(height, 20.0), 2000.0) : height;
}

void library_symbol(Item& item, const model::Block& block, const DiagramNode* node, std::size_t rows,
                    const std::optional<Point>& size) {
    const SettingText text = [&](const std::string& name) -> std::string {
        if (const model::Setting* setting = block.find_setting(name)) return setting->value.matlab();
        if (!node) return "";
        for (const auto& argument : node->block->declaration().arguments)
            if (argument.name == name && argument.initial.kind == Value::Kind::text)
                return argument.initial.text;
        for (const auto& slot : node->block->declaration().slots)
            if (slot.name == name && slot.role == Role::parameter && slot.initial.size() == 1)
                return number_text(slot.initial[0]);
        return "";
    };
    Symbol symbol = symbol_of(block.type, rows, text);
    resize(item, size, symbol.width, symbol.height);
    // What the symbol shows stands in the middle of a block that was made larger.
    const Point shift{(item.box.width - symbol.width) / 2, (item.box.height - symbol.height) / 2};
    item.element.shapes = outline_shapes(symbol.outline, item.box.width, item.box.height, false);
    for (Shape& shape : symbol.shapes) {
        for (Point& point : shape.points) point = {point.x + shift.x, point.y + shift.y};
        item.element.shapes.push_back(std::move(shape));
    }
    item.is_circle = symbol.outline == Symbol::Outline::circle;
    std::string title = block.name + ", " + last_name(block.type);
    for (const auto& setting : block.settings)
        title += ", " + setting.name + " = " + fitted(setting.value.matlab(), letter, 200);
    item.element.title = title;
}

/// Makes room for the names of ports beside what the symbol shows.
void widen(Item& item, const PortNames& ports) {
    const double inputs = names_width(ports.inputs), outputs = names_width(ports.outputs);
    const double wider =
        std::ceil(std::max(item.box.width, item.box.width - 10 + inputs + outputs + 20) / 10) * 10;
    for (auto& shape : item.element.shapes)
        for (Point& point : shape.points)
            if (shape.style == Style::body)
                point.x = point.x > 0 ? wider : 0;
            else
                point.x += (wider - item.box.width) / 2 + (inputs - outputs) / 2;
    item.box.width = wider;
}

void subsystem_symbol(Item& item, const model::Block& block, const PortNames& ports,
                      const std::optional<Point>& size) {
    const double rows = static_cast<double>(std::max(ports.inputs.size(), ports.outputs.size()));
    resize(item, size,
           std::max({80.0, std::ceil((names_width(ports.inputs) + names_width(ports.outputs) + 34) / 10) * 10,
                     50.0 * static_cast<double>(ports.controls.size())}),
           std::max(50.0, rows * port_gap + 10) + (ports.controls.empty() ? 0 : 12));
    const double w = item.box.width, h = item.box.height;
    item.element.shapes = outline_shapes(Symbol::Outline::rectangle, w, h, false);
    // A second line inside says that there is more inside.
    item.element.shapes.push_back(
        {Shape::Kind::line, Style::symbol, {{3, 3}, {w - 3, 3}, {w - 3, h - 3}, {3, h - 3}, {3, 3}}});
    static const std::map<model::Execution, const char*> kinds = {{model::Execution::for_loop, "for"},
                                                                  {model::Execution::while_loop, "while"},
                                                                  {model::Execution::for_each, "each"}};
    if (const auto kind = kinds.find(block.content() ? block.content()->execution : model::Execution::plain);
        kind != kinds.end())
        item.element.shapes.push_back(
            {Shape::Kind::text, Style::value, {{w / 2, h - 8}}, kind->second, small_letter, Align::middle});
    item.element.title =
        block.name + ", subsystem" + (block.reference ? " in the file " + block.reference->file : "");
}

void add_port_name(Item& item, std::size_t i) {
    const Port& port = item.element.ports[i];
    const Side side = item.box.pins[i].side;
    const bool is_left = side == Side::left, is_top = side == Side::top;
    item.element.shapes.push_back({Shape::Kind::text,
                                   Style::port,
                                   {{port.at.x + (is_left  ? 7
                                                  : is_top ? 0
                                                           : -7),
                                     port.at.y + (is_top ? 13 : 3)}},
                                   fitted(port.name, small_letter, widest_port),
                                   small_letter,
                                   is_top    ? Align::middle
                                   : is_left ? Align::start
                                             : Align::end});
}

void add_pins(Item& item, const PortNames& ports) {
    const auto& [inputs, outputs, controls] = ports;
    const double w = item.box.width, h = item.box.height;
    const double middle = controls.empty() ? h / 2 : h / 2 + 6;
    const double input_x = item.is_flipped ? w : 0, output_x = item.is_flipped ? 0 : w;
    const Side input_side = item.is_flipped ? Side::right : Side::left,
               output_side = item.is_flipped ? Side::left : Side::right;
    const auto add_pin = [&](const std::string& name, bool is_output, Point at, Side side) {
        item.box.pins.push_back({at, side});
        item.element.ports.push_back({name, is_output, false, at, {}});
    };
    const auto row = [&](std::size_t i, std::size_t count) {
        const double gap = std::min(port_gap, (h - 8) / static_cast<double>(count));
        return middle + (static_cast<double>(i) - (static_cast<double>(count) - 1) / 2) * gap;
    };
    const bool is_circle = item.is_circle && inputs.size() == 2;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (is_circle && i == 1)
            add_pin(inputs[i], false, {w / 2, h}, Side::bottom);
        else
            add_pin(inputs[i], false, {input_x, is_circle ? h / 2 : row(i, inputs.size())}, input_side);
    }
    for (std::size_t i = 0; i < outputs.size(); ++i)
        add_pin(outputs[i], true, {output_x, row(i, outputs.size())}, output_side);
    const double columns = static_cast<double>(controls.size()) + 1;
    for (std::size_t i = 0; i < controls.size(); ++i)
        add_pin(controls[i], false, {w * (static_cast<double>(i) + 1) / columns, 0}, Side::top);
    if (item.names_ports)
        for (std::size_t i = 0; i < item.element.ports.size(); ++i) add_port_name(item, i);
}

} // namespace

std::string last_name(const std::string& path) { return model::split_last(path).second; }

Item port_item(const model::Port& port, bool is_output) {
    Item item;
    item.element.kind = is_output ? Element::Kind::output : Element::Kind::input;
    item.element.title = port.name + (is_output ? ", output" : ", input");
    item.element.description = port.doc;
    item.shows_name = false;
    item.box.height = 20;
    item.box.width = std::max(40.0, std::ceil((text_width(port.name, letter) + 20) / 10) * 10);
    item.element.shapes = outline_shapes(Symbol::Outline::pill, item.box.width, item.box.height, false);
    item.element.shapes.push_back(
        {Shape::Kind::text, Style::value, {{item.box.width / 2, 14}}, port.name, letter, Align::middle});
    PortNames ports;
    (is_output ? ports.inputs : ports.outputs).emplace_back();
    add_pins(item, ports);
    return item;
}

Item block_item(const model::Block& block, const DiagramNode* node, const PortNames& ports,
                const std::optional<Point>& size, bool is_flipped) {
    Item item;
    item.is_flipped = is_flipped;
    const std::size_t rows = std::max(ports.inputs.size(), ports.outputs.size());
    if (block.is_subsystem()) {
        item.names_ports = true;
        item.element.kind = Element::Kind::subsystem;
        subsystem_symbol(item, block, ports, size);
    } else {
        library_symbol(item, block, node, rows, size);
        // Of a plugin's blocks nobody knows the ports by heart.
        item.names_ports = block.type.find('/') != std::string::npos && rows > 1;
        if (item.names_ports && !size) widen(item, ports);
    }
    add_pins(item, ports);
    item.element.description = sentence(block.doc.empty() && node ? node->doc : block.doc);
    if (node && node->rate >= 0) item.element.rate = node->rate;
    return item;
}

Element finished(const Item& item) {
    Element element = item.element;
    const double w = item.box.width, h = item.box.height;
    element.bounds = {item.at.x, item.at.y, w, h};
    if (item.is_flipped)
        for (auto& shape : element.shapes)
            if (shape.style != Style::port) // names of ports stand beside pins, which know their side
                for (Point& point : shape.points) point.x = w - point.x;
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
