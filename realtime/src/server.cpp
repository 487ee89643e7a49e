#include "bf/realtime/server.hpp"

#include "bf/elaborate/tuning.hpp"
#include "bf/engine/recorder.hpp"
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

namespace bf::realtime {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Json = nlohmann::json;

constexpr std::size_t most_sessions = 64, most_requests = 1000;
constexpr auto tick = std::chrono::milliseconds(5);

std::string to_text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// "host:port" or "scheme://host:port" without port and scheme.
std::string_view host_of(std::string_view text) {
    if (const auto scheme = text.find("://"); scheme != text.npos) text.remove_prefix(scheme + 3);
    if (const auto colon = text.rfind(':'); colon != text.npos && text.find(']', colon) == text.npos)
        text = text.substr(0, colon);
    return text;
}

/// Any web page may ask a browser to connect here; only the viewers' own pages are let in. The name under
/// which this server was asked for must be local, too: else a foreign name was made to point here.
bool is_welcome(const http::request<http::string_body>& request) {
    const auto is_local = [](std::string_view host) {
        return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
    };
    const auto origin = request.find(http::field::origin);
    return is_local(host_of(request[http::field::host])) &&
           (origin == request.end() || origin->value() == "file://" || is_local(host_of(origin->value())) ||
            origin->value() == "https://app.foxglove.dev");
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
        std::string topic;
        recording::ChannelInfo info;
        Node::End end;
        int rate;
        std::atomic<bool> is_wanted{false};
        int subscribers = 0;
    };
    struct Parameter {
        Type type;
        bool is_scalar;
        std::vector<double> values;
    };
    struct Session;
    struct Request {
        std::weak_ptr<Session> session;
        Json id;
        std::vector<ParameterValue> values;     ///< as asked for
        std::vector<ParameterValue> parameters; ///< as they follow; known once it is posted
    };

    State(Simulation& s, ParameterMailbox& p, const ServerOptions& o)
        : simulation(s), mailbox(p), options(o), tuning(s.diagram()), ring(o.buffer_bytes) {}

    void listen();
    void accept();
    void run_tick();
    void deliver();
    void exchange_parameters();
    void finish_change(const ParameterMailbox::Result& result);
    void post_change();
    Json parameters_json(const std::vector<std::string>& names) const;

    Simulation& simulation;
    ParameterMailbox& mailbox;
    const ServerOptions options;
    Tuning tuning;
    std::deque<Channel> channels;   // holds atomics: does not move them
    std::vector<std::string> names; ///< of variables and parameters, in document order
    std::map<std::string, Parameter> parameters;
    SampleRing ring;
    std::atomic<std::uint64_t> lost_messages{0}, changes{0};

