// Changes of parameters while a generated program runs, over a socket of this computer.
//
// Each line is a YAML mapping of names and values, e.g. "Gain.Kp: 0.2" or "{Gain: {Kp: 0.2, Kd: [1, 2]}}".
// All values of a line are applied together between two steps, or none is. The answer is a line, too: "ok",
// or "error: " and what is wrong. The line "?" is answered by the lines that --list has for all that can be
// changed, and an empty line. Whoever sends what is no mapping is disconnected, so that a web page's request
// is none.
//
// A Unix socket is open to its owner alone. Every user of the computer can reach a TCP port, so its first
// line must be "token TOKEN".
#pragma once

#include "bf/codegen/parameter_file.hpp"
#include "bf/realtime/token.hpp"
#include "bf/realtime/unix_socket.hpp"

#include <arpa/inet.h>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace bf::generated {

class CommandPort {
  public:
    template <class Model>
    explicit CommandPort(const Model& model)
        : check_(
              [&model](ParameterChanges& changes, const Entry& entry) { return changes.add(model, entry); }) {
        for (const auto& table : {model.variable_table(), model.parameter_table()})
            for (const Quantity& q : table) {
                quantities_.push_back(&q);
                values_.resize(values_.size() + static_cast<std::size_t>(q.size()));
            }
    }
    CommandPort(const CommandPort&) = delete;
    CommandPort& operator=(const CommandPort&) = delete;
    ~CommandPort() {
        ends_.store(true);
        if (thread_.joinable()) thread_.join();
        if (listener_ >= 0) ::close(listener_);
        if (!path_.empty()) ::unlink(path_.c_str());
    }

    /// Listens at `where`: the path of a Unix socket, or the number of a TCP port of 127.0.0.1, 0 for any
    /// free one. Empty: the Unix socket `program`.sock in the user's folder for such things. The token of a
    /// TCP port is the line in `token_file`, which is made if it is not there; empty: a random one. Returns
    /// an empty text, or what is wrong.
    std::string listen(const std::string& where, const std::string& program, const std::string& token_file) {
        const bool is_port = !where.empty() && where.find_first_not_of("0123456789") == std::string::npos;
        if (const std::string wrong =
                is_port ? listen_to_port(where, token_file) : listen_to_path(where, program);
            !wrong.empty())
            return wrong;
        sigset_t all, before; // signals are for the thread that steps
        ::sigfillset(&all);
        ::pthread_sigmask(SIG_SETMASK, &all, &before);
        thread_ = std::thread([this] { serve(); });
        ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
        return "";
    }
    /// Where it listens, for people.
    const std::string& place() const { return place_; }

    /// The stepping thread, between two steps: takes what is there, waits for nothing.
    template <class Model> void apply(Model& model) noexcept {
        if (state_.load(std::memory_order_acquire) != State::posted) return;
        if (changes_) {
            wrong_ = model.set_parameters(changes_->data(), static_cast<int>(changes_->size()));
        } else {
            std::size_t at = 0;
            for (const Quantity* q : quantities_)
                for (int i = 0; i < q->size(); ++i) values_[at++] = read(model.data(*q), q->type, i);
        }
        state_.store(State::applied, std::memory_order_release);
    }

  private:
    enum class State { empty, posted, applied };
    static constexpr std::size_t most_clients = 16, longest_line = 65536;
    struct Client {
        int socket;
        bool is_known; ///< it told the token
        std::string received;
        bool has_line() const { return received.find('\n') != std::string::npos; }
    };

    static std::string cannot(const std::string& where, const std::string& why, const std::string& remedy) {
        return "cannot take commands at " + where + ": " + why + "; " + remedy;
    }

    std::string listen_to_port(const std::string& where, const std::string& token_file) {
        const long port = std::strtol(where.c_str(), nullptr, 10);
        if (port > 65535) return cannot("port " + where, "it is above 65535", "give another one");
        if (token_file.empty())
            token_ = realtime::random_token();
        else if (const std::string wrong = realtime::read_token(token_file, token_); !wrong.empty())
            return wrong;
        listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        const int yes = 1;
        ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof address;
        auto* const generic = reinterpret_cast<sockaddr*>(&address);
        if (listener_ < 0 || ::bind(listener_, generic, size) != 0 || ::listen(listener_, SOMAXCONN) != 0 ||
            ::getsockname(listener_, generic, &size) != 0)
            return cannot("port " + where, std::strerror(errno), "give another port, or 0 for any free one");
        place_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + " after the line: token " +
                 (token_file.empty() ? token_ : "and the line in " + token_file);
        return "";
    }

    std::string listen_to_path(std::string path, const std::string& program) {
        if (path.empty()) {
            const char* folder = std::getenv("XDG_RUNTIME_DIR");
            if (!folder || !*folder) folder = std::getenv("RUNTIME_DIRECTORY"); // of a service
            if (!folder || !*folder)
                return "cannot take commands: there is no XDG_RUNTIME_DIR; give the path of a socket in a "
                       "folder "
                       "of your own";
            path = std::string(folder) + "/" + program + ".sock";
        }
        listener_ = realtime::listen_at(path);
        if (listener_ < 0) return cannot(path, std::strerror(errno), "give the path of another socket");
        place_ = path_ = path;
        return "";
    }

