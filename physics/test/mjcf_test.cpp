#include "bf/physics/scene.hpp"
#include "complaints.hpp"

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <memory>
#include <mujoco/mujoco.h>
#include <numbers>

namespace bf::physics::test::mjcf {

namespace {

namespace fs = std::filesystem;

/// A folder of its own for each test, with files written into it.
class Folder {
  public:
    explicit Folder(const std::string& name) : path_(fs::path(BF_BINARY_DIRECTORY) / ("mjcf_" + name)) {
        fs::remove_all(path_);
        fs::create_directories(path_);
    }
    fs::path operator/(const std::string& name) const { return path_ / name; }
    fs::path write(const std::string& name, const std::string& text) const {
        fs::create_directories((path_ / name).parent_path());
        std::ofstream(path_ / name) << text;
        return path_ / name;
    }

  private:
    fs::path path_;
};

/// A tetrahedron that contains the origin.
const std::string tetrahedron =
    "v 0.1 0 -0.05\nv -0.05 0.09 -0.05\nv -0.05 -0.09 -0.05\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

SceneRobot robot(const std::string& name, const fs::path& file) {
    SceneRobot made{name};
    made.options.urdf = file;
    return made;
}

SceneSimulation simulate(std::vector<SceneRobot> robots, std::vector<SceneObject> objects = {}) {
    SceneOptions options;
    options.floor.enabled = false;
    options.robots = std::move(robots);
    options.objects = std::move(objects);
    return SceneSimulation(std::make_shared<const Scene>(std::move(options)));
}

std::string complaint(const SceneRobot& made) {
    return complaint_of([&] { simulate({made}); });
}

/// In the style of robots that come as folders: an included file of defaults, classes, meshes in a folder.
fs::path leg(const Folder& folder) {
    folder.write("assets/part.obj", tetrahedron);
    folder.write("parts/defaults.xml", R"(<mujoco><default>
      <joint axis="0 1 0" armature="0.02"/><site pos="1 2 3"/><motor gear="7" ctrlrange="-1 1"/>
      <default class="leg"><joint damping="0.3" range="-90 90"/><geom type="mesh" mesh="part"/>
        <default class="knee"><joint range="-120 0"/><position kp="30" kv="2" forcerange="-25 25"/></default>
        <default class="hip"><motor gear="1" ctrlrange="-40 40"/></default></default></default></mujoco>)");
    return folder.write("leg.xml",
                        R"(<mujoco model="leg"><compiler angle="degree" meshdir="assets" autolimits="true"/>
      <include file="parts/defaults.xml"/>
      <asset><mesh name="part" file="part.obj"/></asset>
      <worldbody><body name="trunk" pos="0 0 0.7" childclass="leg"><freejoint/><inertial mass="5" pos="0 0 0" diaginertia="0.1 0.1 0.1"/>
        <site name="imu"/>
        <body name="thigh" pos="0 0 -0.1"><joint name="hip"/><inertial mass="1" pos="0 0 -0.15" diaginertia="0.02 0.02 0.002"/><geom pos="0 0 -0.1"/>
          <body name="shin" pos="0 0 -0.3"><joint name="knee" class="knee"/><inertial mass="0.5" pos="0 0 -0.1" diaginertia="0.005 0.005 0.001"/></body>
        </body></body></worldbody>
      <actuator><motor name="hip" class="hip" joint="hip"/><position name="knee" class="knee" joint="knee"/></actuator>
      <sensor><gyro name="gyro" site="imu"/></sensor>
      <keyframe><key name="home" qpos="0 0 0.5 1 0 0 0 0.4 -0.8"/></keyframe></mujoco>)");
}

} // namespace

TEST(Mjcf, IsTakenAsItIs) {
    const Folder folder("leg");
    SceneRobot walker = robot("walker", leg(folder));
    walker.key = "home";
    walker.options.initial_w_H_b = Eigen::Matrix4d::Identity();
    (*walker.options.initial_w_H_b)(0, 3) = 3.0;
    SceneSimulation sim = simulate({walker, robot("other", folder / "leg.xml")});
    const Scene& scene = sim.scene();
    EXPECT_EQ(scene.joint_names(0), (std::vector<std::string>{"hip", "knee"}));
    EXPECT_TRUE(scene.actuators(0).empty());
    EXPECT_NEAR(scene.mass(0), 6.5, 1e-12);
    EXPECT_NEAR(scene.upper_limits(0)[0], std::numbers::pi / 2, 1e-12);
    EXPECT_NEAR(scene.lower_limits(0)[1], -2 * std::numbers::pi / 3, 1e-12);
    EXPECT_EQ(scene.effort_limits(0), Eigen::Vector2d(40, 7 * 25))
        << "of the actuators that gave way to motors, with the gear that the outer class gives to all";
    const Gains& gains = sim.control(0).gains(Loop::position);
    EXPECT_EQ(gains.P[1], 7 * 7 * 30);
    EXPECT_EQ(gains.D[1], 7 * 7 * 2) << "of the position actuator";
    EXPECT_NEAR(gains.D[0], gains.P[0] / 15, 1e-12) << "of none, so that it is damped critically";
    EXPECT_EQ(sim.s(0), Eigen::Vector2d(0.4, -0.8)) << "the key frame";
    EXPECT_EQ(sim.s(1), Eigen::Vector2d(0, 0));
    EXPECT_EQ(sim.w_H_b(0).topRightCorner(3, 1), Eigen::Vector3d(3, 0, 0.7))
        << "the base is where the file has it";
    EXPECT_EQ(scene.options().robots[0].options.base_link, "trunk");

    // Without torques both fall as one piece but for what swings, and the trunk's gyro is ours.
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(sim.step()) << sim.error();
    EXPECT_NEAR(sim.com(1)[2] - 0.0, 0.7 - (1 * 0.25 + 0.5 * 0.5) / 6.5 - 9.81e-6 * 100 * 101 / 2, 1e-6);
    EXPECT_NEAR(sim.gyro(0)[1], sim.v_b(0)[4], 1e-9);
    // Torque 2 Nm on a hip alone: the joint's equation with the armature of the default class.
    sim.set_torque(1, std::array{2.0, 0.0});
    ASSERT_TRUE(sim.step());
    EXPECT_EQ(sim.tau(1)[0], 2.0) << "no gear and no limit of the file's default for motors";
}

TEST(Mjcf, MovesAsMujocoMovesItWithItsPositionActuators) {
    // The second joint's damping alone would turn its velocity over 4 times in each explicit step.
    const Folder folder("stiff");
    const fs::path file =
        folder.write("stiff.xml", R"(<mujoco><option integrator="implicitfast" timestep="0.001"/>
      <worldbody><body name="base"><geom type="box" size=".05 .05 .05" mass="1"/>
        <body name="l1" pos="0 0 .5"><joint name="a1" axis="0 1 0" damping="0.1"/><geom type="capsule" fromto="0.05 0 0 .3 0 0" size=".02" mass="1"/>
          <body name="l2" pos=".4 0 0"><joint name="a2" axis="0 1 0"/><geom type="capsule" fromto="0.05 0 0 .3 0 0" size=".02" mass=".5"/></body></body></body></worldbody>
      <actuator><position joint="a1" kp="50" kv="3" forcerange="-20 20"/><position joint="a2" kp="1000" kv="100" forcerange="-500 500"/></actuator></mujoco>)");
    std::array<char, 256> error{};
    const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model(
        mj_loadXML(file.c_str(), nullptr, error.data(), std::ssize(error)), mj_deleteModel);
    ASSERT_TRUE(model) << error.data();
    for (const double size : {0.3, 0.6}) { // within the limits of the forces, and beyond at first
        const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model.get()), mj_deleteData);
        SceneSimulation sim = simulate({robot("arm", file)});
        EXPECT_TRUE(sim.scene().loop_warnings().empty());
        sim.set_mode(0, ControlMode::position_direct);
        const Eigen::Vector2d reference(size, -0.7 * size);
        sim.control(0).set_reference(reference);
        std::copy_n(reference.data(), 2, data->ctrl);
        std::vector<double> state(static_cast<size_t>(sim.state_size()));
        for (int k = 0; k < 400; ++k) {
            ASSERT_TRUE(sim.step()) << sim.error();
            mj_step(model.get(), data.get());
            ASSERT_NEAR(sim.s(0)[0], data->qpos[0], 1e-9) << size << " " << k;
            ASSERT_NEAR(sim.s(0)[1], data->qpos[1], 1e-9) << size << " " << k;
            ASSERT_NEAR(sim.tau(0)[1], data->qfrc_actuator[1], 1e-6) << size << " " << k;
            if (k == 100) sim.save(state.data());
        }
        const Eigen::Vector2d end = sim.s(0);
        sim.restore(state.data());
        for (int k = 101; k < 400; ++k) ASSERT_TRUE(sim.step());
        EXPECT_EQ(sim.s(0), end);
        sim.set_torque(0, std::array{0.5, -0.25}); // nothing of the loops is left in it
        ASSERT_TRUE(sim.step());
        EXPECT_EQ(sim.tau(0), Eigen::Vector2d(0.5, -0.25));
    }
    SceneOptions explicit_loops;
    explicit_loops.robots = {robot("arm", file)};
    explicit_loops.integrator = Integrator::euler;
    const Scene euler(explicit_loops);
    ASSERT_EQ(euler.loop_warnings().size(), 1u);
    expect_contains(euler.loop_warnings()[0],
                    {"robot 'arm': joint 'a2': its position_gains are P 1000, I 0, D 100, which a loop of"});
    explicit_loops.integrator = Integrator::implicit_fast;
    explicit_loops.robots[0].loop_period = 0.002;
    EXPECT_EQ(Scene(explicit_loops).loop_warnings().size(), 1u);
}

