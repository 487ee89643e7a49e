// Accelerations, Coriolis matrices and inverse kinematics, beside bare calls of Pinocchio for the same robot.
#include "bf/dynamics/inverse_kinematics.hpp"

#include <benchmark/benchmark.h>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

namespace {

namespace dyn = bf::dynamics;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>; // Pinocchio's library is compiled for these arguments

const std::string robot = BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf";
/// 30 joints: torso, arms with wrists, legs, and one of the neck.
const std::vector<std::string> controlled = {
    "torso_pitch",    "torso_roll",     "torso_yaw",        "l_shoulder_pitch", "l_shoulder_roll",
    "l_shoulder_yaw", "l_elbow",        "r_shoulder_pitch", "r_shoulder_roll",  "r_shoulder_yaw",
    "r_elbow",        "l_hip_pitch",    "l_hip_roll",       "l_hip_yaw",        "l_knee",
    "l_ankle_pitch",  "l_ankle_roll",   "r_hip_pitch",      "r_hip_roll",       "r_hip_yaw",
    "r_knee",         "r_ankle_pitch",  "r_ankle_roll",     "l_wrist_prosup",   "l_wrist_pitch",
    "l_wrist_yaw",    "r_wrist_prosup", "r_wrist_pitch",    "r_wrist_yaw",      "neck_pitch"};
constexpr int n = 30, v = 6 + n;

struct State {
    Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
    Eigen::VectorXd s, s_dot, forces;
    Vector6 nu_base;
};

const std::vector<State>& states() {
    static const auto all = [] {
        std::mt19937 random(1);
        std::uniform_real_distribution<double> uniform(-1.0, 1.0);
        const auto draw = [&](int size) {
            return Eigen::VectorXd(
                Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index) { return uniform(random); }));
        };
        std::vector<State> made(64);
        for (State& state : made) {
            const Eigen::Vector4d quaternion = draw(4);
            state.w_H_b.topLeftCorner<3, 3>() =
                Eigen::Quaterniond(quaternion).normalized().toRotationMatrix();
            state.w_H_b.topRightCorner<3, 1>() = draw(3);
            state.s = draw(n);
            state.s_dot = draw(n);
            state.nu_base = draw(6);
            state.forces = 10.0 * draw(v);
        }
        return made;
    }();
    return all;
}

/// The robot in Pinocchio, which keeps the velocity of the base in its own axes and the joints in its own
/// order.
struct Bare {
    pinocchio::Model model = make();
    pinocchio::Data data{model};
    std::vector<Eigen::VectorXd> positions, velocities, forces;

    Bare() {
        for (const State& state : states()) {
            const Eigen::Matrix3d R = state.w_H_b.topLeftCorner<3, 3>();
            positions.emplace_back(7 + n) << state.w_H_b.topRightCorner<3, 1>(),
                Eigen::Quaterniond(R).coeffs(), state.s;
            velocities.emplace_back(v) << state.nu_base, state.s_dot;
            forces.push_back(state.forces);
        }
    }
    static pinocchio::Model make() {
        pinocchio::Model full;
        pinocchio::urdf::buildModel(robot, pinocchio::JointModelFreeFlyer(), full);
        std::vector<pinocchio::JointIndex> locked;
        for (pinocchio::JointIndex i = 2; i < full.names.size(); ++i)
            if (std::find(controlled.begin(), controlled.end(), full.names[i]) == controlled.end())
                locked.push_back(i);
        return pinocchio::buildReducedModel(full, locked, pinocchio::neutral(full));
    }
};

void set(const dyn::Model& model, dyn::Data& data, const State& state) {
    dyn::set_state(model, data, state.w_H_b, state.s, state.nu_base, state.s_dot);
}

void forward_dynamics(benchmark::State& run) {
    const dyn::Model model = dyn::Model::load(robot, controlled);
    dyn::Data data(model);
    Eigen::VectorXd nu_dot(v);
    std::size_t k = 0;
    for (auto _ : run) {
        const State& state = states()[k++ % states().size()];
        set(model, data, state);
        dyn::forward_dynamics(model, data, state.forces, nu_dot);
        benchmark::ClobberMemory();
    }
}

void bare_aba(benchmark::State& run) {
    Bare bare;
    std::size_t k = 0;
    for (auto _ : run) {
        const std::size_t i = k++ % states().size();
        const VectorIn q(bare.positions[i]), nu(bare.velocities[i]), forces(bare.forces[i]);
        pinocchio::aba(bare.model, bare.data, q, nu, forces, pinocchio::Convention::WORLD);
        benchmark::ClobberMemory();
    }
}

