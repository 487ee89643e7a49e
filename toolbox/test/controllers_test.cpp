#include "bf/dynamics/impedance.hpp"
#include "bf/dynamics/lie.hpp"

#include "running.hpp"

#include <Eigen/Geometry>

#include <cmath>

namespace bf::toolbox::test {
namespace {

const std::string arm_joints = "{'r_shoulder_pitch', 'r_shoulder_roll', 'r_shoulder_yaw', 'r_elbow', "
                               "'r_wrist_prosup', 'r_wrist_pitch', 'r_wrist_yaw'}";
constexpr int arm_size = 7;

const dynamics::Model& arm_model() {
    static const auto model =
        dynamics::Model::load(BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf",
                              {"r_shoulder_pitch", "r_shoulder_roll", "r_shoulder_yaw", "r_elbow",
                               "r_wrist_prosup", "r_wrist_pitch", "r_wrist_yaw"},
                              {0, 0, -9.81}, {}, false);
    return model;
}

/// The arm on a fixed base, in a world where there is one, beside a controller `x`.
std::string arm_with(const std::string& block, const std::string& inputs, const std::string& connections,
                     const std::string& others = "") {
    return "model: m\nstep: 0.001\ninputs: {" + inputs +
           "}\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, floating_base: false, joints: \"" +
           arm_joints + "\"}\n" + others + "  x: {block: WholeBodyToolbox/" + block + "}\nconnections:\n" +
           connections;
}
const std::string arm_world =
    "  world: {block: WholeBodyToolbox/MujocoWorld, joint_damping: 0, joint_friction: 0, "
    "initial_joints: \"[-0.3 0.4 0.1 0.9 0 0 0]\"}\n";

Vector some_vector(int size, double shift = 0) {
    return Vector::NullaryExpr(size,
                               [shift](Eigen::Index i) { return 0.3 * std::sin(1.7 * double(i) + shift); });
}

} // namespace

TEST(Controllers, RefuseGainsThatAreNoNumbersToMultiplyWith) {
    for (const std::string block :
         {"JointPID, P: Inf", "JointPID, I: Inf", "JointPID, D: Inf", "JointImpedance, stiffness: Inf",
          "JointImpedance, damping: Inf", "CartesianImpedance, frame: r_hand, stiffness: Inf",
          "CartesianImpedance, frame: r_hand, damping: Inf", "CartesianPID, D: Inf", "CartesianPID, P: Inf",
          "MomentumObserver, frames: \"{'r_hand'}\", damping: Inf", "CartesianTrajectory, duration: Inf",
          "DcmController, gain: Inf", "DcmPlanner, height: Inf", "SwingFoot, apex: Inf",
          "CenterOfMassTask, kp: Inf"})
        expect_contains(refusal(arm_with(block, "", "  c: end\n",
                                         "  c: {block: Constant}\n  end: {block: Terminator}\n")),
                        ", but is inf");
}

TEST(JointPidBlock, IsTheDiscretePidOfTheErrorWithTheDerivativeOfMeasuredVelocities) {
    Running run(arm_with("JointPID, P: 20, I: 5, D: 2",
                         "s: {shape: 7}, v: {shape: 7}, t: {shape: 7}, u: {shape: 7}, f: {shape: 7}",
                         "  s: [x.s, e.u2]\n  v: x.s_dot\n  t: [x.s_target, e.u1]\n  u: x.s_dot_target\n  f: "
                         "x.tau_target\n  e: pid\n",
                         "  e: {block: Sum, signs: +-}\n  pid: {block: DiscretePID, P: 20, I: 5}\n"));
    for (int k = 0; k < 20; ++k) {
        const Vector s_dot = some_vector(7, k), target = some_vector(7, 2 * k), f = some_vector(7, 3);
        run.set("s", some_vector(7, 0.1 * k))
            .set("t", some_vector(7, 1 + 0.1 * k))
            .set("v", s_dot)
            .set("u", target);
        run.set("f", f);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Matrix expected = run.get("pid") + 2 * (target - s_dot) + f;
        EXPECT_LT((run.get("x.tau") - expected).norm(), 1e-12) << k;
        EXPECT_EQ(run.get("x.error"), run.get("e"));
    }
}

TEST(JointPidBlock, FiltersTheDerivativeOfPositionsLikeTheDiscretePid) {
    Running run(
        arm_with("JointPID, P: 20, D: 3, N: 50, derivative: filtered", "s: {shape: 7}",
                 "  s: [x.s, e.u2]\n  zero: [x.s_target, e.u1]\n  e: pid\n",
                 "  zero: {block: Constant, value: \"zeros(7,1)\"}\n  e: {block: Sum, signs: +-}\n  pid: "
                 "{block: DiscretePID, P: 20, D: 3, N: 50, filter_method: backward}\n"));
    for (int k = 0; k < 20; ++k) {
        run.set("s", some_vector(7, 0.2 * k));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_LT((run.get("x.tau") - run.get("pid")).norm(), 1e-10) << k;
    }
}

TEST(JointPidBlock, StaysWithinItsLimitsAndDoesNotWindUp) {
    for (const std::string way : {"clamping", "back_calculation", "none"}) {
        Running run(arm_with(
            "JointPID, P: 20, I: 500, tracking_time: 0.01, max_torque: 1, anti_windup: " + way,
            "t: {shape: 7}, f: {shape: 7}", "  zero: [x.s, x.s_dot]\n  t: x.s_target\n  f: x.tau_target\n",
            "  zero: {block: Constant, value: \"zeros(7,1)\"}\n"));
        run.set("t", Vector::Constant(7, 0.1)).set("f", Vector::Constant(7, 0.5));
        for (int k = 0; k < 500; ++k) {
            ASSERT_TRUE(run.step());
            EXPECT_LE(run.get("x.tau").maxCoeff(), 1);
        }
        EXPECT_EQ(run.get("x.tau").minCoeff(), 1);
        run.set("t", Vector::Constant(7, -0.01)).set("f", Vector::Zero(7));
        int steps = 0;
        for (; steps < 3000; ++steps) {
            ASSERT_TRUE(run.step());
            if (run.get("x.tau")(0, 0) < 0.999) break;
        }
        // The error of 0.1 has let the integral grow to 25 where nothing holds it.
        if (way == "none")
            EXPECT_GT(steps, 1000);
        else
            EXPECT_LT(steps, 300);
    }
}

TEST(CartesianPidBlock, GivesTheCommandOfItsEquation) {
    const std::string
        inputs = "H: {shape: \"[4 4]\"}, T: {shape: \"[4 4]\"}, v: {shape: 6}, u: {shape: 6}, a: {shape: "
                 "6}",
        poses = "  H: x.w_H_f\n  T: x.w_H_target\n  u: x.v_target\n";
    Running run(arm_with("CartesianPID, P: 9, D: 4, I: 2", inputs, poses + "  v: x.v\n  a: x.a_target\n"));
    Running velocity(arm_with("CartesianPID, result: velocity, P: 3, limit: 0.5",
                              "H: {shape: \"[4 4]\"}, T: {shape: \"[4 4]\"}, u: {shape: 6}", poses));
    Transform H = Transform::Identity(), T = H;
    T.topRightCorner<3, 1>() << 0.1, 0.2, -0.3;
    T.topLeftCorner<3, 3>() = Eigen::AngleAxisd(0.4, Vector3::UnitZ()).toRotationMatrix();
    Vector6 e;
    e << 0.1, 0.2, -0.3, 0, 0, 0.4;
    const Vector v = some_vector(6), u = some_vector(6, 1), a = some_vector(6, 2);
    run.set("H", H).set("T", T).set("v", v).set("u", u).set("a", a);
    velocity.set("H", H).set("T", T).set("u", 0.2 * u);
    for (int k = 0; k < 5; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_LT((run.get("x.command") - (a + 4 * (u - v) + 9 * e + 2 * 0.001 * k * e)).norm(), 1e-12);
        EXPECT_LT((run.get("x.error") - e).norm(), 1e-14);
    }
    ASSERT_TRUE(velocity.step());
    EXPECT_LT((velocity.get("x.command") - (0.2 * u + 3 * e).cwiseMax(-0.5).cwiseMin(0.5)).norm(), 1e-12);
    run.set("T", Matrix::Zero(4, 4));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(), "x: w_H_target holds no rotation");
}