/// What the robots of public collections use, and more: degrees and Euler angles, nested classes, frames and
/// copies, tendons of both kinds with springs and limits, equalities of all kinds, springs, references, dry
/// friction, gravity compensation, exclusions and pairs of contacts, meshes without a name behind stripped
/// paths.
fs::path everything(const Folder& folder) {
    folder.write("assets/part.obj", tetrahedron);
    return folder.write("all.xml", R"(<mujoco model="all">
      <compiler angle="degree" eulerseq="zyx" meshdir="assets" strippath="true" autolimits="true" boundmass="0.001"/>
      <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="100"/>
      <default><joint armature="0.01" damping="0.1" axis="0 1 0"/><geom density="500" solref="0.01 1"/>
        <default class="chain"><joint range="-80 80" solreflimit="0.01 1"/><geom type="capsule" size="0.02" friction="0.6"/>
          <default class="soft"><joint stiffness="2" springref="10" frictionloss="0.05"/></default></default>
        <default class="shell"><geom type="mesh" contype="0" conaffinity="0" group="2"/></default></default>
      <asset><mesh file="a/b/part.obj" scale="0.5 0.5 0.5"/></asset>
      <worldbody><geom name="ground" type="plane" size="5 5 .1" pos="0 0 -0.6" euler="0 5 0"/>
        <body name="base" pos="0 0 0.6"><geom class="shell" mesh="part" mass="1"/><geom type="box" size=".1 .1 .05"/>
          <site name="anchor" pos="0.1 0 0.1"/><site name="around" pos="0.2 0 0.2"/>
          <frame euler="0 0 20" childclass="chain">
            <body name="a1" pos="0.1 0 0" euler="10 20 30"><joint name="a1"/><geom fromto="0 0 0 .3 0 0"/><geom name="pulley" class="chain" type="cylinder" size="0.03 0.02" pos="0.1 0 0" euler="0 0 90" contype="0" conaffinity="0" mass="0"/>
              <body name="a2" pos=".3 0 0" gravcomp="0.5"><joint name="a2" class="soft"/><geom fromto="0 0 0 .3 0 0"/><site name="tip" pos=".2 0 0"/>
                <body name="a3" pos=".3 0 0"><joint name="a3" ref="5" axis="1 0 0"/><geom fromto="0 0 0 0 .2 0"/></body></body></body></frame>
          <body name="b1" pos="-0.1 0 0"><joint name="b1" range="-90 90"/><geom type="capsule" size=".02" fromto="0 0 0 -.3 0 0"/>
            <body name="b2" pos="-.3 0 0"><joint name="b2"/><geom type="capsule" size=".02" fromto="0 0 0 0 0 -.3"/><site name="b_end" pos="0 0 -.3"/></body></body>
          <body name="c1" pos="-0.4 0 -0.3"><joint name="c1" type="ball" damping="0.05"/><geom size=".03"/><site name="c_top"/></body>
          <replicate count="2" offset="0 0.1 0"><body pos="0 0.3 0"><joint type="slide" axis="0 0 1" range="-0.2 0.1" stiffness="20"/><geom size=".03"/></body></replicate></body>
        <body name="loose" pos="0.3 0 -0.4"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
        <body name="welded" pos="0 1 0"><freejoint/><geom size=".05"/></body></worldbody>
      <tendon><fixed name="sum" stiffness="3" springlength="0.2"><joint joint="a1" coef="0.5"/><joint joint="b1" coef="-0.5"/></fixed>
        <spatial name="cable" range="0 0.5" solreflimit="0.01 1"><site site="anchor"/><geom geom="pulley" sidesite="around"/><site site="tip"/></spatial>
        <spatial name="spring" stiffness="40" damping="0.5" springlength="0 0.1"><site site="tip"/><site site="anchor"/><pulley divisor="2"/><site site="anchor"/><site site="b_end"/></spatial></tendon>
      <equality><connect body1="c1" body2="b2" anchor="0 0 0" solref="0.01 1"/><weld body1="welded" relpose="0 -1 0.01 1 0 0 0"/>
        <joint joint1="a3" joint2="b2" polycoef="0.1 0.5 0.2 0 0" solref="0.01 1"/><tendon tendon1="sum" active="false"/></equality>
      <contact><exclude body1="a1" body2="a3"/><pair geom1="pulley" geom2="ground" friction="1 1 0.005 0.0001 0.0001"/></contact>
      <actuator><general name="pull" tendon="cable" gainprm="4" biasprm="0 -2 -0.5" biastype="affine" dyntype="filter" dynprm="0.05" ctrlrange="-5 5"/>
        <motor name="first" joint="a1" gear="1"/></actuator>
      <sensor><framequat objtype="site" objname="tip"/><tendonpos tendon="cable"/><touch site="c_top"/></sensor>
      <keyframe><key name="begin" qpos="0.2 -0.3 0.087 -0.1 0.2 0.8 0.6 0 0 0 -0.05 0.3 0 -0.4 1 0 0 0 0 1 0 1 0 0 0"/></keyframe></mujoco>)");
}

