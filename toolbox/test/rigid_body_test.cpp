#include "running.hpp"

#include <Eigen/Geometry>
#include <fstream>
#include <iDynTree/EigenHelpers.h>
#include <iDynTree/FreeFloatingState.h>
#include <iDynTree/KinDynComputations.h>
#include <iDynTree/ModelLoader.h>
#include <random>
#include <unistd.h>

namespace bf::toolbox::test {
namespace {

using iDynTree::make_matrix_view;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Matrix3X = Eigen::Matrix<double, 3, Eigen::Dynamic>;

const std::string icub = BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf";

struct State {
    Transform w_H_b = Transform::Identity();
    Vector6 v_b, v_b_dot;
    Vector s, s_dot, s_ddot;
};

State random_state(int n, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto draw = [&](int size) {
        return Vector(Vector::NullaryExpr(size, [&](Eigen::Index) { return uniform(random); }));
    };
    State state;
    const Eigen::Vector4d quaternion = draw(4);
    state.w_H_b.topLeftCorner<3, 3>() = Eigen::Quaterniond(quaternion).normalized().toRotationMatrix();
    state.w_H_b.topRightCorner<3, 1>() = 3 * draw(3);
    state.v_b = 2 * draw(6);
    state.v_b_dot = 3 * draw(6);
    state.s = draw(n);
    state.s_dot = 2 * draw(n);
    state.s_ddot = 3 * draw(n);
    return state;
}

void set(Running& run, const State& state) {
    run.set("w_H_b", state.w_H_b).set("s", state.s).set("v_b", state.v_b).set("s_dot", state.s_dot);
    run.set("v_b_dot", state.v_b_dot).set("s_ddot", state.s_ddot);
}

/// iDynTree in the mixed representation.
struct Oracle {
    iDynTree::KinDynComputations k;
    Eigen::Vector3d gravity{0, 0, -9.81};

    explicit Oracle(const std::vector<std::string>& joints) {
        iDynTree::ModelLoader loader;
        EXPECT_TRUE(loader.loadReducedModelFromFile(icub, joints));
        EXPECT_TRUE(k.loadRobotModel(loader.model()));
        EXPECT_TRUE(k.setFrameVelocityRepresentation(iDynTree::MIXED_REPRESENTATION));
    }
    void set(const State& x) { EXPECT_TRUE(k.setRobotState(x.w_H_b, x.s, x.v_b, x.s_dot, gravity)); }
    int columns() const { return static_cast<int>(k.model().getNrOfDOFs()) + 6; }

