#include "bf/service/server.hpp"

#include "bf/base/files.hpp"
#include "bf/realtime/token.hpp"
#include "bf/realtime/web_socket.hpp"
#include "bf/service/service.hpp"

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace bf::service {

namespace fs = std::filesystem;

namespace {

namespace asio = boost::asio;
using realtime::HttpRequest, realtime::HttpResponse, realtime::WebSocket;
using tcp = asio::ip::tcp;

constexpr auto tick = std::chrono::milliseconds(200);
constexpr std::size_t longest_request = std::size_t{16} << 20; ///< bytes of a pasted text

/// Nothing is loaded from elsewhere, nothing runs that is not a file of the page, and no other page may frame
/// it.
constexpr const char* policy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; "
                               "img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; worker-src "
                               "'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const char* media_type(const fs::path& file) {
    static const std::map<std::string, const char*> types = {{".html", "text/html; charset=utf-8"},
                                                             {".js", "text/javascript; charset=utf-8"},
                                                             {".css", "text/css; charset=utf-8"},
                                                             {".svg", "image/svg+xml"},
                                                             {".png", "image/png"},
                                                             {".woff2", "font/woff2"},
                                                             {".json", "application/json"},
                                                             {".wasm", "application/wasm"}};
    const auto found = types.find(file.extension().string());
    return found == types.end() ? "application/octet-stream" : found->second;
}

} // namespace

struct Server::State {
    struct Page;

    explicit State(const ServerOptions& o)
        : options(o), service({options.file, options.version,
                               [this](std::function<void()> task) { asio::post(io, std::move(task)); },
                               [this](const std::string& text) { broadcast(text, false); },
                               [this](const std::string& frame) { broadcast(frame, true); },
                               options.sceneries, options.attach, options.recording}) {
        if (options.token.empty()) options.token = realtime::random_token();
        if (options.token.empty()) throw std::runtime_error("the system gives no random token");
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
    }

    void accept();
    void run_tick(const std::function<bool()>& go_on);
    void broadcast(const std::string& message, bool is_binary);
    std::size_t open_pages() const;

    /// Is this the address that the browser was given, and not one that another page made it believe in?
    bool is_here(std::string_view host) const {
        const std::string number = ":" + std::to_string(port);
        return host == "127.0.0.1" + number || host == "localhost" + number;
    }

    ServerOptions options;
    asio::io_context io;
    tcp::acceptor acceptor{io};
    asio::steady_timer timer{io};
    std::uint16_t port = 0;
    std::vector<std::shared_ptr<Page>> pages;
    int last_page = 0;
    Service service; ///< after what its callbacks use
};

struct Server::State::Page : std::enable_shared_from_this<Page> {
    Page(State& s, tcp::socket connected)
        : state(s), socket(std::make_shared<WebSocket>(std::move(connected))) {}

    void start() {
        socket->receive(std::chrono::seconds(30),
                        [self = shared_from_this()](auto error, const auto& request) {
                            error ? self->leave() : self->respond(request);
                        });
    }

    void respond(const HttpRequest& request) {
        if (!state.is_here(request.host))
            return refuse(403, "this address is not served; use the one that bf edit printed\n");
        const std::string path = request.target.substr(0, request.target.find('?'));
        const std::string_view token = token_in(request.target);
        if (path == "/socket") return shake_hands(request, token);
        if (request.method != "GET" && request.method != "HEAD")
            return refuse(405, "this server answers GET\n");
        if (path.starts_with("/meshes/") || path.starts_with("/recordings/") || path.starts_with("/images/"))
            return send_data(path.substr(1), token);
        send_file(path == "/" ? "/index.html" : path, request.method == "GET");
    }

    static std::string_view token_in(std::string_view target) {
        constexpr std::string_view key = "?token=";
        const auto at = target.find(key);
        return at == target.npos ? "" : target.substr(at + key.size());
    }
    bool knows(std::string_view token) {
        if (realtime::is_token(token, state.options.token)) return true;
        refuse(403, "open the address with the token, which bf edit printed\n");
        return false;
    }

    void shake_hands(const HttpRequest& request, std::string_view token) {
        if (!knows(token)) return;
        // A program may come without an origin; a browser always says which page it is.
        const std::string_view origin = request.origin;
        constexpr std::string_view scheme = "http://";
        if (!origin.empty() && !(origin.starts_with(scheme) && state.is_here(origin.substr(scheme.size()))))
            return refuse(403, "pages of other addresses are not served\n");
        if (!request.is_upgrade) return refuse(426, "this address takes a WebSocket\n");
        if (state.open_pages() >= state.options.most_pages)
            return refuse(503, "too many pages are open; close one\n");
        socket->accept("", [self = shared_from_this()](auto error) {
            if (error) return self->leave();
            self->is_open = true;
            self->number = ++self->state.last_page;
            self->read();
        });
    }

    void send_data(const std::string& what, std::string_view token) {
        if (!knows(token)) return;
        auto data = state.service.data(what);
        if (!data) return refuse(404, "there is no such scene, recording or image any more\n");
        send({.type = "application/octet-stream", .body = std::move(*data)});
    }