TEST(Mjcf, MovesAsMujocoMovesItWithAllThatAFileMayHave) {
    const Folder folder("everything");
    const fs::path file = everything(folder);
    std::array<char, 512> error{};
    const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model(
        mj_loadXML(file.c_str(), nullptr, error.data(), std::ssize(error)), mj_deleteModel);
    ASSERT_TRUE(model) << error.data();
    const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(model.get()), mj_deleteData);
    mj_resetDataKeyframe(model.get(), data.get(), 0);
    SceneRobot made = robot("a", file);
    made.key = "begin";
    SceneSimulation sim = simulate({made});
    ASSERT_EQ(sim.q().size(), model->nq);
    ASSERT_EQ(sim.scene().actuators(0), std::vector<std::string>{"pull"});
    Eigen::Vector<double, 5> farthest = Eigen::Vector<double, 5>::Zero();
    for (int k = 0; k < 1000; ++k) {
        const double pull = 5 * std::sin(0.01 * k), torque = 6 * std::cos(0.01 * k);
        sim.set_control(sim.scene().actuator(0, "pull"), pull);
        sim.set_torque(0, std::array{torque});
        data->ctrl[0] = pull;
        data->ctrl[1] = torque;
        ASSERT_TRUE(sim.step()) << sim.error();
        mj_step(model.get(), data.get());
        for (int i = 0; i < model->nq; ++i)
            ASSERT_NEAR(sim.q()[i], data->qpos[i], 1e-9) << i << " in step " << k;
        for (int i = 0; i < 5; ++i)
            farthest[i] = std::max(farthest[i], std::abs(data->qpos[i] - model->key_qpos[i]));
    }
    EXPECT_GT(farthest.minCoeff(), 1e-3) << farthest.transpose() << ": all hinges turn";
    EXPECT_GT(farthest.maxCoeff(), 0.1);
    EXPECT_GT(data->ncon, 0) << "it touches the ground";
}

