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
    std::string token = {};                             ///< which viewers must know; made if it is empty
    std::uint16_t port = 8765;                          ///< 0: any free one
    std::size_t most_viewers = 32, most_strangers = 16; ///< connections that told the token, or did not yet
    std::size_t buffer_bytes = std::size_t{4} << 20;    ///< between the loop and the server
    std::size_t client_bytes = std::size_t{4} << 20;    ///< waiting for one viewer; older samples are lost
    /// Told, in the server's thread, what parameters became before that step.
    std::function<void(std::int64_t step, const std::vector<ParameterValue>& values)> on_change = {};
};

/// Serves signals and parameters of a run to viewers on this computer, by the Foxglove
/// WebSocket protocol (https://github.com/foxglove/ws-protocol, subprotocols foxglove.websocket.v1 and
/// foxglove.sdk.v1): one channel per signal with the schema of its recording, parameters by the name
/// "block.parameter", and variables of the model, with which all parameters change that follow from them (see
/// bf::Run::follow). A variable that is fixed is refused with the reason.
///
/// The loop does nothing but copy subscribed samples into a buffer and look whether a change of parameters is
/// there; it calls no system function for it. A viewer that is slow, stalled or gone loses its oldest
/// messages, which are counted, and delays no other: each has queues of its own, and a bounded share of the
/// server's time. Changes that arrive before the loop has taken the last ones join, the newest value of each
/// parameter counts.
///
/// Listens on 127.0.0.1 alone. Every user of this computer and every page in a browser can reach that, so the
/// address must hold the token: ws://127.0.0.1:8765/?token=TOKEN.
class Server final : public Run::Observer {
  public:
    /// Listens at once; the parameters have their present values. Throws std::runtime_error when the port or
    /// a token cannot be had.
    Server(Run& run, const std::vector<Quantity>& signals, ParameterMailbox& parameters,
           const ServerOptions& options = {});
    ~Server(); ///< closes all connections
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    void observe(const Run& run) noexcept override;

    std::uint16_t port() const;
    const std::string& token() const;
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
