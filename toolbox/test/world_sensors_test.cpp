// What blocks feel in a world.
#include "running.hpp"

#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace bf::toolbox::test::sensors {
namespace {

namespace fs = std::filesystem;

/// A table with a ball on it, and a finger with a fixed tip over the floor.
std::string model(const std::string& blocks) {
    static const fs::path folder = [] {
        const fs::path place = fs::path(testing::TempDir()) / ("sensors_" + std::to_string(getpid()));
        fs::create_directories(place);
        std::ofstream(place / "finger.urdf") << R"(<robot name="finger">
  <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger"><inertial><origin xyz="0 0 -0.1"/><mass value="0.5"/><inertia ixx="0.02" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><axis xyz="0 0 1"/><parent link="stand"/><child link="finger"/><limit lower="-1" upper="1" effort="100" velocity="1"/></joint>
  <joint name="glue" type="fixed"><origin xyz="0.1 0 -0.2"/><parent link="finger"/><child link="tip"/></joint></robot>)";
        std::ofstream(place / "world.xml") << R"(<world><floor/>
  <box name="table" size="1 1 0.2" position="0 0 0.1"/>
  <sphere name="ball" radius="0.1" mass="0.5" position="0.13 -0.08 0.2999"/>
  <robot name="finger" file="finger.urdf" position="2 0 0.25"/></world>)";
        return place;
    }();
    return "model: m\nstep: 0.001\nblocks:\n  world: {block: WholeBodyToolbox/World, file: \"'" +
           (folder / "world.xml").string() + "'\"}\n" + blocks;
}

} // namespace

TEST(WorldContact, FeelsTheTipOfAFingerAndNothingElse) {
    Running run(model("  tip: {block: WholeBodyToolbox/WorldContact, body: finger/tip}\n"
                      "  floor: {block: WholeBodyToolbox/WorldContact, body: finger/tip, with: floor}\n"
                      "  ball: {block: WholeBodyToolbox/WorldContact, body: finger/tip, with: ball}\n"
                      "  link: {block: WholeBodyToolbox/WorldContact, body: finger/finger}\n"));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("tip.touches"), 0);
    EXPECT_EQ(run.get("tip.wrench"), Matrix::Zero(6, 1));
    for (int k = 0; k < 2000; ++k) ASSERT_TRUE(run.step());
    const Vector wrench = run.get("tip.wrench");
    EXPECT_EQ(run.scalar("tip.touches"), 1);
    EXPECT_LT((wrench - (Vector(6) << 0, 0, 0.5 * 9.81, 0, 0, 0).finished()).norm(), 1e-3)
        << "the finger's weight, at the tip";
    EXPECT_EQ(run.get("floor.wrench"), wrench);
    EXPECT_EQ(run.scalar("ball.touches"), 0);
    EXPECT_NEAR(run.get("link.wrench")(4), -0.1 * 0.5 * 9.81, 1e-3) << "m_y = -x f_z at the link's origin";
}

TEST(WorldTactile, KeepsTheForceThatPresses) {
    Running run(model("  skin: {block: WholeBodyToolbox/WorldTactile, body: table, size: [0.4 0.2], rows: 8, "
                      "columns: 5, pose: \"[1 0 0 0.1; 0 1 0 -0.05; 0 0 1 0.1; 0 0 0 1]\"}\n"));
    for (int k = 0; k < 2000; ++k) ASSERT_TRUE(run.step());
    const Matrix pressure = run.get("skin");
    EXPECT_EQ(pressure.rows(), 8);
    EXPECT_EQ(pressure.cols(), 5);
    EXPECT_NEAR(pressure.sum() * 0.05 * 0.04, 0.5 * 9.81, 1e-4);
    Eigen::Index row, column;
    pressure.maxCoeff(&row, &column);
    EXPECT_EQ(row, 4) << "0.03 m along x from the middle";
    EXPECT_EQ(column, 1) << "-0.03 m along y";
}

TEST(WorldContact, ContinuesASnapshotBitForBit) {
    Running run(model("  tip: {block: WholeBodyToolbox/WorldContact, body: ball}\n"
                      "  skin: {block: WholeBodyToolbox/WorldTactile, body: table, "
                      "pose: \"[1 0 0 0.1; 0 1 0 -0.05; 0 0 1 0.1; 0 0 0 1]\"}\n"));
    const auto go_on = [&] {
        std::vector<Matrix> all;
        for (int k = 0; k < 20; ++k) {
            EXPECT_TRUE(run.step());
            all.push_back(run.get("tip.wrench"));
            all.push_back(run.get("skin"));
        }
        return all;
    };
    const auto before = go_on();
    const auto snapshot = run.simulation.snapshot();
    const auto once = go_on();
    EXPECT_NE(before, once);
    run.simulation.restore(snapshot);
    EXPECT_EQ(go_on(), once);
    run.simulation.stop();
    run.simulation.start();
    EXPECT_EQ(go_on(), before);
}

TEST(WorldSensors, AreRefusedByName) {
    const auto one = [](const std::string& block) {
        return refusal(model("  x: {block: WholeBodyToolbox/" + block + "}\n"));
    };
    expect_contains(one("WorldContact, body: bal"), "x: the world has no body 'bal'; did you mean 'ball'?");
    expect_contains(one("WorldContact, body: ball, with: flor"), "x: the world has no body 'flor'");
    expect_contains(one("WorldContact, body: ball, pose: [1 2]"), "x: argument 'pose' is no pose");
    expect_contains(one("WorldContact, body: ball, with: ball"),
                    "x: argument 'with' names what the sensor is fixed to, which does not touch itself");
    expect_contains(one("WorldTactile, body: table, size: 1"),
                    "x: argument 'size' has 1 elements; give the lengths along x and y");
    for (const std::string angle : {"nan", "inf", "1e308"})
        expect_contains(one("WorldRays, body: ball, from: " + angle), "'from'");
    expect_contains(one("WorldRays, body: ball, range: inf"), "'range'");
}

TEST(WorldSensors, SayThatThereAreMoreContactsThanTheyRemember) {
    const fs::path file = fs::path(testing::TempDir()) / ("crowd_" + std::to_string(getpid()) + ".xml");
    std::ofstream out(file);
    out << "<world><floor/>";
    for (int i = 0; i < 80; ++i)
        out << "<box name='b" << i << "' mass='1' position='" << i % 20 * 0.11 << " " << i / 20 * 0.11
            << " 0.05'/>";
    out << "</world>";
    out.close();
    Running run("model: m\nstep: 0.001\nblocks:\n  world: {block: WholeBodyToolbox/World, file: \"'" +
                file.string() + "'\"}\n  x: {block: WholeBodyToolbox/WorldContact, body: b0}\n");
    bool goes_on = true;
    for (int k = 0; k < 3 && goes_on; ++k) goes_on = run.step();
    expect_contains(run.simulation.failure(), "there are more than 256 contacts at a time");
}

} // namespace bf::toolbox::test::sensors
