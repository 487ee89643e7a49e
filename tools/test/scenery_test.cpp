// What the editor shows of a world that robots share.
#include "scenery.hpp"

#include "bf/engine/simulation.hpp"
#include "bf/library/load.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>

namespace bf::tools {

TEST(Scenery, ShowsEveryBodyOfAWorldThatRobotsShareWhereItIs) {
    const LoadedModel loaded = load(BF_SOURCE_DIRECTORY "/examples/two_robots/model.yaml");
    const service::MakeSceneries make = scenery_maker();
    if (!make) GTEST_SKIP() << "built without robots";
    const service::Sceneries sceneries = make(loaded.diagram);
    ASSERT_EQ(sceneries.size(), 1u);
    service::Scenery& scenery = *sceneries[0];
    const service::SceneWorld& world = scenery.world();
    EXPECT_EQ(world.path, "world");
    EXPECT_TRUE(world.has_floor);
    const auto body_of = [&](const std::string& name) {
        const auto found = std::find(world.bodies.begin(), world.bodies.end(), name);
        EXPECT_NE(found, world.bodies.end()) << name;
        return static_cast<std::size_t>(found - world.bodies.begin());
    };
    const std::size_t parcel = body_of("parcel"), fore = body_of("right/fore");
    EXPECT_EQ(world.start.size(), 7 * world.bodies.size() + 3);
    EXPECT_NEAR(world.start[7 * parcel + 2], 0.441, 1e-12);
    for (const std::size_t body : {parcel, fore, body_of("table"), body_of("left/base")})
        EXPECT_TRUE(std::any_of(world.shapes.begin(), world.shapes.end(), [&](const auto& shape) {
            return static_cast<std::size_t>(shape.body) == body;
        })) << world.bodies[body];

    Simulation run(loaded.diagram);
    run.start();
    scenery.bind(run.signals());
    ASSERT_TRUE(run.run_until(0.5));
    std::vector<double> values;
    scenery.look(values);
    ASSERT_EQ(values.size(), world.start.size());
    EXPECT_GT(std::abs(values[7 * fore] - world.start[7 * fore]), 0.01) << "the arm has moved";
    const auto signals = run.signals();
    const Quantity& pose = find(signals, "parcel.w_H_o");
    for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(values[7 * parcel + static_cast<std::size_t>(i)], pose[12 + i], 1e-12);
}

TEST(Scenery, ShowsWhatContactSensorsFeel) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "felt";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "world.xml")
        << "<world><floor/><box name='box' size='0.2 0.2 0.2' mass='2' position='1 0 0.1'/></world>";
    std::ofstream(folder / "model.yaml")
        << "model: felt\nplugins: [WholeBodyToolbox]\nstep: 0.001\nblocks:\n"
           "  world: {block: WholeBodyToolbox/World, file: world.xml}\n"
           "  felt: {block: WholeBodyToolbox/WorldContact, body: box, pose: \"[eye(3) [0.3; 0; 0]; 0 0 0 "
           "1]\"}\n";
    const service::MakeSceneries make = scenery_maker();
    if (!make) GTEST_SKIP() << "built without robots";
    const LoadedModel loaded = load(folder / "model.yaml");
    const service::Sceneries sceneries = make(loaded.diagram);
    EXPECT_EQ(sceneries[0]->world().feet, std::vector<std::string>{"felt"});
    Simulation run(loaded.diagram);
    run.start();
    sceneries[0]->bind(run.signals());
    ASSERT_TRUE(run.run_until(1));
    std::vector<double> values;
    sceneries[0]->look(values);
    ASSERT_EQ(values.size(), 7 + 6 + 3u);
    // The floor carries the box under its middle, wherever the sensor is.
    EXPECT_NEAR(values[7], 1, 0.01);
    EXPECT_NEAR(values[8], 0, 0.01);
    EXPECT_NEAR(values[12], 2 * 9.81, 0.05);
}

} // namespace bf::tools
