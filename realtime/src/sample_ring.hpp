// Samples on their way from the loop to the server.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace bf::realtime {

/// One thread pushes, one pops. What does not fit is lost and counted; nobody is woken, since waking would be
/// a call into the system. Positions only grow; `position % capacity` is the place in memory.
class SampleRing {
  public:
    explicit SampleRing(std::size_t capacity) : memory_(std::bit_ceil(capacity)) {}

    void push(std::uint32_t channel, std::int64_t time, const void* value, std::uint32_t size) noexcept {
        const Header header{size, channel, time};
        const std::uint64_t head = head_.load(std::memory_order_relaxed);
        const std::uint64_t end = head + sizeof header + size;
        if (end - tail_.load(std::memory_order_acquire) > memory_.size()) {
            lost_.fetch_add(1, std::memory_order_relaxed);
            return;
        }
        copy_in(head, &header, sizeof header);
        copy_in(head + sizeof header, value, size);
        head_.store(end, std::memory_order_release);
    }

    /// Visits (channel, time in ns, value) of all that was pushed before the call.
    template <class Visit> void pop_all(Visit&& visit) {
        const std::uint64_t head = head_.load(std::memory_order_acquire);
        std::uint64_t tail = tail_.load(std::memory_order_relaxed);
        while (tail != head) {
            Header header;
            copy_out(tail, &header, sizeof header);
            value_.resize(header.size);
            copy_out(tail + sizeof header, value_.data(), header.size);
            tail += sizeof header + header.size;
            tail_.store(tail, std::memory_order_release);
            visit(header.channel, header.time, value_);
        }
    }

    std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

  private:
    struct Header {
        std::uint32_t size, channel;
        std::int64_t time;
    };
    /// Places that run past the end of the memory go on at its beginning.
    template <class Copy> void split(std::uint64_t position, std::size_t size, Copy&& copy) noexcept {
        const std::size_t at = position & (memory_.size() - 1);
        const std::size_t first = std::min(size, memory_.size() - at);
        copy(at, std::size_t{0}, first);
        copy(std::size_t{0}, first, size - first);
    }
    void copy_in(std::uint64_t position, const void* from, std::size_t size) noexcept {
        split(position, size, [&](std::size_t at, std::size_t offset, std::size_t n) {
            std::memcpy(memory_.data() + at, static_cast<const std::byte*>(from) + offset, n);
        });
    }
    void copy_out(std::uint64_t position, void* to, std::size_t size) noexcept {
        split(position, size, [&](std::size_t at, std::size_t offset, std::size_t n) {
            std::memcpy(static_cast<std::byte*>(to) + offset, memory_.data() + at, n);
        });
    }

    std::vector<std::byte> memory_;
    std::vector<std::byte> value_;
    // The two threads write to cache lines of their own.
    alignas(64) std::atomic<std::uint64_t> head_{0};
    std::atomic<std::uint64_t> lost_{0};
    alignas(64) std::atomic<std::uint64_t> tail_{0};
};

} // namespace bf::realtime
