// Runs every folder of this directory that holds model.yaml and expected.csv, and compares the trajectories.
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>

namespace bf {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> folders() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(BF_SOURCE_DIRECTORY "/tests/models"))
        if (fs::exists(entry.path() / "model.yaml")) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

std::vector<std::string> cells(const std::string& line) {
    std::vector<std::string> result;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) result.push_back(cell);
    return result;
}

class ModelOfFolder : public testing::TestWithParam<std::string> {};

TEST_P(ModelOfFolder, FollowsItsExpectedTrajectory) {
    const fs::path folder = fs::path(BF_SOURCE_DIRECTORY "/tests/models") / GetParam();
    Registry registry;
    registry.add(standard_library());
    const Diagram diagram = elaborate(formats::read_yaml(folder / "model.yaml"), registry);
    Simulation simulation(diagram);
    simulation.start();

    std::ifstream file(folder / "expected.csv");
    std::string line;
    ASSERT_TRUE(std::getline(file, line));
    const auto header = cells(line);
    ASSERT_EQ(header.at(0), "time");
    int rows = 0;
    for (; std::getline(file, line); ++rows) {
        const auto expected = cells(line);
        ASSERT_EQ(expected.size(), header.size());
        ASSERT_NEAR(simulation.time(), std::stod(expected[0]), 1e-12);
        ASSERT_TRUE(simulation.step()) << simulation.failure();
        for (std::size_t c = 1; c < header.size(); ++c) {
            const auto bracket = header[c].find('(');
            const auto end = diagram.find_signal(header[c].substr(0, bracket));
            ASSERT_GE(end.node, 0) << header[c];
            const int element =
                bracket == std::string::npos ? 0 : std::stoi(header[c].substr(bracket + 1)) - 1;
            const Slot& slot = diagram.slot(end);
            ASSERT_LT(element, slot.size.count());
            const double wanted = std::stod(expected[c]);
            EXPECT_NEAR(read_value(simulation.context().data(end.node, end.slot), slot.type, element), wanted,
                        1e-14 * std::max(1.0, std::abs(wanted)))
                << header[c] << " in row " << rows;
        }
    }
    EXPECT_GE(rows, 5);
}

INSTANTIATE_TEST_SUITE_P(Folders, ModelOfFolder, testing::ValuesIn(folders()),
                         [](const auto& folder) { return folder.param; });

} // namespace
} // namespace bf
