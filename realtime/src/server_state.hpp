// What the server and its sessions share. All of it is used in one thread, but for what the loop writes.
#pragma once

#include "bf/realtime/server.hpp"
#include "bf/realtime/web_socket.hpp"
#include "log.hpp"
#include "sample_ring.hpp"

#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <future>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

namespace bf::realtime {

namespace asio = boost::asio;
/// A port or a Unix socket.
using Protocol = asio::generic::stream_protocol;
using Json = nlohmann::json;

// What one viewer may take of the server's time, so that no other waits for it: so many bytes of questions
// and answers at once, and in the long run so many per tick. Those who ask for more are read from later.
constexpr std::ptrdiff_t bytes_at_once = 1 << 16, bytes_per_tick = 1 << 12, bytes_per_message = 1 << 6;
constexpr int most_unanswered = 100; // changes of parameters
constexpr std::size_t most_edit_bytes = std::size_t{4} << 20;

template <class AnyJson> std::string to_text(const AnyJson& json) {
    return json.dump(-1, ' ', false, AnyJson::error_handler_t::replace);
}

/// What a client says that makes no sense; goes back to it as a status message.
struct ClientError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

template <class T> T field(const Json& json, const char* name) {
    const auto at = json.find(name);
    if (at == json.end()) throw ClientError("the field '" + std::string(name) + "' is missing");
    try {
        return at->get<T>();
    } catch (const Json::exception&) {
        throw ClientError("the field '" + std::string(name) +
                          "' is of the wrong type: " + to_text(*at).substr(0, 200));
    }
}

/// What somebody calls himself or what he does, for a log: short, on one line.
std::string log_name(std::string text);

struct Server::State {
    struct Channel {
        explicit Channel(Json told) : advertised(std::move(told)) {}

        Json advertised;
        std::atomic<bool> is_wanted{false};
        int subscribers = 0;
        bool is_there = false; ///< in the run of now
    };
    /// Where a run has the signals of channels: what the loop looks at.
    class Table final : public Run::Observer {
      public:
        Table(State& state, const std::vector<Quantity>& signals);
        void observe(const Run& run) noexcept override;
        void tell_constants(); ///< again

        struct Row {
            Channel* channel;
            std::uint32_t number, bytes;
            int rate;
            const std::byte* data;
        };
        const std::vector<Row>& rows() const { return rows_; }

      private:
        State& state_;
        std::vector<Row> rows_;
    };
    struct Parameter {
        Type type;
        bool is_scalar;
        std::vector<double> values;
    };
    struct Session;
    class Edits;
    /// A viewer's wish to change parameters.
    struct Request {
        std::weak_ptr<Session> session;
        std::string who;
        Json id;
        std::vector<std::string> names;
    };

    State(Run& run, LoopAccess loop, const ServerOptions& options);
    ~State();

    void listen();
    void accept();
    void run_tick();
    void deliver();
    void tell_timing();
    /// What the loop has left is taken, and nothing more.
    void settle();
    void end(const std::string& failure, bool is_interrupted);
    std::vector<LogEntry> log_entries() const;
    void tell_log(const Log::Numbered& entry);
    void tell_log(const Log::Numbered& entry, Session& session) const;
    void exchange_parameters();
    void finish_change(const ParameterMailbox::Result& result);
    void post_change();
    void reject(const std::vector<Request>& requests, const std::string& reason);
    std::vector<ParameterValue> present_values() const;
    std::size_t viewers() const;
    Json parameters_json(const std::vector<std::string>& names) const;
    /// Starts or stops the run. Throws ClientError with the reason where that cannot be.
    void command(const std::string& service, const std::string& who);
    void require_control() const;

    /// The channel of a signal, which may have been there before.
    std::uint32_t channel_of(const std::string& topic, const Quantity& signal);
    Json advertisement() const;
    /// Names, parameters and their values are those of the run.
    void know_parameters();
    /// Empty, or why the model cannot be edited.
    std::string why_not_edited() const;

    static constexpr std::uint32_t timing_channel = 0, log_channel = 1; ///< the first two are no signals

    Run* run;
    const LoopAccess loop;
    ServerOptions options;
    std::vector<Quantity> tuned;                   ///< parameters
    std::deque<Channel> channels;                  // holds atomics: does not move them
    std::map<std::string, std::uint32_t> by_topic; ///< numbers of channels
    std::vector<std::string> names;                ///< of variables and parameters, in document order
    std::map<std::string, Parameter> parameters;
    SampleRing ring;
    std::atomic<std::uint64_t> lost_messages{0}, changes{0};
    std::atomic<double> time{0}; ///< of the last step, s

