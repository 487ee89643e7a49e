#include "bf/view/draw.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/edit.hpp"
#include "bf/view/image.hpp"
#include "chart.hpp"
#include "inside.hpp"
#include "item.hpp"
#include "labels.hpp"
#include "tag.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

namespace bf::editor {

namespace {

using model::joined;

constexpr double label_room = 16; ///< beside the guard of a transition
constexpr double open_radius = 3; ///< of a port without a wire

std::string rate_text(const Diagram& diagram, int rate) {
    if (rate == constant_rate) return "constant";
    const SampleRate& r = diagram.rates[static_cast<std::size_t>(rate)];
    if (r.is_continuous) return "continuous";
    if (r.trigger > 0) return "by " + diagram.conditions[static_cast<std::size_t>(r.trigger)].path;
    const double period = diagram.period(rate);
    return "every " +
           (period < 1 ? number_text(std::round(period * 1e9) / 1e6) + " ms" : number_text(period) + " s");
}

class Drawer {
  public:
    Drawer(const model::Model& model, const std::string& system, const Diagram& diagram,
           const DrawOptions& options = {})
        : place_(inside(model, system)), path_(system), diagram_(diagram), options_(options),
          folder_(model.where.file ? std::filesystem::path(*model.where.file).parent_path() : "."),
          signals_(diagram) {
        for (const auto& placed : place_.layout->blocks) placements_.emplace(placed.path, &placed);
        for (const auto& wire : place_.layout->wires) wires_.emplace(wire.path, &wire);
        for (std::size_t i = 0; i < diagram.nodes.size(); ++i)
            nodes_[diagram.nodes[i].path] = &diagram.nodes[i];
        if (place_.machine) {
            add_states();
            return;
        }
        for (const auto& port : place_.system->inputs) add_port(port, false);
        for (const auto& block : place_.system->blocks) add_block(block);
        for (const auto& port : place_.system->outputs) add_port(port, true);
        add_signals(model);
        join();
    }

    /// The corners that arrangement gives all of them.
    std::vector<Point> arrangement() const {
        std::vector<Box> wide = boxes();
        for (std::size_t n = 0; n < labels_.size(); ++n) { // which stand where transitions begin
            Box& box = wide[nets_[n].from.box];
            const double width =
                items_[nets_[n].from.box].box.width + text_width(labels_[n], small_letter) + label_room;
            box.width = std::max(box.width, std::ceil(width / 10) * 10);
        }
        std::vector<double> left(wide.size()); // room for labels of wires
        const auto make_room = [&](const PinOf& pin, const std::string& text) {
            const Side side = side_of(pin);
            Box& box = wide[pin.box];
            const Rectangle area = tag_area({}, side, text);
            const double room = std::max(area.x + area.width, -area.x);
            if (side == Side::right)
                box.width = std::max(box.width, left[pin.box] + items_[pin.box].box.width + room);
            if (side != Side::left || room <= left[pin.box]) return;
            const double more = room - std::exchange(left[pin.box], room);
            box.width += more;
            for (Box::Pin& other : box.pins) other.at.x += more;
        };
        for (const Tag& tag : tags()) make_room(tag.pin, fitted_tag(tag.text, {}, side_of(tag.pin), {}));
        std::vector<Point> corners = arrange(wide, nets_);
        for (std::size_t i = 0; i < corners.size(); ++i) corners[i].x += left[i];
        return corners;
    }
    const std::vector<Item>& items() const { return items_; }
    /// Paths of wires with corners by hand.
    std::vector<std::string> bent() const {
        std::vector<std::string> all;
        for (std::size_t n = 0; n < drawn_.size(); ++n)
            for (std::size_t t = 0; t < drawn_[n].size(); ++t)
                if (!drawn_[n][t].empty()) all.push_back(joined(path_, ends_[n].to[t]));
        return all;
    }

