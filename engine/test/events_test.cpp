// Zero crossings and events, against closed forms.
#include "support.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace bf;
using namespace bf::test;

namespace {

constexpr double g = 9.81;

/// A ball over the floor: x = (height, speed), speed := -e speed where the height falls through zero.
class Ball final : public Block {
  public:
    using Block::Block;
    Parameter<double> restitution{this, "restitution", {.initial = {0.5}}};
    Parameter<double> rest_below{this, "rest_below", {.initial = {0.0}}};
    ContinuousState<> x{this, "x", {.shape = Extent(2), .initial = {1, 0}}};
    DiscreteState<double> bounces{this, "bounces"};
    DiscreteState<bool> rests{this, "rests"};
    Output<double> height{this, "height"};
    Output<double> count{this, "count"};
    Guard floor{this, "floor"};

    Status output(Now at, Out to) const noexcept override {
        to[height] = at[x](0);
        to[count] = at[bounces];
        return ok;
    }
    Status derivative(Now at, Rate to) const noexcept override {
        to[x](0) = at[rests] ? 0 : at[x](1);
        to[x](1) = at[rests] ? 0 : -g;
        return ok;
    }
    Status guards(Now at, Guards to) const noexcept override {
        to[floor] = at[x](0);
        return ok;
    }
    Status event(Now at, After to) const noexcept override {
        if (at[floor] > 0) return ok;
        const double speed = -at[restitution] * at[x](1);
        to[x](0) = 0;
        to[x](1) = speed;
        to[bounces] = at[bounces] + 1;
        to[rests] = speed < at[rest_below];
        return ok;
    }
};

const Library& library() {
    static const Library made = [] {
        Library l("");
        l.group("test").add<Ball>("Ball", "");
        return l;
    }();
    return made;
}

/// Time and a signal whenever observers are called.
class Log final : public Simulation::Observer {
  public:
    Log(Session& session, const std::string& path) : end_(session.diagram.find_signal(path)) {
        session.simulation->add_observer(*this);
    }
    void observe(const Simulation& simulation) noexcept override {
        times.push_back(simulation.time());
        values.push_back(*static_cast<const double*>(simulation.context().data(end_.node, end_.slot)));
    }
    /// When the value jumped: the last of equal times.
    std::vector<double> jumps() const {
        std::vector<double> found;
        for (std::size_t k = 1; k < values.size(); ++k)
            if (values[k] != values[k - 1]) found.push_back(times[k]);
        return found;
    }
    std::vector<double> times, values;

  private:
    Node::End end_;
};

std::string ball(const std::string& solver, const std::string& settings = "") {
    return "model: ball\nstep: 0.1\nstop: 3\nsolver: " + solver + "\nblocks:\n  ball: {block: Ball" +
           settings + "}\n";
}

/// Instant of bounce n = 1, 2, ... of a ball dropped from 1 m: t_1 + 2 v_1 (e + e^2 + ... + e^(n-1)) / g.
double bounce(int n, double e) {
    const double first = std::sqrt(2 / g), speed = g * first;
    double t = first;
    for (int k = 1; k < n; ++k) t += 2 * speed * std::pow(e, k) / g;
    return t;
}

} // namespace

TEST(Events, AreLocatedInsideAStep) {
    for (const auto* solver : {"dormand_prince45", "cvode_bdf", "cvode_adams"}) {
        Session run(ball(solver), &library());
        Log log(run, "ball.count");
        run.trace("ball.height", 12);
        const auto jumps = log.jumps();
        ASSERT_GE(jumps.size(), 3u) << solver;
        for (int n = 1; n <= 3; ++n)
            EXPECT_NEAR(jumps[static_cast<std::size_t>(n) - 1], bounce(n, 0.5), 1e-6) << solver << n;
    }
}

TEST(Events, ShowTheStateBeforeAndAfterAtTheSameInstant) {
    Session run(ball("dormand_prince45"), &library());
    Log log(run, "ball.count");
    run.trace("ball.height", 6);
    const auto after = std::find(log.values.begin(), log.values.end(), 1.0) - log.values.begin();
    EXPECT_EQ(log.times[static_cast<std::size_t>(after)], log.times[static_cast<std::size_t>(after) - 1]);
    EXPECT_TRUE(std::is_sorted(log.times.begin(), log.times.end()));
}

TEST(Events, OfFixedStepsActInTheFirstStepAfterTheCrossing) {
    Session run(ball("rk4"), &library());
    const auto counts = run.trace("ball.count", 8);
    // The height 1 - g/2 t^2 is below zero first at t = 0.5.
    EXPECT_EQ(counts, (Values{0, 0, 0, 0, 0, 1, 1, 1}));
}

