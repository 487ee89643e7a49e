// HTTP and WebSockets: one connection, of a server or of a client. All but its destruction happens in the
// thread of its io_context.
//
// Boost.Beast, whose templates take longer to compile than a server, stays behind it.
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/system/error_code.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace bf::realtime {

/// What a client asks for first. A field that is not there is empty.
struct HttpRequest {
    std::string method, target, host, origin;
    std::vector<std::string> protocols; ///< of a WebSocket that it offers to speak
    bool is_upgrade = false;            ///< to a WebSocket
};

struct HttpResponse {
    int status = 200;
    std::string type = "text/plain; charset=utf-8", body = {};
    std::vector<std::pair<const char*, const char*>> fields = {}; ///< besides its type and length
    bool has_body = true;                                         ///< false: the answer to HEAD
};

/// A connection that begins with a request and its answer, and where both want it goes on with messages.
class WebSocket : public std::enable_shared_from_this<WebSocket> {
  public:
    using Error = boost::system::error_code;
    using Then = std::function<void(Error)>;
    /// Over a port or a Unix socket.
    using Socket = boost::asio::generic::stream_protocol::socket;
    struct Message {
        std::string bytes;
        bool is_text = true;
    };
    enum class Close { too_big = 1009, going_away = 1001 }; ///< RFC 6455, section 7.4.1

    explicit WebSocket(Socket socket);
    ~WebSocket();
    WebSocket(const WebSocket&) = delete;
    WebSocket& operator=(const WebSocket&) = delete;

    // ---- of a server ----

    /// Waits that long for a request, without a body.
    void receive(std::chrono::seconds patience, std::function<void(Error, const HttpRequest&)> then);
    /// The answer to it, which is the last thing that is said.
    void respond(HttpResponse response, std::function<void()> then);
    /// Grants the upgrade that was asked for; to that protocol, if it is not empty.
    void accept(const std::string& protocol, Then then);

    // ---- of a client ----

    /// Why there is no WebSocket.
    struct Refusal {
        int status = 0;        ///< of the answer; 0: there was none
        std::string body = {}; ///< of the answer
        bool is_http = true;   ///< as far as it answered
        std::string error = {};
    };
    /// Waits `patience` at the most for the answer, and later for that to a goodbye.
    void connect(const std::string& host, const std::string& target, const std::string& protocol,
                 std::chrono::seconds patience, std::function<void(const Refusal*)> then);

    // ---- of both ----

    /// One at a time. A message of more than `most` bytes is an error, see is_too_long, after which the
    /// connection is still open.
    void read(std::size_t most, std::function<void(Error, Message)> then);
    static bool is_too_long(Error error);
    /// What whoever sent it is told.
    static std::string too_long(std::size_t most) {
        return "a message has at most " + std::to_string(most) + " bytes";
    }
    /// One at a time.
    void write(Message message, Then then);
    /// Says why. What is being written goes before it.
    void close(Close code, const std::string& reason, std::function<void()> then);
    /// What waits ends with an error.
    void leave();

  private:
    struct State;
    void read_on(std::size_t most, std::function<void(Error, Message)> then);

    std::unique_ptr<State> state_;
};

} // namespace bf::realtime
