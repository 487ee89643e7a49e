// One physics step of a standing iCub, and of two arms that reach for each other, through bf::physics,
// against MuJoCo's own mj_step on the same model.
#include "../physics/src/scene_impl.hpp"
#include "bf/physics/scene.hpp"
#include "bf/physics/world.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace {

using namespace bf::physics;

constexpr int n = 23;

WorldOptions standing_icub() {
    WorldOptions options;
    options.urdf = BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf";
    options.joints = {"torso_pitch",     "torso_roll",     "torso_yaw",   "l_shoulder_pitch",
                      "l_shoulder_roll", "l_shoulder_yaw", "l_elbow",     "r_shoulder_pitch",
                      "r_shoulder_roll", "r_shoulder_yaw", "r_elbow",     "l_hip_pitch",
                      "l_hip_roll",      "l_hip_yaw",      "l_knee",      "l_ankle_pitch",
                      "l_ankle_roll",    "r_hip_pitch",    "r_hip_roll",  "r_hip_yaw",
                      "r_knee",          "r_ankle_pitch",  "r_ankle_roll"};
    options.initial_joints = {0.033,  0,     0,     -0.354, 0.5,   0,      0.801,  -0.354,
                              0.5,    0,     0.801, 0.208,  0.011, -0.002, -0.499, -0.292,
                              -0.012, 0.208, 0.011, -0.002, -0.5,  -0.292, -0.012};
    options.feet = {{"l_sole"}, {"r_sole"}};
    options.ft_sensors = {"l_foot_ft_sensor", "r_foot_ft_sensor"};
    options.imu_frame = "imu_frame";
    options.push_links = {"chest"};
    return options;
}

/// Torque that holds the start posture: torso 300/6, arms 50/2, legs 400/8 (N m/rad, N m s/rad).
double hold(int i, double target, double s, double s_dot) {
    const double kp = i < 3 ? 300 : i < 11 ? 50 : 400;
    const double kd = i < 3 ? 6 : i < 11 ? 2 : 8;
    return kp * (target - s) - kd * s_dot;
}

void step_world(benchmark::State& state) {
    Simulation sim(std::make_shared<const World>(standing_icub()));
    const std::vector<double> target = sim.world().options().initial_joints;
    std::vector<double> tau(n);
    const auto step = [&] {
        const auto s = sim.s();
        const auto s_dot = sim.s_dot();
        for (int i = 0; i < n; ++i) tau[i] = hold(i, target[i], s[i], s_dot[i]);
        return sim.step(tau);
    };
    for (int k = 0; k < 2000; ++k) step();
    for (auto _ : state)
        if (!step()) return state.SkipWithError(sim.error());
}

void step_mujoco(benchmark::State& state) {
    const World world(standing_icub()); // completes the options
    const Simulation start(std::make_shared<const World>(standing_icub()));
    const Urdf urdf = Urdf::read(world.options().urdf);
    const SpecPtr spec = make_spec(world.options(), world.options(), urdf, Looks::none);
    const ModelPtr model = compile(spec.get(), urdf.file);
    const DataPtr data = make_data(model.get());
    const std::vector<double> target = world.options().initial_joints;

    const Eigen::Quaterniond q(Eigen::Matrix3d(start.w_H_b().topLeftCorner<3, 3>()));
    const double base[7] = {
        start.w_H_b()(0, 3), start.w_H_b()(1, 3), start.w_H_b()(2, 3), q.w(), q.x(), q.y(), q.z()};
    std::copy_n(base, 7, data->qpos);
    std::vector<int> position(n), velocity(n);
    for (int i = 0; i < n; ++i) {
        const int joint = id_of(model.get(), mjOBJ_JOINT, world.joint_names()[i]);
        position[i] = model->jnt_qposadr[joint];
        velocity[i] = model->jnt_dofadr[joint];
        data->qpos[position[i]] = target[i];
    }
    const auto step = [&] {
        for (int i = 0; i < n; ++i)
            data->ctrl[i] = hold(i, target[i], data->qpos[position[i]], data->qvel[velocity[i]]);
        mj_step(model.get(), data.get());
    };
    for (int k = 0; k < 2000; ++k) step();
    for (auto _ : state) step();
    if (data->ncon != 8) state.SkipWithError("the robot has fallen");
}

