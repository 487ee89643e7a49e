// Messages between threads and programs that wait for nobody.
#include "bf/middleware/bell.hpp"
#include "bf/middleware/exchange.hpp"
#include "heap.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace bf::middleware::test {
namespace {

/// Message k is k, k, ..., so that a torn one is seen.
std::vector<double> message(int size, double k) {
    return std::vector<double>(static_cast<std::size_t>(size), k);
}

bool is_whole(const std::vector<double>& values) {
    return std::equal(values.begin() + 1, values.end(), values.begin());
}

} // namespace

TEST(Exchange, GivesTheNewestMessageWithItsNumberAndTime) {
    ExchangeBuffer exchange(3);
    std::vector<double> values(3);
    Stamp stamp;
    EXPECT_FALSE(exchange.read(values.data(), stamp)) << "nobody has written";
    for (int k = 1; k <= 9; ++k) exchange.write(message(3, k).data(), 0.5 * k);
    for (int again = 0; again < 2; ++again) {
        ASSERT_TRUE(exchange.read(values.data(), stamp));
        EXPECT_EQ(values, message(3, 9));
        EXPECT_EQ(stamp.number, 9U);
        EXPECT_EQ(stamp.time, 4.5);
    }
}

TEST(Exchange, TakesNothingFromTheHeap) {
    if (!bf::test::heap_is_counted()) GTEST_SKIP();
    ExchangeBuffer exchange(100);
    std::vector<double> values(100);
    Stamp stamp;
    const long before = bf::test::heap_calls();
    for (int k = 0; k < 10; ++k) {
        exchange.write(values.data(), k);
        ASSERT_TRUE(exchange.read(values.data(), stamp));
    }
    EXPECT_EQ(bf::test::heap_calls(), before);
}

/// A writer that never rests, and readers that find each message whole and none twice in the wrong order.
TEST(Exchange, IsNeverTorn) {
    for (const int size : {1, 7, 64, 1000}) {
        ExchangeBuffer exchange(size);
        std::atomic<bool> goes_on{true};
        std::thread writer([&] {
            std::vector<double> values(static_cast<std::size_t>(size));
            for (double k = 1; goes_on; ++k) {
                std::fill(values.begin(), values.end(), k);
                exchange.write(values.data(), k);
            }
        });
        while (exchange.newest() == 0) std::this_thread::yield();
        const auto look = [&] {
            std::vector<double> values(static_cast<std::size_t>(size));
            Stamp stamp;
            std::uint64_t last = 0;
            for (int found = 0, looked = 0; found < 20'000 && looked < 5'000'000; ++looked) {
                if (!exchange.read(values.data(), stamp)) continue;
                ++found;
                ASSERT_TRUE(is_whole(values)) << size;
                ASSERT_EQ(values[0], stamp.time);
                ASSERT_EQ(values[0], static_cast<double>(stamp.number));
                ASSERT_GE(stamp.number, last);
                last = stamp.number;
            }
            EXPECT_GT(last, 1U) << "the writer is seen at work";
        };
        std::thread other(look);
        look();
        other.join();
        goes_on = false;
        writer.join();
    }
}

/// Whatever a writer was at when it was killed, the last whole message stays, and the next writer goes on.
TEST(Exchange, OutlivesItsWriters) {
    constexpr int size = 2000;
    const std::size_t bytes = Exchange::bytes(size);
    void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(memory, MAP_FAILED);
    Exchange exchange(memory, size);
    std::vector<double> values(size);
    Stamp stamp;
    std::uint64_t last = 0;
    for (int round = 0; round < 50; ++round) {
        const pid_t child = fork();
        if (child == 0)
            for (Exchange its(memory, size);;) {
                const auto k = static_cast<double>(its.newest() + 1);
                std::fill(values.begin(), values.end(), k);
                its.write(values.data(), k);
            }
        while (exchange.newest() < last + 3) std::this_thread::yield();
        usleep(static_cast<useconds_t>(37 * round));
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
        ASSERT_TRUE(exchange.read(values.data(), stamp));
        ASSERT_TRUE(is_whole(values));
        ASSERT_EQ(values[0], static_cast<double>(stamp.number));
        ASSERT_GT(stamp.number, last);
        last = stamp.number;
    }
    munmap(memory, bytes);
}

/// In memory that other programs may write over.
TEST(Exchange, IsReadAgainAfterTheNextMessageWhateverWasWrittenOverIt) {
    for (const std::uint64_t word :
         {std::uint64_t{0}, std::uint64_t{1}, ~std::uint64_t{0}, std::uint64_t{1} << 63}) {
        std::vector<std::byte> bytes(Exchange::bytes(2) + 64);
        auto* aligned = bytes.data() + (64 - reinterpret_cast<std::uintptr_t>(bytes.data()) % 64);
        for (std::size_t at = 0; at < Exchange::bytes(2); at += 8) {
            std::fill(bytes.begin(), bytes.end(), std::byte{});
            Exchange writer(aligned, 2);
            const Exchange reader(aligned, 2);
            for (double k = 1; k <= 5; ++k) writer.write(message(2, k).data(), k);
            std::memcpy(aligned + at, &word, sizeof word);
            writer.write(message(2, 6).data(), 6);
            std::vector<double> values(2);
            Stamp stamp;
            ASSERT_TRUE(reader.read(values.data(), stamp)) << "word at " << at << " was " << word;
            EXPECT_EQ(values, message(2, 6));
            EXPECT_EQ(stamp.number, 6u);
        }
    }
}

TEST(Bell, CountsItsSleepersAnewWhereTheirNumberWasWrittenOver) {
    Bell bell{};
    bell.sleepers = ~0U;
    bell.wait(
        0.001, [] { return false; }, 0);
    EXPECT_EQ(bell.sleepers, 0u) << "and with 0 a sleeper of the next time would not be woken";
    bell.wait(
        0.001, [] { return false; }, 0);
    EXPECT_EQ(bell.sleepers, 0u);
}

} // namespace bf::middleware::test
