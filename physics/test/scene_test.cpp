#include "bf/physics/scene.hpp"
#include "complaints.hpp"
#include "robots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

namespace bf::physics::test::scene {

namespace {

/// Two links that swing about y, the second 0.5 m below the first; the tip carries a sphere.
std::string arm_urdf() {
    return write_urdf("arm", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="upper"><inertial><origin xyz="0 0 -0.25"/><mass value="2"/>
        <inertia ixx="0.05" iyy="0.05" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="fore"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
        <inertia ixx="0.02" iyy="0.02" izz="0.005" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><origin xyz="0 0 -0.4"/><geometry><sphere radius="0.05"/></geometry></collision></link>
      <joint name="shoulder" type="revolute"><axis xyz="0 1 0"/><parent link="stand"/><child link="upper"/>
        <limit lower="-3" upper="3" effort="100" velocity="10"/></joint>
      <joint name="elbow" type="revolute"><origin xyz="0 0 -0.5"/><axis xyz="0 1 0"/><parent link="upper"/><child link="fore"/>
        <limit lower="-3" upper="3" effort="100" velocity="10"/></joint>)");
}

Eigen::Matrix4d at(double x, double y, double z, double yaw = 0.0) {
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H.topLeftCorner<3, 3>() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    H.topRightCorner<3, 1>() << x, y, z;
    return H;
}

SceneRobot arm(const std::string& name, const Eigen::Matrix4d& pose, bool floats = false) {
    SceneRobot robot{name};
    robot.options.urdf = arm_urdf();
    robot.options.floating_base = floats;
    robot.options.initial_w_H_b = pose;
    return robot;
}

SceneObject ball(const std::string& name, double radius, const Eigen::Matrix4d& pose, double mass) {
    SceneObject object;
    object.kind = SceneObject::Kind::sphere;
    object.name = name;
    object.size[0] = radius;
    object.w_H_o = pose;
    object.mass = mass;
    return object;
}

SceneSimulation simulate(SceneOptions options) {
    return SceneSimulation(std::make_shared<const Scene>(std::move(options)));
}

std::string complaint(const SceneOptions& options) {
    try {
        const Scene scene(options);
        return {};
    } catch (const std::exception& error) {
        return error.what();
    }
}

/// What reading and compiling a file with this text says.
std::string complaint(const std::string& text) {
    const std::string file = BF_BINARY_DIRECTORY "/scene.xml";
    arm_urdf();
    std::ofstream(file) << text;
    return complaint_of([&] { const Scene scene(SceneOptions::read(file)); });
}

/// Stiffly at zero, besides what is given.
void hold(SceneSimulation& sim, int robot, double shoulder = 0.0) {
    std::array<double, 2> tau{};
    for (int i : {0, 1}) tau[static_cast<size_t>(i)] = -200.0 * sim.s(robot)[i] - 10.0 * sim.s_dot(robot)[i];
    if (shoulder != 0.0) tau[0] = shoulder;
    sim.set_torque(robot, tau);
}

SceneOptions two_arms() {
    SceneOptions options;
    options.robots = {arm("left", at(0, 1, 2)), arm("right", at(0, -1, 2, 1.0))};
    options.robots[0].options.initial_joints = {0.5, -0.3};
    options.robots[1].options.initial_joints = {-0.2, 0.7};
    options.floor.enabled = false;
    return options;
}

} // namespace

TEST(Scene, MovesEachRobotAsAWorldOfItsOwn) {
    SceneSimulation both = simulate(two_arms());
    for (int r : {0, 1}) {
        WorldOptions options;
        static_cast<RobotOptions&>(options) = two_arms().robots[static_cast<size_t>(r)].options;
        options.floor.enabled = false;
        Simulation alone(std::make_shared<const World>(options));
        SceneSimulation scene = simulate(two_arms());
        EXPECT_LT((scene.w_H_b(r) - alone.w_H_b()).norm(), 1e-12);
        for (int k = 0; k < 300; ++k) {
            const double t = 1e-3 * k;
            const std::array tau{std::sin(20 * t), 0.5 * std::cos(15 * t)};
            scene.set_torque(r, tau);
            ASSERT_TRUE(scene.step());
            ASSERT_TRUE(alone.step(tau));
        }
        EXPECT_LT((scene.s(r) - alone.s()).norm(), 1e-10);
        EXPECT_LT((scene.s_ddot(r) - alone.s_ddot()).norm(), 1e-8);
        EXPECT_LT((scene.com(r) - alone.com()).norm(), 1e-10);
        EXPECT_GT((alone.s() - both.s(r)).norm(), 0.1) << "it does move";
    }
}

TEST(Scene, KeepsTheEnergyOfWhatSwingsFreely) {
    SceneOptions options = two_arms();
    options.time_step = 1e-4;
    SceneSimulation sim = simulate(options);
    const double start = sim.energy().sum();
    double lowest = 1e9, highest = -1e9;
    for (int k = 0; k < 10000; ++k) {
        ASSERT_TRUE(sim.step());
        lowest = std::min(lowest, sim.energy()[0]);
        highest = std::max(highest, sim.energy()[0]);
    }
    EXPECT_GT(highest - lowest, 1.0) << "it swings";
    EXPECT_NEAR(sim.energy().sum(), start, 1e-3 * (highest - lowest));
}

TEST(Scene, KeepsTheMomentumOfWhatCollides) {
    SceneOptions options;
    options.gravity.setZero();
    options.floor.enabled = false;
    options.robots = {arm("flying", at(0, 0, 0), true)};
    options.robots[0].options.push_links = {"stand"};
    // The sphere at the tip of the arm hangs at z = -0.9.
    options.objects = {ball("target", 0.05, at(0.2, 0, -0.9), 0.5)};
    SceneSimulation sim = simulate(options);
    Vector6d push = Vector6d::Zero();
    push[0] = 60.0;
    sim.set_wrench(0, 0, push);
    for (int k = 0; k < 100; ++k) { // 6 N s
        hold(sim, 0);
        ASSERT_TRUE(sim.step());
    }
    sim.set_wrench(0, 0, Vector6d::Zero());
    const double mass = sim.scene().mass(0);
    EXPECT_DOUBLE_EQ(mass, 6.0);
    Eigen::Vector3d before = sim.com(0);
    const auto momentum = [&] { // of the arm from the path of its centre of mass
        const Eigen::Vector3d moved = (sim.com(0) - before) / 1e-3;
        before = sim.com(0);
        return Eigen::Vector3d(mass * moved + 0.5 * sim.v_o(0).head<3>());
    };
    double hit = 0.0;
    for (int k = 0; k < 600; ++k) {
        hold(sim, 0);
        ASSERT_TRUE(sim.step());
        const Eigen::Vector3d p = momentum();
        if (k == 0) continue;
        EXPECT_NEAR(p.x(), 6.0, 0.02) << k;
        EXPECT_NEAR(p.z(), 0.0, 0.02) << k;
        hit = std::max(hit, sim.v_o(0)[0]);
    }
    EXPECT_GT(hit, 0.2) << "it hits";
}

TEST(Scene, LetsObjectsFallRestAndBeMoved) {
    SceneOptions options;
    options.objects = {ball("ball", 0.1, at(0, 0, 1), 0.3), {}};
    options.objects[1].name = "table";
    options.objects[1].size = {0.5, 0.5, 0.2};
    options.objects[1].w_H_o = at(0, 2, 0.1);
    options.objects.push_back(ball("above", 0.1, at(0, 2, 0.5), 0.3));
    SceneSimulation sim = simulate(options);
    const int k = 300; // z = z0 - g h² k (k + 1) / 2
    for (int i = 0; i < k; ++i) ASSERT_TRUE(sim.step());
    EXPECT_NEAR(sim.w_H_o(0)(2, 3), 1 - 9.81 * 1e-6 * k * (k + 1) / 2, 1e-9);
    EXPECT_NEAR(sim.v_o(0)[2], -9.81e-3 * k, 1e-9);
    for (int i = 0; i < 3000; ++i) ASSERT_TRUE(sim.step());
    EXPECT_NEAR(sim.w_H_o(0)(2, 3), 0.1, 1e-3) << "on the floor";
    EXPECT_NEAR(sim.w_H_o(2)(2, 3), 0.3, 1e-3) << "on the table";
    EXPECT_EQ(sim.w_H_o(1), at(0, 2, 0.1)) << "what has no mass is fixed";
}

TEST(Scene, LetsRobotsTouchEachOther) {
    SceneOptions options = two_arms();
    options.gravity.setZero();
    for (SceneRobot& robot : options.robots) robot.options.initial_joints = {0.0};
    options.robots[0].options.initial_w_H_b = at(0, 0, 0);
    options.robots[1].options.initial_w_H_b = at(0.3, 0, 0);
    SceneSimulation sim = simulate(options);
    for (int k = 0; k < 600; ++k) {
        hold(sim, 0, -4.0); // about y: towards +x
        ASSERT_TRUE(sim.step());
    }
    EXPECT_LT(sim.s(1)[0], -0.05) << "the right arm is pushed by the left one";
}

TEST(Scene, MayHaveJointsOfOneNameInSeveralRobots) {
    const Scene scene(two_arms());
    EXPECT_EQ(scene.joint_names(0), scene.joint_names(1));
    EXPECT_EQ(scene.robot("right"), 1);
    EXPECT_EQ(scene.bodies(), (std::vector<std::string>{"left/stand", "left/upper", "left/fore",
                                                        "right/stand", "right/upper", "right/fore"}));
}

TEST(Scene, GoesOnBitForBitFromASavedState) {
    SceneOptions options = two_arms();
    options.floor.enabled = true;
    options.robots[0].options.noise.position = 1e-3;
    options.objects = {ball("ball", 0.1, at(0, 1, 0.1), 0.3)};
    SceneSimulation sim = simulate(options);
    const auto look = [](SceneSimulation& s) {
        std::vector<double> seen(s.q().data(), s.q().data() + s.q().size());
        for (int r : {0, 1}) {
            seen.insert(seen.end(), s.s(r).data(), s.s(r).data() + 2);
            seen.insert(seen.end(), s.s_ddot(r).data(), s.s_ddot(r).data() + 2);
        }
        return seen;
    };
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(sim.step());
    sim.set_torque(1, std::array{1.0, 2.0});
    std::vector<double> state(static_cast<size_t>(sim.state_size()));
    sim.save(state.data());
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(sim.step(3));
    const auto first = look(sim);
    SceneSimulation other = simulate(options);
    other.restore(state.data());
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(other.step(3));
    EXPECT_EQ(look(other), first);
    sim.restore(state.data());
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(sim.step(3));
    EXPECT_EQ(look(sim), first) << "held torques belong to the state";
}

TEST(Scene, StepsManyTimesAsOneByOne) {
    SceneOptions options = two_arms();
    options.robots[0].options.noise.position = 1e-3; // the loops see it in each step
    SceneSimulation many = simulate(options), single = simulate(options);
    for (SceneSimulation* sim : {&many, &single}) sim->set_mode(0, ControlMode::position_direct);
    for (int k = 0; k < 20; ++k) ASSERT_TRUE(many.step(5));
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(single.step());
    EXPECT_EQ(many.q(), single.q());
    EXPECT_EQ(many.s_ddot(0), single.s_ddot(0));
    EXPECT_NEAR(many.time(), 0.1, 1e-12);
}

TEST(Scene, FollowsMimicJointsOfTheUrdf) {
    const std::string urdf = write_urdf("mimics", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="a"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="b"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="leader" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="a"/></joint>
      <joint name="follower" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="b"/>
        <mimic joint="leader" multiplier="-2" offset="0.5"/></joint>)");
    SceneOptions options;
    options.robots = {{"hand"}};
    options.robots[0].options.urdf = urdf;
    options.robots[0].options.floating_base = false;
    SceneSimulation sim = simulate(options);
    ASSERT_EQ(sim.scene().joint_names(0), std::vector<std::string>{"leader"});
    for (int k = 0; k < 100; ++k) {
        sim.set_torque(0, std::array{0.5});
        ASSERT_TRUE(sim.step());
    }
    EXPECT_NEAR(sim.s_ddot(0)[0], 0.5 / (0.1 + 4 * 0.1), 2e-3) << "both inertias as the leader feels them";
    EXPECT_NEAR(sim.q()[1], 0.5 - 2 * sim.q()[0], 1e-4);
}

TEST(Terrain, LetsABoxSlideAsCoulombSays) {
    // On a slope of angle a, a = g (sin a - mu cos a) where tan a > mu, and rest otherwise.
    const double height = 0.5, angle = std::atan2(height, 2.0);
    for (const double mu : {0.1, 0.4}) {
        SceneOptions options;
        options.floor.enabled = false;
        options.objects.resize(2);
        SceneObject& slope = options.objects[0];
        slope.kind = SceneObject::Kind::slope;
        slope.name = "slope";
        slope.size = {2.0, 1.0, height};
        slope.surface.friction = mu;
        SceneObject& box = options.objects[1];
        box.name = "box";
        box.size = {0.2, 0.2, 0.1};
        box.mass = 2.0;
        box.surface.friction = mu;
        const Eigen::Matrix3d R = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
        box.w_H_o.topLeftCorner<3, 3>() = R;
        box.w_H_o.topRightCorner<3, 1>() = Eigen::Vector3d(1.5, 0, 0.75 * height) + 0.05 * R.col(2);
        SceneSimulation sim = simulate(options);
        for (int k = 0; k < 200; ++k) ASSERT_TRUE(sim.step()); // until it lies as deep as its weight presses
        const double begin = -R.col(0).dot(sim.v_o(1).head<3>());
        for (int k = 0; k < 300; ++k) ASSERT_TRUE(sim.step());
        const double a = (-R.col(0).dot(sim.v_o(1).head<3>()) - begin) / 0.3;
        const double expected = std::max(0.0, 9.81 * (std::sin(angle) - mu * std::cos(angle)));
        EXPECT_NEAR(a, expected, 0.02) << mu;
    }
}

namespace {

/// Where a small ball that falls at (x, y) comes to rest, without its radius: flat ground, where it does not
/// roll.
double height_at(SceneOptions options, double x, double y) {
    options.floor.enabled = false;
    options.objects.push_back(ball("probe", 0.05, at(x, y, 0.9), 0.1));
    SceneSimulation sim = simulate(options);
    for (int k = 0; k < 1500; ++k)
        if (!sim.step()) return std::nan("");
    return sim.w_H_o(static_cast<int>(options.objects.size()) - 1)(2, 3) - 0.05;
}

} // namespace

TEST(Terrain, RisesInSteps) {
    SceneOptions options;
    options.objects.resize(1);
    options.objects[0].kind = SceneObject::Kind::steps;
    options.objects[0].name = "stairs";
    options.objects[0].size = {0.3, 1.0, 0.15};
    options.objects[0].count = 4;
    options.objects[0].w_H_o = at(1, 0, 0);
    for (int i = 0; i < 4; ++i)
        EXPECT_NEAR(height_at(options, 1.15 + 0.3 * i, 0.0), 0.15 * (i + 1), 2e-3) << i;
}

TEST(Terrain, HasTheHeightsOfAFile) {
    SceneOptions options;
    options.objects.resize(1);
    SceneObject& ground = options.objects[0];
    ground.kind = SceneObject::Kind::heights;
    ground.name = "ground";
    ground.size = {4.0, 4.0, 1.0};
    ground.file = BF_BINARY_DIRECTORY "/ground.txt";
    // Five columns a metre apart from x = -2 on, four rows from y = 2 downwards: flat where the probe falls.
    std::ofstream(ground.file)
        << "0.5 0.5 0 0 0\n0.5, 0.5, 0, 0, 0\n\n0 0 0 -0.25 -0.25\n0 0 0 -0.25 -0.25\n";
    EXPECT_NEAR(height_at(options, -1.5, 1.4), 0.5, 2e-3);
    EXPECT_NEAR(height_at(options, 1.5, 1.4), 0.0, 2e-3);
    EXPECT_NEAR(height_at(options, 1.5, -1.4), -0.25, 2e-3);
    std::ofstream(ground.file) << "0 0 0\n0 1\n";
    expect_contains(complaint(options),
                    {"object 'ground': '", "ground.txt', line 2: it has 2 numbers, and those above have 3"});
    std::ofstream(ground.file) << "0 0 0\n0 x 1\n";
    expect_contains(complaint(options), {"line 2: 'x' is no finite number"});
    std::ofstream(ground.file) << "0 0 0\n";
    expect_contains(complaint(options), {"at least 2 rows and 2 columns"});
    ground.file = "none.txt";
    expect_contains(complaint(options), {"object 'ground': there is no file 'none.txt'"});
    EXPECT_EQ(
        complaint("<world><slope name='s' length='1' height='0.2'/><steps name='t' count='2'/></world>"), "");
    expect_contains(complaint("<world><steps name='t' count='0'/></world>"),
                    {"<steps>: count=\"0\" is no whole number from 1 to 1000"});
    expect_contains(complaint("<world><slope name='t' mass='2'/></world>"),
                    {"object 't': terrain has no mass"});
}

TEST(Scene, TellsBadTorquesByRobotAndJoint) {
    SceneSimulation sim = simulate(two_arms());
    sim.set_torque(1, std::array{0.0, std::numeric_limits<double>::quiet_NaN()});
    EXPECT_FALSE(sim.step());
    EXPECT_STREQ(sim.error(), "t = 0 s: the reference of joint 'elbow' of robot 'right' is nan; it must be "
                              "finite and below 1e10");
    EXPECT_EQ(sim.failure().cause, Failure::Cause::reference);
    EXPECT_EQ(sim.failure().robot, 1);
    EXPECT_EQ(sim.failure().part, 1);
    sim.reset();
    EXPECT_TRUE(sim.step());
    std::array<double, 2> torque{1e9, -1e9};
    SceneOptions wild = two_arms();
    for (SceneRobot& robot : wild.robots) robot.options.armature = {0.0};
    wild.time_step = 0.1;
    SceneSimulation diverging = simulate(wild);
    bool went = true;
    for (int k = 0; k < 1000 && went; ++k) {
        for (double& t : torque) t = 1e3 * ((k % 2) ? 1 : -1) * (k + 1.0);
        diverging.set_torque(0, torque);
        went = diverging.step();
    }
    if (!went) {
        EXPECT_NE(std::string(diverging.error()).find("left/"), std::string::npos) << diverging.error();
    }
}

TEST(Scene, ReadsAFile) {
    arm_urdf();
    const std::string file = BF_BINARY_DIRECTORY "/read.xml";
    std::ofstream(file)
        << R"(<world step="0.002" gravity="0 0 -1.6" cone="pyramidal" integrator="euler" impratio="10">
      <floor friction="0.4"/>
      <robot name="left" file="arm.urdf" base="floating" position="0 1 2" rpy="0 0 1.5707963267948966"
             joints="elbow shoulder" initial="0.2 0.1" armature="0.3" imu="fore"/>
      <box name="parcel" size="0.1 0.2 0.3" mass="0.5" friction="0.7" colour="1 0 0" position="1 0 0.15"/>
      <cylinder name="post" radius="0.05" length="1"/>
    </world>)";
    const SceneOptions options = SceneOptions::read(file);
    EXPECT_EQ(options.time_step, 0.002);
    EXPECT_EQ(options.gravity, Eigen::Vector3d(0, 0, -1.6));
    EXPECT_EQ(options.cone, FrictionCone::pyramidal);
    EXPECT_EQ(options.integrator, Integrator::euler);
    EXPECT_EQ(options.impratio, 10);
    EXPECT_TRUE(options.floor.enabled);
    EXPECT_EQ(options.floor.friction, 0.4);
    ASSERT_EQ(options.robots.size(), 1u);
    EXPECT_LT((*options.robots[0].options.initial_w_H_b - at(0, 1, 2, std::numbers::pi / 2)).norm(), 1e-15);
    EXPECT_EQ(options.robots[0].options.joints, (std::vector<std::string>{"elbow", "shoulder"}));
    ASSERT_EQ(options.objects.size(), 2u);
    EXPECT_EQ(options.objects[0].mass, 0.5);
    EXPECT_EQ(options.objects[0].colour, (std::array<float, 4>{1, 0, 0, 1}));
    EXPECT_FALSE(options.objects[1].mass);
    const SceneSimulation sim(std::make_shared<const Scene>(options));
    EXPECT_EQ(sim.s(0), Eigen::Vector2d(0.2, 0.1));
    EXPECT_LT((sim.w_H_b(0) - *options.robots[0].options.initial_w_H_b).norm(), 1e-15);
    EXPECT_EQ(sim.q().size(), 7 + 2 + 7);
}