SceneOptions two_arms() { return SceneOptions::read(BF_SOURCE_DIRECTORY "/examples/two_robots/world.xml"); }

/// Torque on joint i of an arm that stretches slowly.
double stretch(int i, double t, double s, double s_dot) {
    const double target = i == 0 ? 0.3 * t : i == 1 ? -0.6 + 0.5 * t : 2.2 - t;
    return 60.0 * (target - s) - 3.0 * s_dot;
}

void step_scene(benchmark::State& state) {
    SceneSimulation sim(std::make_shared<const Scene>(two_arms()));
    std::vector<double> start(static_cast<std::size_t>(sim.state_size()));
    sim.save(start.data());
    for (auto _ : state) {
        if (sim.time() > 1.0) sim.restore(start.data());
        for (int r = 0; r < 2; ++r) {
            double tau[3];
            const auto s = sim.s(r), s_dot = sim.s_dot(r);
            for (int i = 0; i < 3; ++i) tau[i] = stretch(i, sim.time(), s[i], s_dot[i]);
            sim.set_torque(r, tau);
        }
        if (!sim.step()) return state.SkipWithError(sim.error());
    }
}

void step_mujoco_scene(benchmark::State& state) {
    const SceneSimulation begin(std::make_shared<const Scene>(two_arms()));
    SceneOptions options = two_arms();
    std::vector<RobotStart> starts;
    std::vector<std::string> warnings;
    const SpecPtr spec = make_scene(options, Looks::none, starts, warnings);
    const ModelPtr model = compile(spec.get(), "world.xml");
    const DataPtr data = make_data(model.get());
    std::vector<RobotIndex> robots(2);
    for (std::size_t r = 0; r < 2; ++r)
        robots[r].find(model.get(), options.robots[r].options, options.robots[r].name + "/");
    const auto reset = [&] {
        mj_resetData(model.get(), data.get());
        std::copy_n(begin.q().data(), begin.q().size(), data->qpos);
        mj_forward(model.get(), data.get());
    };
    reset();
    for (auto _ : state) {
        if (data->time > 1.0) reset();
        for (const RobotIndex& robot : robots)
            for (int i = 0; i < 3; ++i) {
                const auto k = static_cast<std::size_t>(i);
                data->ctrl[robot.motors[k]] =
                    stretch(i, data->time, data->qpos[robot.position[k]], data->qvel[robot.velocity[k]]);
            }
        mj_step(model.get(), data.get());
    }
}

void snapshot(benchmark::State& state) {
    Simulation sim(std::make_shared<const World>(standing_icub()));
    std::vector<double> saved(static_cast<std::size_t>(sim.state_size()));
    for (auto _ : state) {
        sim.save(saved.data());
        benchmark::ClobberMemory();
    }
}

void restore(benchmark::State& state) {
    Simulation sim(std::make_shared<const World>(standing_icub()));
    std::vector<double> saved(static_cast<std::size_t>(sim.state_size()));
    sim.save(saved.data());
    for (auto _ : state) sim.restore(saved.data());
}

BENCHMARK(step_world)->Name("physics.step/world");
BENCHMARK(step_mujoco)->Name("physics.step/bare_mj_step");
BENCHMARK(step_scene)->Name("physics.two_robots/world");
BENCHMARK(step_mujoco_scene)->Name("physics.two_robots/bare_mj_step");
BENCHMARK(snapshot)->Name("physics.state/save");
BENCHMARK(restore)->Name("physics.state/restore");

} // namespace
