#include "robots.hpp"

#include <gtest/gtest.h>
#include <iDynTree/EigenHelpers.h>
#include <iDynTree/FreeFloatingState.h>
#include <iDynTree/JointState.h>
#include <iDynTree/KinDynComputations.h>
#include <iDynTree/ModelLoader.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <unistd.h>

namespace bf::dynamics::test {
namespace {

using iDynTree::make_matrix_view;

/// The same quantities from iDynTree.
class Oracle {
  public:
    explicit Oracle(const std::vector<std::string>& joints) {
        iDynTree::ModelLoader loader;
        EXPECT_TRUE(loader.loadReducedModelFromFile(icub, joints));
        EXPECT_TRUE(computations.loadRobotModel(loader.model()));
        EXPECT_TRUE(computations.setFrameVelocityRepresentation(iDynTree::MIXED_REPRESENTATION));
        EXPECT_TRUE(computations.setFloatingBase("root_link"));
    }

    void set(const State& state, const Eigen::Vector3d& gravity) {
        EXPECT_TRUE(computations.setRobotState(state.w_H_b, state.s, state.nu_base, state.s_dot, gravity));
    }

    void compute(Quantities& result, const std::string& frame, const std::string& reference,
                 const Eigen::VectorXd& nu_dot) {
        result.w_H_f = iDynTree::toEigen(computations.getWorldTransform(frame).asHomogeneousTransform());
        EXPECT_TRUE(computations.getFrameFreeFloatingJacobian(frame, make_matrix_view(result.J)));
        result.J_dot_nu = iDynTree::toEigen(computations.getFrameBiasAcc(frame));
        result.com = iDynTree::toEigen(computations.getCenterOfMassPosition());
        result.com_dot = iDynTree::toEigen(computations.getCenterOfMassVelocity());
        EXPECT_TRUE(computations.getCenterOfMassJacobian(make_matrix_view(result.com_J)));
        result.com_J_dot_nu = iDynTree::toEigen(computations.getCenterOfMassBiasAcc());
        EXPECT_TRUE(computations.getFreeFloatingMassMatrix(make_matrix_view(result.M)));
        iDynTree::FreeFloatingGeneralizedTorques torques(computations.model());
        const auto copy = [&](Eigen::VectorXd& to) {
            to << iDynTree::toEigen(torques.baseWrench()), iDynTree::toEigen(torques.jointTorques());
        };
        EXPECT_TRUE(computations.generalizedBiasForces(torques));
        copy(result.h);
        EXPECT_TRUE(computations.generalizedGravityForces(torques));
        copy(result.g);
        iDynTree::Vector6 base;
        iDynTree::toEigen(base) = nu_dot.head<6>();
        iDynTree::JointDOFsDoubleArray joints(computations.model());
        iDynTree::toEigen(joints) = nu_dot.tail(nu_dot.size() - 6);
        EXPECT_TRUE(computations.inverseDynamics(
            base, joints, iDynTree::LinkNetExternalWrenches(computations.model()), torques));
        copy(result.tau);
        result.H = iDynTree::toEigen(computations.getCentroidalTotalMomentum().asVector());
        EXPECT_TRUE(computations.getCentroidalTotalMomentumJacobian(make_matrix_view(result.A)));
        result.relative =
            iDynTree::toEigen(computations.getRelativeTransform(reference, frame).asHomogeneousTransform());
        const auto index = [&](const std::string& name) { return computations.getFrameIndex(name); };
        EXPECT_TRUE(computations.getRelativeJacobian(index(reference), index(frame),
                                                     make_matrix_view(result.relative_J)));
    }

    iDynTree::KinDynComputations computations;
};

void expect_near(const Eigen::MatrixXd& ours, const Eigen::MatrixXd& theirs, const char* what) {
    ASSERT_EQ(ours.rows(), theirs.rows()) << what;
    ASSERT_EQ(ours.cols(), theirs.cols()) << what;
    EXPECT_LT((ours - theirs).cwiseAbs().maxCoeff(), 1e-9) << what;
}

void compare_with_idyntree(const std::vector<std::string>& joints, const Eigen::Vector3d& gravity) {
    const Model model = Model::load(icub, joints, gravity);
    Data data(model);
    Oracle oracle(model.joint_names());
    Quantities ours(model), theirs(model);
    std::mt19937 random(1);
    const std::vector<std::array<std::string, 2>> pairs = {{"l_sole", "r_sole"},
                                                           {"r_sole", "root_link"},
                                                           {"root_link", "l_hand"},
                                                           {"l_hand", "chest"},
                                                           {"head", "l_elbow_1"}};
    for (int trial = 0; trial < 50; ++trial) {
        const State state = random_state(model.joints(), random);
        const Eigen::VectorXd nu_dot = random_vector(model.velocities(), random);
        set(model, data, state);
        oracle.set(state, gravity);
        for (const auto& [frame, reference] : pairs) {
            SCOPED_TRACE(frame + " and " + reference);
            ours.compute(model, data, model.frame(frame), model.frame(reference), nu_dot);
            oracle.compute(theirs, frame, reference, nu_dot);
            expect_near(ours.w_H_f, theirs.w_H_f, "forward_kinematics");
            expect_near(ours.J, theirs.J, "jacobian");
            expect_near(ours.J_dot_nu, theirs.J_dot_nu, "bias_acceleration");
            expect_near(ours.com, theirs.com, "center_of_mass");
            expect_near(ours.com_dot, theirs.com_dot, "center_of_mass_velocity");
            expect_near(ours.com_J, theirs.com_J, "com_jacobian");
            expect_near(ours.com_J_dot_nu, theirs.com_J_dot_nu, "com_bias_acceleration");
            expect_near(ours.M, theirs.M, "mass_matrix");
            expect_near(ours.h, theirs.h, "bias_forces");
            expect_near(ours.g, theirs.g, "gravity_forces");
            expect_near(ours.tau, theirs.tau, "inverse_dynamics");
            expect_near(ours.H, theirs.H, "centroidal_momentum");
            expect_near(ours.A, theirs.A, "centroidal_momentum_matrix");
            expect_near(ours.relative, theirs.relative, "relative_transform");
            expect_near(ours.relative_J, theirs.relative_J, "relative_jacobian");
        }
    }
}

/// iCub in one random state.
class Identities : public testing::Test {
  protected:
    Identities() {
        set(model, data, state);
        all.compute(model, data, frame, reference, Eigen::VectorXd::Zero(model.velocities()));
    }