TEST(Scene, RefusesWhatAFileSaysWrongWithItsLine) {
    const std::string robot = "<robot name='a' file='arm.urdf'/>";
    const auto in_world = [](const std::string& text) {
        return complaint("<world>\n" + text + "\n</world>");
    };
    EXPECT_EQ(in_world(robot), "");
    expect_contains(complaint("<world>\n<robot</world>"), {"scene.xml', line ", "it is no XML"});
    expect_contains(complaint("<scene/>"), {"does not begin with <world>, but with <scene>"});
    expect_contains(complaint("<world step='0'/>"),
                    {"scene.xml', line 1: <world>: step=\"0\" is out of range"});
    expect_contains(complaint("<world stepp='1'/>"),
                    {"line 1: <world>: it knows no attribute 'stepp'; did you mean 'step'?"});
    expect_contains(in_world("<ball name='a'/>"), {"line 2: <ball>: a world holds floor, robot, box"});
    expect_contains(in_world("<box/>"), {"line 2: <box>: it has no name; add one, e.g. name=\"parcel\""});
    expect_contains(in_world("<box name='a' size='1 2'/>"), {"size=\"1 2\" has 2 numbers; give 3"});
    expect_contains(in_world("<box name='a' mass='nan'/>"), {"mass=\"nan\": 'nan' is no finite number"});
    expect_contains(in_world("<box name='a' mass='0'/>"),
                    {"line 2: object 'a': its mass is 0 kg; give at least 1e-9"});
    expect_contains(in_world("<box name='a' size='1 1 0'/>"),
                    {"line 2: object 'a': its size has 0; give numbers above"});
    expect_contains(in_world("<box name='a' colour='1 0 2'/>"),
                    {"object 'a': its colour has 2; its parts are numbers from 0 to 1"});
    expect_contains(in_world("<box name='a' friction='-1'/>"),
                    {"object 'a': its friction is -1; give 0 to 1e"});
    expect_contains(in_world("<box name='a/b'/>"), {"line 2: the object 'a/b' has a '/'"});
    expect_contains(in_world("<box name='a'><box name='b'/></box>"), {"belongs beside it, into <world>"});
    expect_contains(
        in_world("<mesh name='a' file='none.stl'/>"),
        {"line 2: <mesh>: file=\"none.stl\": there is no file '", "begin at the folder of the description"});
    expect_contains(in_world(robot + "\n" + robot),
                    {"line 3: the name 'a' is taken at '", "line 2; rename this robot"});
    expect_contains(in_world("<robot name='a' file='none.urdf'/>"),
                    {"line 2: <robot>: file=\"none.urdf\": there is no file '"});
    expect_contains(in_world("<robot name='a' file='arm.urdf' base='flying'/>"),
                    {"base=\"flying\" is none of: fixed, floating"});
    expect_contains(in_world("<robot name='a' file='arm.urdf' joints='sholder'/>"),
                    {"line 2: robot 'a': ", "has no joint 'sholder'; similar names: shoulder"});
    expect_contains(in_world("<robot name='a' file='arm.urdf' joints='elbow elbow'/>"),
                    {"line 2: robot 'a': joint 'elbow' is listed twice"});
    expect_contains(
        in_world("<robot name='a' file='arm.urdf' initial='4'/>"),
        {"line 2: robot 'a': the initial position of joint 'shoulder' is 4; the robot's file limits"});
    EXPECT_TRUE(in_world("<robot name='a' file='arm.urdf' dropout='1'/>")
                    .ends_with("line 2: robot 'a': dropout is 1; it is a probability, from 0 to below 1"));
    const std::string missing = in_world("<robot name='a' file='armx.urdf'/>");
    expect_contains(missing, {"line 2: <robot>: file=\"armx.urdf\": there is no file '",
                              "begin at the folder of the description"});
    EXPECT_EQ(missing.find("working directory"), missing.npos) << "the folder of the description is meant";
    expect_contains(in_world("<robot name='a' file='arm.urdf' imu='head'/>"),
                    {"line 2: robot 'a': ", "has no link 'head', wanted as frame of the IMU"});
    EXPECT_NE(complaint(std::string("<world>") + robot + "<box name='floor'/></world>"), "");
}