    /// Own ports without a place stand beside what has one, level with what they are wired to, and what was
    /// put into a wire between its ends; all else without a place is arranged together, below.
    void put() {
        for (auto& item : items_) {
            const model::Placement* placed = placement(last_name(item.element.path));
            if (!placed) continue;
            item.at = placed->at;
            item.is_placed = true;
        }
        std::vector<char> stands;
        for (const auto& item : items_) stands.push_back(item.is_placed);
        put_ports(stands);
        put_between(stands);
        if (std::ranges::all_of(stands, [](char does) { return does; })) return;
        const std::vector<Point> corners = arrangement();
        double below = 0, left = 0, top = 0;
        bool has_placed = false, has_other = false;
        for (std::size_t i = 0; i < items_.size(); ++i) {
            const Item& item = items_[i];
            if (stands[i]) {
                below = std::max(has_placed ? below : item.at.y, item.at.y + item.box.height + 60);
                left = has_placed ? std::min(left, item.at.x) : item.at.x;
                has_placed = true;
            } else {
                top = has_other ? std::min(top, corners[i].y) : corners[i].y;
                has_other = true;
            }
        }
        for (std::size_t i = 0; i < items_.size(); ++i)
            if (!stands[i])
                items_[i].at =
                    has_placed ? Point{corners[i].x + left, corners[i].y - top + below} : corners[i];
    }

    Drawing draw(const std::vector<model::Diagnostic>& diagnostics) {
        put();
        for (auto& item : items_)
            if (const auto moved = options_.moved.find(item.element.path); moved != options_.moved.end())
                item.at = moved->second.at;
        Drawing drawing;
        drawing.system = path_;
        drawing.signals = carried_;
        for (std::size_t rate = 0; rate < diagram_.rates.size(); ++rate)
            drawing.rates.push_back(rate_text(diagram_, static_cast<int>(rate)));
        if (place_.machine) drawing.active = active_of(place_, path_);
        add_wires(drawing);
        for (const Item& item : items_) {
            Element& element = drawing.elements.emplace_back(finished(item));
            for (const Port& port : element.ports)
                if (!port.is_wired && element.kind != Element::Kind::state)
                    element.shapes.push_back({Shape::Kind::ellipse,
                                              Style::open,
                                              {{port.at.x - open_radius, port.at.y - open_radius},
                                               {port.at.x + open_radius, port.at.y + open_radius}}});
        }
        for (const auto& note : place_.layout->notes)
            if (note.system == place_.path) {
                const auto moved = options_.moved_notes.find(note.name);
                drawing.elements.push_back(
                    noted(note, moved == options_.moved_notes.end() ? note.at : moved->second));
            }
        for (Element& element : drawing.elements) check_images(element);
        mark(drawing, diagnostics);
        if (!drawing.elements.empty()) drawing.bounds = drawing.elements.front().bounds;
        for (const auto& element : drawing.elements) {
            drawing.bounds = together(drawing.bounds, element.bounds);
            for (const auto& shape : element.shapes)
                if (shape.kind == Shape::Kind::text) drawing.bounds = together(drawing.bounds, extent(shape));
        }
        return drawing;
    }

  private:
    // ---- blocks and ports ----

    static Rectangle area(const Item& item) {
        return {item.at.x, item.at.y, item.box.width, item.box.height};
    }
    std::vector<Rectangle> areas() const {
        std::vector<Rectangle> all;
        for (const Item& item : items_) all.push_back(area(item));
        return all;
    }

    /// Whether something that stands would be nearer to it than that.
    bool is_taken(const Item& item, const std::vector<char>& stands, const Point& apart) const {
        return std::ranges::any_of(items_, [&](const Item& other) {
            return &other != &item && stands[static_cast<std::size_t>(&other - items_.data())] &&
                   other.at.x < item.at.x + item.box.width + apart.x &&
                   item.at.x < other.at.x + other.box.width + apart.x &&
                   other.at.y < item.at.y + item.box.height + apart.y &&
                   item.at.y < other.at.y + other.box.height + apart.y;
        });
    }

