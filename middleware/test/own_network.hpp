// A network of the test's own, that ends at this computer, for middlewares whose programs listen to
// everybody.
#pragma once

#include <cstring>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace bf::middleware::test {

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

} // namespace bf::middleware::test