TEST(JointImpedanceBlock, MakesJointsThatDecayAsTheirEquationSays) {
    // M (s_ddot - s_ddot_target) + D e_dot + K e = 0 of the whole arm; with K = D = 0 and its own
    // acceleration as target the motion is that of the target.
    Running run(
        arm_with("JointImpedance, stiffness: 0, damping: 0", "a: {shape: 7}",
                 "  world.s: [x.s, x.s_target]\n  world.s_dot: x.s_dot\n  a: x.s_ddot_target\n  x.tau: "
                 "world.tau\n",
                 arm_world));
    run.set("a", Vector::Constant(7, 0.5));
    Matrix begin;
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (k == 0) begin = run.get("world.s");
    }
    EXPECT_LT((run.get("world.s_dot") - Vector::Constant(7, 0.5 * 0.099)).norm(), 1e-3);
    EXPECT_LT((run.get("world.s") - begin - Vector::Constant(7, 0.25 * 0.099 * 0.099)).norm(), 1e-3);
}

TEST(JointImpedanceBlock, HoldsAnArmAgainstGravityWhereItIsWanted) {
    Running run(
        arm_with("JointImpedance, compensation: gravity, stiffness: 5, damping: 0.5", "",
                 "  world.s: x.s\n  world.s_dot: x.s_dot\n  goal: x.s_target\n  x.tau: world.tau\n",
                 arm_world + "  goal: {block: Constant, value: \"[-0.2; 0.5; 0.2; 1; 0.1; 0.1; -0.1]\"}\n"));
    for (int k = 0; k < 3000; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_LT(run.get("x.error").norm(), 2e-2);
}

TEST(CartesianImpedanceBlock, GivesTheTorquesOfItsEquation) {
    Running run(arm_with("CartesianImpedance, frame: r_hand",
                         "s: {shape: 7}, ds: {shape: 7}, T: {shape: \"[4 4]\"}, v: {shape: 6}, f: {shape: 6}",
                         "  s: x.s\n  ds: x.s_dot\n  T: x.w_H_target\n  v: x.v_target\n  f: x.f_target\n"));
    const Vector s = some_vector(arm_size), s_dot = some_vector(arm_size, 2), v = some_vector(6),
                 f = some_vector(6, 1);
    Transform target = Transform::Identity();
    target.topRightCorner<3, 1>() << -0.2, 0.1, 0.1;
    run.set("s", s).set("ds", s_dot).set("T", target).set("v", v).set("f", f);
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    dynamics::Data data(arm_model());
    const auto hand = arm_model().frame("r_hand");
    dynamics::set_state(arm_model(), data, Transform::Identity(), s, Vector6::Zero(), s_dot);
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, arm_size);
    Vector h(arm_size);
    Transform H;
    dynamics::jacobian(arm_model(), data, hand, J);
    dynamics::bias_forces(arm_model(), data, h);
    dynamics::forward_kinematics(arm_model(), data, hand, H);
    Vector6 K, D;
    K << 100, 100, 100, 10, 10, 10;
    D << 20, 20, 20, 1, 1, 1;
    const Vector6 wrench =
        K.cwiseProduct(dynamics::pose_error(H, target)) + D.cwiseProduct(v - J * s_dot) + f;
    EXPECT_LT((run.get("x.f") - wrench).norm(), 1e-10);
    EXPECT_LT((run.get("x.tau") - (J.transpose() * wrench + h)).norm(), 1e-10);
}

