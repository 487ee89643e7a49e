// Ports of YARP listen to everybody, so its tests run in a network of their own that ends at this computer.
#pragma once

#include <cstdlib>
#include <cstring>
#include <gtest/gtest.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace bf::yarp::test {

/// False where the system gives no network of one's own. To be called before there are threads.
inline bool enter_network_of_our_own() {
    if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
    const int any = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq loopback{};
    std::strncpy(loopback.ifr_name, "lo", sizeof loopback.ifr_name - 1);
    loopback.ifr_flags = IFF_UP | IFF_RUNNING;
    const bool is_up = ioctl(any, SIOCSIFFLAGS, &loopback) == 0;
    close(any);
    return is_up;
}

/// What tests of YARP derive from.
class Alone : public ::testing::Test {
  protected:
    static bool is_alone() {
        static const bool is =
            enter_network_of_our_own() && setenv("YARP_DATA_DIRS", BF_YARP_PREFIX "/share/yarp", 1) == 0;
        return is;
    }
    void SetUp() override {
        if (!is_alone()) GTEST_SKIP() << "this system gives a program no network of its own";
    }
};

} // namespace bf::yarp::test
