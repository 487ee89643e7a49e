// Calls of services of std_srvs, whose answers come later.
#pragma once

#include "bf/middleware/bell.hpp"
#include "caller.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace bf::ros1 {

/// Calls a Trigger or, where something is to be asked, a SetBool, in a thread of its own from begin() on.
class Asker {
  public:
    /// What is answered is told in that thread: whether it is done, or why not.
    using Answered = std::function<void(bool is_done, const std::string& why)>;
    Asker(const std::string& name, const char* type, Answered answered)
        : caller_(name, ServiceType::find(type)), answered_(std::move(answered)) {}
    ~Asker() {
        is_over_ = true;
        caller_.break_off();
        bell_.ring();
        if (thread_.joinable()) thread_.join();
    }
    /// Before begin().
    bool has_server() noexcept { return caller_.has_server(); }
    void begin() {
        thread_ = std::thread([this] { run(); });
    }
    /// In a step, too. Of those that come faster than they are answered the newest counts.
    void ask() noexcept {
        ++asked_;
        bell_.ring();
    }

  private:
    void run() {
        const auto request = std::static_pointer_cast<Message>(caller_.type().request->make());
        if (const auto* data = caller_.type().request->field("data")) {
            const double yes = 1;
            data->write(request.get(), &yes, 1);
        }
        for (std::uint64_t done = 0; !is_over_;) {
            bell_.wait(
                0.1, [&] { return asked_ != done || is_over_; }, 0);
            if (asked_ == done || is_over_) continue;
            done = asked_;
            const Message* answer = caller_.has_server() ? caller_.call(*request) : nullptr;
            if (answer == nullptr) {
                answered_(false, "its service does not answer");
                continue;
            }
            double is_done = 0;
            const auto& type = *caller_.type().response;
            type.field("success")->read(answer, &is_done, 1);
            answered_(is_done != 0, type.field("message")->text(answer));
        }
    }
    Caller caller_;
    const Answered answered_;
    std::atomic<std::uint64_t> asked_{0};
    std::atomic<bool> is_over_{false};
    middleware::Bell bell_{};
    std::thread thread_;
};

} // namespace bf::ros1
