#include "bf/view/draw.hpp"

#include "bf/model/edit.hpp"
#include "bf/view/place.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace bf::editor {

namespace {

constexpr double letter = 11, port_gap = 20, least_width = 50, least_height = 40;

double text_width(const std::string& text, double size) {
    return 0.55 * size * static_cast<double>(text.size());
}

std::string joined(const std::string& system, const std::string& name) {
    return system.empty() ? name : system + "." + name;
}

struct Item {
    Element element;
    Box box;
    Point at;
    bool is_placed = false;
};

class Drawer {
  public:
    Drawer(const model::Model& model, const std::string& system, const Diagram& diagram)
        : model_(model), path_(system), diagram_(diagram) {
        layout_ = &model.layout;
        const model::System* at = &model.root;
        std::string rest = system, here;
        local_ = system;
        while (!rest.empty()) {
            const std::string name = rest.substr(0, rest.find('.'));
            rest.erase(0, name.size() + 1);
            here = joined(here, name);
            const model::Block* block = at->find_block(name);
            at = block ? block->content() : nullptr;
            if (!at)
                throw model::Errors(
                    {{{}, here, "there is no subsystem of that path", "look at the model's blocks"}});
            if (block->reference && block->reference->model) {
                layout_ = &block->reference->model->layout;
                local_ = rest;
            }
        }
        system_ = at;
        for (std::size_t i = 0; i < diagram.nodes.size(); ++i) nodes_[diagram.nodes[i].path] = i;
        add_items();
        place();
    }

    std::vector<Item>& items() { return items_; }

    Drawing draw(const std::vector<model::Diagnostic>& diagnostics, const DrawOptions& options) {
        for (auto& item : items_)
            if (const auto moved = options.moved.find(item.element.path); moved != options.moved.end())
                item.at = moved->second;
        Drawing drawing;
        drawing.system = path_;
        wires(drawing);
        for (auto& item : items_) drawing.elements.push_back(finished(item));
        for (auto& element : drawing.elements)
            for (const auto& d : diagnostics)
                if (d.path == element.path || d.path.starts_with(element.path + "."))
                    element.marks.push_back({d.message, d.remedy});
        double left = 0, top = 0, right = 0, bottom = 0;
        bool is_first = true;
        for (const auto& e : drawing.elements) {
            left = is_first ? e.bounds.x : std::min(left, e.bounds.x);
            top = is_first ? e.bounds.y : std::min(top, e.bounds.y);
            right = is_first ? e.bounds.x + e.bounds.width : std::max(right, e.bounds.x + e.bounds.width);
            bottom = is_first ? e.bounds.y + e.bounds.height : std::max(bottom, e.bounds.y + e.bounds.height);
            is_first = false;
        }
        drawing.bounds = {left, top, right - left, bottom - top};
        return drawing;
    }

  private:
    void add_items() {
        for (const auto& port : system_->inputs) add(port.name, Element::Kind::input, {}, {""}, "In");
        for (const auto name : model::control_ports(*system_)) (void)name;
        for (const auto& block : system_->blocks) {
            std::vector<std::string> inputs, outputs;
            if (const auto* content = block.content()) {
                for (const auto& p : content->inputs) inputs.push_back(p.name);
                for (const auto& name : model::control_ports(*content)) inputs.emplace_back(name);
                for (const auto& p : content->outputs) outputs.push_back(p.name);
            } else if (const auto node = nodes_.find(joined(path_, block.name)); node != nodes_.end()) {
                for (const auto& slot : diagram_.nodes[node->second].block->declaration().slots) {
                    if (slot.role == Role::input) inputs.push_back(slot.name);
                    if (slot.role == Role::output) outputs.push_back(slot.name);
                }
            }
            for (const auto& c : system_->connections) {
                const auto note = [](std::vector<std::string>& list, const std::string& name) {
                    if (std::find(list.begin(), list.end(), name) == list.end() &&
                        !(name.empty() && !list.empty()))
                        list.push_back(name);
                };
                if (c.from.block == block.name) note(outputs, c.from.port);
                for (const auto& to : c.to)
                    if (to.block == block.name) note(inputs, to.port);
            }
            add(block.name, block.is_subsystem() ? Element::Kind::subsystem : Element::Kind::block, inputs,
                outputs, block.type);
        }
        for (const auto& port : system_->outputs) add(port.name, Element::Kind::output, {""}, {}, "Out");
    }

    void add(const std::string& name, Element::Kind kind, const std::vector<std::string>& inputs,
             const std::vector<std::string>& outputs, const std::string& type) {
        Item item;
        item.element.kind = kind;
        item.element.path = joined(path_, name);
        item.element.title = name + ", " + type;
        const double rows = static_cast<double>(std::max(inputs.size(), outputs.size()));
        const bool is_port = kind == Element::Kind::input || kind == Element::Kind::output;
        item.box.width = is_port ? 30 : std::max(least_width, text_width(type, letter) + 16);
        item.box.height = is_port ? 20 : std::max(least_height, rows * port_gap + 10);
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            const double y =
                item.box.height * (static_cast<double>(i) + 0.5) / static_cast<double>(inputs.size());
            item.box.pins.push_back({{0, y}, Side::left});
            item.element.ports.push_back({inputs[i], false, false, {0, y}, {}});
        }
        for (std::size_t i = 0; i < outputs.size(); ++i) {
            const double y =
                item.box.height * (static_cast<double>(i) + 0.5) / static_cast<double>(outputs.size());
            item.box.pins.push_back({{item.box.width, y}, Side::right});
            item.element.ports.push_back({outputs[i], true, false, {item.box.width, y}, {}});
        }
        const std::string place = joined(local_, name);
        for (const auto& placement : layout_->blocks)
            if (placement.path == place) {
                item.at = placement.at;
                item.is_placed = true;
            }
        index_[name + (kind == Element::Kind::output ? "\n" : "")] = items_.size();
        types_.push_back(type);
        items_.push_back(std::move(item));
    }

