#include "streams/streams.hpp"

#include "BlockFactory/Core/Log.h"
#include "bf/core/block.hpp"
#include "bf/core/interrupt.hpp"
#include "bf/core/kept_text.hpp"
#include "bf/toolbox/streams.hpp"
#include "streams/local_network.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <thread>
#include <utility>

namespace bf::toolbox {

namespace {

class LocalStreams final : public Block {
  public:
    explicit LocalStreams(const Arguments& arguments) : Block(arguments) {
        for (const char letter : *domain)
            if (!std::isalnum(static_cast<unsigned char>(letter)) && letter != '_' && letter != '-') {
                problem("argument 'domain' is '" + *domain + "'; write letters, digits, '_' and '-'");
                break;
            }
        if (*domain == "robots")
            problem("argument 'domain' is 'robots', where robots in shared memory are; give another one");
    }
    Argument<std::string> domain{
        this, "domain", {.initial = "default", .doc = "programs of one domain see each other's streams"}};
    Provides<StreamNetwork> network{this, [this]() -> std::shared_ptr<const StreamNetwork> {
                                        return std::make_shared<LocalNetwork>(*domain);
                                    }};
};

/// What a block has opened in a run. It is not part of snapshots.
template <class End> struct Opened { std::shared_ptr<End> end; };

/// There is nobody at the other end of a stream.
void report_missing(const std::string& stream, const char* who, bool is_error) {
    const auto text = "nobody " + std::string(who) + " '" + stream + "'; start the other program first, or " +
                      "set error_on_missing to false";
    if (is_error) throw std::runtime_error(text);
    bfWarning << "nobody " << who << " '" << stream << "' yet";
}

class StreamRead final : public Block {
  public:
    explicit StreamRead(const Arguments& arguments) : Block(arguments) {
        if (stream->empty()) problem("argument 'stream' is empty; name the stream, such as '/robot/state'");
    }
    Argument<std::string> stream{this, "stream", {.initial = "/stream", .doc = "name of the stream"}};
    Argument<int> size{
        this, "size", {.initial = 1, .minimum = 1, .maximum = 1'000'000, .doc = "elements of a message"}};
    Argument<bool> wait_for_data{
        this,
        "wait_for_data",
        {.initial = false, .doc = "each step waits for a new message, at most `timeout`, and fails without"}};
    Argument<bool> read_timestamp{this, "read_timestamp", {.initial = true, .doc = "port timestamp"}};
    Argument<bool> autoconnect{
        this,
        "autoconnect",
        {.initial = true,
         .doc = "somebody must send already; false: whoever will, and port is_connected says since when"}};
    Argument<bool> error_on_missing{
        this,
        "error_on_missing",
        {.initial = true, .doc = "nobody sends: the run does not start; false: a warning"}};
    Argument<double> timeout{this, "timeout", {.initial = 0.5, .minimum = 0, .doc = "of wait_for_data, s"}};

    Requires<StreamNetwork> network{this, "the network of the stream"};
    Output<Vector> y{
        this, "y", {.shape = {*size}, .unit = any_unit, .doc = "newest message; zero before the first"}};
    Output<Vector> timestamp{
        this,
        "timestamp",
        {.shape = {2},
         .unit = mixed_units,
         .doc = "number of the message and when it was sent, s, by the clock of the network",
         .present = read_timestamp}};
    Output<double> is_connected{
        this, "is_connected", {.doc = "1 since the first message", .present = !*autoconnect}};
    DiscreteState<Vector> last{this, "last", {.shape = {*size}, .unit = any_unit, .doc = "newest message"}};
    DiscreteState<Vector> last_stamp{
        this, "last_stamp", {.shape = {2}, .unit = mixed_units, .doc = "its number and time"}};
    OutsideState<Opened<StreamReader>> reader{this, [] { return std::make_shared<Opened<StreamReader>>(); }};
    Scratch<std::pair<Vector, Stamp>> newest{
        this, [this] { return std::pair<Vector, Stamp>(Vector::Zero(*size), {}); }};
    struct Told {
        char letters[600] = "";
    };
    Scratch<Told> told{this, [] { return Told(); }};

