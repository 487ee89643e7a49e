#include "placing.hpp"

#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"

#include <algorithm>

namespace bf::service {

namespace {

namespace op = model::operations;

bool leads_to(const model::Model& model, const std::string& system, const std::string& path) {
    const model::System* content = model::find_system(model, system);
    if (!content) return false;
    const std::string end = system.empty() ? path : path.substr(system.size() + 1);
    return std::ranges::any_of(content->connections, [&](const model::Connection& connection) {
        return std::ranges::find(connection.to, end, &model::Endpoint::text) != connection.to.end();
    });
}

std::string around(const std::string& path) { return model::split_last(path).first; }

void note(const model::Model& model, const op::Bend& bend, std::set<std::string>& systems) {
    // "controller.tau" leads to an output inside of the controller, or to one of its inputs outside.
    for (const std::string& system : {around(bend.path), around(around(bend.path))})
        if (leads_to(model, system, bend.path)) systems.insert(system);
    // "machine.lift.4" is a transition of the state machine.
    if (const auto machine = model::split_chart(model, bend.path).first; !machine.empty())
        systems.insert(machine);
}

void note(const model::Model& model, const model::Operation& operation, std::set<std::string>& systems) {
    if (const auto* add = std::get_if<op::Add>(&operation); add && add->at) systems.insert(add->system);
    if (const auto* move = std::get_if<op::Move>(&operation)) systems.insert(around(move->path));
    if (const auto* flip = std::get_if<op::Flip>(&operation)) systems.insert(around(flip->path));
    if (const auto* rotate = std::get_if<op::Rotate>(&operation)) systems.insert(around(rotate->path));
    if (const auto* place = std::get_if<op::PlacePort>(&operation)) systems.insert(around(place->path));
    if (const auto* resize = std::get_if<op::Resize>(&operation)) systems.insert(around(resize->path));
    if (const auto* bend = std::get_if<op::Bend>(&operation)) note(model, *bend, systems);
    if (const auto* batch = std::get_if<op::Batch>(&operation))
        for (const auto& part : batch->operations) note(model, part, systems);
}

} // namespace

std::set<std::string> systems_placed_in(const model::Model& model, const model::Operation& operation) {
    std::set<std::string> systems;
    note(model, operation, systems);
    return systems;
}

} // namespace bf::service