    /// A block of one wire in and one out, level with where that leads to, where there is room.
    void put_between(std::vector<char>& stands) {
        constexpr Point apart{15, 10};
        std::vector<std::vector<std::pair<PinOf, PinOf>>> in(items_.size()), out(items_.size());
        for (const Net& net : nets_)
            for (const PinOf& to : net.to) {
                out[net.from.box].emplace_back(net.from, to);
                in[to.box].emplace_back(net.from, to);
            }
        const auto at = [&](const PinOf& pin) {
            const Item& item = items_[pin.box];
            const Point& within = item.box.pins[pin.pin].at;
            return Point{item.at.x + within.x, item.at.y + within.y};
        };
        for (std::size_t i = 0; i < items_.size(); ++i) {
            if (stands[i] || in[i].size() != 1 || out[i].size() != 1) continue;
            const PinOf from = in[i][0].first, to = out[i][0].second;
            if (!stands[from.box] || !stands[to.box]) continue;
            Item& item = items_[i];
            item.at = {std::round((at(from).x + at(to).x - item.box.width) / 2),
                       at(to).y - item.box.pins[out[i][0].first.pin].at.y};
            stands[i] = !is_taken(item, stands, apart);
        }
    }

    /// Inputs on the left of all that has a place, outputs on the right.
    void put_ports(std::vector<char>& stands) {
        constexpr double beside = 60, apart = 10;
        std::optional<Rectangle> placed;
        for (const auto& item : items_)
            if (item.is_placed) placed = placed ? together(*placed, area(item)) : area(item);
        const auto put_port = [&](const PinOf& port, const PinOf& other) {
            Item& item = items_[port.box];
            const Item& known = items_[other.box];
            const bool is_input = item.element.kind == Element::Kind::input;
            if (stands[port.box] || !known.is_placed ||
                (!is_input && item.element.kind != Element::Kind::output))
                return;
            item.at = {is_input ? placed->x - beside - item.box.width : placed->x + placed->width + beside,
                       known.at.y + known.box.pins[other.pin].at.y - item.box.pins[port.pin].at.y};
            while (is_taken(item, stands, {0, apart})) item.at.y += apart;
            stands[port.box] = true;
        };
        for (const Net& net : nets_)
            for (const PinOf& to : net.to) {
                put_port(net.from, to);
                put_port(to, net.from);
            }
    }

    /// The place of a block or an own port, where the document has one.
    const model::Placement* placement(const std::string& name) const {
        const auto found = placements_.find(joined(place_.path, name));
        return found == placements_.end() ? nullptr : found->second;
    }

    /// What the document says of a block, a port or a state, with the size that is tried.
    model::Placement drawn(const std::string& name) const {
        const model::Placement* const placed = placement(name);
        model::Placement drawn = placed ? *placed : model::Placement();
        const auto moved = options_.moved.find(joined(path_, name));
        if (moved != options_.moved.end() && moved->second.size) drawn.size = moved->second.size;
        return drawn;
    }
    /// The corners of the wire to an input, as they are tried or else as the document has them.
    std::vector<Point> corners_of(const std::string& to) const {
        const auto tried = options_.bent.find(joined(path_, to));
        if (tried != options_.bent.end()) return tried->second;
        const auto found = wires_.find(joined(place_.path, to));
        return found != wires_.end() ? found->second->points : std::vector<Point>();
    }
    /// Do labels stand for the wire to an input?
    bool has_labels(const std::string& to) const {
        const auto found = wires_.find(joined(place_.path, to));
        return found != wires_.end() && found->second->as_labels;
    }

    void add_port(const model::Port& port, bool is_output) {
        Item item = port_item(port, is_output, drawn(port.name));
        if (!is_output)
            for (const auto& input : diagram_.inputs)
                if (path_.empty() && input.path == port.name) item.element.ports[0].about = about(input.end);
        add(std::move(item), port.name, is_output ? "output " : "input ");
    }

    void add_block(const model::Block& block) {
        const std::string path = joined(path_, block.name);
        const auto found = nodes_.find(path);
        const DiagramNode* node =
            found != nodes_.end() && found->second->type == block.type ? found->second : nullptr;
        PortNames ports;
        if (const model::System* content = block.content()) {
            for (const auto& port : content->inputs) ports.inputs.push_back(port.name);
            for (const auto& port : content->outputs) ports.outputs.push_back(port.name);
            for (const auto name : model::control_ports(*content)) ports.controls.emplace_back(name);
        } else if (node) {
            for (const auto& slot : node->block->declaration().slots) {
                if (slot.role == Role::input) ports.inputs.push_back(slot.name);
                if (slot.role == Role::output) ports.outputs.push_back(slot.name);
            }
        } else {
            ports = guessed_ports(block.name);
        }
        Item item = block_item(block, node, ports, drawn(block.name));
        for (auto& port : item.element.ports)
            if (port.is_output) port.about = about(signals_.find(joined(path, port.name)));
        add(std::move(item), block.name, "");
    }

