// How a running loop is started and ended from outside.
//
// C++17 and no other header of BlockFactory: generated projects carry a copy of this file.
#pragma once

#include <atomic>

namespace bf::realtime {

/// Any thread asks, the loop looks between two steps; neither waits for the other.
class Control {
  public:
    enum class State {
        waiting,  ///< nothing is started, no device is open
        running,  ///< one step follows another
        stopping, ///< no step begins any more; when the one under way has ended, blocks are stopped
        emergency ///< as stopping, and where that does not come about soon the program ends without it
    };
    explicit Control(bool waits = false) noexcept : state_(waits ? State::waiting : State::running) {}

    /// False when it does not wait.
    bool start() noexcept { return go(State::waiting, State::running); }
    /// False when it ends already.
    bool stop() noexcept {
        return go(State::waiting, State::stopping) || go(State::running, State::stopping);
    }
    /// False when it has been asked for already.
    bool emergency_stop() noexcept { return state_.exchange(State::emergency) != State::emergency; }

    State state() const noexcept { return state_.load(std::memory_order_acquire); }
    bool goes_on() const noexcept { return state_.load(std::memory_order_relaxed) == State::running; }

  private:
    bool go(State from, State to) noexcept { return state_.compare_exchange_strong(from, to); }

    std::atomic<State> state_;
};

inline const char* text(Control::State state) {
    static constexpr const char* texts[] = {"waiting", "running", "stopping", "emergency stop"};
    return texts[static_cast<int>(state)];
}

} // namespace bf::realtime
