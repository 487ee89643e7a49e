// Live signals, parameters and the cockpit of a loop for viewers.
#pragma once

#include "bf/realtime/runner.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bf::realtime {

/// Who did what to a run.
struct LogEntry {
    double clock; ///< s since 1970
    double time;  ///< s of the model, of the last step before
    /// As far as it is known: what the viewer calls itself, and where it is connected from, e.g. "page 1 of
    /// ada@desk at 127.0.0.1:51234".
    std::string who;
    std::string what; ///< "k = 2, was 0.3", "start", "stop", "emergency stop"
};

/// The last twenty entries, a line each, for a terminal.
std::string log_text(const std::vector<LogEntry>& log);
/// Whoever ended the run: the entry of the emergency stop, else of the stop; null where the log has neither.
const LogEntry* stop_in(const std::vector<LogEntry>& log);
/// "emergency stop by WHO", where there was one; else empty.
std::string emergency_in(const std::vector<LogEntry>& log);

/// What a viewer has made of the model of a run.
struct Edit {
    std::string text = {};                         ///< of the model
    std::map<std::string, std::string> files = {}; ///< of models that it refers to, by paths from its folder
    /// By the path of a block, a subsystem or a state of a chart the one that it had in the run; none: it is
    /// new. Others kept theirs.
    std::map<std::string, std::optional<std::string>> origins = {};
    bool is_by_hand = false;   ///< was it written by hand, so that nothing is known of names that changed?
    bool is_late = false;      ///< has somebody else edited the run meanwhile?
    bool accepts_loss = false; ///< is what is lost known?
};

/// What would become of a run by an edit.
struct Edited {
    std::string refusal = {};                   ///< why it cannot be
    std::vector<std::string> lost = {};         ///< states that cannot be taken over, with the reason
    std::vector<std::string> begun = {};        ///< states that begin with their initial values
    std::vector<std::string> unclear = {};      ///< whose states these are, and what is taken for true
    Successor* successor = nullptr;             ///< where the edit is to be made
    std::vector<Run::Observer*> observers = {}; ///< that see its steps, besides the server
    std::vector<ParameterValue> asked = {};     ///< values of before that hold in it
};

/// Whoever knows how to edit the model of a run. Both are called in a thread beside server and loop, in
/// turns.
class Editing {
  public:
    virtual ~Editing() = default;
    /// Prepares an edit of the run that is there. It is made, as soon as the loop can, where nothing is lost
    /// and nothing unclear, or the viewer accepts that. `asked`: values that viewers have set, in that order.
    virtual Edited prepare(const Edit& edit, const std::vector<ParameterValue>& asked) = 0;
    /// Afterwards, where there is a successor: it has taken over, and the run before is not needed any more;
    /// or it has not.
    virtual void finish(bool has_taken_over) = 0;
};

struct ServerOptions {
    std::string where = "8765"; ///< a port of this computer, 0 for any free one; or "unix:PATH"
    std::string token = {};     ///< which viewers must know; made if it is empty
    bool is_controlled = false; ///< may viewers change parameters, start and stop the run?
    std::size_t most_viewers = 32, most_strangers = 16; ///< connections that told the token, or did not yet
    std::size_t buffer_bytes = std::size_t{4} << 20;    ///< between the loop and the server
    std::size_t client_bytes = std::size_t{4} << 20;    ///< waiting for one viewer; older samples are lost
    /// Told, in the server's thread, what parameters became before that step, and who asked for it.
    std::function<void(std::int64_t step, const std::vector<ParameterValue>& values, const std::string& who)>
        on_change = {};
    /// Told, in the server's thread, of a start or a stop.
    std::function<void(const LogEntry& entry)> on_control = {};
    Editing* editing = nullptr; ///< which outlives the server; none: the model cannot be edited
    /// Then: why.
    std::string why_not_edited =
        "this program was started without --editable, so edits change the file alone; start it with "
        "--editable to let them act in the run";
    /// Told, in the server's thread, of an edit that acts from that step on.
    std::function<void(std::int64_t step, const LogEntry& entry)> on_edit = {};
};

/// Empty, or why no server can be at such a place.
std::string check_place(const std::string& where);

