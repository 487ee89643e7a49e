// Several robots and objects in one world, through blocks and beside dynamics/.
#include "BlockFactory/Core/Log.h"
#include "bf/dynamics/algorithms.hpp"
#include "bf/physics/scene.hpp"
#include "running.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <unistd.h>

namespace bf::toolbox::test {
namespace {

namespace fs = std::filesystem;

/// A folder with a world of two different arms, one on a cart that floats, and a ball.
const fs::path& folder() {
    static const fs::path made = [] {
        const fs::path place = fs::path(testing::TempDir()) / ("worlds_" + std::to_string(getpid()));
        fs::create_directories(place);
        const auto link = [](const std::string& name, double m, double I) {
            return "<link name='" + name + "'><inertial><origin xyz='0.02 0.01 -0.2'/><mass value='" +
                   std::to_string(m) + "'/><inertia ixx='" + std::to_string(I) + "' iyy='" +
                   std::to_string(1.2 * I) + "' izz='" + std::to_string(0.5 * I) +
                   "' ixy='0.001' ixz='0' iyz='-0.002'/></inertial></link>\n";
        };
        const auto joint = [](const std::string& name, const std::string& parent, const std::string& child,
                              const std::string& axis, const std::string& xyz) {
            return "<joint name='" + name + "' type='continuous'><origin xyz='" + xyz +
                   "' rpy='0.1 0 0'/><axis xyz='" + axis + "'/><parent link='" + parent + "'/><child link='" +
                   child + "'/></joint>\n";
        };
        std::ofstream(place / "arm.urdf")
            << "<robot name='arm'>" << link("stand", 3, 0.4) << link("upper", 2, 0.05)
            << link("fore", 1, 0.03) << joint("shoulder", "stand", "upper", "0 1 0", "0 0 0.5")
            << joint("elbow", "upper", "fore", "1 0.2 0", "0 0 -0.4") << "</robot>";
        std::ofstream(place / "walker.urdf")
            << "<robot name='walker'>" << link("body", 4, 0.3) << link("thigh", 1.5, 0.05)
            << link("shin", 1, 0.04) << joint("hip", "body", "thigh", "0 1 0", "0 0.1 -0.1")
            << joint("knee", "thigh", "shin", "0 1 0", "0 0 -0.4") << "</robot>";
        std::ofstream(place / "world.xml") << R"(<world step="0.001">
  <robot name="left" file="arm.urdf" position="0 1 2" rpy="0.1 0.2 0.3" initial="0.4 -0.6"/>
  <robot name="right" file="arm.urdf" position="0 -1 2" joints="elbow shoulder"/>
  <robot name="walker" file="walker.urdf" base="floating" position="5 0 3" rpy="0 0.3 0" imu="shin" push_links="body"/>
  <sphere name="ball" radius="0.1" mass="0.3" position="0 5 1"/>
  <box name="table" size="1 1 0.1" position="3 3 0.5"/>
</world>)";
        return place;
    }();
    return made;
}

std::string world_file() { return "'" + (folder() / "world.xml").string() + "'"; }

/// A subsystem with the robot of that name, driven by `tau`.
std::string robot_part(const std::string& name, const std::string& tau) {
    return "  " + name + ":\n    blocks:\n      robot: {block: WholeBodyToolbox/WorldRobot, robot: " + name +
           "}\n      tau: {block: Sine, amplitude: \"" + tau +
           "\", frequency: 7}\n      s: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints "
           "Position}\n      motors: {block: WholeBodyToolbox/SetReferences}\n    connections: {tau: "
           "motors}\n";
}

std::string model(const std::string& blocks, const std::string& more = {}) {
    return "model: m\nstep: 0.001\nblocks:\n  world: {block: WholeBodyToolbox/World, file: \"" +
           world_file() + "\"}\n" + blocks + more;
}

const std::string all_parts = robot_part("left", "[2; 1]") + robot_part("right", "[-1; 3]") +
                              robot_part("walker", "[1; -1]") +
                              "  ball: {block: WholeBodyToolbox/WorldObject, object: ball}\n";

} // namespace

