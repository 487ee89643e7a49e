// A robot whose driver waits for it, behind a thread that does the waiting.
#pragma once

#include "bf/middleware/remote_robot.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf::middleware {

/// Of a middleware whose calls take locks, use the heap or wait for the network: its thread makes them.
struct WaitingDriver {
    std::unique_ptr<toolbox::RobotDevice> device;
    std::unique_ptr<toolbox::RobotConnection> robot; ///< steps do not call it, so its calls may wait
};

/// The link to it. The thread serves the robot as a program of its own would: every `period` s it reads all,
/// and gives what was commanded; when no command has come for `watchdog` s, it takes the joints back. `name`
/// is how users call it.
std::unique_ptr<RobotLink> make_threaded_link(std::string name, WaitingDriver driver, double period,
                                              double watchdog);

} // namespace bf::middleware
