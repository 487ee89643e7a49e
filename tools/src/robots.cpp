#include "robots.hpp"

#include "bf/toolbox/shared_world.hpp"
#include "bf/toolbox/simulated_robot.hpp"

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

std::vector<std::pair<std::string, const physics::Scene*>> shared_worlds_of(const Diagram& diagram) {
    std::vector<std::pair<std::string, const physics::Scene*>> worlds;
    for (const auto& node : diagram.nodes)
        if (const void* world = node.block->resolution().find_provided(toolbox::SharedWorld::resource))
            worlds.emplace_back(node.path, static_cast<const toolbox::SharedWorld*>(world)->scene.get());
    return worlds;
}

} // namespace bf::tools
