#include "bf/middleware/outbox.hpp"

#include <chrono>
#include <stdexcept>

namespace bf::middleware {

void send_last(const std::shared_ptr<Sender>& sender) noexcept {
    for (int tries = 0; sender && sender->has_news() && tries < 100; ++tries)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

bool wait_until(double end, const std::function<bool()>& is_so) {
    while (!is_so()) {
        if (is_interrupted()) throw std::runtime_error(interrupted);
        if (now() > end) return is_so();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
}

void Outbox::open() {
    if (thread_.joinable()) return;
    goes_on_ = true;
    thread_ = std::thread([this] { run(); });
}

void Outbox::close() noexcept {
    if (!thread_.joinable()) return;
    goes_on_ = false;
    bell_.ring();
    thread_.join();
    senders_.clear();
}

void Outbox::add(const std::shared_ptr<Sender>& sender) {
    const std::lock_guard lock(mutex_);
    senders_.push_back(sender);
}

void Outbox::run() {
    // What was left last is sent before the end, too.
    for (bool is_last = false; !is_last;) {
        is_last = !goes_on_;
        std::vector<std::shared_ptr<Sender>> all;
        {
            const std::lock_guard lock(mutex_);
            all = alive(senders_);
        }
        const auto has_news = [&] {
            return std::any_of(all.begin(), all.end(), [](const auto& each) { return each->has_news(); });
        };
        if (!is_last)
            bell_.wait(
                0.05, [&] { return has_news() || !goes_on_; }, 0);
        for (const auto& each : all)
            if (each->has_news()) each->send();
    }
}

} // namespace bf::middleware
