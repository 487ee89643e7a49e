#pragma once

#include <ctime>

namespace bf::middleware {

/// Time since this computer has started, s: the same in all of its programs, and never set back.
inline double now() noexcept {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

} // namespace bf::middleware