TEST(Mjcf, MayBeOneOfSeveralBodiesOfAFile) {
    const Folder folder("several");
    const fs::path file = folder.write("scene.xml", R"(<mujoco><worldbody><geom type="plane" size="1 1 1"/>
      <body name="a" pos="1 0 1"><geom size="0.1" mass="1"/><body name="arm_a" pos="0 0 -0.1"><joint name="ja" axis="0 1 0"/><geom size="0.05" pos="0 0 -0.3" mass="0.5"/></body></body>
      <body name="b" pos="-1 0 1"><geom size="0.1" mass="2"/><body name="arm_b" pos="0 0 -0.1"><joint name="jb" axis="0 1 0"/><geom size="0.05" pos="0 0 -0.3" mass="0.25"/></body></body>
      </worldbody><actuator><motor joint="jb"/></actuator></mujoco>)");
    SceneRobot b = robot("b", file);
    b.body = "b";
    const SceneSimulation sim = simulate({b});
    EXPECT_EQ(sim.scene().joint_names(0), std::vector<std::string>{"jb"});
    EXPECT_NEAR(sim.scene().mass(0), 2.25, 1e-12);
    EXPECT_EQ(sim.scene().bodies(), (std::vector<std::string>{"b/b", "b/arm_b"}));
    b.body = "c";
    expect_contains(complaint(b), {"robot 'b': '", "scene.xml' has no body 'c', wanted as the robot"});
}

