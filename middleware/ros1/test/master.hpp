// A master of ROS 1 for the tests, and programs that are not ours.
#pragma once

#include "patience.hpp"
#include "program.hpp"
#include "running.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <optional>
#include <string>
#include <sys/socket.h>
#include <vector>

namespace bf::ros1::test {

using middleware::test::expect_refusal_with, middleware::test::refusal_with, middleware::test::steps_until;
using middleware::test::Folder, middleware::test::Program;

/// A socket of this computer; bound to a port where there is one, otherwise connected to it.
struct Socket {
    ~Socket() { close(number); }
    sockaddr_in address(int port) const {
        sockaddr_in its{};
        its.sin_family = AF_INET;
        its.sin_port = htons(static_cast<std::uint16_t>(port));
        its.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        return its;
    }
    int port() const {
        sockaddr_in its{};
        socklen_t size = sizeof its;
        getsockname(number, reinterpret_cast<sockaddr*>(&its), &size);
        return ntohs(its.sin_port);
    }
    const int number = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

inline int free_port() {
    const Socket any;
    const auto address = any.address(0);
    return bind(any.number, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? any.port()
                                                                                              : 0;
}

inline bool answers(int port) {
    const Socket caller;
    const auto address = caller.address(port);
    return connect(caller.number, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

/// test/peer.py. Its verbs are said there.
class Peer : public Program {
  public:
    explicit Peer(std::vector<std::string> words) : Program(with_python(std::move(words))) {}
    static bool is_there() { return access("/usr/lib/python3/dist-packages/rosbag", R_OK) == 0; }

  private:
    static std::vector<std::string> with_python(std::vector<std::string> words) {
        words.insert(words.begin(),
                     {"/usr/bin/python3", BF_SOURCE_DIRECTORY "/middleware/ros1/test/peer.py"});
        return words;
    }
};

inline bool has_master() { return Peer::is_there() && access("/usr/bin/rosmaster", X_OK) == 0; }
inline std::vector<std::string> master_at(int port) {
    return {"/usr/bin/python3", "/usr/bin/rosmaster", "--core", "-p", std::to_string(port)};
}
inline bool waits_for_answers(int port) {
    for (int tries = 0; tries < 3000; ++tries, usleep(10'000))
        if (answers(port)) return true;
    return false;
}

/// Outside of the ports that the system gives to programs, so that it stays free between two masters.
inline int port_of_master() {
    constexpr int first = 20'000, count = 10'000;
    for (int k = 0; k < count; ++k) {
        const int port = first + (getpid() + k) % count;
        if (!answers(port)) return port;
    }
    return 0;
}

/// What tests derive from that need a master. Each has its own, which knows no nodes that another test has
/// killed: a program that gets the port of one of them is taken for it. roscpp asks once where the master is.
class WithMaster : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!has_master()) GTEST_SKIP() << "there is no rosmaster";
        static const int port = port_of_master();
        setenv("ROS_MASTER_URI", ("http://127.0.0.1:" + std::to_string(port)).c_str(), 1);
        setenv("ROS_IP", "127.0.0.1", 1);
        master.emplace(master_at(port));
        ASSERT_TRUE(waits_for_answers(port)) << "rosmaster does not start";
    }
    std::optional<Program> master;
};

} // namespace bf::ros1::test
