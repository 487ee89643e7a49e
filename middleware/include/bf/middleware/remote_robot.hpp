// A robot that another program serves, as a robot that blocks measure and actuate.
#pragma once

#include "bf/core/block.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/robot_frames.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bf::middleware {

/// What carries states and commands: all that differs between one middleware and another. One thread uses it.
/// What is noexcept is called in steps: it allocates and locks nothing, and does not wait, but for wait().
class RobotLink {
  public:
    virtual ~RobotLink() = default;

    /// Finds the robot, for which it waits at most `timeout` s and until is_interrupted(). Throws
    /// std::runtime_error that says who was waited for and how he is started, or who drives the robot
    /// already.
    virtual RobotDescription start(double timeout) = 0;
    /// Lets it go, after the last command.
    virtual void stop() noexcept = 0;

    /// Copies the newest state or gains that were not taken yet; the stamp's time is when they were written
    /// or came, by now() of bf/middleware/clock.hpp. False: there are none.
    virtual bool take_state(double* state, Stamp& stamp) noexcept = 0;
    virtual bool take_gains(double* gains) noexcept = 0;
    virtual void send_command(const double* command) noexcept = 0;
    virtual void send_settings(const double* settings) noexcept = 0;
    /// Waits until there is a state to take, at most `timeout` s and until is_interrupted().
    virtual void wait(double timeout) noexcept = 0;
    /// Is the server known to be gone? And why that is thought, such as "has ended".
    virtual bool is_gone() noexcept = 0;
    virtual const char* how_gone() const noexcept { return "has ended"; }
    /// How many numbers the newest state had, where that is not the size which the server has described; -1:
    /// it had that.
    virtual int wrong_size() const noexcept { return -1; }
    /// The diagram has blocks that command it. Called before start().
    virtual void expect_commands() noexcept {}
    /// Completes a sentence that says that no new state has come: why what came is none; the empty text:
    /// nothing did. Asked when a run has failed.
    virtual void say_left_out(toolbox::RobotConnection::ErrorText& text) const noexcept { text[0] = '\0'; }
    /// Why the robot has refused what it was told; the empty text: it does not say.
    virtual void say_refusal(toolbox::RobotConnection::ErrorText& text) const noexcept { text[0] = '\0'; }
    virtual Counts counts() const noexcept { return {}; }
    /// How users call it, such as "robot 'icub' in shared memory".
    virtual const std::string& name() const noexcept = 0;
};

/// How a diagram runs with a robot.
struct RemoteOptions {
    std::vector<std::string> joints; ///< in the order of the diagram's vectors
    bool follows = true;             ///< steps wait for the robot's time; otherwise our clock drives the loop
    double timeout = 1;              ///< s without a new state until a step fails
    double start_timeout = 10;       ///< s until the start fails without a robot
};

/// A running connection over a link. Between begin_step and end_step nothing changes of what is read.
class RemoteConnection final : public toolbox::RobotConnection {
  public:
    RemoteConnection(std::unique_ptr<RobotLink> link, const RemoteOptions& options);
    ~RemoteConnection() override;

    /// How often steps come, s. To be said before start().
    void set_period(double period) { period_ = period; }
    void start() override;
    void stop() noexcept override;

    /// The state of this step: the first who reads in a step calls it, whoever that is. False: error() says
    /// why.
    bool begin_step() noexcept;
    /// Sends the commands of this step.
    void end_step() noexcept;

    double time() const noexcept { return state_[RobotLayout::time]; } ///< of the robot, s
    /// By how much the robot's clock is ahead of the steps since both began, s.
    double drift() const noexcept {
        const double drift = time() - begin_ - static_cast<double>(steps_) * period_;
        const double roundoff = 4 * std::numeric_limits<double>::epsilon() * std::abs(time());
        return std::abs(drift) < 1e-9 * period_ + roundoff ? 0 : drift;
    }
    Counts counts() const noexcept { return link_->counts(); }

