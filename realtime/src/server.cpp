#include "bf/realtime/server.hpp"

#include "bf/base/run_options.hpp"
#include "bf/realtime/statistics_json.hpp"
#include "bf/realtime/token.hpp"
#include "bf/realtime/unix_socket.hpp"
#include "bf/recording/message.hpp"
#include "server_state.hpp"

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <cmath>
#include <csignal>
#include <cstring>
#include <netinet/in.h>

namespace bf::realtime {

namespace {

using tcp = asio::ip::tcp;

constexpr auto tick = std::chrono::milliseconds(5);
constexpr int ticks_per_report = 50; // of the timing
constexpr std::string_view unix_scheme = "unix:";
constexpr const char* read_only =
    "this program was started to be looked at alone; start it with --control to let viewers change "
    "parameters, start and stop it";

} // namespace

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

Server::State::State(Run& r, LoopAccess l, const ServerOptions& o)
    : run(&r), loop(l), options(o), ring(o.buffer_bytes), told(l.control.state()),
      edits(std::make_unique<Edits>(*this)) {
    if (options.token.empty()) options.token = random_token();
    if (options.token.empty()) throw std::runtime_error("the system gives no random token");
    if (const std::string wrong = check_place(options.where); !wrong.empty()) throw std::runtime_error(wrong);
}

Server::State::~State() {
    if (!path.empty()) ::unlink(path.c_str());
}

void Server::State::listen() {
    const auto cannot = [](const std::string& place, const std::string& why, const std::string& remedy) {
        return std::runtime_error("cannot serve " + place + ": " + why + "; give " + remedy);
    };
    if (options.where.starts_with(unix_scheme)) {
        const std::string place = options.where.substr(unix_scheme.size());
        const int listener = listen_at(place);
        if (listener < 0)
            throw cannot("at the socket " + place, std::strerror(errno), "the path of another socket");
        path = place;
        acceptor.assign(Protocol(AF_UNIX, 0), listener);
        address = options.where;
    } else {
        try {
            const tcp::endpoint endpoint(asio::ip::address_v4::loopback(),
                                         static_cast<std::uint16_t>(std::stoi(options.where)));
            acceptor.open(endpoint.protocol());
            acceptor.set_option(tcp::acceptor::reuse_address(true));
            acceptor.bind(endpoint);
            acceptor.listen();
        } catch (const boost::system::system_error& error) {
            throw cannot("on port " + options.where, error.code().message(),
                         "another port, or 0 for any free one");
        }
        const auto bound = acceptor.local_endpoint();
        sockaddr_in at{};
        std::memcpy(&at, bound.data(), sizeof at);
        address = "ws://127.0.0.1:" + std::to_string(ntohs(at.sin_port)) + "/";
    }
    run_tick();
}

void Server::State::accept() {
    is_accepting = true;
    acceptor.async_accept([this](auto error, WebSocket::Socket socket) {
        is_accepting = false;
        if (error) return;        // the next tick tries again
        WebSocket::Error ignored; // by Unix sockets, which never wait
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
    if (!last_state.empty()) return;
    if (!is_accepting) accept();
    deliver();
    exchange_parameters();
    edits->tick();
    const auto state = loop.control.state();
    if (++ticks % ticks_per_report == 0 || state != std::exchange(told, state)) tell_timing();
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
        for (const auto& session : sessions)
            if (session->wants(channel)) session->send_sample(channel, time, value);
    });
}

void Server::State::tell_timing() {
    const auto wants = [this](const auto& session) { return session->wants(timing_channel); };
    if (std::none_of(sessions.begin(), sessions.end(), wants)) return;
    nlohmann::ordered_json json{
        {"state", last_state.empty() ? text(loop.control.state()) : last_state.c_str()},
        {"end", how_it_ended},
        {"time", time.load()},
        {"edits", edits->count()}};
    json.update(statistics_json(loop.statistics));
    const std::string content = to_text(json);
    for (const auto& session : sessions)
        if (wants(session)) session->send_data(timing_channel, nanoseconds(time), content);
}

void Server::State::settle() {
    deliver();
    if (!posted.empty())
        if (const auto result = loop.parameters.take_result()) finish_change(*result);
    edits->end();
    acceptor.close();
    timer.cancel();
}

std::vector<LogEntry> Server::State::log_entries() const {
    std::vector<LogEntry> all;
    for (const auto& entry : log.entries()) all.push_back(entry.entry);
    return all;
}

void Server::State::end(const std::string& failure, bool is_interrupted) {
    settle();
    const auto entries = log_entries();
    const LogEntry* const stop = stop_in(entries);
    last_state = failure.empty() ? "ended" : "failed";
    how_it_ended =
        !failure.empty() ? "the program failed: " + failure
        : !stop          ? std::string("the program ended in order") + (is_interrupted ? ", interrupted" : "")
        : stop->what == emergency_entry ? "the program was stopped by emergency stop of " + stop->who
                                        : "the program ended in order, stopped by " + stop->who;
    tell_timing();
    const auto everyone = sessions;
    for (const auto& session : everyone) session->say_goodbye();
    if (everyone.empty()) all_have_left.set_value();
}

void Server::State::tell_log(const Log::Numbered& entry, Session& session) const {
    if (!session.wants(log_channel)) return;
    constexpr int information = 2;
    const std::int64_t ns = std::llround(entry.entry.clock * 1e9);
    const Json json{{"timestamp", {{"sec", ns / 1'000'000'000}, {"nsec", ns % 1'000'000'000}}},
                    {"level", information},
                    {"message", entry.entry.what},
                    {"name", entry.entry.who},
                    {"file", ""},
                    {"line", 0},
                    {"number", entry.number},
                    {"time", entry.entry.time}};
    session.send_data(log_channel, nanoseconds(entry.entry.time), to_text(json));
}

void Server::State::tell_log(const Log::Numbered& entry) {
    for (const auto& session : sessions) tell_log(entry, *session);
}

std::uint32_t Server::State::channel_of(const std::string& topic, const Quantity& signal) {
    const auto& info = signal.info;
    Json told{{"topic", topic},
              {"encoding", "cdr"},
              {"schemaName", recording::message_type(info)},
              {"schemaEncoding", "ros2msg"},
              {"schema", recording::message_definition(info)}};
    const auto id = static_cast<std::uint32_t>(channels.size());
    const auto known = by_topic.find(topic);
    if (known != by_topic.end()) {
        told["id"] = known->second;
        if (channels[known->second].advertised == told) return known->second;
    }
    told["id"] = id;
    channels.emplace_back(std::move(told));
    by_topic[topic] = id;
    return id;
}

Json Server::State::advertisement() const {
    Json all = Json::array();
    for (const auto& channel : channels)
        if (channel.is_there) all.push_back(channel.advertised);
    return {{"op", "advertise"}, {"channels", std::move(all)}};
}

Server::State::Table::Table(State& state, const std::vector<Quantity>& signals) : state_(state) {
    std::set<std::string> topics;
    for (const auto& signal : signals) {
        const auto topic = recording::topic_of(signal.path);
        if (!topics.insert(topic).second) continue;
        const std::uint32_t number = state.channel_of(topic, signal);
        rows_.push_back({&state.channels[number], number, static_cast<std::uint32_t>(signal.info.bytes()),
                         signal.rate, signal.data});
    }
}

void Server::State::Table::observe(const Run& run) noexcept {
    const auto time = static_cast<std::int64_t>(std::llround(run.time() * 1e9));
    state_.time.store(run.time(), std::memory_order_relaxed);
    for (const auto& [channel, number, bytes, rate, data] : rows_) {
        if (!channel->is_wanted.load(std::memory_order_relaxed)) continue;
        // A constant is sent once, to those who come late too.
        if (rate == 0)
            channel->is_wanted.store(false, std::memory_order_relaxed);
        else if (!run.is_hit(rate))
            continue;
        state_.ring.push(number, time, data, bytes);
    }
}

void Server::State::Table::tell_constants() {
    for (const auto& row : rows_)
        if (row.rate == 0 && row.channel->subscribers > 0) row.channel->is_wanted.store(true);
}

void Server::State::know_parameters() {
    tuned = run->parameters();
    names.clear();
    parameters.clear();
    for (auto& [name, values] : present_values()) {
        names.push_back(name);
        parameters.emplace(name, Parameter{Type::float64, values.size() == 1, std::move(values)});
    }
    for (const auto& parameter : tuned) parameters.at(parameter.path).type = parameter.type;
    // A client may name every channel, and give every parameter, in one message.
    longest_message = bytes_at_once + 64 * channels.size();
    for (const auto& [name, parameter] : parameters)
        longest_message += 64 + name.size() + 32 * parameter.values.size();
    if (why_not_edited().empty()) longest_message = std::max(longest_message, most_edit_bytes);
}

std::string Server::State::why_not_edited() const {
    if (!options.editing || !loop.succession) return options.why_not_edited;
    return options.is_controlled ? "" : read_only;
}

void Server::State::require_control() const {
    if (!options.is_controlled) throw ClientError(read_only);
}

void Server::State::command(const std::string& service, const std::string& who) {
    require_control();
    Control& control = loop.control;
    if (service == start_service && !control.start())
        throw ClientError("the program does not wait to be started");
    if (service == stop_service && !control.stop()) throw ClientError("the program ends already");
    if (service == emergency_service && !control.emergency_stop())
        throw ClientError("the emergency stop is under way already");
    const auto& entry = log.add(time, who, service == emergency_service ? emergency_entry : service);
    tell_log(entry);
    if (options.on_control) options.on_control(entry.entry);
}

void Server::State::exchange_parameters() {
    if (!posted.empty()) {
        const auto result = loop.parameters.take_result();
        if (!result) return;
        finish_change(*result);
    }
    if (!waiting.empty() && !edits->is_busy()) post_change();
}

/// Of variables and parameters, in document order.
std::vector<ParameterValue> Server::State::present_values() const {
    std::vector<ParameterValue> all = run->variables();
    for (const auto& parameter : tuned) all.push_back({parameter.path, parameter.values()});
    return all;
}

void Server::State::post_change() {
    posted = std::exchange(waiting, {});
    posted_values = std::exchange(waiting_values, {});
    try {
        posted_parameters = run->follow(posted_values);
        loop.parameters.post(run->prepare(posted_parameters));
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
    std::map<std::string, std::string> who; // asked last for that value
    std::string all;
    for (const auto& request : requests) {
        for (const auto& name : request.names) who[name] = request.who;
        if (all.find(request.who) == all.npos) all += (all.empty() ? "" : ", ") + request.who;
    }
    if (options.on_change) options.on_change(result.step, posted_parameters, all);
    run->accept(posted_values);
    for (const auto& value : posted_values) {
        std::erase_if(asked, [&](const auto& before) { return before.path == value.path; });
        asked.push_back(value);
    }
    std::vector<std::string> changed;
    for (const auto& [name, values] : posted_parameters) changed.push_back(name);
    for (auto& [name, values] : present_values()) {
        auto& known = parameters.at(name).values;
        if (known == values) continue;
        if (who.contains(name)) tell_log(log.add_change(time, who.at(name), name, known, values));
        known = std::move(values);
        if (std::find(changed.begin(), changed.end(), name) == changed.end()) changed.push_back(name);
    }
    edits->table().tell_constants(); // they may follow from parameters
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

std::string check_place(const std::string& where) {
    if (where.starts_with(unix_scheme)) {
        if (where.size() == unix_scheme.size())
            return "unix: needs the path of a socket, e.g. unix:motor.sock";
        return where.find('?') == where.npos
                   ? ""
                   : "the path of a socket has no '?', behind which the token stands in its address";
    }
    double port = 0;
    const bool is_number = where.find_first_not_of("0123456789") == where.npos;
    if (is_number && read_option(where, {0, 65535, true}, port).empty()) return "";
    return "'" + where + "' is neither a port, 0 to 65535, nor unix:PATH";
}

Server::Server(Run& run, const std::vector<Quantity>& signals, LoopAccess loop, const ServerOptions& options)
    : state_(std::make_unique<State>(run, loop, options)) {
    State& s = *state_;
    const auto add_json = [&](const char* topic, const char* schema) {
        s.channels.emplace_back(Json{{"id", s.channels.size()},
                                     {"topic", topic},
                                     {"encoding", "json"},
                                     {"schemaName", schema},
                                     {"schemaEncoding", "jsonschema"},
                                     {"schema", R"({"type": "object"})"}});
    };
    add_json(timing_topic, "bf.Timing");
    add_json(log_topic, "foxglove.Log");
    s.first = std::make_unique<State::Table>(s, signals);
    for (auto& channel : s.channels) channel.is_there = true;
    Json metadata = Json::object(); // of texts
    for (const auto& signal : signals) {
        std::string elements; // a line each
        for (const auto& name : signal.info.element_names) elements += name + "\n";
        if (!elements.empty()) metadata["elements of " + recording::topic_of(signal.path)] = elements;
    }
    s.services = {{"op", "advertiseServices"}, {"services", Json::array()}};
    for (const char* name : {start_service, stop_service, emergency_service, edit_service}) {
        const Json message{{"encoding", "json"},
                           {"schemaName", name},
                           {"schemaEncoding", "jsonschema"},
                           {"schema", R"({"type": "object"})"}};
        s.services["services"].push_back({{"id", s.services["services"].size()},
                                          {"name", name},
                                          {"type", "std_srvs/Trigger"},
                                          {"request", message},
                                          {"response", message}});
    }
    if (!options.is_controlled) metadata[refusal_key] = read_only;
    if (const std::string why = s.why_not_edited(); !why.empty()) metadata[edit_refusal_key] = why;
    s.server_info = {{"op", "serverInfo"},
                     {"name", run.name()},
                     {"capabilities", {"parameters", "parametersSubscribe", "services"}},
                     {"supportedEncodings", {"json"}},
                     {"metadata", std::move(metadata)},
                     {"sessionId", std::to_string(now(CLOCK_REALTIME))}};
    s.know_parameters();
    s.listen();
    // Signals are for the threads of the application.
    sigset_t all, before;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    s.thread = std::thread([&s] { s.io.run(); });
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void Server::end(const std::string& failure, bool is_interrupted) {
    constexpr auto patience = std::chrono::milliseconds(300);
    asio::post(state_->io, [&s = *state_, failure, is_interrupted] { s.end(failure, is_interrupted); });
    state_->all_have_left.get_future().wait_for(patience);
}

Server::~Server() {
    asio::post(state_->io, [&s = *state_] {
        s.settle();
        const auto everyone = s.sessions;
        for (const auto& session : everyone) session->leave();
        s.io.stop();
    });
    state_->thread.join();
}

void Server::observe(const Run& run) noexcept { state_->first->observe(run); }

std::string Server::address() const { return state_->address + "?token="; }
const std::string& Server::token() const { return state_->options.token; }

Server::Counts Server::counts() const {
    return {state_->ring.lost(), state_->lost_messages.load(), state_->changes.load(),
            static_cast<std::uint64_t>(state_->edits->count())};
}

std::vector<LogEntry> Server::log() const {
    std::promise<std::vector<LogEntry>> told;
    asio::post(state_->io, [&] { told.set_value(state_->log_entries()); });
    return told.get_future().get();
}

} // namespace bf::realtime
