#include "live.hpp"

#include "bf/base/value_text.hpp"
#include "bf/realtime/server.hpp"
#include "bf/realtime/web_socket.hpp"
#include "bf/recording/message.hpp"
#include "frame.hpp"
#include "json.hpp"
#include "recordings.hpp"

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <pwd.h>
#include <set>
#include <thread>
#include <unistd.h>

namespace bf::service {

namespace {

namespace asio = boost::asio;
using realtime::WebSocket;
using tcp = asio::ip::tcp;

constexpr auto between_frames = std::chrono::milliseconds(30);
constexpr auto patience = std::chrono::seconds(2);        ///< until an answer
constexpr auto before_again = std::chrono::seconds(1);    ///< until the next attempt to connect
constexpr std::size_t most_entries = 100;                 ///< of the log
constexpr std::size_t most_bytes = std::size_t{64} << 20; ///< of a message

struct Address {
    std::string host, port; ///< of a port
    std::string path;       ///< of a Unix socket
    std::string target;

    std::string place() const { return path.empty() ? host + ":" + port : path; }
};

Address parsed(const std::string& text) {
    constexpr std::string_view scheme = "ws://", unix_scheme = "unix:";
    const auto query = text.find("?token=");
    if (text.starts_with(unix_scheme) && query != text.npos && query > unix_scheme.size())
        return {"", "", text.substr(unix_scheme.size(), query - unix_scheme.size()),
                "/" + text.substr(query)};
    const auto slash = text.find('/', scheme.size());
    const auto colon = text.rfind(':', slash);
    if (!text.starts_with(scheme) || slash == text.npos || colon == text.npos || colon < scheme.size())
        throw std::runtime_error("'" + text +
                                 "' is no address of a live program; give the one that it printed, "
                                 "ws://HOST:PORT/?token=TOKEN or unix:PATH?token=TOKEN");
    return {text.substr(scheme.size(), colon - scheme.size()), text.substr(colon + 1, slash - colon - 1), "",
            text.substr(slash)};
}

/// What logs call a page of this process, "page 3 of ada@desk (4711)", in two parts around its number.
constexpr std::string_view before_page = "page ";
std::string name_after_page() {
    const passwd* const user = ::getpwuid(::getuid());
    char host[256] = "";
    ::gethostname(host, sizeof host - 1);
    return " of " + std::string(user ? user->pw_name : "somebody") + "@" + host + " (" +
           std::to_string(::getpid()) + ")";
}

/// Why a connection that was taken leads to no program.
std::string refusal_of(const std::string& place, const WebSocket::Refusal& refusal) {
    if (refusal.status == 403)
        return "the program at " + place +
               " does not let this page in; give the whole address that it printed, with the token";
    if (refusal.status > 0)
        return "what answers at " + place + " refuses the connection: " + std::to_string(refusal.status) +
               " " + refusal.body;
    if (!refusal.is_http)
        return "what answers at " + place + " is no program of BlockFactory: " + refusal.error;
    return "nothing answers behind " + place +
           ": the program may have ended while a tunnel still listens there";
}

} // namespace

struct Live::Connection {
    Connection(const std::string& text, Listener l) : address(parsed(text)), listener(std::move(l)) {
        state.live.emplace();
        state.live->message = "connecting …";
        connect();
        thread = std::thread([this] { io.run(); });
    }
    ~Connection() {
        asio::post(io, [this] { io.stop(); });
        thread.join();
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    // ---- the connection, in its thread ----

    void connect() {
        WebSocket::Error error;
        WebSocket::Socket connected(io);
        if (address.path.empty()) {
            tcp::socket socket(io);
            tcp::resolver resolver(io);
            asio::connect(socket, resolver.resolve(address.host, address.port, error), error);
            if (!error) socket.set_option(tcp::no_delay(true), error);
            if (!error) connected = std::move(socket);
        } else if (address.path.size() < sizeof(sockaddr_un::sun_path)) {
            connected.connect(asio::local::stream_protocol::endpoint(address.path), error);
        } else {
            error = asio::error::name_too_long;
        }
        socket = std::make_shared<WebSocket>(std::move(connected));
        if (error) return lose("the program at " + address.place() + " is not there: " + error.message());
        const std::string host = address.path.empty() ? address.place() : "localhost";
        socket->connect(host, address.target, "foxglove.websocket.v1", patience, [this](const auto* refusal) {
            if (refusal) return lose(refusal_of(address.place(), *refusal));
            queue.clear();
            is_writing = false;
            subscribed.clear();
            services.clear();
            channels.clear();
            timing_channel = log_channel = {};
            edits = 0;
            {
                const std::lock_guard lock(mutex);
                infos.clear();
                state.time = state.reached = 0;
                state.tuned.clear();
                report = {};
            }
            tell_report();
            read();
            tick();
        });
    }

    /// Whoever has told how it ended is looked for as well, since it may be started again.
    void lose(std::string why) {
        timer.cancel();
        const auto& timing = report.timing; // only this thread writes it
        const bool has_ended = timing && !timing->end.empty();
        if (has_ended) why = timing->end;
        enter(has_ended && timing->state == "ended" ? Running::ended : Running::failed, why);
        if (waiting) fail(*waiting, why);
        waiting.reset();
        for (const auto& [number, done] : calls) fail(*done, why);
        calls.clear();
        for (const auto& [number, then] : std::exchange(edit_calls, {})) then(RunEdit{why});
        again.expires_after(before_again);
        again.async_wait([this](auto error) {
            if (!error) connect();
        });
    }

    void enter(Running running, const std::string& message) {
        {
            const std::lock_guard lock(mutex);
            state.state = running;
            state.message = message;
            state.live->message = message;
        }
        tell();
    }
    void tell() { listener.state(copy()); }
    void tell_report() {
        std::unique_lock lock(mutex);
        const LiveReport told = report;
        lock.unlock();
        listener.report(told);
    }
    RunState copy() const {
        const std::lock_guard lock(mutex);
        return state;
    }

    void tick() {
        timer.expires_after(between_frames);
        timer.async_wait([this](auto error) {
            if (error) return;
            if (!frame.empty()) {
                listener.samples(std::exchange(frame, {}));
                tell();
            }
            tick();
        });
    }

    void read() {
        socket->read(most_bytes, [this](auto error, const auto& message) {
            if (error) return lose("the connection to the program is lost: " + error.message());
            try {
                message.is_text ? hear(message.bytes) : take(message.bytes);
            } catch (const std::exception&) { // it is none of the protocol
            }
            read();
        });
    }

    void send(const Json& json) {
        queue.push_back({json.dump(-1, ' ', false, Json::error_handler_t::replace)});
        write();
    }
    void write() {
        if (is_writing || queue.empty()) return;
        is_writing = true;
        socket->write(std::move(queue.front()), [this, of = socket.get()](auto error) {
            if (of != socket.get()) return; // there is a new connection
            is_writing = false;
            if (!error) write(); // otherwise the read says why
        });
        queue.pop_front();
    }

    void hear(const std::string& text) {
        const Json json = Json::parse(text, nullptr, false);
        if (!json.is_object()) return;
        const std::string op = json.value("op", "");
        if (op == "serverInfo") {
            const std::lock_guard lock(mutex);
            state.live->name = json.value("name", "");
            const Json metadata = json.value("metadata", Json::object());
            state.live->refusal = metadata.value(realtime::refusal_key, "");
            state.live->edit_refusal = metadata.value(realtime::edit_refusal_key, "");
        } else if (op == "advertise") {
            advertise(json);
        } else if (op == "unadvertise") {
            const std::lock_guard lock(mutex);
            for (const auto& number : json.value("channelIds", std::vector<std::uint32_t>())) {
                subscribed.erase(number);
                if (const auto gone = channels.extract(number))
                    std::erase_if(infos,
                                  [&](const auto& info) { return info.index == gone.mapped().second; });
            }
        } else if (op == "advertiseServices") {
            for (const auto& service : json.value("services", Json::array()))
                services[service.value("name", "")] = service.value("id", std::uint32_t{0});
            enter(Running::running, ""); // this comes last
        } else if (op == "serviceCallFailure") {
            const auto number = json.value("callId", std::uint32_t{0});
            const std::string why = json.value("message", "");
            if (const auto done = calls.extract(number)) fail(*done.mapped(), why);
            if (const auto then = edit_calls.extract(number)) then.mapped()(RunEdit{why});
        } else if (op == "status" && json.value("level", 0) == 2) {
            refusal = json.value("message", "");
        } else if (op == "parameterValues") {
            hear_parameters(json);
        }
    }

    /// What is there at the beginning, and what an edit brings.
    void advertise(const Json& json) {
        {
            const std::lock_guard lock(mutex);
            ++advertised;
            for (const auto& channel : json.value("channels", Json::array())) {
                const std::string topic = channel.value("topic", "");
                const auto number = channel.value("id", std::uint32_t{0});
                if (topic == realtime::timing_topic) timing_channel = number;
                if (topic == realtime::log_topic) log_channel = number;
                const auto info = recording::channel_of(channel.value("schemaName", ""));
                if (!info || info->elements() > most_bytes / sizeof(double)) continue;
                const int index = next_index++;
                channels[number] = {*info, index};
                infos.push_back(described(index, recording::signal_of(topic), *info));
            }
        }
        subscribe();
        send({{"op", "getParameters"}, {"id", "all"}, {"parameterNames", Json::array()}});
    }

    /// Of all parameters and variables at the beginning, later of those that change.
    void hear_parameters(const Json& json) {
        std::vector<std::string> heard;
        const std::string id = json.value("id", "");
        {
            const std::lock_guard lock(mutex);
            if (id == "all") state.tuned.clear();
            for (const auto& parameter : json.value("parameters", Json::array())) {
                if (!parameter.is_object() || !parameter.contains("value")) continue;
                Tune told{parameter.value("name", ""), numbers_in(parameter["value"])};
                heard.push_back(told.name);
                const auto known = std::ranges::find(state.tuned, told.name, &Tune::name);
                (known != state.tuned.end() ? *known : state.tuned.emplace_back()) = std::move(told);
            }
        }
        if (id == "all") send({{"op", "subscribeParameterUpdates"}, {"parameterNames", heard}});
        tell();
        if (id != "tune" || !waiting) return;
        if (refusal.empty())
            waiting->set_value();
        else
            fail(*waiting, refusal);
        waiting.reset();
    }

    /// JSON has no infinity: the server tells it by name.
    static std::vector<double> numbers_in(const Json& value) {
        std::vector<double> numbers;
        for (const auto& element : value.is_array() ? value : Json::array({value})) {
            double number = 0;
            if (element.is_number()) numbers.push_back(element.get<double>());
            if (element.is_boolean()) numbers.push_back(element.get<bool>() ? 1 : 0);
            if (element.is_string() && read_value(element.get<std::string>(), number).empty())
                numbers.push_back(number);
        }
        return numbers;
    }

    static void fail(std::promise<void>& done, const std::string& why) {
        done.set_exception(std::make_exception_ptr(std::runtime_error(why)));
    }

    void hear_timing(const std::string& text) {
        Timing timing;
        Json json = Json::parse(text);
        edits = json.value("edits", edits);
        json.erase("edits"); // which is no timing
        from_json(json, timing);
        {
            const std::lock_guard lock(mutex);
            report.timing = std::move(timing);
        }
        tell_report();
    }

    void hear_entry(const std::string& text) {
        const Json json = Json::parse(text);
        const Json clock = json.value("timestamp", Json::object());
        LiveEntry entry{json.value("number", std::int64_t{0}),
                        clock.value("sec", 0.0) + clock.value("nsec", 0.0) / 1e9,
                        json.value("time", 0.0),
                        json.value("name", ""),
                        json.value("message", ""),
                        {}};
        entry.page = page_in(entry.who);
        {
            const std::lock_guard lock(mutex);
            auto& log = report.log;
            std::erase_if(log, [&](const LiveEntry& other) { return other.number == entry.number; });
            if (log.size() == most_entries) log.erase(log.begin());
            log.push_back(std::move(entry));
        }
        tell_report();
    }

    using Then = std::function<void(std::optional<RunEdit>)>;

    void hear_edit(const std::string& message, const Then& then) {
        const Json json =
            Json::parse(message.substr(std::min(message.find('{'), message.size())), nullptr, false);
        if (!json.is_object()) return then(RunEdit{"the program does not say what became of the edit"});
        const std::vector<std::string> none;
        edits = json.value("edits", edits);
        RunEdit edit{json.value("refusal", ""), json.value("lost", none), json.value("begun", none),
                     json.value("unclear", none)};
        const bool is_held = !edit.refusal.empty() || !edit.lost.empty() || !edit.unclear.empty();
        then(json.value("is_made", false) || !is_held ? std::nullopt : std::optional(std::move(edit)));
    }

    /// Message data: opcode 1, the number of the subscription, which is that of the channel, the time in ns,
    /// CDR with the values behind its prefix.
    void take(const std::string& message) {
        constexpr std::size_t header = 1 + 4 + 8, begin = header + recording::message_prefix_bytes;
        if (message.size() < header) return;
        std::uint32_t number = 0;
        std::int64_t time = 0;
        std::memcpy(&number, &message[1], 4);
        std::memcpy(&time, &message[5], 8);
        if (message[0] == 3) { // of a service: its number and that of the call
            std::memcpy(&number, &message[5], 4);
            if (const auto then = edit_calls.extract(number)) return hear_edit(message, then.mapped());
            if (const auto done = calls.extract(number)) done.mapped()->set_value();
            return;
        }
        if (message[0] != 1) return;
        if (number == timing_channel) return hear_timing(message.substr(header));
        if (number == log_channel) return hear_entry(message.substr(header));
        const auto found = channels.find(number);
        if (found == channels.end() || message.size() < begin) return;
        const auto& [info, index] = found->second;
        if (message.size() < begin + info.bytes()) return;
        append_piece(frame, static_cast<std::uint32_t>(index), 0, info.elements(),
                     static_cast<double>(time) / 1e9);
        const auto* const elements = reinterpret_cast<const std::byte*>(&message[begin]);
        for (std::size_t i = 0; i < info.elements(); ++i)
            append(frame, recording::element_at(info.type, elements, i));
        const std::lock_guard lock(mutex);
        state.time = state.reached = std::max(state.time, static_cast<double>(time) / 1e9);
    }

    void subscribe() {
        Json added = Json::array(), removed = Json::array();
        for (const auto& always : {timing_channel, log_channel})
            if (always && subscribed.insert(*always).second)
                added.push_back({{"id", *always}, {"channelId", *always}});
        for (const auto& [number, channel] : channels) {
            const bool is_wanted = wanted.contains(channel.second);
            if (is_wanted && subscribed.insert(number).second)
                added.push_back({{"id", number}, {"channelId", number}});
            if (!is_wanted && subscribed.erase(number) > 0) removed.push_back(number);
        }
        if (!added.empty()) send({{"op", "subscribe"}, {"subscriptions", added}});
        if (!removed.empty()) send({{"op", "unsubscribe"}, {"subscriptionIds", removed}});
    }

    using Done = std::shared_ptr<std::promise<void>>;

    std::string name_of(int page) const {
        return (page > 0 ? std::string(before_page) + std::to_string(page) : "the file") + after_page;
    }
    std::optional<int> page_in(const std::string& who) const {
        int page = 0;
        const char* const end = who.data() + who.size();
        if (!who.starts_with(before_page)) return {};
        const auto [behind, error] = std::from_chars(who.data() + before_page.size(), end, page);
        if (error != std::errc() || !std::string_view(behind, end).starts_with(after_page + " at "))
            return {};
        return page;
    }

    void call(Action action, int page, Done done) {
        const std::string service = action == Action::start  ? realtime::start_service
                                    : action == Action::stop ? realtime::stop_service
                                                             : realtime::emergency_service;
        const auto found = services.find(service);
        if (const RunState now = copy(); now.state != Running::running) return fail(*done, now.live->message);
        if (found == services.end()) return fail(*done, "the program has no service '" + service + "'");
        const std::uint32_t number = ++last_call;
        calls[number] = std::move(done);
        // Before all that waits, behind what is being written.
        queue.push_front({request(found->second, number, {{"who", name_of(page)}}), false});
        write();
    }

    /// Opcode 2, the numbers of the service and of the call, the length of the encoding's name, that name,
    /// JSON.
    static std::string request(std::uint32_t service, std::uint32_t call, const Json& json) {
        constexpr std::string_view encoding = "json";
        std::string bytes(1, '\2');
        for (const std::uint32_t part : {service, call, static_cast<std::uint32_t>(encoding.size())})
            bytes.append(reinterpret_cast<const char*>(&part), sizeof part);
        bytes += encoding;
        return bytes + json.dump(-1, ' ', false, Json::error_handler_t::replace);
    }

    void send_edit(const realtime::Edit& edit, const std::string& what, int page, Then then) {
        const auto found = services.find(realtime::edit_service);
        if (const RunState now = copy(); now.state != Running::running)
            return then(RunEdit{now.live->message});
        if (found == services.end()) return then(RunEdit{"the program takes no edits"});
        Json origins = Json::object();
        for (const auto& [path, before] : edit.origins) origins[path] = before ? Json(*before) : Json();
        edit_calls[++last_call] = std::move(then);
        queue.push_back({request(found->second, last_call,
                                 {{"who", name_of(page)},
                                  {"what", what},
                                  {"after", edits},
                                  {"model", edit.text},
                                  {"files", edit.files},
                                  {"origins", std::move(origins)},
                                  {"is_by_hand", edit.is_by_hand},
                                  {"accepts_loss", edit.accepts_loss}}),
                         false});
        write();
    }

    void ask(const Tune& tune, int page, Done done) {
        if (copy().state != Running::running || waiting)
            return fail(*done, waiting ? "another change is under way; try again" : copy().message);
        refusal.clear();
        waiting = std::move(done);
        Json value = Json::array();
        for (const double x : tune.values) // JSON has no infinity
            value.push_back(std::isinf(x) ? Json(x > 0 ? "Inf" : "-Inf") : Json(x));
        if (value.size() == 1) value = Json(value[0]);
        send({{"op", "setParameters"},
              {"id", "tune"},
              {"who", name_of(page)},
              {"parameters", Json::array({{{"name", tune.name}, {"value", value}}})}});
    }

    const Address address;
    const Listener listener;
    asio::io_context io;
    asio::steady_timer timer{io}, again{io};
    std::shared_ptr<WebSocket> socket;
    std::deque<WebSocket::Message> queue; ///< behind what is being written
    bool is_writing = false;
    std::map<std::uint32_t, std::pair<recording::ChannelInfo, int>>
        channels; ///< by number, with the index of the signal
    std::set<std::uint32_t> subscribed;
    std::set<int> wanted; ///< signals
    std::string frame, refusal;
    Done waiting; ///< for the answer to a change
    std::map<std::string, std::uint32_t> services;
    std::map<std::uint32_t, Done> calls; ///< of services, not yet answered
    std::map<std::uint32_t, Then> edit_calls;
    std::int64_t edits = 0; ///< that the program has made, as far as it is known
    std::uint32_t last_call = 0;
    std::optional<std::uint32_t> timing_channel, log_channel;
    const std::string after_page = name_after_page();

    mutable std::mutex mutex; ///< of these
    RunState state;
    LiveReport report;
    std::vector<SignalInfo> infos;
    int next_index = 0, advertised = 0;

    std::thread thread;
};

Live::Live(const std::string& address, Listener listener)
    : connection_(std::make_unique<Connection>(address, std::move(listener))) {}
Live::~Live() = default;

void Live::tune(const Tune& tune, int page) {
    const auto done = std::make_shared<std::promise<void>>();
    asio::post(connection_->io, [c = connection_.get(), tune, page, done] { c->ask(tune, page, done); });
    auto answer = done->get_future();
    if (answer.wait_for(patience) != std::future_status::ready) {
        asio::post(connection_->io, [c = connection_.get(), done] {
            if (c->waiting == done) c->waiting.reset();
        });
        throw std::runtime_error("the program does not answer; whether '" + tune.name +
                                 "' has changed is not known");
    }
    answer.get();
}

void Live::command(Action action, int page) {
    const auto done = std::make_shared<std::promise<void>>();
    asio::post(connection_->io, [c = connection_.get(), action, page, done] { c->call(action, page, done); });
    auto answer = done->get_future();
    if (answer.wait_for(patience) != std::future_status::ready)
        throw std::runtime_error("the program does not answer; whether it obeys is not known");
    answer.get();
}

void Live::watch(std::vector<int> signals) {
    asio::post(connection_->io, [c = connection_.get(), signals = std::move(signals)] {
        c->wanted = {signals.begin(), signals.end()};
        if (c->copy().state == Running::running) c->subscribe();
    });
}

void Live::edit(const realtime::Edit& edit, const std::string& what, int page,
                std::function<void(std::optional<RunEdit>)> then) {
    asio::post(connection_->io, [c = connection_.get(), edit, what, page, then = std::move(then)] {
        c->send_edit(edit, what, page, then);
    });
}

RunState Live::state() const { return connection_->copy(); }
LiveReport Live::report() const {
    const std::lock_guard lock(connection_->mutex);
    return connection_->report;
}
std::vector<SignalInfo> Live::signals() const {
    const std::lock_guard lock(connection_->mutex);
    return connection_->infos;
}

int Live::advertised() const {
    const std::lock_guard lock(connection_->mutex);
    return connection_->advertised;
}

} // namespace bf::service
