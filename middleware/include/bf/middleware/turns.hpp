// Several programs that send by turns what one alone is to send.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

namespace bf::middleware {

class Turns {
  public:
    /// The program with that number has sent. From one thread.
    void sent(std::uint64_t who) noexcept;
    /// Has one sent between two messages of another program, within a second?
    bool are_two() const noexcept { return are_two_; }
    /// The last two who have sent; in that thread.
    std::pair<std::uint64_t, std::uint64_t> newest() const noexcept { return {before_, newest_}; }

  private:
    std::uint64_t newest_ = 0, before_ = 0;
    double before_sent_ = -1; ///< when the one before did last, s
    double newest_sent_ = -1;
    std::atomic<bool> are_two_{false};
};

} // namespace bf::middleware
