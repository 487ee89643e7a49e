#include "bf/dynamics/algorithms.hpp"

#include <benchmark/benchmark.h>
#include <iDynTree/EigenHelpers.h>
#include <iDynTree/FreeFloatingState.h>
#include <iDynTree/KinDynComputations.h>
#include <iDynTree/ModelLoader.h>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

// The whole-body quantities of one step of a balancing controller: M, h, centroidal momentum and its matrix,
// centre of mass and its Jacobian, and pose, Jacobian and J_dot nu of both soles, each step in a new state.
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>; // Pinocchio's library is compiled for these arguments

const std::string robot = BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf";
const std::vector<std::string> controlled = {
    "torso_pitch",    "torso_roll",    "torso_yaw",        "l_shoulder_pitch", "l_shoulder_roll",
    "l_shoulder_yaw", "l_elbow",       "r_shoulder_pitch", "r_shoulder_roll",  "r_shoulder_yaw",
    "r_elbow",        "l_hip_pitch",   "l_hip_roll",       "l_hip_yaw",        "l_knee",
    "l_ankle_pitch",  "l_ankle_roll",  "r_hip_pitch",      "r_hip_roll",       "r_hip_yaw",
    "r_knee",         "r_ankle_pitch", "r_ankle_roll"};
constexpr int n = 23;

struct State {
    Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
    Eigen::VectorXd s, s_dot;
    Vector6 nu_base;
};

std::vector<State> random_states() {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto draw = [&](int size) {
        return Eigen::VectorXd(
            Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index) { return uniform(random); }));
    };
    std::vector<State> states(64);
    for (State& state : states) {
        const Eigen::Vector4d quaternion = draw(4);
        state.w_H_b.topLeftCorner<3, 3>() = Eigen::Quaterniond(quaternion).normalized().toRotationMatrix();
        state.w_H_b.topRightCorner<3, 1>() = draw(3);
        state.s = draw(n);
        state.nu_base = draw(6);
        state.s_dot = draw(n);
    }
    return states;
}

struct Sole {
    Eigen::Matrix4d H;
    Matrix6X J{6, 6 + n};
    Vector6 J_dot_nu;
};

void whole_body_step_api(benchmark::State& run) {
    namespace dyn = bf::dynamics;
    const dyn::Model model = dyn::Model::load(robot, controlled);
    const std::array frames{model.frame("l_sole"), model.frame("r_sole")};
    dyn::Data data(model);
    const std::vector<State> states = random_states();
    Eigen::MatrixXd M(6 + n, 6 + n);
    Eigen::VectorXd h(6 + n);
    Vector6 momentum;
    Matrix6X A(6, 6 + n);
    Eigen::Vector3d com;
    Eigen::Matrix<double, 3, Eigen::Dynamic> com_J(3, 6 + n);
    std::array<Sole, 2> soles;
    std::size_t step = 0;
    for (auto _ : run) {
        const State& state = states[step++ % states.size()];
        dyn::set_state(model, data, state.w_H_b, state.s, state.nu_base, state.s_dot);
        dyn::mass_matrix(model, data, M);
        dyn::bias_forces(model, data, h);
        dyn::centroidal_momentum(model, data, momentum);
        dyn::centroidal_momentum_matrix(model, data, A);
        dyn::center_of_mass(model, data, com);
        dyn::com_jacobian(model, data, com_J);
        for (std::size_t i = 0; i < soles.size(); ++i) {
            dyn::forward_kinematics(model, data, frames[i], soles[i].H);
            dyn::jacobian(model, data, frames[i], soles[i].J);
            dyn::bias_acceleration(model, data, frames[i], soles[i].J_dot_nu);
        }
        benchmark::ClobberMemory();
    }
}

