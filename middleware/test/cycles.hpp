// Starting and stopping again and again.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <iterator>
#include <unistd.h>

namespace bf::middleware::test {

/// What this process holds at the moment.
struct Held {
    long files, threads, kilobytes;
    static Held now() {
        const auto count = [](const char* folder) {
            return std::distance(std::filesystem::directory_iterator(folder), {});
        };
        long pages = 0;
        std::ifstream("/proc/self/statm").ignore(100, ' ') >> pages;
        return {count("/proc/self/fd"), count("/proc/self/task"), pages * sysconf(_SC_PAGESIZE) / 1024};
    }
};

/// After the first cycles, which load and cache, the others leave no file and no thread behind, and hardly
/// any memory. BF_CYCLES in the environment: how many; otherwise 20.
inline void expect_no_leak(const std::function<void()>& cycle) {
    const char* const chosen = std::getenv("BF_CYCLES");
    const int count = chosen ? std::atoi(chosen) : 20;
    for (int k = 0; k < 10; ++k) cycle();
    const Held before = Held::now();
    for (int k = 0; k < count && !::testing::Test::HasFailure(); ++k) cycle();
    const Held after = Held::now();
    std::printf("%d cycles: %+ld files, %+ld threads, %+ld kB\n", count, after.files - before.files,
                after.threads - before.threads, after.kilobytes - before.kilobytes);
    EXPECT_LE(after.files, before.files);
    EXPECT_LE(after.threads, before.threads);
    // Allocators keep what they have; of many cycles each one leaves less than a page.
    EXPECT_LT(after.kilobytes - before.kilobytes, 2000 + 2 * count);
}

} // namespace bf::middleware::test