TEST(Scene, RefusesNumbersThatMujocoTakesForADivergedMotionWhereTheyStand) {
    const auto in_world = [](const std::string& text) {
        return complaint("<world>\n" + text + "\n</world>");
    };
    for (const auto* attribute : {"position", "noise", "rpy"})
        expect_contains(
            in_world("<robot name='a' file='arm.urdf' " + std::string(attribute) + "='0 1e308 0'/>"),
            {"scene.xml', line 2: <robot>: ", attribute, "=\"0 1e308 0\": '1e308' is too large"});
    expect_contains(complaint("<world gravity='0 0 -1e308'/>"),
                    {"<world>: gravity=", "'-1e308' is too large"});
    expect_contains(in_world("<floor friction='1e308'/>"), {"line 2: <floor>: friction=\"1e308\""});
    expect_contains(
        in_world("<robot name='a' file='arm.urdf' encoder_resolution='1e-320'/>"),
        {"line 2: robot 'a'", "encoder_resolution holds ", "give 0, which is exact, or at least"});
    EXPECT_EQ(in_world("<robot name='a' file='arm.urdf' seed='1e14'/>"), "");
}

TEST(Scene, RefusesWhatItWouldPassOver) {
    expect_contains(complaint("<world/>\n<world><floor/></world>"), {"line 2: a file describes one world"});
    expect_contains(complaint("<world>hello<floor/></world>"), {"<world>: it holds the text 'hello'"});
    expect_contains(complaint("<world><floor>flat</floor></world>"), {"<floor>: it holds the text 'flat'"});
    expect_contains(complaint("<world><floor/>\n<floor friction='0.1'/></world>"),
                    {"line 2: <floor>: there is a floor already, '", "line 1; leave one of them out"});
    for (const auto* count : {"2.5", "-3", "1e9"})
        expect_contains(complaint("<world><steps name='s' count='" + std::string(count) + "'/></world>"),
                        {"<steps>: count=\"", count, "\" is no whole number from 1 to 1000"});
    expect_contains(complaint("<world><robot name='a' file='arm.urdf' push_links='fore fore'/></world>"),
                    {"robot 'a'", "push_links names 'fore' twice"});
    expect_contains(complaint("<world><robot name='a' file='arm.urdf' ft_sensors='elbow'/></world>"),
                    {"force/torque sensor at 'elbow': the joint 'elbow' moves, its type is revolute"});
    expect_contains(complaint("<world><robot name='a' file='arm.urdf' command_delay='-0.001'/></world>"),
                    {"command_delay holds -0.001"});
    expect_contains(complaint("<world><robot name='a' file='arm.urdf' measurement_delay='1000'/></world>"),
                    {"measurement_delay is 1000 s, which is the time step, 0.001 s, more than 999999 times"});
    expect_contains(complaint("<world><robot name='a' file='arm.urdf' k_tau='0'/></world>"),
                    {"'k_tau' has 0 for joint"});
    std::ofstream(BF_BINARY_DIRECTORY "/flat.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    expect_contains(complaint("<world><floor/>\n<mesh name='m' mass='1' file='flat.obj'/></world>"),
                    {"scene.xml', line 2: object 'm': MuJoCo cannot make it ("});
    expect_contains(complaint(""), {"scene.xml': it is no XML (XML_ERROR_EMPTY_DOCUMENT); it is empty"});
}

