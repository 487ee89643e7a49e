// Starting and stopping again and again.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <iterator>
#include <malloc.h>
#include <sched.h>
#include <sys/mount.h>
#include <system_error>
#include <unistd.h>

namespace bf::middleware::test {

/// What this process holds at the moment, and how many names there are in shared memory.
struct Held {
    long files, threads, names, kilobytes;
    static Held now() {
        const auto count = [](const char* folder) {
            return std::distance(std::filesystem::directory_iterator(folder), {});
        };
        long pages = 0;
        std::ifstream("/proc/self/statm").ignore(100, ' ') >> pages;
        return {count("/proc/self/fd"), count("/proc/self/task"), names_below("/dev/shm"),
                pages * sysconf(_SC_PAGESIZE) / 1024};
    }

  private:
    /// Others may remove them meanwhile, and keep some to themselves.
    static long names_below(const std::filesystem::path& folder) {
        long count = 0;
        std::error_code gone;
        for (std::filesystem::directory_iterator each(folder, gone), end; !gone && each != end;
             each.increment(gone)) {
            std::error_code hidden;
            count += each->is_directory(hidden) ? names_below(each->path()) : 1;
        }
        return count;
    }
};

/// Has this program shared memory whose names no other one sees? It enters that before it has threads: those
/// of Fast DDS would look for the names of before, and take what they do not find for left by dead programs.
inline const bool has_own_shared_memory = [] {
    constexpr const char* place = "/dev/shm";
    if (unshare(CLONE_NEWNS) != 0 || mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        mount("own", place, "tmpfs", 0, nullptr) != 0)
        return false;
    const bool takes_files = bool(std::ofstream(std::string(place) + "/try"));
    if (!takes_files) umount(place); // it is of no user that there is here
    std::error_code none;
    std::filesystem::remove(std::string(place) + "/try", none);
    return takes_files;
}();

/// Those of threads that have ended keep memory, which would look like a leak.
inline const bool has_one_arena = mallopt(M_ARENA_MAX, 1) == 1;

/// After the first cycles, which load and cache, the others leave no file, no thread and no name in shared
/// memory behind, and hardly any memory. BF_CYCLES in the environment: how many; otherwise 20.
inline void expect_no_leak(const std::function<void()>& cycle) {
    const char* const chosen = std::getenv("BF_CYCLES");
    const int count = chosen ? std::atoi(chosen) : 20;
    for (int k = 0; k < 10; ++k) cycle();
    const Held before = Held::now();
    for (int k = 0; k < count && !::testing::Test::HasFailure(); ++k) cycle();
    Held after = Held::now();
    // Threads of the middlewares themselves end when they see that they are to.
    for (int tries = 0; tries < 50 && (after.files > before.files || after.threads > before.threads);
         ++tries, usleep(100'000))
        after = Held::now();
    std::printf("%d cycles: %+ld files, %+ld threads, %+ld names, %+ld kB\n", count,
                after.files - before.files, after.threads - before.threads, after.names - before.names,
                after.kilobytes - before.kilobytes);
    EXPECT_LE(after.files, before.files);
    EXPECT_LE(after.threads, before.threads);
    // Where other programs make some meanwhile, only many cycles tell.
    EXPECT_LE(after.names - before.names, has_own_shared_memory ? 0 : 100 + count / 2);
    // Allocators keep what they have, those of sanitizers most of it; of many cycles each one leaves less
    // than a page.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    EXPECT_LT(after.kilobytes - before.kilobytes, 2000 + 2 * count);
#endif
}

} // namespace bf::middleware::test
