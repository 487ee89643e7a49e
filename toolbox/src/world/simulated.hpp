// Robots of physics worlds, as robots that can be connected to.
#pragma once

#include "bf/core/block.hpp"
#include "bf/physics/scene.hpp"
#include "bf/toolbox/robot_device.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace bf::toolbox {

/// A running robot of a scene: its measurements, its loops and motors.
class SimulatedConnection : public RobotConnection {
  public:
    /// `wrenches` are the names of its force/torque sensors.
    SimulatedConnection(int robot, std::vector<std::string> wrenches)
        : robot_(robot), wrenches_(std::move(wrenches)) {}
    /// The scene, which outlives this. Before, all calls fail.
    void bind(physics::SceneSimulation& scene) { scene_ = &scene; }

    bool read(Measurement what, Eigen::Ref<Vector> values) noexcept override;
    bool read(Sensor kind, const std::string& name, Eigen::Ref<Vector> values) noexcept override;
    bool read(Limits which, Eigen::Ref<Vector> minimum, Eigen::Ref<Vector> maximum) noexcept override;
    std::vector<std::string> sensors(Sensor kind) const override;
    bool set_mode(ControlMode mode) noexcept override;
    int joint_in_other_mode(ControlMode mode) noexcept override;
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override;
    bool write(ControlMode mode, const Eigen::Ref<const Vector>& references) noexcept override;
    bool read_gains(Loop loop, Gains& gains) noexcept override;
    bool write_gains(Loop loop, const Gains& gains) noexcept override;
    bool read_motor_parameters(MotorParameters& parameters) noexcept override;
    bool write_motor_parameters(const MotorParameters& parameters) noexcept override;
    bool can_save() const override { return true; }
    const ErrorText& error() const noexcept override {
        static constexpr ErrorText text = "the world's blocks have not started";
        return text;
    }

  private:
    /// f(control), if there is one.
    template <class F> bool with_control(F&& f) noexcept;

    const int robot_;
    const std::vector<std::string> wrenches_;
    physics::SceneSimulation* scene_ = nullptr;
};

/// Warns of a saved state that is of another world than the one that `describes` it now.
void warn_of_another_world(const physics::SceneSimulation& simulation, const double* state,
                           const std::string& describes);

/// What a block says of a step of a scene that failed.
Status failed_step(const physics::Failure& failure);

/// What every robot of a scene is: it has all modes, measurements, gains and parameters. `Base` is
/// RobotDevice or derived from it. `sensors` are its force/torque sensors as they were named, `place` says
/// where.
template <class Base> class SimulatedAs : public Base {
  public:
    SimulatedAs(std::shared_ptr<const physics::Scene> scene, int robot, std::vector<std::string> sensors,
                const char* place)
        : scene_(std::move(scene)), robot_(robot), sensors_(std::move(sensors)), place_(place) {}

    const std::vector<std::string>& joint_names() const override { return scene_->joint_names(robot_); }
    void check_sensor(Sensor kind, const std::string& name) const override;
    void check_gains(Loop) const override {}
    void check_motor_parameters() const override {}
    bool is_prismatic(int joint) const override { return scene_->is_prismatic(robot_, joint); }

  protected:
    const std::shared_ptr<const physics::Scene> scene_;
    const int robot_;
    const std::vector<std::string> sensors_;

  private:
    const char* const place_;
};

/// RobotDevice::check_sensor of a robot with one inertial sensor, on `imu`, and force/torque sensors. `place`
/// says where sensors are named.
void check_simulated_sensor(Sensor kind, const std::string& name, const std::string& imu,
                            const std::vector<std::string>& sensors, const std::string& place);

template <class Base> void SimulatedAs<Base>::check_sensor(Sensor kind, const std::string& name) const {
    const auto& options = scene_->options().robots[static_cast<std::size_t>(robot_)].options;
    check_simulated_sensor(kind, name, options.imu_frame, sensors_, place_);
}

} // namespace bf::toolbox