TEST(Scene, StartsWithinTheLimitsAndNamesWhatOfAUrdfItLeavesOut) {
    const std::string mass =
        R"("><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>)";
    const auto with = [&](const std::string& joint) {
        SceneOptions options;
        options.robots = {{"odd"}};
        options.robots[0].options.floating_base = false;
        options.robots[0].options.urdf =
            write_urdf("odd", "<link name=\"a" + mass + "<link name=\"b" + mass + "<joint name=\"j\" " +
                                  joint + "<parent link=\"a\"/><child link=\"b\"/></joint>");
        return options;
    };
    const SceneSimulation sim =
        simulate(with(R"(type="revolute"><limit lower="1" upper="2" effort="1" velocity="1"/>)"));
    EXPECT_EQ(sim.s(0)[0], 1.0);
    for (const std::string type : {"floating", "planar"}) {
        const Scene scene(with("type=\"" + type + "\">"));
        ASSERT_EQ(scene.warnings().size(), 1u);
        expect_contains(scene.warnings()[0],
                        {"robot 'odd': joint 'j' of 'odd.urdf' is ", type.c_str(), "locked"});
    }
    expect_contains(complaint(with(R"(type="continuous"><mimic joint="zz"/>)")),
                    {"robot 'odd': joint 'j' of '", "mimics 'zz', which is no joint there"});
}