    Vector forces(const Vector6& base, const Vector& s_ddot) {
        iDynTree::Vector6 base_acceleration;
        iDynTree::toEigen(base_acceleration) = base;
        iDynTree::JointDOFsDoubleArray joints(k.model());
        iDynTree::toEigen(joints) = s_ddot;
        iDynTree::FreeFloatingGeneralizedTorques torques(k.model());
        EXPECT_TRUE(k.inverseDynamics(base_acceleration, joints, iDynTree::LinkNetExternalWrenches(k.model()),
                                      torques));
        Vector all(columns());
        all << iDynTree::toEigen(torques.baseWrench()), iDynTree::toEigen(torques.jointTorques());
        return all;
    }
};

void expect_near(const Matrix& ours, const Matrix& theirs, const char* what) {
    ASSERT_EQ(ours.rows(), theirs.rows()) << what;
    ASSERT_EQ(ours.cols(), theirs.cols()) << what;
    EXPECT_LT((ours - theirs).cwiseAbs().maxCoeff(), 1e-9) << what;
}

/// Every model block, each on the same inputs.
std::string every_block(const std::string& joints, const std::string& gravity, int n) {
    const auto block = [](const std::string& name, const std::string& type,
                          const std::string& settings = {}) {
        return "  " + name + ": {block: WholeBodyToolbox/" + type + settings + "}\n";
    };
    const std::vector<std::string> position = {"fk", "fk_com", "J", "J_com", "M", "A", "g"};
    const std::vector<std::string> velocity = {"com",        "dot", "dot_com", "h",     "momentum", "tau",
                                               "accelerate", "c",   "C",       "M_dot", "bias"};
    std::string text = "model: m\nstep: 0.01\ninputs:\n  w_H_b: {shape: \"[4 4]\"}\n  v_b: {shape: 6}\n  "
                       "v_b_dot: {shape: 6}\n  f1: {shape: 6}\n  f2: {shape: 6}\n";
    for (const char* input : {"s", "s_dot", "s_ddot", "torques"})
        text += "  " + std::string(input) + ": {shape: " + std::to_string(n) + "}\n";
    text += "blocks:\n" +
            block("robot", "Configuration",
                  ", robot: iCubGazeboV2_5, joints: \"" + joints + "\", gravity: \"" + gravity + "\"") +
            block("fk", "ForwardKinematics", ", frame: l_sole") +
            block("fk_com", "ForwardKinematics", ", frame: com") + block("com", "CenterOfMass") +
            block("J", "Jacobian", ", frame: r_hand") + block("J_com", "Jacobian", ", frame: com") +
            block("dot", "DotJNu", ", frame: l_sole") + block("dot_com", "DotJNu", ", frame: com") +
            block("M", "MassMatrix") + block("tau", "InverseDynamics") + block("h", "GetBiasForces") +
            block("g", "GetGravityForces") + block("momentum", "CentroidalMomentum") +
            block("A", "CentroidalTotalMomentumMatrix") +
            block("accelerate", "ForwardDynamics", ", frames: \"{'l_sole', 'r_hand'}\"") +
            block("c", "GetCoriolisForces") + block("C", "CoriolisMatrix") +
            block("M_dot", "MassMatrixDerivative") + block("bias", "DotANu") +
            block("relative", "RelativeTransform", ", frame1: l_sole, frame2: r_hand") +
            block("J_relative", "RelativeJacobian", ", reference: l_sole, frame: r_hand") + "connections:\n";
    const auto fan = [&](const std::string& input, std::vector<std::string> to) {
        text += "  " + input + ": [";
        for (const auto& name : to) text += name + "." + input + ", ";
        text += "]\n";
    };
    std::vector<std::string> both = position;
    both.insert(both.end(), velocity.begin(), velocity.end());
    fan("w_H_b", both);
    both.insert(both.end(), {"relative", "J_relative"});
    fan("s", both);
    fan("v_b", velocity);
    fan("s_dot", velocity);
    fan("v_b_dot", {"tau"});
    fan("s_ddot", {"tau"});
    text += "  torques: accelerate.tau\n  f1: accelerate.wrench_l_sole\n  f2: accelerate.wrench_r_hand\n";
    return text;
}

void compare(Running& run, Oracle& oracle, const State& x) {
    set(run, x);
    oracle.set(x);
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    auto& k = oracle.k;
    const int columns = oracle.columns();
    const auto homogeneous = [](const iDynTree::Transform& H) {
        return Matrix(iDynTree::toEigen(H.asHomogeneousTransform()));
    };
    const Vector3 com = iDynTree::toEigen(k.getCenterOfMassPosition());
    Transform at_com = Transform::Identity();
    at_com.topRightCorner<3, 1>() = com;
    expect_near(run.get("fk"), homogeneous(k.getWorldTransform("l_sole")), "ForwardKinematics");
    expect_near(run.get("fk_com"), at_com, "ForwardKinematics of com");
    expect_near(run.get("com.com"), com, "CenterOfMass");
    expect_near(run.get("com.com_dot"), iDynTree::toEigen(k.getCenterOfMassVelocity()), "its velocity");

    Matrix6X J(6, columns);
    ASSERT_TRUE(k.getFrameFreeFloatingJacobian("r_hand", make_matrix_view(J)));
    expect_near(run.get("J"), J, "Jacobian");
    Matrix3X J_com(3, columns);
    ASSERT_TRUE(k.getCenterOfMassJacobian(make_matrix_view(J_com)));
    J.setZero();
    J.topRows<3>() = J_com;
    expect_near(run.get("J_com"), J, "Jacobian of com");
    ASSERT_TRUE(k.getCentroidalTotalMomentumJacobian(make_matrix_view(J)));
    expect_near(run.get("A"), J, "CentroidalTotalMomentumMatrix");

    expect_near(run.get("dot"), iDynTree::toEigen(k.getFrameBiasAcc("l_sole")), "DotJNu");
    Vector6 dot_com = Vector6::Zero();
    dot_com.head<3>() = iDynTree::toEigen(k.getCenterOfMassBiasAcc());
    expect_near(run.get("dot_com"), dot_com, "DotJNu of com");

    Matrix M(columns, columns);
    ASSERT_TRUE(k.getFreeFloatingMassMatrix(make_matrix_view(M)));
    expect_near(run.get("M"), M, "MassMatrix");
    expect_near(run.get("momentum"), iDynTree::toEigen(k.getCentroidalTotalMomentum().asVector()),
                "CentroidalMomentum");
    expect_near(run.get("tau"), oracle.forces(x.v_b_dot, x.s_ddot), "InverseDynamics");
    const Vector rest = Vector::Zero(columns - 6);
    expect_near(run.get("h"), oracle.forces(Vector6::Zero(), rest), "GetBiasForces");

    expect_near(run.get("relative"), homogeneous(k.getRelativeTransform("l_sole", "r_hand")),
                "RelativeTransform");
    Matrix6X relative(6, columns - 6);
    ASSERT_TRUE(k.getRelativeJacobian(k.getFrameIndex("l_sole"), k.getFrameIndex("r_hand"),
                                      make_matrix_view(relative)));
    expect_near(run.get("J_relative"), relative, "RelativeJacobian");

    // Pushed by its own inertia and weight, less what the wrenches do, the robot moves as it was told.
    const Vector forces = oracle.forces(x.v_b_dot, x.s_ddot);
    ASSERT_TRUE(k.getFrameFreeFloatingJacobian("l_sole", make_matrix_view(J)));
    Matrix contacts(12, columns);
    contacts << J, run.get("J");
    // The base's six forces come from the two wrenches alone, the least ones.
    const Matrix on_base = contacts.leftCols<6>().transpose();
    const Vector wrenches = on_base.completeOrthogonalDecomposition().solve(forces.head<6>());
    run.set("f1", wrenches.head<6>()).set("f2", wrenches.tail<6>());
    run.set("torques", (forces - contacts.transpose() * wrenches).tail(columns - 6));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    expect_near(run.get("accelerate.v_b_dot"), x.v_b_dot, "ForwardDynamics, base");
    expect_near(run.get("accelerate.s_ddot"), x.s_ddot, "ForwardDynamics, joints");

    Vector nu(columns);
    nu << x.v_b, x.s_dot;
    const Vector h = oracle.forces(Vector6::Zero(), rest);
    expect_near(run.get("C") * nu, run.get("c"), "CoriolisMatrix");
    expect_near(run.get("C") + run.get("C").transpose(), run.get("M_dot"), "MassMatrixDerivative");
    // The momentum of a robot that is free to fall changes by its weight alone.
    Vector6 momentum_rate = run.get("A") * M.ldlt().solve(-h) + run.get("bias");
    momentum_rate.head<3>() -= M(0, 0) * oracle.gravity;
    expect_near(momentum_rate, Vector6::Zero(), "DotANu");

    State still = x;
    still.v_b.setZero();
    still.s_dot.setZero();
    oracle.set(still);
    const Vector g = oracle.forces(Vector6::Zero(), rest);
    expect_near(run.get("g"), g, "GetGravityForces");
    expect_near(run.get("c"), h - g, "GetCoriolisForces");
}

const std::vector<std::string> five = {"r_knee", "l_elbow", "torso_yaw", "l_hip_yaw", "r_shoulder_roll"};

} // namespace

TEST(ModelBlocks, AgreeWithIDynTreeInAnyOrderOfJointsAndObliqueGravity) {
    Running run(
        every_block("{'r_knee', 'l_elbow', 'torso_yaw', 'l_hip_yaw', 'r_shoulder_roll'}", "[1 -2 -9]", 5));
    Oracle oracle(five);
    oracle.gravity = {1, -2, -9};
    std::mt19937 random(1);
    for (int k = 0; k < 20; ++k) compare(run, oracle, random_state(5, random));
}

TEST(ModelBlocks, AgreeWithIDynTreeOnTheBalancingJoints) {
    Running run(every_block(icub_joints, "[0 0 -9.81]", 23));
    std::vector<std::string> joints;
    for (std::size_t from = icub_joints.find('\''); from != std::string::npos;) {
        const auto to = icub_joints.find('\'', from + 1);
        joints.push_back(icub_joints.substr(from + 1, to - from - 1));
        from = icub_joints.find('\'', to + 1);
    }
    ASSERT_EQ(joints.size(), 23u);
    Oracle oracle(joints);
    std::mt19937 random(2);
    for (int k = 0; k < 20; ++k) compare(run, oracle, random_state(23, random));
}

TEST(ForwardDynamics, RefusesUnknownFramesAndNamesTheJointThatMovesNothing) {
    const auto model = [](const std::string& robot, const std::string& frames) {
        return "model: m\nstep: 0.01\ninputs: [s, v, tau]\nblocks:\n"
               "  robot: {block: WholeBodyToolbox/Configuration, " +
               robot + ", floating_base: false}\n  x: {block: WholeBodyToolbox/ForwardDynamics, frames: \"" +
               frames + "\"}\nconnections: {s: x.s, v: x.s_dot, tau: x.tau}\n";
    };
    const std::string knee = "joints: \"{'l_knee'}\"";
    expect_contains(refusal(model(knee, "{'l_sol'}")), "model.yaml:6:3: x: frame 'l_sol' is not a link");
    expect_contains(refusal(model(knee, "{'l_sole'}")), "x: input 'wrench_l_sole' is not connected");
    expect_contains(refusal(model(knee, "{'l_sole', 'l_sole'}")), "wrench_l_sole");

    const std::string urdf = "/tmp/bf_massless_" + std::to_string(getpid()) + ".urdf";
    std::ofstream(urdf)
        << "<robot name='r'><link name='base'/><link name='tip'/><link name='arm'><inertial><mass "
           "value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
           "<joint name='swing' type='continuous'><parent link='base'/><child link='arm'/></joint>"
           "<joint name='turn' type='continuous'><parent link='arm'/><child link='tip'/></joint></robot>";
    Running run(model("robot: \"'" + urdf + "'\"", "{}"));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(),
                    "x: the mass matrix is singular: s_ddot[turn] accelerates no mass");
    unlink(urdf.c_str());
}

