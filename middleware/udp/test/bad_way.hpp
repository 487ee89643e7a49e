// A key, and a way between two programs that loses, doubles, delays and turns round datagrams, and remembers
// them.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <netinet/in.h>
#include <poll.h>
#include <random>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace bf::udp::test {

/// A key of the tests alone.
inline std::string key_file(const std::string& name = "good") {
    const auto file =
        std::filesystem::temp_directory_path() / ("bf_udp_" + std::to_string(getpid()) + "_" + name);
    if (!std::filesystem::exists(file)) {
        std::ofstream(file) << name << "-0123456789abcdef\n";
        chmod(file.c_str(), 0600);
    }
    return file.string();
}

/// A socket of this computer at any free port.
inline int local_socket(int port = 0) {
    const int made = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(static_cast<std::uint16_t>(port));
    if (bind(made, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0) throw std::runtime_error("no socket");
    return made;
}
inline int port_of(int made) {
    sockaddr_in at{};
    socklen_t size = sizeof at;
    getsockname(made, reinterpret_cast<sockaddr*>(&at), &size);
    return ntohs(at.sin_port);
}
/// One that nobody uses at present.
inline int free_port() {
    const int made = local_socket();
    const int port = port_of(made);
    close(made);
    return port;
}
inline void send_to(int from, int port, const std::string& bytes) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    sendto(from, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
}

struct Faults {
    double loss = 0;                        ///< probability
    double least_delay = 0, most_delay = 0; ///< s; datagrams overtake each other
    double doubling = 0;                    ///< probability
    bool repeats_first = false;             ///< the first one to the server, behind each that comes
};

/// Leads datagrams of one client at `port()` to `server` and back.
class BadWay {
  public:
    BadWay(int server, const Faults& faults)
        : server_(server), faults_(faults), near_(local_socket()), far_(local_socket()),
          thread_([this] { run(); }) {}
    ~BadWay() {
        goes_on_ = false;
        thread_.join();
        close(near_);
        close(far_);
    }
    int port() const { return port_of(near_); }
    std::vector<std::string> to_server() const {
        const std::lock_guard lock(mutex_);
        return to_server_;
    }
    /// Whoever has recorded a datagram to the server sends it again, from where it came.
    void send_again(const std::string& datagram) const { send_to(far_, server_, datagram); }
    std::atomic<bool> is_cut{false};
    std::atomic<int> lost{0};
    /// What became of those to the client.
    std::atomic<int> sent_back{0}, lost_back{0}, doubled_back{0};

  private:
    using Clock = std::chrono::steady_clock;
    struct Datagram {
        int to;
        std::string bytes;
    };

    void run() {
        std::mt19937 random(7);
        std::uniform_real_distribution<double> uniform;
        std::multimap<Clock::time_point, Datagram> underway;
        int client = 0;
        while (goes_on_) {
            pollfd waits[2] = {{near_, POLLIN, 0}, {far_, POLLIN, 0}};
            poll(waits, 2, 1);
            for (int side = 0; side < 2; ++side) {
                char bytes[65536];
                sockaddr_in from{};
                socklen_t size = sizeof from;
                const auto count = recvfrom(side == 0 ? near_ : far_, bytes, sizeof bytes, MSG_DONTWAIT,
                                            reinterpret_cast<sockaddr*>(&from), &size);
                if (count < 0) continue;
                if (side == 0) {
                    client = ntohs(from.sin_port);
                    const std::lock_guard lock(mutex_);
                    to_server_.emplace_back(bytes, static_cast<std::size_t>(count));
                }
                if (const auto all = to_server(); faults_.repeats_first && !all.empty())
                    send_again(all.front());
                sent_back += side;
                if (is_cut || uniform(random) < faults_.loss) {
                    ++lost;
                    lost_back += side;
                    continue;
                }
                const bool is_doubled = uniform(random) < faults_.doubling;
                doubled_back += side * is_doubled;
                for (int copy = 0; copy <= is_doubled; ++copy) {
                    const double delay =
                        faults_.least_delay + (faults_.most_delay - faults_.least_delay) * uniform(random);
                    underway.emplace(Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                        std::chrono::duration<double>(delay)),
                                     Datagram{side == 0 ? server_ : client,
                                              std::string(bytes, static_cast<std::size_t>(count))});
                }
            }
            while (!underway.empty() && underway.begin()->first <= Clock::now()) {
                const auto& datagram = underway.begin()->second;
                send_to(datagram.to == server_ ? far_ : near_, datagram.to, datagram.bytes);
                underway.erase(underway.begin());
            }
        }
    }

    const int server_;
    const Faults faults_;
    const int near_, far_;
    std::atomic<bool> goes_on_{true};
    mutable std::mutex mutex_;
    std::vector<std::string> to_server_;
    std::thread thread_;
};

} // namespace bf::udp::test