/// The fewest calls of Pinocchio that contain these quantities, in its own base-fixed velocity and joint
/// order.
void whole_body_step_bare_pinocchio(benchmark::State& run) {
    pinocchio::Model full;
    pinocchio::urdf::buildModel(robot, pinocchio::JointModelFreeFlyer(), full);
    std::vector<pinocchio::JointIndex> locked;
    for (pinocchio::JointIndex i = 2; i < full.names.size(); ++i) {
        if (std::find(controlled.begin(), controlled.end(), full.names[i]) == controlled.end())
            locked.push_back(i);
    }
    const pinocchio::Model model = pinocchio::buildReducedModel(full, locked, pinocchio::neutral(full));
    pinocchio::Data data(model);
    const std::array frames{model.getBodyId("l_sole"), model.getBodyId("r_sole")};
    std::vector<Eigen::VectorXd> positions, velocities;
    for (const State& state : random_states()) {
        const Eigen::Matrix3d R = state.w_H_b.topLeftCorner<3, 3>();
        positions.emplace_back(7 + n) << state.w_H_b.topRightCorner<3, 1>(), Eigen::Quaterniond(R).coeffs(),
            state.s;
        velocities.emplace_back(6 + n) << state.nu_base, state.s_dot;
    }
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6 + n);
    std::array<Sole, 2> soles;
    std::size_t step = 0;
    for (auto _ : run) {
        const VectorIn q(positions[step % positions.size()]), v(velocities[step % positions.size()]), a(zero);
        ++step;
        pinocchio::crba(model, data, q, pinocchio::Convention::WORLD); // M, J, A, centre of mass
        pinocchio::nonLinearEffects(model, data, q, v);
        pinocchio::forwardKinematics(model, data, q, v, a);
        for (std::size_t i = 0; i < soles.size(); ++i) {
            const auto world_aligned = pinocchio::LOCAL_WORLD_ALIGNED;
            soles[i].H = pinocchio::updateFramePlacement(model, data, frames[i]).toHomogeneousMatrix();
            soles[i].J.setZero();
            pinocchio::getFrameJacobian(model, data, frames[i], world_aligned, soles[i].J);
            soles[i].J_dot_nu =
                pinocchio::getFrameClassicalAcceleration(model, data, frames[i], world_aligned).toVector();
        }
        benchmark::ClobberMemory();
    }
}

void whole_body_step_idyntree(benchmark::State& run) {
    iDynTree::ModelLoader loader;
    iDynTree::KinDynComputations computations;
    if (!loader.loadReducedModelFromFile(robot, controlled) || !computations.loadRobotModel(loader.model()) ||
        !computations.setFrameVelocityRepresentation(iDynTree::MIXED_REPRESENTATION)) {
        run.SkipWithError("iDynTree did not load the robot");
        return;
    }
    const std::array frames{computations.getFrameIndex("l_sole"), computations.getFrameIndex("r_sole")};
    const std::vector<State> states = random_states();
    const Eigen::Vector3d gravity(0.0, 0.0, -9.81);
    iDynTree::FreeFloatingGeneralizedTorques h(computations.model());
    Eigen::MatrixXd M(6 + n, 6 + n);
    Matrix6X A(6, 6 + n);
    Eigen::Matrix<double, 3, Eigen::Dynamic> com_J(3, 6 + n);
    std::array<Sole, 2> soles;
    std::size_t step = 0;
    for (auto _ : run) {
        const State& state = states[step++ % states.size()];
        computations.setRobotState(state.w_H_b, state.s, state.nu_base, state.s_dot, gravity);
        computations.getFreeFloatingMassMatrix(iDynTree::make_matrix_view(M));
        computations.generalizedBiasForces(h);
        benchmark::DoNotOptimize(computations.getCentroidalTotalMomentum());
        computations.getCentroidalTotalMomentumJacobian(iDynTree::make_matrix_view(A));
        benchmark::DoNotOptimize(computations.getCenterOfMassPosition());
        computations.getCenterOfMassJacobian(iDynTree::make_matrix_view(com_J));
        for (std::size_t i = 0; i < soles.size(); ++i) {
            soles[i].H =
                iDynTree::toEigen(computations.getWorldTransform(frames[i]).asHomogeneousTransform());
            computations.getFrameFreeFloatingJacobian(frames[i], iDynTree::make_matrix_view(soles[i].J));
            soles[i].J_dot_nu = iDynTree::toEigen(computations.getFrameBiasAcc(frames[i]));
        }
        benchmark::ClobberMemory();
    }
}

BENCHMARK(whole_body_step_api)->Name("toolbox.whole_body_step/api");
BENCHMARK(whole_body_step_bare_pinocchio)->Name("toolbox.whole_body_step/bare_pinocchio");
BENCHMARK(whole_body_step_idyntree)->Name("toolbox.whole_body_step/idyntree");

} // namespace
