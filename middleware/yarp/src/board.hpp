// The control boards of a YARP robot.
#pragma once

#include "bf/middleware/threaded_robot.hpp"

#include <string>
#include <vector>

namespace bf::yarp {

/// What says which joints of which boards a diagram drives.
struct BoardOptions {
    std::string robot;                       ///< prefix of the boards' ports, e.g. icubSim
    std::vector<std::string> boards;         ///< e.g. left_leg, of /icubSim/left_leg
    std::vector<std::string> joints;         ///< in the order of the diagram
    std::string local;                       ///< prefix of our own ports; empty: one that nobody else has
    std::vector<std::string> wrenches, imus; ///< "sensor=/port" each, which streams 6 or 12 numbers
    std::string simulator; ///< port of the ClockServer by which the robot goes on; empty: it goes by itself
    std::string carrier;   ///< of states and commands; what is asked and answered goes by tcp
    double start_timeout;  ///< for which the start waits for boards, s
};

/// A driver over `remotecontrolboardremapper`, whose calls wait. Nothing is opened yet.
middleware::WaitingDriver make_driver(const BoardOptions& options);

} // namespace bf::yarp