TEST(Scene, KnowsStatesOfOtherWorlds) {
    SceneOptions options = two_arms();
    options.objects = {ball("ball", 0.1, at(0, 1, 0.1), 0.3)};
    const auto state_of = [](const SceneOptions& of) {
        const SceneSimulation sim = simulate(of);
        std::vector<double> state(static_cast<size_t>(sim.state_size()));
        sim.save(state.data());
        return state;
    };
    const SceneSimulation sim = simulate(options);
    EXPECT_TRUE(sim.is_of_this_scene(state_of(options).data()));
    EXPECT_TRUE(sim.is_of_this_scene(state_of(sim.scene().options()).data())) << "names filled in";
    const auto is_known = [&](const std::function<void(SceneOptions&)>& change) {
        SceneOptions other = options;
        change(other);
        const auto state = state_of(other);
        EXPECT_EQ(std::ssize(state), sim.state_size());
        return sim.is_of_this_scene(state.data());
    };
    EXPECT_FALSE(is_known([](auto& o) { o.objects[0].mass = 3.0; }));
    EXPECT_FALSE(is_known([](auto& o) { o.objects[0].surface.friction = 0.5; }));
    EXPECT_FALSE(is_known([](auto& o) { o.gravity[2] = -1.6; }));
    EXPECT_FALSE(is_known([](auto& o) { o.time_step = 0.002; }));
    EXPECT_FALSE(is_known([](auto& o) { o.robots[1].options.noise.seed = 7; }));
    EXPECT_FALSE(is_known([](auto& o) { o.robots[1].options.imperfections.encoder_resolution = {0.01}; }));
    EXPECT_FALSE(is_known([](auto& o) { o.robots[0].motors.k_tau = {2.0}; }));
    EXPECT_FALSE(is_known([](auto& o) { o.robots[0].options.initial_w_H_b = at(0, 2, 2); }));
}

