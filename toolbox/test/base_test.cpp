// Fixed bases, other base links, mimicking joints and contacts through blocks.
#include "running.hpp"

#include <cmath>
#include <fstream>
#include <unistd.h>

namespace bf::toolbox::test {
namespace {

std::string arm_inertial(double mass, double inertia) {
    const std::string i = std::to_string(inertia);
    return "<inertial><mass value='" + std::to_string(mass) + "'/><inertia ixx='" + i + "' iyy='" + i +
           "' izz='" + i + "' ixy='0' ixz='0' iyz='0'/></inertial>";
}

/// An arm of two joints on a heavy base, of which the second joint mimics the first.
const std::string arm_urdf =
    "<robot name='arm'><link name='stand'>" + arm_inertial(4, 1) + "</link><link name='upper'>" +
    arm_inertial(2, 0.1) + "</link><link name='lower'>" + arm_inertial(1, 0.05) +
    "<collision><geometry><sphere radius='0.1'/></geometry></collision></link>"
    "<joint name='shoulder' type='revolute'><origin xyz='0.3 0 1'/><parent link='stand'/>"
    "<child link='upper'/><axis xyz='0 1 0'/><limit effort='0' velocity='0'/>"
    "<dynamics friction='0.5'/></joint>"
    "<joint name='elbow' type='revolute'><origin xyz='0.4 0 0'/><parent link='upper'/>"
    "<child link='lower'/><axis xyz='0 1 0'/><limit effort='0' velocity='0'/>"
    "<mimic joint='shoulder' multiplier='-2' offset='0.1'/></joint></robot>";

/// The file of a URDF as long as the object lives.
class TemporaryUrdf {
  public:
    explicit TemporaryUrdf(const std::string& text) { std::ofstream(path) << text; }
    ~TemporaryUrdf() { unlink(path.c_str()); }
    const std::string path = "/tmp/bf_toolbox_base_" + std::to_string(getpid()) + ".urdf";
};

std::string arm_model(const std::string& urdf, const std::string& configuration, const std::string& world) {
    return "model: m\nstep: 0.0001\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, robot: \"'" +
           urdf + "'\"" + configuration + "}\n  world: {block: WholeBodyToolbox/MujocoWorld" + world +
           "}\n  M: {block: WholeBodyToolbox/MassMatrix}\n  h: {block: WholeBodyToolbox/GetBiasForces}\n"
           "  J: {block: WholeBodyToolbox/Jacobian, frame: lower}\n"
           "  A: {block: WholeBodyToolbox/CentroidalTotalMomentumMatrix}\n"
           "  com: {block: WholeBodyToolbox/CenterOfMass}\n"
           "  s_ddot: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints Acceleration}\n"
           "connections:\n  world.w_H_b: [M.w_H_b, h.w_H_b, J.w_H_b, A.w_H_b, com.w_H_b]\n"
           "  world.v_b: [h.v_b, com.v_b]\n  world.s: [M.s, h.s, J.s, A.s, com.s]\n"
           "  world.s_dot: [h.s_dot, com.s_dot]\n";
}

} // namespace

TEST(FixedBase, HasTheSizesOfItsJointsAndTheWorldsCentreOfMass) {
    const TemporaryUrdf file(arm_urdf);
    Running run(arm_model(file.path, ", floating_base: false", ", floor: false"));
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("M.M").size(), 1);
    EXPECT_EQ(run.get("h.h").size(), 1);
    EXPECT_EQ(run.get("J.J").cols(), 1);
    EXPECT_EQ(run.get("A.A").cols(), 1);
    EXPECT_LT((run.get("world.com") - run.get("com.com")).norm(), 1e-6);
    // At the start the arm is level but for the elbow: (4 * 0 + 2 * 0.3 + 1 * 0.7) / 7.
    EXPECT_NEAR(run.get("com.com")(0), 1.3 / 7, 1e-3);
}

