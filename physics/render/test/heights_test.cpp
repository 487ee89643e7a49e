// Terrain from images, beside their pixels.
#include "bf/physics/renderer.hpp"
#include "bf/physics/scene.hpp"
#include "complaints.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <gtest/gtest.h>
#include <memory>

namespace bf::physics::test::heights {

namespace {

const std::filesystem::path file = BF_BINARY_DIRECTORY "/heights.png";

/// Grey values, the first row above.
constexpr int rows = 3, columns = 4;
constexpr std::array<std::uint8_t, rows * columns> pixels{50,  60,  70,  200, 90,  100,
                                                          110, 120, 130, 140, 150, 80};

void write_pixels() {
    Image image{columns, rows, {}};
    for (const std::uint8_t value : pixels) image.pixels.insert(image.pixels.end(), 3, value);
    write_png(file, image);
}

SceneOptions ground() {
    SceneOptions options;
    options.floor.enabled = false;
    options.objects.resize(1);
    SceneObject& object = options.objects[0];
    object.kind = SceneObject::Kind::heights;
    object.name = "ground";
    object.file = file;
    object.size = {6, 4, 0.6};
    object.w_H_o(2, 3) = 1.0;
    return options;
}

/// Height of what a ray from above meets.
double height(const SceneSimulation& sim, double x, double y) {
    Frame eye;
    eye.pose.topRightCorner<3, 1>() << x, y, 9.0;
    Eigen::VectorXd distance(1);
    sim.measure_rays(eye, -Eigen::Vector3d::UnitZ(), 20.0, distance);
    return 9.0 - distance[0];
}

} // namespace

TEST(Heights, AreThePixelsOfAnImageFromTheDarkestToTheBrightest) {
    write_pixels();
    const SceneSimulation sim(std::make_shared<const Scene>(ground()));
    const auto expected = [](int row, int column) {
        return 1.0 + 0.6 * (pixels[static_cast<size_t>(row * columns + column)] - 50) / 150.0;
    };
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            // Inside by a hair, as a ray at the border may miss; slopes are below 1.
            const double x = std::clamp(-3.0 + 2.0 * column, -2.9999, 2.9999);
            const double y = std::clamp(2.0 - 2.0 * row, -1.9999, 1.9999);
            EXPECT_NEAR(height(sim, x, y), expected(row, column), 2e-4) << row << ", " << column;
        }
    EXPECT_NEAR(height(sim, -2.0, 0.0), 0.5 * (expected(1, 0) + expected(1, 1)), 1e-6) << "straight between";
}

TEST(Heights, AreRefusedWhereTheImageIsNone) {
    std::ofstream(file) << "no image";
    SceneOptions options = ground();
    options.objects[0].where = "'world.xml', line 3";
    expect_contains(complaint_of([&] { const Scene scene(options); }),
                    {"'world.xml', line 3: object 'ground': ", "heights.png", "give a PNG image"});
}

} // namespace bf::physics::test::heights