TEST(Scene, HasNoiseThatIsAnotherOneForEachRobotAndTheSameInEachRun) {
    arm_urdf();
    const std::string file = BF_BINARY_DIRECTORY "/noise.xml";
    std::ofstream(file) << R"(<world><robot name="a" file="arm.urdf" noise="0.01 0.1 0"/>
      <robot name="b" file="arm.urdf" position="0 2 0" noise="0.01 0.1 0"/>
      <robot name="c" file="arm.urdf" position="0 4 0" noise="0.01 0.1 0" seed="1"/>
      <robot name="d" file="arm.urdf" position="0 6 0"/></world>)";
    SceneSimulation sim = simulate(SceneOptions::read(file)), again = simulate(SceneOptions::read(file));
    double squares = 0.0;
    for (int k = 0; k < 500; ++k) {
        ASSERT_TRUE(sim.step());
        ASSERT_TRUE(again.step());
        EXPECT_EQ(sim.s(0), again.s(0));
        EXPECT_NE(sim.s(0), sim.s(1));
        EXPECT_EQ((sim.s(0) - sim.s(3)).norm(), (sim.s(2) - sim.s(3)).norm()) << "of one seed";
        squares += (sim.s(1) - sim.s(3)).squaredNorm() / 1000;
    }
    EXPECT_NEAR(std::sqrt(squares), 0.01, 0.001);
    expect_contains(complaint("<world><robot name='a' file='arm.urdf' seed='-1'/></world>"),
                    {"seed=\"-1\" is no whole number"});
}

