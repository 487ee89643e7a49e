#include "bf/realtime/server.hpp"

#include "bf/base/value_text.hpp"
#include "bf/realtime/token.hpp"
#include "bf/recording/message.hpp"
#include "sample_ring.hpp"

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cmath>
#include <csignal>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

namespace bf::realtime {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Json = nlohmann::json;

constexpr auto tick = std::chrono::milliseconds(5);

// What one viewer may take of the server's time, so that no other waits for it: so many bytes of questions
// and answers at once, and in the long run so many per tick. Those who ask for more are read from later.
constexpr std::ptrdiff_t bytes_at_once = 1 << 16, bytes_per_tick = 1 << 12, bytes_per_message = 1 << 6;
constexpr int most_unanswered = 100; // changes of parameters

std::string to_text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// Whoever knows the token is let in, from wherever his page or program comes; any web page may ask a browser
/// to connect here, but does not know it.
std::string_view token_in(std::string_view address) {
    const auto query = address.find('?');
    for (auto at = query; at != address.npos; at = address.find('&', at + 1))
        if (constexpr std::string_view key = "token="; address.substr(at + 1, key.size()) == key) {
            const auto token = address.substr(at + 1 + key.size());
            return token.substr(0, token.find('&'));
        }
    return {};
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
        throw ClientError("the field '" + std::string(name) + "' is of the wrong type: " + to_text(*at));
    }
}

/// The numbers by which clients call channels and subscriptions.
std::uint32_t number_field(const Json& json, const char* name) {
    const auto number = field<Json>(json, name);
    if (!number.is_number_unsigned() || number > UINT32_MAX)
        throw ClientError("the field '" + std::string(name) +
                          "' is no whole number of 32 bits: " + to_text(number));
    return number.get<std::uint32_t>();
}

} // namespace

// ---- the server: one thread, in which everything below runs ----

struct Server::State {
    struct Channel {
        Channel(std::string t, Quantity s) : topic(std::move(t)), signal(std::move(s)) {}

        std::string topic;
        Quantity signal;
        std::atomic<bool> is_wanted{false};
        int subscribers = 0;
    };
    struct Parameter {
        Type type;
        bool is_scalar;
        std::vector<double> values;
    };
    struct Session;
    /// A viewer's wish to change parameters.
    struct Request {
        std::weak_ptr<Session> session;
        Json id;
        std::vector<std::string> names;
    };

    State(Run& r, ParameterMailbox& p, const ServerOptions& o)
        : run(r), mailbox(p), options(o), tuned(r.parameters()), ring(o.buffer_bytes) {
        if (options.token.empty()) options.token = random_token();
        if (options.token.empty()) throw std::runtime_error("the system gives no random token");
    }

    void listen();
    void accept();
    void run_tick();
    void deliver();
    void exchange_parameters();
    void finish_change(const ParameterMailbox::Result& result);
    void post_change();
    void reject(const std::vector<Request>& requests, const std::string& reason);
    std::vector<ParameterValue> present_values() const;
    std::size_t viewers() const;
    Json parameters_json(const std::vector<std::string>& names) const;

    Run& run;
    ParameterMailbox& mailbox;
    ServerOptions options;
    const std::vector<Quantity> tuned; ///< parameters
    std::deque<Channel> channels;      // holds atomics: does not move them
    std::vector<std::string> names;    ///< of variables and parameters, in document order
    std::map<std::string, Parameter> parameters;
    SampleRing ring;
    std::atomic<std::uint64_t> lost_messages{0}, changes{0};

    asio::io_context io;
    tcp::acceptor acceptor{io};
    std::uint16_t port = 0;
    asio::steady_timer timer{io};
    bool is_accepting = false;
    std::vector<std::shared_ptr<Session>> sessions; ///< in the order of their arrival
    // Changes wait for the loop to take those under way, the newest value of each parameter.
    std::vector<Request> waiting, posted;
    std::vector<ParameterValue> waiting_values, posted_values;
    std::vector<ParameterValue> posted_parameters; ///< which follow from those values
    std::size_t longest_message = 0;               ///< bytes
    Json advertisement, server_info;
    std::thread thread;
};

