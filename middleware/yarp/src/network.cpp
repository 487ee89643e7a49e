#include "network.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/core/value.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/ending.hpp"
#include "bf/middleware/exchange.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>
#include <yarp/os/Bottle.h>
#include <yarp/os/BufferedPort.h>
#include <yarp/os/Clock.h>
#include <yarp/os/ConnectionWriter.h>
#include <yarp/os/Log.h>
#include <yarp/os/Network.h>
#include <yarp/os/NetworkClock.h>
#include <yarp/os/Port.h>
#include <yarp/os/PortReader.h>
#include <yarp/os/Stamp.h>
#include <yarp/os/Time.h>
#include <yarp/os/TypedReaderCallback.h>

namespace bf::yarp {

namespace os = ::yarp::os;

using middleware::Bell;
using middleware::ExchangeBuffer;
using toolbox::Taken;

namespace {

/// The time that another program tells. YARP itself waits for its first time, and for its next one, for ever.
class ToldClock final : public os::Clock {
  public:
    /// Throws std::runtime_error: it is no name of a port, or YARP cannot listen to it.
    explicit ToldClock(const std::string& port) {
        if (port.front() != '/')
            throw std::runtime_error("YARP_CLOCK is '" + port +
                                     "'; write it as the name of a port, such as /clock");
        if (!its_.open(port))
            throw std::runtime_error("YARP cannot listen to " + port + ", which YARP_CLOCK names");
    }
    double now() override { return its_.now(); }
    void delay(double duration) override {
        for (const double end = now() + duration; now() < end && !is_interrupted();)
            os::SystemClock::delaySystem(1e-3);
    }
    bool isValid() const override { return true; } // for YARP, which takes no other clock
    bool is_told() const { return its_.isValid(); }

  private:
    os::NetworkClock its_;
};

/// This program as one of the network.
class Joined {
  public:
    Joined() {
        const char* const given = std::getenv("YARP_CLOCK");
        const std::string clock = given == nullptr ? "" : given;
        unsetenv("YARP_CLOCK");                     // for YARP; programs that this one starts have it again
        network_ = std::make_unique<os::Network>(); // finds the name server
        if (clock.empty()) return;
        setenv("YARP_CLOCK", clock.c_str(), 1);
        clock_ = std::make_unique<ToldClock>(clock);
        os::Time::useCustomClock(clock_.get());
    }
    Joined(const Joined&) = delete;
    Joined& operator=(const Joined&) = delete;
    /// The program that tells the time may stand still, and YARP waits until it has taken a farewell.
    ~Joined() {
        middleware::end_within(2, [network = std::shared_ptr(std::move(network_)),
                                   clock = std::shared_ptr(std::move(clock_))]() mutable {
            if (clock) os::Time::useSystemClock();
            clock.reset();
            network.reset();
        });
    }
    bool has_time() const { return !clock_ || clock_->is_told(); }

    const bool is_guest = os::NetworkBase::isNetworkInitialized(); ///< of a program that has joined before

  private:
    std::unique_ptr<os::Network> network_;
    std::unique_ptr<ToldClock> clock_;
};

const Joined& joined() {
    static const Joined its;
    return its;
}

} // namespace

void join() {
    // What goes wrong is told by those who call.
    os::Log::setMinimumPrintLevel(os::Log::FatalType);
    os::Log::setPrintCallback([](auto...) {});
    const Joined& its = joined();
    // YARP begins its local mode by itself where nobody has said where the name server is.
    if (os::NetworkBase::getLocalMode() && !its.is_guest) throw std::runtime_error(no_name_server);
    if (!os::NetworkBase::getLocalMode() && !os::NetworkBase::checkNetwork(5.0))
        throw std::runtime_error("no YARP name server answers; start yarpserver, and say where it is by "
                                 "`yarp conf HOST PORT`");
}

bool is_there(const std::string& port) { return os::NetworkBase::exists(port, true); }

void open_port(os::Contactable& port, const std::string& name, const std::string& wanted) {
    if (name.empty() || name.front() != '/')
        throw std::runtime_error("the port '" + name + "' needs a name that begins with /");
    if (!port.open(wanted))
        throw std::runtime_error("the port " + name + " does not open; look whether another program has it");
}

namespace {

void connect(const std::string& from, const std::string& to) {
    if (!os::NetworkBase::connect(from, to, "", true))
        throw std::runtime_error(from + " cannot be connected to " + to +
                                 "; look whether the program that has it still runs");
}

constexpr const char* anonymous = "...";

/// A thread of YARP hears, and the step takes what came last.
class Reader final : public toolbox::StreamReader, private os::TypedReaderCallback<os::Bottle> {
  public:
    Reader(const std::string& name, int size)
        : name_(name), newest_(size + 2), arriving_(static_cast<std::size_t>(size) + 2),
          values_(arriving_.size()) {
        const bool is_theirs = is_there(name);
        port_.setStrict(false);
        open_port(port_, name, is_theirs ? anonymous : name);
        port_.useCallback(*this);
        if (!is_theirs) return;
        connect(name, port_.getName());
        // The port notices a little later.
        for (int tries = 0; tries < 500 && port_.getInputCount() == 0; ++tries)
            os::SystemClock::delaySystem(0.002);
    }
    ~Reader() override {
        port_.disableCallback(); // first, or its thread is given a message that is none
        port_.close();
    }