TEST(Mjcf, ClosesLoops) {
    // A parallelogram: crank and rocker of one length turn alike, though only the crank has a motor.
    const Folder folder("loop");
    const fs::path file = folder.write("loop.xml", R"(<mujoco><compiler angle="radian"/><worldbody>
      <body name="frame"><geom type="box" size="0.2 0.02 0.02" mass="1" contype="0" conaffinity="0"/>
        <body name="crank" pos="-0.2 0 0"><joint name="crank" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.01" mass="0.2" contype="0" conaffinity="0"/>
          <body name="coupler" pos="0 0 0.3"><joint name="coupler" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.01" mass="0.2" contype="0" conaffinity="0"/></body></body>
        <body name="rocker" pos="0.2 0 0"><joint name="rocker" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.01" mass="0.2" contype="0" conaffinity="0"/></body></body>
      </worldbody><equality><connect body1="coupler" body2="rocker" anchor="0.4 0 0" solref="0.002 1"/></equality>
      <actuator><motor joint="crank"/></actuator></mujoco>)");
    SceneSimulation sim = simulate({robot("linkage", file)});
    ASSERT_EQ(sim.scene().joint_names(0), std::vector<std::string>{"crank"});
    double reached = 0.0;
    for (int k = 0; k < 600; ++k) {
        sim.set_torque(0, std::array{30.0 * (0.6 - sim.s(0)[0]) - 2.0 * sim.s_dot(0)[0]});
        ASSERT_TRUE(sim.step()) << sim.error();
        EXPECT_NEAR(sim.q()[2], sim.q()[0], 2e-3) << k;  // rocker
        EXPECT_NEAR(sim.q()[1], -sim.q()[0], 2e-3) << k; // the coupler stays level
        reached = std::max(reached, sim.s(0)[0]);
    }
    EXPECT_GT(reached, 0.5);
}