struct Server::State::Session : std::enable_shared_from_this<Session> {
    Session(State& s, tcp::socket socket) : state(s), stream(std::move(socket)) {}

    void start() {
        beast::get_lowest_layer(stream).expires_after(std::chrono::seconds(10));
        http::async_read(stream.next_layer(), buffer, request, [self = shared_from_this()](auto error, auto) {
            error ? self->leave() : self->shake_hands();
        });
    }

    void shake_hands() {
        std::string protocol;
        for (const auto offered : http::token_list(request[http::field::sec_websocket_protocol]))
            if (protocol.empty() && (offered == "foxglove.websocket.v1" || offered == "foxglove.sdk.v1"))
                protocol = std::string(offered.data(), offered.size());
        const auto target = request.target();
        if (!is_token(token_in({target.data(), target.size()}), state.options.token))
            return refuse(http::status::forbidden,
                          "connect to the address with the token, ws://HOST:PORT/?token=..., which the "
                          "program told when it started\n");
        if (!websocket::is_upgrade(request) || protocol.empty())
            return refuse(
                http::status::bad_request,
                "this is a live BlockFactory model; connect a viewer that speaks Foxglove's WebSocket "
                "protocol (foxglove.websocket.v1)\n");
        if (state.viewers() >= state.options.most_viewers)
            return refuse(http::status::service_unavailable, "too many viewers are connected\n");
        beast::get_lowest_layer(stream).expires_never();
        stream.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
        stream.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& r) {
            r.set(http::field::sec_websocket_protocol, protocol);
        }));
        stream.read_message_max(state.longest_message);
        stream.async_accept(request, [self = shared_from_this()](auto error) {
            if (error) return self->leave();
            self->is_open = true;
            self->buffer.clear();
            self->numbers.resize(self->state.channels.size(), -1);
            self->send(self->state.server_info);
            self->send(self->state.advertisement);
            self->credit = bytes_at_once;
            self->read();
        });
    }

    void refuse(http::status status, const char* text) {
        auto response = std::make_shared<http::response<http::string_body>>(status, 11, text);
        response->set(http::field::content_type, "text/plain");
        response->prepare_payload();
        http::async_write(stream.next_layer(), *response,
                          [self = shared_from_this(), response](auto, auto) { self->leave(); });
    }

    /// Reads the next message, as soon as this viewer's turn has come and it takes the answers it asked for.
    void read() {
        if (!is_open || is_reading || credit <= 0 || unanswered >= most_unanswered || !answers.empty())
            return;
        is_reading = true;
        stream.async_read(buffer, [self = shared_from_this()](auto error, std::size_t size) {
            self->is_reading = false;
            if (error) return self->leave();
            self->credit -= static_cast<std::ptrdiff_t>(size) + bytes_per_message;
            self->handle();
            self->buffer.clear();
            self->read();
        });
    }

    void handle() {
        try {
            if (stream.got_binary()) throw ClientError("this server takes no data");
            const Json json = parsed(beast::buffers_to_string(buffer.data()));
            const auto op = field<std::string>(json, "op");
            if (op == "subscribe")
                for (const auto& entry : field<std::vector<Json>>(json, "subscriptions"))
                    subscribe(number_field(entry, "id"), number_field(entry, "channelId"));
            else if (op == "unsubscribe")
                for (const auto& id : field<std::vector<Json>>(json, "subscriptionIds"))
                    unsubscribe(number_field({{"subscriptionIds", id}}, "subscriptionIds"));
            else if (op == "getParameters")
                send(values_message(field<std::vector<std::string>>(json, "parameterNames"), id_of(json)));
            else if (op == "setParameters")
                set_parameters(json);
            else if (op == "subscribeParameterUpdates")
                for (const auto& name : names_or_all(json)) {
                    if (state.parameters.count(name)) watched.insert(name);
                }
            else if (op == "unsubscribeParameterUpdates")
                for (const auto& name : names_or_all(json)) watched.erase(name);
            else
                throw ClientError("this server knows no operation '" + op + "'");
        } catch (const ClientError& error) {
            status(2, error.what());
        }
    }

    static Json parsed(const std::string& text) {
        Json json;
        try {
            json = Json::parse(text);
        } catch (const Json::out_of_range&) {
            throw ClientError("a number in the message is beyond the largest number, 1.8e308; write \"Inf\" "
                              "for infinity");
        } catch (const Json::exception&) {
        }
        if (!json.is_object()) throw ClientError("the message is no JSON object");
        return json;
    }

    static Json id_of(const Json& json) { return json.contains("id") ? json["id"] : Json(); }

    std::vector<std::string> names_or_all(const Json& json) const {
        auto names = field<std::vector<std::string>>(json, "parameterNames");
        return names.empty() ? state.names : names;
    }

    /// The protocol allows a client one subscription per channel.
    void subscribe(std::uint32_t id, std::uint32_t channel) {
        if (channel >= state.channels.size())
            throw ClientError("there is no channel " + std::to_string(channel));
        if (subscriptions.count(id))
            throw ClientError("subscription " + std::to_string(id) + " exists already");
        if (numbers[channel] >= 0)
            throw ClientError("channel " + std::to_string(channel) + " is subscribed already");
        subscriptions[id] = channel;
        numbers[channel] = id;
        ++state.channels[channel].subscribers;
        state.channels[channel].is_wanted.store(true, std::memory_order_relaxed);
    }

    void unsubscribe(std::uint32_t id) {
        const auto at = subscriptions.find(id);
        if (at == subscriptions.end()) throw ClientError("there is no subscription " + std::to_string(id));
        Channel& channel = state.channels[at->second];
        if (--channel.subscribers == 0) channel.is_wanted.store(false, std::memory_order_relaxed);
        numbers[at->second] = -1;
        subscriptions.erase(at);
    }

    Json values_message(const std::vector<std::string>& names, const Json& id) const {
        Json message{{"op", "parameterValues"}, {"parameters", state.parameters_json(names)}};
        if (!id.is_null()) message["id"] = id;
        return message;
    }

    void set_parameters(const Json& json) {
        State::Request request{weak_from_this(), id_of(json), {}};
        try {
            std::vector<ParameterValue> candidate = state.waiting_values;
            std::set<std::string> names;
            for (const auto& entry : field<std::vector<Json>>(json, "parameters")) {
                const auto name = field<std::string>(entry, "name");
                if (!names.insert(name).second)
                    throw ClientError("parameter '" + name + "' is given twice; give it once");
                request.names.push_back(name);
                std::vector<double> values;
                const Json value = entry.contains("value") ? entry["value"] : Json();
                const auto add = [&](const Json& element) {
                    double number = 0;
                    if (element.is_string() && read_value(element.get<std::string>(), number).empty())
                        return values.push_back(number);
                    if (!element.is_number() && !element.is_boolean())
                        throw ClientError(
                            "parameter '" + name +
                            "' takes a number or an array of numbers, with \"Inf\" for infinity, "
                            "not " +
                            to_text(value));
                    values.push_back(element.is_boolean() ? element.get<bool>() : element.get<double>());
                };
                if (value.is_array())
                    for (const auto& element : value) add(element);
                else
                    add(value);
                const auto same = std::find_if(candidate.begin(), candidate.end(),
                                               [&](const auto& other) { return other.path == name; });
                if (same == candidate.end())
                    candidate.push_back({name, std::move(values)});
                else
                    same->values = std::move(values);
            }
            static_cast<void>(state.run.prepare(state.run.follow(candidate))); // refuses what is wrong
            state.waiting_values = std::move(candidate);
            state.waiting.push_back(std::move(request));
            ++unanswered;
        } catch (const std::runtime_error& error) {
            reject(request, error.what());
        }
    }

    /// Says why, and what the parameters are.
    void reject(const State::Request& request, const std::string& reason) {
        status(2, reason + "; nothing was changed");
        if (request.id.is_null()) return;
        send(request.names.empty()
                 ? Json{{"op", "parameterValues"}, {"parameters", Json::array()}, {"id", request.id}}
                 : values_message(request.names, request.id));
    }

    void status(int level, const std::string& message) {
        send(Json{{"op", "status"}, {"level", level}, {"message", message}});
    }

    void send(const Json& json) {
        if (!is_open) return;
        std::string text = to_text(json);
        credit -= static_cast<std::ptrdiff_t>(text.size());
        answer_bytes += text.size();
        answers.push_back(std::move(text));
        // It asks for no more before it has read these, so they are what others changed.
        if (answers.size() > 1 && answer_bytes > state.options.client_bytes) return leave();
        write();
    }

    /// Message data: opcode 1, the client's own number for the channel, the time in ns, CDR. Where a viewer
    /// reads too slowly, the oldest samples make room.
    void send_sample(std::uint32_t channel, std::int64_t time, const std::vector<std::byte>& value) {
        if (!is_open || numbers[channel] < 0) return;
        const auto id = static_cast<std::uint32_t>(numbers[channel]);
        constexpr std::size_t header = 1 + 4 + 8, prefix = recording::message_prefix_bytes;
        std::string bytes(header + prefix + value.size(), '\1');
        std::memcpy(&bytes[1], &id, 4);
        std::memcpy(&bytes[5], &time, 8);
        recording::write_message_prefix(reinterpret_cast<std::byte*>(&bytes[header]),
                                        static_cast<double>(time) / 1e9);
        std::memcpy(&bytes[header + prefix], value.data(), value.size());
        for (; !samples.empty() && sample_bytes + bytes.size() > state.options.client_bytes; ++lost) {
            sample_bytes -= samples.front().size();
            samples.pop_front();
            state.lost_messages.fetch_add(1, std::memory_order_relaxed);
        }
        sample_bytes += bytes.size();
        samples.push_back(std::move(bytes));
        write();
    }

    /// Answers go before samples.
    void write() {
        if (is_writing) return;
        const bool is_answer = !answers.empty();
        auto& queue = is_answer ? answers : samples;
        if (queue.empty()) {
            if (lost > 0)
                status(1, std::to_string(std::exchange(lost, 0)) +
                              " messages were lost: this viewer reads too slowly");
            return;
        }
        written = std::move(queue.front());
        queue.pop_front();
        (is_answer ? answer_bytes : sample_bytes) -= written.size();
        is_writing = true;
        stream.binary(!is_answer);
        stream.async_write(asio::buffer(written), [self = shared_from_this()](auto error, auto) {
            self->is_writing = false;
            if (error) return self->leave();
            self->write();
            self->read();
        });
    }

    /// Whatever waits for the network ends with an error then.
    void leave() {
        is_open = false;
        while (!subscriptions.empty()) unsubscribe(subscriptions.begin()->first);
        beast::error_code ignored;
        beast::get_lowest_layer(stream).socket().close(ignored);
        std::erase(state.sessions, shared_from_this());
    }

    State& state;
    websocket::stream<beast::tcp_stream> stream;
    beast::flat_buffer buffer;
    http::request<http::string_body> request;
    bool is_open = false, is_reading = false, is_writing = false;
    std::map<std::uint32_t, std::uint32_t> subscriptions; ///< the client's number -> channel
    std::vector<std::int64_t> numbers;                    ///< channel -> the client's number, or -1
    std::set<std::string> watched;                        ///< parameters
    std::deque<std::string> answers, samples;             ///< not yet written
    std::size_t answer_bytes = 0, sample_bytes = 0;       ///< in these
    std::string written;                                  ///< what is being written
    std::ptrdiff_t credit = 0;                            ///< bytes; see bytes_at_once
    int unanswered = 0;                                   ///< changes of parameters
    std::uint64_t lost = 0;
};

