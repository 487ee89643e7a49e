#include "bf/view/draw.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/edit.hpp"
#include "bf/view/place.hpp"
#include "symbol.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

namespace bf::editor {

namespace {

constexpr double letter = 11, small_letter = 9;
constexpr double port_gap = 20;
constexpr double widest_port = 110; ///< of the name of a port in a block
constexpr double name_below = 14;   ///< from a block to the base line of its name

std::string joined(const std::string& system, const std::string& name) {
    return system.empty() ? name : system + "." + name;
}

std::string last_name(const std::string& path) { return path.substr(path.rfind('.') + 1); }

std::string rate_text(const Diagram& diagram, int rate) {
    if (rate == constant_rate) return "constant";
    const SampleRate& r = diagram.rates[static_cast<std::size_t>(rate)];
    if (r.is_continuous) return "continuous";
    if (r.trigger > 0) return "by " + diagram.conditions[static_cast<std::size_t>(r.trigger)].path;
    const double period = diagram.period(rate);
    return "every " +
           (period < 1 ? number_text(std::round(period * 1e9) / 1e6) + " ms" : number_text(period) + " s");
}

std::string sentence(const std::string& text) { return text.substr(0, text.find('\n')); }

Rectangle around(const std::vector<Point>& points) {
    const auto [left, right] = std::ranges::minmax(points, {}, &Point::x);
    const auto [top, bottom] = std::ranges::minmax(points, {}, &Point::y);
    return {left.x, top.y, right.x - left.x, bottom.y - top.y};
}

Rectangle together(const Rectangle& a, const Rectangle& b) {
    const double x = std::min(a.x, b.x), y = std::min(a.y, b.y);
    return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

/// A block or an own port of the subsystem, on its way to an element: shapes and ports from its upper left
/// corner.
struct Item {
    Element element;
    Box box;
    Point at;
    bool is_placed = false, is_flipped = false, shows_name = true, is_circle = false, names_ports = false;
};

/// A wire that leaves another one of its net is drawn from there on.
std::vector<Point> own_part(const Route& way) {
    if (way.branches.empty()) return way.points;
    const Point leaves = way.branches.back();
    for (std::size_t i = way.points.size(); i-- > 1;) {
        const Rectangle piece = around({way.points[i - 1], way.points[i]});
        const bool is_on = leaves.x >= piece.x - 0.1 && leaves.x <= piece.x + piece.width + 0.1 &&
                           leaves.y >= piece.y - 0.1 && leaves.y <= piece.y + piece.height + 0.1;
        if (!is_on) continue;
        std::vector<Point> points{leaves};
        points.insert(points.end(), way.points.begin() + static_cast<std::ptrdiff_t>(i), way.points.end());
        return points;
    }
    return way.points;
}

/// Where the content of a subsystem stands: the file, which has the positions, and the path there.
struct Place {
    const model::System* system;
    const model::Layout* layout;
    std::string path;
};

Place find_place(const model::Model& model, const std::string& path) {
    Place place{&model.root, &model.layout, ""};
    std::string rest = path, here;
    while (!rest.empty()) {
        const std::string name = rest.substr(0, rest.find('.'));
        rest.erase(0, name.size() + 1);
        here = joined(here, name);
        const model::Block* block = place.system->find_block(name);
        place.system = block ? block->content() : nullptr;
        if (!place.system)
            throw model::Errors(
                {{{}, here, "there is no subsystem of that path", "look at the model's blocks"}});
        place.path = joined(place.path, name);
        if (block->reference && block->reference->model) {
            place.layout = &block->reference->model->layout;
            place.path = "";
        }
    }
    return place;
}

class Drawer {
  public:
    Drawer(const model::Model& model, const std::string& system, const Diagram& diagram)
        : place_(find_place(model, system)), path_(system), diagram_(diagram), signals_(diagram) {
        for (std::size_t i = 0; i < diagram.nodes.size(); ++i)
            nodes_[diagram.nodes[i].path] = &diagram.nodes[i];
        for (const auto& port : place_.system->inputs) add_port(port, false);
        for (const auto& block : place_.system->blocks) add_block(block);
        for (const auto& port : place_.system->outputs) add_port(port, true);
        join();
    }

    /// The corners that arrangement gives all of them.
    std::vector<Point> arrangement() const { return arrange(boxes(), nets_); }
    const std::vector<Item>& items() const { return items_; }

    /// Those without a place are arranged together, below those that have one.
    void put() {
        for (auto& item : items_) {
            const auto placed =
                std::ranges::find(place_.layout->blocks, joined(place_.path, last_name(item.element.path)),
                                  &model::Placement::path);
            if (placed == place_.layout->blocks.end()) continue;
            item.at = placed->at;
            item.is_placed = true;
        }
        if (std::ranges::all_of(items_, &Item::is_placed)) return;
        const std::vector<Point> corners = arrangement();
        double below = 0, left = 0, top = 0;
        bool has_placed = false, has_other = false;
        for (std::size_t i = 0; i < items_.size(); ++i) {
            const Item& item = items_[i];
            if (item.is_placed) {
                below = std::max(has_placed ? below : item.at.y, item.at.y + item.box.height + 60);
                left = has_placed ? std::min(left, item.at.x) : item.at.x;
                has_placed = true;
            } else {
                top = has_other ? std::min(top, corners[i].y) : corners[i].y;
                has_other = true;
            }
        }
        for (std::size_t i = 0; i < items_.size(); ++i)
            if (!items_[i].is_placed)
                items_[i].at =
                    has_placed ? Point{corners[i].x + left, corners[i].y - top + below} : corners[i];
    }

    Drawing draw(const std::vector<model::Diagnostic>& diagnostics, const DrawOptions& options) {
        put();
        for (auto& item : items_)
            if (const auto moved = options.moved.find(item.element.path); moved != options.moved.end())
                item.at = moved->second;
        Drawing drawing;
        drawing.system = path_;
        for (std::size_t rate = 0; rate < diagram_.rates.size(); ++rate)
            drawing.rates.push_back(rate_text(diagram_, static_cast<int>(rate)));
        add_wires(drawing, options);
        for (const Item& item : items_) drawing.elements.push_back(finished(item));
        for (const auto& note : place_.layout->notes)
            if (note.system == place_.path) drawing.elements.push_back(noted(note));
        mark(drawing, diagnostics);
        for (const auto& element : drawing.elements)
            drawing.bounds = &element == drawing.elements.data() ? element.bounds
                                                                 : together(drawing.bounds, element.bounds);
        return drawing;
    }

  private:
    // ---- blocks and ports ----

    void add_port(const model::Port& port, bool is_output) {
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
        add_pins(item, is_output ? std::vector<std::string>{""} : std::vector<std::string>{},
                 is_output ? std::vector<std::string>{} : std::vector<std::string>{""}, {});
        if (!is_output)
            for (const auto& input : diagram_.inputs)
                if (path_.empty() && input.path == port.name) item.element.ports[0].about = about(input.end);
        add(std::move(item), port.name, is_output ? "output " : "input ");
    }

    void add_block(const model::Block& block) {
        Item item;
        const std::string path = joined(path_, block.name);
        const auto found = nodes_.find(path);
        const DiagramNode* node =
            found != nodes_.end() && found->second->type == block.type ? found->second : nullptr;
        std::vector<std::string> inputs, outputs, controls;
        if (const model::System* content = block.content()) {
            for (const auto& port : content->inputs) inputs.push_back(port.name);
            for (const auto& port : content->outputs) outputs.push_back(port.name);
            for (const auto name : model::control_ports(*content)) controls.emplace_back(name);
        } else if (node) {
            for (const auto& slot : node->block->declaration().slots) {
                if (slot.role == Role::input) inputs.push_back(slot.name);
                if (slot.role == Role::output) outputs.push_back(slot.name);
            }
        }
        if (!node && !block.content()) guess_ports(block.name, inputs, outputs);

        const auto placed = std::ranges::find(place_.layout->blocks, joined(place_.path, block.name),
                                              &model::Placement::path);
        if (block.is_subsystem()) {
            item.names_ports = true;
            item.element.kind = Element::Kind::subsystem;
            subsystem_symbol(item, block, inputs, outputs, controls);
        } else {
            library_symbol(item, block, node, std::max(inputs.size(), outputs.size()));
            // Of a plugin's blocks nobody knows the ports by heart.
            if (block.type.find('/') != std::string::npos && std::max(inputs.size(), outputs.size()) > 1) {
                item.names_ports = true;
                const double middle = item.box.width - 10,
                             w = middle + names_width(inputs) + names_width(outputs) + 20;
                const double wider = std::ceil(std::max(item.box.width, w) / 10) * 10;
                if (placed == place_.layout->blocks.end() || !placed->size) {
                    for (auto& shape : item.element.shapes)
                        for (Point& point : shape.points)
                            if (shape.style == Style::body)
                                point.x = point.x > 0 ? wider : 0;
                            else
                                point.x += (wider - item.box.width) / 2 +
                                           (names_width(inputs) - names_width(outputs)) / 2;
                    item.box.width = wider;
                }
            }
        }
        if (placed != place_.layout->blocks.end()) item.is_flipped = placed->flipped;
        add_pins(item, inputs, outputs, controls);
        item.element.description = sentence(block.doc.empty() && node ? node->doc : block.doc);
        if (node && node->rate >= 0) item.element.rate = node->rate;
        for (auto& port : item.element.ports)
            if (port.is_output) port.about = about(signals_.find(joined(path, port.name)));
        add(std::move(item), block.name, "");
    }

    /// Of a block that cannot be made the connections say what ports it has.
    void guess_ports(const std::string& block, std::vector<std::string>& inputs,
                     std::vector<std::string>& outputs) const {
        const auto note = [&](const model::Endpoint& end, std::vector<std::string>& ports) {
            if (end.block == block && std::ranges::find(ports, end.port) == ports.end())
                ports.push_back(end.port);
        };
        for (const auto& connection : place_.system->connections) {
            note(connection.from, outputs);
            for (const auto& to : connection.to) note(to, inputs);
        }
    }

    void library_symbol(Item& item, const model::Block& block, const DiagramNode* node, std::size_t rows) {
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
        resize(item, block, symbol.width, symbol.height);
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

    static double names_width(const std::vector<std::string>& names) {
        double width = 0;
        for (const auto& name : names)
            width = std::max(width, text_width(fitted(name, small_letter, widest_port), small_letter));
        return width;
    }

    void subsystem_symbol(Item& item, const model::Block& block, const std::vector<std::string>& inputs,
                          const std::vector<std::string>& outputs, const std::vector<std::string>& controls) {
        const double left = names_width(inputs), right = names_width(outputs);
        const double rows = static_cast<double>(std::max(inputs.size(), outputs.size()));
        const double top = controls.empty() ? 0 : 12;
        resize(item, block,
               std::max({80.0, std::ceil((left + right + 34) / 10) * 10,
                         50.0 * static_cast<double>(controls.size())}),
               std::max(50.0, rows * port_gap + 10) + top);
        const double w = item.box.width, h = item.box.height;
        item.element.shapes = outline_shapes(Symbol::Outline::rectangle, w, h, false);
        // A second line inside says that there is more inside.
        item.element.shapes.push_back(
            {Shape::Kind::line, Style::symbol, {{3, 3}, {w - 3, 3}, {w - 3, h - 3}, {3, h - 3}, {3, 3}}});
        static const std::map<model::Execution, const char*> kinds = {{model::Execution::for_loop, "for"},
                                                                      {model::Execution::while_loop, "while"},
                                                                      {model::Execution::for_each, "each"}};
        if (const auto kind =
                kinds.find(block.content() ? block.content()->execution : model::Execution::plain);
            kind != kinds.end())
            item.element.shapes.push_back({Shape::Kind::text,
                                           Style::value,
                                           {{w / 2, h - 8}},
                                           kind->second,
                                           small_letter,
                                           Align::middle});
        item.element.title =
            block.name + ", subsystem" + (block.reference ? " in the file " + block.reference->file : "");
    }

    /// The size that the document gives, or this one.
    void resize(Item& item, const model::Block& block, double width, double height) const {
        item.box.width = width;
        item.box.height = height;
        const auto placed = std::ranges::find(place_.layout->blocks, joined(place_.path, block.name),
                                              &model::Placement::path);
        if (placed == place_.layout->blocks.end() || !placed->size) return;
        item.box.width = std::clamp(placed->size->x, std::min(width, 20.0), 2000.0);
        item.box.height = std::clamp(placed->size->y, std::min(height, 20.0), 2000.0);
    }

    void add_pins(Item& item, const std::vector<std::string>& inputs, const std::vector<std::string>& outputs,
                  const std::vector<std::string>& controls) {
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
        for (std::size_t i = 0; i < controls.size(); ++i)
            add_pin(controls[i], false,
                    {w * (static_cast<double>(i) + 1) / (static_cast<double>(controls.size()) + 1), 0},
                    Side::top);
        if (item.names_ports)
            for (std::size_t i = 0; i < item.element.ports.size(); ++i) add_port_name(item, i);
    }

    static void add_port_name(Item& item, std::size_t i) {
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

    void add(Item item, const std::string& name, const std::string& kind) {
        item.element.path = joined(path_, name);
        index_[kind + name] = items_.size();
        items_.push_back(std::move(item));
    }

    // ---- wires ----

    std::optional<PinOf> pin(const model::Endpoint& end, bool is_output) const {
        const bool is_own = end.block.empty();
        const auto found = index_.find(is_own ? (is_output ? "input " : "output ") + end.port : end.block);
        if (found == index_.end()) return {};
        const auto& ports = items_[found->second].element.ports;
        for (std::size_t i = 0; i < ports.size(); ++i)
            if (ports[i].is_output == is_output && (is_own || end.port.empty() || ports[i].name == end.port))
                return PinOf{found->second, i};
        return {};
    }

    /// Finds the pins of all connections. A wire to or from what is not there is not drawn; its diagnostic
    /// says so.
    void join() {
        for (const auto& connection : place_.system->connections) {
            const auto from = pin(connection.from, true);
            if (!from) continue;
            Net net{*from, {}};
            Ends ends{connection.from.text(), {}, {}};
            for (const auto& to : connection.to) {
                const auto target = pin(to, false);
                if (!target) continue;
                net.to.push_back(*target);
                ends.to.push_back(to.text());
                const auto bends = std::ranges::find(place_.layout->wires, joined(place_.path, to.text()),
                                                     &model::Bends::path);
                ends.bends.push_back(bends == place_.layout->wires.end() ? std::vector<Point>()
                                                                         : bends->points);
                Port& input = port(*target);
                input.is_wired = port(*from).is_wired = true;
                input.about = port(*from).about;
            }
            nets_.push_back(std::move(net));
            ends_.push_back(std::move(ends));
        }
    }

    Port& port(const PinOf& pin) { return items_[pin.box].element.ports[pin.pin]; }

    std::vector<Box> boxes() const {
        std::vector<Box> all;
        for (const auto& item : items_) all.push_back(item.box);
        return all;
    }

    void add_wires(Drawing& drawing, const DrawOptions& options) {
        std::vector<Point> corners;
        for (const auto& item : items_) corners.push_back(item.at);
        std::vector<std::vector<std::vector<Point>>> bends;
        for (const auto& ends : ends_) bends.push_back(ends.bends);
        const auto routes = route(boxes(), corners, nets_, bends);
        for (std::size_t n = 0; n < nets_.size(); ++n) {
            const std::string text = label(nets_[n].from, options);
            for (std::size_t t = 0; t < nets_[n].to.size(); ++t) {
                const Route& way = routes[n][t];
                Element wire;
                wire.kind = Element::Kind::wire;
                wire.from = ends_[n].from;
                wire.to = ends_[n].to[t];
                wire.path = joined(path_, wire.to);
                wire.title = "wire from " + wire.from + " to " + wire.to;
                wire.description = port(nets_[n].from).about;
                wire.rate = items_[nets_[n].from.box].element.rate;
                wire.bounds = around(way.points);
                wire.shapes.push_back({Shape::Kind::line, Style::wire, own_part(way)});
                for (const Point& b : way.branches)
                    wire.shapes.push_back(
                        {Shape::Kind::ellipse, Style::branch, {{b.x - 3, b.y - 3}, {b.x + 3, b.y + 3}}});
                const double room = way.points.size() > 1
                                        ? std::max(40.0, std::abs(way.points[1].x - way.points[0].x) - 8)
                                        : 0;
                if (t == 0 && !text.empty())
                    wire.shapes.push_back({Shape::Kind::text,
                                           Style::label,
                                           {{way.points[0].x + 4, way.points[0].y - 4}},
                                           fitted(text, small_letter, room),
                                           small_letter,
                                           Align::start});
                drawing.elements.push_back(std::move(wire));
            }
        }
    }

    // ---- what elaboration knows ----

    const Slot* slot(const Node::End& end) const { return end.node < 0 ? nullptr : &diagram_.slot(end); }

    /// Empty where the wiring has decided none.
    static std::string unit_text(const Slot& slot) {
        const std::string unit(slot.unit.text);
        return unit == "any" || unit == "mixed" || unit == "1" ? "" : unit;
    }

    std::string about(const Node::End& end) const {
        const Slot* const s = slot(end);
        if (!s) return "";
        std::string text;
        if (s->size_known) text = s->size.text() == "1" ? "scalar" : s->size.text();
        if (s->type_known) text += (text.empty() ? "" : " ") + std::string(name(s->type));
        if (const std::string unit = unit_text(*s); !unit.empty()) text += (text.empty() ? "" : ", ") + unit;
        const int rate = diagram_.nodes[static_cast<std::size_t>(end.node)].rate;
        if (rate >= 0) text += (text.empty() ? "" : ", ") + rate_text(diagram_, rate);
        return text;
    }

    std::string label(const PinOf& from, const DrawOptions& options) const {
        const Element& element = items_[from.box].element;
        const std::string& port = element.ports[from.pin].name;
        const Node::End end = signals_.find(port.empty() ? element.path : joined(element.path, port));
        const Slot* const s = slot(end);
        if (!s) return "";
        std::string text;
        const auto add = [&](const std::string& part) {
            text += (text.empty() || part.empty() ? "" : " ") + part;
        };
        if (options.sizes && s->size_known) add(s->size.text());
        if (options.types && s->type_known) add(name(s->type));
        if (options.units) add(unit_text(*s));
        const int rate = diagram_.nodes[static_cast<std::size_t>(end.node)].rate;
        if (options.rates && rate >= 0) add(rate_text(diagram_, rate));
        return text;
    }

    // ---- elements ----

    static Element finished(const Item& item) {
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

    static Element noted(const model::Note& note) {
        Element element;
        element.kind = Element::Kind::note;
        element.path = note.name;
        element.title = "note: " + note.text;
        constexpr double line_height = 16;
        double width = 0, y = note.at.y;
        for (std::size_t begin = 0; begin <= note.text.size();) {
            const std::size_t end = std::min(note.text.find('\n', begin), note.text.size());
            const std::string line = note.text.substr(begin, end - begin);
            y += line_height;
            element.shapes.push_back(
                {Shape::Kind::text, Style::note, {{note.at.x, y - 4}}, line, letter + 1, Align::start});
            width = std::max(width, text_width(line, letter + 1));
            begin = end + 1;
        }
        element.bounds = {note.at.x, note.at.y, width, y - note.at.y};
        return element;
    }

    /// Marks what a diagnostic concerns: a block, an own port or a wire, and the subsystem in which it
    /// stands.
    static void mark(Drawing& drawing, const std::vector<model::Diagnostic>& diagnostics) {
        std::unordered_map<std::string, std::vector<const model::Diagnostic*>> by_path;
        for (const auto& d : diagnostics)
            for (std::string path = d.path; !path.empty();) {
                by_path[path].push_back(&d);
                const auto dot = path.rfind('.');
                path.erase(dot == path.npos ? 0 : dot);
            }
        for (auto& element : drawing.elements) {
            const auto found = by_path.find(element.path);
            if (found == by_path.end()) continue;
            for (const auto* d : found->second) element.marks.push_back({d->message, d->remedy});
            if (element.kind == Element::Kind::wire) {
                element.shapes[0].style = Style::highlight;
            } else {
                const Rectangle& r = element.bounds;
                element.shapes.push_back({Shape::Kind::polygon,
                                          Style::highlight,
                                          {{r.x - 4, r.y - 4},
                                           {r.x + r.width + 4, r.y - 4},
                                           {r.x + r.width + 4, r.y + r.height + 4},
                                           {r.x - 4, r.y + r.height + 4}}});
            }
        }
    }

    struct Ends {
        std::string from;
        std::vector<std::string> to;
        std::vector<std::vector<Point>> bends;
    };

    const Place place_;
    const std::string path_;
    const Diagram& diagram_;
    const SignalFinder signals_;
    std::unordered_map<std::string, const DiagramNode*> nodes_; ///< by path
    std::vector<Item> items_;
    std::unordered_map<std::string, std::size_t> index_; ///< "gain", "input reference", "output tau"
    std::vector<Net> nets_;
    std::vector<Ends> ends_; ///< as the document writes those of each net
};

} // namespace

Drawing draw(const model::Model& model, const std::string& system, const Diagram& diagram,
             const std::vector<model::Diagnostic>& diagnostics, const DrawOptions& options) {
    return Drawer(model, system, diagram).draw(diagnostics, options);
}

std::vector<std::pair<std::string, Point>> arranged(const model::Model& model, const std::string& system,
                                                    const Diagram& diagram) {
    const Drawer drawer(model, system, diagram);
    const std::vector<Point> corners = drawer.arrangement();
    std::vector<std::pair<std::string, Point>> all;
    for (std::size_t i = 0; i < corners.size(); ++i)
        all.emplace_back(drawer.items()[i].element.path, corners[i]);
    return all;
}

std::vector<std::pair<std::string, Point>> unplaced(const model::Model& model, const std::string& system,
                                                    const Diagram& diagram) {
    Drawer drawer(model, system, diagram);
    drawer.put();
    std::vector<std::pair<std::string, Point>> all;
    for (const Item& item : drawer.items())
        if (!item.is_placed) all.emplace_back(item.element.path, item.at);
    return all;
}

} // namespace bf::editor