    asio::io_context io;
    tcp::acceptor acceptor{io};
    std::uint16_t port = 0;
    asio::steady_timer timer{io};
    std::set<std::shared_ptr<Session>> sessions;
    std::deque<Request> requests; ///< the first is under way when `is_posted`
    bool is_posted = false;
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
        if (!is_welcome(request))
            return refuse(http::status::forbidden, "only viewers on this computer are served\n");
        if (!websocket::is_upgrade(request) || protocol.empty())
            return refuse(
                http::status::bad_request,
                "this is a live BlockFactory model; connect a viewer that speaks Foxglove's WebSocket "
                "protocol (foxglove.websocket.v1)\n");
        if (state.sessions.size() > most_sessions)
            return refuse(http::status::service_unavailable, "too many viewers are connected\n");
        beast::get_lowest_layer(stream).expires_never();
        stream.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
        stream.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& r) {
            r.set(http::field::sec_websocket_protocol, protocol);
        }));
        stream.read_message_max(1 << 20);
        stream.async_accept(request, [self = shared_from_this()](auto error) {
            if (error) return self->leave();
            self->is_open = true;
            self->buffer.clear();
            self->send(self->state.server_info);
            self->send(self->state.advertisement);
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

    void read() {
        stream.async_read(buffer, [self = shared_from_this()](auto error, auto) {
            if (error) return self->leave();
            self->handle();
            self->buffer.clear();
            self->read();
        });
    }

    void handle() {
        try {
            if (stream.got_binary()) throw ClientError("this server takes no data");
            const Json json = Json::parse(beast::buffers_to_string(buffer.data()), nullptr, false);
            if (!json.is_object()) throw ClientError("the message is no JSON object");
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
                for (const auto& name : names_or_all(json)) watched.insert(name);
            else if (op == "unsubscribeParameterUpdates")
                for (const auto& name : names_or_all(json)) watched.erase(name);
            else
                throw ClientError("this server knows no operation '" + op + "'");
        } catch (const ClientError& error) {
            status(2, error.what());
        }
    }

    static Json id_of(const Json& json) { return json.contains("id") ? json["id"] : Json(); }

    std::vector<std::string> names_or_all(const Json& json) const {
        auto names = field<std::vector<std::string>>(json, "parameterNames");
        return names.empty() ? state.names : names;
    }

    void subscribe(std::uint32_t id, std::uint32_t channel) {
        if (channel >= state.channels.size())
            throw ClientError("there is no channel " + std::to_string(channel));
        if (subscriptions.count(id))
            throw ClientError("subscription " + std::to_string(id) + " exists already");
        subscriptions[id] = channel;
        ++state.channels[channel].subscribers;
        state.channels[channel].is_wanted.store(true, std::memory_order_relaxed);
    }

    void unsubscribe(std::uint32_t id) {
        const auto at = subscriptions.find(id);
        if (at == subscriptions.end()) throw ClientError("there is no subscription " + std::to_string(id));
        Channel& channel = state.channels[at->second];
        if (--channel.subscribers == 0) channel.is_wanted.store(false, std::memory_order_relaxed);
        subscriptions.erase(at);
    }

    Json values_message(const std::vector<std::string>& names, const Json& id) const {
        Json message{{"op", "parameterValues"}, {"parameters", state.parameters_json(names)}};
        if (!id.is_null()) message["id"] = id;
        return message;
    }

    void set_parameters(const Json& json) {
        Request request{weak_from_this(), id_of(json), {}, {}};
        try {
            for (const auto& entry : field<std::vector<Json>>(json, "parameters")) {
                const auto name = field<std::string>(entry, "name");
                std::vector<double> values;
                const Json value = entry.contains("value") ? entry["value"] : Json();
                const auto add = [&](const Json& element) {
                    if (!element.is_number() && !element.is_boolean())
                        throw ClientError("parameter '" + name +
                                          "' takes a number or an array of numbers, not " + to_text(value));
                    values.push_back(element.is_boolean() ? element.get<bool>() : element.get<double>());
                };
                if (value.is_array())
                    for (const auto& element : value) add(element);
                else
                    add(value);
                request.values.push_back({name, std::move(values)});
            }
            if (state.requests.size() >= most_requests) throw ClientError("too many changes are waiting");
            state.requests.push_back(std::move(request));
        } catch (const std::runtime_error& error) {
            reject(request, error.what());
        }
    }

    /// Says why, and what the parameters are.
    void reject(const Request& request, const std::string& reason) {
        status(2, reason + "; nothing was changed");
        if (request.id.is_null()) return;
        std::vector<std::string> names;
        for (const auto& value : request.values) names.push_back(value.path);
        send(names.empty()
                 ? Json{{"op", "parameterValues"}, {"parameters", Json::array()}, {"id", request.id}}
                 : values_message(names, request.id));
    }

    void status(int level, const std::string& message) {
        send(Json{{"op", "status"}, {"level", level}, {"message", message}});
    }

    void send(const Json& json) { enqueue({to_text(json), false}); }

    /// Message data: opcode 1, the client's own number for the channel, the time in ns, CDR.
    void send_sample(std::uint32_t channel, std::int64_t time, const std::vector<std::byte>& value) {
        for (const auto& [id, subscribed] : subscriptions) {
            if (subscribed != channel) continue;
            constexpr std::size_t header = 1 + 4 + 8, prefix = recording::message_prefix_bytes;
            if (waiting + header + prefix + value.size() > state.options.client_bytes) {
                ++lost;
                state.lost_messages.fetch_add(1, std::memory_order_relaxed);
                continue;
            }
            std::string bytes(header + prefix + value.size(), '\1');
            std::memcpy(&bytes[1], &id, 4);
            std::memcpy(&bytes[5], &time, 8);
            recording::write_message_prefix(reinterpret_cast<std::byte*>(&bytes[header]),
                                            static_cast<double>(time) / 1e9);
            std::memcpy(&bytes[header + prefix], value.data(), value.size());
            enqueue({std::move(bytes), true});
        }
    }

    struct Message {
        std::string bytes;
        bool is_binary;
    };
    void enqueue(Message message) {
        if (!is_open) return;
        // Answers go past the limit of samples, but a client that asks without reading is no viewer.
        if (waiting > 4 * state.options.client_bytes) return leave();
        waiting += message.bytes.size();
        queue.push_back(std::move(message));
        if (queue.size() == 1) write();
    }
    void write() {
        stream.binary(queue.front().is_binary);
        stream.async_write(asio::buffer(queue.front().bytes), [self = shared_from_this()](auto error, auto) {
            if (error) return self->leave();
            self->waiting -= self->queue.front().bytes.size();
            self->queue.pop_front();
            if (!self->queue.empty()) return self->write();
            if (self->lost > 0)
                self->status(1, std::to_string(std::exchange(self->lost, 0)) +
                                    " messages were lost: this viewer reads too slowly");
        });
    }

    /// Whatever waits for the network ends with an error then.
    void leave() {
        is_open = false;
        while (!subscriptions.empty()) unsubscribe(subscriptions.begin()->first);
        beast::error_code ignored;
        beast::get_lowest_layer(stream).socket().close(ignored);
        state.sessions.erase(shared_from_this());
    }

    State& state;
    websocket::stream<beast::tcp_stream> stream;
    beast::flat_buffer buffer;
    http::request<http::string_body> request;
    bool is_open = false;
    std::map<std::uint32_t, std::uint32_t> subscriptions; ///< the client's number -> channel
    std::set<std::string> watched;                        ///< parameters
    std::deque<Message> queue;                            ///< the first is being written
    std::size_t waiting = 0;                              ///< bytes in the queue
    std::uint64_t lost = 0;
};

Json Server::State::parameters_json(const std::vector<std::string>& wanted) const {
    Json list = Json::array();
    for (const auto& name : wanted.empty() ? names : wanted) {
        const auto at = parameters.find(name);
        if (at == parameters.end()) continue; // as the protocol has it: unknown ones are left out
        const auto& [type, is_scalar, values] = at->second;
        const auto element = [&, t = type](double v) { return t == Type::boolean ? Json(v != 0) : Json(v); };
        Json value = Json::array();
        for (const double v : values) value.push_back(element(v));
        Json entry{{"name", name}, {"value", is_scalar ? value[0] : value}};
        if (type != Type::boolean) entry["type"] = is_scalar ? "float64" : "float64_array";
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
    accept();
    run_tick();
}

void Server::State::accept() {
    acceptor.async_accept([this](auto error, tcp::socket socket) {
        if (error == asio::error::operation_aborted) return;
        if (!error) {
            beast::error_code ignored;
            socket.set_option(tcp::no_delay(true), ignored);
            (*sessions.insert(std::make_shared<Session>(*this, std::move(socket))).first)->start();
        }
        accept();
    });
}

void Server::State::run_tick() {
    deliver();
    exchange_parameters();
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
    if (is_posted) {
        const auto result = mailbox.take_result();
        if (!result) return;
        is_posted = false;
        finish_change(*result);
    }
    while (!requests.empty() && !is_posted) post_change();
}

void Server::State::post_change() {
    Request& request = requests.front();
    try {
        NamedValues asked;
        for (const auto& [name, values] : request.values) asked.emplace_back(name, values);
        for (auto& [name, values] : tuning.follow(asked))
            request.parameters.push_back({name, std::move(values)});
        is_posted = mailbox.post(simulation.prepare(request.parameters));
    } catch (const std::runtime_error& error) {
        if (const auto session = request.session.lock()) session->reject(request, error.what());
        requests.pop_front();
    }
}

void Server::State::finish_change(const ParameterMailbox::Result& result) {
    const Request request = std::move(requests.front());
    requests.pop_front();
    const auto session = request.session.lock();
    if (!result.status) {
        if (session) session->reject(request, result.status.text());
        return;
    }
    changes.fetch_add(1, std::memory_order_relaxed);
    if (options.on_change) options.on_change(result.step, request.parameters);
    NamedValues asked;
    for (const auto& [name, values] : request.values) asked.emplace_back(name, values);
    tuning.accept(asked);
    std::vector<std::string> changed;
    for (const auto& [name, values] : request.parameters) {
        auto& parameter = parameters.at(name);
        parameter.values.assign(parameter.values.size(), values[0]);
        if (values.size() > 1) parameter.values = values;
        if (parameter.type == Type::float32)
            for (double& v : parameter.values) v = static_cast<float>(v);
        changed.push_back(name);
    }
    for (auto& variable : tuning.variables()) {
        auto& known = parameters.at(variable.path).values;
        if (known == variable.values) continue;
        known = std::move(variable.values);
        changed.push_back(variable.path);
    }
    for (auto& channel : channels) // constants may follow from parameters
        if (channel.rate == constant_rate && channel.subscribers > 0) channel.is_wanted.store(true);
    std::vector<std::string> own;
    for (const auto& value : request.values) own.push_back(value.path);
    if (session && !request.id.is_null()) session->send(session->values_message(own, request.id));
    const auto everyone = sessions;
    for (const auto& other : everyone) {
        std::vector<std::string> watched;
        for (const auto& name : changed) {
            const bool is_answered = other == session && !request.id.is_null() &&
                                     std::find(own.begin(), own.end(), name) != own.end();
            if (other->watched.count(name) && !is_answered) watched.push_back(name);
        }
        if (!watched.empty()) other->send(other->values_message(watched, {}));
    }
}

// ---- the public functions ----

Server::Server(Simulation& simulation, const std::vector<SignalName>& signals, ParameterMailbox& parameters,
               const ServerOptions& options)
    : state_(std::make_unique<State>(simulation, parameters, options)) {
    State& s = *state_;
    const Diagram& diagram = simulation.diagram();
    std::set<std::string> topics;
    Json channels = Json::array();
    for (const auto& signal : signals) {
        const auto topic = recording::topic_of(signal.path);
        if (!topics.insert(topic).second) continue;
        const auto info = channel_info(diagram, signal.end);
        channels.push_back({{"id", s.channels.size()},
                            {"topic", topic},
                            {"encoding", "cdr"},
                            {"schemaName", recording::message_type(info)},
                            {"schemaEncoding", "ros2msg"},
                            {"schema", recording::message_definition(info)}});
        s.channels.emplace_back(topic, info, signal.end, rate_of(diagram, signal.end));
    }
    s.advertisement = {{"op", "advertise"}, {"channels", std::move(channels)}};
    s.server_info = {{"op", "serverInfo"},
                     {"name", diagram.name},
                     {"capabilities", {"parameters", "parametersSubscribe"}},
                     {"supportedEncodings", Json::array()},
                     {"metadata", Json::object()},
                     {"sessionId", std::to_string(now(CLOCK_REALTIME))}};
    for (auto& variable : s.tuning.variables()) {
        s.names.push_back(variable.path);
        s.parameters.emplace(variable.path, State::Parameter{Type::float64, variable.values.size() == 1,
                                                             std::move(variable.values)});
    }
    for (const auto& named : simulation.parameters()) {
        const Slot& slot = diagram.slot(named.end);
        State::Parameter parameter{slot.type, slot.size.count() == 1, {}};
        const void* data = simulation.context().data(named.end.node, named.end.slot);
        for (int i = 0; i < slot.size.count(); ++i)
            parameter.values.push_back(read_value(data, slot.type, i));
        s.names.push_back(named.path);
        s.parameters.emplace(named.path, std::move(parameter));
    }
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
        if (s.is_posted)
            if (const auto result = s.mailbox.take_result()) s.finish_change(*result);
        s.acceptor.close();
        s.timer.cancel();
        const auto everyone = s.sessions;
        for (const auto& session : everyone) session->leave();
        s.io.stop();
    });
    state_->thread.join();
}

void Server::observe(const Simulation& simulation) noexcept {
    State& s = *state_;
    const auto time = static_cast<std::int64_t>(std::llround(simulation.time() * 1e9));
    std::uint32_t number = 0;
    for (auto& channel : s.channels) {
        const std::uint32_t id = number++;
        if (!channel.is_wanted.load(std::memory_order_relaxed)) continue;
        // A constant is sent once, to those who come late too.
        if (channel.rate == constant_rate)
            channel.is_wanted.store(false, std::memory_order_relaxed);
        else if (!simulation.is_hit(channel.rate))
            continue;
        s.ring.push(id, time, simulation.context().data(channel.end.node, channel.end.slot),
                    static_cast<std::uint32_t>(channel.info.bytes()));
    }
}

std::uint16_t Server::port() const { return state_->port; }

Server::Counts Server::counts() const {
    return {state_->ring.lost(), state_->lost_messages.load(), state_->changes.load()};
}

} // namespace bf::realtime
