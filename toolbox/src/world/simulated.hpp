// What robots in every physics world have in common.
#pragma once

#include "bf/core/block.hpp"
#include "bf/toolbox/robot.hpp"

#include <optional>
#include <string>
#include <vector>

namespace bf::toolbox {

/// A running robot: its measurements, its loops and motors.
class SimulatedConnection : public RobotConnection {
  public:
    bool read(Measurement what, Eigen::Ref<Vector> values) noexcept override;
    bool read(Sensor kind, int index, Eigen::Ref<Vector> values) noexcept override;
    bool set_mode(ControlMode mode) noexcept override;
    int joint_in_other_mode(ControlMode mode) noexcept override;
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override;
    bool write(ControlMode mode, const Eigen::Ref<const Vector>& references) noexcept override;
    bool read_gains(Loop loop, Gains& gains) noexcept override;
    bool write_gains(Loop loop, const Gains& gains) noexcept override;
    bool read_motor_parameters(MotorParameters& parameters) noexcept override;
    bool write_motor_parameters(const MotorParameters& parameters) noexcept override;
    bool can_save() const override { return true; }

  protected:
    /// What the world tells of the robot, as its simulations name it.
    struct View {
        physics::JointControl& control;
        physics::Readings joints, at_loops;
        Eigen::Map<const Vector3> imu_rpy, accelerometer, gyro;
    };
    /// None before the world runs.
    virtual std::optional<View> view() noexcept = 0;
    virtual Eigen::Map<const Vector6> ft_wrench(int i) const noexcept = 0;

  private:
    /// f(control), if there is one.
    template <class F> bool with_control(F&& f) noexcept;
};

/// What every simulated robot has: all modes, measurements, gains and parameters. `Base` is RobotDevice or
/// derived from it.
template <class Base> class WithAllModes : public Base {
  public:
    void check_mode(ControlMode) const override {}
    void check_measurement(Measurement) const override {}
    void check_gains(Loop) const override {}
    void check_motor_parameters() const override {}
};

/// Those of positions are the model's; torque motors have no speed limit of their own.
void simulated_limits(Limits which, const Vector& lower, const Vector& upper, Vector& minimum,
                      Vector& maximum);

/// RobotDevice::sensor_index of a robot with one inertial sensor, on `imu`, and force/torque sensors. `place`
/// says where sensors are named.
int simulated_sensor(Sensor kind, const std::string& name, const std::string& imu,
                     const std::vector<std::string>& sensors, const std::string& place);

} // namespace bf::toolbox