TEST(SharedWorld, AcceleratesEachRobotAsItsOwnEquationOfMotionSays) {
    physics::SceneSimulation sim(
        std::make_shared<const physics::Scene>(physics::SceneOptions::read(folder() / "world.xml")));
    std::vector<dynamics::Model> models;
    for (const auto& robot : sim.scene().options().robots)
        models.push_back(dynamics::Model::load(robot.options.urdf, robot.options.joints, {0, 0, -9.81},
                                               robot.options.base_link, robot.options.floating_base));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-5.0, 5.0);
    for (int k = 0; k < 200; ++k) {
        std::vector<Vector> expected;
        for (int r = 0; r < 3; ++r) {
            const auto& robot = models[static_cast<std::size_t>(r)];
            const Vector tau = Vector::NullaryExpr(2, [&](Eigen::Index) { return uniform(random); });
            sim.set_torque(r, {tau.data(), 2});
            dynamics::Data data(robot);
            dynamics::set_state(robot, data, sim.w_H_b(r), sim.s(r), sim.v_b(r), sim.s_dot(r));
            const int v = robot.velocities();
            Matrix M(v, v);
            Vector h(v), forces = Vector::Zero(v);
            forces.tail(2) = tau;
            dynamics::mass_matrix(robot, data, M);
            dynamics::bias_forces(robot, data, h);
            expected.push_back(M.ldlt().solve(forces - h).tail(2));
            Vector3 com;
            dynamics::center_of_mass(robot, data, com);
            EXPECT_LT((com - sim.com(r)).norm(), 1e-10);
        }
        ASSERT_TRUE(sim.step()) << sim.error();
        for (int r = 0; r < 3; ++r)
            EXPECT_LT((sim.s_ddot(r) - expected[static_cast<std::size_t>(r)]).norm(),
                      1e-8 * (1 + sim.s_ddot(r).norm()))
                << "robot " << r << ", step " << k;
    }
}

TEST(SharedWorld, StepsOncePerPeriodHoweverManyLookAtIt) {
    // The ball falls by v⁺ = v - g h, z⁺ = z + h v⁺.
    for (const std::string& parts :
         {std::string("  ball: {block: WholeBodyToolbox/WorldObject, object: ball}\n"), all_parts}) {
        Running run(model(parts));
        for (int k = 0; k <= 100; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            EXPECT_NEAR(run.get("ball.w_H_o")(2, 3), 1 - 9.81e-6 * k * (k + 1) / 2, 1e-9);
        }
        EXPECT_NEAR(run.get("ball.v_o")(2), -0.981, 1e-9);
    }
}

TEST(SharedWorld, GivesTheStateOfTheStepToPortsAndMeasurements) {
    Running run(model(all_parts));
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(run.step());
    for (const std::string name : {"left", "right", "walker"}) {
        EXPECT_EQ(run.get(name + ".robot.s"), run.get(name + ".s"));
        EXPECT_GT(run.get(name + ".robot.s_dot").norm(), 1e-3);
    }
    EXPECT_NEAR((run.get("left.robot.s") - run.get("right.robot.s")).norm(), 0, 10);
}

TEST(SharedWorld, NamesThePositionsByJointsAndBodies) {
    const Running run(model(all_parts));
    const Diagram& diagram = run.simulation.diagram();
    const auto names = diagram.element_names(diagram.find_signal("world.q"));
    for (const char* name : {"left/shoulder", "walker/knee", "walker/body.z", "ball.qw"})
        EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
}

TEST(SharedWorld, GoesOnBitForBitFromASnapshot) {
    Running run(model(all_parts)), other(model(all_parts));
    for (int k = 0; k < 40; ++k) ASSERT_TRUE(run.step());
    const auto snapshot = run.simulation.snapshot();
    std::vector<Matrix> seen;
    for (int k = 0; k < 40; ++k) {
        ASSERT_TRUE(run.step());
        seen.push_back(run.get("world.q"));
    }
    for (Running* again : {&run, &other}) {
        again->simulation.restore(snapshot);
        for (int k = 0; k < 40; ++k) {
            ASSERT_TRUE(again->step());
            ASSERT_EQ(again->get("world.q"), seen[static_cast<std::size_t>(k)]) << k;
        }
    }
}

TEST(SharedWorld, WarnsOfASnapshotOfAnotherWorld) {
    using blockfactory::core::Log;
    const fs::path file = folder() / "changing.xml";
    const auto write = [&](const std::string& attribute) {
        std::ofstream(file) << "<world><floor/><sphere name='ball' mass='1' " << attribute << "/></world>";
        return "model: m\nstep: 0.001\nblocks:\n  world: {block: WholeBodyToolbox/World, file: \"'" +
               file.string() + "'\"}\n";
    };
    Running run(write("position='0 0 1'"));
    ASSERT_TRUE(run.step());
    const auto snapshot = run.simulation.snapshot();
    Log::getSingleton().clear();
    run.simulation.restore(snapshot);
    EXPECT_EQ(Log::getSingleton().getWarnings(), "");
    for (const std::string change : {"friction='0.5'", "radius='0.06'"}) {
        Log::getSingleton().clear();
        Running other(write(change));
        other.simulation.restore(snapshot);
        expect_contains(Log::getSingleton().getWarnings(),
                        "is of another world than '" + file.string() + "' describes now");
    }
    Log::getSingleton().clear();
}

