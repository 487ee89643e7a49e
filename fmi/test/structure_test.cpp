#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include "odd.hpp"

#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

namespace bf::fmi::test {
namespace {

/// The FMU has v, n x 3 with the numbers 0, 1, ... row by row, and refuses to give it with another size.
class StructuralParameters : public ::testing::Test {
  protected:
    bf::Diagram diagram(const std::string& settings, const std::string& options = {}) {
        odd_fmu("odd", folder_.path(), options);
        ::setenv("BLOCKFACTORY_PLUGIN_PATH",
                 (folder_.path().string() + ":" BF_BINARY_DIRECTORY "/lib/blockfactory").c_str(), 1);
        auto& registry = *registries_.emplace_back(std::make_unique<bf::Registry>());
        registry.add(bf::standard_library());
        return bf::elaborate(bf::formats::read_yaml_text(
                                 "model: m\nplugins: [FMI]\nstep: 0.01\nblocks:\n  f: {block: FMI/FMU, "
                                 "fmu: odd.fmu, period: 0.01" +
                                     settings + "}\nrecord: [f.v]\n",
                                 "m.yaml"),
                             registry);
    }
    std::string refusal(const std::string& settings, const std::string& options = {}) {
        try {
            const bf::Diagram its = diagram(settings, options);
            bf::Simulation(its).start();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "it was taken";
    }
    const TemporaryFolder folder_{"structure_test"};
    std::vector<std::unique_ptr<bf::Registry>> registries_; // of the blocks
};

TEST_F(StructuralParameters, DecideTheSizesOfPortsAndHoldWhereARunBeginsAnew) {
    for (const std::string process : {"shared", "own"}) {
        const bf::Diagram its = diagram(", structure: [n=4], process: " + process);
        bf::Simulation simulation(its);
        for (int run = 0; run < 2; ++run) {
            simulation.start();
            for (int k = 0; k < 3; ++k)
                ASSERT_TRUE(static_cast<bool>(simulation.step())) << simulation.failure();
            const auto v = find(simulation.signals(), "f.v").values();
            ASSERT_EQ(v.size(), 12);
            for (int i = 0; i < 12; ++i) EXPECT_EQ(v[static_cast<std::size_t>(i % 3 * 4 + i / 3)], i);
        }
        simulation.stop();
    }
}

TEST_F(StructuralParameters, AreRefusedWhereTheFmuHasNoneOfThatNameOrValue) {
    const auto has = [](const std::string& text, const std::string& part) {
        EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    has(refusal(", structure: [m=4]"), "'m' is no structural parameter; there are: n");
    has(refusal(", structure: [n=-1]"), "'n' must be a whole number from 0 to");
    has(refusal(", structure: [n=1.5]"), "but is 1.5");
    has(refusal(", structure: [n]"), "'structure' has 'n', which gives no parameter a number; write n=3");
    has(refusal(", structure: [n=9]"), "fmi3SetUInt64 gave Error");
    has(refusal(", structure: [n=4]", "-DWITHOUT_CONFIGURATION"),
        "lacks the functions fmi3EnterConfigurationMode");
}

/// One start value is that of all elements; of several, those of another size are not known, which is NaN for
/// parameters.
TEST(StructuralParametersOfDescriptions, LeaveStartValuesOfAnotherSizeOpen) {
    const std::string text = R"(<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="t">
<CoSimulation modelIdentifier="m"/><ModelVariables>
<UInt64 name="n" valueReference="1" causality="structuralParameter" variability="fixed" start="2"/>
<Float64 name="one" valueReference="2" causality="parameter" variability="tunable" start="7">
<Dimension valueReference="1"/></Float64>
<Float64 name="several" valueReference="3" causality="parameter" variability="tunable" start="1 2">
<Dimension valueReference="1"/></Float64>
<Float64 name="u" valueReference="4" causality="input" start="1 2"><Dimension valueReference="1"/></Float64>
</ModelVariables><ModelStructure/></fmiModelDescription>)";
    const auto starts = [&](double n) {
        const auto d = read_description(text, "m.fmu", {{"n", n}});
        return std::vector{d.variables[1].start, d.variables[2].start, d.variables[3].start};
    };
    EXPECT_EQ(starts(2), (std::vector<std::vector<double>>{{7, 7}, {1, 2}, {1, 2}}));
    const auto of_3 = starts(3);
    EXPECT_EQ(of_3[0], (std::vector<double>{7, 7, 7}));
    ASSERT_EQ(of_3[1].size(), 3u);
    EXPECT_TRUE(std::isnan(of_3[1][0]));
    EXPECT_EQ(of_3[2], (std::vector<double>{0, 0, 0}));
}

} // namespace
} // namespace bf::fmi::test
