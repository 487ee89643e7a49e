// Blocks of the Whole-Body Toolbox in a running diagram, beside what they call; the same quantities without
// blocks are measured in dynamics_benchmark.cpp, qp_benchmark.cpp and physics_benchmark.cpp.
#include "../toolbox/qp/test/two_feet.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/core/registry.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/walking/dcm.hpp"
#include "whole_body_frames.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace {

constexpr int n = 23;
const std::string joints =
    "\"{'torso_pitch', 'torso_roll', 'torso_yaw', 'l_shoulder_pitch', 'l_shoulder_roll', 'l_shoulder_yaw', "
    "'l_elbow', 'r_shoulder_pitch', 'r_shoulder_roll', 'r_shoulder_yaw', 'r_elbow', 'l_hip_pitch', "
    "'l_hip_roll', 'l_hip_yaw', 'l_knee', 'l_ankle_pitch', 'l_ankle_roll', 'r_hip_pitch', 'r_hip_roll', "
    "'r_hip_yaw', 'r_knee', 'r_ankle_pitch', 'r_ankle_roll'}\"";

/// A model in execution; its signals are memory that the benchmark reads and writes.
struct Loop {
    bf::Registry registry;
    bf::Diagram diagram;
    bf::Simulation simulation;

    explicit Loop(const std::string& text)
        : diagram(bf::elaborate(bf::formats::read_yaml_text(text), with_plugin(registry))),
          simulation(diagram) {
        simulation.start();
    }
    double* input(const std::string& name) {
        for (const auto& port : diagram.inputs)
            if (port.path == name)
                return static_cast<double*>(simulation.context().data(port.end.node, port.end.slot));
        throw std::runtime_error("no input '" + name + "'");
    }
    const double* signal(const std::string& path) {
        const auto end = diagram.find_signal(path);
        return static_cast<const double*>(simulation.context().data(end.node, end.slot));
    }
    static bf::Registry& with_plugin(bf::Registry& registry) {
        registry.add(bf::standard_library());
        registry.add_search_path(BF_PLUGIN_DIRECTORY);
        return registry;
    }
};

/// M, h, centre of mass and its Jacobian, centroidal momentum and its matrix; poses, Jacobians and bias
/// accelerations of the frames; each step in a new state.
void whole_body_step(benchmark::State& run, const std::vector<std::string>& frames) {
    std::string blocks, base, joint_positions, velocities;
    for (std::size_t i = 0; i < frames.size(); ++i)
        for (const char* type : {"ForwardKinematics", "Jacobian", "DotJNu"}) {
            const std::string name = type + std::to_string(i);
            blocks += "  " + name + ": {block: WholeBodyToolbox/" + type + ", frame: " + frames[i] + "}\n";
            base += ", " + name + ".w_H_b";
            joint_positions += ", " + name + ".s";
            if (type[0] == 'D') velocities += ", " + name + ".VELOCITY";
        }
    const auto of = [&](const std::string& port) {
        std::string all = velocities;
        for (std::size_t at = all.find("VELOCITY"); at != all.npos; at = all.find("VELOCITY"))
            all.replace(at, 8, port);
        return all;
    };
    Loop loop(
        "model: m\nstep: 0.01\n"
        "inputs: {w_H_b: {shape: \"[4 4]\"}, s: {shape: 23}, v_b: {shape: 6}, s_dot: {shape: 23}}\nblocks:\n"
        "  robot: {block: WholeBodyToolbox/Configuration, joints: " +
        joints + "}\n" + R"(
  M: {block: WholeBodyToolbox/MassMatrix}
  h: {block: WholeBodyToolbox/GetBiasForces}
  H: {block: WholeBodyToolbox/CentroidalMomentum}
  A: {block: WholeBodyToolbox/CentroidalTotalMomentumMatrix}
  com: {block: WholeBodyToolbox/ForwardKinematics, frame: com}
  J_com: {block: WholeBodyToolbox/Jacobian, frame: com}
)" + blocks +
        "connections:\n  w_H_b: [M.w_H_b, h.w_H_b, H.w_H_b, A.w_H_b, com.w_H_b, J_com.w_H_b" + base +
        "]\n  s: [M.s, h.s, H.s, A.s, com.s, J_com.s" + joint_positions + "]\n  v_b: [h.v_b, H.v_b" +
        of("v_b") + "]\n  s_dot: [h.s_dot, H.s_dot" + of("s_dot") + "]\n");
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    struct State {
        Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
        Eigen::Matrix<double, n, 1> s, s_dot;
        Eigen::Matrix<double, 6, 1> v_b;
    };
    std::vector<State> states(64);
    for (State& state : states) {
        const auto draw = [&](Eigen::Index) { return uniform(random); };
        const Eigen::Vector4d quaternion = Eigen::Vector4d::NullaryExpr(draw);
        state.w_H_b.topLeftCorner<3, 3>() = Eigen::Quaterniond(quaternion).normalized().toRotationMatrix();
        state.w_H_b.topRightCorner<3, 1>() = Eigen::Vector3d::NullaryExpr(draw);
        state.s = decltype(state.s)::NullaryExpr(draw);
        state.s_dot = decltype(state.s)::NullaryExpr(draw);
        state.v_b = decltype(state.v_b)::NullaryExpr(draw);
    }
    double *w_H_b = loop.input("w_H_b"), *s = loop.input("s"), *v_b = loop.input("v_b"),
           *s_dot = loop.input("s_dot");
    std::size_t step = 0;
    for (auto _ : run) {
        const State& state = states[step++ % states.size()];
        std::copy_n(state.w_H_b.data(), 16, w_H_b);
        std::copy_n(state.s.data(), n, s);
        std::copy_n(state.v_b.data(), 6, v_b);
        std::copy_n(state.s_dot.data(), n, s_dot);
        if (!loop.simulation.step()) return run.SkipWithError(loop.simulation.failure().c_str());
        benchmark::ClobberMemory();
    }
}

