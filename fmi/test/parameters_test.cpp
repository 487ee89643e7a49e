#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include "odd.hpp"

#include <cmath>

namespace bf::fmi::test {
namespace {

// The FMU refuses to have its fixed parameter set after the initialization, and its tunable one between
// events.
TEST(ModelExchange, ChangesTunableParametersInEventsAndFixedOnesNot) {
    const TemporaryFolder folder("parameters_test");
    odd_fmu("exchanged", folder.path());
    ::setenv("BLOCKFACTORY_PLUGIN_PATH",
             (folder.path().string() + ":" BF_BINARY_DIRECTORY "/lib/blockfactory").c_str(), 1);
    bf::Registry registry;
    registry.add(bf::standard_library());
    const bf::Diagram diagram = bf::elaborate(
        bf::formats::read_yaml_text("model: m\nplugins: [FMI]\nstep: 0.01\nsolver: rk4\nblocks:\n"
                                    "  f: {block: FMI/ModelExchange, fmu: odd.fmu}\nrecord: [f.y]\n",
                                    "m.yaml"),
        registry);
    bf::Simulation simulation(diagram);
    simulation.start();
    for (int k = 0; k < 20; ++k) ASSERT_TRUE(static_cast<bool>(simulation.step())) << simulation.failure();
    simulation.set_parameter("f.k", {3});
    simulation.set_parameter("f.mass", {2});
    for (int k = 0; k < 11; ++k) ASSERT_TRUE(static_cast<bool>(simulation.step())) << simulation.failure();
    // The change makes an event in the step that begins at 0.2 s; the last of the others begins at 0.3 s.
    EXPECT_NEAR(find(simulation.signals(), "f.y")[0], std::exp(-0.2) * std::exp(-3 * 0.1), 1e-6);
    simulation.stop();
}

} // namespace
} // namespace bf::fmi::test
