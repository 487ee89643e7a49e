// Streams of vectors between programs, their clock, and simulators that other programs step: what blocks know
// of a middleware. Whoever brings one (YARP, ROS 2) provides a StreamNetwork.
#pragma once

#include <Eigen/Core>
#include <cstring>
#include <memory>
#include <string>

namespace bf::toolbox {

// What waits here ends early when bf::is_interrupted(), as if the timeout had come.

/// What belongs to a message.
struct Stamp {
    double count = 0; ///< number of the message, as its sender counts
    double time = 0;  ///< when it was sent, s, by the clock of the network
};

enum class Taken {
    nothing,    ///< no message came since the last one
    message,    ///< the newest one, which others may have come before
    wrong_size, ///< the newest one has another number of elements
    failure,    ///< the connection broke
};

/// The end of a stream that receives. Only the newest message counts; those of before it was opened do not.
/// In a step nothing allocates or locks.
class StreamReader {
  public:
    virtual ~StreamReader() = default;
    /// Takes the newest message that was not taken yet; `values` and `stamp` stay as they are without one.
    virtual Taken take(Eigen::Ref<Eigen::VectorXd> values, Stamp& stamp) noexcept = 0;
    /// Waits, at most `timeout` seconds of the system's clock, until there is a message to take.
    virtual bool wait(double timeout) noexcept = 0;
    /// Is there somebody who sends?
    virtual bool has_writer() const noexcept = 0;
    /// Number of elements of the newest message.
    virtual int received_size() const noexcept = 0;
    /// Where messages come from, such as "UDP from 127.0.0.1:9001", for people; asked when a step has failed.
    using Source = char[200];
    virtual void say_source(Source& text) const noexcept { std::strcpy(text, "another program"); }
};

/// The end of a stream that sends.
class StreamWriter {
  public:
    virtual ~StreamWriter() = default;
    virtual bool write(const Eigen::Ref<const Eigen::VectorXd>& values) noexcept = 0;
    /// Is there somebody who receives?
    virtual bool has_reader() const noexcept = 0;
};

/// A simulator of another program that runs only when it is told to.
class SimulatorConnection {
  public:
    virtual ~SimulatorConnection() = default;
    /// Its time step, s.
    virtual double step_size() const noexcept = 0;
    /// Pauses it, or lets it run freely.
    virtual bool pause() noexcept = 0;
    virtual bool resume() noexcept = 0;
    /// Runs that many steps and returns when they are done.
    virtual bool step(int count) noexcept = 0;
};

/// A simulator as it is told to run.
class SimulatorServer {
  public:
    virtual ~SimulatorServer() = default;
    /// Waits until the next step may be done: at once while nobody has paused it. False after `timeout`
    /// seconds in which nobody said anything.
    virtual bool next(double timeout) noexcept = 0;
};

/// A network in a running diagram. Names are texts such as "/icub/torso/state:o". Whoever opens something
/// gets a std::runtime_error with reason and remedy where that is impossible, but not where there is nobody
/// at the other end yet.
class StreamConnection {
  public:
    virtual ~StreamConnection() = default;
    virtual std::shared_ptr<StreamReader> open_reader(const std::string& name, int size) = 0;
    virtual std::shared_ptr<StreamWriter> open_writer(const std::string& name, int size) = 0;
    /// Asks the simulator of that name for its step size, at most `timeout` seconds.
    virtual std::shared_ptr<SimulatorConnection> open_simulator(const std::string& server,
                                                                const std::string& client,
                                                                double timeout) = 0;
    virtual std::shared_ptr<SimulatorServer> serve_simulator(const std::string& name, double step_size) = 0;
    /// Time of the network, s: that of the system (since 1970) or a simulated one, which is 0 until it is
    /// told.
    virtual double now() const noexcept = 0;
    /// False: its time is a simulated one, and nobody has told it yet.
    virtual bool has_time() const noexcept { return true; }
};

/// A network that can be connected to. Resource of the blocks over streams. What it opens cannot be saved: a
/// replay gives what the blocks gave.
class StreamNetwork {
  public:
    static constexpr const char* resource = "stream network";
    using Live = StreamConnection;
    virtual ~StreamNetwork() = default;
    /// Opens nothing yet.
    virtual std::shared_ptr<Live> open() const = 0;
};

} // namespace bf::toolbox