    /// Of a block that cannot be made the connections say what ports it has.
    PortNames guessed_ports(const std::string& block) const {
        PortNames guessed;
        const auto note = [&](const model::Endpoint& end, std::vector<std::string>& ports) {
            if (end.block == block && std::ranges::find(ports, end.port) == ports.end())
                ports.push_back(end.port);
        };
        for (const auto& connection : place_.system->connections) {
            note(connection.from, guessed.outputs);
            for (const auto& to : connection.to) note(to, guessed.inputs);
        }
        return guessed;
    }

    void add(Item item, const std::string& name, const std::string& kind) {
        item.element.path = joined(path_, name);
        index_[kind + name] = items_.size();
        items_.push_back(std::move(item));
    }

    // ---- charts ----

    void add_states() {
        const auto find_node = [this](const std::string& block) -> const DiagramNode* {
            const auto found = nodes_.find(joined(model::split_last(path_).first, block));
            return found == nodes_.end() ? nullptr : found->second;
        };
        const model::Block& machine = *place_.machine;
        const auto level = level_of(machine, folder_of(place_), place_.state);
        const model::Chart chart = level ? level->chart : chart_of(machine, find_node(machine.name));
        const auto conditions = condition_names(machine, *place_.system, diagram_, find_node);
        std::vector<std::size_t> inputs(chart.states.size()), outputs(chart.states.size());
        for (const auto& transition : chart.transitions) {
            const std::size_t from = outputs[transition.from]++, to = inputs[transition.to]++;
            nets_.push_back({{transition.from, from}, {{transition.to, to}}});
            labels_.push_back(level ? transition.condition : label_of(transition, conditions));
        }
        for (Net& net : nets_) net.from.pin += inputs[net.from.box]; // outputs come after inputs
        for (std::size_t i = 0; i < chart.states.size(); ++i) {
            const std::string& name = chart.states[i];
            const StateKind kind = level ? level->kinds[i] : StateKind::plain;
            Item item = state_item(name, kind, i == chart.initial, inputs[i], outputs[i], drawn(name));
            item.element.state = level ? level->numbers[i] : std::optional(static_cast<int>(i) + 1);
            add(std::move(item), name, "");
        }
        for (std::size_t t = 0; t < chart.transitions.size(); ++t) {
            const std::string to = level ? level->names[t] : chart.name_of(t);
            ends_.push_back({chart.states[chart.transitions[t].from], {to}});
            drawn_.push_back({corners_of(to)});
            inputs_.try_emplace(joined(path_, to), joined(path_, to));
        }
    }

    void add_transitions(Drawing& drawing, const std::vector<std::vector<Route>>& routes) const {
        std::vector<Labelled> ways;
        for (std::size_t n = 0; n < labels_.size(); ++n) ways.push_back({routes[n][0].points, labels_[n]});
        const std::vector<Shape> guards = place_labels(ways, areas());
        for (std::size_t n = 0; n < labels_.size(); ++n) {
            drawing.elements.push_back(arrow_of(n, routes[n][0]));
            if (!labels_[n].empty()) drawing.elements.back().shapes.push_back(guards[n]);
        }
    }

    /// Without its guard.
    Element arrow_of(std::size_t n, const Route& way) const {
        Element arrow;
        arrow.kind = Element::Kind::wire;
        arrow.from = ends_[n].from;
        arrow.to = ends_[n].to[0];
        arrow.path = joined(path_, arrow.to);
        arrow.title = "transition from " + arrow.from + " to " +
                      last_name(items_[nets_[n].to[0].box].element.path) +
                      (labels_[n].empty() ? "" : ", " + labels_[n]);
        arrow.corners = way.points;
        arrow.bounds = around(way.points);
        arrow.state = items_[nets_[n].from.box].element.state;
        arrow.shapes = arrow_along(way.points);
        return arrow;
    }

    // ---- signals ----

