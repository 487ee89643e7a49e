#include "bf/core/interrupt.hpp"
#include "running.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>

namespace bf::toolbox::test {
namespace {

const std::string arm = "\"{'torso_pitch', 'torso_roll', 'torso_yaw', 'r_shoulder_pitch', 'r_shoulder_roll', "
                        "'r_shoulder_yaw', 'r_elbow', 'r_wrist_prosup', 'r_wrist_pitch', 'r_wrist_yaw'}\"";

/// The iCub's arm on a fixed base, with the pose of its hand at what the block found.
std::string hand_model(const std::string& settings, const std::string& inputs,
                       const std::string& connections) {
    return "model: m\nstep: 0.01\ninputs: {" + inputs +
           "}\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, floating_base: false, joints: " +
           arm + "}\n  ik: {block: WholeBodyToolbox/InverseKinematics, " + settings +
           "}\n  hand: {block: WholeBodyToolbox/ForwardKinematics, frame: r_hand}\nconnections:\n  ik.s: "
           "hand.s\n" +
           connections;
}
const std::string hand_pose = "H: {shape: \"[4 4]\"}", to_pose = "  H: ik.w_H_r_hand\n";

Transform pose(double x, double y, double z, double turn = 0.0) {
    Transform H = Transform::Identity();
    H.topLeftCorner<3, 3>() = Eigen::AngleAxisd(turn, Vector3::UnitZ()).toRotationMatrix();
    H.topRightCorner<3, 1>() << x, y, z;
    return H;
}

} // namespace

TEST(InverseKinematics, PutsTheHandWhereItIsWanted) {
    Running run(hand_model("pose: \"{'r_hand'}\"", hand_pose, to_pose));
    run.set("H", pose(0.0, 0.0, 0.0));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("ik.status"), 2) << "within the body";
    int reached = 0;
    for (int k = 0; k < 400; ++k) {
        const double angle = 2.0 * M_PI * k / 200.0;
        const Transform wanted =
            pose(-0.28, 0.15 + 0.03 * std::cos(angle), 0.12 + 0.03 * std::sin(angle), -0.2);
        run.set("H", wanted);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (run.scalar("ik.status") != 0) continue;
        ++reached;
        EXPECT_LT((run.get("hand") - wanted).cwiseAbs().maxCoeff(), 2e-6);
    }
    EXPECT_GT(reached, 380);
}

TEST(InverseKinematics, TellsWhatIsLeftOfATargetOutOfReach) {
    Running run(hand_model("position: \"{'r_hand'}\"", "p: {shape: 3}", "  p: ik.p_r_hand\n"));
    const Vector3 far(-3.0, 0.5, 0.2);
    run.set("p", far);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("ik.status"), 2);
    const Vector3 left = far - run.get("hand").topRightCorner<3, 1>();
    EXPECT_LT((run.get("ik.error").topRows<3>() - left).norm(), 1e-12);
    EXPECT_EQ(run.get("ik.error").bottomRows<3>().norm(), 0.0);
}

TEST(InverseKinematics, MovesNoJointFasterThanItMay) {
    Running run(
        hand_model("position: \"{'r_hand'}\", max_speed: 0.5", "p: {shape: 3}", "  p: ik.p_r_hand\n"));
    run.set("p", Vector3(-0.25, 0.1, 0.1));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("ik.status"), 0);
    run.set("p", Vector3(-0.2, 0.15, 0.25));
    Matrix last = run.get("ik.s");
    int steps = 0;
    for (; steps < 500; ++steps) {
        ASSERT_TRUE(run.step());
        EXPECT_LE((run.get("ik.s") - last).cwiseAbs().maxCoeff(), 0.005 + 1e-12);
        last = run.get("ik.s");
        if (run.scalar("ik.status") == 0) break;
    }
    EXPECT_GT(steps, 5);
    EXPECT_LT(steps, 500);
}

TEST(InverseKinematics, FindsTheBaseOverTheFeetAndTheCentreOfMass) {
    Running run(
        "model: m\nstep: 0.01\ninputs: {H: {shape: \"[4 4]\"}, l: {shape: \"[4 4]\"}, r: {shape: \"[4 4]\"}, "
        "c: {shape: 3}, s: {shape: 23}, ds: {shape: 23}, v: {shape: 6}}\nblocks:\n"
        "  robot: {block: WholeBodyToolbox/Configuration, joints: \"" +
        icub_joints +
        "\"}\n  ik: {block: WholeBodyToolbox/InverseKinematics, pose: \"{'l_sole', 'r_sole'}\", com: true, "
        "posture: true, posture_weights: 1e-9, finds_base: true}\n"
        "  left: {block: WholeBodyToolbox/ForwardKinematics, frame: l_sole}\n"
        "  right: {block: WholeBodyToolbox/ForwardKinematics, frame: r_sole}\n"
        "  com: {block: WholeBodyToolbox/CenterOfMass}\nconnections:\n"
        "  ik.w_H_b: [left.w_H_b, right.w_H_b, com.w_H_b]\n  ik.s: [left.s, right.s, com.s]\n"
        "  H: ik.w_H_b_0\n  s: [ik.s_0, ik.posture]\n  l: ik.w_H_l_sole\n  r: ik.w_H_r_sole\n"
        "  c: ik.com\n  ds: com.s_dot\n  v: com.v_b\n");
    Vector s = Vector::Zero(23);
    s(14) = s(20) = -0.6; // knees
    s(11) = s(17) = 0.3;  // hips
    s(15) = s(21) = -0.3; // ankles
    const Transform l = pose(0.0, -0.07, 0.0, M_PI), r = pose(0.02, 0.07, 0.0, M_PI);
    run.set("H", pose(0.0, 0.0, 0.6)).set("s", s).set("l", l).set("r", r);
    for (int k = 0; k < 100; ++k) {
        const Vector3 com(0.0, 0.02 * std::sin(0.1 * k), 0.48 + 0.0002 * k);
        run.set("c", com);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.scalar("ik.status"), 0) << k;
        EXPECT_LT((run.get("left") - l).cwiseAbs().maxCoeff(), 2e-6);
        EXPECT_LT((run.get("right") - r).cwiseAbs().maxCoeff(), 2e-6);
        EXPECT_LT((run.get("com.com") - com).cwiseAbs().maxCoeff(), 2e-6);
    }
}

