// Pictures that cameras in a world give, beside geometry.
#include "running.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace bf::toolbox::test::camera {
namespace {

namespace fs = std::filesystem;

constexpr double field_of_view = 0.8;

/// A folder with a red box whose face is the plane x = 2, 0.4 m wide and 0.2 m high around z = 0.5, a ball
/// that falls past, and a green wall behind.
const fs::path& folder() {
    static const fs::path made = [] {
        const fs::path place = fs::path(testing::TempDir()) / ("cameras_" + std::to_string(getpid()));
        fs::create_directories(place);
        std::ofstream(place / "world.xml") << R"(<world step="0.001"><floor/>
  <box name="box" size="0.2 0.4 0.2" position="2.1 0 0.5" colour="0.9 0.05 0.05"/>
  <box name="wall" size="0.1 8 8" position="4.05 0 0" colour="0.05 0.8 0.05"/>
  <sphere name="ball" radius="0.1" mass="1" position="1 1 5"/></world>)";
        return place;
    }();
    return made;
}

/// It stands at x = 0, z = 0.5 and looks along x: x to the right is -y of the world, y down is -z.
const std::string ahead = "\"[0 0 1 0; -1 0 0 0; 0 -1 0 0.5; 0 0 0 1]\"";

std::string model(const std::string& settings, const std::string& more = {}) {
    return "model: m\nplugins: [WholeBodyToolbox, WholeBodyCameras]\nstep: 0.001\nblocks:\n"
           "  world: {block: WholeBodyToolbox/World, file: \"'" +
           (folder() / "world.xml").string() +
           "'\"}\n  camera: {block: WholeBodyCameras/WorldCamera, width: 160, height: 120, pose: " + ahead +
           settings + "}\n" + more;
}

/// Pixels per tangent.
const double f = 60 / std::tan(field_of_view / 2);

} // namespace

TEST(WorldCamera, SeesDepthsAsGeometrySays) {
    Running run(model(", with_depth: true, range: 6"));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    const Matrix depth = run.get("camera.depth");
    ASSERT_EQ(depth.rows(), 120);
    ASSERT_EQ(depth.cols(), 160);
    int floor = 0, box = 0, wall = 0;
    for (int row = 0; row < 120; ++row)
        for (int column = 0; column < 160; ++column) {
            // The ray through the middle of the pixel, of length 1 along the axis.
            const double right = (column + 0.5 - 80) / f, down = (row + 0.5 - 60) / f;
            const auto near_edge = [&](double value, double edge) {
                return std::abs(std::abs(value) - edge) < 1.5 / f;
            };
            if (near_edge(right, 0.1) || near_edge(down, 0.05)) continue; // which pixel it is is not said
            const bool on_box = std::abs(right) < 0.1 && std::abs(down) < 0.05;
            const double to_floor = down > 0 ? 0.5 / down : 1e9;
            const double expected = on_box ? 2.0 : std::min(to_floor, 4.0);
            ASSERT_NEAR(depth(row, column), expected, 2e-3 * expected) << row << ", " << column;
            (on_box ? box : to_floor < 4 ? floor : wall) += 1;
        }
    EXPECT_GT(floor, 1000);
    EXPECT_GT(box, 300);
    EXPECT_GT(wall, 1000);

    Running blind(model(", with_depth: true, range: 1.5"));
    ASSERT_TRUE(blind.step());
    EXPECT_EQ(blind.get("camera.depth")(60, 80), 1.5) << "what is behind the range has it";
}

TEST(WorldCamera, NumbersTheBodiesAsTheWorldDoes) {
    Running run(model(", with_segmentation: true, with_colour: false"));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    const Matrix seen = run.get("camera.segmentation");
    EXPECT_EQ(seen(60, 80), 1) << "the box";
    EXPECT_EQ(seen(10, 10), 2) << "the wall";
    EXPECT_EQ(seen(118, 80), 0) << "the floor";
    const double box = 4 * (0.1 * f) * (0.05 * f); // 2 m away
    EXPECT_NEAR(static_cast<double>((seen.array() == 1).count()), box, 0.05 * box);
    EXPECT_EQ((seen.array() > 2).count(), 0) << "no number in between";
    EXPECT_THROW(run.get("camera.colour"), std::runtime_error) << "not asked for";

    Running up(model(", with_segmentation: true, body: ball"));
    ASSERT_TRUE(up.step());
    EXPECT_EQ(up.get("camera.segmentation")(10, 80), -1) << "the sky above the wall";
}

TEST(WorldCamera, GivesThePlanesOfColoursBesideEachOther) {
    Running run(model(""));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    const auto end = run.diagram().find_signal("camera.colour");
    EXPECT_EQ(run.diagram().slot(end).type, Type::uint8);
    const Matrix colour = run.get("camera.colour");
    ASSERT_EQ(colour.rows(), 120);
    ASSERT_EQ(colour.cols(), 480);
    const auto at = [&](int row, int column) {
        return Vector3(colour(row, column), colour(row, 160 + column), colour(row, 320 + column));
    };
    EXPECT_GT(at(60, 80)[0], 3 * at(60, 80)[1]) << "red";
    EXPECT_GT(at(60, 80)[0], 60);
    EXPECT_GT(at(10, 10)[1], 3 * at(10, 10)[0]) << "green";
    EXPECT_LT((at(60, 75) - at(60, 85)).norm(), 30) << "alike";
}