    std::optional<PinOf> pin(const model::Endpoint& end, bool is_output) const {
        const std::string name = end.block.empty() ? end.port : end.block;
        const auto found = index_.find(name + (end.block.empty() && !is_output ? "\n" : ""));
        if (found == index_.end()) return {};
        const auto& ports = items_[found->second].element.ports;
        for (std::size_t i = 0; i < ports.size(); ++i)
            if (ports[i].is_output == is_output &&
                (end.block.empty() || end.port.empty() || ports[i].name == end.port))
                return PinOf{found->second, i};
        return {};
    }

    void place() {
        std::vector<Box> boxes;
        for (const auto& connection : system_->connections) {
            Net net;
            Ends ends;
            const auto from = pin(connection.from, true);
            if (!from) continue;
            net.from = *from;
            ends.from = connection.from.text();
            for (const auto& to : connection.to)
                if (const auto target = pin(to, false)) {
                    net.to.push_back(*target);
                    ends.to.push_back(to.text());
                }
            nets_.push_back(net);
            ends_.push_back(ends);
        }
        for (const auto& item : items_) boxes.push_back(item.box);
        const auto corners = arrange(boxes, nets_);
        for (std::size_t i = 0; i < items_.size(); ++i)
            if (!items_[i].is_placed) items_[i].at = corners[i];
    }

    void wires(Drawing& drawing) {
        std::vector<Box> boxes;
        std::vector<Point> corners;
        for (const auto& item : items_) {
            boxes.push_back(item.box);
            corners.push_back(item.at);
        }
        const auto routes = route(boxes, corners, nets_);
        for (std::size_t n = 0; n < nets_.size(); ++n)
            for (std::size_t t = 0; t < nets_[n].to.size(); ++t) {
                const Route& r = routes[n][t];
                Element wire;
                wire.kind = Element::Kind::wire;
                wire.from = ends_[n].from;
                wire.to = ends_[n].to[t];
                wire.path = joined(path_, wire.to);
                wire.title = "wire from " + wire.from + " to " + wire.to;
                wire.shapes.push_back({Shape::Kind::line, Style::wire, r.points});
                for (const auto& b : r.branches)
                    wire.shapes.push_back(
                        {Shape::Kind::ellipse, Style::branch, {{b.x - 3, b.y - 3}, {b.x + 3, b.y + 3}}});
                double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
                for (const auto& p : r.points) {
                    left = std::min(left, p.x), right = std::max(right, p.x);
                    top = std::min(top, p.y), bottom = std::max(bottom, p.y);
                }
                wire.bounds = {left, top, right - left, bottom - top};
                items_[nets_[n].from.box].element.ports[nets_[n].from.pin].is_wired = true;
                items_[nets_[n].to[t].box].element.ports[nets_[n].to[t].pin].is_wired = true;
                drawing.elements.push_back(std::move(wire));
            }
    }

    Element finished(Item& item) {
        Element e = item.element;
        const double x = item.at.x, y = item.at.y, w = item.box.width, h = item.box.height;
        e.bounds = {x, y, w, h};
        for (auto& port : e.ports) port.at = {port.at.x + x, port.at.y + y};
        e.shapes.push_back(
            {Shape::Kind::polygon, Style::body, {{x, y}, {x + w, y}, {x + w, y + h}, {x, y + h}}});
        const std::string name = e.path.substr(e.path.rfind('.') + 1);
        const auto& type = types_[static_cast<std::size_t>(&item - items_.data())];
        e.shapes.push_back(
            {Shape::Kind::text, Style::value, {{x + w / 2, y + h / 2 + 4}}, type, letter, Align::middle});
        e.shapes.push_back(
            {Shape::Kind::text, Style::name, {{x + w / 2, y + h + 14}}, name, letter, Align::middle});
        return e;
    }

    struct Ends {
        std::string from;
        std::vector<std::string> to;
    };
    const model::Model& model_;
    const std::string path_;
    std::string local_;
    const Diagram& diagram_;
    const model::Layout* layout_;
    const model::System* system_;
    std::unordered_map<std::string, std::size_t> nodes_, index_;
    std::vector<std::string> types_;
    std::vector<Item> items_;
    std::vector<Net> nets_;
    std::vector<Ends> ends_;
};

} // namespace

Drawing draw(const model::Model& model, const std::string& system, const Diagram& diagram,
             const std::vector<model::Diagnostic>& diagnostics, const DrawOptions& options) {
    return Drawer(model, system, diagram).draw(diagnostics, options);
}

std::vector<std::pair<std::string, Point>> arranged(const model::Model& model, const std::string& system,
                                                    const Diagram& diagram) {
    std::vector<std::pair<std::string, Point>> all;
    Drawer drawer(model, system, diagram);
    for (const auto& item : drawer.items())
        if (!item.is_placed) all.emplace_back(item.element.path, item.at);
    return all;
}

} // namespace bf::editor
