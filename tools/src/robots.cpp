#include "robots.hpp"

#include "bf/physics/figure.hpp"
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

std::optional<physics::ContactForce> axial_force(const Eigen::Vector3d& point,
                                                 const physics::Vector6d& wrench) {
    const Eigen::Vector3d force = wrench.head<3>(), moment = wrench.tail<3>();
    if (!(force.norm() >= 1)) return {};
    return physics::ContactForce{point + force.cross(moment) / force.squaredNorm(), force};
}

} // namespace bf::tools