    asio::io_context io;
    const asio::executor_work_guard<asio::io_context::executor_type> stays{
        io.get_executor()}; ///< the log is asked for after the end, too
    asio::basic_socket_acceptor<Protocol> acceptor{io};
    std::string address, path; ///< of a Unix socket
    asio::steady_timer timer{io};
    bool is_accepting = false;
    std::vector<std::shared_ptr<Session>> sessions; ///< in the order of their arrival
    // Changes wait for the loop to take those under way, the newest value of each parameter.
    std::vector<Request> waiting, posted;
    std::vector<ParameterValue> waiting_values, posted_values;
    std::vector<ParameterValue> posted_parameters; ///< which follow from those values
    std::size_t longest_message = 0;               ///< bytes
    Json services, server_info;
    std::vector<ParameterValue> asked; ///< by viewers, so far
    Log log;
    int ticks = 0;
    Control::State told = Control::State::running; ///< to those who look at the timing
    std::string last_state, how_it_ended;          ///< "ended" or "failed", and a sentence; empty before
    std::promise<void> all_have_left;              ///< after the end
    std::unique_ptr<Edits> edits;
    std::unique_ptr<Table> first; ///< of the run that the server began with
    std::thread thread;
};

/// Edits of the model of the run, one at a time. All is used in the server's thread; what takes time is done
/// in another one.
class Server::State::Edits {
  public:
    explicit Edits(State& state) : state_(state) {}
    ~Edits() { end(); }
    Edits(const Edits&) = delete;
    Edits& operator=(const Edits&) = delete;

    struct Asked {
        std::weak_ptr<Session> session;
        std::uint32_t service, call;
        std::string head; ///< of the answer
        std::string who, what;
        Edit edit;
    };
    /// Throws ClientError with the reason where there can be no edit.
    void ask(const Json& request, Asked asked);
    void tick();
    /// The loop has ended: what it took is made, and nothing more.
    void end();
    bool is_busy() const { return phase_ != Phase::none; } ///< and no parameter may change
    Table& table() { return table_ ? *table_ : *state_.first; }
    std::int64_t count() const { return count_.load(); }

  private:
    enum class Phase { none, asked, preparing, posted, finishing };
    void work(std::function<void()> task);
    bool has_worked();
    void post();
    void take(std::int64_t step);
    void answer(bool is_made);

    State& state_;
    Phase phase_ = Phase::none;
    Asked asked_;
    Edited edited_;
    std::unique_ptr<Table> table_, next_table_; ///< of the run, where it comes from an edit
    std::atomic<std::int64_t> count_{0};
    std::atomic<bool> is_done_{false}; ///< the task
    std::thread worker_;
};

/// One viewer.
struct Server::State::Session : std::enable_shared_from_this<Session> {
    Session(State& state, WebSocket::Socket socket);

    void start();
    /// Reads the next message, as soon as this viewer's turn has come and it takes the answers it asked for.
    void read();
    void send(const Json& json);
    void send_sample(std::uint32_t channel, std::int64_t time, const std::vector<std::byte>& value);
    void send_data(std::uint32_t channel, std::int64_t time, std::string_view content);
    bool wants(std::uint32_t channel) const { return is_open && numbers[channel] >= 0; }
    Json values_message(const std::vector<std::string>& names, const Json& id) const;
    /// Says why, and what the parameters are.
    void reject(const Request& request, const std::string& reason);
    /// Reads nothing more, writes what waits and closes.
    void say_goodbye();
    /// Whatever waits for the network ends with an error then.
    void leave();
    void dismiss();
    void close(WebSocket::Close code, const std::string& reason);

    void shake_hands(const HttpRequest& request);
    void refuse(int status, const char* text);
    void handle(const WebSocket::Message& message);
    void handle_text(const std::string& text);
    void call_service(const std::string& bytes);
    void fail_call(std::uint32_t service, std::uint32_t call, const std::string& why);
    std::vector<std::string> names_or_all(const Json& json) const;
    void subscribe(std::uint32_t id, std::uint32_t channel);
    void unsubscribe(std::uint32_t id);
    void set_parameters(const Json& json);
    void status(int level, const std::string& message);
    std::string name_of(const Json& message) const;
    void answer(WebSocket::Message message);
    void write();

    State& state;
    const std::string peer; ///< where it is connected from
    const std::shared_ptr<WebSocket> socket;
    bool is_open = false, is_reading = false, is_writing = false, is_leaving = false;
    std::map<std::uint32_t, std::uint32_t> subscriptions; ///< the client's number -> channel
    std::vector<std::int64_t> numbers;                    ///< channel -> the client's number, or -1
    std::set<std::string> watched;                        ///< parameters
    std::deque<WebSocket::Message> answers, samples;      ///< not yet written
    std::size_t answer_bytes = 0, sample_bytes = 0;       ///< in these
    std::ptrdiff_t credit = 0;                            ///< bytes; see bytes_at_once
    int unanswered = 0;                                   ///< changes of parameters
    std::uint64_t lost = 0;
};

} // namespace bf::realtime
