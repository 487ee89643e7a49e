// What a program that serves a robot and one that drives it tell each other, whatever carries it: once a
// description, then vectors of doubles, of which the newest counts.
#pragma once

#include "bf/toolbox/robot_device.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace bf::middleware {

using toolbox::ControlMode;
using toolbox::Limits;
using toolbox::Loop;
using toolbox::Measurement;
using toolbox::Sensor;

inline constexpr int measurement_count = 9, mode_count = 7, wrench_size = 6, imu_size = 12;
/// As users call them, by number.
extern const char* const measurement_names[measurement_count];
extern const char* const mode_names[mode_count];

/// A served robot, as its server tells it to whoever connects.
struct RobotDescription {
    static constexpr int version = 2; ///< of all that this file says

    std::string name;
    int process = 0;     ///< of the server; 0: it is a thread of the controller's own program
    double period = 0;   ///< between two states, s
    bool waits = false;  ///< its time stands still until it is told how far it may go
    double watchdog = 0; ///< after how many s without a command it lets its joints go; 0: never
    std::vector<std::string> joints, wrenches, imus; ///< names; of the sensors, too
    std::uint32_t measurements = 0, modes = 0;       ///< those that it has, a bit each
    bool has_position_gains = false, has_torque_gains = false, has_motor_parameters = false;
    Eigen::VectorXd position_min, position_max, velocity_min, velocity_max; ///< n each

    /// As JSON.
    std::string text() const;
    /// Throws std::runtime_error that says what the text lacks, or which version it is of.
    static RobotDescription read(const std::string& text);
};

/// Where things stand in the four vectors. All numbers are doubles: whole ones are exact up to 2^53.
struct RobotLayout {
    int n = 0, wrenches = 0, imus = 0;

    explicit RobotLayout(const RobotDescription& d)
        : n(static_cast<int>(d.joints.size())), wrenches(static_cast<int>(d.wrenches.size())),
          imus(static_cast<int>(d.imus.size())) {}

    /// From the robot, in each of its steps; behind these the measurements (n each), wrenches and IMUs.
    enum State {
        time,     ///< of the robot, s
        mode,     ///< of the joints, by number; -1: not known
        other,    ///< the first joint that is in another one; -1: none
        owner,    ///< session of the controller that drives it; 0: nobody
        commands, ///< number of the last command that was taken
        settings, ///< number of the last settings that were taken
        refused,  ///< a Refusal, of this controller
        age,      ///< of the measurements, when the state was written, s
        state_head
    };
    int measurement(Measurement what) const { return state_head + static_cast<int>(what) * n; }
    int wrench(int i) const { return state_head + measurement_count * n + wrench_size * i; }
    int imu(int i) const { return wrench(wrenches) + imu_size * i; }
    int state_size() const { return imu(imus); }

    /// From the controller, in each of its steps; behind these n references.
    enum Command {
        session,    ///< a number by which this controller differs from all others; never 0
        number,     ///< of the command, from 1
        until,      ///< to which time a robot that waits may go, s
        mode_count, ///< how often the mode was set so far; 0: the robot is only looked at
        mode_asked, ///< by number
        limit,      ///< RobotConnection::set_trajectory_limit
        references, ///< how often references were given since the mode was set
        given,      ///< number of the last settings that were given before it
        release,    ///< 1: it is the last one
        command_head
    };
    int command_size() const { return command_head + n; }

    /// From the controller when it changes gains, and from the robot when they have changed: three numbers,
    /// then P, I and D of the loops of position and torque, k_tau and k_bemf of the motors (n each).
    enum Settings {
        of,      ///< session of the controller; from the robot: of whom it took the last ones
        count,   ///< of the settings, from 1
        changed, ///< 1 the position loop, 2 the torque loop, 4 motors, added up: since the session began
        settings_head
    };
    int gains(Loop loop) const { return settings_head + (loop == Loop::position ? 0 : 3 * n); }
    int motors() const { return settings_head + 6 * n; }
    int settings_size() const { return settings_head + 8 * n; }
};

/// What a robot did not accept.
enum class Refusal { nothing, mode, references, position_gains, torque_gains, motor_parameters };

/// What went wrong on the way.
struct Counts {
    std::uint64_t received = 0;   ///< messages that came
    std::uint64_t lost = 0;       ///< that did not, yet
    std::uint64_t late = 0;       ///< that came after a newer one
    std::uint64_t duplicates = 0; ///< that came again
    std::uint64_t rejected = 0;   ///< without the key, of another time, protocol or size
};

} // namespace bf::middleware
