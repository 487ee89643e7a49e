// Live signals and parameters for viewers.
#pragma once

#include "bf/realtime/runner.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::realtime {

struct ServerOptions {
    std::uint16_t port = 8765;                       ///< 0: any free one
    std::size_t buffer_bytes = std::size_t{4} << 20; ///< between the loop and the server
    std::size_t client_bytes = std::size_t{4} << 20; ///< waiting for one viewer; what is more is lost
    /// Told, in the server's thread, what parameters became before that step.
    std::function<void(std::int64_t step, const std::vector<ParameterValue>& values)> on_change = {};
};

/// Serves signals and parameters of a running simulation to viewers on this computer, by the Foxglove
/// WebSocket protocol (https://github.com/foxglove/ws-protocol, subprotocols foxglove.websocket.v1 and
/// foxglove.sdk.v1): one channel per signal with the schema of its recording, parameters by the name
/// "block.parameter", and variables of the model, with which all parameters change that follow from them (see
/// bf::Tuning). A variable that is fixed is refused with the reason.
///
/// The loop does nothing but copy subscribed samples into a buffer and look whether a change of parameters is
/// there; it calls no system function for it. A viewer that is slow, stalled or gone loses messages, which
/// are counted. Listens on 127.0.0.1 alone, and refuses pages of other web sites.
class Server final : public Simulation::Observer {
  public:
    /// Listens at once; the parameters have their present values. Throws std::runtime_error when the port
    /// cannot be had.
    Server(Simulation& simulation, const std::vector<SignalName>& signals, ParameterMailbox& parameters,
           const ServerOptions& options = {});
    ~Server(); ///< closes all connections
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    void observe(const Simulation& simulation) noexcept override;

    std::uint16_t port() const;
    struct Counts {
        std::uint64_t lost_samples;  ///< the server was too slow
        std::uint64_t lost_messages; ///< a viewer was too slow
        std::uint64_t changes;       ///< of parameters that were applied
    };
    Counts counts() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace bf::realtime
