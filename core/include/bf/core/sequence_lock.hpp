// What keeps messages whole that one thread writes and others read, without locks.
#pragma once

#include <atomic>
#include <cstdint>

namespace bf {

/// The turn of a message in memory that one thread writes and any number of others read, in one program or in
/// several: 2 k - 1 while message k is being written, 2 k from then on; at first it is 0. Every value of a
/// message is an atomic that is stored and loaded relaxed, between begin(k) and end(k), and between turn()
/// and is_still().
///
/// That no message is ever torn, after H. Boehm, Can seqlocks get along with programming language memory
/// models?, MSPC 2012. Let a reader find turn = 2 k (acquire), load values, pass an acquire fence, and find
/// turn = 2 k again.
///
/// - No value is older than k: the load of turn = 2 k reads from the release store that follows all stores of
/// k.
/// - No value is newer: a value of a later message j was stored behind a release fence that follows the store
///   of turn = 2 j - 1. A load that read it, followed by the acquire fence, makes that store happen before
///   the last load of turn, which then cannot read 2 k, the earlier value in the order of modifications.
///
/// A writer that dies while it writes k leaves 2 k - 1, and its successor writes k anew.
class SequenceLock {
  public:
    void begin(std::uint64_t k) noexcept {
        turn_.store(2 * k - 1, std::memory_order_relaxed);
        std::atomic_thread_fence(std::memory_order_release);
    }
    void end(std::uint64_t k) noexcept { turn_.store(2 * k, std::memory_order_release); }

    /// What is_still() is asked with later; odd while a message is being written.
    std::uint64_t turn() const noexcept { return turn_.load(std::memory_order_acquire); }
    /// Are all values that were loaded since then of one message?
    bool is_still(std::uint64_t turn) const noexcept {
        std::atomic_thread_fence(std::memory_order_acquire);
        return turn_.load(std::memory_order_relaxed) == turn;
    }

  private:
    static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
    std::atomic<std::uint64_t> turn_;
};

} // namespace bf