TEST(ModelBlocks, OfDifferentStatesDoNotDisturbEachOther) {
    // Two mass matrices of one robot, asked in turn at two states, and a third block at the first state
    // again.
    const std::string text = R"(
model: m
step: 0.01
inputs: {H1: {shape: "[4 4]"}, s1: {shape: 2}, H2: {shape: "[4 4]"}, s2: {shape: 2}}
blocks:
  robot: {block: WholeBodyToolbox/Configuration, joints: "{'l_knee', 'r_elbow'}"}
  M1: {block: WholeBodyToolbox/MassMatrix}
  M2: {block: WholeBodyToolbox/MassMatrix}
  again: {block: WholeBodyToolbox/MassMatrix}
connections: {H1: [M1.w_H_b, again.w_H_b], s1: [M1.s, again.s], H2: M2.w_H_b, s2: M2.s}
)";
    Running run(text);
    std::mt19937 random(3);
    Matrix last;
    for (int k = 0; k < 5; ++k) {
        const State a = random_state(2, random), b = random_state(2, random);
        run.set("H1", a.w_H_b).set("s1", a.s).set("H2", b.w_H_b).set("s2", b.s);
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.get("M1"), run.get("again"));
        EXPECT_GT((run.get("M1") - run.get("M2")).norm(), 1e-3);
        run.set("H2", a.w_H_b).set("s2", a.s);
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.get("M1"), run.get("M2"));
    }
}

