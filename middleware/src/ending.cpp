#include "bf/middleware/ending.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <thread>
#include <unistd.h>
#include <utility>

namespace bf::middleware {

void keep_globals() noexcept {
    [[maybe_unused]] static const int once = ::on_exit(
        [](int code, void*) {
            std::fflush(nullptr);
            ::_exit(code);
        },
        nullptr);
}

bool end_within(double patience, std::function<void()> end) {
    std::promise<void> promise;
    const auto ended = promise.get_future();
    std::thread thread([end = std::move(end), promise = std::move(promise)]() mutable {
        end();
        end = nullptr; // and what it holds
        promise.set_value();
    });
    const bool is_in_time =
        ended.wait_for(std::chrono::duration<double>(patience)) == std::future_status::ready;
    if (is_in_time) {
        thread.join();
    } else {
        thread.detach();
        keep_globals();
    }
    return is_in_time;
}

} // namespace bf::middleware
