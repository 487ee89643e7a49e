// Robots as blocks see them: a device that measures and actuates, whatever middleware is behind it.
#pragma once

#include "bf/physics/joint_control.hpp"

#include <Eigen/Core>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf::toolbox {

/// The joints that a Configuration names, in the order of all vectors, for those who connect to a robot and
/// compute nothing with its model.
struct ControlledJoints {
    static constexpr const char* resource = "controlled joints";
    struct Live {
        static constexpr bool is_cache = true;
    };
    std::vector<std::string> names;

    std::shared_ptr<Live> open() const { return std::make_shared<Live>(); }
};

/// What joints measure. Motor quantities are on the motor side of the transmission.
enum class Measurement {
    joint_position,     ///< rad
    joint_velocity,     ///< rad/s
    joint_acceleration, ///< rad/s2
    joint_torque,       ///< Nm
    motor_position,     ///< rad
    motor_velocity,     ///< rad/s
    motor_acceleration, ///< rad/s2
    motor_current,      ///< raw
    motor_pwm,          ///< raw
};

using physics::ControlMode;
using physics::Gains;
using physics::Loop;
using physics::MotorParameters;

enum class Limits { position, velocity };

/// Sensors beside the joints.
enum class Sensor {
    wrench, ///< 6: force [N] and moment [Nm] in sensor axes
    imu, ///< 12: roll pitch yaw [rad], acceleration minus gravity [m/s2], angular velocity [rad/s], magnetic
         ///< field
};

/// A running connection to a robot. One thread uses it. In a step nothing allocates, locks or blocks; vectors
/// are in the order of joint_names().
class RobotConnection {
  public:
    virtual ~RobotConnection() = default;

    /// Opens devices; throws std::runtime_error that says what is missing and the remedy.
    virtual void start() {}
    /// Puts actuators back into a safe state (their control mode, reference speeds, gains and motor
    /// parameters are those of before the first call that changed them) and closes devices.
    virtual void stop() noexcept {}

    /// Latest measurement (n). False when the device gave none; error() says why.
    virtual bool read(Measurement what, Eigen::Ref<Eigen::VectorXd> values) noexcept = 0;
    /// Latest reading of a sensor, by its name; an empty name of an inertial sensor is that of the only one.
    virtual bool read(Sensor kind, const std::string& name, Eigen::Ref<Eigen::VectorXd> values) noexcept = 0;
    /// Limits of the control boards (n), infinite where there are none.
    virtual bool read(Limits which, Eigen::Ref<Eigen::VectorXd> minimum,
                      Eigen::Ref<Eigen::VectorXd> maximum) noexcept = 0;
    /// How long ago the joints were measured whose measurements are read now, s.
    virtual double age() const noexcept { return 0; }
    /// The names of its sensors, once it has started; not in a step.
    virtual std::vector<std::string> sensors(Sensor) const { return {}; }
    /// Switches all joints to a mode; called once before the first reference.
    virtual bool set_mode(ControlMode mode) noexcept = 0;
    /// The first joint that is in another mode than this one, e.g. after a fault; -1: none, or it is not
    /// known.
    virtual int joint_in_other_mode(ControlMode) noexcept { return -1; }
    /// Largest speed of trajectories of the mode position (rad/s), or largest acceleration of the mode
    /// velocity (rad/s2), of all joints.
    virtual bool set_trajectory_limit(ControlMode, double) noexcept { return true; }
    /// Sends references (n) in the present mode.
    virtual bool write(ControlMode mode, const Eigen::Ref<const Eigen::VectorXd>& references) noexcept = 0;
    /// Gains of all joints, as large as the caller made them (n).
    virtual bool read_gains(Loop, Gains&) noexcept { return false; }
    virtual bool write_gains(Loop, const Gains&) noexcept { return false; }
    /// Parameters of all motors, as large as the caller made them (n).
    virtual bool read_motor_parameters(MotorParameters&) noexcept { return false; }
    virtual bool write_motor_parameters(const MotorParameters&) noexcept { return false; }
    /// Why the last call failed, with the robot's name, what was expected and what came. It stays as long as
    /// the connection, so that a failure of a step may refer to it.
    using ErrorText = char[256];
    virtual const ErrorText& error() const noexcept = 0;

    /// A simulated robot is saved and restored with its world; a real one refuses.
    virtual bool can_save() const { return false; }
    virtual int state_size() const { return 0; }
    virtual void save(double*) const {}
    virtual void restore(const double*) {}
};

/// A robot that can be connected to, and what is known of it before. Resource of the blocks that measure and
/// actuate: which middleware is behind it they do not know. What only the connected robot can tell, such as
/// the sensors that it has, fails in the first step.
class RobotDevice {
  public:
    static constexpr const char* resource = "robot";
    using Live = RobotConnection;

    virtual ~RobotDevice() = default;
    virtual const std::vector<std::string>& joint_names() const = 0;
    /// The same for all devices that are the same robot: of what blocks set of it, they claim it.
    virtual const void* identity() const { return this; }
    int joints() const { return static_cast<int>(joint_names().size()); }
    /// Throw std::runtime_error when it is known that the robot cannot be driven that way, measures no such
    /// thing, or has no such sensor, gains or parameters.
    virtual void check_mode(ControlMode) const {}
    virtual void check_measurement(Measurement) const {}
    virtual void check_sensor(Sensor, const std::string&) const {}
    virtual void check_gains(Loop) const {
        throw std::runtime_error("this robot tells no gains of its low level; leave the block out");
    }
    virtual void check_motor_parameters() const {
        throw std::runtime_error("this robot tells no parameters of its motors; leave the block out");
    }
    virtual std::shared_ptr<Live> open() const = 0;
    /// Is that joint known to move along its axis, in m, m/s and N in place of rad, rad/s and Nm?
    virtual bool is_prismatic(int /*joint*/) const { return false; }
};

} // namespace bf::toolbox
