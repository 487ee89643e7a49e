// What bodies feel of each other.
#include "bf/physics/scene.hpp"
#include "complaints.hpp"
#include "robots.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <gtest/gtest.h>
#include <memory>

namespace bf::physics::test::contacts {

namespace {

constexpr double h = 1e-3, g = 9.81;

Eigen::Matrix4d at(double x, double y, double z) {
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H.topRightCorner<3, 1>() << x, y, z;
    return H;
}

SceneObject box(const std::string& name, const Eigen::Vector3d& size, const Eigen::Matrix4d& pose,
                std::optional<double> mass = {}) {
    SceneObject object;
    object.name = name;
    object.size = size;
    object.w_H_o = pose;
    object.mass = mass;
    return object;
}

SceneObject ball(double x, double y, double z) {
    SceneObject object = box("ball", {0.1, 0, 0}, at(x, y, z), 0.5);
    object.kind = SceneObject::Kind::sphere;
    return object;
}

SceneSimulation simulate(SceneOptions options) {
    SceneSimulation sim(std::make_shared<const Scene>(std::move(options)));
    sim.remember_contacts();
    return sim;
}

void settle(SceneSimulation& sim, int steps = 2000) {
    for (int k = 0; k < steps; ++k) ASSERT_TRUE(sim.step()) << sim.error();
}

/// A ball on a table that stands on the floor by itself, and a parcel on the floor.
SceneOptions table() {
    SceneOptions options;
    options.objects = {box("table", {1, 1, 0.2}, at(0, 0, 0.1), 4.0), ball(0.13, -0.08, 0.3),
                       box("parcel", {0.2, 0.3, 0.1}, at(2, 0, 0.05), 2.0)};
    return options;
}

} // namespace

TEST(Surface, SinksInAsFarAsItsParametersSay) {
    // At rest m g = f and MuJoCo's constraint g / d = a_ref + g, a_ref = d depth / (d_max T Z)^2 where all
    // impedances are d (its documentation, Modeling, Solver parameters), so that depth = g (1 - d) (T Z)^2.
    const std::string folder = BF_BINARY_DIRECTORY;
    std::ofstream(folder + "/ball.urdf")
        << R"(<robot name="ball"><link name="ball"><inertial><mass value="2"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>)";
    const auto depths = [&](const std::string& floor, const std::string& others) {
        std::ofstream(folder + "/surfaces.xml")
            << "<world><robot name='a' file='ball.urdf' base='floating' position='0 0 0.1' " << others
            << "/><sphere name='b' radius='0.1' mass='3' position='1 0 0.1' " << others << "/><floor "
            << floor << "/></world>";
        SceneSimulation sim = simulate(SceneOptions::read(folder + "/surfaces.xml"));
        settle(sim);
        return Eigen::Vector2d(0.1 - sim.w_H_b(0)(2, 3), 0.1 - sim.w_H_o(0)(2, 3));
    };
    const auto expected = [](double T, double Z, double d) { return g * (1 - d) * T * T * Z * Z; };
    const std::string soft = "solref='0.03 1.5' solimp='0.8 0.8'";
    for (const double depth : depths(soft, soft)) EXPECT_NEAR(depth, expected(0.03, 1.5, 0.8), 1e-6);
    // The mean of both surfaces.
    for (const double depth : depths("solref='0.01 1' solimp='0.7 0.7'", "solref='0.03 2' solimp='0.9 0.9'"))
        EXPECT_NEAR(depth, expected(0.02, 1.5, 0.8), 1e-6);
    // A robot that says nothing is like the floor, an object is not.
    const Eigen::Vector2d unlike = depths(soft, "");
    EXPECT_NEAR(unlike[0], expected(0.03, 1.5, 0.8), 1e-6);
    EXPECT_LT(unlike[1], 0.5 * unlike[0]);
}

TEST(Surface, OfARobotSlidesAsCoulombSays) {
    std::ofstream(BF_BINARY_DIRECTORY "/block.urdf")
        << R"(<robot name="block"><link name="block"><inertial><mass
      value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><geometry><box size="0.4 0.4 0.1"/></geometry></collision></link></robot>)";
    for (const double mu : {0.2, 0.7}) {
        const std::string file = BF_BINARY_DIRECTORY "/sliding.xml";
        std::ofstream(file)
            << "<world gravity='3 0 -10'><floor friction='0.1'/><robot name='a' file='block.urdf' "
               "base='floating' position='0 0 0.05' friction='"
            << mu << "'/></world>";
        SceneSimulation sim = simulate(SceneOptions::read(file));
        settle(sim, 300);
        const double before = sim.v_b(0)[0];
        settle(sim, 500);
        EXPECT_NEAR((sim.v_b(0)[0] - before) / 0.5, std::max(3 - 10 * mu, 0.0), 0.03) << mu;
    }
}