void coriolis_matrix(benchmark::State& run) {
    const dyn::Model model = dyn::Model::load(robot, controlled);
    dyn::Data data(model);
    Eigen::MatrixXd C(v, v);
    std::size_t k = 0;
    for (auto _ : run) {
        set(model, data, states()[k++ % states().size()]);
        dyn::coriolis_matrix(model, data, C);
        benchmark::ClobberMemory();
    }
}

void bare_coriolis_matrix(benchmark::State& run) {
    Bare bare;
    std::size_t k = 0;
    for (auto _ : run) {
        const std::size_t i = k++ % states().size();
        const VectorIn q(bare.positions[i]), nu(bare.velocities[i]);
        pinocchio::computeCoriolisMatrix(bare.model, bare.data, q, nu);
        benchmark::ClobberMemory();
    }
}

constexpr std::array frames{"l_sole", "r_sole", "l_hand", "r_hand"};

/// Soles that stand and hands that draw circles of 5 cm, at 100 Hz; the base is found, too.
struct Following {
    dyn::Model model = dyn::Model::load(robot, controlled);
    dyn::InverseKinematics ik = make(model);
    Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
    Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
    std::array<Eigen::Matrix4d, frames.size()> start;

    static dyn::InverseKinematics make(const dyn::Model& model) {
        std::vector<dyn::Target> targets;
        for (const char* frame : frames) targets.push_back({dyn::Target::Kind::pose, model.frame(frame)});
        return {model, targets, true, {}};
    }
    Following() {
        for (std::size_t joint = 0; joint < controlled.size(); ++joint)
            if (controlled[joint].ends_with("elbow")) s[static_cast<Eigen::Index>(joint)] = 0.9;
        for (const char* side : {"l_", "r_"})
            for (const auto& [joint, angle] :
                 {std::pair("hip_pitch", 0.4), {"knee", -0.8}, {"ankle_pitch", -0.4}})
                s[std::find(controlled.begin(), controlled.end(), side + std::string(joint)) -
                  controlled.begin()] = angle;
        ik.posture_weights.setConstant(1e-6);
        ik.posture = s;
        dyn::Data data(model);
        dyn::set_position(model, data, w_H_b, s);
        for (std::size_t i = 0; i < frames.size(); ++i)
            dyn::forward_kinematics(model, data, model.frame(frames[i]), start[i]);
    }
    void step(int k) {
        const double angle = 2.0 * M_PI * k / 200.0;
        for (std::size_t i = 0; i < frames.size(); ++i) {
            ik.targets[i].pose = start[i];
            if (i >= 2)
                ik.targets[i].pose.block<2, 1>(1, 3) +=
                    0.05 * Eigen::Vector2d(std::sin(angle), 1.0 - std::cos(angle));
        }
        ik.follow(w_H_b, s);
    }
};

void inverse_kinematics(benchmark::State& run) {
    Following following;
    int k = 0, iterations = 0;
    for (auto _ : run) {
        following.step(k++);
        iterations += following.ik.iterations();
    }
    run.counters["iterations"] = static_cast<double>(iterations) / k;
}

/// As many Jacobians of the same frames, each time in a new posture, and nothing else.
void bare_jacobians(benchmark::State& run) {
    Following following;
    std::vector<int> evaluations; // one at the beginning, and one behind each iteration
    for (int k = 0; k < 200; ++k) {
        following.step(k);
        evaluations.push_back(1 + following.ik.iterations());
    }
    Bare bare;
    std::array<pinocchio::FrameIndex, frames.size()> ids;
    for (std::size_t i = 0; i < frames.size(); ++i) ids[i] = bare.model.getBodyId(frames[i]);
    Matrix6X J = Matrix6X::Zero(6, v);
    std::size_t k = 0, state = 0;
    for (auto _ : run) {
        for (int i = evaluations[k++ % evaluations.size()]; i > 0; --i) {
            const VectorIn q(bare.positions[state++ % states().size()]);
            pinocchio::computeJointJacobians(bare.model, bare.data, q);
            for (const auto id : ids) {
                pinocchio::updateFramePlacement(bare.model, bare.data, id);
                pinocchio::getFrameJacobian(bare.model, bare.data, id, pinocchio::LOCAL_WORLD_ALIGNED, J);
            }
            benchmark::ClobberMemory();
        }
    }
}

BENCHMARK(forward_dynamics)->Name("toolbox.forward_dynamics/api");
BENCHMARK(bare_aba)->Name("toolbox.forward_dynamics/bare_pinocchio");
BENCHMARK(coriolis_matrix)->Name("toolbox.coriolis_matrix/api");
BENCHMARK(bare_coriolis_matrix)->Name("toolbox.coriolis_matrix/bare_pinocchio");
BENCHMARK(inverse_kinematics)->Name("toolbox.ik_30/api");
BENCHMARK(bare_jacobians)->Name("toolbox.ik_30/bare_pinocchio");

} // namespace
