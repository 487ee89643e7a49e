// Robots that programs serve to each other over UDP.
#pragma once

#include "bf/middleware/remote_robot.hpp"
#include "bf/middleware/robot_host.hpp"

#include <memory>
#include <string>

namespace bf::udp {

/// What is wrong with an address; empty: nothing. Port 0 is one that the system chooses, for this side alone.
std::string wrong_address(const std::string& address, bool may_choose = false);

/// Both sides of a robot. Addresses are PORT, of this computer alone, or HOST:PORT; `key` is a file of one
/// line that both sides have. Nothing is opened before start().
std::unique_ptr<middleware::RobotLink> make_link(const std::string& address, const std::string& key);
/// Makes the key where it is not there.
std::unique_ptr<middleware::RobotEnd> make_end(const std::string& address, const std::string& key);

} // namespace bf::udp
