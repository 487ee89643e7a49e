// Robots that programs of one user on one computer serve to each other through shared memory.
#pragma once

#include "bf/middleware/remote_robot.hpp"
#include "bf/middleware/robot_host.hpp"

#include <memory>
#include <string>

namespace bf::shared_memory {

/// What is wrong with the name of a robot; empty: nothing.
std::string wrong_name(const std::string& name);

/// Both sides of a robot of that name. Nothing is opened before start().
std::unique_ptr<middleware::RobotLink> make_link(const std::string& name);
std::unique_ptr<middleware::RobotEnd> make_end(const std::string& name);

} // namespace bf::shared_memory
