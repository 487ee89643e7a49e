// Streams, clock and simulators of a YARP network.
#pragma once

#include "bf/toolbox/streams.hpp"

#include <memory>
#include <string>
#include <yarp/os/Contactable.h>

namespace bf::yarp {

/// Joins the network of YARP, until the program ends: YARP cannot be begun twice. Throws std::runtime_error
/// where no name server answers.
void join();
/// What to do where no name server is known.
inline constexpr char no_name_server[] = "no YARP name server is known; start `yarpserver --write`, or say "
                                         "where one is by `yarp conf HOST PORT`";

/// How others lead a simulator.
enum class Led {
    once_paused, ///< it runs freely until somebody pauses it, and again when he is gone
    always,      ///< it stands still until it is told to run, also when whoever told it is gone
    never,       ///< it runs by a clock of its own; who wants steps waits for them
};

/// The service ClockServer of Gazebo's plugins for YARP, at a port of that name.
class ClockServer : public toolbox::SimulatorServer {
  public:
    virtual int clients() const noexcept = 0; ///< connected
};

/// Throws std::runtime_error: the port has another program already, or does not open.
std::shared_ptr<ClockServer> serve_clock(const std::string& name, double step_size, Led led);

/// Does another program, or this one, have a port of that name?
bool is_there(const std::string& port);

/// Opens the port `wanted`, which messages call `name`. Throws std::runtime_error.
void open_port(::yarp::os::Contactable& port, const std::string& name, const std::string& wanted);

/// Ports. A reader whose name is that of a port which is there already is connected to it from a port without
/// a name; otherwise it is the port of that name, and others connect to it. A writer the same.
class Network final : public toolbox::StreamNetwork {
  public:
    std::shared_ptr<toolbox::StreamConnection> open() const override;
};

} // namespace bf::yarp
