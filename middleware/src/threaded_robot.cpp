#include "bf/middleware/threaded_robot.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/robot_host.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <future>
#include <optional>
#include <stdexcept>
#include <thread>

namespace bf::middleware {

namespace {

/// Both ends in one program.
struct Vectors {
    explicit Vectors(const RobotLayout& at)
        : state(at.state_size()), gains(at.settings_size()), command(at.command_size()),
          settings(at.settings_size()) {}
    ExchangeBuffer state, gains, command, settings;
};

/// Copies a message that was not taken yet.
bool take(const Exchange& from, double* values, Stamp& last) noexcept {
    return from.newest() != last.number && from.read(values, last);
}

class Threaded final : public RobotLink, private RobotEnd {
  public:
    Threaded(std::string name, WaitingDriver driver, double period, double watchdog)
        : name_(std::move(name)), driver_(std::move(driver)), period_(period), watchdog_(watchdog) {}
    ~Threaded() override { stop(); }

    // The side of the step.
    RobotDescription start(double timeout) override {
        stop();
        goes_on_ = true;
        is_gone_ = false;
        state_ = gains_ = command_ = settings_ = {};
        std::promise<RobotDescription> promise;
        auto described = promise.get_future();
        thread_ = std::thread([this, promise = std::move(promise)]() mutable { serve(std::move(promise)); });
        const double end = now() + timeout;
        while (described.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready)
            if (is_interrupted() || now() > end) {
                goes_on_ = false; // its driver may wait on: stop() waits for it
                throw std::runtime_error(is_interrupted()
                                             ? std::string(interrupted)
                                             : "its driver is not ready within " + Value(timeout).describe() +
                                                   " s; look whether the robot runs, or raise start_timeout");
            }
        return described.get(); // or throws what the driver threw
    }
    void stop() noexcept override {
        goes_on_ = false;
        if (thread_.joinable()) thread_.join();
    }
    bool take_state(double* state, Stamp& stamp) noexcept override {
        if (!take(vectors_->state, state, state_)) return false;
        stamp = state_;
        return true;
    }
    bool take_gains(double* gains) noexcept override { return take(vectors_->gains, gains, gains_); }
    void send_command(const double* command) noexcept override { vectors_->command.write(command, now()); }
    void send_settings(const double* settings) noexcept override {
        vectors_->settings.write(settings, now());
    }
    void wait(double timeout) noexcept override {
        bell_.wait(timeout, [&] { return vectors_->state.newest() != state_.number || is_gone_; });
    }
    bool is_gone() noexcept override { return is_gone_; }
    const std::string& name() const noexcept override { return name_; }

  private:
    // The side of the thread.
    void serve(std::promise<RobotDescription> promise) {
        std::optional<RobotHost> host;
        try {
            driver_.robot->start();
            host.emplace(name_, *driver_.device, *driver_.robot, static_cast<RobotEnd&>(*this),
                         HostOptions{.waits = false, .watchdog = watchdog_});
            host->start(period_);
            promise.set_value(*description_);
        } catch (...) {
            driver_.robot->stop();
            promise.set_exception(std::current_exception());
            return;
        }
        const double begin = now();
        for (double due = begin; goes_on_; due = std::max(due + period_, now() - period_)) {
            const timespec until{static_cast<time_t>(due), static_cast<long>((due - std::floor(due)) * 1e9)};
            while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) continue;
            host->step(now() - begin);
        }
        host->step(now() - begin); // takes the last command, which lets the robot go
        host->stop();
        driver_.robot->stop();
        is_gone_ = true;
        bell_.ring();
    }
    void start(const RobotDescription& description) override {
        description_ = description;
        description_->process = 0;
        vectors_.emplace(RobotLayout(description));
    }
    void show_state(const double* state, double time) noexcept override {
        vectors_->state.write(state, time);
        bell_.ring();
    }
    void show_gains(const double* gains) noexcept override { vectors_->gains.write(gains, now()); }
    bool take_command(double* command, Stamp& stamp) noexcept override {
        if (!take(vectors_->command, command, command_)) return false;
        stamp = command_;
        return true;
    }
    bool take_settings(double* settings) noexcept override {
        return take(vectors_->settings, settings, settings_);
    }

    const std::string name_;
    const WaitingDriver driver_;
    const double period_, watchdog_;
    std::optional<RobotDescription> description_;
    std::optional<Vectors> vectors_;
    Stamp state_, gains_, command_, settings_; ///< of what was taken
    Bell bell_{};
    std::atomic<bool> goes_on_{false}, is_gone_{false};
    std::thread thread_;
};

} // namespace

std::unique_ptr<RobotLink> make_threaded_link(std::string name, WaitingDriver driver, double period,
                                              double watchdog) {
    return std::make_unique<Threaded>(std::move(name), std::move(driver), period, watchdog);
}

} // namespace bf::middleware
