// Robots as blocks see them: a description that model blocks compute with, and a device that measures and
// actuates, whatever middleware is behind it.
#pragma once

#include "bf/dynamics/data.hpp"
#include "bf/dynamics/model.hpp"
#include "bf/physics/joint_control.hpp"

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf::toolbox {

/// The description of a robot: URDF, joint list, gravity. Resource of every model block around it. All of
/// them share one workspace in a running diagram, so that nothing is computed twice for the same state.
struct RobotConfiguration {
    static constexpr const char* resource = "robot configuration";
    struct Live {
        static constexpr bool is_cache = true;
        const dynamics::Model& model;
        dynamics::Data data{model};
    };
    dynamics::Model model;
    std::filesystem::path urdf;
    std::vector<std::filesystem::path> search_directories; ///< where meshes and other robots are looked for

    std::shared_ptr<Live> open() const { return std::shared_ptr<Live>(new Live{model}); }
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
    /// Latest reading of a sensor, by its index in RobotDevice::sensor_index.
    virtual bool read(Sensor kind, int index, Eigen::Ref<Eigen::VectorXd> values) noexcept = 0;
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
    /// Why the last call failed.
    virtual const char* error() const noexcept = 0;

    /// A simulated robot is saved and restored with its world; a real one refuses.
    virtual bool can_save() const { return false; }
    virtual int state_size() const { return 0; }
    virtual void save(double*) const {}
    virtual void restore(const double*) {}
};

/// A robot that can be connected to. Resource of the blocks that measure and actuate: which middleware is
/// behind it they do not know.
class RobotDevice {
  public:
    static constexpr const char* resource = "robot";
    using Live = RobotConnection;

    virtual ~RobotDevice() = default;
    virtual const std::vector<std::string>& joint_names() const = 0;
    /// The same for all devices that are the same robot: of what blocks set of it, they claim it.
    virtual const void* identity() const { return this; }
    int joints() const { return static_cast<int>(joint_names().size()); }
    /// Limits of the control boards (n), infinite where there are none.
    virtual void limits(Limits which, Eigen::VectorXd& minimum, Eigen::VectorXd& maximum) const = 0;
    /// Index of a sensor; throws std::runtime_error that names the sensors there are.
    virtual int sensor_index(Sensor kind, const std::string& name) const = 0;
    /// Throws std::runtime_error when the robot cannot be driven that way.
    virtual void check_mode(ControlMode mode) const = 0;
    virtual void check_measurement(Measurement what) const = 0;
    /// Throws std::runtime_error when the robot has no such gains or parameters.
    virtual void check_gains(Loop) const {
        throw std::runtime_error("this robot tells no gains of its low level; leave the block out");
    }
    virtual void check_motor_parameters() const {
        throw std::runtime_error("this robot tells no parameters of its motors; leave the block out");
    }
    virtual std::shared_ptr<Live> open() const = 0;
};

} // namespace bf::toolbox