    /// Only files of the page, which hold no secret, so that they need no token.
    void send_file(const std::string& path, bool has_body) {
        const fs::path file = state.options.page / fs::path(path.substr(1));
        std::error_code error;
        if (!is_inside(file, state.options.page) || !fs::is_regular_file(file, error))
            return refuse(404, "there is no such file\n");
        try {
            send({.type = media_type(file), .body = read_text_file(file), .has_body = has_body});
        } catch (const FileError&) {
            refuse(404, "there is no such file\n");
        }
    }

    void refuse(int status, const char* text) { send({.status = status, .body = text}); }

    /// One answer for each connection: a page has few files.
    void send(HttpResponse response) {
        response.fields = {{"Content-Security-Policy", policy},
                           {"X-Content-Type-Options", "nosniff"},
                           {"Referrer-Policy", "no-referrer"},
                           {"Cross-Origin-Opener-Policy", "same-origin"},
                           {"Cross-Origin-Resource-Policy", "same-origin"},
                           {"Cache-Control", "no-cache"}};
        socket->respond(std::move(response), [self = shared_from_this()] { self->leave(); });
    }

    void read() {
        if (!is_open) return;
        socket->read(longest_request, [self = shared_from_this()](auto error, const auto& request) {
            if (WebSocket::is_too_long(error)) return self->dismiss();
            if (error) return self->leave();
            // Others wait in the meantime; what a page asks for takes milliseconds.
            if (request.is_text) self->push({self->state.service.answer(self->number, request.bytes)});
            self->read();
        });
    }

    /// Samples are lost where a page does not read, and in the end the page is.
    void push(WebSocket::Message message) {
        if (!is_open) return;
        if (waiting + message.bytes.size() > state.options.page_bytes) {
            if (!message.is_text) return;
            if (waiting > 4 * state.options.page_bytes) return leave();
        }
        waiting += message.bytes.size();
        queue.push_back(std::move(message));
        write();
    }

    void write() {
        if (is_writing || queue.empty() || !is_open) return;
        is_writing = true;
        const std::size_t bytes = queue.front().bytes.size();
        socket->write(std::move(queue.front()), [self = shared_from_this(), bytes](auto error) {
            self->is_writing = false;
            if (error) return self->leave();
            self->waiting -= bytes;
            self->write();
        });
        queue.pop_front();
    }

    /// Who asks for too much gets nothing more but the reason.
    void dismiss() {
        if (std::exchange(is_open, false)) state.service.leave(number);
        socket->close(WebSocket::Close::too_big, WebSocket::too_long(longest_request),
                      [self = shared_from_this()] { self->leave(); });
    }

    void leave() {
        if (std::exchange(has_left, true)) return;
        if (std::exchange(is_open, false)) state.service.leave(number);
        socket->leave();
        std::erase(state.pages, shared_from_this());
    }

    State& state;
    const std::shared_ptr<WebSocket> socket;
    int number = 0; ///< of one that is open
    bool is_open = false, is_writing = false, has_left = false;
    std::deque<WebSocket::Message> queue; ///< not yet written
    std::size_t waiting = 0;              ///< bytes in it and in what is being written
};

std::size_t Server::State::open_pages() const {
    return static_cast<std::size_t>(
        std::count_if(pages.begin(), pages.end(), [](const auto& p) { return p->is_open; }));
}

void Server::State::accept() {
    acceptor.async_accept([this](auto error, tcp::socket socket) {
        if (!error) {
            WebSocket::Error ignored;
            socket.set_option(tcp::no_delay(true), ignored);
            constexpr std::size_t most_strangers = 64; // browsers open several connections at once
            if (pages.size() - open_pages() >= most_strangers)
                (*std::find_if(pages.begin(), pages.end(), [](const auto& p) {
                    return !p->is_open;
                }))->leave();
            pages.push_back(std::make_shared<Page>(*this, std::move(socket)));
            pages.back()->start();
        }
        if (acceptor.is_open()) accept();
    });
}

void Server::State::run_tick(const std::function<bool()>& go_on) {
    if (!go_on()) return io.stop();
    service.tick();
    timer.expires_after(tick);
    timer.async_wait([this, &go_on](auto error) {
        if (!error) run_tick(go_on);
    });
}

void Server::State::broadcast(const std::string& message, bool is_binary) {
    const auto everyone = pages; // who reads nothing may leave
    for (const auto& page : everyone) page->push({message, !is_binary});
}

Server::Server(const ServerOptions& options) : state_(std::make_unique<State>(options)) {}

Server::~Server() {
    const auto everyone = state_->pages;
    for (const auto& page : everyone) page->leave();
    state_->io.poll(); // what they waited for ends
}

std::string Server::address() const {
    return "http://127.0.0.1:" + std::to_string(state_->port) + "/?token=" + state_->options.token;
}
std::uint16_t Server::port() const { return state_->port; }
const std::string& Server::token() const { return state_->options.token; }

std::string Server::run(const std::function<bool()>& go_on) {
    state_->accept();
    state_->run_tick(go_on);
    state_->io.run();
    return state_->service.unsaved();
}

} // namespace bf::service