TEST(Surface, IsRefusedWhereItIsOutOfRange) {
    const std::string file = BF_BINARY_DIRECTORY "/rough.xml";
    std::ofstream(BF_BINARY_DIRECTORY "/hinge.xml") << "<mujoco><worldbody><body name='b'><joint name='j'/>"
                                                       "<geom size='0.1'/></body></worldbody></mujoco>";
    const auto with = [&](const std::string& element) {
        std::ofstream(file) << "<world>\n" << element << "\n</world>";
        return complaint_of([&] { const Scene scene(SceneOptions::read(file)); });
    };
    EXPECT_EQ(with("<floor friction='0' solref='0.02 1' solimp='0.9 0.95 0.001'/>"), "");
    expect_contains(with("<floor friction='-1'/>"), {"line 2: <floor>: its friction is -1; give 0 to 1e6"});
    expect_contains(
        with("<sphere name='a' solref='0 1'/>"),
        {"line 2: object 'a': its solref is (0 1); time constant and damping ratio must be positive"});
    expect_contains(
        with("<sphere name='a' solimp='0.9 1'/>"),
        {"object 'a': its solimp is (0.9 1 0.001 0.5 2); impedances and midpoint lie between 0 and 1"});
    expect_contains(with("<sphere name='a' solimp='1 2 3 4 5 6'/>"),
                    {"line 2: <sphere>: solimp has 6 numbers"});
    expect_contains(with("<robot name='a' file='block.urdf' base='floating' solref='1 nan'/>"),
                    {"line 2: <robot>: solref=\"1 nan\": 'nan' is no finite number"});
    expect_contains(with("<robot name='a' file='block.urdf' base='floating' friction='-2'/>"),
                    {"line 2: robot 'a': friction is -2; give 0 to 1e6"});
    expect_contains(
        with("<robot name='a' file='hinge.xml' friction='2'/>"),
        {"line 2: robot 'a': an MJCF says itself how its shapes touch; leave friction, solref and solimp "
         "out"});
}

TEST(Contact, CarriesTheWeightOfWhatRests) {
    SceneSimulation sim = simulate(table());
    const Scene& scene = sim.scene();
    settle(sim);
    const Contact ball = sim.contact(scene.frame("ball"));
    EXPECT_EQ(ball.points, 1);
    EXPECT_LT((ball.wrench - (Vector6d() << 0, 0, 0.5 * g, 0, 0, 0).finished()).norm(), 1e-5);
    const Contact parcel = sim.contact(scene.frame("parcel"));
    EXPECT_EQ(parcel.points, 4);
    EXPECT_LT((parcel.wrench - (Vector6d() << 0, 0, 2 * g, 0, 0, 0).finished()).norm(), 1e-4);

    // On the table, at its corner and without the others.
    const Frame corner = scene.frame("table", at(0.5, 0.5, 0));
    const Contact on_table = sim.contact(corner, scene.body("ball"));
    EXPECT_EQ(on_table.points, 1);
    const Eigen::Vector3d lever = sim.w_H_o(1).topRightCorner<3, 1>() - Eigen::Vector3d(0.5, 0.5, 0.1);
    const Eigen::Vector3d weight(0, 0, -0.5 * g);
    EXPECT_LT((on_table.wrench.head<3>() - weight).norm(), 1e-5);
    EXPECT_LT((on_table.wrench.tail<3>() - lever.cross(weight)).norm(), 1e-5);
    EXPECT_NEAR(sim.contact(corner, -1).wrench[2], 4.5 * g, 1e-4) << "the floor";
    EXPECT_NEAR(sim.contact(corner).wrench[2], 4.0 * g, 1e-4) << "both";
    EXPECT_EQ(sim.contact(scene.frame("ball"), scene.body("parcel")).points, 0);
}