    Taken take(Eigen::Ref<Eigen::VectorXd> values, toolbox::Stamp& stamp) noexcept override {
        if (const auto wrong = wrong_messages_.load(); wrong != seen_wrong_) {
            seen_wrong_ = wrong;
            return Taken::wrong_size;
        }
        if (newest_.newest() == taken_.number || !newest_.read(values_.data(), taken_)) return Taken::nothing;
        stamp = {values_[0], values_[1]};
        values = Eigen::Map<const Eigen::VectorXd>(values_.data() + 2, values.size());
        return Taken::message;
    }
    bool wait(double timeout) noexcept override {
        bell_.wait(timeout, [&] { return is_news(); });
        return is_news();
    }
    bool has_writer() const noexcept override { return port_.getInputCount() > 0; }
    int received_size() const noexcept override { return wrong_size_; }
    void say_source(Source& text) const noexcept override {
        std::snprintf(text, sizeof text, "YARP port %s", name_.c_str());
    }

  private:
    bool is_news() const noexcept {
        return newest_.newest() != taken_.number || wrong_messages_.load() != seen_wrong_;
    }
    // In the thread of the port.
    using os::TypedReaderCallback<os::Bottle>::onRead;
    void onRead(os::Bottle& message) override {
        const std::size_t size = message.size();
        if (size + 2 != arriving_.size()) {
            wrong_size_ = static_cast<int>(size);
            ++wrong_messages_;
            bell_.ring();
            return;
        }
        os::Stamp stamp;
        const bool is_stamped = port_.getEnvelope(stamp) && stamp.isValid();
        arriving_[0] = is_stamped ? stamp.getCount() : static_cast<double>(newest_.newest() + 1);
        arriving_[1] = is_stamped ? stamp.getTime() : os::Time::now();
        for (std::size_t i = 0; i < size; ++i) arriving_[i + 2] = message.get(i).asFloat64();
        newest_.write(arriving_.data(), arriving_[1]);
        bell_.ring();
    }

    const std::string name_;
    ExchangeBuffer newest_; ///< number, time, values
    std::vector<double> arriving_, values_;
    middleware::Stamp taken_;
    Bell bell_{};
    std::atomic<std::uint64_t> wrong_messages_{0};
    std::atomic<int> wrong_size_{0};
    std::uint64_t seen_wrong_ = 0;
    mutable os::BufferedPort<os::Bottle> port_; ///< even asking it for its connections is no const call
};

/// The step leaves a message, and a thread sends it.
class Writer final : public toolbox::StreamWriter {
  public:
    Writer(const std::string& name, int size) : newest_(size), values_(static_cast<std::size_t>(size)) {
        const bool is_theirs = is_there(name);
        open_port(port_, name, is_theirs ? anonymous : name);
        if (is_theirs) connect(port_.getName(), name);
        thread_ = std::thread([this] { send(); });
    }
    ~Writer() override {
        goes_on_ = false;
        bell_.ring();
        thread_.join();
        port_.interrupt();
        port_.close();
    }

    bool write(const Eigen::Ref<const Eigen::VectorXd>& values) noexcept override {
        newest_.write(values.data(), 0);
        bell_.ring();
        return true;
    }
    bool has_reader() const noexcept override { return port_.getOutputCount() > 0; }

