#include "socket.hpp"

#include "bf/middleware/clock.hpp"
#include "packet.hpp"

#include <arpa/inet.h>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <poll.h>
#include <stdexcept>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace bf::udp {

namespace {

constexpr double longest_listening = 0.001; ///< s until it is looked whether there is something to send

} // namespace

std::string Address::text() const {
    char host[INET_ADDRSTRLEN] = "";
    inet_ntop(AF_INET, &ip.sin_addr, host, sizeof host);
    return std::string(host) + ":" + std::to_string(ntohs(ip.sin_port));
}

Address address_of(const std::string& text, bool may_choose) {
    const auto colon = text.rfind(':');
    std::string host = colon == text.npos ? "127.0.0.1" : text.substr(0, colon);
    const std::string port = colon == text.npos ? text : text.substr(colon + 1);
    if (host == "localhost") host = "127.0.0.1";
    int number = -1;
    const auto read = std::from_chars(port.data(), port.data() + port.size(), number);
    Address address;
    address.ip.sin_family = AF_INET;
    if (read.ec != std::errc() || read.ptr != port.data() + port.size() || number < 0 || number > 65535 ||
        inet_pton(AF_INET, host.c_str(), &address.ip.sin_addr) != 1)
        throw std::runtime_error("'" + text +
                                 "' is no address; write PORT, or HOST:PORT such as 192.168.0.5:9000");
    if (number == 0 && !may_choose)
        throw std::runtime_error("'" + text + "' has no port; write one from 1 to 65535");
    address.ip.sin_port = htons(static_cast<std::uint16_t>(number));
    return address;
}

void Socket::open(const Address& at) {
    close();
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    bell_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (socket_ < 0 || bell_ < 0 ||
        bind(socket_, reinterpret_cast<const sockaddr*>(&at.ip), sizeof at.ip) != 0) {
        const std::string why = std::strerror(errno);
        close();
        throw std::runtime_error("cannot listen at " + at.text() + ": " + why + "; choose another port");
    }
}

void Socket::open_towards(const Address& peer) {
    Address at;
    at.ip.sin_family = AF_INET;
    const bool is_here = (ntohl(peer.ip.sin_addr.s_addr) >> 24) == 127;
    at.ip.sin_addr.s_addr = htonl(is_here ? INADDR_LOOPBACK : INADDR_ANY);
    open(at);
}

void Socket::run(Receive receive, std::function<void()> send, double pause) {
    goes_on_ = true;
    thread_ = std::thread(
        [this, receive = std::move(receive), send = std::move(send), pause] { serve(receive, send, pause); });
}

void Socket::serve(const Receive& receive, const std::function<void()>& send, double pause) {
    std::vector<std::byte> datagram(65'536);
    double due = middleware::now();
    while (goes_on_) {
        pollfd waits[2] = {{socket_, POLLIN, 0}, {bell_, POLLIN, 0}};
        const double left = due - middleware::now();
        const timespec time{0, static_cast<long>(left > 0 ? left * 1e9 : 0)};
        if (ppoll(waits, 2, &time, nullptr) < 0 && errno != EINTR) return;
        std::uint64_t rung = 0;
        const bool is_woken = ::read(bell_, &rung, sizeof rung) > 0;
        // Whoever floods the socket does not keep it from sending.
        for (const double end = middleware::now() + longest_listening; middleware::now() < end;) {
            Address from;
            socklen_t size = sizeof from.ip;
            const auto count = recvfrom(socket_, datagram.data(), datagram.size(), 0,
                                        reinterpret_cast<sockaddr*>(&from.ip), &size);
            if (count < 0) break;
            receive({datagram.data(), static_cast<std::size_t>(count)}, from);
        }
        if (is_woken || middleware::now() >= due) {
            send();
            due = middleware::now() + pause;
        }
    }
    send();
}

void Socket::close() noexcept {
    if (thread_.joinable()) {
        goes_on_ = false;
        wake();
        thread_.join();
    }
    for (int* descriptor : {&socket_, &bell_})
        if (*descriptor >= 0) ::close(std::exchange(*descriptor, -1));
}

void Socket::wake() noexcept {
    const std::uint64_t one = 1;
    static_cast<void>(::write(bell_, &one, sizeof one) < 0);
}

void Socket::send(std::span<const std::byte> datagram, const Address& to) const noexcept {
    static_cast<void>(sendto(socket_, datagram.data(), datagram.size(), MSG_NOSIGNAL,
                             reinterpret_cast<const sockaddr*>(&to.ip), sizeof to.ip) < 0);
}

Address Socket::address() const {
    Address at;
    socklen_t size = sizeof at.ip;
    getsockname(socket_, reinterpret_cast<sockaddr*>(&at.ip), &size);
    return at;
}

} // namespace bf::udp