    /// What each output carries, by which name, and where the model keeps it.
    void add_signals(const model::Model& model) {
        std::map<std::pair<int, int>, std::vector<Kept>> by_end; // of all that the diagram knows
        std::map<std::string, std::vector<Kept>> by_path;
        const auto note = [](std::vector<Kept>& list, const Kept& kept) {
            if (list.empty() || list.back().plot != kept.plot || list.back().entry != kept.entry)
                list.push_back(kept);
        };
        const auto keep = [&](const std::string& plot, const std::string& entry) {
            const Kept kept{plot, entry.find('*') == std::string::npos ? entry : ""};
            note(by_path[entry], kept);
            for (const auto& signal : signals_.match(entry))
                note(by_end[{signal.end.node, signal.end.slot}], kept);
        };
        for (const auto& signal : model.record) keep("", signal.path);
        for (const auto& panel : model.plots)
            for (const auto& signal : panel.signals) keep(panel.title, signal.path);
        for (Item& item : items_) {
            auto& ports = item.element.ports;
            const bool is_only = std::ranges::count_if(ports, &Port::is_output) == 1;
            for (Port& port : ports) {
                if (!port.is_output) continue;
                const std::string& block = item.element.path;
                const std::string full = port.name.empty() ? block : joined(block, port.name);
                port.signal = static_cast<int>(carried_.size());
                DrawnSignal& signal = carried_.emplace_back(DrawnSignal{is_only ? block : full});
                const Node::End end = signals_.find(full);
                if (model.record_all) signal.kept.push_back({});
                if (end.node >= 0) {
                    for (const Kept& kept : by_end[{end.node, end.slot}]) signal.kept.push_back(kept);
                    continue;
                }
                for (const std::string& path : std::set<std::string>{signal.path, full})
                    for (const Kept& kept : by_path[path]) signal.kept.push_back(kept);
            }
        }
        for (const auto& named : place_.system->signals)
            if (const auto source = pin(named.of, true))
                carried_[static_cast<std::size_t>(port(*source).signal)].name = joined(path_, named.name);
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
            Ends ends{connection.from.text(), {}};
            std::vector<std::vector<Point>> bends;
            for (const auto& to : connection.to) {
                const auto target = pin(to, false);
                if (!target) continue;
                net.to.push_back(*target);
                ends.to.push_back(to.text());
                bends.push_back(corners_of(to.text()));
                Port& input = port(*target);
                const std::string& element = items_[target->box].element.path;
                inputs_.try_emplace(joined(path_, to.text()),
                                    input.name.empty() ? element : joined(element, input.name));
                input.is_wired = port(*from).is_wired = true;
                input.about = port(*from).about;
                input.signal = port(*from).signal;
            }
            nets_.push_back(std::move(net));
            ends_.push_back(std::move(ends));
            drawn_.push_back(std::move(bends));
        }
    }

    Port& port(const PinOf& pin) { return items_[pin.box].element.ports[pin.pin]; }

    std::vector<Box> boxes() const {
        std::vector<Box> all;
        for (const auto& item : items_) all.push_back(item.box);
        return all;
    }