Json Server::State::parameters_json(const std::vector<std::string>& wanted) const {
    Json list = Json::array();
    std::set<std::string> done;
    for (const auto& name : wanted.empty() ? names : wanted) {
        const auto at = parameters.find(name);
        if (at == parameters.end()) continue; // as the protocol has it: unknown ones are left out
        if (!done.insert(name).second) continue;
        const auto& [type, is_scalar, values] = at->second;
        const auto element = [&, t = type](double v) {
            if (t == Type::boolean) return Json(v != 0);
            return std::isinf(v) ? Json(v > 0 ? "Inf" : "-Inf") : Json(v); // JSON has no infinity
        };
        Json value = Json::array();
        for (const double v : values) value.push_back(element(v));
        Json entry{{"name", name}, {"value", is_scalar ? value[0] : value}};
        const bool is_finite =
            std::none_of(values.begin(), values.end(), [](double v) { return std::isinf(v); });
        if (type != Type::boolean && is_finite) entry["type"] = is_scalar ? "float64" : "float64_array";
        list.push_back(std::move(entry));
    }
    return list;
}

void Server::State::listen() {
    const tcp::endpoint endpoint(asio::ip::address_v4::loopback(), options.port);
    try {
        acceptor.open(endpoint.protocol());
        acceptor.set_option(tcp::acceptor::reuse_address(true));
        acceptor.bind(endpoint);
        acceptor.listen();
        port = acceptor.local_endpoint().port();
    } catch (const boost::system::system_error& error) {
        throw std::runtime_error("cannot serve on port " + std::to_string(options.port) + ": " +
                                 error.code().message() + "; give another port, or 0 for any free one");
    }
    run_tick();
}

