#include "bf/physics/world.hpp"
#include "complaints.hpp"
#include "robots.hpp"

#include <array>
#include <gtest/gtest.h>
#include <limits>

using namespace bf::physics;
using namespace bf::physics::test;

namespace {

/// What World says about `options`; empty when it accepts them.
std::string complaint(const WorldOptions& options) {
    return complaint_of([&] { const World world(options); });
}

} // namespace

TEST(World, NamesAMissingUrdf) {
    WorldOptions options;
    options.urdf = "nowhere/robot.urdf";
    expect_contains(complaint(options), {"cannot read the URDF 'nowhere/robot.urdf'", "check the path"});
}

TEST(World, SuggestsSimilarNames) {
    WorldOptions options = icub_options();
    options.joints[14] = "l_kne";
    expect_contains(complaint(options), {"has no joint 'l_kne'", "similar names: l_knee"});
    options = icub_options();
    options.feet[0].frame = "left_sole";
    expect_contains(complaint(options), {"has no link 'left_sole', wanted as frame of a foot", "l_sole"});
    options = icub_options();
    options.base_link = "rot_link";
    expect_contains(complaint(options),
                    {"has no link 'rot_link', wanted as base link; similar names: root_link"});
    options = icub_options();
    options.push_links = {"chset"};
    expect_contains(complaint(options), {"has no link 'chset', wanted as link to push", "chest"});
    options = icub_options();
    options.ft_sensors = {"l_foot_ft_senso"};
    expect_contains(complaint(options),
                    {"has no link 'l_foot_ft_senso', wanted as child of a force/torque sensor"});
}

TEST(World, RefusesJointsWithoutMotor) {
    WorldOptions options = icub_options();
    options.joints[0] = "l_foot_ft_sensor";
    expect_contains(complaint(options), {"joint 'l_foot_ft_sensor'", "has no motor: its type is fixed"});
    options = icub_options();
    options.joints[0] = "l_knee";
    expect_contains(complaint(options), {"joint 'l_knee' is listed twice"});
}

TEST(World, RefusesASensorThatCarriesNothing) {
    WorldOptions options = icub_options();
    options.ft_sensors = {"l_foot_ft"};
    expect_contains(complaint(options),
                    {"force/torque sensor at 'l_foot_ft' carries no mass", "fixed joint"});
}

TEST(World, ListsEveryValueOutOfRangeAtOnce) {
    WorldOptions options = icub_options();
    options.time_step = -1e-3;
    options.impratio = 0.0;
    options.floor.friction = -1.0;
    options.feet[0].shapes.clear();
    options.feet[1].shapes[0].size.setZero();
    options.damping = {1.0, 2.0};
    options.armature = {std::numeric_limits<double>::quiet_NaN()};
    options.noise.velocity = -1.0;
    options.initial_w_H_b = Eigen::Matrix4d::Zero();
    expect_contains(complaint(options),
                    {"time_step is -0.001 s; it must be above 0", "impratio is 0", "floor.friction is -1",
                     "foot 'l_sole' has no contact shape",
                     "foot 'r_sole' has a contact shape of size (0 0 0)", "damping holds 2 values",
                     "armature holds nan", "noise holds -1", "initial_w_H_b"});
}

TEST(World, RefusesAStartOutsideTheJointLimits) {
    WorldOptions options = icub_options();
    options.initial_joints[14] = 1.0;
    expect_contains(complaint(options),
                    {"the initial position of joint 'l_knee' is 1; the robot's file limits it to ["});
}

TEST(World, GivesMovingLinksWithoutMassALittleAndNamesThem) {
    WorldOptions options;
    options.urdf = write_urdf("weightless", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="ghost"/>
      <joint name="hinge" type="continuous"><parent link="stand"/><child link="ghost"/></joint>)");
    const World world(options);
    ASSERT_EQ(world.warnings().size(), 1u);
    expect_contains(world.warnings()[0],
                    {"link 'ghost' of 'weightless.urdf' moves without mass", "1e-06 kg"});
    options.joints = {};
    EXPECT_TRUE(World(icub_options()).warnings().empty());
}