TEST(Mjcf, HoldsABallInAGripper) {
    const Folder folder("gripper");
    const fs::path file =
        folder.write("hand.xml", R"(<mujoco><default><geom friction="1.5"/></default><worldbody>
      <body name="palm" pos="0 0 1"><geom type="box" size="0.1 0.03 0.01" mass="1"/>
        <body name="left" pos="0 0 -0.06"><joint name="left" type="slide" axis="-1 0 0" range="0 0.08" limited="true" damping="5"/><geom type="box" size="0.01 0.02 0.04" mass="0.1"/></body>
        <body name="right" pos="0 0 -0.06"><joint name="right" type="slide" axis="1 0 0" range="0 0.08" limited="true" damping="5"/><geom type="box" size="0.01 0.02 0.04" mass="0.1"/></body></body></worldbody>
      <contact><exclude body1="left" body2="right"/></contact>
      <tendon><fixed name="split"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed></tendon>
      <equality><joint joint1="left" joint2="right" solref="0.005 1"/></equality>
      <actuator><position name="grip" tendon="split" kp="1000" forcerange="-20 20" ctrlrange="0 0.08"/></actuator>
      <keyframe><key name="open" qpos="0.06 0.06"/></keyframe></mujoco>)");
    SceneObject ball;
    ball.kind = SceneObject::Kind::sphere;
    ball.name = "ball";
    ball.size[0] = 0.03;
    ball.mass = 0.1;
    ball.w_H_o(2, 3) = 0.92;
    SceneRobot hand = robot("hand", file);
    hand.key = "open";
    SceneSimulation sim = simulate({hand}, {ball});
    const Scene& scene = sim.scene();
    EXPECT_EQ(scene.joint_count(0), 0) << "the tendon drives both fingers";
    EXPECT_EQ(scene.actuators(0), std::vector<std::string>{"grip"});
    const int grip = scene.actuator(0, "grip");
    sim.set_control(grip, 0.0);
    std::vector<double> state(static_cast<size_t>(sim.state_size()));
    for (int k = 0; k < 1500; ++k) {
        ASSERT_TRUE(sim.step()) << sim.error();
        if (k == 500) sim.save(state.data());
    }
    const double held = sim.w_H_o(0)(2, 3);
    EXPECT_GT(held, 0.85) << "it does not fall";
    EXPECT_NEAR(sim.q()[0], sim.q()[1], 1e-3);
    EXPECT_NEAR(sim.q()[0], 0.04, 5e-3) << "half a finger and the ball's radius";
    sim.restore(state.data());
    for (int k = 501; k < 1500; ++k) ASSERT_TRUE(sim.step());
    EXPECT_EQ(sim.w_H_o(0)(2, 3), held);
    sim.set_control(grip, 0.08);
    for (int k = 0; k < 500; ++k) ASSERT_TRUE(sim.step());
    EXPECT_LT(sim.w_H_o(0)(2, 3), held - 0.5) << "until it is let go";
    sim.set_control(grip, std::nan(""));
    EXPECT_FALSE(sim.step());
    expect_contains(sim.error(), {"the control of actuator 'hand/grip' is nan"});
    EXPECT_THROW(
        try { scene.actuator(0, "gripp"); } catch (const std::runtime_error& error) {
            expect_contains(error.what(),
                            {"robot 'hand' has no actuator 'gripp'; did you mean 'grip'? there are: grip"});
            throw;
        },
        std::runtime_error);
}

