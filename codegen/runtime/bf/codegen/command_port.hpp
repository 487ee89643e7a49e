// Changes of parameters while a generated program runs, over a socket of this computer.
//
// Each line is a YAML mapping of names and values, e.g. "Gain.Kp: 0.2" or "{Gain: {Kp: 0.2, Kd: [1, 2]}}".
// All values of a line are applied together between two steps, or none is. The answer is a line, too: "ok",
// or "error: " and what is wrong. The line "?" is answered by the lines that --list has for all that can be
// changed, and an empty line. Whoever sends what is no mapping is disconnected, so that a web page's request
// is none.
#pragma once

#include "bf/codegen/parameter_file.hpp"

#include <arpa/inet.h>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
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
    }

    /// Listens on 127.0.0.1; port 0 is any free one. Empty, or what is wrong.
    std::string listen(int port) {
        listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        const int yes = 1;
        ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof address;
        auto* const generic = reinterpret_cast<sockaddr*>(&address);
        if (listener_ < 0 || ::bind(listener_, generic, size) != 0 || ::listen(listener_, 8) != 0 ||
            ::getsockname(listener_, generic, &size) != 0)
            return "cannot take commands at port " + std::to_string(port) + ": " + std::strerror(errno) +
                   "; give another port, or 0 for any free one";
        port_ = ntohs(address.sin_port);
        sigset_t all, before; // signals are for the thread that steps
        ::sigfillset(&all);
        ::pthread_sigmask(SIG_SETMASK, &all, &before);
        thread_ = std::thread([this] { serve(); });
        ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
        return "";
    }
    int port() const { return port_; }

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
    struct Client {
        int socket;
        std::string received;
    };

    void serve() {
        std::vector<Client> clients;
        while (!ends_.load()) {
            std::vector<pollfd> polled{{listener_, POLLIN, 0}};
            for (const Client& client : clients) polled.push_back({client.socket, POLLIN, 0});
            if (::poll(polled.data(), polled.size(), 50) <= 0) continue;
            for (std::size_t i = clients.size(); i-- > 0;)
                if (polled[i + 1].revents && !serve(clients[i])) {
                    ::close(clients[i].socket);
                    clients.erase(clients.begin() + static_cast<std::ptrdiff_t>(i));
                }
            if (polled[0].revents & POLLIN) {
                const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
                if (socket >= 0 && clients.size() >= 64) ::close(socket);
                if (socket >= 0 && clients.size() < 64) clients.push_back({socket, ""});
            }
        }
        for (const Client& client : clients) ::close(client.socket);
    }

    /// False when the connection is over.
    bool serve(Client& client) {
        char bytes[4096];
        const ssize_t count = ::recv(client.socket, bytes, sizeof bytes, 0);
        if (count <= 0) return count < 0 && (errno == EAGAIN || errno == EINTR);
        client.received.append(bytes, static_cast<std::size_t>(count));
        for (std::size_t end; (end = client.received.find('\n')) != std::string::npos;) {
            const std::string line = detail::trimmed(client.received.substr(0, end));
            client.received.erase(0, end + 1);
            bool is_mapping = true;
            const std::string answer = answer_to(line, is_mapping);
            // What is not read is lost; a step waits for nobody.
            const ssize_t sent = ::send(client.socket, answer.data(), answer.size(), MSG_NOSIGNAL);
            if (sent != static_cast<ssize_t>(answer.size()) || !is_mapping) return false;
        }
        return client.received.size() <= 65536;
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
    int listener_ = -1, port_ = 0;
    std::thread thread_;
    std::atomic<bool> ends_{false};
    std::atomic<State> state_{State::empty};
    const std::vector<NewValue>* changes_ = nullptr;
    const char* wrong_ = nullptr;
};

} // namespace bf::generated