    void start(Now at) const override {
        at[reader].end = at[network].open_reader(*stream, size);
        if (autoconnect && !at[reader].end->has_writer()) report_missing(*stream, "sends", error_on_missing);
    }
    void stop(Now at) const noexcept override { at[reader].end.reset(); }

    Status output(Now at, Out out) const noexcept override {
        auto& [values, stamp] = at[newest];
        values = at[last];
        stamp = {at[last_stamp](0), at[last_stamp](1)};
        auto& end = *at[reader].end;
        if (wait_for_data && !end.wait(timeout))
            return is_interrupted() ? Status::failure(interrupted)
                                    : failure(at,
                                              "no message came within the timeout of %g s; look whether its "
                                              "sender runs, or raise timeout",
                                              *timeout);
        switch (end.take(values, stamp)) {
        case Taken::wrong_size:
            return Status::failure("a message has {} elements, but argument 'size' is {}",
                                   end.received_size(), *size);
        case Taken::failure: return failure(at, "it broke; look at its network");
        case Taken::message:
            for (Eigen::Index i = 0; i < values.size(); ++i)
                if (!std::isfinite(values[i]))
                    return failure(at,
                                   "message %.0f brings %g as element %d of %d; look at what its sender "
                                   "computes",
                                   stamp.count, values[i], static_cast<int>(i + 1), *size);
            break;
        case Taken::nothing: break;
        }
        out[y] = values;
        if (timestamp.is_present()) out[timestamp] << stamp.count, stamp.time;
        if (is_connected.is_present()) out[is_connected] = stamp.count > 0 ? 1 : 0;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        const auto& [values, stamp] = at[newest];
        next[last] = values;
        next[last_stamp] << stamp.count, stamp.time;
        return ok;
    }

  private:
    /// What happened, behind the stream's name and where its messages come from.
    template <class... Values> Status failure(Now at, const char* format, Values... happened) const noexcept {
        StreamReader::Source source;
        at[reader].end->say_source(source);
        char text[sizeof(Told)];
        const int head = std::snprintf(text, sizeof text, "stream '%.200s' (%s): ", stream->c_str(), source);
        std::snprintf(text + head, sizeof text - static_cast<std::size_t>(head), format, happened...);
        keep_text(at[told].letters, text);
        return Status::failure(at[told].letters);
    }
};

class StreamWrite final : public Block {
  public:
    explicit StreamWrite(const Arguments& arguments) : Block(arguments) {
        if (stream->empty()) problem("argument 'stream' is empty; name the stream, such as '/robot/command'");
    }
    Argument<std::string> stream{this, "stream", {.initial = "/stream", .doc = "name of the stream"}};
    Argument<bool> autoconnect{
        this, "autoconnect", {.initial = false, .doc = "somebody must receive already; false: whoever will"}};
    Argument<bool> error_on_missing{
        this,
        "error_on_missing",
        {.initial = true, .doc = "nobody receives: the run does not start; false: a warning"}};

    Requires<StreamNetwork> network{this, "the network of the stream"};
    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}, .unit = any_unit, .doc = "message of each step"}};
    OutsideState<Opened<StreamWriter>> writer{this, [] { return std::make_shared<Opened<StreamWriter>>(); }};

    void start(Now at) const override {
        at[writer].end = at[network].open_writer(*stream, static_cast<int>(at[u].size()));
        if (autoconnect && !at[writer].end->has_reader())
            report_missing(*stream, "receives", error_on_missing);
    }
    void stop(Now at) const noexcept override { at[writer].end.reset(); }
    Status output(Now at, Out) const noexcept override {
        if (at[writer].end->write(at[u])) return ok;
        return Status::failure("the stream did not take the message; look at its network");
    }
};

