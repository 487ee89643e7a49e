// A robot on a serial line, which sends a line of its joint positions and velocities as often as it measures,
// and takes lines `torque t1 t2 ...` and `stop`.
#include <bf/core/block.hpp>
#include <bf/core/registry.hpp>
#include <bf/middleware/clock.hpp>
#include <bf/middleware/exchange.hpp>
#include <bf/toolbox/robot_device.hpp>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sstream>
#include <stdexcept>
#include <termios.h>
#include <thread>
#include <unistd.h>

namespace serial {

using namespace bf;
using namespace bf::toolbox;
using middleware::ExchangeBuffer;
using middleware::Stamp;

class Connection final : public RobotConnection {
  public:
    Connection(std::string port, int joints)
        : port_(std::move(port)), n_(joints), states_(2 * joints), torques_(joints), state_(2 * joints) {}
    ~Connection() override { stop(); }

    void start() override {
        stop();
        line_ = open(port_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
        if (line_ < 0) throw std::runtime_error(port_ + ": " + std::strerror(errno) + "; plug the robot in");
        if (termios raw{}; tcgetattr(line_, &raw) == 0) cfmakeraw(&raw), tcsetattr(line_, TCSANOW, &raw);
        goes_on_ = true;
        thread_ = std::thread([this] { talk(); });
        const auto first = states_.newest();
        for (const double end = middleware::now() + 2; states_.newest() == first;) {
            if (middleware::now() > end)
                throw std::runtime_error(port_ + ": no line of " + std::to_string(2 * n_) +
                                         " numbers within 2 s; switch the robot on");
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    void stop() noexcept override {
        if (!thread_.joinable()) return;
        goes_on_ = false;
        thread_.join(); // which says `stop` to the robot
        close(line_);
    }

    // What blocks call in a step: nothing here waits, locks or allocates.
    bool read(Measurement what, Eigen::Ref<Vector> values) noexcept override {
        if (!is_taken_) is_taken_ = states_.read(state_.data(), stamp_); // one state for all of a step
        if (age() > 0.5) return fail("%s: silent for more than 0.5 s", port_.c_str());
        if (what == Measurement::joint_position)
            values = state_.head(n_);
        else if (what == Measurement::joint_velocity)
            values = state_.tail(n_);
        else
            return fail("%s: it measures positions and velocities alone", port_.c_str());
        return true;
    }
    bool read(Sensor, const std::string&, Eigen::Ref<Vector>) noexcept override {
        return fail("%s: it has no sensors beside its joints", port_.c_str());
    }
    bool read(toolbox::Limits, Eigen::Ref<Vector> minimum, Eigen::Ref<Vector> maximum) noexcept override {
        maximum.setConstant(std::numeric_limits<double>::infinity());
        minimum = -maximum;
        return true;
    }
    double age() const noexcept override { return middleware::now() - stamp_.time; }
    bool set_mode(ControlMode) noexcept override { return true; }
    bool write(ControlMode, const Eigen::Ref<const Vector>& torques) noexcept override {
        torques_.write(torques.data(), middleware::now());
        return true;
    }
    const ErrorText& error() const noexcept override { return error_; }
    void next_step() noexcept { is_taken_ = false; }

  private:
    bool fail(const char* format, const char* value) noexcept {
        std::snprintf(error_, sizeof error_, format, value);
        return false;
    }

    /// The thread that waits for the line, and nothing else.
    void talk() {
        std::string text;
        Vector values(2 * n_), torques(n_);
        Stamp sent;
        while (goes_on_) {
            pollfd waits{line_, POLLIN, 0};
            char bytes[256];
            if (poll(&waits, 1, 10) <= 0) continue;
            const auto count = ::read(line_, bytes, sizeof bytes);
            if (count <= 0) break;
            text.append(bytes, static_cast<std::size_t>(count));
            for (std::size_t end; (end = text.find('\n')) != text.npos; text.erase(0, end + 1)) {
                std::istringstream numbers(text.substr(0, end));
                int found = 0;
                for (double x; found < 2 * n_ && numbers >> x;) values[found++] = x;
                if (found == 2 * n_) states_.write(values.data(), middleware::now());
            }
            if (text.size() > 10'000) text.clear(); // noise without an end
            if (torques_.newest() == sent.number || !torques_.read(torques.data(), sent)) continue;
            std::ostringstream line;
            line << "torque";
            for (const double x : torques) line << ' ' << x;
            say(line.str() + "\n");
        }
        say("stop\n");
    }
    /// A robot that does not read for 0.1 s is left, as one that is gone is.
    void say(const std::string& line) noexcept {
        pollfd reads{line_, POLLOUT, 0};
        const auto size = static_cast<ssize_t>(line.size());
        if (poll(&reads, 1, 100) <= 0 || ::write(line_, line.data(), line.size()) < size) goes_on_ = false;
    }

    const std::string port_;
    const int n_;
    ExchangeBuffer states_, torques_;
    Vector state_;
    Stamp stamp_;
    bool is_taken_ = false;
    int line_ = -1;
    std::atomic<bool> goes_on_{false};
    std::thread thread_;
    ErrorText error_ = "";
};

class Device final : public RobotDevice {
  public:
    Device(std::string port, std::vector<std::string> joints)
        : port_(std::move(port)), joints_(std::move(joints)) {}
    const std::vector<std::string>& joint_names() const override { return joints_; }
    void check_mode(ControlMode mode) const override {
        if (mode != ControlMode::torque)
            throw std::runtime_error("this robot takes torques alone; give control_type: Torque");
    }
    std::shared_ptr<RobotConnection> open() const override {
        return std::make_shared<Connection>(port_, joints());
    }

  private:
    const std::string port_;
    const std::vector<std::string> joints_;
};

class Robot final : public Block {
  public:
    using Block::Block;
    Argument<std::string> port{this, "port", {.initial = "/dev/ttyUSB0", .doc = "the serial line"}};
    Argument<std::vector<std::string>> joints{this, "joints", {.doc = "names of its joints"}};
    Provides<RobotDevice> device{this, [this] { return std::make_shared<Device>(port, joints); }};

    void start(Now at) const override { at[device].start(); }
    void stop(Now at) const noexcept override { at[device].stop(); }
    Status update(Now at, Next) const noexcept override {
        static_cast<Connection&>(at[device]).next_step();
        return ok;
    }
};

} // namespace serial

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("robot").add<serial::Robot>("Robot", "A robot on a serial line, driven by torques.");
}