namespace {

std::string one_block(const std::string& configuration, const std::string& block) {
    return "model: m\nstep: 0.01\ninputs: {H: {shape: \"[4 4]\"}, s: {}}\nblocks:\n" + configuration +
           "  x: " + block + "\nconnections: {H: x.w_H_b, s: x.s}\n";
}
const std::string knees =
    "  robot: {block: WholeBodyToolbox/Configuration, joints: \"{'l_knee', 'r_knee'}\"}\n";

} // namespace

TEST(ModelBlocks, TakeTheirSizesFromTheConfiguration) {
    Running run(one_block(knees, "{block: WholeBodyToolbox/Jacobian, frame: l_sole}"));
    EXPECT_EQ(run.size("x"), (Size{6, 8, true}));
    EXPECT_EQ(run.size("s"), (Size{2, 1, false}));
}

TEST(ModelBlocks, RefuseAnUnknownFrameAndNameSimilarOnes) {
    const auto text = refusal(one_block(knees, "{block: WholeBodyToolbox/Jacobian, frame: l_sol}"));
    expect_contains(text, "model.yaml:6:3: x: ");
    expect_contains(text, "l_sol'");
    expect_contains(text, "l_sole");
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 0) << text;
}

TEST(ModelBlocks, KnowTheFrameComOnlyWhereItHasAMeaning) {
    const std::string text = "model: m\nstep: 0.01\ninputs: {s: {}}\nblocks:\n" + knees +
                             "  x: {block: WholeBodyToolbox/RelativeTransform, frame1: l_sole, frame2: com}\n"
                             "connections: {s: x.s}\n";
    expect_contains(refusal(text), "x: ");
    expect_contains(refusal(text), "'com'");
}