void Server::State::accept() {
    is_accepting = true;
    acceptor.async_accept([this](auto error, tcp::socket socket) {
        is_accepting = false;
        if (error) return; // the next tick tries again
        beast::error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        sessions.push_back(std::make_shared<Session>(*this, std::move(socket)));
        // Whoever has not told the token gives way to those who come later.
        if (sessions.size() - viewers() > options.most_strangers)
            (*std::find_if(sessions.begin(), sessions.end(), [](const auto& s) {
                return !s->is_open;
            }))->leave();
        sessions.back()->start();
        accept();
    });
}

std::size_t Server::State::viewers() const {
    return static_cast<std::size_t>(
        std::count_if(sessions.begin(), sessions.end(), [](const auto& s) { return s->is_open; }));
}

void Server::State::run_tick() {
    if (!is_accepting) accept();
    deliver();
    exchange_parameters();
    for (const auto& session : sessions) {
        session->credit = std::min(session->credit + bytes_per_tick, bytes_at_once);
        session->read();
    }
    timer.expires_after(tick);
    timer.async_wait([this](auto error) {
        if (!error) run_tick();
    });
}

void Server::State::deliver() {
    ring.pop_all([this](std::uint32_t channel, std::int64_t time, const std::vector<std::byte>& value) {
        for (const auto& session : sessions) session->send_sample(channel, time, value);
    });
}

