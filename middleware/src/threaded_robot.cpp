#include "bf/middleware/threaded_robot.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/ending.hpp"
#include "bf/middleware/robot_host.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <future>
#include <memory>
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

/// The thread and what it shares with the step. It lives until both have let it go, as a call of the driver
/// may never come back.
class Worker : public std::enable_shared_from_this<Worker> {
  public:
    Worker(std::string name, WaitingDriver driver, double period, double watchdog)
        : name_(std::move(name)), driver_(std::move(driver)), period_(period), watchdog_(watchdog) {}

    // The side of the step.
    RobotDescription start(double timeout) {
        stop();
        if (!is_done_)
            throw std::runtime_error(
                "its driver still waits for it since the last run; start this program anew");
        goes_on_ = true;
        is_done_ = false;
        say("has ended");
        refusal_[0] = '\0';
        state_ = gains_ = command_ = settings_ = {};
        until_ = 0;
        std::promise<RobotDescription> promise;
        auto described = promise.get_future();
        thread_ = std::thread([self = shared_from_this(), promise = std::move(promise)]() mutable {
            self->serve(std::move(promise));
            self->is_done_ = true;
            self->bell_.ring();
        });
        const double end = now() + timeout;
        while (described.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready)
            if (is_interrupted() || now() > end) {
                goes_on_ = false;
                throw std::runtime_error(is_interrupted()
                                             ? std::string(interrupted)
                                             : "its driver is not ready within " + Value(timeout).describe() +
                                                   " s; look whether the robot runs, or raise start_timeout");
            }
        return described.get(); // or throws what the driver threw
    }
    void stop() noexcept {
        goes_on_ = false;
        command_bell_.ring();
        if (!thread_.joinable()) return;
        for (const double end = now() + patience; !is_done_ && now() < end;)
            bell_.wait(0.05, [&] { return is_done_.load(); });
        if (is_done_) {
            thread_.join();
        } else {
            thread_.detach();
            keep_globals();
        }
    }
    bool take_state(double* state, Stamp& stamp) noexcept {
        if (!take(vectors_->state, state, state_)) return false;
        stamp = state_;
        return true;
    }
    bool take_gains(double* gains) noexcept { return take(vectors_->gains, gains, gains_); }
    void send_command(const double* command) noexcept {
        vectors_->command.write(command, now());
        command_bell_.ring();
    }
    void send_settings(const double* settings) noexcept { vectors_->settings.write(settings, now()); }
    void wait(double timeout) noexcept {
        bell_.wait(timeout, [&] { return vectors_->state.newest() != state_.number || is_done_; });
    }
    bool is_gone() noexcept { return is_done_; }
    void expect_commands() noexcept {
        if (driver_.expect_commands) driver_.expect_commands();
    }
    const char* how_gone() const noexcept { return how_gone_; }
    void say_left_out(toolbox::RobotConnection::ErrorText& text) const noexcept {
        text[0] = '\0';
        if (driver_.left_out) driver_.left_out(text);
    }
    /// Once a state has told of it.
    void say_refusal(toolbox::RobotConnection::ErrorText& text) const noexcept {
        std::memcpy(text, refusal_, sizeof text);
    }
    const std::string& name() const noexcept { return name_; }

  private:
    static constexpr double patience = 5; ///< s that a driver may take to let the robot go

    /// The side of the thread.
    class End final : public RobotEnd {
      public:
        explicit End(Worker& its) : its_(its) {}
        void start(const RobotDescription& description) override {
            its_.description_ = description;
            its_.description_->process = 0;
            its_.vectors_.emplace(RobotLayout(description));
        }
        void show_state(const double* state, double time) noexcept override {
            if (state[RobotLayout::refused] != 0 && its_.refusal_[0] == '\0') {
                const char* const why = std::strstr(its_.driver_.robot->error(), ": "); // behind its name
                std::snprintf(its_.refusal_, sizeof its_.refusal_, "%s", why ? why + 2 : "");
            }
            its_.vectors_->state.write(state, time);
            its_.bell_.ring();
        }
        void show_gains(const double* gains) noexcept override { its_.vectors_->gains.write(gains, now()); }
        bool take_command(double* command, Stamp& stamp) noexcept override {
            if (!take(its_.vectors_->command, command, its_.command_)) return false;
            its_.until_ = command[RobotLayout::until];
            stamp = its_.command_;
            return true;
        }
        bool take_settings(double* settings) noexcept override {
            return take(its_.vectors_->settings, settings, its_.settings_);
        }
        void wait(double timeout) noexcept override {
            its_.command_bell_.wait(timeout, [&] {
                return its_.vectors_->command.newest() != its_.command_.number || !its_.goes_on_;
            });
        }
        bool is_gone() noexcept override { return false; }
        const std::string& name() const noexcept override { return its_.name_; }

      private:
        Worker& its_;
    };

