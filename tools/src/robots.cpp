#include "robots.hpp"

#include "bundle.hpp"

#include "bf/engine/simulation.hpp"
#include "bf/toolbox/shared_world.hpp"
#include "bf/toolbox/simulated_robot.hpp"

#include <algorithm>

namespace bf::tools {

std::filesystem::path urdf_of(const Resolution& block) {
    const void* robot = block.find_provided(toolbox::RobotConfiguration::resource);
    return robot ? static_cast<const toolbox::RobotConfiguration*>(robot)->urdf : std::filesystem::path();
}

std::vector<std::pair<std::string, const physics::World*>> worlds_of(const Diagram& diagram) {
    std::vector<std::pair<std::string, const physics::World*>> worlds;
    for (const auto& node : diagram.nodes) {
        const auto* device = static_cast<const toolbox::RobotDevice*>(
            node.block->resolution().find_provided(toolbox::RobotDevice::resource));
        if (const auto* simulated = dynamic_cast<const toolbox::SimulatedDevice*>(device))
            worlds.emplace_back(node.path, &simulated->world());
    }
    return worlds;
}

std::vector<RunningRobot> robots_of(const Simulation& simulation) {
    const auto& nodes = simulation.diagram().nodes;
    std::vector<RunningRobot> robots;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto& declaration = nodes[n].block->declaration();
        for (std::size_t i = 0; i < declaration.objects.size(); ++i) {
            const int provision = declaration.objects[i].provision;
            if (provision < 0 || declaration.provisions[static_cast<std::size_t>(provision)].type !=
                                     toolbox::RobotDevice::resource)
                continue;
            RunningRobot robot{
                nodes[n].path,
                static_cast<const toolbox::RobotDevice*>(
                    nodes[n].block->resolution().find_provided(toolbox::RobotDevice::resource)),
                static_cast<toolbox::RobotConnection*>(
                    simulation.context().frame(static_cast<int>(n)).objects[i]),
                ""};
            const auto is_it = [&](const Node::End& from) {
                return from.node == static_cast<int>(n) && from.slot == provision;
            };
            for (const auto& user : nodes)
                if (user.type.substr(user.type.rfind('/') + 1).starts_with("Set") &&
                    std::ranges::any_of(user.providers, is_it))
                    robot.driven_by = user.path;
            if (const int tau = declaration.find("tau", Role::input);
                tau >= 0 && nodes[n].sources[static_cast<std::size_t>(tau)].node >= 0)
                robot.driven_by = nodes[n].path + ".tau";
            robots.push_back(std::move(robot));
        }
    }
    return robots;
}

std::vector<std::pair<std::string, const physics::Scene*>> shared_worlds_of(const Diagram& diagram) {
    std::vector<std::pair<std::string, const physics::Scene*>> worlds;
    for (const auto& node : diagram.nodes)
        if (const void* world = node.block->resolution().find_provided(toolbox::SharedWorld::resource))
            worlds.emplace_back(node.path, static_cast<const toolbox::SharedWorld*>(world)->scene.get());
    return worlds;
}

std::vector<std::filesystem::path> world_files_of(const Diagram& diagram) {
    std::vector<std::filesystem::path> files;
    for (const auto& [path, scene] : shared_worlds_of(diagram)) {
        for (const auto& robot : scene->options().robots) files.push_back(robot.options.urdf);
        for (const auto& object : scene->options().objects)
            if (!object.file.empty()) files.push_back(object.file);
    }
    return files;
}

bool has_world(const Diagram& diagram) {
    return !worlds_of(diagram).empty() || !shared_worlds_of(diagram).empty();
}

std::vector<std::pair<std::string, const toolbox::ContactSensor*>> contact_sensors_of(
    const Diagram& diagram, const physics::Scene& scene) {
    std::vector<std::pair<std::string, const toolbox::ContactSensor*>> sensors;
    for (const auto& node : diagram.nodes) {
        const auto* sensor = dynamic_cast<const toolbox::ContactSensor*>(node.block.get());
        if (sensor && &sensor->scene() == &scene && sensor->frame().body >= 0)
            sensors.emplace_back(node.path, sensor);
    }
    return sensors;
}

} // namespace bf::tools