  private:
    void send() {
        middleware::Stamp taken;
        os::Stamp stamp;
        os::Bottle message;
        // The last message is sent before the end, too.
        for (bool is_last = false; !is_last;) {
            is_last = !goes_on_;
            if (!is_last) bell_.wait(0.05, [&] { return newest_.newest() != taken.number || !goes_on_; });
            if (newest_.newest() == taken.number || !newest_.read(values_.data(), taken)) continue;
            message.clear();
            for (const double value : values_) message.addFloat64(value);
            stamp.update();
            port_.setEnvelope(stamp);
            port_.write(message);
        }
    }

    ExchangeBuffer newest_;
    std::vector<double> values_;
    Bell bell_{};
    std::atomic<bool> goes_on_{true};
    mutable os::Port port_;
    std::thread thread_;
};

// ---- simulators that are told to run, by the service ClockServer of Gazebo's plugins for YARP: each call is
// a list of its name's parts between underscores, none here, and its arguments.

class Simulator final : public toolbox::SimulatorConnection {
  public:
    Simulator(const std::string& server, const std::string& client, double timeout) : timeout_(timeout) {
        const double end = middleware::now() + timeout;
        while (!is_there(server)) {
            if (is_interrupted()) throw std::runtime_error(interrupted);
            if (middleware::now() > end) throw std::runtime_error(no_answer(server));
            os::SystemClock::delaySystem(0.02);
        }
        open_port(port_, client, client);
        port_.setTimeout(static_cast<float>(timeout));
        connect(port_.getName(), server);
        thread_ = std::thread([this] { run(); });
        if (!ask(Call::step_size, 0, true) || !(step_size_ > 0)) {
            end_thread();
            throw std::runtime_error(no_answer(server));
        }
    }
    ~Simulator() override { end_thread(); }

    double step_size() const noexcept override { return step_size_; }
    bool pause() noexcept override { return ask(Call::pause, 0, true); }
    bool resume() noexcept override { return ask(Call::resume, 0, true); }
    bool step(int count) noexcept override { return ask(Call::step, count, false); }

  private:
    enum class Call { step_size, pause, resume, step };

    std::string no_answer(const std::string& server) const {
        return "no simulator answers at '" + server + "' within " + Value(timeout_).describe() +
               " s; start the one that serves it, or correct the name";
    }
    /// What is asked has its number; the step waits for the answer of that number.
    bool ask(Call call, int count, bool is_quick) noexcept {
        call_ = call;
        count_ = count;
        const auto number = ++asked_;
        asked_bell_.ring();
        const double end = middleware::now() + timeout_;
        while (answered_ != number) {
            if (is_over_ || is_interrupted() || (is_quick && middleware::now() > end)) return false;
            answered_bell_.wait(0.05, [&] { return answered_ == number || is_over_; });
        }
        return is_good_;
    }
    // In the thread, as its calls wait without end.
    void run() {
        for (std::uint64_t done = 0; goes_on_;) {
            asked_bell_.wait(0.05, [&] { return asked_ != done || !goes_on_; });
            if (asked_ == done) continue;
            os::Bottle question, answer;
            switch (call_.load()) {
            case Call::step_size: question.addString("getStepSize"); break;
            case Call::pause: question.addString("pauseSimulation"); break;
            case Call::resume: question.addString("continueSimulation"); break;
            case Call::step:
                question.addString("stepSimulationAndWait");
                question.addInt32(count_);
                break;
            }
            is_good_ = port_.write(question, answer);
            if (call_ == Call::step_size) step_size_ = answer.get(0).asFloat64();
            if (!is_good_ || port_.getOutputCount() == 0) is_over_ = !is_good_;
            answered_ = ++done;
            answered_bell_.ring();
        }
    }
    void end_thread() noexcept {
        goes_on_ = false;
        asked_bell_.ring();
        port_.interrupt();
        port_.close();
        thread_.join();
    }

    const double timeout_;
    os::Port port_;
    std::atomic<Call> call_{};
    std::atomic<int> count_{0};
    std::atomic<std::uint64_t> asked_{0}, answered_{0};
    std::atomic<bool> goes_on_{true}, is_over_{false}, is_good_{false};
    std::atomic<double> step_size_{0};
    Bell asked_bell_{}, answered_bell_{};
    std::thread thread_;
};

class Server final : public ClockServer, private os::PortReader {
  public:
    Server(const std::string& name, double step_size, Led led)
        : step_size_(step_size), led_(led), is_paused_(led == Led::always) {
        if (is_there(name))
            throw std::runtime_error("another simulator is called '" + name +
                                     "'; end it, or give this one another name");
        port_.setReader(*this);
        open_port(port_, name, name);
    }
    ~Server() override {
        is_over_ = true;
        done_bell_.ring();
        port_.interrupt();
        port_.close();
    }