TEST(Scene, MeasuresDistancesAlongRays) {
    SceneOptions options;
    options.objects.resize(2);
    options.objects[0].name = "wall";
    options.objects[0].size = {0.2, 10, 4};
    options.objects[0].w_H_o = at(3.1, 0, 0);
    options.objects[1] = ball("sensor", 0.1, at(0, 0, 0.5, 0.3), 1.0); // turned by 0.3
    SceneSimulation sim = simulate(options);
    Eigen::Matrix3Xd directions(3, 4);
    const double angles[] = {-0.3, 0.2, 2.5};
    for (int i = 0; i < 3; ++i) directions.col(i) << std::cos(angles[i]), std::sin(angles[i]), 0;
    directions.col(3) << 0, 0, -1;
    Eigen::VectorXd distances(4);
    Eigen::Matrix4d raised = at(0, 0, 0.2);
    sim.measure_rays({sim.scene().body("sensor"), raised}, directions, 8.0, distances);
    EXPECT_NEAR(distances[0], 3.0, 1e-9);
    EXPECT_NEAR(distances[1], 3.0 / std::cos(0.5), 1e-9);
    EXPECT_EQ(distances[2], 8.0) << "nothing there";
    EXPECT_NEAR(distances[3], 0.7, 1e-9) << "the floor, through the sensor's own ball";
    EXPECT_THROW(sim.scene().body("wal"), std::runtime_error);
}