TEST(Mjcf, MayHaveBodiesJointsAndActuatorsWithoutNames) {
    const Folder folder("nameless");
    SceneSimulation sim = simulate({robot("a", folder.write("a.xml", R"(<mujoco><worldbody>
      <body name="q"><geom size="0.1"/><joint name="first"/><body pos="1 0 0"><joint/><geom size="0.1"/>
        <body pos="1 0 0"><geom size="0.1"/></body></body></body></worldbody>
      <actuator><motor joint="first"/></actuator></mujoco>)"))});
    EXPECT_TRUE(sim.step());
    EXPECT_EQ(sim.scene().bodies(), (std::vector<std::string>{"a/q", "a/bf:body:1"}));
    EXPECT_EQ(sim.scene().joint_names(0), std::vector<std::string>{"first"});
    EXPECT_EQ(sim.scene().position_names(), (std::vector<std::string>{"a/first", "a/bf:joint:1"}));
}

TEST(Mjcf, RefusesWhatIsWrongWithFileAndLine) {
    const Folder folder("wrong");
    const auto with = [&](const std::string& text) {
        return complaint(robot("a", folder.write("a.xml", text)));
    };
    const std::string body =
        "<worldbody><body name='b'><joint name='j'/><geom size='0.1'/></body></worldbody>";
    EXPECT_EQ(with("<mujoco>" + body + "</mujoco>"), "");
    folder.write("inside.xml", "<mujoco>\n<include file='../outside.xml'/></mujoco>");
    folder.write("../outside.xml", "<mujoco/>");
    expect_contains(with("<mujoco>\n\n<include file='../outside.xml'/>" + body + "</mujoco>"),
                    {"robot 'a': '",
                     "a.xml', line 3: <include file=\"../outside.xml\"> is outside of the folder '",
                     "move the file into it"});
    expect_contains(with("<mujoco><include file='inside.xml'/>" + body + "</mujoco>"),
                    {"inside.xml', line 2: <include file=\"../outside.xml\"> is outside"});
    expect_contains(with("<mujoco><include file='/etc/passwd'/>" + body + "</mujoco>"),
                    {"is outside of the folder"});
    expect_contains(with("<mujoco><include file='none.xml'/>" + body + "</mujoco>"),
                    {"line 1: <include", "there is no file"});
    expect_contains(with("<mujoco>\n<worldbody><bod/></worldbody></mujoco>"),
                    {"MuJoCo cannot read '", "a.xml'", "bod"});
    expect_contains(with("<mujoco/>"), {"has no <body>; a robot has one"});
    expect_contains(with("<mujoco><worldbody><body name='ghost'><joint/></body></worldbody></mujoco>"),
                    {"robot 'a': MuJoCo cannot compile '", "mass", "ghost"});
    expect_contains(with("<mujoco>\n<worldbody>"), {"a.xml', line ", "it is no XML"});
    fs::create_symlink("../outside.xml", folder / "link.xml");
    expect_contains(with("<mujoco><include file='link.xml'/>" + body + "</mujoco>"),
                    {"<include file=\"link.xml\"> is outside of the folder"});
    folder.write("../outside.obj", tetrahedron);
    folder.write("assets/part.obj", tetrahedron);
    const auto mesh = [&](const std::string& settings, const std::string& file) {
        return with("<mujoco><compiler " + settings + "/>\n<asset><mesh name='m' file='" + file +
                    "'/></asset>" + body + "</mujoco>");
    };
    EXPECT_EQ(mesh("meshdir='assets'", "part.obj"), "");
    EXPECT_EQ(mesh("meshdir='assets' strippath='true'", "../part.obj"), "");
    expect_contains(mesh("", "../outside.obj"),
                    {"a.xml', line 2: <mesh file=\"../outside.obj\"> is outside of the folder"});
    expect_contains(with("<mujoco><asset><texture name='t' type='cube' fileright='../outside.png'/></asset>" +
                         body + "</mujoco>"),
                    {"line 1: <texture fileright=\"../outside.png\"> is outside of the folder"});
    expect_contains(mesh("meshdir='..'", "outside.obj"), {"<mesh file=\"outside.obj\"> is outside"});
    SceneRobot made = robot(
        "a", folder.write("a.xml", "<mujoco>" + body +
                                       R"(<keyframe><key name="far" qpos="nan"/></keyframe></mujoco>)"));
    made.key = "far";
    expect_contains(complaint(made), {"key frame 'far' of '", "puts joint 'j' at nan"});
    made = robot("a", folder.write("a.xml", "<mujoco>" + body + "</mujoco>"));
    made.options.joints = {"jj"};
    expect_contains(complaint(made), {"has no joint 'jj'; similar names: j"});
    made.options.joints = {"j", "j"};
    expect_contains(complaint(made), {"joint 'j' is listed twice"});
    made.options.joints.clear();
    made.key = "home";
    expect_contains(complaint(made), {"has no key frame 'home'"});
    made.key.clear();
    made.options.imu_frame = "head";
    expect_contains(complaint(made), {"has no body 'head', wanted as body of the IMU"});
}

} // namespace bf::physics::test::mjcf