/// One solve per step; the problems follow each other as in a control loop.
void qp_block(benchmark::State& run) {
    const auto problems = bf::qp::two_feet::sequence(bf::qp::two_feet::cached);
    Loop loop(R"(
model: m
step: 0.01
inputs: {H: {shape: "[12 12]"}, g: {shape: 12}, A: {shape: "[38 12]"}, ubA: {shape: 38}}
blocks: {qp: {block: WholeBodyToolbox/QP, stop_when_fails: true}}
connections: {H: qp.H, g: qp.g, A: qp.A, ubA: qp.ubA}
)");
    // Its inputs point at the problems, as they would at the outputs of the blocks before it.
    const int node = loop.diagram.find_node("qp");
    const auto& declaration = loop.diagram.nodes[static_cast<std::size_t>(node)].block->declaration();
    auto** pointers = const_cast<void**>(loop.simulation.context().frame(node).now);
    const auto slot = [&](const char* name) -> void*& {
        return pointers[declaration.find(name, bf::Role::input)];
    };
    void *&H = slot("H"), *&g = slot("g"), *&A = slot("A"), *&ubA = slot("ubA");
    std::size_t k = 0;
    for (auto _ : run) {
        const auto& p = problems[k++ % problems.size()];
        H = const_cast<double*>(p.H.data());
        g = const_cast<double*>(p.g.data());
        A = const_cast<double*>(p.A.data());
        ubA = const_cast<double*>(p.ubA.data());
        if (!loop.simulation.step()) return run.SkipWithError(loop.simulation.failure().c_str());
    }
}