TEST(Events, ThatAccumulateEndTheRunByName) {
    Session run(ball("dormand_prince45"), &library());
    while (run.simulation->step())
        if (run.simulation->time() > 3) FAIL() << "a ball bounces infinitely often";
    EXPECT_EQ(run.simulation->failure(), "ball: its zero crossings accumulate (Zeno behaviour or "
                                         "chattering): let the block rest below a small "
                                         "speed, or give it hysteresis");
    EXPECT_NEAR(run.simulation->time(), 1.3, 0.1); // bounces accumulate at 3 t_1 = 1.35 s
}

TEST(Events, LetTheBallComeToRest) {
    Session run(ball("dormand_prince45", ", rest_below: 1e-3"), &library());
    run.trace("ball.height", 30);
    EXPECT_EQ(run("ball.height"), 0);
    EXPECT_EQ(run("ball.count"), std::ceil(std::log(1e-3 / std::sqrt(2 * g)) / std::log(0.5)));
}

TEST(Events, GoOnBitForBitAfterASnapshot) {
    for (const auto* solver : {"dormand_prince45", "cvode_bdf", "rk4"}) {
        Session run(ball(solver, ", restitution: 0.8"), &library());
        run.trace("ball.height", 7);
        const auto snapshot = run.simulation->snapshot();
        const Values first = run.trace("ball.height", 10);
        run.simulation->restore(snapshot);
        EXPECT_EQ(run.trace("ball.height", 10), first) << solver;
        Session other(ball(solver, ", restitution: 0.8"), &library());
        other.simulation->restore(snapshot);
        EXPECT_EQ(other.trace("ball.height", 10), first) << solver << " in another simulation";
    }
}

TEST(Adaptive, StiffOscillatorsMeetThePublishedSolution) {
    // Van der Pol, mu = 1000, at t = 2000: x = 1.706167732170469 (Mazzia, Magherini, Test Set for IVP
    // Solvers, II-8).
    Session run(
        "model: m\nstep: 100\nsolver: cvode_bdf\nrelative_tolerance: 1e-8\nabsolute_tolerance: 1e-10\n"
        "blocks:\n  x: {block: Integrator, initial: 2}\n  v: {block: Integrator}\n"
        "  one: {block: Constant, value: 1}\n  xx: {block: Product, operations: '**'}\n"
        "  s: {block: Sum, signs: +-}\n  p: {block: Product, operations: '**'}\n"
        "  mu: {block: Gain, K: 1000}\n  a: {block: Sum, signs: +-}\n"
        "connections: {v: [x, p.u2], x: [xx.u1, xx.u2, a.u2], one: s.u1, xx: s.u2, s: p.u1, p: mu, mu: a.u1, "
        "a: v}\n");
    Log x(run, "x");
    run.trace("x", 21);
    EXPECT_NEAR(x.values.back(), 1.706167732170469, 1e-5);
}

TEST(Adaptive, DiscreteControllersAreSampledExactly) {
    // A plant x' = u under a sampled controller u = -x: x_k = (1 - T)^k exactly.
    for (const auto* solver : {"dormand_prince45", "cvode_bdf"}) {
        Session run(
            std::string("model: m\nstep: 0.1\nsolver: ") + solver +
            "\nblocks:\n  x: {block: Integrator, initial: 1}\n  u: {block: Gain, K: -1, period: 0.1}\n"
            "connections: {x: u, u: x}\n");
        Log x(run, "x");
        run.trace("x", 11);
        for (std::size_t k = 0; k < 11; ++k)
            EXPECT_NEAR(x.values[k], std::pow(0.9, static_cast<double>(k)), 1e-9) << solver;
    }
}

TEST(Adaptive, TolerancesCanBeSetByName) {
    try {
        Session run(
            "model: m\nstep: 1\nsolver: cvode_bdf\nrelative_tolerance: -1\nblocks: {x: {block: Clock}}\n");
        FAIL();
    } catch (const model::Errors& errors) {
        EXPECT_STREQ(errors.what(), "m.yaml:4:21: 'relative_tolerance' is -1; give a positive number");
    }
}

TEST(Events, EnablingSignalsAreLocated) {
    // x' = 1 while sin(2 pi t + 0.1) > 0: half of the time.
    Session run(
        "model: m\nstep: 0.3\nstop: 6\nsolver: dormand_prince45\nblocks:\n"
        "  u: {block: Sine, frequency: 2*pi, phase: 0.1}\n  s:\n    execution: enabled\n    outputs: [y]\n   "
        " blocks:\n"
        "      one: {block: Constant, value: 1}\n      x: {block: Integrator}\n"
        "    connections: {one: x, x: y}\nconnections: {u: s.enable}\n");
    Log x(run, "s.x");
    run.trace("s.x", 21);
    EXPECT_NEAR(x.values.back(), 3, 1e-9);
}
