#include "bf/base/value_text.hpp"
#include "bf/realtime/token.hpp"
#include "bf/recording/message.hpp"
#include "server_state.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <cctype>
#include <cstring>
#include <netinet/in.h>
#include <pwd.h>

namespace bf::realtime {

namespace {

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

/// The numbers by which clients call channels and subscriptions.
std::uint32_t number_field(const Json& json, const char* name) {
    const auto number = field<Json>(json, name);
    if (!number.is_number_unsigned() || number > UINT32_MAX)
        throw ClientError("the field '" + std::string(name) +
                          "' is no whole number of 32 bits: " + to_text(number));
    return number.get<std::uint32_t>();
}

Json parsed(const std::string& text) {
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

Json id_of(const Json& json) { return json.contains("id") ? json["id"] : Json(); }

std::string peer_of(WebSocket::Socket& socket) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    const int descriptor = socket.native_handle();
    if (::getpeername(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
        address.ss_family == AF_INET) {
        const auto& internet = reinterpret_cast<const sockaddr_in&>(address);
        char text[INET_ADDRSTRLEN] = "";
        ::inet_ntop(AF_INET, &internet.sin_addr, text, sizeof text);
        return std::string(text) + ":" + std::to_string(ntohs(internet.sin_port));
    }
    ucred process{};
    size = sizeof process;
    if (::getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &process, &size) != 0) return "somewhere";
    const passwd* const user = ::getpwuid(process.uid);
    return "process " + std::to_string(process.pid) + " of " +
           (user ? user->pw_name : "user " + std::to_string(process.uid));
}

} // namespace

std::string log_name(std::string text) {
    constexpr std::size_t most_bytes = 80;
    if (text.size() > most_bytes) text.resize(most_bytes);
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c); }, ' ');
    return text;
}

Server::State::Session::Session(State& s, WebSocket::Socket connected)
    : state(s), peer(peer_of(connected)), socket(std::make_shared<WebSocket>(std::move(connected))) {}

void Server::State::Session::start() {
    socket->receive(std::chrono::seconds(10), [self = shared_from_this()](auto error, const auto& request) {
        error ? self->leave() : self->shake_hands(request);
    });
}

void Server::State::Session::shake_hands(const HttpRequest& request) {
    std::string protocol;
    for (const auto& offered : request.protocols)
        if (protocol.empty() && (offered == "foxglove.websocket.v1" || offered == "foxglove.sdk.v1"))
            protocol = offered;
    if (!is_token(token_in(request.target), state.options.token))
        return refuse(403, "connect to the address with the token, ws://HOST:PORT/?token=..., which the "
                           "program told when it started\n");
    if (!request.is_upgrade || protocol.empty())
        return refuse(400,
                      "this is a live BlockFactory model; connect a viewer that speaks Foxglove's WebSocket "
                      "protocol (foxglove.websocket.v1)\n");
    if (state.viewers() >= state.options.most_viewers) return refuse(503, "too many viewers are connected\n");
    socket->accept(protocol, [self = shared_from_this()](auto error) {
        if (error) return self->leave();
        self->is_open = true;
        self->numbers.resize(self->state.channels.size(), -1);
        for (const auto& message :
             {self->state.server_info, self->state.advertisement(), self->state.services})
            self->send(message);
        self->credit = bytes_at_once;
        self->read();
    });
}

void Server::State::Session::refuse(int status, const char* text) {
    socket->respond({.status = status, .body = text}, [self = shared_from_this()] { self->leave(); });
}

void Server::State::Session::read() {
    if (!is_open || is_reading || credit <= 0 || unanswered >= most_unanswered || !answers.empty()) return;
    is_reading = true;
    socket->read(state.longest_message, [self = shared_from_this()](auto error, const auto& message) {
        self->is_reading = false;
        if (self->is_leaving) return; // what is being written ends it
        if (WebSocket::is_too_long(error)) return self->dismiss();
        if (error) return self->leave();
        self->credit -= static_cast<std::ptrdiff_t>(message.bytes.size()) + bytes_per_message;
        self->handle(message);
        self->read();
    });
}

void Server::State::Session::handle(const WebSocket::Message& message) {
    try {
        message.is_text ? handle_text(message.bytes) : call_service(message.bytes);
    } catch (const ClientError& error) {
        status(2, error.what());
    }
}

void Server::State::Session::handle_text(const std::string& text) {
    const Json json = parsed(text);
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
}