    void serve(std::promise<RobotDescription> promise) {
        std::optional<RobotHost> host;
        const bool waits = driver_.advance != nullptr;
        try {
            driver_.robot->start();
            // Whoever waited has given up, and others may drive the robot now.
            if (!goes_on_) throw std::runtime_error("nobody waits for it any more");
            host.emplace(name_, *driver_.device, *driver_.robot, end_,
                         HostOptions{.waits = waits, .watchdog = watchdog_, .goes_on = [this] {
                                         return goes_on_.load();
                                     }});
            host->start(waits ? driver_.period() : period_);
            promise.set_value(*description_);
        } catch (...) {
            promise.set_exception(std::current_exception()); // before whoever waits for it has given up
            driver_.robot->stop();
            return;
        }
        const double time = driver_.time ? driver_.time() : 0;
        if (waits)
            serve_led(*host, time);
        else
            serve_by_the_clock(*host, time);
        host->stop();
        driver_.robot->stop();
    }
    void serve_led(RobotHost& host, double time) {
        for (std::int64_t k = 0;;) {
            const double at = time + static_cast<double>(k) * description_->period;
            host.show(at);
            host.step();
            if (until_ < at + description_->period / 2) return; // it is not to go on, and all before is done
            // As far as it may go at once, which is the period of whoever steps it.
            const int steps =
                static_cast<int>(std::clamp(std::round((until_ - at) / description_->period), 1.0, 1e6));
            k += steps;
            if (driver_.advance(steps)) continue;
            say(driver_.robot->error()); // which others replace when the joints are taken back
            return;
        }
    }
    void serve_by_the_clock(RobotHost& host, double time) {
        const double begin = now() - time;
        const auto step = [&] {
            const double at = driver_.clock ? driver_.clock() : now() - begin;
            host.show(at);
            host.step();
        };
        for (double due = now(); goes_on_; due = std::max(due + period_, now() - period_)) {
            const timespec until{static_cast<time_t>(due), static_cast<long>((due - std::floor(due)) * 1e9)};
            while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) continue;
            step();
        }
        step(); // takes the last command, which lets the robot go
    }

    /// Before its thread begins, or in it, before it is done.
    void say(const char* how_gone) noexcept { std::snprintf(how_gone_, sizeof how_gone_, "%s", how_gone); }

    const std::string name_;
    const WaitingDriver driver_;
    const double period_, watchdog_;
    double until_ = 0; ///< how far the newest command lets the robot go, s
    std::optional<RobotDescription> description_;
    std::optional<Vectors> vectors_;
    Stamp state_, gains_, command_, settings_; ///< of what was taken
    Bell bell_{}, command_bell_{};
    std::atomic<bool> goes_on_{false}, is_done_{true};
    toolbox::RobotConnection::ErrorText how_gone_ = "", refusal_ = "";
    End end_{*this};
    std::thread thread_;
};

class Threaded final : public RobotLink {
  public:
    explicit Threaded(std::shared_ptr<Worker> worker) : worker_(std::move(worker)) {}
    ~Threaded() override { stop(); }
    RobotDescription start(double timeout) override { return worker_->start(timeout); }
    void stop() noexcept override { worker_->stop(); }
    bool take_state(double* state, Stamp& stamp) noexcept override {
        return worker_->take_state(state, stamp);
    }
    bool take_gains(double* gains) noexcept override { return worker_->take_gains(gains); }
    void send_command(const double* command) noexcept override { worker_->send_command(command); }
    void send_settings(const double* settings) noexcept override { worker_->send_settings(settings); }
    void wait(double timeout) noexcept override { worker_->wait(timeout); }
    bool is_gone() noexcept override { return worker_->is_gone(); }
    void expect_commands() noexcept override { worker_->expect_commands(); }
    const char* how_gone() const noexcept override { return worker_->how_gone(); }
    void say_left_out(toolbox::RobotConnection::ErrorText& text) const noexcept override {
        worker_->say_left_out(text);
    }
    void say_refusal(toolbox::RobotConnection::ErrorText& text) const noexcept override {
        worker_->say_refusal(text);
    }
    const std::string& name() const noexcept override { return worker_->name(); }

  private:
    const std::shared_ptr<Worker> worker_;
};

} // namespace

ThreadArguments::ThreadArguments(Block* owner)
    : interval{owner,
               "interval",
               {.initial = 0.001, .above = 0, .maximum = 1, .doc = "between two looks at the robot, s"}},
      silence{owner,
              "silence",
              {.initial = 0.2,
               .minimum = 0,
               .doc = "without a step until the joints are taken back, s; 0: never"}} {}

std::unique_ptr<RobotLink> make_threaded_link(std::string name, WaitingDriver driver,
                                              const ThreadArguments& thread) {
    return std::make_unique<Threaded>(
        std::make_shared<Worker>(std::move(name), std::move(driver), thread.interval, thread.silence));
}

} // namespace bf::middleware
