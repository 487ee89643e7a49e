// A master of ROS 1 for the tests, and programs that are not ours.
#pragma once

#include "program.hpp"
#include "running.hpp"

#include <arpa/inet.h>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <netinet/in.h>
#include <string>
#include <sys/socket.h>
#include <vector>

namespace bf::ros1::test {

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

/// Steps until it is so; false: it never was.
inline bool steps_until(toolbox::test::Running& run, const std::function<bool()>& is_so) {
    for (int k = 0; k < 5000; ++k, usleep(1000)) {
        if (!run.step()) return false;
        if (is_so()) return true;
    }
    return false;
}

/// What tests derive from that need a master, of which there is one for all: roscpp asks once where it is.
class WithMaster : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!has_master()) GTEST_SKIP() << "there is no rosmaster";
        static const std::unique_ptr<Program> master = start();
        ASSERT_TRUE(master) << "rosmaster does not start";
    }

  private:
    static std::unique_ptr<Program> start() {
        const int port = free_port();
        setenv("ROS_MASTER_URI", ("http://127.0.0.1:" + std::to_string(port)).c_str(), 1);
        setenv("ROS_IP", "127.0.0.1", 1);
        auto master = std::make_unique<Program>(master_at(port));
        return waits_for_answers(port) ? std::move(master) : nullptr;
    }
};

} // namespace bf::ros1::test
