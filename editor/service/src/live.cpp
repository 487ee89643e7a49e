#include "live.hpp"

#include "bf/base/value_text.hpp"
#include "bf/recording/message.hpp"
#include "frame.hpp"
#include "json.hpp"
#include "recordings.hpp"

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

namespace bf::service {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;

constexpr auto between_frames = std::chrono::milliseconds(30);
constexpr auto patience = std::chrono::seconds(2);     ///< until an answer
constexpr auto before_again = std::chrono::seconds(1); ///< until the next attempt to connect
/// The program does not say who made a change that was not asked for here, nor what follows from one that
/// was.
constexpr const char* elsewhere = "another viewer, or what follows";
constexpr std::size_t most_changes = 100;                 ///< that are listed
constexpr std::size_t most_bytes = std::size_t{64} << 20; ///< of a message

struct Address {
    std::string host, port, target;
};

Address parsed(const std::string& text) {
    constexpr std::string_view scheme = "ws://";
    const auto slash = text.find('/', scheme.size());
    const auto colon = text.rfind(':', slash);
    if (!text.starts_with(scheme) || slash == text.npos || colon == text.npos || colon < scheme.size())
        throw std::runtime_error("'" + text +
                                 "' is no address of a live program; give the one that it printed, "
                                 "ws://HOST:PORT/?token=TOKEN");
    return {text.substr(scheme.size(), colon - scheme.size()), text.substr(colon + 1, slash - colon - 1),
            text.substr(slash)};
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
        beast::error_code error;
        socket = std::make_unique<websocket::stream<tcp::socket>>(io);
        socket->read_message_max(most_bytes);
        socket->set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
            request.set(beast::http::field::sec_websocket_protocol, "foxglove.websocket.v1");
        }));
        tcp::resolver resolver(io);
        asio::connect(socket->next_layer(), resolver.resolve(address.host, address.port, error), error);
        if (!error) socket->next_layer().set_option(tcp::no_delay(true), error);
        if (error)
            return lose("the program at " + address.host + ":" + address.port +
                        " is not there: " + error.message());
        socket->async_handshake(address.host + ":" + address.port, address.target, [this](auto failed) {
            if (failed)
                return lose("the program does not let this page in: " + failed.message() +
                            "; give the whole address that it printed, with the token");
            queue.clear();
            is_writing = false;
            subscribed.clear();
            {
                const std::lock_guard lock(mutex);
                state.time = state.reached = 0;
            }
            send({{"op", "subscribeParameterUpdates"}, {"parameterNames", Json::array()}});
            read();
            tick();
        });
    }

    void lose(const std::string& why) {
        timer.cancel();
        enter(Running::failed, why);
        if (waiting) waiting->set_exception(std::make_exception_ptr(std::runtime_error(why)));
        waiting.reset();
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
        socket->async_read(buffer, [this](auto error, auto) {
            if (error) return lose("the connection to the program is lost: " + error.message());
            const std::string message = beast::buffers_to_string(buffer.data());
            buffer.clear();
            try {
                socket->got_text() ? hear(message) : take(message);
            } catch (const Json::exception&) { // it is none of the protocol
            }
            read();
        });
    }

    void send(const Json& json) {
        queue.push_back(json.dump(-1, ' ', false, Json::error_handler_t::replace));
        write();
    }
    void write() {
        if (is_writing || queue.empty()) return;
        is_writing = true;
        socket->async_write(asio::buffer(queue.front()), [this, of = socket.get()](auto error, auto) {
            if (of != socket.get()) return; // there is a new connection
            is_writing = false;
            if (error || queue.empty()) return; // the read says why
            queue.pop_front();
            write();
        });
    }

    void hear(const std::string& text) {
        const Json json = Json::parse(text, nullptr, false);
        if (!json.is_object()) return;
        const std::string op = json.value("op", "");
        if (op == "serverInfo") {
            const std::lock_guard lock(mutex);
            const Json capabilities = json.value("capabilities", Json::array());
            state.live->name = json.value("name", "");
            state.live->may_tune =
                std::find(capabilities.begin(), capabilities.end(), "parameters") != capabilities.end();
        } else if (op == "advertise") {
            advertise(json);
        } else if (op == "status" && json.value("level", 0) == 2) {
            refusal = json.value("message", "");
        } else if (op == "parameterValues") {
            hear_parameters(json);
        }
    }

    void advertise(const Json& json) {
        {
            const std::lock_guard lock(mutex);
            infos.clear();
            channels.clear();
            for (const auto& channel : json.value("channels", Json::array())) {
                const auto info = recording::channel_of(channel.value("schemaName", ""));
                const int index = static_cast<int>(infos.size());
                if (!info || info->elements() > most_bytes / sizeof(double)) continue;
                channels[channel.value("id", std::uint32_t{0})] = {*info, index};
                infos.push_back(described(index, recording::signal_of(channel.value("topic", "")), *info));
            }
        }
        enter(Running::running, "");
        subscribe();
    }

    void hear_parameters(const Json& json) {
        if (json.contains("id")) {
            if (!waiting) return;
            if (refusal.empty()) {
                note(asked_by, asked.name, asked.values);
                waiting->set_value();
                tell();
            } else {
                waiting->set_exception(std::make_exception_ptr(std::runtime_error(refusal)));
            }
            waiting.reset();
            return;
        }
        for (const auto& parameter : json.value("parameters", Json::array())) {
            std::vector<double> values;
            const Json value = parameter.value("value", Json());
            const auto add = [&](const Json& element) {
                double number = 0;
                if (element.is_number()) values.push_back(element.get<double>());
                if (element.is_boolean()) values.push_back(element.get<bool>() ? 1 : 0);
                if (element.is_string() && read_value(element.get<std::string>(), number).empty())
                    values.push_back(number);
            };
            if (value.is_array())
                for (const auto& element : value) add(element);
            else
                add(value);
            note(elsewhere, parameter.value("name", ""), values);
        }
        tell();
    }

    void note(const std::string& who, const std::string& name, const std::vector<double>& values) {
        const std::lock_guard lock(mutex);
        auto& all = state.live->changes;
        if (all.size() == most_changes) all.erase(all.begin());
        all.push_back({state.time, who, name, values});
    }

    /// Message data: opcode 1, the number of the subscription, which is that of the channel, the time in ns,
    /// CDR with the values behind its prefix.
    void take(const std::string& message) {
        constexpr std::size_t header = 1 + 4 + 8, begin = header + recording::message_prefix_bytes;
        if (message.size() < begin || message[0] != 1) return;
        std::uint32_t number = 0;
        std::int64_t time = 0;
        std::memcpy(&number, &message[1], 4);
        std::memcpy(&time, &message[5], 8);
        const auto found = channels.find(number);
        if (found == channels.end()) return;
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
        for (const auto& [number, channel] : channels) {
            const bool is_wanted = wanted.contains(channel.second);
            if (is_wanted && subscribed.insert(number).second)
                added.push_back({{"id", number}, {"channelId", number}});
            if (!is_wanted && subscribed.erase(number) > 0) removed.push_back(number);
        }
        if (!added.empty()) send({{"op", "subscribe"}, {"subscriptions", added}});
        if (!removed.empty()) send({{"op", "unsubscribe"}, {"subscriptionIds", removed}});
    }

    void ask(const Tune& tune, const std::string& who, std::shared_ptr<std::promise<void>> done) {
        if (copy().state != Running::running || waiting) {
            done->set_exception(std::make_exception_ptr(
                std::runtime_error(waiting ? "another change is under way; try again" : copy().message)));
            return;
        }
        refusal.clear();
        waiting = std::move(done);
        asked = tune;
        asked_by = who;
        Json value = Json::array();
        for (const double x : tune.values) // JSON has no infinity
            value.push_back(std::isinf(x) ? Json(x > 0 ? "Inf" : "-Inf") : Json(x));
        if (value.size() == 1) value = Json(value[0]);
        send({{"op", "setParameters"},
              {"id", "tune"},
              {"parameters", Json::array({{{"name", tune.name}, {"value", value}}})}});
    }

    const Address address;
    const Listener listener;
    asio::io_context io;
    asio::steady_timer timer{io}, again{io};
    std::unique_ptr<websocket::stream<tcp::socket>> socket;
    beast::flat_buffer buffer;
    std::deque<std::string> queue;
    bool is_writing = false;
    std::map<std::uint32_t, std::pair<recording::ChannelInfo, int>>
        channels; ///< by number, with the index of the signal
    std::set<std::uint32_t> subscribed;
    std::set<int> wanted; ///< signals
    std::string frame, refusal;
    std::shared_ptr<std::promise<void>> waiting; ///< for the answer to a change, which is
    Tune asked;
    std::string asked_by;

    mutable std::mutex mutex; ///< of these two
    RunState state;
    std::vector<SignalInfo> infos;

    std::thread thread;
};

Live::Live(const std::string& address, Listener listener)
    : connection_(std::make_unique<Connection>(address, std::move(listener))) {}
Live::~Live() = default;

void Live::tune(const Tune& tune, const std::string& who) {
    auto done = std::make_shared<std::promise<void>>();
    auto answer = done->get_future();
    asio::post(connection_->io, [c = connection_.get(), tune, who, done] { c->ask(tune, who, done); });
    if (answer.wait_for(patience) != std::future_status::ready) {
        asio::post(connection_->io, [c = connection_.get(), done] {
            if (c->waiting == done) c->waiting.reset();
        });
        throw std::runtime_error("the program does not answer; whether '" + tune.name +
                                 "' has changed is not known");
    }
    answer.get();
}

void Live::watch(std::vector<int> signals) {
    asio::post(connection_->io, [c = connection_.get(), signals = std::move(signals)] {
        c->wanted = {signals.begin(), signals.end()};
        if (c->copy().state == Running::running) c->subscribe();
    });
}

RunState Live::state() const { return connection_->copy(); }
std::vector<SignalInfo> Live::signals() const {
    const std::lock_guard lock(connection_->mutex);
    return connection_->infos;
}

} // namespace bf::service
