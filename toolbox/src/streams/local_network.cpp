#include "streams/local_network.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/core/value.hpp"
#include "streams/segment.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <unistd.h>
#include <utility>

namespace bf::toolbox {

namespace {

double seconds(clockid_t clock) noexcept {
    timespec time{};
    clock_gettime(clock, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void sleep(double duration) noexcept {
    if (!(duration > 0)) return;
    const double whole = std::floor(duration);
    timespec time{static_cast<time_t>(whole), static_cast<long>((duration - whole) * 1e9)};
    while (nanosleep(&time, &time) != 0) {
    }
}

/// Looks every half of a millisecond whether `done`, at most `timeout` seconds or until it is interrupted.
template <class F> bool wait_until(double timeout, F&& done) noexcept {
    const double end = seconds(CLOCK_MONOTONIC) + timeout;
    while (!done()) {
        if (seconds(CLOCK_MONOTONIC) >= end || is_interrupted()) return false;
        sleep(0.5e-3);
    }
    return true;
}

class LocalReader final : public StreamReader {
  public:
    LocalReader(const std::string& folder, std::string domain, const std::string& name, int size)
        : segment_(folder, name, size, Segment::Role::reader), domain_(std::move(domain)), buffer_(size),
          last_(segment_.newest()) {}

    Taken take(Eigen::Ref<Eigen::VectorXd> values, Stamp& stamp) noexcept override {
        if (!is_news()) return Taken::nothing;
        const auto number = std::exchange(coming_, Segment::none);
        if (number == Segment::misfit) return Taken::wrong_size;
        last_ = number;
        values = buffer_;
        stamp = {static_cast<double>(number), time_};
        return Taken::message;
    }
    bool wait(double timeout) noexcept override {
        return wait_until(timeout, [&] { return is_news(); });
    }
    bool has_writer() const noexcept override { return segment_.has(Segment::Role::writer); }
    int received_size() const noexcept override { return segment_.count(); }
    void say_source(Source& text) const noexcept override {
        std::snprintf(text, sizeof text, "shared memory, domain '%s'", domain_.c_str());
    }

  private:
    /// What cannot be read is none, however new it is.
    bool is_news() noexcept {
        if (const auto newest = segment_.newest(); newest != Segment::none && newest != last_)
            coming_ = segment_.read(buffer_, time_);
        return coming_ != Segment::none;
    }

    Segment segment_;
    const std::string domain_;
    Eigen::VectorXd buffer_;
    double time_ = 0;
    std::uint64_t last_, coming_ = Segment::none; ///< numbers of the messages that were taken and read
};

class LocalWriter final : public StreamWriter {
  public:
    LocalWriter(const std::string& folder, const std::string& name, int size)
        : segment_(folder, name, size, Segment::Role::writer) {}
    bool write(const Eigen::Ref<const Eigen::VectorXd>& values) noexcept override {
        return segment_.write(values, seconds(CLOCK_REALTIME));
    }
    bool has_reader() const noexcept override { return segment_.has(Segment::Role::reader); }

  private:
    Segment segment_;
};

// A client asks by [number, command, steps] and the server answers by [number, step size].
enum class Command { tell, pause, resume, step };
constexpr double most_steps = 1e9; ///< at once
std::string requests_of(const std::string& name) { return name + "?request"; }
std::string replies_of(const std::string& name) { return name + "?reply"; }

class LocalSimulator final : public SimulatorConnection {
  public:
    LocalSimulator(const std::string& folder, const std::string& name, double timeout)
        : requests_(folder, requests_of(name), 3, Segment::Role::writer),
          replies_(folder, replies_of(name), 2, Segment::Role::reader),
          number_(static_cast<double>(requests_.newest())), timeout_(timeout) {
        if (!ask(Command::tell, 0))
            throw std::runtime_error("no simulator answers at '" + name + "' within " +
                                     Value(timeout).describe() +
                                     " s; start the one that serves it, or correct the name");
    }
    double step_size() const noexcept override { return reply_[1]; }
    bool pause() noexcept override { return ask(Command::pause, 0); }
    bool resume() noexcept override { return ask(Command::resume, 0); }
    bool step(int count) noexcept override { return ask(Command::step, count); }

  private:
    bool ask(Command command, int count) noexcept {
        const Eigen::Vector3d request(++number_, static_cast<double>(command), count);
        requests_.write(request, 0);
        double time = 0;
        const auto is_answered = [&] {
            const auto taken = replies_.read(reply_, time);
            return taken != Segment::none && taken != Segment::misfit && reply_[0] == number_;
        };
        // One that has ended answers nothing more; one that is asked first may only begin.
        const auto is_over = [&] {
            return is_answered() || (command != Command::tell && !replies_.has(Segment::Role::writer));
        };
        if (command != Command::step) return wait_until(timeout_, is_over) && is_answered();
        // Steps take as long as they take; only the end of the simulator ends them.
        for (int looked = 0; !is_answered(); ++looked) {
            if (!replies_.has(Segment::Role::writer)) return is_answered();
            if (is_interrupted()) return false;
            sleep(looked < 1000 ? 20e-6 : 0.5e-3);
        }
        return true;
    }

    Segment requests_, replies_;
    Eigen::VectorXd reply_ = Eigen::VectorXd::Zero(2);
    double number_, timeout_;
};

class LocalServer final : public SimulatorServer {
  public:
    LocalServer(const std::string& folder, const std::string& name, double step_size)
        : requests_(folder, requests_of(name), 3, Segment::Role::reader),
          replies_(folder, replies_of(name), 2, Segment::Role::writer), last_(requests_.newest()),
          step_size_(step_size) {}

    bool next(double timeout) noexcept override {
        if (steps_ > 0 && --steps_ == 0) answer();
        if (steps_ > 0) return true;
        const auto may_go = [&] {
            serve();
            // Whoever paused it and is gone cannot let it go on.
            if (is_paused_ && !requests_.has(Segment::Role::writer)) is_paused_ = false;
            return !is_paused_ || steps_ > 0;
        };
        // Whoever steps it answers soon, mostly.
        for (int looked = 0; looked < 1000; ++looked) {
            if (may_go()) return true;
            sleep(20e-6);
        }
        return wait_until(timeout, may_go);
    }

  private:
    void serve() noexcept {
        const auto newest = requests_.newest();
        if (newest == last_) return;
        double time = 0;
        const auto taken = requests_.read(request_, time);
        if (taken == Segment::none || taken == Segment::misfit) return;
        last_ = taken;
        // Anybody can write a stream of that name.
        if (!(request_[1] >= 0 && request_[1] < 4) || !(request_[2] >= 0 && request_[2] <= most_steps))
            return;
        switch (static_cast<Command>(static_cast<int>(request_[1]))) {
        case Command::tell: break;
        case Command::pause: is_paused_ = true; break;
        case Command::resume: is_paused_ = false; break;
        case Command::step:
            is_paused_ = true;
            steps_ = static_cast<int>(request_[2]);
            if (steps_ > 0) return; // answered when they are done
            break;
        }
        answer();
    }
    void answer() noexcept { replies_.write(Eigen::Vector2d(request_[0], step_size_), 0); }

    Segment requests_, replies_;
    Eigen::VectorXd request_ = Eigen::VectorXd::Zero(3);
    std::uint64_t last_;
    double step_size_;
    int steps_ = 0; ///< to be done before the answer, with the one under way
    bool is_paused_ = false;
};

class LocalConnection final : public StreamConnection {
  public:
    LocalConnection(std::string folder, std::string domain)
        : folder_(std::move(folder)), domain_(std::move(domain)) {}
    std::shared_ptr<StreamReader> open_reader(const std::string& name, int size) override {
        return std::make_shared<LocalReader>(folder_, domain_, name, size);
    }
    std::shared_ptr<StreamWriter> open_writer(const std::string& name, int size) override {
        return std::make_shared<LocalWriter>(folder_, name, size);
    }
    std::shared_ptr<SimulatorConnection> open_simulator(const std::string& server, const std::string&,
                                                        double timeout) override {
        if (has_writer(requests_of(server)))
            throw std::runtime_error("another program steps the simulator '" + server +
                                     "'; end it, or step another simulator");
        return std::make_shared<LocalSimulator>(folder_, server, timeout);
    }
    std::shared_ptr<SimulatorServer> serve_simulator(const std::string& name, double step_size) override {
        if (has_writer(replies_of(name)))
            throw std::runtime_error("another simulator is called '" + name +
                                     "'; end it, or give this one another name");
        return std::make_shared<LocalServer>(folder_, name, step_size);
    }
    double now() const noexcept override { return seconds(CLOCK_REALTIME); }

  private:
    bool has_writer(const std::string& stream) const {
        return Segment(folder_, stream, 1, Segment::Role::reader).has(Segment::Role::writer);
    }

    const std::string folder_, domain_;
};

} // namespace

LocalNetwork::LocalNetwork(const std::string& domain)
    : folder_("/dev/shm/blockfactory-" + std::to_string(geteuid()) + "-" + domain), domain_(domain) {}

std::shared_ptr<StreamConnection> LocalNetwork::open() const {
    return std::make_shared<LocalConnection>(folder_, domain_);
}

} // namespace bf::toolbox
