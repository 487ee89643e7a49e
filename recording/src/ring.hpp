#pragma once

#include "format.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <new>
#include <semaphore.h>
#include <sys/mman.h>
#include <time.h>

namespace bf::recording {

/// Wakes the other thread from a function that may not lock.
class Wakeup {
  public:
    Wakeup() noexcept { ::sem_init(&semaphore_, 0, 0); }
    ~Wakeup() { ::sem_destroy(&semaphore_); }
    Wakeup(const Wakeup&) = delete;
    Wakeup& operator=(const Wakeup&) = delete;
    void raise() noexcept { ::sem_post(&semaphore_); }
    void wait() noexcept { ::sem_wait(&semaphore_); }
    /// Returns at `deadline` at the latest, perhaps earlier without cause.
    void wait_until(std::chrono::steady_clock::time_point deadline) noexcept {
        const auto ns =
            std::chrono::duration_cast<std::chrono::nanoseconds>(deadline.time_since_epoch()).count();
        const timespec at{static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
        ::sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &at);
    }

  private:
    sem_t semaphore_;
};

/// Memory in pages of 2 MB where the kernel grants them: with ordinary ones a ring passes through more pages
/// than the processor keeps addresses of. Every page is there, so that none is waited for later.
inline auto large_pages(std::size_t size) {
    constexpr std::size_t page = std::size_t{2} << 20;
    size = (size + page - 1) / page * page;
    struct Free {
        void operator()(std::byte* memory) const noexcept { std::free(memory); }
    };
    std::unique_ptr<std::byte[], Free> memory(static_cast<std::byte*>(std::aligned_alloc(page, size)));
    if (!memory) throw std::bad_alloc();
    ::madvise(memory.get(), size, MADV_HUGEPAGE); // a wish
    for (std::size_t at = 0; at < size; at += 4096) memory[at] = std::byte{0};
    return memory;
}

/// Records on their way from the thread that appends to the thread that writes. Each record is contiguous;
/// one that does not fit before the end of the memory starts at its beginning, and a zero byte, which is no
/// opcode, marks the gap. Positions only grow; `position % capacity` is the place in memory.
class Ring {
  public:
    explicit Ring(std::size_t capacity)
        : mask_(std::bit_ceil(capacity) - 1), memory_(large_pages(mask_ + 1)) {}

    /// Place for the next record, of `size` bytes, or null when there is none and `wait` is false.
    std::byte* claim(std::size_t size, bool wait) noexcept {
        const std::uint64_t head = next_;
        const std::size_t to_end = capacity() - (head & mask_);
        const std::size_t gap = to_end < size ? to_end : 0;
        while (head + gap + size - seen_tail_ > capacity()) {
            const std::uint64_t tail = tail_.load(std::memory_order_acquire);
            if (tail == seen_tail_) {
                if (!wait) return nullptr;
                publish(); // what would be waited for may be among the records claimed before
                work.raise();
                space_.wait();
            }
            seen_tail_ = tail;
        }
        if (gap > 0) memory_[head & mask_] = std::byte{0};
        next_ = head + gap + size;
        return &memory_[(head + gap) & mask_];
    }

    /// Hands over the records claimed so far. Wakes nobody, since that is a call into the system.
    void publish() noexcept { head_.store(next_, std::memory_order_release); }

    std::uint64_t head() const noexcept { return head_.load(std::memory_order_acquire); }
    std::uint64_t tail() const noexcept { return tail_.load(std::memory_order_relaxed); }

    /// Whole records from the tail on, at most up to `end`, of `enough` bytes or a little more. Empty at a
    /// gap, which is skipped. `visit(offset in the run, record)` sees each.
    template <class Visit> Bytes run(std::uint64_t end, std::size_t enough, Visit&& visit) {
        const std::uint64_t start = tail();
        const std::byte* from = &memory_[start & mask_];
        const std::size_t limit = std::min<std::uint64_t>(end - start, capacity() - (start & mask_));
        std::size_t size = 0;
        while (size < limit && size < enough && from[size] != std::byte{0}) {
            std::uint64_t length;
            std::memcpy(&length, from + size + 1, sizeof length);
            const Bytes record(from + size, record_header_bytes + length);
            visit(size, record);
            size += record.size();
        }
        return {from, size};
    }

    /// Gives the memory of a run back.
    void release(Bytes run) noexcept {
        const std::uint64_t start = tail();
        const std::size_t skipped = run.empty() ? capacity() - (start & mask_) : run.size();
        tail_.store(start + skipped, std::memory_order_release);
        space_.raise();
    }

    Wakeup work; ///< raised when there is no space left

  private:
    std::size_t capacity() const noexcept { return mask_ + 1; }

    const std::size_t mask_;
    const decltype(large_pages(0)) memory_;
    Wakeup space_;
    // The two threads write to cache lines of their own.
    alignas(64) std::atomic<std::uint64_t> head_{0};
    std::uint64_t next_ = 0, seen_tail_ = 0;
    alignas(64) std::atomic<std::uint64_t> tail_{0};
};

} // namespace bf::recording
