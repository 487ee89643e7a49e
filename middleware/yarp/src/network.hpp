// Streams, clock and simulators of a YARP network.
#pragma once

#include "bf/toolbox/streams.hpp"

#include <memory>

namespace bf::yarp {

/// Joins the network of YARP, until the program ends: YARP cannot be begun twice. Throws std::runtime_error
/// where no name server answers.
void join();

/// Ports. A reader whose name is that of a port which is there already is connected to it from a port without
/// a name; otherwise it is the port of that name, and others connect to it. A writer the same.
class Network final : public toolbox::StreamNetwork {
  public:
    std::shared_ptr<toolbox::StreamConnection> open() const override;
};

} // namespace bf::yarp
