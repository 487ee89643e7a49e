#include "bf/shared_memory/robot.hpp"

#include "bf/core/interrupt.hpp"
#include "robot_file.hpp"

#include <algorithm>
#include <stdexcept>

namespace bf::shared_memory {

using middleware::now;
using middleware::RobotDescription;
using middleware::Stamp;

namespace {

std::string called(const std::string& name) { return "robot '" + name + "' in shared memory"; }

constexpr double mending = 1; ///< s within which a server writes anew what was written over

class Link final : public middleware::RobotLink {
  public:
    explicit Link(const std::string& name) : robot_(name), name_(called(name)) {}

    RobotDescription start(double timeout) override {
        if (const auto wrong = wrong_name(robot_); !wrong.empty()) throw std::runtime_error(wrong);
        RobotDescription description;
        const std::string how = "bf serve MODEL --shm " + robot_;
        const double begin = now();
        const auto is_open = [&] {
            try {
                return file_.open(robot_, description);
            } catch (const std::runtime_error&) { // its server may mend it
                if (now() - begin > std::min(timeout, mending)) throw;
                return false;
            }
        };
        for (bool is_told = false; !is_open();) {
            if (now() - begin > timeout)
                throw std::runtime_error("nobody serves it within " + Value(timeout).describe() +
                                         " s; start it first, e.g. by " + how);
            if (is_interrupted()) throw std::runtime_error(interrupted);
            if (!is_told && now() - begin > 0.5) {
                tell_wait((name_ + ", which " + how + " serves").c_str());
                is_told = true;
            }
            const timespec pause{0, 2'000'000};
            nanosleep(&pause, nullptr);
        }
        state_ = {};
        gains_ = {};
        return description;
    }
    void stop() noexcept override { file_.close(); }

    bool take_state(double* state, Stamp& stamp) noexcept override {
        if (!file_.state().take(state, state_)) return false;
        stamp = state_;
        return true;
    }
    bool take_gains(double* gains) noexcept override { return file_.gains().take(gains, gains_); }
    void send_command(const double* command) noexcept override {
        file_.command().write(command, now());
        file_.command_bell().ring();
    }
    void send_settings(const double* settings) noexcept override { file_.settings().write(settings, now()); }
    void wait(double timeout) noexcept override {
        const auto has_news = [&] { return file_.state().has_news(state_); };
        file_.state_bell().wait(timeout, has_news);
        if (has_news()) return;
        file_.command().mend(); // or the server waits for it
        file_.settings().mend();
    }
    bool is_gone() noexcept override { return file_.is_server_gone(); }
    const std::string& name() const noexcept override { return name_; }

  private:
    const std::string robot_, name_;
    RobotFile file_;
    Stamp state_, gains_; ///< of what was taken
};

class End final : public middleware::RobotEnd {
  public:
    explicit End(const std::string& name) : robot_(name), name_(called(name)) {}

    void start(const RobotDescription& description) override {
        file_.create(robot_, description);
        command_ = settings_ = {};
    }
    void show_state(const double* state, double time) noexcept override {
        file_.state().write(state, time);
        file_.state_bell().ring();
        if (++shown_ % 64 == 0) file_.mend();
    }
    void show_gains(const double* gains) noexcept override { file_.gains().write(gains, now()); }
    bool take_command(double* command, Stamp& stamp) noexcept override {
        if (!file_.command().take(command, command_)) return false;
        stamp = command_;
        return true;
    }
    bool take_settings(double* settings) noexcept override {
        return file_.settings().take(settings, settings_);
    }
    void wait(double timeout) noexcept override {
        const auto has_news = [&] { return file_.command().has_news(command_); };
        file_.command_bell().wait(timeout, has_news);
        if (!has_news()) file_.mend();
    }
    bool is_gone() noexcept override { return file_.is_controller_gone(); }
    const std::string& name() const noexcept override { return name_; }

  private:
    const std::string robot_, name_;
    RobotFile file_;
    Stamp command_, settings_;
    unsigned shown_ = 0; ///< states
};

} // namespace

std::unique_ptr<middleware::RobotLink> make_link(const std::string& name) {
    return std::make_unique<Link>(name);
}
std::unique_ptr<middleware::RobotEnd> make_end(const std::string& name) {
    return std::make_unique<End>(name);
}

} // namespace bf::shared_memory
