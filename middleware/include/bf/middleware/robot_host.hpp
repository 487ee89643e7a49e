// A robot that this program serves to others.
#pragma once

#include "bf/middleware/exchange.hpp"
#include "bf/middleware/robot_frames.hpp"

#include <array>
#include <atomic>
#include <functional>
#include <string>
#include <vector>

namespace bf::middleware {

/// What carries states and commands on the side of the server, as RobotLink does on the other.
class RobotEnd {
  public:
    virtual ~RobotEnd() = default;

    /// Shows the robot to others. Throws std::runtime_error, e.g. where somebody else serves one of that
    /// name.
    virtual void start(const RobotDescription& description) = 0;
    virtual void show_state(const double* state, double time) noexcept = 0;
    virtual void show_gains(const double* gains) noexcept = 0;
    /// Copies the newest command or settings that were not taken yet; the stamp's time is when it was written
    /// or came, by now() of bf/middleware/clock.hpp. False: there are none.
    virtual bool take_command(double* command, Stamp& stamp) noexcept = 0;
    virtual bool take_settings(double* settings) noexcept = 0;
    /// Waits until there is a command to take, at most `timeout` s and until is_interrupted().
    virtual void wait(double timeout) noexcept = 0;
    /// Is the controller known to be gone?
    virtual bool is_gone() noexcept = 0;
    /// From now on others may ask for the robot as it began: does somebody? He is answered by reset(), which
    /// is called when it will be so in the next step.
    virtual void allow_reset() noexcept {}
    virtual bool wants_reset() const noexcept { return false; }
    virtual void reset() noexcept {}
    virtual Counts counts() const noexcept { return {}; }
    /// What nobody was told yet of those who command it, as a sentence; empty: nothing.
    virtual std::string take_news() { return ""; }
    /// Does another program show a robot of the same name, where nobody can be kept from it?
    virtual bool has_double() const noexcept { return false; }
    /// How users call it, such as "robot 'icub' in shared memory".
    virtual const std::string& name() const noexcept = 0;
};

/// What the joints do when their controller is gone. Before the first one comes they stay where they are.
enum class OnLoss {
    hold, ///< stay where they are, in the mode position, or position direct
    limp, ///< torques of zero
};

struct HostOptions {
    /// The robot's time stands still until a controller says how far it may go; otherwise it runs by a clock.
    bool waits = true;
    bool is_once = false; ///< it waits for the first controller alone, not for one after it
    /// s without a command until the joints are taken back, where it does not wait; 0: never
    double watchdog = 0.2;
    /// s without references until joints that live from them, all but those in the modes of positions, wait
    /// for the next ones as after a loss, where it does not wait; 0: never
    double idle_after = 0;
    OnLoss on_loss = OnLoss::hold;
    /// Asked about twenty times a second while it waits for a controller; false ends the wait.
    std::function<bool()> goes_on = nullptr;
};

/// Serves a running robot, step by step. A controller is whoever sends commands; there is one at a time. When
/// it ends, is killed or falls silent, the joints are taken back: gains and motor parameters as they were
/// before it came, and the mode of OnLoss. One that goes on, but gives no references where joints live from
/// them, as the part of its diagram that commands is not enabled, keeps the robot, whose joints are in the
/// mode of OnLoss until references come again.
class RobotHost {
  public:
    /// All outlive the host.
    RobotHost(std::string name, const toolbox::RobotDevice& device, toolbox::RobotConnection& robot,
              RobotEnd& end, const HostOptions& options);

    /// Shows the robot, which has started, to others. Throws what RobotEnd::start throws.
    void start(double period);
    /// Between the outputs and the updates of a step at that time of the robot: shows its state.
    void show(double time) noexcept;
    /// Then waits where it waits, and gives the robot what the controller commands. Allocates nothing.
    void step() noexcept;
    /// While the model waits in the step of another of its robots: sees whether the controller ends.
    void heed() noexcept;
    /// Takes the joints back.
    void stop() noexcept;
    /// Takes the joints back from a robot that will be as it began in the next step.
    void reset() noexcept;

    /// What happened since the last call, for people, oldest first; from any one thread.
    enum class Event : std::uint8_t { came, left, died, silent, refused, idle };
    bool take_event(Event& event) noexcept;
    /// How many controllers have gone, however they did.
    int gone() const noexcept { return gone_.load(std::memory_order_relaxed); }

  private:
    void show_gains() noexcept;
    bool has_all() noexcept;
    void lose() noexcept;
    void take() noexcept;
    bool may_go() const noexcept;
    bool take_settings() noexcept;
    void obey() noexcept;
    void obey_settings() noexcept;
    void refuse(Refusal what) noexcept;
    void let_go(Event why) noexcept;
    void take_joints(OnLoss how) noexcept;
    bool set_mode() noexcept;
    void suspend() noexcept;
    void tell(Event event) noexcept;

    struct Loops {
        explicit Loops(Eigen::Index n) : position(n), torque(n), motors(n) {}
        toolbox::Gains position, torque;
        toolbox::MotorParameters motors;
    };
    void read(Loops& loops) noexcept;

    const toolbox::RobotDevice& device_;
    toolbox::RobotConnection& robot_;
    RobotEnd& end_;
    const HostOptions options_;
    RobotDescription description_;
    RobotLayout at_{description_};
    std::vector<double> state_, command_, settings_, gains_;
    Eigen::VectorXd values_, wrench_, imu_;
    Loops loops_{0}, before_{0};            ///< as they are; as they were before the controller came
    double session_ = 0;                    ///< of the controller
    double last_session_ = 0;               ///< of the one before, whose commands are not obeyed any more
    double heard_ = 0;                      ///< when the last command was given, s
    double referred_ = 0;                   ///< when the last mode or references were, s
    double modes_set_ = 0, references_ = 0; ///< how many of those that it asked for were done
    bool is_leaving_ = false;               ///< it has said farewell, behind what is still to be done
    bool is_suspended_ = false;             ///< no references came, and the robot is in another mode
    bool is_changed_ = false;               ///< loops are not those of before
    bool are_new_ = false;                  ///< settings, which nobody has obeyed
    std::array<std::atomic<Event>, 64> events_{};
    std::atomic<unsigned> told_{0}, seen_{0};
    std::atomic<int> gone_{0};
};

} // namespace bf::middleware