/// The standing iCub of physics_benchmark.cpp, its joint PD outside the diagram.
void world_block(benchmark::State& run) {
    const double home[n] = {0.033,  0,     0,     -0.354, 0.5,   0,      0.801,  -0.354,
                            0.5,    0,     0.801, 0.208,  0.011, -0.002, -0.499, -0.292,
                            -0.012, 0.208, 0.011, -0.002, -0.5,  -0.292, -0.012};
    std::string initial;
    for (const double value : home) initial += std::to_string(value) + " ";
    Loop loop("model: m\nstep: 0.001\ninputs: {tau: {shape: 23}}\nblocks:\n"
              "  robot: {block: WholeBodyToolbox/Configuration, joints: " +
              joints +
              "}\n  world:\n    block: WholeBodyToolbox/MujocoWorld\n    feet: \"{'l_sole', 'r_sole'}\"\n"
              "    ft_sensors: \"{'l_foot_ft_sensor', 'r_foot_ft_sensor'}\"\n    imu_frame: imu_frame\n"
              "    push_links: \"{'chest'}\"\n    initial_joints: [" +
              initial + "]\nconnections: {tau: world.tau}\n");
    double* tau = loop.input("tau");
    const double *s = loop.signal("world.s"), *s_dot = loop.signal("world.s_dot");
    std::copy_n(home, n, const_cast<double*>(s)); // before the first step it shows nothing
    const auto step = [&] {
        for (int i = 0; i < n; ++i) {
            const double kp = i < 3 ? 300 : i < 11 ? 50 : 400, kd = i < 3 ? 6 : i < 11 ? 2 : 8;
            tau[i] = kp * (home[i] - s[i]) - kd * s_dot[i];
        }
        return bool(loop.simulation.step());
    };
    for (int k = 0; k < 2000; ++k) step();
    for (auto _ : run)
        if (!step()) return run.SkipWithError(loop.simulation.failure().c_str());
    if (loop.signal("world.com")[2] < 0.45) run.SkipWithError("the robot has fallen");
}

/// A walk at constant velocity: in each step the footholds, the DCM and the swing foot are planned anew.
void walking_plan(benchmark::State& run) {
    Loop loop(R"(
model: m
step: 0.005
inputs: {command: {shape: 3}}
blocks:
  left: {block: Constant, value: "[1 0 0 0; 0 1 0 0.075; 0 0 1 0; 0 0 0 1]"}
  right: {block: Constant, value: "[1 0 0 0; 0 1 0 -0.075; 0 0 1 0; 0 0 0 1]"}
  feet: {block: WholeBodyToolbox/FootstepPlanner, ground: "[2 0 0.015 0.5 0.5 0.015]"}
  plan: {block: WholeBodyToolbox/DcmPlanner}
  soles: {block: WholeBodyToolbox/SwingFoot}
connections:
  command: feet.command
  left: feet.w_H_left
  right: feet.w_H_right
  feet.footholds: [plan.footholds, soles.footholds]
  feet.step: [plan.step, soles.step]
)");
    loop.input("command")[0] = 0.15;
    for (auto _ : run) {
        if (!loop.simulation.step()) return run.SkipWithError(loop.simulation.failure().c_str());
        benchmark::ClobberMemory();
    }
}

/// The DCM of four steps alone.
void bare_dcm(benchmark::State& run) {
    using namespace bf::walking;
    Eigen::Matrix<double, 4, 6> feet;
    for (int i = 0; i < 6; ++i) feet.col(i) << 0.1 * i, i % 2 ? -0.075 : 0.075, 0, 0;
    const double omega = natural_frequency(0.5);
    Step step{0, 0.25, 0.6, 0.25, 0.6, Side::right, 4, false};
    for (auto _ : run) {
        step.time = step.time > 0.8 ? 0 : step.time + 0.005;
        benchmark::DoNotOptimize(plan_dcm(feet, step, {{0.03, 0, 0.5}}, omega));
    }
}

BENCHMARK(walking_plan)->Name("toolbox.walking_plan/diagram");
BENCHMARK(bare_dcm)->Name("toolbox.walking_plan/bare_dcm");
BENCHMARK_CAPTURE(whole_body_step, soles, bf::benchmarks::two_soles)->Name("toolbox.whole_body_step/diagram");
BENCHMARK_CAPTURE(whole_body_step, thirty, bf::benchmarks::eight_frames)
    ->Name("toolbox.whole_body_step_30/diagram");
BENCHMARK(qp_block)->Name("toolbox.qp_12x38/block");
BENCHMARK(world_block)->Name("physics.step/block");

} // namespace
