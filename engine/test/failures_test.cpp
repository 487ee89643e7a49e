// Steps that fail, in whatever a block does.
#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

/// x' = 1 with a guard that rises at 0.25 s; one of its methods fails from a time on.
struct Fails : Block {
    using Block::Block;
    Argument<std::string> where{this, "where", {.initial = "nowhere"}};
    Parameter<double> from{this, "from", {.initial = {0.2}}};
    Input<double> u{this, "u", {.feedthrough = false, .optional = true}};
    Output<double> y{this, "y"};
    DiscreteState<double> events{this, "events"};
    ContinuousState<double> x{this, "x"};
    Guard quarter{this, "quarter"};

    Status judged(Now at, const char* method) const noexcept {
        if (*where == method && at.time() >= at[from]) return Status::failure("it fails as asked");
        return ok;
    }
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[x];
        return judged(at, "output");
    }
    Status update(Now at, Next next) const noexcept override {
        next[events] = at[events];
        return judged(at, "update");
    }
    Status derivative(Now at, Rate rate) const noexcept override {
        rate[x] = 1;
        return judged(at, "derivative");
    }
    Status guards(Now at, Guards guards) const noexcept override {
        guards[quarter] = at.time() - 0.25;
        return judged(at, "guards");
    }
    Status event(Now at, After after) const noexcept override {
        after[events] = at[events] + 1;
        return judged(at, "event");
    }
};

/// Its guard has crossed again whenever it has answered: s (t - 0.25) with s := -s.
struct Restless : Block {
    using Block::Block;
    Output<double> y{this, "y"};
    DiscreteState<double> s{this, "s", {.initial = {1}}};
    ContinuousState<double> x{this, "x"};
    Guard guard{this, "guard"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[s];
        return ok;
    }
    Status derivative(Now, Rate rate) const noexcept override {
        rate[x] = 1;
        return ok;
    }
    Status guards(Now at, Guards guards) const noexcept override {
        guards[guard] = at[s] * (at.time() < 0.25 ? -1 : 1);
        return ok;
    }
    Status event(Now at, After after) const noexcept override {
        after[s] = -at[s];
        return ok;
    }
};

const Library& failing() {
    static const Library made = [] {
        Library l("");
        l.group("test").add<Fails>("Fails", "").add<Restless>("Restless", "");
        return l;
    }();
    return made;
}

struct Count : Run::Observer {
    void observe(const Run& run) noexcept override {
        ++seen;
        last = run.time();
    }
    int seen = 0;
    double last = -1;
};

const std::vector<std::string> all_solvers{"euler",     "heun",           "bogacki_shampine",
                                           "rk4",       "dormand_prince", "dormand_prince45",
                                           "cvode_bdf", "cvode_adams"};

TEST(Failures, OfEveryMethodEndTheRunByNameInTheStepInWhichTheyHappen) {
    for (const auto& solver : all_solvers)
        for (const std::string method : {"output", "update", "derivative", "guards", "event"}) {
            Session run(
                "model: m\nstep: 0.1\nsolver: " + solver +
                    "\nblocks:\n  before: {block: Fails}\n  culprit: {block: Fails, where: " + method + "}\n",
                &failing());
            Count count;
            run.simulation->add_observer(count);
            int steps = 0;
            while (steps < 10 && run.simulation->step()) ++steps;
            const std::string what = solver + ", " + method;
            EXPECT_EQ(run.simulation->failure(), "culprit: it fails as asked") << what;
            EXPECT_FALSE(run.simulation->step()) << what << ": the run has ended";
            EXPECT_EQ(run.simulation->steps(), steps) << what;
            EXPECT_LE(count.last, 0.4) << what;
            if (method == "update") {
                EXPECT_EQ(steps, 2) << what;
                EXPECT_EQ(count.seen, 3) << what << ": updates come after observers";
            } else { // inside the step before, where a solver asks, or in it
                EXPECT_GE(steps, 1) << what;
                EXPECT_LE(steps, method == "event" ? 3 : 2) << what;
            }
            if (method == "event") {
                EXPECT_EQ(*static_cast<double*>(run.simulation->context().data(
                              0, run.diagram.nodes[0].block->declaration().find("events"))),
                          1)
                    << what << ": blocks before it have answered";
            }
        }
}

TEST(Failures, AnswersWithoutEndAreGivenUpByName) {
    for (const std::string solver : {"rk4", "dormand_prince45", "cvode_bdf"}) {
        Session run("model: m\nstep: 0.1\nsolver: " + solver + "\nblocks:\n  r: {block: Restless}\n",
                    &failing());
        int steps = 0;
        while (steps < 10 && run.simulation->step()) ++steps;
        EXPECT_EQ(run.simulation->failure(),
                  "r: its zero crossings answer one another without end: 1000 times at one instant; give one "
                  "of the blocks a dead band or hysteresis")
            << solver;
        EXPECT_EQ(steps, solver == "rk4" ? 3 : 2) << "fixed steps look in the first step after 0.25 s";
        EXPECT_EQ(run.simulation->steps(), steps) << solver;
    }
}

} // namespace
} // namespace bf::test