    void serve() {
        const NumberLocale locale;
        std::vector<Client> clients;
        while (!ends_.load()) {
            std::vector<pollfd> polled{{listener_, POLLIN, 0}};
            bool is_busy = false;
            for (const Client& client : clients) {
                is_busy = is_busy || client.has_line();
                polled.push_back({client.socket, static_cast<short>(client.has_line() ? 0 : POLLIN), 0});
            }
            if (::poll(polled.data(), polled.size(), is_busy ? 0 : 50) < 0) continue;
            for (std::size_t i = clients.size(); i-- > 0;)
                if ((polled[i + 1].revents || clients[i].has_line()) && !serve(clients[i])) {
                    ::close(clients[i].socket);
                    clients.erase(clients.begin() + static_cast<std::ptrdiff_t>(i));
                }
            if (polled[0].revents & POLLIN) accept(clients);
        }
        for (const Client& client : clients) ::close(client.socket);
    }

    /// Whoever has not told the token gives way to those who come later.
    void accept(std::vector<Client>& clients) {
        const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (socket < 0) { // no descriptor is left: the connection waits
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
            return;
        }
        if (clients.size() >= most_clients) {
            const auto stranger = std::find_if(clients.begin(), clients.end(),
                                               [](const Client& client) { return !client.is_known; });
            ::close(stranger == clients.end() ? socket : stranger->socket);
            if (stranger == clients.end()) return;
            clients.erase(stranger);
        }
        clients.push_back({socket, token_.empty(), ""});
    }

    /// Answers one line, so that nobody waits for many lines of another. False when the connection is over.
    bool serve(Client& client) {
        if (!client.has_line()) {
            char bytes[4096];
            const ssize_t count = ::recv(client.socket, bytes, sizeof bytes, 0);
            if (count <= 0) return count < 0 && (errno == EAGAIN || errno == EINTR);
            client.received.append(bytes, static_cast<std::size_t>(count));
            if (!client.has_line()) return client.received.size() <= longest_line;
        }
        const std::size_t end = client.received.find('\n');
        const std::string line = detail::trimmed(client.received.substr(0, end));
        client.received.erase(0, end + 1);
        bool goes_on = true;
        const std::string answer = client.is_known ? answer_to(line, goes_on) : greet(client, line, goes_on);
        // What is not read is lost; a step waits for nobody.
        const ssize_t sent = ::send(client.socket, answer.data(), answer.size(), MSG_NOSIGNAL);
        return sent == static_cast<ssize_t>(answer.size()) && goes_on;
    }

    std::string greet(Client& client, const std::string& line, bool& goes_on) const {
        client.is_known = goes_on =
            line.compare(0, 6, "token ") == 0 && realtime::is_token(detail::trimmed(line.substr(6)), token_);
        return goes_on ? "ok\n"
                       : "error: the first line is 'token TOKEN', which the program told when it started\n";
    }

    std::string answer_to(const std::string& line, bool& is_mapping) {
        if (line == "?") {
            if (!exchange(nullptr)) return "error: the program ends\n";
            std::string text;
            std::size_t at = 0;
            for (const Quantity* q : quantities_) {
                text += line_of(*q, [&](int i) { return values_[at + static_cast<std::size_t>(i)]; });
                at += static_cast<std::size_t>(q->size());
            }
            return text + "\n";
        }
        const auto error = [](std::string text) {
            for (char& c : text) c = c == '\n' ? ' ' : c;
            return "error: " + detail::trimmed(text) + "\n";
        };
        const ParsedParameters parsed = parse_parameters(line, "line");
        is_mapping = parsed.errors.empty();
        if (!is_mapping) return error(parsed.errors);
        ParameterChanges changes;
        for (const Entry& entry : parsed.entries)
            if (const std::string wrong = check_(changes, entry); !wrong.empty()) return error(wrong);
        if (!exchange(&changes.all())) return "error: the program ends\n";
        return wrong_ ? error(wrong_) : "ok\n";
    }

    /// Waits until the stepping thread has taken the changes, or has given the values.
    bool exchange(const std::vector<NewValue>* changes) {
        changes_ = changes;
        state_.store(State::posted, std::memory_order_release);
        while (state_.load(std::memory_order_acquire) != State::applied) {
            if (ends_.load()) return false;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        state_.store(State::empty, std::memory_order_release);
        return true;
    }

    std::function<std::string(ParameterChanges&, const Entry&)> check_;
    std::vector<const Quantity*> quantities_;
    std::vector<double> values_; ///< of all quantities, for "?"
    int listener_ = -1;
    std::string token_, path_, place_;
    std::thread thread_;
    std::atomic<bool> ends_{false};
    std::atomic<State> state_{State::empty};
    const std::vector<NewValue>* changes_ = nullptr;
    const char* wrong_ = nullptr;
};

} // namespace bf::generated