    bool next(double timeout) noexcept override {
        // That of before is done now.
        if (is_begun_) {
            done_.fetch_add(1);
            done_bell_.ring();
        }
        is_begun_ = false;
        if (led_ == Led::never) return is_begun_ = true;
        const auto may_go = [&] {
            // Whoever paused it and is gone cannot let it go on.
            if (led_ == Led::once_paused && is_paused_ && clients() == 0) is_paused_ = false;
            return !is_paused_ || done_ < wanted_;
        };
        bell_.wait(timeout, may_go);
        if (!may_go()) return false;
        if (!is_paused_) wanted_ = done_ + 1; // it runs freely
        return is_begun_ = true;
    }
    int clients() const noexcept override { return port_.getInputCount(); }

  private:
    // In a thread of the port.
    bool read(os::ConnectionReader& reader) override {
        os::Bottle question, answer;
        if (!question.read(reader)) return false;
        const std::string call = question.get(0).asString();
        const auto steps = question.size() > 1 ? question.get(1).asInt32() : 1;
        if (call == "pauseSimulation") {
            if (led_ != Led::never) {
                wanted_ = done_.load();
                is_paused_ = true;
            }
        } else if (call == "continueSimulation") {
            is_paused_ = false;
        } else if (call == "stepSimulation" || call == "stepSimulationAndWait") {
            if (steps > 0) {
                const std::uint64_t from = is_paused_ ? wanted_.load() : done_.load();
                const std::uint64_t end = from + static_cast<std::uint64_t>(steps);
                if (led_ != Led::never) {
                    wanted_ = end;
                    is_paused_ = true;
                }
                bell_.ring();
                // Somebody else may pause it meanwhile.
                const auto is_done = [&] {
                    return done_ >= end || is_over_ || (led_ != Led::never && is_paused_ && wanted_ < end);
                };
                if (call == "stepSimulationAndWait")
                    while (!is_done()) done_bell_.wait(0.05, is_done);
            }
        } else if (call == "resetSimulationTime") {
            answer.addString("a running model's time is not set back");
        } else if (call == "getSimulationTime") {
            answer.addFloat64(static_cast<double>(done_) * step_size_);
        } else if (call == "getStepSize") {
            answer.addFloat64(step_size_);
        } else {
            answer.addString("pauseSimulation, continueSimulation, stepSimulation N, stepSimulationAndWait "
                             "N, getSimulationTime, getStepSize");
        }
        bell_.ring();
        auto* writer = reader.getWriter();
        return writer == nullptr || answer.write(*writer);
    }

    const double step_size_;
    const Led led_;
    std::atomic<std::uint64_t> wanted_{0}, done_{0}; ///< steps
    std::atomic<bool> is_paused_, is_over_{false};
    bool is_begun_ = false;
    Bell bell_{}, done_bell_{};
    mutable os::Port port_; ///< even asking it for its connections is no const call
};

class Connection final : public toolbox::StreamConnection {
  public:
    std::shared_ptr<toolbox::StreamReader> open_reader(const std::string& name, int size) override {
        return opened<Reader>(name, size);
    }
    std::shared_ptr<toolbox::StreamWriter> open_writer(const std::string& name, int size) override {
        return opened<Writer>(name, size);
    }
    std::shared_ptr<toolbox::SimulatorConnection> open_simulator(const std::string& server,
                                                                 const std::string& client,
                                                                 double timeout) override {
        return opened<Simulator>(server, client, timeout);
    }
    std::shared_ptr<toolbox::SimulatorServer> serve_simulator(const std::string& name,
                                                              double step_size) override {
        join();
        return serve_clock(name, step_size, Led::once_paused);
    }
    double now() const noexcept override { return os::Time::now(); }
    bool has_time() const noexcept override { return joined().has_time(); }

  private:
    template <class T, class... Values> std::shared_ptr<T> opened(const Values&... values) {
        join();
        return std::make_shared<T>(values...);
    }
};

} // namespace

std::shared_ptr<ClockServer> serve_clock(const std::string& name, double step_size, Led led) {
    return std::make_shared<Server>(name, step_size, led);
}

std::shared_ptr<toolbox::StreamConnection> Network::open() const { return std::make_shared<Connection>(); }

} // namespace bf::yarp