TEST(SharedWorld, TakesSeveralOfItsStepsInAPeriod) {
    std::string slow = model(all_parts);
    slow.replace(slow.find("step: 0.001"), 11, "step: 0.005");
    Running run(slow);
    for (int k = 0; k <= 20; ++k) ASSERT_TRUE(run.step());
    EXPECT_NEAR(run.get("ball.w_H_o")(2, 3), 1 - 9.81e-6 * 100 * 101 / 2, 1e-9);
    slow.replace(slow.find("step: 0.005"), 11, "step: 0.0015");
    expect_contains(refusal(slow), "the world's period is 0.0015 s, which is no multiple of its time step of "
                                   "0.001 s; set step in the file or the block's period");
}

TEST(SharedWorld, TellsAConfigurationWhichRobotItIs) {
    const std::string text =
        model("  right:\n    blocks:\n      robot: {block: WholeBodyToolbox/WorldRobot, robot: right}\n"
              "      configuration: {block: WholeBodyToolbox/Configuration, world_robot: right}\n"
              "      com: {block: WholeBodyToolbox/CenterOfMass}\n"
              "    connections:\n      robot.w_H_b: com.w_H_b\n      robot.s: com.s\n      robot.s_dot: "
              "com.s_dot\n");
    Running run(text);
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(run.step());
    EXPECT_LT((run.get("right.com.com") - run.get("right.robot.com")).norm(), 1e-10);
    EXPECT_EQ(run.size("right.com.s").rows, 2);
}

TEST(SharedWorld, IsPushedAndSeenByRays) {
    // The walker flies freely: 6.5 kg, pushed along y by 6.5 N.
    Running run(
        model("  walker:\n    blocks:\n      robot: {block: WholeBodyToolbox/WorldRobot, robot: walker}\n"
              "  push: {block: WholeBodyToolbox/WorldPush, robot: walker, link: body}\n"
              "  wrench: {block: Constant, value: [0; 6.5; 0; 0; 0; 0]}\n"
              "  rays: {block: WholeBodyToolbox/WorldRays, body: ball, rays: 3, from: -1.5707963267948966, "
              "to: 1.5707963267948966, range: 6, pose: \"[1 0 0 0; 0 1 0 0; 0 0 1 -0.5; 0 0 0 1]\"}\n",
              "connections: {wrench: push}\n"));
    ASSERT_TRUE(run.step());
    const Matrix start = run.get("walker.robot.com");
    // From (0, 5, 0.5): along -y nothing within 6 m, along x nothing, along y nothing.
    EXPECT_EQ(run.get("rays"), Matrix::Constant(3, 1, 6.0));
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(run.step());
    EXPECT_NEAR(run.get("walker.robot.com")(1) - start(1), 0.5 * 0.1 * 0.1, 2e-4) << "a = f/m = 1 m/s2";
    // The table reaches from (2.5, 2.5) to (3.5, 3.5) at heights from 0.45 to 0.55.
    Running table(
        model("  rays: {block: WholeBodyToolbox/WorldRays, body: ball, rays: 1, from: "
              "-0.4636476090008061, range: 9, pose: \"[1 0 0 0; 0 1 0 0; 0 0 1 -0.5; 0 0 0 1]\"}\n"));
    ASSERT_TRUE(table.step());
    EXPECT_NEAR(table.scalar("rays"), 1.5 / std::sin(0.4636476090008061), 1e-9) << "its upper edge in y";
    const auto one = [](const std::string& block) {
        return refusal(model("  x: {block: WholeBodyToolbox/" + block + "}\n"));
    };
    expect_contains(one("WorldRays, body: left/uper"),
                    "x: the world has no body 'left/uper'; did you mean 'left/upper'?");
    expect_contains(one("WorldRays, body: ball, pose: [1 2]"), "x: argument 'pose' is no pose");
    expect_contains(refusal(model("  x: {block: WholeBodyToolbox/WorldPush, robot: left, link: stand}\n"
                                  "  c: {block: Constant, value: \"zeros(6, 1)\"}\n",
                                  "connections: {c: x}\n")),
                    "x: robot 'left' has no link 'stand' that may be pushed; name it in push_links");
}

