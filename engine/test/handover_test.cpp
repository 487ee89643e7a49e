// A run that goes on as a run of another diagram.
#include "bf/engine/handover.hpp"
#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

const std::vector<const char*> signals{"slow", "fast", "plant", "s.y", "t.y", "gain"};

Values everything(Session& run, int steps) {
    Values all;
    for (int k = 0; k < steps; ++k) {
        if (!run.simulation->step()) throw std::runtime_error(run.simulation->failure());
        for (const char* signal : signals)
            for (const double x : run.values(signal)) all.push_back(x);
    }
    return all;
}

/// A new block stands in front of the others, so that nodes, slots and flags have other numbers.
const std::string with_more = replaced(multirate, "blocks:\n",
                                       "blocks:\n  first: {block: UnitDelay, initial: \"[7 8 9]\"}\n"
                                       "  three: {block: Constant, value: \"[1 2 3]\"}\n");
const std::string with_more_wired =
    replaced(with_more, "connections: {sine:", "connections: {three: first, sine:");

TEST(Handover, AnotherDiagramGoesOnWithTheSameBitsWhereBothAreTheSame) {
    for (const int instant : {0, 1, 2, 3, 5, 8, 13}) {
        Session run(multirate), other(with_more_wired);
        if (instant > 0) everything(run, instant);
        other.simulation->go_on_from(*run.simulation);
        EXPECT_EQ(other.simulation->steps(), instant);
        EXPECT_EQ(everything(other, 20), everything(run, 20)) << instant;
        const Handover between = handover(*run.simulation, *other.simulation);
        EXPECT_TRUE(between.lost.empty());
        EXPECT_EQ(between.begun, std::vector<std::string>{"first.x"});
    }
}

TEST(Handover, SaysWhichStatesHaveNoPlaceInTheOtherDiagram) {
    const Session run(multirate), narrow(replaced(multirate, "\"[3 5]\"", "\"[3 5 7]\""));
    const Session without(
        replaced(replaced(multirate, "  fast: {block: DiscreteIntegrator}\n", ""), "fast, ", ""));
    const Session other(replaced(multirate, "fast: {block: DiscreteIntegrator}", "fast: {block: UnitDelay}"));
    EXPECT_EQ(handover(*run.simulation, *narrow.simulation).lost.front(),
              "'slow.x' is 3x1 double and was 2x1 double");
    EXPECT_EQ(handover(*run.simulation, *without.simulation).lost,
              (std::vector<std::string>{"'fast.x' is no longer there", "'fast.before' is no longer there"}));
    EXPECT_EQ(handover(*run.simulation, *other.simulation).begun, std::vector<std::string>{"fast.x"});
}

TEST(Handover, ParametersAndConstantsAreThoseOfTheNewDiagram) {
    Session run(multirate), other(replaced(multirate, "K: 2", "K: 4"));
    everything(run, 4);
    const double plant = run("plant");
    other.simulation->go_on_from(*run.simulation);
    everything(other, 1);
    everything(run, 1);
    EXPECT_EQ(other("gain"), 2 * run("gain"));
    EXPECT_EQ(other("plant"), run("plant")) << plant;
}

TEST(Handover, ATimeWithinAStepOfTheNewDiagramIsRefused) {
    Session run(multirate), other(replaced(replaced(multirate, "step: 0.1", "step: 0.2"),
                                           "period: 0.3, offset: 0.1", "period: 0.6, offset: 0.2"));
    everything(run, 3);
    try {
        other.simulation->go_on_from(*run.simulation);
        FAIL() << "it went on";
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(),
                     "t = 0.30000000000000004 s lies within a step of 0.2 s; go on from a multiple "
                     "of it, or start anew");
    }
    everything(run, 1);
    other.simulation->go_on_from(*run.simulation);
    EXPECT_EQ(other.simulation->steps(), 2);
}

} // namespace
} // namespace bf::test
