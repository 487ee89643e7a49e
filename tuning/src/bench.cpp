#include "bf/tuning/bench.hpp"

#include <stdexcept>
#include <utility>

namespace bf::tuning {

using physics::ControlMode;
using physics::Gains;

void Bench::begin(const Gains& gains, const Eigen::VectorXd& holding) {
    reset();
    references_ = s();
    for (Eigen::Index i = 0; i < references_.size(); ++i)
        if (gains.I[i] == 0 && gains.P[i] > 0) references_[i] += holding[i] / gains.P[i];
    control().set_mode(ControlMode::position_direct, s());
    control().set_gains(physics::Loop::position, gains);
    control().preload(holding);
    control().set_reference(references_);
}

void Bench::command(const Eigen::VectorXd& references) {
    references_ = references;
    control().set_reference(references);
}

void Bench::step() {
    if (!advance()) throw std::runtime_error(error());
}

namespace {

/// The robot alone, exact and held, which starts at the pose, where there is one.
void leave_alone(physics::PhysicsOptions& world, physics::RobotOptions& options,
                 const std::vector<double>& pose) {
    world.floor.enabled = false;
    options.floating_base = false;
    options.noise = {};
    options.imperfections = {};
    if (pose.empty()) return;
    if (pose.size() != options.joints.size())
        throw std::runtime_error("the pose has " + std::to_string(pose.size()) +
                                 " positions, but the robot has " + std::to_string(options.joints.size()) +
                                 " joints");
    options.initial_joints = pose;
}

/// A pose is meant to leave what stands still where it is; a world places its base link.
void require_standing(bool moves, const std::string& base_link) {
    if (moves)
        throw std::runtime_error("no pose can be chosen, as the base link '" + base_link +
                                 "' moves with the joints; make the link that stands still the base link");
}

/// Do torques move the base link?
bool moves_base(physics::SceneSimulation& simulation) {
    const Eigen::Matrix4d start = simulation.w_H_b(0);
    simulation.set_torque(0, std::vector<double>(simulation.scene().joint_names(0).size(), 1.0));
    return !simulation.step(10) || simulation.w_H_b(0) != start;
}

class SceneBench final : public Bench {
  public:
    SceneBench(std::shared_ptr<const physics::Scene> scene, Gains safe, bool is_held)
        : simulation_(std::move(scene)), given_(simulation_.control(0).motors().position),
          safe_(std::move(safe)), is_held_(is_held) {}

    const std::vector<std::string>& joints() const override { return simulation_.scene().joint_names(0); }
    const Eigen::VectorXd& effort_limits() const override { return simulation_.scene().effort_limits(0); }
    const Eigen::VectorXd& lower_limits() const override { return simulation_.scene().lower_limits(0); }
    const Eigen::VectorXd& upper_limits() const override { return simulation_.scene().upper_limits(0); }
    const Gains& given() const override { return given_; }
    const Gains& safe() const override { return safe_; }
    double period() const override { return simulation_.scene().options().time_step; }
    double loop_period() const override {
        const double own = simulation_.scene().options().robots[0].loop_period;
        return own > 0 ? own : period();
    }
    bool is_held() const override { return is_held_; }
    Eigen::Map<const Eigen::VectorXd> s() const override { return simulation_.s(0); }
    Eigen::Map<const Eigen::VectorXd> s_dot() const override { return simulation_.s_dot(0); }
    Eigen::Map<const Eigen::VectorXd> s_ddot() const override { return simulation_.s_ddot(0); }
    Eigen::Map<const Eigen::VectorXd> tau() const override { return simulation_.tau(0); }

  private:
    void reset() override { simulation_.reset(); }
    physics::JointControl& control() override { return simulation_.control(0); }
    bool advance() override { return simulation_.step(); }
    const char* error() const override { return simulation_.error(); }

    physics::SceneSimulation simulation_;
    const Gains given_, safe_;
    const bool is_held_;
};

} // namespace

std::unique_ptr<Bench> bench_of(const physics::World& world, double period, const std::vector<double>& pose) {
    physics::WorldOptions options = world.options();
    const bool is_held = options.floating_base;
    if (is_held) {
        // The world lives longer than this function.
        const physics::Simulation start(
            std::shared_ptr<const physics::World>(std::shared_ptr<void>(), &world));
        options.initial_w_H_b = start.w_H_b();
    }
    options.time_step = period;
    options.feet.clear();
    leave_alone(options, options, pose);
    physics::WorldOptions with_safe_gains = options;
    with_safe_gains.motors.position_gains.resize(0, 0);
    const auto alone = physics::World(std::move(options)).scene();
    physics::SceneSimulation safe(physics::World(std::move(with_safe_gains)).scene());
    if (!pose.empty()) require_standing(moves_base(safe), world.base_link());
    return std::make_unique<SceneBench>(alone, safe.control(0).motors().position, is_held);
}

std::unique_ptr<Bench> bench_of(const physics::Scene& scene, int robot, const std::vector<double>& pose) {
    physics::SceneOptions options = scene.options();
    options.robots = {options.robots.at(static_cast<std::size_t>(robot))};
    options.objects.clear();
    physics::RobotOptions& alone = options.robots[0].options;
    const bool is_mjcf = scene.is_mjcf(robot);
    bool is_held = alone.floating_base && !is_mjcf;
    leave_alone(options, alone, pose);
    const auto with_safe_gains = [&] {
        physics::SceneOptions safe = options;
        safe.robots[0].motors.position_gains.resize(0, 0);
        return physics::SceneSimulation(std::make_shared<const physics::Scene>(std::move(safe)));
    };
    physics::SceneSimulation safe = with_safe_gains();
    bool moves = moves_base(safe);
    if (moves && is_mjcf) {
        options.robots[0].is_held = is_held = true;
        safe = with_safe_gains();
        moves = moves_base(safe);
    }
    if (!pose.empty() && !is_mjcf) require_standing(moves, alone.base_link);
    if (moves && is_mjcf)
        throw std::runtime_error("the base link '" + alone.base_link + "' of robot '" +
                                 options.robots[0].name +
                                 "' moves with its joints; make the link that stands still the base link");
    return std::make_unique<SceneBench>(std::make_shared<const physics::Scene>(std::move(options)),
                                        safe.control(0).motors().position, is_held);
}

} // namespace bf::tuning