TEST(SharedWorld, IsSetByOneBlockInAStep) {
    std::ofstream(folder() / "hand.xml")
        << R"(<mujoco><worldbody><body name="palm"><geom size="0.1" mass="1"/>
      <body name="finger"><joint name="f" type="slide" axis="1 0 0" damping="2"/><geom size="0.05" mass="0.5" contype="0" conaffinity="0"/></body></body></worldbody>
      <tendon><fixed name="t"><joint joint="f" coef="1"/></fixed></tendon>
      <actuator><motor name="pull" tendon="t" gear="3"/><motor name="other" tendon="t"/></actuator></mujoco>)";
    std::ofstream(folder() / "hands.xml")
        << "<world gravity='0 0 0'><robot name='a' file='hand.xml'/><robot name='b' "
           "file='hand.xml'/></world>";
    const auto hands = [](const std::string& blocks) {
        return "model: m\nstep: 0.001\ninputs: {u: {}}\nblocks:\n  world: {block: WholeBodyToolbox/World, "
               "file: \"'" +
               (folder() / "hands.xml").string() + "'\"}\n" + blocks;
    };
    const auto actuator = [](const std::string& name, const std::string& robot, const std::string& of) {
        return "  " + name + ": {block: WholeBodyToolbox/WorldActuator, robot: " + robot +
               ", actuator: " + of + "}\n";
    };
    const std::string one = actuator("one", "a", "pull");
    expect_contains(refusal(hands(one + actuator("two", "a", "pull") + "connections: {u: [one, two]}\n")),
                    "two: sets actuator 'pull' of robot 'a', which one sets in the same step");
    // m v' = 3 u - d v.
    Running run(hands(one + actuator("two", "b", "pull") + actuator("three", "a", "other") +
                      "  none: {block: Constant, value: 0}\nconnections: {u: [one, two], none: three}\n"));
    run.set("u", 0.4);
    for (int k = 0; k < 300; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
    const double t = 0.299, T = 0.5 / 2, v = 3 * 0.4 / 2, expected = v * (t - T * (1 - std::exp(-t / T)));
    EXPECT_NEAR(run.get("world.q")(0), expected, 5e-3 * expected); // steps of 1 ms
    EXPECT_EQ(run.get("world.q")(0), run.get("world.q")(1));

    const std::string push = ": {block: WholeBodyToolbox/WorldPush, robot: walker, link: body}\n";
    expect_contains(refusal(model("  c: {block: Constant, value: \"zeros(6, 1)\"}\n  x" + push + "  y" +
                                  push + "connections: {c: [x, y]}\n")),
                    "y: sets the wrench on link 'body' of robot 'walker', which x sets in the same step");
}

TEST(SharedWorld, SaysWhatIsWrongOnceAndWhere) {
    const auto one = [](const std::string& block) {
        return refusal(model("  x: {block: WholeBodyToolbox/" + block + "}\n"));
    };
    EXPECT_EQ(one("WorldRobot, robot: walker"), "");
    const std::string robot = one("WorldRobot, robot: wlker");
    expect_contains(robot, "model.yaml:5:3: x: the world has no robot 'wlker'; did you mean 'walker'? there "
                           "are: left, right, walker");
    EXPECT_EQ(robot.find("the world has no"), robot.rfind("the world has no")) << robot;
    expect_contains(one("WorldObject, object: bal"),
                    "x: the world has no object 'bal'; did you mean 'ball'?");
    for (const std::string given : {"robot: left.urdf", "gravity: [0 0 -1]", "floating_base: true",
                                    "joints: elbow", "base_link: upper"})
        expect_contains(
            one("Configuration, world_robot: left, " + given),
            "x: argument '" + given.substr(0, given.find(':')) +
                "' stands beside world_robot, and the world says it of 'left'; leave one of the two out");
    for (const std::string g : {"nan", "inf"})
        expect_contains(one("Configuration, robot: \"'" + (folder() / "arm.urdf").string() +
                            "'\", gravity: \"[0 0 " + g + "]\""),
                        "x: argument 'gravity' has ");
    expect_contains(one("Configuration, world_robot: none"), "x: the world has no robot 'none'");
    expect_contains(
        refusal("model: m\nstep: 0.001\nblocks:\n  x: {block: WholeBodyToolbox/WorldRobot, robot: a}\n"),
        "x: needs a world, and no enclosing subsystem has one");
    expect_contains(
        refusal("model: m\nstep: 0.001\nblocks:\n  w: {block: WholeBodyToolbox/World, file: none.xml}\n"),
        "w: cannot read the world '");
    expect_contains(refusal("model: m\nstep: 0.001\nblocks:\n  w: {block: WholeBodyToolbox/World}\n"),
                    "w: argument 'file' is empty");
    expect_contains(refusal(model("  a: {block: WholeBodyToolbox/WorldRobot, robot: left}\n"
                                  "  b: {block: WholeBodyToolbox/WorldRobot, robot: right}\n"
                                  "  s: {block: WholeBodyToolbox/GetMeasurement}\n")),
                    "s: finds more than one robot around it: a and b");
}

} // namespace bf::toolbox::test