TEST(InverseKinematics, RefusesWhatItCannotLookFor) {
    const auto with = [](const std::string& settings, const std::string& inputs = {},
                         const std::string& connections = "  {}\n") {
        return refusal(hand_model(settings, inputs, connections == "  {}\n" ? "" : connections));
    };
    expect_contains(with("pose: \"{'r_han'}\""), "ik: frame 'r_han' is not a link");
    expect_contains(with("iterations: 3"),
                    "ik: it has no target; give position, orientation, pose, com or posture");
    expect_contains(with("pose: \"{'r_hand'}\", finds_base: true", hand_pose, to_pose),
                    "ik: finds_base is true, but the robot's base is fixed");
    expect_contains(with("pose: \"{'r_hand'}\", tolerance: 0", hand_pose, to_pose), "tolerance");
    expect_contains(with("pose: \"{'r_hand'}\", weights: -1", hand_pose, to_pose), "weights");
    expect_contains(with("pose: \"{'r_hand'}\", weights: [1 2]", hand_pose, to_pose), "weights");
    expect_contains(with("pose: \"{'r_hand'}\""), "ik: input 'w_H_r_hand' is not connected");
    expect_contains(with("posture: true", "q: {shape: 3}", "  q: ik.posture\n"), "'posture' needs");
}

TEST(InverseKinematics, EndsALongSearchWhenTheEndIsAskedFor) {
    static volatile std::sig_atomic_t asked = 0;
    asked = 0;
    Running run(
        hand_model("position: \"{'r_hand'}\", restarts: 10000", "p: {shape: 3}", "  p: ik.p_r_hand\n"));
    run.set("p", Vector3(-3.0, 0.5, 0.2));
    look_for_interrupt(&asked);
    asked = 2;
    EXPECT_FALSE(run.step());
    look_for_interrupt(nullptr);
    EXPECT_EQ(run.simulation.failure(), std::string("ik: ") + interrupted);
    for (const std::string most : {"restarts: 1000000000", "iterations: 1000000000"})
        expect_contains(
            refusal(hand_model("position: \"{'r_hand'}\", " + most, "p: {shape: 3}", "  p: ik.p_r_hand\n")),
            "ik: argument '" + most.substr(0, most.find(':')) + "'");
    expect_contains(
        refusal(hand_model("position: \"{'r_hand', 'r_hand'}\"", "p: {shape: 3}", "  p: ik.p_r_hand\n")),
        "ik: there are two inputs 'p_r_hand'; name once what they are called after");
}

TEST(InverseKinematics, StopsAtTargetsThatAreNone) {
    const auto failure = [](const std::string& settings, const std::string& inputs, const std::string& input,
                            const Matrix& value) {
        Running run(hand_model(settings, input + ": {shape: \"" + inputs + "\"}",
                               "  " + input + ": ik." + (input == "H" ? "w_H_r_hand" : input) + "\n"));
        run.set(input, value);
        EXPECT_FALSE(run.step());
        return run.simulation.failure();
    };
    Matrix H = pose(-0.2, 0.1, 0.1);
    H(1, 3) = std::numeric_limits<double>::quiet_NaN();
    expect_contains(failure("pose: \"{'r_hand'}\"", "[4 4]", "H", H), "ik: w_H_r_hand");
    expect_contains(failure("pose: \"{'r_hand'}\"", "[4 4]", "H", H),
                    "is not finite; look at what computes it");
    expect_contains(failure("pose: \"{'r_hand'}\"", "[4 4]", "H", Matrix::Zero(4, 4)),
                    "ik: w_H_r_hand holds no rotation");
    const Vector posture = Vector::Constant(10, std::numeric_limits<double>::infinity());
    expect_contains(failure("posture: true", "10", "posture", posture),
                    "ik: posture[torso_pitch] is not finite");
}

TEST(InverseKinematics, ForgetsATargetThatWeighsNothing) {
    Running run(hand_model("position: \"{'r_hand', 'r_elbow_1'}\", weights: [1 0]", "p: {shape: 3}",
                           "  p: [ik.p_r_hand, ik.p_r_elbow_1]\n"));
    run.set("p", Vector3(-0.25, 0.1, 0.1));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("ik.status"), 0);
    EXPECT_GT(run.get("ik.error").col(1).norm(), 0.05);
}

} // namespace bf::toolbox::test