/// A request is opcode 2, the numbers of the service and of the call, the length of the encoding's name, that
/// name, and the payload. A response is the same with opcode 3.
void Server::State::Session::call_service(const std::string& bytes) {
    constexpr std::size_t header = 1 + 4 + 4 + 4;
    std::uint32_t service = 0, call = 0, length = 0;
    if (bytes.size() < header || bytes[0] != 2) throw ClientError("this server takes no data");
    std::memcpy(&service, &bytes[1], 4);
    std::memcpy(&call, &bytes[5], 4);
    std::memcpy(&length, &bytes[9], 4);
    try {
        if (service >= state.services["services"].size())
            throw ClientError("there is no service " + std::to_string(service));
        if (length > bytes.size() - header || bytes.compare(header, length, "json") != 0)
            throw ClientError("services take JSON, and name that encoding");
        const std::string payload = bytes.substr(header + length);
        const Json request = payload.empty() ? Json::object() : parsed(payload);
        const std::string who = name_of(request), name = state.services["services"][service]["name"];
        std::string response = bytes.substr(0, header + length);
        response[0] = 3;
        if (name == edit_service) {
            state.edits->ask(request, {weak_from_this(), service, call, std::move(response), who, {}, {}});
            // A stop need not wait until a long model is paid for.
            credit += std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(bytes.size()) - bytes_at_once, 0);
            return;
        }
        state.command(name, who);
        answer({response + R"({"success": true, "message": ""})", false});
    } catch (const ClientError& error) {
        fail_call(service, call, error.what());
    }
}

void Server::State::Session::fail_call(std::uint32_t service, std::uint32_t call, const std::string& why) {
    send({{"op", "serviceCallFailure"}, {"serviceId", service}, {"callId", call}, {"message", why}});
}

/// What the log calls this viewer. It is his own word, so it stands beside where he is connected from.
std::string Server::State::Session::name_of(const Json& message) const {
    return message.contains("who") ? log_name(field<std::string>(message, "who")) + " at " + peer : peer;
}

std::vector<std::string> Server::State::Session::names_or_all(const Json& json) const {
    auto names = field<std::vector<std::string>>(json, "parameterNames");
    return names.empty() ? state.names : names;
}

/// The protocol allows a client one subscription per channel.
void Server::State::Session::subscribe(std::uint32_t id, std::uint32_t channel) {
    if (channel >= state.channels.size() || !state.channels[channel].is_there)
        throw ClientError("there is no channel " + std::to_string(channel));
    if (subscriptions.count(id)) throw ClientError("subscription " + std::to_string(id) + " exists already");
    if (numbers[channel] >= 0)
        throw ClientError("channel " + std::to_string(channel) + " is subscribed already");
    subscriptions[id] = channel;
    numbers[channel] = id;
    if (channel == log_channel)
        for (const auto& entry : state.log.entries()) state.tell_log(entry, *this);
    ++state.channels[channel].subscribers;
    state.channels[channel].is_wanted.store(true, std::memory_order_relaxed);
}

void Server::State::Session::unsubscribe(std::uint32_t id) {
    const auto at = subscriptions.find(id);
    if (at == subscriptions.end()) throw ClientError("there is no subscription " + std::to_string(id));
    const std::uint32_t number = at->second;
    numbers[number] = -1;
    subscriptions.erase(at);
    Channel& channel = state.channels[number];
    if (--channel.subscribers == 0) channel.is_wanted.store(false, std::memory_order_relaxed);
}

Json Server::State::Session::values_message(const std::vector<std::string>& names, const Json& id) const {
    Json message{{"op", "parameterValues"}, {"parameters", state.parameters_json(names)}};
    if (!id.is_null()) message["id"] = id;
    return message;
}

void Server::State::Session::set_parameters(const Json& json) {
    State::Request request{weak_from_this(), name_of(json), id_of(json), {}};
    try {
        state.require_control();
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
                    throw ClientError("parameter '" + name +
                                      "' takes a number or an array of numbers, with \"Inf\" for infinity, "
                                      "not " +
                                      to_text(value));
                const auto known = state.parameters.find(name);
                if (element.is_boolean() && known != state.parameters.end() &&
                    known->second.type != Type::boolean)
                    throw ClientError("parameter '" + name + "' takes a number, not " + to_text(element));
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
        static_cast<void>(state.run->prepare(state.run->follow(candidate))); // refuses what is wrong
        state.waiting_values = std::move(candidate);
        state.waiting.push_back(std::move(request));
        ++unanswered;
    } catch (const std::runtime_error& error) {
        reject(request, error.what());
    }
}