    void add_wires(Drawing& drawing) {
        std::vector<Point> corners;
        for (const auto& item : items_) corners.push_back(item.at);
        std::vector<Box> around_wires = boxes();
        std::vector<Tag> tags_drawn = tags();
        const std::vector<Rectangle> blocks = areas();
        for (Tag& tag : tags_drawn) {
            tag.port = port_of(tag.pin);
            tag.text = fitted_tag(tag.text, tag.port, side_of(tag.pin), blocks);
            const Rectangle label = tag_area(tag.port, side_of(tag.pin), tag.text),
                            r = together(label, around({tag.port}));
            // One that stands on a block, for want of room, would shut in the wires to and from that.
            const auto hides = [&](const Rectangle& block) { return overlap(block, label); };
            if (std::ranges::any_of(blocks, hides)) continue;
            around_wires.push_back({r.width, r.height, {}});
            corners.push_back({r.x, r.y});
        }
        std::vector<Net> lines = nets_; // without those for which labels stand
        std::vector<std::vector<std::vector<Point>>> drawn = drawn_;
        for (std::size_t n = labels_.size(); n < nets_.size(); ++n)
            for (std::size_t t = nets_[n].to.size(); t-- > 0;)
                if (has_labels(ends_[n].to[t])) {
                    lines[n].to.erase(lines[n].to.begin() + static_cast<std::ptrdiff_t>(t));
                    drawn[n].erase(drawn[n].begin() + static_cast<std::ptrdiff_t>(t));
                }
        const auto routes = route(around_wires, corners, lines, drawn);
        add_transitions(drawing, routes);
        for (std::size_t n = labels_.size(); n < nets_.size(); ++n) {
            const auto tag_begin = std::ranges::lower_bound(tags_drawn, n, {}, &Tag::net);
            const auto tag_end = std::ranges::upper_bound(tags_drawn, n, {}, &Tag::net);
            const std::string text = tag_begin != tag_end ? tag_text(n) : label(nets_[n].from);
            std::size_t line = 0;
            for (std::size_t t = 0; t < nets_[n].to.size(); ++t) {
                Element wire;
                wire.kind = Element::Kind::wire;
                wire.from = ends_[n].from;
                wire.to = ends_[n].to[t];
                wire.path = joined(path_, wire.to);
                wire.title = "wire from " + wire.from + " to " + wire.to;
                wire.description = port(nets_[n].from).about;
                wire.signal = port(nets_[n].from).signal;
                wire.rate = items_[nets_[n].from.box].element.rate;
                if (has_labels(wire.to)) {
                    wire.as_labels = true;
                    for (auto tag = tag_begin; tag != tag_end; ++tag)
                        if (tag->to == t)
                            add_tag(wire, tag->port, side_of(tag->pin), tag->is_source, tag->text);
                } else {
                    const Route& way = routes[n][line++];
                    wire.corners = way.points;
                    wire.bounds = around(way.points);
                    wire.shapes.push_back({Shape::Kind::line, Style::wire, own_part(way)});
                    for (const Point& b : way.branches)
                        wire.shapes.push_back(
                            {Shape::Kind::ellipse, Style::branch, {{b.x - 3, b.y - 3}, {b.x + 3, b.y + 3}}});
                    if (line == 1 && !text.empty()) wire.shapes.push_back(label_along(way.points, text));
                }
                drawing.elements.push_back(std::move(wire));
            }
        }
    }

    /// A label of a wire, which is number `to` of its net: at its end, or at its source.
    struct Tag {
        std::size_t net, to;
        PinOf pin;
        bool is_source;
        std::string text;
        Point port = {}; ///< where it is drawn
    };
    /// Each end has one; a source has one for all wires from there, unless it stands along a line. In the
    /// order of nets.
    std::vector<Tag> tags() const {
        std::vector<Tag> all;
        for (std::size_t n = labels_.size(); n < nets_.size(); ++n) {
            const std::size_t first = all.size();
            for (std::size_t t = 0; t < nets_[n].to.size(); ++t)
                if (has_labels(ends_[n].to[t])) all.push_back({n, t, nets_[n].to[t], false, tag_text(n)});
            const std::size_t count = all.size() - first;
            if (count > 0 && count == nets_[n].to.size())
                all.push_back({n, 0, nets_[n].from, true, tag_text(n)});
        }
        return all;
    }
    std::string tag_text(std::size_t net) const {
        const std::string text = label(nets_[net].from);
        return text.empty() ? ends_[net].from : text;
    }
    Point port_of(const PinOf& pin) const {
        const Item& item = items_[pin.box];
        return {item.at.x + item.box.pins[pin.pin].at.x, item.at.y + item.box.pins[pin.pin].at.y};
    }
    Side side_of(const PinOf& pin) const { return items_[pin.box].box.pins[pin.pin].side; }

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

    std::string label(const PinOf& from) const {
        const Element& element = items_[from.box].element;
        const std::string& port = element.ports[from.pin].name;
        std::string text = last_name(carried_[static_cast<std::size_t>(element.ports[from.pin].signal)].name);
        const Node::End end = signals_.find(port.empty() ? element.path : joined(element.path, port));
        const Slot* const s = slot(end);
        if (!s) return text;
        const auto add = [&](const std::string& part) {
            text += (text.empty() || part.empty() ? "" : " ") + part;
        };
        if (options_.sizes && s->size_known) add(s->size.text());
        if (options_.types && s->type_known) add(name(s->type));
        if (options_.units) add(unit_text(*s));
        const int rate = diagram_.nodes[static_cast<std::size_t>(end.node)].rate;
        if (options_.rates && rate >= 0) add(without_every(rate_text(diagram_, rate)));
        return text;
    }

