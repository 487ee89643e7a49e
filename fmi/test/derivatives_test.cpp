#include "bf/analysis/linearize.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/formats/yaml.hpp"

#include "odd.hpp"

#include <cstdlib>

namespace bf::fmi::test {
namespace {

class Derivatives : public ::testing::Test {
  protected:
    /// x' = k (u - x), y = x of an FMU with those derivatives, linearised around a loop u = r - 2 y, with a
    /// Gain of 3 before u.
    analysis::LinearSystem linearized(const std::string& options, const std::string& attributes,
                                      const std::string& process = "shared") {
        odd_fmu(
            "exchanged", folder_.path(), options,
            {"<ModelExchange ",
             "<ModelExchange canGetAndSetFMUState='true' canSerializeFMUState='true' " + attributes + " "});
        ::setenv("BLOCKFACTORY_PLUGIN_PATH",
                 (folder_.path().string() + ":" BF_BINARY_DIRECTORY "/lib/blockfactory").c_str(), 1);
        bf::Registry registry;
        registry.add(bf::standard_library());
        const bf::Diagram diagram = bf::elaborate(
            bf::formats::read_yaml_text("model: m\nplugins: [FMI]\nstep: 0.01\nsolver: rk4\ninputs: [r]\n"
                                        "outputs: [y]\nblocks:\n  by: {block: Gain, K: 3}\n"
                                        "  f: {block: FMI/ModelExchange, fmu: odd.fmu, k: 5, process: " +
                                            process + "}\nconnections: {r: by, by: f.u, f.y: y}\n",
                                        "m.yaml"),
            registry);
        return analysis::linearize(diagram, {}, 0.02);
    }
    const TemporaryFolder folder_{"derivatives_test"};
};

void expect_near(const analysis::LinearSystem& found, double a, double b, double c, double tolerance) {
    ASSERT_EQ(found.A.size(), 1);
    EXPECT_NEAR(found.A(0, 0), a, tolerance);
    EXPECT_NEAR(found.B(0, 0), b, tolerance);
    EXPECT_NEAR(found.C(0, 0), c, tolerance);
    EXPECT_EQ(found.D(0, 0), 0);
}

TEST_F(Derivatives, AreThoseThatTheFmuGives) {
    const std::string says = "providesDirectionalDerivatives='true'";
    for (const char* process : {"shared", "own"}) {
        const auto found = linearized("-DDERIVATIVES=1", says, process);
        expect_near(found, -5, 15, 1, 0);
        EXPECT_TRUE(found.differenced.empty());
    }
    expect_near(linearized("-DDERIVATIVES=2", says), -10, 30, 2, 0); // wrong ones are taken, too
}

TEST_F(Derivatives, AreDifferencesWhereItGivesNone) {
    const auto found = linearized("-DDERIVATIVES=2", "");
    expect_near(found, -5, 15, 1, 1e-8);
    EXPECT_FALSE(found.differenced.empty());
}

TEST_F(Derivatives, ThatItPromisesItMustHave) {
    try {
        static_cast<void>(linearized("", "providesDirectionalDerivatives='true'"));
        ADD_FAILURE() << "it was taken";
    } catch (const std::exception& error) {
        EXPECT_NE(
            std::string(error.what()).find("its library lacks the functions fmi3GetDirectionalDerivative"),
            std::string::npos)
            << error.what();
    }
}

} // namespace
} // namespace bf::fmi::test