/// M s_ddot + h = 0 where the joint has no friction and no motor torque; the elbow is held to the shoulder.
TEST(FixedBase, NeedsNoPoseNorVelocitiesOfItsBase) {
    const TemporaryUrdf file(arm_urdf);
    const auto model = [&](const std::string& configuration) {
        return "model: m\nstep: 0.1\ninputs: [H, v, s, ds]\nblocks:\n"
               "  robot: {block: WholeBodyToolbox/Configuration, robot: \"'" +
               file.path + "'\"" + configuration +
               "}\n  open: {block: WholeBodyToolbox/InverseDynamics}\n"
               "  wired: {block: WholeBodyToolbox/InverseDynamics}\n"
               "  elsewhere: {block: WholeBodyToolbox/ForwardKinematics, frame: lower}\n"
               "  here: {block: WholeBodyToolbox/ForwardKinematics, frame: lower}\n"
               "connections:\n  H: [wired.w_H_b, elsewhere.w_H_b]\n  v: [wired.v_b, wired.v_b_dot]\n"
               "  s: [open.s, wired.s, here.s, elsewhere.s]\n  ds: [open.s_dot, open.s_ddot, wired.s_dot, "
               "wired.s_ddot]\n";
    };
    Running run(model(", floating_base: false"));
    run.set("s", 0.3).set("ds", 0.7).set("v", Matrix::Ones(6, 1)).set("H", Matrix::Identity(4, 4));
    ASSERT_TRUE(run.step());
    EXPECT_NE(run.get("open.tau").norm(), 0);
    EXPECT_EQ(run.get("open.tau"), run.get("wired.tau"));
    EXPECT_EQ(run.get("here.w_H_frame"), run.get("elsewhere.w_H_frame"));
    Matrix H = Matrix::Identity(4, 4);
    H(2, 3) = 1;
    run.set("H", H);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("elsewhere.w_H_frame"), H * run.get("here.w_H_frame"));

    const std::string floating = refusal(model(""));
    for (const std::string open :
         {"open: input 'w_H_b'", "open: input 'v_b'", "open: input 'v_b_dot'", "here: input 'w_H_b'"})
        EXPECT_NE(floating.find(open + " is not connected"), std::string::npos) << floating;
}

TEST(Mimic, IsTheSameInTheWorldAndInTheBlocks) {
    const TemporaryUrdf file(arm_urdf);
    for (const char* joints : {"", ", joints: \"{'shoulder', 'elbow'}\""}) {
        Running run(arm_model(file.path, std::string(", floating_base: false") + joints,
                              ", floor: false, joint_friction: 0"));
        ASSERT_TRUE(run.step());
        const Matrix s_ddot = run.get("M.M").inverse() * -run.get("h.h");
        ASSERT_TRUE(run.step());
        EXPECT_LT((run.get("s_ddot.y") - s_ddot).norm(), 1e-3 * s_ddot.norm()) << joints;
    }
}

TEST(Friction, OfJointsIsTheUrdfsOrNone) {
    const TemporaryUrdf file(arm_urdf);
    const auto turned = [&](const std::string& friction) {
        Running run(arm_model(file.path, ", floating_base: false, gravity: [0 0 -0.01]",
                              ", floor: false" + friction));
        for (int k = 0; k < 500; ++k) EXPECT_TRUE(run.step());
        return std::abs(run.get("world.s_dot")(0));
    };
    const double free = turned(", joint_friction: 0"); // 0.5 Nm hold what weighs 0.01 N/kg
    EXPECT_GT(free, 1e-4);
    EXPECT_LT(turned(""), 0.1 * free);
}

TEST(BaseLink, IsTheOneThatIsNamed) {
    const TemporaryUrdf file(arm_urdf);
    Running run(arm_model(file.path, ", base_link: upper", ", floor: false"));
    for (int k = 0; k < 20; ++k) ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("M.M").rows(), 7);
    EXPECT_LT((run.get("world.com") - run.get("com.com")).norm(), 1e-6);
    expect_contains(refusal(arm_model(file.path, ", base_link: uper", "")), "base link 'uper' is not a link");
}

