#pragma once

#include "bf/realtime/server.hpp"
#include "bf/service/protocol.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bf::service {

/// A run of another program, watched, tuned, started and stopped over its live server (see
/// bf/realtime/server.hpp). One connection for all pages, so that whatever they do the program has one
/// viewer; it is made again when it breaks.
class Live {
  public:
    /// All are called in a thread of its own.
    struct Listener {
        std::function<void(RunState)> state;      ///< whenever it changes, and with samples
        std::function<void(LiveReport)> report;   ///< whenever it changes
        std::function<void(std::string)> samples; ///< a binary frame of the protocol
    };

    /// `address` is ws://HOST:PORT/?token=TOKEN or unix:PATH?token=TOKEN. Throws std::runtime_error for one
    /// that is not so.
    Live(const std::string& address, Listener listener);
    ~Live();
    Live(const Live&) = delete;
    Live& operator=(const Live&) = delete;

    /// These wait for the program's answer. `page` asks, as its log tells. Throw std::runtime_error with the
    /// program's reason.
    void tune(const Tune& tune, int page);
    void command(Action action, int page); ///< start, stop or emergency stop
    void watch(std::vector<int> signals);  ///< by index
    /// Sends an edit, which `what` names. `then` is called in a thread of its own with what would be lost or
    /// why it cannot be; nothing: the program runs that model.
    void edit(const realtime::Edit& edit, const std::string& what, int page,
              std::function<void(std::optional<RunEdit>)> then);

    RunState state() const;
    LiveReport report() const;
    std::vector<SignalInfo> signals() const; ///< that are there
    int advertised() const;                  ///< how often the program has told of its signals

  private:
    struct Connection;
    std::unique_ptr<Connection> connection_;
};

} // namespace bf::service