TEST(ModelBlocks, RefuseSignalsOfAnotherNumberOfJoints) {
    const std::string text =
        "model: m\nstep: 0.01\ninputs: {H: {shape: \"[4 4]\"}, s: {shape: 3}}\nblocks:\n" + knees +
        "  x: {block: WholeBodyToolbox/MassMatrix}\nconnections: {H: x.w_H_b, s: x.s}\n";
    expect_contains(refusal(text), "x: input 's' needs n = 3, but n is already 2");
}

TEST(Configuration, IsMissedByBlocksThatNeedIt) {
    const auto text = refusal(one_block("", "{block: WholeBodyToolbox/MassMatrix}"));
    expect_contains(
        text, "model.yaml:5:3: x: needs a robot configuration, and no enclosing subsystem has one; add a "
              "block that provides it");
}

TEST(Configuration, StandsOnlyOnceInASubsystem) {
    auto second = knees;
    second.replace(second.find("robot"), 5, "twin");
    const auto text = refusal(one_block(knees + second, "{block: WholeBodyToolbox/MassMatrix}"));
    expect_contains(text, "x: finds more than one robot configuration around it: robot and twin");
}

TEST(Configuration, OfTheNearestEnclosingSubsystemCounts) {
    const std::string text = R"(
model: m
step: 0.01
inputs: {H: {shape: "[4 4]"}, s2: {shape: 2}, s3: {shape: 3}}
blocks:
  robot: {block: WholeBodyToolbox/Configuration, joints: "{'l_knee', 'r_knee'}"}
  near:
    inputs: [H, s]
    outputs: [M]
    blocks:
      robot: {block: WholeBodyToolbox/Configuration, joints: "{'l_elbow', 'r_elbow', 'l_knee'}"}
      deeper:
        inputs: [H, s]
        outputs: [M]
        blocks: {mass: {block: WholeBodyToolbox/MassMatrix}}
        connections: {H: mass.w_H_b, s: mass.s, mass: M}
    connections: {H: deeper.H, s: deeper.s, deeper: M}
  far:
    inputs: [H, s]
    outputs: [M]
    blocks: {mass: {block: WholeBodyToolbox/MassMatrix}}
    connections: {H: mass.w_H_b, s: mass.s, mass: M}
connections: {H: [near.H, far.H], s2: far.s, s3: near.s}
)";
    Running run(text);
    EXPECT_EQ(run.size("near.deeper.mass.M"), (Size{9, 9, true}));
    EXPECT_EQ(run.size("far.mass.M"), (Size{8, 8, true}));
}

TEST(Configuration, RefusesUnknownRobotsJointsAndGravity) {
    const auto with = [](const std::string& settings) {
        return refusal("model: m\nstep: 0.01\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, " +
                       settings + "}\n");
    };
    const auto robot = with("robot: iCubGazeboV9");
    expect_contains(robot, "model.yaml:4:3: robot: ");
    expect_contains(robot, "iCubGazeboV9");
    const auto joint = with("joints: \"{'l_kne'}\"");
    expect_contains(joint, "model.yaml:4:3: robot: ");
    expect_contains(joint, "'l_kne'");
    expect_contains(joint, "l_knee");
    expect_contains(with("joints: \"{'l_knee', 'l_knee'}\""), "l_knee");
    expect_contains(with("gravity: \"[0 9.81]\""),
                    "robot: argument 'gravity' has 2 elements; give three, e.g. [0 0 -9.81]");
}

TEST(Limits, OfTheModelAreThoseOfTheUrdf) {
    Running run("model: m\nstep: 0.01\nblocks:\n" + knees + "  x: {block: WholeBodyToolbox/GetLimits}\n");
    ASSERT_TRUE(run.step());
    iDynTree::ModelLoader loader;
    ASSERT_TRUE(loader.loadReducedModelFromFile(icub, {"l_knee", "r_knee"}));
    for (int i = 0; i < 2; ++i) {
        const auto joint =
            loader.model().getJoint(loader.model().getJointIndex(i == 0 ? "l_knee" : "r_knee"));
        EXPECT_EQ(run.get("x.minimum")(i), joint->getMinPosLimit(0));
        EXPECT_EQ(run.get("x.maximum")(i), joint->getMaxPosLimit(0));
    }
    EXPECT_LT(run.get("x.minimum")(0), run.get("x.maximum")(0));
}

} // namespace bf::toolbox::test