// ---- what the server adds to the Foxglove WebSocket protocol, in that protocol's own terms ----

/// A channel of JSON objects: {"state", "end", "time"} and all of `statistics_json`, a few times a second.
/// The states are those of Control, and in the last message "ended" or "failed"; `end` says there how it
/// ended.
inline constexpr const char* timing_topic = "/live.timing";
/// A channel of JSON objects of the schema foxglove.Log, with "number" and "time" [s of the model] added:
/// what has been done to the run; `name` is who did it. Who subscribes gets the last thousand. An entry comes
/// again with the same number when the same viewer changed the same value again within two seconds.
inline constexpr const char* log_topic = "/live.log";
/// Services without a request but {"who": "..."}, which may be left out.
inline constexpr const char *start_service = "start", *stop_service = "stop",
                            *emergency_service = "emergency_stop";
/// Service that edits the model of the run, which goes on with it between two steps: {"who", "what": names
/// the edit, "after": how many edits the viewer knows of, "model": text, "files": {PATH: text}, "origins":
/// {PATH: PATH or null}, "is_by_hand", "accepts_loss"}, see Edit. PATHs of files are relative to the model's
/// folder. The answer: {"success": true, "is_made", "refusal", "lost", "begun", "unclear", "edits": how many
/// there were}, see Edited. No file is opened whose name it gives.
inline constexpr const char* edit_service = "edit";
/// In the server's metadata, where viewers may change nothing: why.
inline constexpr const char* refusal_key = "read only";
/// Likewise, where the model cannot be edited.
inline constexpr const char* edit_refusal_key = "not editable";

/// Serves signals and parameters of a run to viewers on this computer, by the Foxglove
/// WebSocket protocol (https://github.com/foxglove/ws-protocol, subprotocols foxglove.websocket.v1 and
/// foxglove.sdk.v1): one channel per signal with the schema of its recording, parameters by the name
/// "block.parameter", and variables of the model, with which all parameters change that follow from them (see
/// bf::Run::follow). A variable that is fixed is refused with the reason. What the loop counts and what was
/// done to the run are channels, too; start, stop and emergency stop are services (see Control). Where
/// `is_controlled` is false, viewers look: every change and service is refused with the remedy.
///
/// The loop does nothing but copy subscribed samples into a buffer and look whether a change of parameters is
/// there; it calls no system function for it. A viewer that is slow, stalled or gone loses its oldest
/// messages, which are counted, and delays no other: each has queues of its own, and a bounded share of the
/// server's time. Changes that arrive before the loop has taken the last ones join, the newest value of each
/// parameter counts. A viewer may say in "who" of a setParameters message what the log calls it.
///
/// Listens on 127.0.0.1 alone, or at a Unix socket of mode 0600. Every user of this computer and every page
/// in a browser can reach a port, also one that a tunnel leads to the socket, so the address must hold the
/// token.
class Server final : public Run::Observer {
  public:
    /// Listens at once; the parameters have their present values. Throws std::runtime_error when the place or
    /// a token cannot be had.
    Server(Run& run, const std::vector<Quantity>& signals, LoopAccess loop,
           const ServerOptions& options = {});
    ~Server(); ///< closes connections that are still there
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    void observe(const Run& run) noexcept override;
    /// The run has ended: viewers get what waits for them, and the last message of the timing. In order, with
    /// who stopped it, or else for this reason, which is no stop of a viewer. Their connections are
    /// closed (1001, going away), for which it waits 0.3 s at most. Any thread may call it, once.
    void end(const std::string& failure, bool is_interrupted);

    /// For viewers, up to the token: "ws://127.0.0.1:8765/?token=", "unix:/run/motor.sock?token=".
    std::string address() const;
    const std::string& token() const;
    struct Counts {
        std::uint64_t lost_samples;  ///< the server was too slow
        std::uint64_t lost_messages; ///< a viewer was too slow
        std::uint64_t changes;       ///< of parameters that were applied
        std::uint64_t edits;         ///< that were made
    };
    Counts counts() const;
    std::vector<LogEntry> log() const; ///< the last thousand

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace bf::realtime