void Server::State::exchange_parameters() {
    if (!posted.empty()) {
        const auto result = mailbox.take_result();
        if (!result) return;
        finish_change(*result);
    }
    if (!waiting.empty()) post_change();
}

/// Of variables and parameters, in document order.
std::vector<ParameterValue> Server::State::present_values() const {
    std::vector<ParameterValue> all = run.variables();
    for (const auto& parameter : tuned) all.push_back({parameter.path, parameter.values()});
    return all;
}

void Server::State::post_change() {
    posted = std::exchange(waiting, {});
    posted_values = std::exchange(waiting_values, {});
    try {
        posted_parameters = run.follow(posted_values);
        mailbox.post(run.prepare(posted_parameters));
    } catch (const std::runtime_error& error) {
        reject(std::exchange(posted, {}), error.what());
    }
}

void Server::State::reject(const std::vector<Request>& requests, const std::string& reason) {
    for (const auto& request : requests)
        if (const auto session = request.session.lock()) {
            --session->unanswered;
            session->reject(request, reason);
        }
}

void Server::State::finish_change(const ParameterMailbox::Result& result) {
    const auto requests = std::exchange(posted, {});
    if (!result.status) return reject(requests, result.refusal);
    changes.fetch_add(1, std::memory_order_relaxed);
    if (options.on_change) options.on_change(result.step, posted_parameters);
    run.accept(posted_values);
    std::vector<std::string> changed;
    for (const auto& [name, values] : posted_parameters) changed.push_back(name);
    for (auto& [name, values] : present_values()) {
        auto& known = parameters.at(name).values;
        if (known == values) continue;
        known = std::move(values);
        if (std::find(changed.begin(), changed.end(), name) == changed.end()) changed.push_back(name);
    }
    for (auto& channel : channels) // constants may follow from parameters
        if (channel.signal.rate == 0 && channel.subscribers > 0) channel.is_wanted.store(true);
    std::map<std::shared_ptr<Session>, std::set<std::string>> answered;
    for (const auto& request : requests) {
        const auto session = request.session.lock();
        if (!session) continue;
        --session->unanswered;
        if (request.id.is_null()) continue;
        session->send(session->values_message(request.names, request.id));
        answered[session].insert(request.names.begin(), request.names.end());
    }
    const auto everyone = sessions; // who reads nothing may leave
    for (const auto& other : everyone) {
        std::vector<std::string> watched;
        for (const auto& name : changed)
            if (other->watched.count(name) && !answered[other].count(name)) watched.push_back(name);
        if (!watched.empty()) other->send(other->values_message(watched, {}));
    }
}