TEST(WorldCamera, GivesThePictureOfItsStateWhateverItDrewBefore) {
    std::string text = model(", with_depth: true, period: 0.01"); // above a floor that has no end
    text.replace(text.find(ahead), ahead.size(), "\"[0 0 -1 2; 1 0 0 0; 0 -1 0 0.8; 0 0 0 1]\"");
    Running used(text);
    for (int k = 0; k < 15; ++k) ASSERT_TRUE(used.step()) << used.simulation.failure();
    const auto snapshot = used.simulation.snapshot();
    Running fresh(text);
    fresh.simulation.restore(snapshot);
    for (Running* run : {&used, &fresh})
        for (int k = 0; k < 10; ++k) ASSERT_TRUE(run->step()); // one more picture
    EXPECT_EQ(used.get("camera.colour"), fresh.get("camera.colour"));
    EXPECT_EQ(used.get("camera.depth"), fresh.get("camera.depth"));
}

TEST(WorldCamera, GivesDepthsTheNoiseThatIsAskedFor) {
    const std::string noisy = ", with_depth: true, depth_noise: \"[0.01 0.005]\"";
    const auto depths = [](Running& run, int steps = 1) {
        for (int k = 0; k < steps; ++k) EXPECT_TRUE(run.step());
        return run.get("camera.depth");
    };
    Running exact(model(", with_depth: true")), one(model(noisy + ", seed: 1")),
        same(model(noisy + ", seed: 1")), other(model(noisy + ", seed: 2"));
    const Matrix z = depths(exact), first = depths(one);
    EXPECT_EQ(depths(same), first);
    EXPECT_NE(depths(other), first);
    const auto error = [&](const Matrix& seen, int row, int column, int rows, int columns) {
        const Matrix e = (seen - z).block(row, column, rows, columns);
        EXPECT_LT(std::abs(e.mean()), 4 * 0.04 / std::sqrt(e.size())) << "no bias";
        return std::sqrt(e.squaredNorm() / static_cast<double>(e.size()));
    };
    EXPECT_NEAR(error(first, 56, 70, 8, 20), 0.01 + 0.005 * 4, 0.007) << "2 m";
    EXPECT_NEAR(error(first, 5, 5, 30, 100), 0.01 + 0.005 * 16, 0.004) << "4 m";

    const Matrix second = depths(one);
    EXPECT_NE(second, first) << "each picture has its own";
    const auto snapshot = one.simulation.snapshot();
    const Matrix later = depths(one, 3);
    one.simulation.restore(snapshot);
    EXPECT_EQ(depths(one, 3), later) << "bit for bit";
}

TEST(WorldCamera, HoldsItsPictureForItsPeriod) {
    // The ball falls and the camera with it.
    Running run(model(", with_depth: true, body: ball, period: 0.05, range: 50"));
    std::vector<double> heights;
    for (int k = 0; k <= 100; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        heights.push_back(run.get("camera.depth")(119, 80));
    }
    for (std::size_t k = 1; k < heights.size(); ++k)
        EXPECT_EQ(heights[k] != heights[k - 1], k % 50 == 0) << k;
    const double slope = f / 59.5; // depth per height of the last row
    const double fallen = 9.81e-6 * 50 * 51 / 2;
    EXPECT_NEAR(heights[0] - heights[50], slope * fallen, 0.002);
}

TEST(WorldCamera, IsRefusedByName) {
    expect_contains(refusal(model(", body: bal")), "the world has no body 'bal'; did you mean 'ball'?");
    expect_contains(refusal(model(", with_depth: true, depth_noise: 1")),
                    "argument 'depth_noise' has 1 elements; give a and b of a + b z^2");
    expect_contains(refusal(model(", seed: -1")), "'seed'");
    expect_contains(refusal(model(", range: Inf")), "argument 'range' must be");
    expect_contains(refusal(model(", with_colour: false")), "the camera gives nothing; let with_colour");
    std::string large = model("");
    large.replace(large.find("width: 160, height: 120"), 23, "width: 8192, height: 8192");
    expect_contains(refusal(large), "width times height is 6.71089e+07; it must be at most 9e6 pixels");
    const std::string skew = model("");
    const auto at = skew.find(ahead);
    expect_contains(refusal(std::string(skew).replace(at, ahead.size(), "\"2 * eye(4)\"")),
                    "argument 'pose' is no pose");
}

TEST(WorldCamera, IsMissedByNameWhereItsPluginIsNot) {
    const fs::path alone = folder() / "plugins";
    fs::create_directories(alone);
    if (!fs::exists(alone / "WholeBodyToolbox.so"))
        fs::create_symlink(fs::path(BF_PLUGIN_DIRECTORY) / "WholeBodyToolbox.so",
                           alone / "WholeBodyToolbox.so");
    Registry registry;
    registry.add(standard_library());
    registry.add_search_path(alone);
    std::string text;
    try {
        elaborate(formats::read_yaml_text(model("")), registry);
    } catch (const std::exception& error) {
        text = error.what();
    }
    expect_contains(text, "WholeBodyCameras");
    expect_contains(text, "2:"); // the line that names it
}

} // namespace bf::toolbox::test::camera
