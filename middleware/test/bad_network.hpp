// Two networks that nobody else has, and a way between them that loses, delays and turns round packets,
// whatever protocol they are of.
#pragma once

#include "own_network.hpp"

#include <arpa/inet.h>
#include <atomic>
#include <chrono>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <map>
#include <poll.h>
#include <random>
#include <signal.h>
#include <string>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <thread>
#include <vector>

namespace bf::middleware::test {

struct BadWays {
    double loss = 0.1;                         ///< probability
    double least_delay = 0, most_delay = 0.01; ///< s; packets overtake each other
};

/// The test has the address 10.77.0.1 then, and programs that enter the other network 10.77.0.2.
class BadNetwork {
  public:
    explicit BadNetwork(const BadWays& how) : how_(how) {
        ends_[0] = tunnel("10.77.0.1");
        int pair[2];
        if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) return;
        other_ = fork();
        if (other_ == 0) { // it keeps the other network
            prctl(PR_SET_PDEATHSIG, SIGKILL);
            send_handle(pair[1], enter_network_of_our_own() ? tunnel("10.77.0.2") : -1);
            for (;;) pause();
        }
        ends_[1] = receive_handle(pair[0]);
        close(pair[0]);
        close(pair[1]);
        network_ = open(("/proc/" + std::to_string(other_) + "/ns/net").c_str(), O_RDONLY | O_CLOEXEC);
        if (is_there()) carrier_ = std::thread([this] { carry(); });
    }
    ~BadNetwork() {
        goes_on_ = false;
        if (carrier_.joinable()) carrier_.join();
        for (const int end : {ends_[0], ends_[1], network_})
            if (end >= 0) close(end);
        if (other_ > 0) {
            kill(other_, SIGKILL);
            waitpid(other_, nullptr, 0);
        }
    }
    BadNetwork(const BadNetwork&) = delete;
    BadNetwork& operator=(const BadNetwork&) = delete;

    /// False where the system has no such devices.
    bool is_there() const { return ends_[0] >= 0 && ends_[1] >= 0 && network_ >= 0; }
    /// Of the other network, for setns().
    int network() const { return network_; }
    int carried() const { return carried_; }
    int lost() const { return lost_; }
    std::atomic<bool> is_cut{false}; ///< all are lost

  private:
    static int tunnel(const char* address) {
        const int made = open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK);
        ifreq its{};
        std::strncpy(its.ifr_name, "bad0", sizeof its.ifr_name - 1);
        its.ifr_flags = IFF_TUN | IFF_NO_PI;
        if (made < 0 || ioctl(made, TUNSETIFF, &its) != 0) return -1;
        const int any = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        const auto set = [&](unsigned long what, const char* to) {
            auto& at = reinterpret_cast<sockaddr_in&>(its.ifr_addr);
            at = {};
            at.sin_family = AF_INET;
            inet_pton(AF_INET, to, &at.sin_addr);
            return ioctl(any, what, &its) == 0;
        };
        bool is_good = set(SIOCSIFADDR, address);
        is_good = is_good && set(SIOCSIFNETMASK, "255.255.255.0");
        its.ifr_flags = IFF_UP | IFF_RUNNING | IFF_MULTICAST;
        is_good = is_good && ioctl(any, SIOCSIFFLAGS, &its) == 0;
        close(any);
        return is_good ? made : -1;
    }
    static void send_handle(int to, int handle) {
        char byte = 0, room[CMSG_SPACE(sizeof(int))] = {};
        iovec bytes{&byte, 1};
        msghdr message{};
        message.msg_iov = &bytes;
        message.msg_iovlen = 1;
        if (handle >= 0) {
            message.msg_control = room;
            message.msg_controllen = sizeof room;
            cmsghdr* its = CMSG_FIRSTHDR(&message);
            its->cmsg_level = SOL_SOCKET;
            its->cmsg_type = SCM_RIGHTS;
            its->cmsg_len = CMSG_LEN(sizeof(int));
            std::memcpy(CMSG_DATA(its), &handle, sizeof handle);
        }
        sendmsg(to, &message, 0);
    }
    static int receive_handle(int from) {
        char byte = 0, room[CMSG_SPACE(sizeof(int))] = {};
        iovec bytes{&byte, 1};
        msghdr message{};
        message.msg_iov = &bytes;
        message.msg_iovlen = 1;
        message.msg_control = room;
        message.msg_controllen = sizeof room;
        int handle = -1;
        if (recvmsg(from, &message, MSG_CMSG_CLOEXEC) == 1)
            if (const cmsghdr* its = CMSG_FIRSTHDR(&message))
                std::memcpy(&handle, CMSG_DATA(its), sizeof handle);
        return handle;
    }

    void carry() {
        using Clock = std::chrono::steady_clock;
        std::mt19937 random(1);
        std::uniform_real_distribution<double> delay(how_.least_delay, how_.most_delay), chance(0, 1);
        std::multimap<Clock::time_point, std::pair<int, std::string>> under_way; ///< by when they arrive
        while (goes_on_) {
            pollfd waits[2] = {{ends_[0], POLLIN, 0}, {ends_[1], POLLIN, 0}};
            poll(waits, 2, 1);
            for (int from = 0; from < 2; ++from) {
                char packet[65536];
                for (ssize_t size; (size = read(ends_[from], packet, sizeof packet)) > 0;) {
                    if (is_cut || chance(random) < how_.loss) {
                        ++lost_;
                        continue;
                    }
                    const auto later = std::chrono::duration<double>(delay(random));
                    under_way.emplace(
                        Clock::now() + std::chrono::duration_cast<Clock::duration>(later),
                        std::pair(ends_[1 - from], std::string(packet, static_cast<std::size_t>(size))));
                }
            }
            while (!under_way.empty() && under_way.begin()->first <= Clock::now()) {
                const auto& [to, packet] = under_way.begin()->second;
                if (write(to, packet.data(), packet.size()) > 0) ++carried_;
                under_way.erase(under_way.begin());
            }
        }
    }

    const BadWays how_;
    int ends_[2] = {-1, -1}, network_ = -1;
    pid_t other_ = 0;
    std::atomic<bool> goes_on_{true};
    std::atomic<int> carried_{0}, lost_{0};
    std::thread carrier_;
};

} // namespace bf::middleware::test
