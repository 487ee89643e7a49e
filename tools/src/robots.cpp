#include "robots.hpp"

#include "bf/toolbox/robot.hpp"

namespace bf::tools {

std::filesystem::path urdf_of(const ProvisionDeclaration& provision) {
    if (provision.type != toolbox::RobotConfiguration::resource || !provision.made) return {};
    return static_cast<const toolbox::RobotConfiguration*>(provision.made.get())->urdf;
}

} // namespace bf::tools