// ---- the public functions ----

Server::Server(Run& run, const std::vector<Quantity>& signals, ParameterMailbox& parameters,
               const ServerOptions& options)
    : state_(std::make_unique<State>(run, parameters, options)) {
    State& s = *state_;
    std::set<std::string> topics;
    Json channels = Json::array();
    Json metadata = Json::object(); // of texts
    for (const auto& signal : signals) {
        const auto topic = recording::topic_of(signal.path);
        if (!topics.insert(topic).second) continue;
        const auto& info = signal.info;
        channels.push_back({{"id", s.channels.size()},
                            {"topic", topic},
                            {"encoding", "cdr"},
                            {"schemaName", recording::message_type(info)},
                            {"schemaEncoding", "ros2msg"},
                            {"schema", recording::message_definition(info)}});
        std::string elements; // a line each
        for (const auto& name : info.element_names) elements += name + "\n";
        if (!elements.empty()) metadata["elements of " + topic] = elements;
        s.channels.emplace_back(topic, signal);
    }
    s.advertisement = {{"op", "advertise"}, {"channels", std::move(channels)}};
    s.server_info = {{"op", "serverInfo"},
                     {"name", run.name()},
                     {"capabilities", {"parameters", "parametersSubscribe"}},
                     {"supportedEncodings", Json::array()},
                     {"metadata", std::move(metadata)},
                     {"sessionId", std::to_string(now(CLOCK_REALTIME))}};
    for (auto& [name, values] : s.present_values()) {
        s.names.push_back(name);
        s.parameters.emplace(name, State::Parameter{Type::float64, values.size() == 1, std::move(values)});
    }
    for (const auto& parameter : s.tuned) s.parameters.at(parameter.path).type = parameter.type;
    // A client may name every channel, and give every parameter, in one message.
    s.longest_message = bytes_at_once + 64 * s.channels.size();
    for (const auto& [name, parameter] : s.parameters)
        s.longest_message += 64 + name.size() + 32 * parameter.values.size();
    s.listen();
    // Signals are for the threads of the application.
    sigset_t all, before;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    s.thread = std::thread([&s] { s.io.run(); });
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Server::~Server() {
    asio::post(state_->io, [&s = *state_] {
        s.deliver();
        if (!s.posted.empty())
            if (const auto result = s.mailbox.take_result()) s.finish_change(*result);
        s.acceptor.close();
        s.timer.cancel();
        const auto everyone = s.sessions;
        for (const auto& session : everyone) session->leave();
        s.io.stop();
    });
    state_->thread.join();
}

void Server::observe(const Run& run) noexcept {
    State& s = *state_;
    const auto time = static_cast<std::int64_t>(std::llround(run.time() * 1e9));
    std::uint32_t number = 0;
    for (auto& channel : s.channels) {
        const std::uint32_t id = number++;
        if (!channel.is_wanted.load(std::memory_order_relaxed)) continue;
        // A constant is sent once, to those who come late too.
        if (channel.signal.rate == 0)
            channel.is_wanted.store(false, std::memory_order_relaxed);
        else if (!run.is_hit(channel.signal.rate))
            continue;
        s.ring.push(id, time, channel.signal.data, static_cast<std::uint32_t>(channel.signal.info.bytes()));
    }
}

std::uint16_t Server::port() const { return state_->port; }
const std::string& Server::token() const { return state_->options.token; }

Server::Counts Server::counts() const {
    return {state_->ring.lost(), state_->lost_messages.load(), state_->changes.load()};
}

} // namespace bf::realtime
