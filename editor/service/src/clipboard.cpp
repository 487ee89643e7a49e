#include "clipboard.hpp"

#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

namespace bf::service {

namespace {

const model::System& system_at(const model::Model& model, const std::string& path) {
    const model::System* const system = model::find_system(model, path);
    if (!system)
        throw model::Errors({{{}, path, "there is no subsystem of that path", "look at the model's blocks"}});
    return *system;
}

/// "gain" -> "gain2", "gain2" -> "gain3".
std::string fresh(std::string name, const std::set<std::string>& taken) {
    if (!taken.contains(name)) return name;
    const auto digits = name.find_last_not_of("0123456789") + 1;
    unsigned long long number =
        digits < name.size() && name.size() - digits < 10 ? std::stoull(name.substr(digits)) : 1;
    if (digits < name.size() && name.size() - digits < 10) name.resize(digits);
    while (taken.contains(name + std::to_string(number + 1))) ++number;
    return name + std::to_string(number + 1);
}

/// How a block looks that another one looks like.
void add_look(model::operations::Batch& batch, const std::string& path, const model::Placement& as) {
    namespace op = model::operations;
    if (as.size) batch.operations.emplace_back(op::Resize{path, as.size});
    if (as.flipped) batch.operations.emplace_back(op::Flip{path});
    for (int i = 0; i < static_cast<int>(as.rotated); ++i) batch.operations.emplace_back(op::Rotate{path});
    for (const auto& [port, side] : as.sides) batch.operations.emplace_back(op::PlacePort{path, port, side});
}

/// Its mistakes stand in no file.
model::Model read_clipboard(const std::string& text, const std::filesystem::path& folder) {
    const std::string name = "clipboard", file = (folder / name).string();
    try {
        return formats::read_yaml_text(text, file);
    } catch (const model::Errors& errors) {
        std::vector<model::Diagnostic> all = errors.diagnostics();
        for (auto& one : all)
            if (one.where.file && *one.where.file == file)
                one.where.file = std::make_shared<const std::string>(name);
        throw model::Errors(std::move(all));
    }
}

} // namespace

std::string copied(const model::Model& model, const std::string& system,
                   const std::vector<std::string>& names) {
    const model::System& from = system_at(model, system);
    model::Model part{.name = "clipboard"};
    for (const auto& block : from.blocks)
        if (std::ranges::find(names, block.name) != names.end()) part.root.blocks.push_back(block);
    for (const auto& name : names)
        if (!from.find_block(name))
            throw model::Errors(
                {{{}, model::joined(system, name), "there is no block of that path", "copy blocks alone"}});
    for (model::Connection wire : from.connections) {
        std::erase_if(wire.to, [&](const model::Endpoint& end) { return !part.root.find_block(end.block); });
        if (!wire.to.empty() && part.root.find_block(wire.from.block))
            part.root.connections.push_back(std::move(wire));
    }
    for (const model::NamedSignal& signal : from.signals)
        if (part.root.find_block(signal.of.block)) part.root.signals.push_back(signal);
    const std::string prefix = system.empty() ? "" : system + ".";
    const auto is_inside = [&](std::string& path) {
        if (!path.starts_with(prefix)) return false;
        path.erase(0, prefix.size());
        return part.root.find_block(path.substr(0, path.find('.'))) != nullptr;
    };
    for (model::Placement placement : model.layout.blocks)
        if (is_inside(placement.path)) part.layout.blocks.push_back(std::move(placement));
    for (model::Bends bends : model.layout.wires)
        if (is_inside(bends.path)) part.layout.wires.push_back(std::move(bends));
    return formats::canonical_yaml(part);
}

model::Operation pasted(const model::Model& model, const std::string& system, const std::string& text,
                        const std::filesystem::path& folder, model::Point at) {
    const model::Model part = read_clipboard(text, folder);
    const model::System& into = system_at(model, system);
    std::set<std::string> taken;
    for (const auto& block : into.blocks) taken.insert(block.name);
    for (const auto* ports : {&into.inputs, &into.outputs})
        for (const auto& port : *ports) taken.insert(port.name);
    for (const auto& signal : into.signals) taken.insert(signal.name);

    std::optional<model::Point> corner; // upper left one of what was copied
    for (const auto& placement : part.layout.blocks)
        if (placement.path.find('.') == std::string::npos)
            corner = corner ? model::Point{std::min(corner->x, placement.at.x),
                                           std::min(corner->y, placement.at.y)}
                            : placement.at;
    const auto moved = [&](model::Point p) {
        return model::Point{p.x - corner->x + at.x, p.y - corner->y + at.y};
    };

    namespace op = model::operations;
    op::Batch batch;
    std::map<std::string, std::string> names;
    double below = 0; // those without a place stand one below the other
    for (model::Block block : part.root.blocks) {
        const std::string name = fresh(block.name, taken);
        taken.insert(name);
        names[block.name] = name;
        const auto placed = std::ranges::find(part.layout.blocks, block.name, &model::Placement::path);
        const bool is_placed = placed != part.layout.blocks.end();
        block.name = name;
        batch.operations.emplace_back(op::Add{
            system, std::move(block), {}, is_placed ? moved(placed->at) : model::Point{at.x, at.y + below}});
        if (!is_placed) below += 80;
        if (is_placed) add_look(batch, model::joined(system, name), *placed);
    }
    const auto renamed = [&](const std::string& path) {
        const auto dot = std::min(path.find('.'), path.size());
        const auto found = names.find(path.substr(0, dot));
        return found == names.end() ? std::string() : model::joined(system, found->second + path.substr(dot));
    };
    for (const auto& placement : part.layout.blocks) { // inside of subsystems
        const std::string path = renamed(placement.path);
        if (path.empty() || placement.path.find('.') == std::string::npos) continue;
        batch.operations.emplace_back(op::Move{path, placement.at});
        add_look(batch, path, placement);
    }
    std::set<std::string> wired; // inputs, as the text calls them
    for (const auto& wire : part.root.connections)
        for (const auto& end : wire.to) {
            if (!names.contains(wire.from.block) || !names.contains(end.block)) continue;
            wired.insert(end.text());
            model::Endpoint from{names[wire.from.block], wire.from.port}, to{names[end.block], end.port};
            batch.operations.emplace_back(op::Connect{system, from.text(), to.text()});
        }
    for (const auto& [path, points, as_labels, comments, where] : part.layout.wires) {
        const std::string to = renamed(path);
        const bool is_inside = !part.root.find_block(model::split_last(path).first); // of a subsystem
        if (to.empty() || (!is_inside && !wired.contains(path))) continue;
        if (as_labels) batch.operations.emplace_back(op::Label{to, true});
        if (points.empty() || (!is_inside && !corner)) continue;
        op::Bend bend{to, points};
        if (!is_inside) std::ranges::transform(points, bend.points.begin(), moved);
        batch.operations.emplace_back(std::move(bend));
    }
    for (const auto& signal : part.root.signals) {
        if (!names.contains(signal.of.block)) continue;
        const std::string name = fresh(signal.name, taken);
        taken.insert(name);
        batch.operations.emplace_back(
            op::NameSignal{system, model::Endpoint{names[signal.of.block], signal.of.port}.text(), name});
    }
    return batch;
}

} // namespace bf::service