void Server::State::Session::reject(const Request& request, const std::string& reason) {
    status(2, reason + "; nothing was changed");
    if (request.id.is_null()) return;
    send(request.names.empty()
             ? Json{{"op", "parameterValues"}, {"parameters", Json::array()}, {"id", request.id}}
             : values_message(request.names, request.id));
}

void Server::State::Session::status(int level, const std::string& message) {
    send(Json{{"op", "status"}, {"level", level}, {"message", message}});
}

void Server::State::Session::send(const Json& json) { answer({to_text(json)}); }

void Server::State::Session::answer(WebSocket::Message message) {
    if (!is_open) return;
    credit -= static_cast<std::ptrdiff_t>(message.bytes.size());
    answer_bytes += message.bytes.size();
    answers.push_back(std::move(message));
    // It asks for no more before it has read these, so they are what others changed.
    if (answers.size() > 1 && answer_bytes > state.options.client_bytes) return leave();
    write();
}

void Server::State::Session::send_sample(std::uint32_t channel, std::int64_t time,
                                         const std::vector<std::byte>& value) {
    std::string content(recording::message_prefix_bytes + value.size(), '\0');
    recording::write_message_prefix(reinterpret_cast<std::byte*>(content.data()),
                                    static_cast<double>(time) / 1e9);
    std::memcpy(&content[recording::message_prefix_bytes], value.data(), value.size());
    send_data(channel, time, content);
}

/// Message data: opcode 1, the client's own number for the channel, the time in ns, content. Where a viewer
/// reads too slowly, the oldest samples make room.
void Server::State::Session::send_data(std::uint32_t channel, std::int64_t time, std::string_view content) {
    const auto id = static_cast<std::uint32_t>(numbers[channel]);
    constexpr std::size_t header = 1 + 4 + 8;
    std::string bytes(header, '\1');
    std::memcpy(&bytes[1], &id, 4);
    std::memcpy(&bytes[5], &time, 8);
    bytes += content;
    for (; !samples.empty() && sample_bytes + bytes.size() > state.options.client_bytes; ++lost) {
        sample_bytes -= samples.front().bytes.size();
        samples.pop_front();
        state.lost_messages.fetch_add(1, std::memory_order_relaxed);
    }
    sample_bytes += bytes.size();
    samples.push_back({std::move(bytes), false});
    write();
}

/// Answers go before samples.
void Server::State::Session::write() {
    if (is_writing) return;
    const bool is_answer = !answers.empty();
    auto& queue = is_answer ? answers : samples;
    if (queue.empty()) {
        if (lost > 0 && !is_leaving)
            status(1, std::to_string(std::exchange(lost, 0)) +
                          " messages were lost: this viewer reads too slowly");
        else if (is_leaving)
            close(WebSocket::Close::going_away, "");
        return;
    }
    WebSocket::Message message = std::move(queue.front());
    queue.pop_front();
    (is_answer ? answer_bytes : sample_bytes) -= message.bytes.size();
    is_writing = true;
    socket->write(std::move(message), [self = shared_from_this()](auto error) {
        self->is_writing = false;
        if (error) return self->leave();
        self->write();
        self->read();
    });
}

/// Who sends too much gets nothing more but the reason.
void Server::State::Session::dismiss() {
    is_open = false;
    answers.clear();
    samples.clear();
    close(WebSocket::Close::too_big, WebSocket::too_long(state.longest_message));
}

void Server::State::Session::say_goodbye() {
    if (!is_open) return leave();
    is_open = false;
    is_leaving = true;
    write();
}

void Server::State::Session::close(WebSocket::Close code, const std::string& reason) {
    is_writing = true; // nothing follows
    socket->close(code, reason, [self = shared_from_this()] { self->leave(); });
}

void Server::State::Session::leave() {
    is_open = false;
    while (!subscriptions.empty()) unsubscribe(subscriptions.begin()->first);
    socket->leave();
    const bool has_left = std::erase(state.sessions, shared_from_this()) > 0;
    if (has_left && state.sessions.empty() && !state.last_state.empty()) state.all_have_left.set_value();
}

} // namespace bf::realtime