TEST(Scene, NamesAllItsPositions) {
    SceneOptions options = two_arms();
    options.robots[1] = arm("right", at(0, -1, 2), true);
    options.objects = {ball("ball", 0.1, at(1, 2, 3), 1.0)};
    const Scene scene(options);
    const std::vector<std::string> names = scene.position_names();
    ASSERT_EQ(names.size(), static_cast<size_t>(scene.position_count()));
    SceneSimulation sim(std::make_shared<const Scene>(options));
    const auto q = [&](const std::string& name) {
        const auto found = std::find(names.begin(), names.end(), name);
        EXPECT_NE(found, names.end()) << name;
        return sim.q()[found - names.begin()];
    };
    EXPECT_EQ(q("left/elbow"), -0.3);
    EXPECT_EQ(q("ball.y"), 2);
    EXPECT_EQ(q("ball.qw"), 1);
    EXPECT_NEAR(q("right/stand.y"), -1, 1e-12);
    EXPECT_EQ(q("right/shoulder"), sim.s(1)[0]);
}

TEST(Scene, ListsTheRobotsThereAre) {
    const Scene scene(two_arms());
    EXPECT_THROW(
        try { scene.robot("lft"); } catch (const std::runtime_error& error) {
            EXPECT_STREQ(error.what(),
                         "the world has no robot 'lft'; did you mean 'left'? there are: left, right");
            throw;
        },
        std::runtime_error);
    EXPECT_THROW(scene.object("box"), std::runtime_error);
}

TEST(Scene, GivesMovingLinksWithoutMassALittleAndNamesRobotAndLink) {
    SceneOptions options;
    options.robots = {{"odd"}};
    options.robots[0].options.urdf = write_urdf("ghost", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="ghost"/>
      <joint name="hinge" type="continuous"><parent link="stand"/><child link="ghost"/></joint>)");
    const Scene scene(options);
    ASSERT_EQ(scene.warnings().size(), 1u);
    expect_contains(scene.warnings()[0], {"robot 'odd': link 'ghost' of 'ghost.urdf' moves without mass"});
    options = two_arms();
    options.robots[1].name = "left";
    expect_contains(complaint(options), {"the name 'left' is taken; rename this robot"});
}

} // namespace bf::physics::test::scene
