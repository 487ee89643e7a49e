// Whether work takes a time that grows with the size of what it is done to.
#pragma once

#include <algorithm>
#include <ctime>
#include <functional>
#include <gtest/gtest.h>
#include <string>

namespace bf::test {

/// Processor seconds, the least of three.
inline double processor_seconds(const std::function<void()>& work) {
    double least = 1e9;
    for (int k = 0; k < 3; ++k) {
        const std::clock_t begin = std::clock();
        work();
        least = std::min(least, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    }
    return least;
}

/// Of work on something, and on four times as much: where every pair is looked at, that takes sixteen times
/// as long, whatever else the computer does.
inline void expect_growth(const std::string& what, const std::function<void()>& small,
                          const std::function<void()>& large, double most = 9) {
    double ratio = most;
    for (int tries = 0; tries < 4 && ratio >= most; ++tries)
        ratio = std::min(ratio, processor_seconds(large) / processor_seconds(small));
    EXPECT_LT(ratio, most) << what;
}

} // namespace bf::test
