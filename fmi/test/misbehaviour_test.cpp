// FMUs that fail, crash, hang or lack what they need, in this process and in one of their own.
#include "bf/fmi/instance.hpp"
#include "odd.hpp"

#include <chrono>

namespace bf::fmi::test {
namespace {

class Misbehaviour : public ::testing::Test {
  protected:
    /// What becomes of five steps of an odd FMU; empty: all is well.
    std::string run(const std::string& options, bool is_remote, double timeout = 60,
                    const std::pair<std::string, std::string>& change = {}) {
        const TemporaryFolder folder("misbehaviour");
        logged.clear();
        try {
            const auto archive = odd_fmu("odd", folder.path(), options, change);
            const Description d = description_of(archive);
            const auto log = [this](int status, const std::string& category, const std::string& text) {
                logged.push_back(std::to_string(status) + " " + category + " " + text);
            };
            std::optional<Library> library;
            std::unique_ptr<Instance> instance;
            if (is_remote) {
                instance = make_remote_instance(archive, d, Kind::co_simulation, "odd", timeout, log);
            } else {
                library.emplace(archive);
                instance = std::make_unique<LocalInstance>(*library, "odd", log);
            }
            const auto begins = std::chrono::steady_clock::now();
            bool is_good = instance->enter_initialization(0) && instance->exit_initialization();
            for (steps = 0; steps < 5 && is_good; ++steps) is_good = instance->do_step(0.01 * steps, 0.01);
            if (!is_good) {
                --steps;
                went_on = instance->do_step(0.05, 0.01);
            }
            const std::string failure = is_good ? "" : instance->failure();
            instance.reset();
            seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begins).count();
            return failure;
        } catch (const FmuError& error) {
            const std::string text = error.what();
            return text.substr(std::min(text.find("odd.fmu"), text.size()));
        }
    }
    int steps = 0; ///< that were good
    bool went_on = true;
    double seconds = 0;
    std::vector<std::string> logged;
};

TEST_F(Misbehaviour, AFunctionThatFailsIsNamedWithItsStatusAndWhatItLogged) {
    for (const bool is_remote : {false, true}) {
        EXPECT_EQ(run("", is_remote), "");
        EXPECT_EQ(steps, 5);
        EXPECT_TRUE(logged.empty());
        run("-DFAILS_AT=3", is_remote);
        EXPECT_EQ(steps, 2) << "it counts from 1";
        ASSERT_EQ(logged.size(), 1u);
        EXPECT_EQ(logged[0], "3 logStatusError thrown on purpose");
        EXPECT_FALSE(went_on) << "after an error there is no next step";
    }
}

TEST_F(Misbehaviour, StepsThatEndTheSimulationOrThemselvesAreFailures) {
    for (const bool is_remote : {false, true}) {
        EXPECT_EQ(run("-DTERMINATES", is_remote), "odd.fmu: fmi3DoStep asks for the end of the simulation");
        EXPECT_EQ(run("-DRETURNS_EARLY", is_remote),
                  "odd.fmu: fmi3DoStep ended its step early, though it was not allowed to (FMI 3.0, section "
                  "4.2.1)");
    }
}

TEST_F(Misbehaviour, WhatItLacksIsSaidBeforeTheFirstStep) {
    for (const bool is_remote : {false, true}) {
        EXPECT_EQ(run("-DNO_INSTANCE", is_remote), "odd.fmu: it makes no instance: there is none");
        EXPECT_EQ(run("-DWITHOUT_STEP", is_remote),
                  "odd.fmu: its library lacks the functions fmi3DoStep (FMI 3.0, section 2.2)");
    }
}

TEST_F(Misbehaviour, OfAProcessOfItsOwnEndsThatProcessAlone) {
    EXPECT_EQ(run("-DCRASHES", true), "odd.fmu: fmi3DoStep crashed (Segmentation fault)");
    EXPECT_EQ(steps, 0);
    EXPECT_FALSE(went_on);
    EXPECT_EQ(run("-DEXITS", true), "odd.fmu: fmi3DoStep ended its process");
    EXPECT_EQ(run("-DABORTS_AT=3", true), "odd.fmu: fmi3DoStep crashed (Aborted)");
    EXPECT_EQ(steps, 2);
    EXPECT_EQ(run("-DCRASHES_FIRST", true),
              "odd.fmu: fmi3InstantiateCoSimulation crashed (Segmentation fault)");
    EXPECT_EQ(run("-DHANGS", true, 0.3), "odd.fmu: fmi3DoStep did not return within 0.3 s");
    EXPECT_GE(seconds, 0.3);
    EXPECT_EQ(run("-DHANGS_LAST", true, 0.3), "") << "it is ended where it does not end by itself";
    EXPECT_EQ(steps, 5);
}

} // namespace
} // namespace bf::fmi::test