TEST(CartesianImpedanceBlock, HoldsAHandAtAPoseAndSettlesThePostureAside) {
    const auto end = [](const std::string& posture) {
        Running run(arm_with(
            "CartesianImpedance, frame: r_hand, stiffness: [300 300 300 10 10 10], posture: true, damping: "
            "[30 "
            "30 30 0.5 0.5 0.5], posture_damping: 0.3, posture_stiffness: 3",
            "T: {shape: \"[4 4]\"}, s: {shape: 7}",
            "  world.s: [x.s, hand.s]\n  world.s_dot: x.s_dot\n  T: x.w_H_target\n  s: x.s_target\n  "
            "x.tau: world.tau\n",
            arm_world + "  hand: {block: WholeBodyToolbox/ForwardKinematics, frame: r_hand}\n"));
        Transform target;
        Vector s(7);
        s << -0.3, 0.4, 0.1, 0.9, 0, 0, 0;
        dynamics::Data data(arm_model());
        dynamics::set_state(arm_model(), data, Transform::Identity(), s, Vector6::Zero(), Vector::Zero(7));
        dynamics::forward_kinematics(arm_model(), data, arm_model().frame("r_hand"), target);
        if (posture == "other") s[1] += 0.3;
        run.set("T", target).set("s", s);
        for (int k = 0; k < 3000; ++k) EXPECT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_LT((run.get("hand") - target).norm(), 5e-3);
        return run.get("world.s");
    };
    EXPECT_GT((end("same") - end("other")).norm(), 0.02) << "the joints that the hand leaves free move";
}

TEST(CartesianImpedanceBlock, RefusesAPostureOfAFloatingBase) {
    expect_contains(
        refusal("model: m\nstep: 0.01\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, joints: \"" +
                icub_joints +
                "\"}\n  x: {block: WholeBodyToolbox/CartesianImpedance, frame: r_hand, posture: true}\n"),
        "x: posture is true, but the robot's base floats");
    expect_contains(refusal(arm_with("CartesianImpedance, frame: r_han", "s: {shape: 7}", "  s: x.s\n")),
                    "x: frame 'r_han' is not a link");
}

} // namespace bf::toolbox::test