    std::mt19937 random{7};
    Model model = Model::load(icub, icub_joints);
    Data data{model};
    State state = random_state(model.joints(), random);
    Frame frame = model.frame("r_hand"), reference = model.frame("l_sole");
    Quantities all{model};
};

} // namespace

TEST(Algorithms, AgreeWithIDynTreeOnTheControlledJointsOfICub) {
    compare_with_idyntree(icub_joints, {0.0, 0.0, -9.81});
}

TEST(Algorithms, AgreeWithIDynTreeOnAllJointsOfICub) { compare_with_idyntree({}, {0.0, 0.0, -9.81}); }

TEST(Algorithms, AgreeWithIDynTreeInAnyOrderOfJointsAndObliqueGravity) {
    compare_with_idyntree({"r_knee", "l_elbow", "torso_yaw", "l_hip_yaw", "r_shoulder_roll"},
                          {1.0, -2.0, 3.0});
}

TEST_F(Identities, MassMatrixIsSymmetricPositiveDefiniteWithTheMassOnItsDiagonal) {
    EXPECT_EQ(all.M, all.M.transpose());
    EXPECT_EQ(all.M.llt().info(), Eigen::Success);
    EXPECT_NEAR(all.M(0, 0), model.total_mass(), 1e-12);
    EXPECT_NEAR(all.M(2, 2), 33.061673, 1e-6);
}

TEST_F(Identities, KineticEnergyOfTheMassMatrixIsThatOfTheLinksMotion) {
    // The power of the forces that hold nu constant equals the rate of kinetic and potential energy.
    const double dt = 1e-6;
    const auto energy = [&](const State& at) {
        Quantities now(model);
        set(model, data, at);
        now.compute(model, data, frame, reference, Eigen::VectorXd::Zero(model.velocities()));
        return 0.5 * at.nu().dot(now.M * at.nu()) - model.total_mass() * model.gravity().dot(now.com);
    };
    const double rate = (energy(moved(state, dt)) - energy(moved(state, -dt))) / (2.0 * dt);
    EXPECT_NEAR(state.nu().dot(all.h), rate, 1e-6 * std::abs(rate));
}

TEST_F(Identities, InverseDynamicsWithoutAccelerationGivesTheBiasForces) { EXPECT_EQ(all.tau, all.h); }

TEST_F(Identities, JacobianTimesNuIsTheMotionOfTheFrame) {
    const double dt = 1e-6;
    Eigen::Matrix4d before, after;
    set(model, data, moved(state, -dt));
    forward_kinematics(model, data, frame, before);
    set(model, data, moved(state, dt));
    forward_kinematics(model, data, frame, after);
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(after.topLeftCorner<3, 3>() * before.topLeftCorner<3, 3>().transpose()));
    Vector6 velocity;
    velocity << after.topRightCorner<3, 1>() - before.topRightCorner<3, 1>(), turn.angle() * turn.axis();
    EXPECT_LT((all.J * state.nu() - velocity / (2.0 * dt)).norm(), 1e-7);
}

TEST_F(Identities, BiasAccelerationsAreTheChangeOfJacobiansTimesNu) {
    const double dt = 1e-6;
    Quantities before(model), after(model);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(model.velocities());
    set(model, data, moved(state, -dt));
    before.compute(model, data, frame, reference, zero);
    set(model, data, moved(state, dt));
    after.compute(model, data, frame, reference, zero);
    EXPECT_LT(((after.J - before.J) * state.nu() / (2.0 * dt) - all.J_dot_nu).norm(), 1e-6);
    EXPECT_LT(((after.com_J - before.com_J) * state.nu() / (2.0 * dt) - all.com_J_dot_nu).norm(), 1e-6);
}

