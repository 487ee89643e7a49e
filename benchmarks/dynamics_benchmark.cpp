#include "bf/dynamics/algorithms.hpp"
#include "robot_states.hpp"
#include "whole_body_frames.hpp"

#include <benchmark/benchmark.h>
#include <iDynTree/EigenHelpers.h>
#include <iDynTree/FreeFloatingState.h>
#include <iDynTree/KinDynComputations.h>
#include <iDynTree/ModelLoader.h>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <array>
#include <vector>

// The whole-body quantities of one step of a balancing controller: M, h, centroidal momentum and its matrix,
// centre of mass and its Jacobian, and pose, Jacobian and J_dot nu of both soles, each step in a new state.
namespace {

using namespace bf::benchmarks;

constexpr int n = 23;

struct Sole {
    Eigen::Matrix4d H;
    Matrix6X J{6, 6 + n};
    Vector6 J_dot_nu;
};

void whole_body_step_api(benchmark::State& run) {
    namespace dyn = bf::dynamics;
    const dyn::Model model = dyn::Model::load(icub, icub_joints(n));
    const std::array frames{model.frame("l_sole"), model.frame("r_sole")};
    dyn::Data data(model);
    const std::vector<RobotState> states = random_states(n);
    Eigen::MatrixXd M(6 + n, 6 + n);
    Eigen::VectorXd h(6 + n);
    Vector6 momentum;
    Matrix6X A(6, 6 + n);
    Eigen::Vector3d com;
    Eigen::Matrix<double, 3, Eigen::Dynamic> com_J(3, 6 + n);
    std::array<Sole, 2> soles;
    std::size_t step = 0;
    for (auto _ : run) {
        set(model, data, states[step++ % states.size()]);
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
/// order: what bias forces need leaves velocities and, without gravity, bias accelerations of the links
/// behind.
void whole_body_step_bare_pinocchio(benchmark::State& run, const std::vector<std::string>& names) {
    BarePinocchio bare(n);
    const auto& model = bare.model;
    auto& data = bare.data;
    std::vector<pinocchio::FrameIndex> frames;
    for (const auto& name : names) frames.push_back(model.getBodyId(name));
    std::vector<Sole> soles(frames.size());
    std::size_t step = 0;
    const auto compute = [&] {
        const std::size_t i = step % bare.positions.size();
        const VectorIn q(bare.positions[i]), v(bare.velocities[i]);
        ++step;
        pinocchio::crba(model, data, q, pinocchio::Convention::WORLD); // M, J, A, centre of mass
        pinocchio::nonLinearEffects(model, data, q, v);
        for (std::size_t j = 0; j < soles.size(); ++j) {
            const auto& frame = model.frames[frames[j]];
            const auto& H = pinocchio::updateFramePlacement(model, data, frames[j]);
            soles[j].H = H.toHomogeneousMatrix();
            soles[j].J.setZero();
            pinocchio::getFrameJacobian(model, data, frames[j], pinocchio::LOCAL_WORLD_ALIGNED, soles[j].J);
            const auto velocity = frame.placement.actInv(data.v[frame.parentJoint]);
            const auto bias = frame.placement.actInv(data.a_gf[frame.parentJoint]);
            soles[j].J_dot_nu << H.rotation() *
                                         (bias.linear() + velocity.angular().cross(velocity.linear())) +
                                     model.gravity.linear(),
                H.rotation() * bias.angular();
        }
    };
    compute();
    const VectorIn q(bare.positions[0]), v(bare.velocities[0]);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6 + n);
    pinocchio::forwardKinematics(model, data, q, v, VectorIn(zero));
    for (std::size_t j = 0; j < soles.size(); ++j)
        if (!soles[j].J_dot_nu.isApprox(pinocchio::getFrameClassicalAcceleration(
                                            model, data, frames[j], pinocchio::LOCAL_WORLD_ALIGNED)
                                            .toVector(),
                                        1e-9))
            return run.SkipWithError("the bias acceleration is another one");
    for (auto _ : run) {
        compute();
        benchmark::ClobberMemory();
    }
}

void whole_body_step_idyntree(benchmark::State& run) {
    iDynTree::ModelLoader loader;
    iDynTree::KinDynComputations computations;
    if (!loader.loadReducedModelFromFile(icub, icub_joints(n)) ||
        !computations.loadRobotModel(loader.model()) ||
        !computations.setFrameVelocityRepresentation(iDynTree::MIXED_REPRESENTATION)) {
        run.SkipWithError("iDynTree did not load the robot");
        return;
    }
    const std::array frames{computations.getFrameIndex("l_sole"), computations.getFrameIndex("r_sole")};
    const std::vector<RobotState> states = random_states(n);
    const Eigen::Vector3d gravity(0.0, 0.0, -9.81);
    iDynTree::FreeFloatingGeneralizedTorques h(computations.model());
    Eigen::MatrixXd M(6 + n, 6 + n);
    Matrix6X A(6, 6 + n);
    Eigen::Matrix<double, 3, Eigen::Dynamic> com_J(3, 6 + n);
    std::array<Sole, 2> soles;
    std::size_t step = 0;
    for (auto _ : run) {
        const RobotState& state = states[step++ % states.size()];
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
BENCHMARK_CAPTURE(whole_body_step_bare_pinocchio, soles, two_soles)
    ->Name("toolbox.whole_body_step/bare_pinocchio");
BENCHMARK_CAPTURE(whole_body_step_bare_pinocchio, thirty, eight_frames)
    ->Name("toolbox.whole_body_step_30/bare_pinocchio");
BENCHMARK(whole_body_step_idyntree)->Name("toolbox.whole_body_step/idyntree");

} // namespace
