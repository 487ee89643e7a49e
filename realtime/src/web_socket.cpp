#include "bf/realtime/web_socket.hpp"

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>

namespace bf::realtime {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Protocol = asio::generic::stream_protocol;

constexpr std::uint32_t most_header_bytes = 1 << 14;

std::string text(beast::string_view view) { return {view.data(), view.size()}; }

/// With a limit of its own Beast would close a connection without a reason; see read_on.
template <class Stream> void unlimit(Stream& stream) { stream.read_message_max(0); }

} // namespace

struct WebSocket::State {
    explicit State(Socket socket) : stream(std::move(socket)) {}
    auto& socket() { return beast::get_lowest_layer(stream); }

    websocket::stream<beast::basic_stream<Protocol>> stream;
    beast::flat_buffer buffer;
    std::optional<http::request_parser<http::string_body>> parser;
    websocket::response_type answer; ///< to a client
    http::response<http::string_body> response;
    Message written; ///< under way
};

WebSocket::WebSocket(Socket socket) : state_(std::make_unique<State>(std::move(socket))) {}
WebSocket::~WebSocket() = default;

void WebSocket::receive(std::chrono::seconds patience, std::function<void(Error, const HttpRequest&)> then) {
    State& s = *state_;
    s.socket().expires_after(patience);
    s.parser.emplace();
    s.parser->header_limit(most_header_bytes);
    s.parser->body_limit(0);
    http::async_read(s.stream.next_layer(), s.buffer, *s.parser,
                     [self = shared_from_this(), then = std::move(then)](Error error, std::size_t) {
                         HttpRequest request;
                         if (error) return then(error, request);
                         const auto& asked = self->state_->parser->get();
                         request.method = text(asked.method_string());
                         request.target = text(asked.target());
                         request.host = text(asked[http::field::host]);
                         request.origin = text(asked[http::field::origin]);
                         for (const auto offered :
                              http::token_list(asked[http::field::sec_websocket_protocol]))
                             request.protocols.push_back(text(offered));
                         request.is_upgrade = websocket::is_upgrade(asked);
                         then(error, request);
                     });
}

void WebSocket::respond(HttpResponse response, std::function<void()> then) {
    auto& to = state_->response;
    to = {static_cast<http::status>(response.status), 11};
    to.set(http::field::content_type, response.type);
    for (const auto& [name, value] : response.fields) to.set(name, value);
    to.keep_alive(false);
    to.content_length(response.body.size());
    if (response.has_body) to.body() = std::move(response.body);
    http::async_write(state_->stream.next_layer(), to,
                      [self = shared_from_this(), then = std::move(then)](Error, std::size_t) { then(); });
}

void WebSocket::accept(const std::string& protocol, Then then) {
    auto& stream = state_->stream;
    state_->socket().expires_never();
    stream.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    if (!protocol.empty())
        stream.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& response) {
            response.set(http::field::sec_websocket_protocol, protocol);
        }));
    unlimit(stream);
    stream.async_accept(state_->parser->get(),
                        [self = shared_from_this(), then = std::move(then)](Error error) {
                            self->state_->buffer.clear();
                            then(error);
                        });
}

void WebSocket::connect(const std::string& host, const std::string& target, const std::string& protocol,
                        std::chrono::seconds patience, std::function<void(const Refusal*)> then) {
    auto& stream = state_->stream;
    stream.set_option(websocket::stream_base::timeout{patience, websocket::stream_base::none(), false});
    stream.set_option(websocket::stream_base::decorator([protocol](websocket::request_type& request) {
        request.set(http::field::sec_websocket_protocol, protocol);
    }));
    unlimit(stream);
    stream.async_handshake(
        state_->answer, host, target, [self = shared_from_this(), then = std::move(then)](Error error) {
            if (!error) return then(nullptr);
            Refusal refusal{.error = error.message()};
            if (error == websocket::error::upgrade_declined) {
                refusal.status = self->state_->answer.result_int();
                refusal.body = self->state_->answer.body();
            }
            const bool is_of_http = error.category() == Error(http::error::bad_version).category();
            refusal.is_http =
                !is_of_http || error == http::error::end_of_stream || error == http::error::partial_message;
            then(&refusal);
        });
}

void WebSocket::read(std::size_t most, std::function<void(Error, Message)> then) {
    state_->buffer.clear();
    read_on(most, std::move(then));
}

void WebSocket::read_on(std::size_t most, std::function<void(Error, Message)> then) {
    auto& buffer = state_->buffer;
    state_->stream.async_read_some(
        buffer, most + 1 - buffer.size(),
        [this, self = shared_from_this(), most, then = std::move(then)](Error error, std::size_t) mutable {
            const auto& read = state_->buffer;
            if (!error && read.size() > most) error = websocket::error::message_too_big;
            if (error) return then(error, {});
            if (!state_->stream.is_message_done()) return read_on(most, std::move(then));
            then(error, {beast::buffers_to_string(read.data()), state_->stream.got_text()});
        });
}

bool WebSocket::is_too_long(Error error) { return error == websocket::error::message_too_big; }

void WebSocket::write(Message message, Then then) {
    state_->written = std::move(message);
    state_->stream.text(state_->written.is_text);
    state_->stream.async_write(
        asio::buffer(state_->written.bytes),
        [self = shared_from_this(), then = std::move(then)](Error error, std::size_t) { then(error); });
}

void WebSocket::close(Close code, const std::string& reason, std::function<void()> then) {
    state_->stream.async_close({static_cast<websocket::close_code>(code), reason},
                               [self = shared_from_this(), then = std::move(then)](Error) { then(); });
}

void WebSocket::leave() {
    Error ignored;
    auto& socket = state_->socket().socket();
    socket.shutdown(Socket::shutdown_send, ignored);
    socket.close(ignored);
}

} // namespace bf::realtime