TEST_F(Identities, CentroidalMomentumMatrixTimesNuIsTheMomentum) {
    EXPECT_LT((all.A * state.nu() - all.H).norm(), 1e-12);
    EXPECT_LT((all.com_J * state.nu() - all.com_dot).norm(), 1e-12);
}

TEST_F(Identities, ResultsStayExactFarFromTheWorldsOrigin) {
    State far = state;
    far.w_H_b.topRightCorner<3, 1>() << 1e6, -1e6, 1e3;
    set(model, data, far);
    Quantities there(model);
    there.compute(model, data, frame, reference, Eigen::VectorXd::Zero(model.velocities()));
    EXPECT_EQ(there.M, all.M);
    EXPECT_EQ(there.h, all.h);
    EXPECT_EQ(there.J, all.J);
    EXPECT_EQ(there.A, all.A);
}

TEST_F(Identities, RelativeJacobianOfAFrameToItselfIsZero) {
    Matrix6X J(6, model.joints());
    relative_jacobian(model, data, frame, frame, J);
    EXPECT_EQ(J, Matrix6X::Zero(6, model.joints()));
}

TEST_F(Identities, OutputsMayBePartsOfLargerColumnMajorMatrices) {
    Eigen::MatrixXd contact = Eigen::MatrixXd::Constant(12, model.velocities() + 2, 5.0);
    jacobian(model, data, frame, contact.block(6, 1, 6, model.velocities()));
    EXPECT_EQ(contact.block(6, 1, 6, model.velocities()), all.J);
    EXPECT_EQ(contact.topRows(6), Eigen::MatrixXd::Constant(6, model.velocities() + 2, 5.0));
    EXPECT_EQ(contact.col(0), Eigen::VectorXd::Constant(12, 5.0));
}

namespace {

/// A planar arm in the x-z plane: a `continuous` shoulder, 0.5 m to a prismatic slide along the arm, whose
/// load of 2 kg is a point. The base weighs 3 kg.
constexpr const char* slider = R"(<?xml version="1.0"?>
<robot name="slider">
  <link name="base"><inertial><mass value="3"/>
    <inertia ixx="1" iyy="2" izz="3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"/>
  <link name="load"><inertial><mass value="2"/>
    <inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <!-- <joint name="slide" type="revolute"> -->
  <joint name="swing" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
  <joint name="slide" type="prismatic"><parent link="arm"/><child link="load"/><origin xyz="0.5 0 0"/>
    <axis xyz="1 0 0"/><limit lower="-0.2" upper="0.3" effort="10" velocity="4"/></joint>
</robot>)";

} // namespace

TEST(Algorithms, AgreeWithTheClosedFormOfATurningAndSlidingArm) {
    const auto path =
        std::filesystem::temp_directory_path() / ("bf_dynamics_slider_" + std::to_string(getpid()) + ".urdf");
    std::ofstream(path) << slider;
    const Model model = Model::load(path);
    ASSERT_EQ(model.joint_names(), (std::vector<std::string>{"swing", "slide"}));
    Data data(model);
    const double theta = 2.5, x = 0.1, theta_dot = 1.5, x_dot = -0.7, m = 2.0, gravity = 9.81;
    const double r = 0.5 + x, c = std::cos(theta), s = std::sin(theta);
    set_state(model, data, Eigen::Matrix4d::Identity(), Eigen::Vector2d(theta, x), Vector6::Zero(),
              Eigen::Vector2d(theta_dot, x_dot));

    // The load is at r (c, 0, -s): M = diag(m r², m), h = [2 m r rdot thetadot - m g r c; -m r thetadot² - m
    // g s].
    Eigen::MatrixXd M(8, 8);
    mass_matrix(model, data, M);
    EXPECT_NEAR(M(6, 6), m * r * r, 1e-13);
    EXPECT_NEAR(M(7, 7), m, 1e-13);
    EXPECT_NEAR(M(6, 7), 0.0, 1e-13);
    EXPECT_NEAR(M(0, 6), -m * r * s, 1e-13);
    EXPECT_NEAR(M(2, 7), -m * s, 1e-13);
    EXPECT_NEAR(M(4, 4), 2.0 + m * r * r, 1e-13);

    Eigen::VectorXd h(8);
    bias_forces(model, data, h);
    EXPECT_NEAR(h[6], 2.0 * m * r * x_dot * theta_dot - m * gravity * r * c, 1e-12);
    EXPECT_NEAR(h[7], -m * r * theta_dot * theta_dot - m * gravity * s, 1e-12);

    Eigen::Matrix4d w_H_load;
    forward_kinematics(model, data, model.frame("load"), w_H_load);
    EXPECT_LT((w_H_load.topRightCorner<3, 1>() - Eigen::Vector3d(r * c, 0.0, -r * s)).norm(), 1e-13);
    EXPECT_LT((w_H_load.topLeftCorner<3, 3>() -
               Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitY()).toRotationMatrix())
                  .norm(),
              1e-13);

    Eigen::Vector3d com;
    center_of_mass(model, data, com);
    EXPECT_LT((com - 0.4 * Eigen::Vector3d(r * c, 0.0, -r * s)).norm(), 1e-13);
}

} // namespace bf::dynamics::test
