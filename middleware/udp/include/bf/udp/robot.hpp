// Robots that programs serve to each other over UDP.
#pragma once

#include "bf/middleware/remote_robot.hpp"
#include "bf/middleware/robot_host.hpp"

#include <memory>
#include <string>

namespace bf::udp {

/// What is wrong with an address; empty: nothing.
std::string wrong_address(const std::string& address);

/// Both sides of a robot. Addresses are PORT, of this computer alone, or HOST:PORT; `key` is a file of one
/// line that both sides have. Nothing is opened before start().
std::unique_ptr<middleware::RobotLink> make_link(const std::string& address, const std::string& key);
/// Makes the key where it is not there.
std::unique_ptr<middleware::RobotEnd> make_end(const std::string& address, const std::string& key);

} // namespace bf::udp
