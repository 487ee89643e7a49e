// A socket that a thread of its own serves.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <netinet/in.h>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace bf::udp {

struct Address {
    sockaddr_in ip{};
    bool operator==(const Address& other) const {
        return ip.sin_addr.s_addr == other.ip.sin_addr.s_addr && ip.sin_port == other.ip.sin_port;
    }
    std::string text() const;
};

/// PORT, which is one of this computer alone, or HOST:PORT with a numeric address of IPv4, or localhost;
/// 0, a port that the system chooses, if `may_choose`. Throws std::runtime_error.
Address address_of(const std::string& text, bool may_choose = false);

/// Calls `receive` for each datagram that comes, and `send` when it is woken and otherwise every `pause` s,
/// all in its thread.
class Socket {
  public:
    using Receive = std::function<void(std::span<const std::byte> datagram, const Address& from)>;
    Socket() = default;
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;
    ~Socket() { close(); }

    /// At that address, or at any free port of this computer (of its network where `peer` is elsewhere).
    /// Throws std::runtime_error.
    void open(const Address& at);
    void open_towards(const Address& peer);
    void run(Receive receive, std::function<void()> send, double pause);
    /// Ends the thread, after one more `send`.
    void close() noexcept;
    bool is_open() const noexcept { return socket_ >= 0; }

    /// From any thread; waits for nobody.
    void wake() noexcept;
    /// Whether it arrives nobody knows.
    void send(std::span<const std::byte> datagram, const Address& to) const noexcept;
    Address address() const;

  private:
    void serve(const Receive& receive, const std::function<void()>& send, double pause);

    int socket_ = -1, bell_ = -1;
    std::atomic<bool> goes_on_{false};
    std::thread thread_;
};

} // namespace bf::udp
