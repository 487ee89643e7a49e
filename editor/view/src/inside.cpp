#include "inside.hpp"

#include "bf/model/edit.hpp"
#include "bf/view/draw.hpp"
#include "chart.hpp"

#include <algorithm>

namespace bf::editor {

using model::joined;

std::string folder_of(const Inside& place) {
    const std::string file = place.file ? *place.file : "";
    return file.find('/') == file.npos ? "" : file.substr(0, file.rfind('/'));
}

Inside inside(const model::Model& model, const std::string& path) {
    Inside place{&model.root, &model.layout, "", model.where.file};
    std::string rest = path, here;
    while (!rest.empty()) {
        const std::string name = rest.substr(0, rest.find('.'));
        rest.erase(0, name.size() + 1);
        here = joined(here, name);
        if (place.machine) {
            place.state = joined(place.state, name);
            if (!level_of(*place.machine, folder_of(place), place.state))
                throw model::Errors(
                    {{place.machine->where, here, "there is no state of that path with states inside",
                      "look at the chart"}});
            place.path = joined(place.path, name);
            continue;
        }
        const model::Block* block = place.system->find_block(name);
        const model::System* content = block ? block->content() : nullptr;
        if (block && model::has_chart(*block))
            place.machine = block;
        else if (content)
            place.system = content;
        else
            throw model::Errors(
                {{{}, here, "there is no subsystem of that path", "look at the model's blocks"}});
        place.path = joined(place.path, name);
        if (block->reference && block->reference->model) {
            place.layout = &block->reference->model->layout;
            place.path = "";
            place.file = block->reference->model->where.file;
        }
    }
    return place;
}

std::string active_of(const Inside& place, const std::string& path) {
    const std::size_t inner = place.state.empty() ? 0 : place.state.size() + 1;
    return joined(path.substr(0, path.size() - inner),
                  place.machine->find_setting(model::chart_setting) ? "active" : "state");
}

std::vector<std::string> conditions_of(const model::Model& model, const std::string& machine,
                                       const Diagram& diagram) {
    const Inside place = inside(model, machine);
    if (!place.machine) return {};
    const std::string system = model::split_last(machine).first;
    return condition_names(*place.machine, *place.system, diagram, [&](const std::string& block) {
        const auto found = std::ranges::find(diagram.nodes, joined(system, block), &DiagramNode::path);
        return found == diagram.nodes.end() ? nullptr : &*found;
    });
}

bool may_draw(const model::Model& model, const std::string& system) {
    const model::Block* const block = system.empty() ? nullptr : model::find(model, system);
    if (system.empty() || (block && (block->content() || model::has_chart(*block)))) return true;
    try {
        return !inside(model, system).state.empty();
    } catch (const model::Errors&) {
        return false;
    }
}

} // namespace bf::editor
