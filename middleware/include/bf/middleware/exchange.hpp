// The newest message of a fixed number of doubles, which one side writes and others read, without locks: what
// stands between whoever waits for a device, a thread or another program, and a step, which does not wait.
#pragma once

#include "bf/core/sequence_lock.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

namespace bf::middleware {

/// What belongs to a message.
struct Stamp {
    std::uint64_t number = 0; ///< of the message, as its writer counts them, from 1
    double time = 0;          ///< when it was written, by whatever clock its writer says, s
};

/// Memory that one thread writes and any number of others read, in one program or in several: whoever dies in
/// the middle of a call disturbs nobody else. Nothing allocates, locks, or waits. Only the newest message
/// counts.
///
/// Message k lies in slot k mod 4, so that it stays whole while the three after it are written, and its slot
/// has a SequenceLock, by which no message is ever torn; `newest` is the greatest k that is complete.
///
/// A writer that dies while it writes k + 1 leaves `newest` = k and the slot of k as they are; its successor
/// writes k + 1 anew. A writer counts by itself, so that its next message is read whatever somebody else
/// wrote over the memory. A reader changes nothing. Every value is an atomic, so there are no data races
/// either.
class Exchange {
  public:
    static constexpr int slots = 4;

    /// How many bytes of memory it takes.
    static std::size_t bytes(int size) { return sizeof(Header) + slots * stride(size) * sizeof(double); }

    /// Over that much memory, aligned to 64 bytes, that is zero or that another one for the same size has
    /// used.
    Exchange(void* memory, int size)
        : header_(static_cast<Header*>(memory)),
          words_(reinterpret_cast<std::atomic<double>*>(static_cast<std::byte*>(memory) + sizeof(Header))),
          stride_(stride(size)), size_(size), written_(newest()) {}

    int size() const noexcept { return size_; }
    /// The number of the newest message; 0: none was written yet.
    std::uint64_t newest() const noexcept { return header_->newest.load(std::memory_order_acquire); }

    /// The number of the last message that was written here, or of the newest one before.
    std::uint64_t written() const noexcept { return written_; }
    /// One thread alone.
    void write(const double* values, double time) noexcept {
        const std::uint64_t k = ++written_;
        SequenceLock& lock = header_->turn[k % slots].lock;
        std::atomic<double>* slot = words_ + (k % slots) * stride_;
        lock.begin(k);
        slot[0].store(time, std::memory_order_relaxed);
        for (int i = 0; i < size_; ++i) slot[i + 1].store(values[i], std::memory_order_relaxed);
        lock.end(k);
        header_->newest.store(k, std::memory_order_release);
    }

    /// Copies the newest message. False where there is none, or where the writer has written four messages
    /// during the copy, each of three times; all of `values` may have changed then, and the next call finds a
    /// newer one.
    bool read(double* values, Stamp& stamp) const noexcept {
        for (int attempt = 0; attempt < 3; ++attempt) {
            const std::uint64_t k = newest();
            if (k == 0) return false;
            const SequenceLock& lock = header_->turn[k % slots].lock;
            const std::atomic<double>* slot = words_ + (k % slots) * stride_;
            if (lock.turn() != 2 * k) continue;
            const double time = slot[0].load(std::memory_order_relaxed);
            for (int i = 0; i < size_; ++i) values[i] = slot[i + 1].load(std::memory_order_relaxed);
            if (!lock.is_still(2 * k)) continue;
            stamp = {k, time};
            return true;
        }
        return false;
    }

  private:
    static_assert(std::atomic<double>::is_always_lock_free &&
                  std::atomic<std::uint64_t>::is_always_lock_free);
    static constexpr std::size_t line = 64; ///< bytes that processors share as one

    struct alignas(line) Turn {
        SequenceLock lock;
    };
    struct Header {
        alignas(line) std::atomic<std::uint64_t> newest;
        Turn turn[slots];
    };
    /// Doubles of a slot: its time and values, in whole lines.
    static std::size_t stride(int size) {
        constexpr std::size_t each = line / sizeof(double);
        return (static_cast<std::size_t>(size) + 1 + each - 1) / each * each;
    }

    Header* header_;
    std::atomic<double>* words_;
    std::size_t stride_;
    int size_;
    std::uint64_t written_;
};

/// One with memory of its own, between threads of one program.
class ExchangeBuffer : public Exchange {
  public:
    explicit ExchangeBuffer(int size) : ExchangeBuffer(size, Memory(allocate(bytes(size)))) {}

  private:
    struct Free {
        void operator()(void* memory) const { ::operator delete (memory, std::align_val_t{64}); }
    };
    using Memory = std::unique_ptr<void, Free>;
    static void* allocate(std::size_t bytes) {
        void* memory = ::operator new (bytes, std::align_val_t{64});
        std::fill_n(static_cast<std::byte*>(memory), bytes, std::byte{});
        return memory;
    }
    ExchangeBuffer(int size, Memory memory) : Exchange(memory.get(), size), memory_(std::move(memory)) {}
    Memory memory_;
};

} // namespace bf::middleware
