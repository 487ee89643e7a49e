// A hosted block in a model like any other.
#include "bf/blocks/standard.hpp"
#include "bf/core/registry.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include <gtest/gtest.h>

namespace bf {
namespace {

struct HostedInDiagram : testing::Test {
    Registry registry;
    HostedInDiagram() {
        registry.add_search_path(BF_TEST_PLUGINS);
        registry.add(standard_library());
    }
    Diagram diagram(const std::string& blocks) {
        return elaborate(
            formats::read_yaml_text("model: hosted\nplugins: [LegacyPlugin]\nstep: 0.01\nstop: 1\n"
                                    "blocks:\n  a: {block: Constant, value: \"[1 2 3]\"}\n" +
                                    blocks + "connections:\n  a: h.u1\n"),
            registry);
    }
};

TEST_F(HostedInDiagram, RunsWithTheSizesAndValuesOfTheModel) {
    const Diagram d = diagram("  h: {block: LegacyPlugin/Misbehaves, misdeed: none}\n");
    Simulation simulation(d);
    simulation.start();
    ASSERT_TRUE(simulation.step()) << simulation.failure();
    const auto end = d.find_signal("h.y1");
    EXPECT_EQ(static_cast<const double*>(simulation.context().data(end.node, end.slot))[2], 1);
    try {
        simulation.snapshot();
        FAIL() << "hidden state was saved";
    } catch (const std::exception& error) {
        EXPECT_NE(std::string(error.what()).find("h"), std::string::npos) << error.what();
    }
}

TEST_F(HostedInDiagram, AFailingStepNamesPathPluginBlockAndCall) {
    const Diagram d = diagram("  h: {block: LegacyPlugin/Misbehaves, misdeed: output throws}\n");
    Simulation simulation(d);
    simulation.start();
    EXPECT_FALSE(simulation.step());
    EXPECT_NE(simulation.failure().find("h"), std::string::npos);
    EXPECT_NE(
        simulation.failure().find("plugin 'LegacyPlugin', block 'Misbehaves', output: threw an exception"),
        std::string::npos)
        << simulation.failure();
}

TEST_F(HostedInDiagram, AFailingStartAndAMissingArgumentAreLocated) {
    const Diagram d = diagram("  h: {block: LegacyPlugin/Misbehaves, misdeed: initialize throws 7}\n");
    Simulation simulation(d);
    try {
        simulation.start();
        FAIL() << "it started";
    } catch (const std::exception& error) {
        EXPECT_NE(std::string(error.what()).find("block 'Misbehaves', initialize: threw an exception"),
                  std::string::npos)
            << error.what();
    }
    try {
        diagram("  h: {block: LegacyPlugin/Misbehaves}\n");
        FAIL() << "it was elaborated";
    } catch (const std::exception& error) {
        EXPECT_NE(std::string(error.what())
                      .find("h: plugin 'LegacyPlugin', block 'Misbehaves', parseParameters: the "
                            "argument 'misdeed' is missing"),
                  std::string::npos)
            << error.what();
    }
}

} // namespace
} // namespace bf
