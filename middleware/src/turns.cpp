#include "bf/middleware/turns.hpp"

#include "bf/middleware/clock.hpp"

#include <utility>

namespace bf::middleware {

void Turns::sent(std::uint64_t who) noexcept {
    constexpr double soon = 1; // s
    const double time = now();
    if (who != newest_) {
        if (who == before_ && time - before_sent_ < soon) are_two_ = true;
        before_ = std::exchange(newest_, who);
        before_sent_ = newest_sent_;
    }
    newest_sent_ = time;
}

} // namespace bf::middleware