TEST(World, GivesLinksThatNoBodyCanBeTheNearestPossibleInertia) {
    const auto urdf = [](const std::string& inertia) {
        return write_urdf("impossible", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="arm"><inertial><mass value="2"/><inertia )" +
                                            inertia + R"( ixz="0" iyz="0"/></inertial></link>
      <joint name="hinge" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="arm"/></joint>)");
    };
    WorldOptions options;
    options.floating_base = false;
    options.gravity.setZero();
    options.urdf = urdf(R"(ixx="0.001" iyy="0.001" izz="0.008" ixy="0")");
    const auto world = std::make_shared<const World>(options);
    ASSERT_EQ(world->warnings().size(), 1u);
    expect_contains(world->warnings()[0], {"link 'arm' of 'impossible.urdf' has principal moments", "0.008"});
    // Second moments (4, 4, -3) become (4, 4, 0): the moments of inertia are (4, 4, 8), and 0.008 stays about
    // z.
    Simulation sim(world);
    ASSERT_TRUE(sim.step(std::array{0.8}));
    EXPECT_NEAR(sim.s_ddot()[0], 100.0, 1e-6);
    options.urdf = urdf(R"(ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="1e-6")"); // a direction without inertia
    EXPECT_EQ(World(options).warnings().size(), 1u);
    options.urdf = urdf(R"(ixx="0.1" iyy="0.1" izz="0.1" ixy="10")");
    expect_contains(complaint(options),
                    {"link 'arm'", "no body has nor comes near to", "correct its <inertial>"});
}

TEST(World, KeepsSettingsOfMujocoThatTheUrdfBrings) {
    const std::string long_name = "<mujoco model='" + std::string(1'000'000, 'x') + "'/>";
    for (const char* own :
         {"<mujoco/>", long_name.c_str(), "<mujoco><option timestep='0.1'/></mujoco>",
          "<!-- <mujoco> --><mujoco><compiler discardvisual='false' strippath = 'true'/></mujoco>"}) {
        WorldOptions options;
        options.urdf = write_urdf("settings", std::string(own) + R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>)");
        EXPECT_EQ(complaint(options), "") << std::string(own).substr(0, 200);
    }
}

TEST(World, TakesAnEffortOfZeroForNoLimit) {
    WorldOptions options;
    options.urdf = write_urdf("effortless", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="arm"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="hinge" type="revolute"><parent link="stand"/><child link="arm"/><limit effort="0" velocity="0"/></joint>)");
    const World world(options);
    EXPECT_EQ(world.effort_limits()[0], std::numeric_limits<double>::infinity());
    EXPECT_EQ(world.upper_limits()[0], std::numeric_limits<double>::infinity());
}

TEST(World, PassesOnWhatMujocoRefuses) {
    WorldOptions options;
    options.urdf = write_urdf("broken", "<link name=\"a\"><inertial></link>");
    expect_contains(complaint(options), {"MuJoCo cannot read", "broken.urdf"});
    options.urdf = write_urdf("empty", "");
    expect_contains(complaint(options), {"contains no <link>"});
}

TEST(World, FloatsFromARootWithoutMass) {
    WorldOptions options;
    options.urdf = write_urdf("massless_root", R"(
      <link name="base_link"/>
      <link name="root_link"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="glue" type="fixed"><parent link="base_link"/><child link="root_link"/></joint>)");
    EXPECT_EQ(World(options).base_link(), "root_link");
    options.base_link = "base_link";
    EXPECT_EQ(World(options).base_link(), "base_link");
}

TEST(World, RefusesToFloatTheWorld) {
    WorldOptions options;
    options.urdf = write_urdf("mounted", R"(
      <link name="world"/>
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="glue" type="fixed"><parent link="world"/><child link="stand"/></joint>)");
    options.base_link = "world";
    expect_contains(complaint(options),
                    {"the link 'world'", "cannot float; set floating_base to false", "'stand'"});
    options.floating_base = false;
    EXPECT_EQ(complaint(options), "");
}

TEST(World, ControlsAllMovableJointsByDefault) {
    WorldOptions options;
    options.urdf = icub_urdf();
    const World world(options);
    EXPECT_EQ(world.joint_count(), 32);
    EXPECT_EQ(world.base_link(), "root_link");
    EXPECT_EQ(world.lower_limits().size(), 32);
}

TEST(World, ReadsJointLimitsFromTheUrdf) {
    const World world(icub_options());
    EXPECT_LT(world.lower_limits()[14], -1.0);
    EXPECT_GT(world.upper_limits()[14], 0.0);
    WorldOptions options;
    options.urdf = pendulum_urdf();
    options.floating_base = false;
    EXPECT_EQ(World(options).upper_limits()[0], std::numeric_limits<double>::infinity());
}