class NetworkClock final : public Block {
  public:
    using Block::Block;
    Requires<StreamNetwork> network{this, "the network whose time it is"};
    Output<double> y{this, "y", {.unit = unit<"s">, .doc = "time of the network"}};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[network].now();
        return ok;
    }
};

void sleep(double duration) noexcept { std::this_thread::sleep_for(std::chrono::duration<double>(duration)); }

double system_time() noexcept {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// 31 years: no run takes longer, and times of the schedule fit.
constexpr double longest_interval = 1e9;

/// What an interval between steps may be, s; 0: that of the sample time.
std::string wrong_interval(double interval) {
    if (interval == 0 || interval >= 1e-9) return {};
    return "argument 'interval' is " + Value(interval).describe() +
           " s; give at least 1e-9, or 0 for the block's sample time";
}

class RealTimeSynchronizer final : public Block {
  public:
    explicit RealTimeSynchronizer(const Arguments& arguments) : Block(arguments) {
        if (auto wrong = wrong_interval(interval); !wrong.empty()) problem(std::move(wrong));
    }
    Argument<double> interval{this,
                              "interval",
                              {.initial = 0,
                               .minimum = 0,
                               .maximum = longest_interval,
                               .doc = "between two steps, s; 0: the block's sample time"}};
    Argument<std::string> clock{this,
                                "clock",
                                {.initial = "system",
                                 .doc = "whose time it is: of this computer, or of the stream network around",
                                 .choices = {"system", "network"}}};
    Argument<bool> skip{
        this,
        "skip",
        {.initial = false,
         .doc = "a step that is late by whole intervals leaves these out; false: late steps follow at once "
                "until they have caught up"}};
    Argument<bool> report{this, "report", {.initial = false, .doc = "ports overruns and lateness"}};

    Requires<StreamNetwork> network{this, "the network whose time it is", *clock == "network"};
    Output<double> overruns{
        this, "overruns", {.doc = "steps so far that came after their time", .present = report}};
    Output<double> lateness{
        this,
        "lateness",
        {.unit = unit<"s">, .doc = "how long after its time this step came; 0: in time", .present = report}};

    /// Step k is due at begin + k interval.
    struct Schedule {
        double begin = 0, worst = 0, seen = 0; ///< s; the newest time
        std::int64_t next = 0, steps = 0, overruns = 0;
        char told[160] = "";
    };
    OutsideState<Schedule> schedule{this, [] { return std::make_shared<Schedule>(); }};

    void start(Now at) const override {
        at[schedule] = {};
        if (*interval == 0 && at.period() == 0)
            throw std::runtime_error(
                "argument 'interval' is 0, but the block has no sample time; give one of both");
    }
    Status output(Now at, Out out) const noexcept override {
        Schedule& s = at[schedule];
        const double T = *interval > 0 ? *interval : at.period();
        if (s.steps == 0) {
            await_time(at);
            s.begin = s.seen = time(at);
        }
        const double due = s.begin + static_cast<double>(s.next) * T, late = time(at) - due;
        const bool is_late = s.steps > 0 && late > resolution;
        if (is_late) {
            ++s.overruns;
            s.worst = std::max(s.worst, late);
            if (skip) s.next += static_cast<std::int64_t>(late / T);
        }
        if (const Status waited = wait_until(at, due); !waited) return waited;
        ++s.next;
        ++s.steps;
        if (report) {
            out[overruns] = static_cast<double>(s.overruns);
            out[lateness] = is_late ? late : 0;
        }
        return ok;
    }
    void stop(Now at) const noexcept override {
        const Schedule& s = at[schedule];
        if (s.overruns == 0) return;
        try {
            bfWarning << "RealTimeSynchronizer: " << s.overruns << " of " << s.steps
                      << " steps came after their time, the worst " << s.worst << " s; lengthen the interval";
        } catch (...) { // the run ends all the same
        }
    }

  private:
    static constexpr double resolution = 1e-9; ///< of clocks, s

    /// A simulator that runs already tells no time that steps would be late for.
    void await_time(Now at) const noexcept {
        if (network.index() < 0) return;
        for (int ms = 0; !at[network].has_time() && !is_interrupted(); ++ms) {
            if (ms == 500) tell_wait("the simulated time of the network, which nobody has told yet");
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    /// In parts, so that somebody can interrupt it, and as a simulated time may take any time or stand still.
    Status wait_until(Now at, double due) const noexcept {
        Schedule& s = at[schedule];
        bool is_told = false;
        for (double moved = system_time();;) {
            if (is_interrupted()) return Status::failure(interrupted);
            const double now = time(at), before = std::exchange(s.seen, now), left = due - now;
            if (now < before - resolution) {
                std::snprintf(s.told, sizeof s.told,
                              "the time of the network went back from t = %.9g s to t = %.9g s, as where a "
                              "simulator begins again; start this run anew",
                              before, now);
                return Status::failure(s.told);
            }
            if (!(left > 0)) return ok;
            if (now > before) moved = system_time();
            if (!is_told && system_time() - moved > 0.5) {
                is_told = true;
                std::snprintf(s.told, sizeof s.told,
                              "the simulated time of the network, which stands still at t = %.9g s", now);
                tell_wait(s.told);
            }
            sleep(std::min(left, network.index() >= 0 ? 1e-3 : 0.1));
        }
    }
    double time(Now at) const noexcept { return network.index() >= 0 ? at[network].now() : system_time(); }
};

class SimulatorSynchronizer final : public Block {
  public:
    explicit SimulatorSynchronizer(const Arguments& arguments) : Block(arguments) {
        if (auto wrong = wrong_interval(interval); !wrong.empty()) problem(std::move(wrong));
    }
    Argument<double> interval{this,
                              "interval",
                              {.initial = 0,
                               .minimum = 0,
                               .maximum = longest_interval,
                               .doc = "of simulated time, s; 0: the block's sample time"}};
    Argument<std::string> server{
        this, "server", {.initial = "/clock/rpc", .doc = "name under which the simulator is stepped"}};
    Argument<std::string> client{
        this,
        "client",
        {.initial = "/WBT_synchronizer/rpc:o", .doc = "own name, for networks whose connections have two"}};
    Argument<double> timeout{
        this, "timeout", {.initial = 5, .above = 0, .doc = "until the simulator answers at the start, s"}};

    Requires<StreamNetwork> network{this, "the network of the simulator"};
    struct Session {
        std::shared_ptr<SimulatorConnection> simulator;
        int steps = 1;
        bool is_paused = false;
    };
    OutsideState<Session> session{this, [] { return std::make_shared<Session>(); }};

    void start(Now at) const override {
        const double T = *interval > 0 ? *interval : at.period();
        if (!(T > 0))
            throw std::runtime_error(
                "argument 'interval' is 0, but the block has no sample time; give one of both");
        Session& s = at[session];
        s = {};
        try {
            s.simulator = at[network].open_simulator(*server, *client, timeout);
        } catch (const std::runtime_error&) {
            if (is_interrupted()) return; // the first step tells
            throw;
        }
        const double ratio = T / s.simulator->step_size();
        if (!(ratio > 0.5 && ratio < 1e9))
            throw std::runtime_error("an interval of " + Value(T).describe() +
                                     " s is no number of steps of " +
                                     Value(s.simulator->step_size()).describe() + " s of the simulator");
        s.steps = static_cast<int>(std::lround(ratio));
        if (std::abs(ratio - s.steps) > 1e-6 * ratio)
            bfWarning << "SimulatorSynchronizer: an interval of " << T << " s is " << ratio
                      << " steps of the simulator; it runs " << s.steps;
    }
    Status output(Now at, Out) const noexcept override {
        Session& s = at[session];
        if (!s.simulator) return Status::failure(interrupted);
        if (!s.is_paused && !s.simulator->pause())
            return is_interrupted()
                       ? Status::failure(interrupted)
                       : Status::failure("the simulator did not pause; look whether it still runs");
        s.is_paused = true;
        if (s.simulator->step(s.steps)) return ok;
        if (is_interrupted()) return Status::failure(interrupted);
        return Status::failure("the simulator did not do its steps; look whether it still runs");
    }
    void stop(Now at) const noexcept override {
        Session& s = at[session];
        if (s.simulator && s.is_paused) s.simulator->resume();
        s.simulator.reset();
    }
};

class SimulatorClock final : public Block {
  public:
    using Block::Block;
    Argument<std::string> server{
        this, "server", {.initial = "/clock/rpc", .doc = "name under which others step this model"}};
    Argument<double> timeout{
        this,
        "timeout",
        {.initial = 60, .above = 0, .doc = "how long a paused step waits before the run ends, s"}};
    Requires<StreamNetwork> network{this, "the network of those who step"};
    OutsideState<Opened<bf::toolbox::SimulatorServer>> end{
        this, [] { return std::make_shared<Opened<bf::toolbox::SimulatorServer>>(); }};

    void start(Now at) const override {
        if (at.period() == 0)
            throw std::runtime_error(
                "the block has no sample time, and a simulator needs one; put it among discrete blocks");
        at[end].end = at[network].serve_simulator(*server, at.period());
    }
    void stop(Now at) const noexcept override { at[end].end.reset(); }
    Status output(Now at, Out) const noexcept override {
        if (at[end].end->next(timeout)) return ok;
        if (is_interrupted()) return Status::failure(interrupted);
        return Status::failure("nobody stepped the paused simulator within the timeout; look at its client");
    }
};

} // namespace

void add_streams(Library& library) {
    library.group("streams")
        .add<LocalStreams>("LocalStreams",
                           "Streams among the programs of one user on this computer, through shared memory, "
                           "for the blocks in its subsystem and below. Blocks of another plugin may provide "
                           "those of a middleware instead. It has no ports. Its time is that of the system, "
                           "s since 1970. Errors: two networks in one subsystem.")
        .add<StreamRead>("StreamRead",
                         "Newest message of a stream, of which messages in between are lost; without a new "
                         "one, the last. Messages of before the start do not count. Errors: nobody sends, "
                         "with autoconnect and error_on_missing; in a step: a message of another size or "
                         "with a number that is not finite, and with wait_for_data none within the timeout.")
        .add<StreamWrite>(
            "StreamWrite",
            "Sends its input as a message in each step. A stream has one writer and any number of readers. "
            "Errors: another writer of the stream, but over ROS 2; nobody receives, with autoconnect and "
            "error_on_missing.")
        .add<NetworkClock>("NetworkClock",
                           "Time of the stream network around: that of the system, or the simulated one of a "
                           "middleware.")
        .add<RealTimeSynchronizer>(
            "RealTimeSynchronizer",
            "Holds each step until its time: step k is not done before that of the first one + k interval. A "
            "step that comes later is an overrun; they are counted, and told when the run ends. A simulated "
            "time that stands still is waited for, and that is told. `bf run --realtime` does the same for "
            "whole models, with more to say. Errors: neither an interval nor a sample time; the time of the "
            "network goes back.")
        .add<SimulatorSynchronizer>(
            "SimulatorSynchronizer",
            "Steps a simulator of another program by its interval in each step, and waits until that is "
            "done. The number of steps is the interval over the simulator's step, rounded, with a warning "
            "where it is no integer. The simulator is paused with the first step and goes on freely after "
            "the last one. Errors: no simulator answers; an interval below half a step of the simulator; in "
            "a step: a simulator that has ended.")
        .add<SimulatorClock>(
            "SimulatorClock",
            "Makes this model a simulator that a SimulatorSynchronizer of another program pauses and steps. "
            "Before that it runs freely, and again when the other program is gone. Where it stands in the "
            "order of the document, the model waits: behind what sends the state, and before what receives "
            "commands. Errors: no sample time; another simulator of that name; in a step: a pause that is "
            "longer than the timeout.");
}

} // namespace bf::toolbox
