// Running to a time and to an event.
#include "support.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <map>

namespace bf::test {
namespace {

const std::string ramp = R"m(
model: m
step: 0.1
blocks:
  x: {block: Ramp, slope: 2}
  slow: {block: DiscreteIntegrator, period: 0.5}
connections: {x: slow}
)m";

std::function<bool(const Simulation&)> above(const Session& run, const std::string& signal,
                                             double threshold) {
    const auto end = run.diagram.find_signal(signal);
    return [end, threshold](const Simulation& s) {
        return *static_cast<const double*>(s.context().data(end.node, end.slot)) > threshold;
    };
}

TEST(RunUntil, CompletesTheStepInWhichTheEventIsSeen) {
    Session run(ramp);
    EXPECT_TRUE(run.simulation->run_until(above(run, "x", 1.1)));
    // x = 2 t passes 1.1 first at the step at 0.6 s, k = 6.
    EXPECT_EQ(run.simulation->steps(), 7);
    EXPECT_DOUBLE_EQ(run("x"), 1.2);
    EXPECT_TRUE(run.simulation->run_until(above(run, "x", 1.1))) << "it is asked anew";
    EXPECT_EQ(run.simulation->steps(), 8);
}

TEST(RunUntil, GivesUpAtItsLimit) {
    Session run(ramp);
    EXPECT_FALSE(run.simulation->run_until(above(run, "x", 100), 2));
    EXPECT_EQ(run.simulation->steps(), 20);
}

TEST(RunUntil, ATimeStopsBeforeTheStepAtThatTime) {
    Session run(ramp);
    EXPECT_TRUE(run.simulation->run_until(0.3));
    EXPECT_EQ(run.simulation->steps(), 3);
    EXPECT_TRUE(run.simulation->run_until(0.3)) << "it is there already";
    EXPECT_EQ(run.simulation->steps(), 3);
}

TEST(RunUntil, ARunHasTheStepsThatStandBeforeItsEnd) {
    for (const auto& [end, steps] : {std::pair{3.05, 31}, {3.0, 30}, {3.01, 31}, {0.7, 7}, {0.0, 0}}) {
        Session run(ramp);
        EXPECT_TRUE(run.simulation->run_until(end));
        EXPECT_EQ(run.simulation->steps(), steps) << end;
    }
}

TEST(RunUntil, EndsWhereAStepFails) {
    Session run(
        "model: m\nstep: 0.1\nblocks:\n  x: {block: Ramp}\n  low: {block: CompareToConstant, "
        "operator: <, constant: 0.35}\n  stop: {block: Assertion}\nconnections: {x: low, low: stop}\n");
    EXPECT_FALSE(run.simulation->run_until(10));
    EXPECT_NE(run.simulation->failure().find("stop"), std::string::npos);
    EXPECT_EQ(run.simulation->steps(), 4);
}

TEST(VisitTasks, ShowsEveryBlockWithItsRate) {
    Session run(ramp);
    std::map<std::string, double> periods;
    run.simulation->visit_tasks(
        [&](Task&, Phase, const std::string& block, int rate) { periods[block] = run.diagram.period(rate); });
    EXPECT_EQ(periods, (std::map<std::string, double>{{"x", 0.1}, {"slow", 0.5}}));
}

} // namespace
} // namespace bf::test