TEST(Contacts, AreShapesOfTheUrdfOrOfSingleFeet) {
    const TemporaryUrdf file(arm_urdf);
    const auto height = [&](const std::string& settings) {
        Running run(arm_model(file.path, "", ", feet: \"{'lower', 'stand'}\", " + settings));
        EXPECT_TRUE(run.step());
        return run.get("world.pose_stand")(2, 3);
    };
    // The lowest shape touches the floor: the sphere of 'lower', 1 m above the stand, never does.
    EXPECT_NEAR(height("contact_points: [1 0 0 0; 2 0 0 -0.3]"), 0.305, 1e-3);
    EXPECT_NEAR(height("contact_points: [2 0 0 -0.3 0.1 0.1 0.2; 1 0 0 0 0.1 0.1 0.1]"), 0.5, 1e-3);
    expect_contains(refusal(arm_model(file.path, "", ", feet: \"{'lower'}\", contact_points: [2 0 0 0]")),
                    "row 1 of argument 'contact_points' begins with no number of a foot");
    expect_contains(refusal(arm_model(file.path, "", ", feet: \"{'lower'}\", contact_points: [0 0]")),
                    "rows x y z, foot x y z, or foot x y z a b c");
    expect_contains(refusal(arm_model(file.path, "", ", feet: \"{'stand'}\", contacts: urdf")),
                    "link 'stand' of");
}

/// Every block over the robot's state, with what else it needs.
TEST(StateOfTheRobot, IsRefusedByEachBlockWithTheNameOfItsPort) {
    const TemporaryUrdf file(arm_urdf);
    const std::vector<std::string> by_position{"ForwardKinematics, frame: lower", "Jacobian, frame: lower",
                                               "MassMatrix", "GetGravityForces",
                                               "CentroidalTotalMomentumMatrix"},
        by_velocity{"CenterOfMass",
                    "DotJNu, frame: lower",
                    "GetBiasForces",
                    "CoriolisMatrix",
                    "CentroidalMomentum",
                    "JointImpedance",
                    "JointImpedance, compensation: gravity",
                    "CartesianImpedance, frame: lower",
                    "RigidContact, frame: lower",
                    "MomentumObserver",
                    "ContactWrenches, contacts: \"{'lower'}\""};
    const auto expect_refusals = [&](const std::string& block, bool moves) {
        const bool has_targets = block.starts_with("JointImpedance"),
                   has_target = block.starts_with("CartesianImpedance"),
                   has_torques = block.starts_with("MomentumObserver");
        const std::string model =
            "model: m\nstep: 0.1\ninputs: {H: {shape: \"[4 4]\"}, v: {shape: 6}, s: {}, ds: {}}\n"
            "blocks:\n  robot: {block: WholeBodyToolbox/Configuration, robot: \"'" +
            file.path +
            "'\"}\n  zero: {block: Constant}\n  eye: {block: Constant, value: eye(4)}\n"
            "  x: {block: WholeBodyToolbox/" +
            block + "}\nconnections:\n  H: x.w_H_b\n  s: x.s\n" +
            (moves ? "  v: x.v_b\n  ds: x.s_dot\n" : "") +
            (has_targets   ? "  zero: x.s_target\n"
             : has_torques ? "  zero: x.tau\n"
                           : "") +
            (has_target ? "  eye: x.w_H_target\n" : "");
        const auto expect_failure = [&](const char* input, const Matrix& value, const std::string& text) {
            Running run(model);
            run.set("H", Matrix::Identity(4, 4)).set("v", Matrix::Zero(6, 1)).set("s", 0.1).set("ds", 0.2);
            EXPECT_TRUE(run.step()) << block << run.simulation.failure();
            run.set(input, value);
            EXPECT_FALSE(run.step()) << block << input;
            expect_contains(run.simulation.failure(), text);
        };
        Matrix H = Matrix::Identity(4, 4);
        H(1, 3) = NAN;
        expect_failure("H", H, "x: w_H_b[2][4] is not finite");
        for (const double z : {0.0, -1.0}) { // singular, and a mirror
            H = Matrix::Identity(4, 4);
            H(2, 2) = z;
            expect_failure("H", H, "x: w_H_b holds no rotation");
        }
        expect_failure("s", Matrix::Constant(1, 1, NAN), "x: s is not finite");
        if (!moves) return;
        expect_failure("v", Vector6::Constant(INFINITY), "x: v_b[1] is not finite");
        expect_failure("ds", Matrix::Constant(1, 1, NAN), "x: s_dot is not finite");
    };
    for (const std::string& block : by_position) expect_refusals(block, false);
    for (const std::string& block : by_velocity) expect_refusals(block, true);
}

} // namespace bf::toolbox::test
