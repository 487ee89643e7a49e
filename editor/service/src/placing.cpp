#include "placing.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/chart.hpp"
#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/suggest.hpp"

#include <algorithm>

namespace bf::service {

namespace {

namespace op = model::operations;

std::string around(const std::string& path) { return model::split_last(path).first; }

void note(const model::Model& model, const model::Operation& operation, std::set<std::string>& systems) {
    if (const auto* add = std::get_if<op::Add>(&operation); add && add->at) systems.insert(add->system);
    if (const auto* move = std::get_if<op::Move>(&operation)) systems.insert(around(move->path));
    if (const auto* flip = std::get_if<op::Flip>(&operation)) systems.insert(around(flip->path));
    if (const auto* rotate = std::get_if<op::Rotate>(&operation)) systems.insert(around(rotate->path));
    if (const auto* place = std::get_if<op::PlacePort>(&operation)) systems.insert(around(place->path));
    if (const auto* resize = std::get_if<op::Resize>(&operation)) systems.insert(around(resize->path));
    if (const auto* bend = std::get_if<op::Bend>(&operation))
        for (const auto& system : model::systems_with_wire(model, bend->path)) systems.insert(system);
    if (const auto* batch = std::get_if<op::Batch>(&operation))
        for (const auto& part : batch->operations) note(model, part, systems);
    // States without a place would make room for each transition that comes, and for what stands at it.
    const auto note_chart = [&](const std::string& path) {
        const auto machine = model::split_chart(model, path).first;
        if (machine.empty()) return;
        const bool has_levels = model::find(model, machine)->find_setting(model::chart_setting);
        systems.insert(has_levels ? around(path) : machine);
    };
    if (const auto* connect = std::get_if<op::Connect>(&operation))
        note_chart(model::joined(connect->system, connect->to));
    if (const auto* disconnect = std::get_if<op::Disconnect>(&operation))
        note_chart(model::joined(disconnect->system, disconnect->to));
    if (const auto* set = std::get_if<op::Set>(&operation)) note_chart(set->path);
    if (const auto* rename = std::get_if<op::Rename>(&operation)) note_chart(rename->path);
    if (const auto* remove = std::get_if<op::Remove>(&operation)) note_chart(remove->path);
}

} // namespace

std::set<std::string> systems_placed_in(const model::Model& model, const model::Operation& operation) {
    std::set<std::string> systems;
    note(model, operation, systems);
    // One that comes with the operation has nothing that could jump.
    std::erase_if(systems, [&](const std::string& system) { return !editor::may_draw(model, system); });
    return systems;
}

void require_ports(const model::Model& model, const Diagram& diagram, const model::Operation& operation) {
    if (const auto* batch = std::get_if<op::Batch>(&operation))
        for (const auto& part : batch->operations) require_ports(model, diagram, part);
    const auto* const place = std::get_if<op::PlacePort>(&operation);
    const model::Block* const block = place ? model::find(model, place->path) : nullptr;
    if (!block || !place->side) return;
    const auto drawing = editor::draw(model, around(place->path), diagram, {});
    const auto element = std::ranges::find_if(drawing.elements, [&](const editor::Element& e) {
        return e.path == place->path && e.kind != editor::Element::Kind::wire;
    });
    std::vector<std::string> known;
    if (element != drawing.elements.end())
        for (const auto& port : element->ports) known.push_back(port.name);
    if (std::ranges::find(known, place->port) == known.end())
        throw model::Errors({{block->where, place->path, "there is no port '" + place->port + "'",
                              model::name_remedy(place->port, known)}});
}

editor::DrawOptions options_of(const Draw& asked) {
    const auto checked = [](const std::string& path, const editor::Point& at) {
        if (model::is_drawable(at)) return at;
        throw model::Errors({{{},
                              path,
                              "it cannot be drawn at [" + number_text(at.x) + ", " + number_text(at.y) + "]",
                              model::coordinate_rule()}});
    };
    editor::DrawOptions show;
    show.marks_open = asked.marks_open;
    for (const Show what : asked.show) {
        show.sizes |= what == Show::sizes;
        show.types |= what == Show::types;
        show.rates |= what == Show::rates;
        show.units |= what == Show::units;
    }
    for (const auto& [path, to, size] : asked.moved) show.moved[path] = {checked(path, to), size};
    for (const auto& note : asked.moved_notes) show.moved_notes[note.path] = checked(note.path, note.to);
    for (const auto& [path, points] : asked.bent) {
        show.bent[path] = points;
        for (const auto& point : points) checked(path, point);
    }
    return show;
}

} // namespace bf::service