TEST(Contact, ExplainsEveryChangeOfMomentum) {
    // Spheres and cubes have the same inertia about all axes: 2/5 m r², m a²/6.
    const auto falls = [](const SceneObject& falling, double inertia) {
        SceneOptions options;
        options.objects = {falling, box("ramp", {2, 2, 0.1}, at(0, 0, 0.05))};
        const Eigen::AngleAxisd tilt(0.3, Eigen::Vector3d(1, 2, 0).normalized());
        options.objects[1].w_H_o.topLeftCorner<3, 3>() = tilt.toRotationMatrix();
        SceneSimulation sim = simulate(options);
        const Frame centre = sim.scene().frame(falling.name);
        int touching = 0;
        for (int k = 0; k < 1200; ++k) { // onto the ramp, down, and on along the floor
            const Vector6d before = sim.v_o(0);
            ASSERT_TRUE(sim.step());
            const Contact felt = sim.contact(centre);
            Vector6d expected = (sim.v_o(0) - before) / h;
            expected.head<3>() = 0.5 * (expected.head<3>() + Eigen::Vector3d(0, 0, g));
            expected.tail<3>() *= inertia;
            ASSERT_LT((felt.wrench - expected).norm(), 1e-6 * (1 + expected.norm())) << k;
            touching += felt.points > 0;
        }
        EXPECT_GT(touching, 100);
        EXPECT_LT(touching, 1200);
        EXPECT_GT((sim.w_H_o(0).topRightCorner<2, 1>().norm()), 0.2) << "it moves";
    };
    falls(ball(0, 0, 0.4), 0.4 * 0.5 * 0.01);
    SceneObject cube = box("cube", {0.2, 0.2, 0.2}, at(0, 0, 0.5), 0.5);
    cube.w_H_o.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 0.3, 0.5).normalized()).toRotationMatrix();
    falls(cube, 0.5 * 0.04 / 6);
}

TEST(Contact, IsKnownAtTheStart) {
    SceneOptions options;
    options.objects = {ball(0, 0, 0.1 - 1e-4)};
    SceneSimulation sim = simulate(options);
    EXPECT_EQ(sim.contact(sim.scene().frame("ball")).points, 1);
    const double first = sim.contact(sim.scene().frame("ball")).wrench[2];
    EXPECT_GT(first, 0.5 * g);
    settle(sim, 50);
    sim.reset();
    EXPECT_EQ(sim.contact(sim.scene().frame("ball")).wrench[2], first);
}

