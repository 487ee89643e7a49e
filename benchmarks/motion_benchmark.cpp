// Accelerations, Coriolis matrices and inverse kinematics, beside bare calls of Pinocchio for the same robot.
#include "bf/dynamics/inverse_kinematics.hpp"
#include "robot_states.hpp"

#include <benchmark/benchmark.h>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace {

namespace dyn = bf::dynamics;
using namespace bf::benchmarks;

constexpr int n = 30, v = 6 + n;
const std::vector<std::string> controlled = icub_joints(n);

const std::vector<RobotState>& states() {
    static const auto all = random_states(n);
    return all;
}

void forward_dynamics(benchmark::State& run) {
    const dyn::Model model = dyn::Model::load(icub, controlled);
    dyn::Data data(model);
    Eigen::VectorXd nu_dot(v);
    std::size_t k = 0;
    for (auto _ : run) {
        const RobotState& state = states()[k++ % states().size()];
        set(model, data, state);
        dyn::forward_dynamics(model, data, state.forces, nu_dot);
        benchmark::ClobberMemory();
    }
}

void bare_aba(benchmark::State& run) {
    BarePinocchio bare(n);
    std::size_t k = 0;
    for (auto _ : run) {
        const std::size_t i = k++ % states().size();
        const VectorIn q(bare.positions[i]), nu(bare.velocities[i]), forces(bare.forces[i]);
        pinocchio::aba(bare.model, bare.data, q, nu, forces, pinocchio::Convention::WORLD);
        benchmark::ClobberMemory();
    }
}

void coriolis_matrix(benchmark::State& run) {
    const dyn::Model model = dyn::Model::load(icub, controlled);
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
    BarePinocchio bare(n);
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
    dyn::Model model = dyn::Model::load(icub, controlled);
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
    BarePinocchio bare(n);
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
