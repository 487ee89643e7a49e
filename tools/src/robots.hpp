// What the program knows about robots; in a build without them (BF_ROBOTS) nothing.
#pragma once

#include "bf/core/resolution.hpp"
#include "bf/elaborate/diagram.hpp"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace bf::physics {
class Scene;
class World;
} // namespace bf::physics
namespace bf::toolbox {
class ContactSensor;
class RobotConnection;
class RobotDevice;
} // namespace bf::toolbox
namespace bf {
class Simulation;
}

namespace bf::tools {

/// The URDF of the robot that the block provides; empty if it provides none.
std::filesystem::path urdf_of(const Resolution& block);

/// The physics worlds of a diagram with the paths of their blocks.
std::vector<std::pair<std::string, const physics::World*>> worlds_of(const Diagram& diagram);

/// A robot that a block of a running diagram provides.
struct RunningRobot {
    std::string path; ///< of the block
    const toolbox::RobotDevice* device;
    toolbox::RobotConnection* connection;
    std::string driven_by; ///< block of the diagram that commands it; empty: none does
};
std::vector<RunningRobot> robots_of(const Simulation& simulation);

/// Those that several robots share.
std::vector<std::pair<std::string, const physics::Scene*>> shared_worlds_of(const Diagram& diagram);

/// Is there any of them, that is, something to look at?
bool has_world(const Diagram& diagram);

/// The sensors of contacts on what moves in a Scene, with the paths of their blocks.
std::vector<std::pair<std::string, const toolbox::ContactSensor*>> contact_sensors_of(
    const Diagram& diagram, const physics::Scene& scene);

} // namespace bf::tools