TEST(Contact, KnowsLinksThatAreFixedToOthers) {
    SceneOptions options;
    SceneRobot robot{"arm"};
    robot.options.urdf = write_urdf("with_tip", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="bob"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="wrist"/><link name="tip"/>
      <joint name="swing" type="continuous"><axis xyz="0 1 0"/><parent link="stand"/><child link="bob"/></joint>
      <joint name="a" type="fixed"><origin xyz="0 0 -1" rpy="0 0 1.5707963267948966"/><parent link="bob"/><child link="wrist"/></joint>
      <joint name="b" type="fixed"><origin xyz="0.2 0 0" rpy="0.5 0 0"/><parent link="wrist"/><child link="tip"/></joint>)");
    robot.options.floating_base = false;
    robot.options.initial_w_H_b = at(1, 2, 3);
    robot.options.initial_joints = {0.7};
    options.robots = {robot};
    SceneSimulation sim = simulate(options);
    using Eigen::AngleAxisd, Eigen::Vector3d;
    const Eigen::Matrix3d bob = AngleAxisd(0.7, Vector3d::UnitY()).toRotationMatrix();
    const Eigen::Matrix3d wrist = bob * AngleAxisd(std::acos(0.0), Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Matrix4d tip = sim.w_H(sim.scene().frame("arm/tip"));
    const Vector3d expected = Vector3d(1, 2, 3) + bob * Vector3d(0, 0, -1) + wrist * Vector3d(0.2, 0, 0);
    EXPECT_LT((tip.topRightCorner<3, 1>() - expected).norm(), 1e-9);
    EXPECT_LT(
        (tip.topLeftCorner<3, 3>() - wrist * AngleAxisd(0.5, Vector3d::UnitX()).toRotationMatrix()).norm(),
        1e-9);
    EXPECT_EQ(sim.w_H(sim.scene().frame("", at(7, 8, 9))), at(7, 8, 9)) << "the world";
    expect_contains(complaint_of([&] { sim.scene().frame("arm/tipp"); }),
                    {"the world has no body 'arm/tipp'; did you mean 'arm/tip'? there are: ", "arm/bob"});
    expect_contains(complaint_of([&] { sim.scene().frame("arm/tip", Eigen::Matrix3d::Identity()); }),
                    {"argument 'pose' is no pose; give [R p; 0 0 0 1] with a rotation R"});
}

TEST(Tactile, KeepsForceAndCentreOfPressure) {
    SceneSimulation sim = simulate(table());
    settle(sim);
    const Patch top{sim.scene().frame("table", at(0, 0, 0.1)), {0.6, 0.4}};
    Eigen::MatrixXd cells(12, 10);
    sim.pressures(top, cells);
    const double area = 0.05 * 0.04;
    EXPECT_NEAR(cells.sum() * area, 0.5 * g, 1e-5);
    EXPECT_GE(cells.minCoeff(), 0.0);
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    for (int i = 0; i < 12; ++i)
        for (int j = 0; j < 10; ++j)
            centre += area * cells(i, j) / (0.5 * g) *
                      Eigen::Vector2d(-0.3 + 0.05 * (i + 0.5), -0.2 + 0.04 * (j + 0.5));
    EXPECT_LT((centre - sim.w_H_o(1).topRightCorner<2, 1>()).norm(), 1e-5);
    EXPECT_EQ((cells.array() > 0.0).count(), 4) << "the cells around it";
}

TEST(Tactile, FeelsOnlyWhatPressesOnThePatch) {
    SceneSimulation sim = simulate(table());
    settle(sim);
    const Scene& scene = sim.scene();
    Eigen::MatrixXd one(1, 1), cells(4, 4);
    const auto felt = [&](const Patch& patch) {
        sim.pressures(patch, cells);
        sim.pressures(patch, one);
        EXPECT_NEAR(one(0, 0), cells.sum() / 16, 1e-9 * (1 + one(0, 0))) << "as one cell";
        return cells.sum() * patch.size.prod() / 16;
    };
    EXPECT_NEAR(felt({scene.frame("table", at(0.13, -0.08, 0.1)), {0.02, 0.02}}), 0.5 * g, 1e-5);
    EXPECT_EQ(felt({scene.frame("table", at(0.1, -0.08, 0.1)), {0.02, 0.02}}), 0.0) << "beside it";
    EXPECT_EQ(felt({scene.frame("table", at(0.13, -0.08, 0.08)), {0.02, 0.02}}), 0.0) << "too deep";
    EXPECT_NEAR(felt({scene.frame("table", at(0.13, -0.08, 0.08)), {0.02, 0.02}, 0.03}), 0.5 * g, 1e-5);
    Eigen::Matrix4d down = at(0, 0, -0.1);
    down.diagonal() << 1, -1, -1, 1;
    EXPECT_NEAR(felt({scene.frame("table", down), {1.01, 1.01}}), 4.5 * g, 1e-4) << "below it";
    down(2, 3) = 0.1;
    EXPECT_EQ(felt({scene.frame("table", down), {1, 1}}), 0.0) << "what presses from behind";
    down(2, 3) = -0.05;
    down.diagonal() << 1, -1, -1, 1;
    EXPECT_NEAR(felt({scene.frame("parcel", down), {0.21, 0.31}}), 2 * g, 1e-4);
    EXPECT_NEAR(cells(0, 0), cells(3, 3), 1e-3 * cells(0, 0)) << "a box is felt at its corners";
    EXPECT_EQ(cells(1, 1), 0.0);
}

TEST(Contact, ContinuesBitForBitFromASavedState) {
    SceneSimulation sim = simulate(table());
    settle(sim, 30);
    std::vector<double> state(static_cast<size_t>(sim.state_size()));
    sim.save(state.data());
    const Frame frame = sim.scene().frame("table");
    const auto go_on = [&](SceneSimulation& one) {
        std::vector<Vector6d> all{one.contact(frame).wrench};
        for (int k = 0; k < 30; ++k) {
            EXPECT_TRUE(one.step());
            all.push_back(one.contact(frame).wrench);
        }
        return all;
    };
    const auto expected = go_on(sim);
    EXPECT_NE(expected[0], expected[30]);
    sim.restore(state.data());
    EXPECT_EQ(go_on(sim), expected);
    SceneSimulation fresh = simulate(table());
    fresh.restore(state.data());
    EXPECT_EQ(go_on(fresh), expected);
    SceneSimulation without(std::make_shared<const Scene>(table()));
    EXPECT_LT(without.state_size(), sim.state_size()) << "who does not ask does not pay";
    EXPECT_EQ(without.contact(frame).points, 0);
}

TEST(Contact, IsRefusedWhereThereAreTooMany) {
    const std::string file = BF_BINARY_DIRECTORY "/flat.txt";
    std::ofstream text(file);
    for (int i = 0; i < 60; ++i) {
        for (int j = 0; j < 60; ++j) text << " 0";
        text << "\n";
    }
    text.close();
    SceneOptions options;
    options.objects.resize(1);
    options.objects[0].kind = SceneObject::Kind::heights;
    options.objects[0].name = "ground";
    options.objects[0].file = file;
    options.objects[0].size = {6, 6, 1};
    for (int i = 0; i < 9; ++i)
        options.objects.push_back(box("box" + std::to_string(i), {1.5, 1.5, 0.2},
                                      at(2.0 * (i % 3) - 2, 2.0 * (i / 3) - 2, 0.0999), 1.0));
    SceneSimulation sim = simulate(options);
    EXPECT_FALSE(sim.step());
    expect_contains(sim.error(), {"more than 256 contacts at a time"});
    EXPECT_EQ(sim.failure().cause, Failure::Cause::contacts);
}

} // namespace bf::physics::test::contacts