    // ---- elements ----

    /// Images are files beside the one that names them; those that may not be shown are marked instead.
    void check_images(Element& element) const {
        std::shared_ptr<const std::string> file = place_.file;
        if (element.kind == Element::Kind::subsystem)
            if (const model::Block* block = place_.system->find_block(last_name(element.path));
                block->reference && block->reference->model)
                file = block->reference->model->where.file;
        const std::filesystem::path folder = options_.folder.empty() ? folder_ : options_.folder;
        for (Shape& shape : element.shapes) {
            if (shape.kind != Shape::Kind::image) continue;
            const auto beside = (file ? std::filesystem::path(*file).parent_path() : folder) / shape.text;
            const std::string defect = image_defect(beside, folder);
            shape.text = beside.lexically_normal().string();
            if (defect.empty()) continue;
            element.marks.push_back({defect, "name another file, or remove it", {}});
            const Point a = shape.points[0], b = shape.points[1];
            shape = {Shape::Kind::polygon, Style::note, {a, {b.x, a.y}, b, {a.x, b.y}}};
        }
    }

    /// Marks what a diagnostic concerns: a block, an own port or a wire, and the subsystem in which it
    /// stands. A wire that the document calls by its block alone is meant where its port is.
    void mark(Drawing& drawing, const std::vector<model::Diagnostic>& diagnostics) const {
        std::unordered_map<std::string, std::vector<const model::Diagnostic*>> by_path;
        for (const auto& d : diagnostics) {
            if (d.is_open && !options_.marks_open) continue;
            for (std::string path = d.path; !path.empty(); path = model::split_last(path).first)
                by_path[path].push_back(&d);
        }
        for (auto& element : drawing.elements) {
            const bool is_wire = element.kind == Element::Kind::wire;
            const auto found = by_path.find(is_wire ? inputs_.at(element.path) : element.path);
            if (found == by_path.end()) continue;
            for (const auto* d : found->second) element.marks.push_back({d->message, d->remedy, d->fixes});
            outline(element, Style::highlight);
        }
    }

    struct Ends {
        std::string from;
        std::vector<std::string> to;
    };

    const Inside place_;
    const std::string path_;
    const Diagram& diagram_;
    const DrawOptions options_;
    const std::filesystem::path folder_; ///< of the model's file
    const SignalFinder signals_;
    std::unordered_map<std::string, const model::Placement*> placements_; ///< of the file, by path there
    std::unordered_map<std::string, const model::Bends*> wires_;          ///< by path there
    std::unordered_map<std::string, const DiagramNode*> nodes_;           ///< by path
    std::vector<Item> items_;
    std::unordered_map<std::string, std::size_t> index_; ///< "gain", "input reference", "output tau"
    std::vector<DrawnSignal> carried_;
    std::vector<Net> nets_;
    std::vector<std::string> labels_; ///< of the nets of a chart, all of which are transitions
    std::vector<Ends> ends_;          ///< as the document writes those of each net
    std::unordered_map<std::string, std::string> inputs_; ///< by paths of wires, with the name of the port
    std::vector<std::vector<std::vector<Point>>> drawn_;  ///< corners by hand, of each net and wire
};

} // namespace

Drawing draw(const model::Model& model, const std::string& system, const Diagram& diagram,
             const std::vector<model::Diagnostic>& diagnostics, const DrawOptions& options) {
    return Drawer(model, system, diagram, options).draw(diagnostics);
}

model::operations::Batch arranged(const model::Model& model, const std::string& system,
                                  const Diagram& diagram) {
    const Drawer drawer(model, system, diagram);
    const std::vector<Point> corners = drawer.arrangement();
    model::operations::Batch all;
    for (std::size_t i = 0; i < corners.size(); ++i)
        all.operations.emplace_back(model::operations::Move{drawer.items()[i].element.path, corners[i]});
    for (const std::string& wire : drawer.bent()) all.operations.emplace_back(model::operations::Bend{wire});
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
