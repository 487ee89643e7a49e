// The thread that sends what steps leave.
#pragma once

#include "bf/middleware/bell.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace bf::middleware {

/// What that thread sends, when somebody has left something.
class Sender {
  public:
    virtual ~Sender() = default;
    virtual bool has_news() const noexcept = 0;
    virtual void send() = 0;
};

/// Waits until what was left last is sent, behind the last step.
void send_last(const std::shared_ptr<Sender>& sender) noexcept;

/// Waits for what other threads bring, up to that time of now(); false: it is not so then. Throws
/// std::runtime_error where the user interrupts it.
bool wait_until(double end, const std::function<bool()>& is_so);

/// Its thread runs from open() to close().
class Outbox {
  public:
    ~Outbox() { close(); }
    void open();
    /// What was left last is sent before.
    void close() noexcept;
    /// The thread looks at it as long as somebody else has it, too.
    void add(const std::shared_ptr<Sender>& sender);
    /// Wakes the thread; in steps, too.
    Bell& bell() noexcept { return bell_; }

  private:
    void run();
    std::mutex mutex_; ///< of the list
    std::vector<std::weak_ptr<Sender>> senders_;
    std::atomic<bool> goes_on_{false};
    Bell bell_{};
    std::thread thread_;
};

/// Those that somebody else has, too; the others are forgotten.
template <class T> std::vector<std::shared_ptr<T>> alive(std::vector<std::weak_ptr<T>>& list) {
    std::vector<std::shared_ptr<T>> result;
    std::erase_if(list, [](const auto& each) { return each.expired(); });
    for (const auto& each : list)
        if (auto its = each.lock()) result.push_back(std::move(its));
    return result;
}

} // namespace bf::middleware
