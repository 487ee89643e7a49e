#include "robots.hpp"

#include "bf/toolbox/robot.hpp"

namespace bf::tools {

std::filesystem::path urdf_of(const Resolution& block) {
    const void* robot = block.find_provided(toolbox::RobotConfiguration::resource);
    return robot ? static_cast<const toolbox::RobotConfiguration*>(robot)->urdf : std::filesystem::path();
}

} // namespace bf::tools
