// A robot whose driver waits for it, behind a thread that does the waiting.
#pragma once

#include "bf/middleware/remote_robot.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::middleware {

/// Of a middleware whose calls take locks, use the heap or wait for the network: its thread makes them.
struct WaitingDriver {
    std::unique_ptr<toolbox::RobotDevice> device;
    std::unique_ptr<toolbox::RobotConnection> robot; ///< steps do not call it, so its calls may wait
    std::function<double()> time = nullptr;          ///< of its own clock when it has started, s; empty: 0
    /// Its own clock, asked in every look at it, s; empty: that of this computer goes on from `time`.
    std::function<double()> clock = nullptr;
    /// Of a robot that stands still until it is told to go on, such as a simulator; empty: it has a clock of
    /// its own. By how much it goes on in a step, s, once it has started; and lets it go on by that many
    /// steps, until it measures again: false where it does not, and its error() completes a sentence that
    /// begins with "it".
    std::function<double()> period = nullptr;
    std::function<bool(int steps)> advance = nullptr;
    /// Told before the start where the diagram has blocks that command the robot.
    std::function<void()> expect_commands = nullptr;
    /// Completes a sentence that says that no new state has come: why what came is none; the empty text:
    /// nothing did. Any thread asks it, when a run has failed.
    std::function<void(toolbox::RobotConnection::ErrorText&)> left_out = nullptr;
};

/// What users may say of its thread.
struct ThreadArguments {
    explicit ThreadArguments(Block* owner);
    Argument<double> interval, silence; ///< s
};

/// The link to it. The thread serves the robot as a program of its own would: every `interval` s it reads
/// all, and gives what was commanded; when no command has come for `silence` s, it takes the joints back. A
/// robot that can be advanced goes on with each command instead. `name` is how users call it.
std::unique_ptr<RobotLink> make_threaded_link(std::string name, WaitingDriver driver,
                                              const ThreadArguments& thread);

} // namespace bf::middleware