    bool read(Measurement what, Eigen::Ref<Eigen::VectorXd> values) noexcept override;
    bool read(Sensor kind, const std::string& name, Eigen::Ref<Eigen::VectorXd> values) noexcept override;
    bool read(Limits which, Eigen::Ref<Eigen::VectorXd> minimum,
              Eigen::Ref<Eigen::VectorXd> maximum) noexcept override;
    double age() const noexcept override;
    std::vector<std::string> sensors(Sensor kind) const override;
    bool set_mode(ControlMode mode) noexcept override;
    int joint_in_other_mode(ControlMode mode) noexcept override;
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override;
    bool write(ControlMode mode, const Eigen::Ref<const Eigen::VectorXd>& references) noexcept override;
    bool read_gains(Loop loop, toolbox::Gains& gains) noexcept override;
    bool write_gains(Loop loop, const toolbox::Gains& gains) noexcept override;
    bool read_motor_parameters(toolbox::MotorParameters& parameters) noexcept override;
    bool write_motor_parameters(const toolbox::MotorParameters& parameters) noexcept override;
    const ErrorText& error() const noexcept override { return error_; }

  private:
    bool refresh() noexcept;
    bool take() noexcept;
    bool is_fitting() noexcept;
    /// For how long nothing has come that is awaited, s.
    double silence() const noexcept;
    bool is_still_ours() noexcept;
    bool take_gains() noexcept;
    bool send_settings(double which) noexcept;
    template <class... Values> bool fail(const char* format, Values... values) noexcept;
    /// values[i] = what of the robot's joint that is our joint i.
    void from_robot(const double* what, Eigen::Ref<Eigen::VectorXd> values) const noexcept;
    void to_robot(const Eigen::Ref<const Eigen::VectorXd>& values, double* what) const noexcept;

    const std::unique_ptr<RobotLink> link_;
    const RemoteOptions options_;
    RobotDescription robot_;
    std::string server_; ///< how messages call who serves it
    RobotLayout at_{robot_};
    std::vector<int> theirs_; ///< number of our joint i at the robot
    std::vector<double> state_, command_, settings_, gains_;
    std::vector<double> sent_;         ///< the command of the last step that has ended
    double period_ = 0, begin_ = 0;    ///< s; of the robot's clock when we began
    double came_ = 0;                  ///< when the newest state was written, s
    double asked_ = 0;                 ///< when the first command after it was sent, s; 0: none was
    std::int64_t steps_ = 0;           ///< since we began
    double mode_command_ = 0;          ///< number of the command that set the mode
    std::optional<double> back_from_;  ///< newest time of the robot before its clock went back, s
    std::optional<double> ahead_from_; ///< the same before it jumped ahead
    bool is_open_ = false, is_begun_ = false, is_good_ = false, is_driven_ = false, has_come_ = false;
    ErrorText error_ = "the robot's block has not started";
};

/// A block that provides a robot of another program. Middlewares derive theirs, which name the robot and make
/// links.
class RemoteRobot : public Block {
  public:
    explicit RemoteRobot(const Arguments& arguments);

    Argument<std::vector<std::string>> joints;
    Argument<std::string> clock;
    Argument<double> timeout, start_timeout;
    Requires<toolbox::ControlledJoints> controlled;
    Provides<toolbox::RobotDevice> device;
    Dim n;
    Output<Vector> s, s_dot, tau_measured;
    Output<double> time, age, drift, lost, late, duplicates, rejected;
    DiscreteState<double> worst_age, last_drift;

    void start(Now at) const override;
    void stop(Now at) const noexcept override;
    Status output(Now at, Out out) const noexcept override;
    Status update(Now at, Next next) const noexcept override;

  protected:
    /// Nothing is opened yet.
    virtual std::unique_ptr<RobotLink> make_link() const = 0;
    /// Each sensor is to be given as NAME=SOURCE, of which `source` says how it is written, from its first
    /// letter on if that is '/'.
    void require_names_of(const std::vector<std::string>& sensors, const std::string& source);
    const std::vector<std::string>& joint_names() const {
        return joints->empty() ? controlled->names : *joints;
    }

  private:
    class Device;
    RemoteConnection& connection(Now at) const { return static_cast<RemoteConnection&>(at[device]); }
};

} // namespace bf::middleware
