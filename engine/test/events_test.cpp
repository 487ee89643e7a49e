// Zero crossings and events, against closed forms.
#include "adaptive.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
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
    for (const auto* solver : adaptive_solvers) {
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
    for (const auto* solver : adaptive_solvers) {
        Session run(ball(solver), &library());
        while (run.simulation->step())
            if (run.simulation->time() > 3) FAIL() << "a ball bounces infinitely often";
        EXPECT_EQ(run.simulation->failure(), "ball: its zero crossings accumulate (Zeno behaviour or "
                                             "chattering): let the block rest below a small "
                                             "speed, or give it hysteresis")
            << solver;
        EXPECT_NEAR(run.simulation->time(), 1.3, 0.1) << solver; // bounces accumulate at 3 t_1 = 1.35 s
    }
}

/// A ball from blocks: the speed is reset where the height passes the floor, which leaves the height as it
/// is.
std::string ball_of_blocks(const std::string& settings, const std::string& floor) {
    return "model: m\nmax_step: 0.5\nvariables: {floor: " + floor + "}\n" + settings +
           "blocks:\n  g: {block: Constant, value: -9.81}\n  v: {block: LimitedIntegrator, reset: falling, "
           "initial_source: external, state_port: true}\n"
           "  r: {block: Gain, K: -0.8}\n  h: {block: Integrator, initial: floor + 1}\n"
           "  over: {block: Bias, bias: -floor}\n"
           "connections: {g: v.u, v.y: h, v.state: r, r: v.x0, h: over, over: v.reset}\n";
}

TEST(Events, AWayOutAndBackWithinAStepOfTheSolverIsSeen) {
    for (const std::string solver : adaptive_solvers)
        for (const auto* tolerance : {"1e-5", "1e-7", "1e-9"})
            for (const double step : {0.01, 0.1})
                for (const auto* floor : {"0", "-3.7", "1"}) { // numbers are coarser away from 0
                    const std::string settings = "step: " + std::to_string(step) + "\nsolver: " + solver +
                                                 "\nabsolute_tolerance: " + tolerance + "\n";
                    Session run(ball_of_blocks(settings, floor));
                    Log height(run, "over");
                    while (run.simulation->time() < 5 && run.simulation->step()) {
                    }
                    EXPECT_EQ(run.simulation->failure().substr(0, 36), "v: its zero crossings accumulate (Ze")
                        << settings << floor;
                    // 1 + 2 (0.8 + 0.8^2 + ...) times the fall, but for the flights that are left out.
                    const double error = solver == "dormand_prince45" ? 5e-4 * step : 0.1;
                    EXPECT_NEAR(height.times.back(), 9 * std::sqrt(2 / g), error) << settings << floor;
                    EXPECT_GT(*std::min_element(height.values.begin(), height.values.end()), -1e-9)
                        << settings << floor;
                }
}

TEST(Events, OfAPulseShorterThanAStepOfTheSolverAreSeen) {
    // 40 pulses of 10 ms.
    expect_last("x", 0.4, 1e-5, 21, "step: 1\nstop: 100\n",
                "  u: {block: Pulse, cycle: 0.5, width: 2, delay: 0.1}\n"
                "  x: {block: Integrator}\nconnections: {u: x}\n");
}

TEST(Events, OfAnythingShorterThanAStepOfTheSolverAreSeen) {
    // All are 0 but for 10 ms, between steps of seconds.
    const std::string file = testing::TempDir() + "rows.csv";
    std::ofstream(file) << "0,0\n5,1\n5.01,0\n";
    const struct {
        std::string blocks, connections;
        double area;
    } cases[] = {
        {"y: {block: IntervalTest, lower: 5, upper: 5.01}\n  c: {block: Convert}", "t: y, y: c, c: x", 0.01},
        {"y: {block: SignalFromFile, file: " + file + "}", "y: x", 0.01},
        {"y: {block: RepeatingSequence, times: \"[0 5 5.005 5.01 20]\", values: \"[0 0 1 0 0]\"}", "y: x",
         0.005},
        {"y: {block: MultiportSwitch, indices: [501, 0]}\n  o: {block: Constant}\n  z: {block: Constant, "
         "value: 0}",
         "k: y.control, o: y.u1, z: y.u2, y: x", 0.01},
        {"y: {block: SwitchCase, cases: [501]}\n  c: {block: Convert}", "k: y, y.y1: c, c: x", 0.01},
    };
    for (const auto* solver : adaptive_solvers)
        for (const auto& [blocks, connections, area] : cases) {
            Session run(
                "model: m\nstep: 1\nstop: 10\nmax_step: 5\nsolver: " + std::string(solver) +
                "\nblocks:\n  t: {block: Clock}\n  k: {block: Gain, K: 100}\n"
                "  x: {block: Integrator}\n  " +
                blocks + "\nconnections: {t: " +
                (connections.starts_with("t: ") ? "[k, y]" + connections.substr(4) : "k, " + connections) +
                "}\n");
            EXPECT_NEAR(run.trace("x", 11).back(), area, 1e-5) << solver << ": " << blocks;
        }
}

TEST(Events, OfOneBlockLeaveTheMemoryOfOthersAlone) {
    // Memory in the order of the blocks: what the pulses count, then what the switch noted at the start.
    Session run("model: m\nstep: 0.1\nsolver: dormand_prince45\nblocks:\n  ball: {block: Ball}\n"
                "  pulses: {block: Pulse, cycle: \"[3 3 3 3 3]\", delay: 10}\n"
                "  two: {block: Constant, value: 2}\n  one: {block: Constant}\n"
                "  choice: {block: MultiportSwitch, indices: [1, 2]}\n"
                "connections: {two: [choice.control, choice.u1], one: choice.u2}\n",
                &library());
    const int node = run.diagram.find_node("choice");
    const auto& block = *run.diagram.nodes[static_cast<std::size_t>(node)].block;
    const int slot = block.declaration().find("wanted", Role::workspace);
    const auto wanted = [&] { return *static_cast<double*>(run.simulation->context().data(node, slot)); };
    EXPECT_EQ(wanted(), 2);
    run.trace("ball.count", 6);
    EXPECT_EQ(run("ball.count"), 1);
    EXPECT_EQ(wanted(), 2);
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

TEST(Adaptive, AJumpJustBehindASampleIsPassed) {
    // The limit is reached at t = 0.5, the end of a base step, but for a rounding error.
    expect_last("x", 0.75, 1e-12, 11, "step: 0.1\nstop: 3\n",
                "  u: {block: Constant, value: 1}\n  x0: {block: Constant, value: 0.25}\n"
                "  x: {block: LimitedIntegrator, initial_source: external, upper: 0.75}\n"
                "connections: {u: x.u, x0: x.x0}\n");
}

TEST(Adaptive, AnEventJustBeforeASampleIsPassed) {
    // The solver finds the step at t = 0.5 a rounding error before the end of a base step, or there.
    const std::string blocks =
        "  u: {block: Step, time: 0.5, before: 1, after: -1}\n  x: {block: Integrator}\n";
    expect_last("x", 0, 1e-5, 11, "step: 0.1\nstop: 3\n", blocks + "connections: {u: x}\n");
    expect_last("x", 0, 1e-5, 11, "step: 0.1\nstop: 3\n",
                blocks + "  k: {block: Gain, K: 0, period: 0.1}\n  sum: {block: Sum, signs: ++}\n"
                         "connections: {u: sum.u1, x: k, k: sum.u2, sum: x}\n");
}

TEST(Adaptive, ADerivativeThatIsNaNNamesItsState) {
    for (const auto* solver : adaptive_solvers) {
        Session run("model: m\nstep: 0.1\nsolver: " + std::string(solver) +
                    "\nblocks:\n  t: {block: Clock}\n  u: {block: Bias, bias: -1}\n  r: {block: Sqrt}\n"
                    "  y: {block: Integrator}\n  x: {block: Integrator}\n"
                    "connections: {t: [u, y], u: r, r: x}\n");
        EXPECT_FALSE(run.simulation->step()) << solver;
        EXPECT_EQ(run.simulation->failure().substr(0, 44), "x: a continuous state became NaN or infinite")
            << solver;
    }
}

TEST(Adaptive, StepsWithoutEndAreGivenUp) {
    // A stable explicit step of x' = -1e7 x is at most 3.3e-7 s long.
    Session run("model: m\nstep: 1\nsolver: dormand_prince45\nblocks:\n  x: {block: Integrator, initial: 1}\n"
                "  k: {block: Gain, K: -1e7}\nconnections: {x: k, k: x}\n");
    EXPECT_FALSE(run.simulation->step());
    EXPECT_EQ(
        run.simulation->failure(),
        "x: the solver did not reach the end of the base step in a million steps: use larger tolerances, or "
        "cvode_bdf if the plant is stiff");
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

TEST(Events, ADisabledSubsystemHoldsItsOutputsOfThatInstant) {
    // x' = cos t from t = 0 on; it is disabled where sin(1.3 t + 0.2) falls through 0, or at the sample 1.5.
    for (const std::string solver : adaptive_solvers)
        for (const auto& [enable, end] :
             {std::pair<std::string, double>{"Sine, frequency: 1.3, phase: 0.2", (std::acos(-1) - 0.2) / 1.3},
              {"Step, time: 1.5, before: 1, after: 0, period: 0.1", 1.5}}) {
            Session run("model: m\nstep: 0.1\nmax_step: 0.5\nrelative_tolerance: 1e-9\nsolver: " + solver +
                        "\nblocks:\n  on: {block: " + enable +
                        "}\n  u: {block: Sine, phase: pi/2}\n"
                        "  s:\n    execution: enabled\n    inputs: [u]\n    outputs: [y, v]\n    blocks:\n"
                        "      x: {block: Integrator}\n      square: {block: Square}\n"
                        "    connections: {u: [x, square], x: y, square: v}\n"
                        "  z: {block: Integrator}\n"
                        "connections: {on: s.enable, u: s.u, s.y: z}\n");
            run.trace("s.y", 26);
            EXPECT_NEAR(run("s.x"), std::sin(end), 1e-7) << solver << ' ' << enable;
            EXPECT_EQ(run("s.y"), run("s.x")) << solver << ' ' << enable;
            EXPECT_NEAR(run("s.v"), std::cos(end) * std::cos(end), 1e-12) << solver << ' ' << enable;
            EXPECT_NEAR(run("z"), 1 - std::cos(end) + (2.5 - end) * std::sin(end), 1e-6) << solver << enable;
        }
}

TEST(Events, ALevelThatResetsIsLocatedWhereItEnds) {
    // sin(2 pi t + 0.3) falls through 0 at t = 0.5 - 0.3/(2 pi).
    Session run(
        "model: m\nstep: 0.1\nstop: 2\nsolver: dormand_prince45\nblocks:\n  one: {block: Constant, "
        "value: 1}\n"
        "  u: {block: Sine, frequency: 2*pi, phase: 0.3}\n  s:\n    reset: level_hold\n    inputs: [u]\n"
        "    outputs: [y]\n    blocks: {x: {block: Integrator}}\n    connections: {u: x, x: y}\n"
        "connections: {one: s.u, u: s.reset}\n");
    Log x(run, "s.x");
    run.trace("s.x", 9);
    EXPECT_NEAR(x.values.back(), 0.3 + 0.3 / (2 * std::acos(-1)), 1e-9);
}

TEST(Events, TruthValuesThatEnableAreLocated) {
    // x' = 1 from t = 0.35 on: where the crossing is found, t - 0.35 is 0 and `>` does not hold yet.
    expect_last("s.x", 0.65, 1e-12, 11, "step: 0.1\nstop: 1\n",
                "  t: {block: Clock}\n"
                "  late: {block: CompareToConstant, operator: '>', constant: 0.35}\n"
                "  s:\n    execution: enabled\n    outputs: [y]\n    blocks:\n"
                "      one: {block: Constant, value: 1}\n      x: {block: Integrator}\n"
                "    connections: {one: x, x: y}\nconnections: {t: late, late: s.enable}\n");
}

TEST(Events, OfSignalsThatBecomeInfiniteAreLocated) {
    // x' = 1 from t = 0.35 on, where exp(1e4 (t - 0.35)) passes 1; at 0.43 it is infinite.
    expect_last("s.x", 9.65, 1e-12, 11, "step: 1\nstop: 10\nmax_step: 5\n",
                "  t: {block: Clock}\n  since: {block: Bias, bias: -0.35}\n  k: {block: Gain, K: 1e4}\n"
                "  grown: {block: Exp}\n"
                "  late: {block: CompareToConstant, operator: '>', constant: 1}\n"
                "  s:\n    execution: enabled\n    outputs: [y]\n    blocks:\n"
                "      one: {block: Constant, value: 1}\n      x: {block: Integrator}\n"
                "    connections: {one: x, x: y}\n"
                "connections: {t: since, since: k, k: grown, grown: late, late: s.enable}\n");
}

TEST(Events, OfControlSignalsThatAccumulateEndTheRunByName) {
    // x' = 1 below 0 and -1 above it.
    Session run(
        "model: m\nstep: 0.1\nsolver: dormand_prince45\nblocks:\n  one: {block: Constant, value: 1}\n"
        "  sum: {block: Sum, signs: ++}\n  x: {block: Integrator, initial: -0.05}\n"
        "  s:\n    execution: enabled\n    outputs: {y: {when_disabled: reset, initial: 0}}\n    blocks:\n"
        "      two: {block: Constant, value: -2}\n      g: {block: Gain}\n"
        "    connections: {two: g, g: y}\n"
        "connections: {one: sum.u1, s: sum.u2, sum: x, x: s.enable}\n");
    EXPECT_FALSE(run.simulation->step());
    EXPECT_EQ(run.simulation->failure().substr(0, 35), "x: its zero crossings accumulate (Z");
}

TEST(Triggered, RunsAtTheLocatedInstantOfAContinuousTrigger) {
    // sin(2 pi t + 0.1) rises through 0 at t = 1 - 0.1/(2 pi), 2 - ..., between the base steps.
    const auto model = [](const std::string& solver) {
        return "model: m\nstep: 0.3\nmax_step: 0.1\nsolver: " + solver +
               "\nblocks:\n  u: {block: Sine, frequency: 2*pi, phase: 0.1}\n  x: {block: Integrator}\n"
               "  one: {block: Constant}\n  s:\n    execution: triggered\n    outputs: [when, count]\n"
               "    blocks:\n      t: {block: Clock}\n      one: {block: Constant}\n      sum: {block: Sum}\n"
               "      past: {block: UnitDelay}\n"
               "    connections: {t: when, one: sum.u1, past: sum.u2, sum: [past, count]}\n"
               "connections: {u: s.trigger, one: x}\n";
    };
    for (const auto* solver : adaptive_solvers) {
        Session run(model(solver));
        Log log(run, "s.when");
        run.trace("s.when", 14); // to 4.2 s
        EXPECT_EQ(run("s.count"), 4) << solver;
        const auto jumps = log.jumps();
        ASSERT_EQ(jumps.size(), 4u) << solver;
        for (int n = 1; n <= 4; ++n) {
            const double exact = n - 0.1 / (2 * std::acos(-1));
            EXPECT_NEAR(jumps[static_cast<std::size_t>(n) - 1], exact, 1e-9) << solver;
        }
        EXPECT_NEAR(run("s.when"), 4 - 0.1 / (2 * std::acos(-1)), 1e-9) << solver;
    }
    Session fixed(model("rk4"));
    EXPECT_EQ(fixed.trace("s.when", 6), (Values{0, 0, 0, 0, 4 * 0.3, 4 * 0.3}));
}

TEST(Enabled, ByASignalThatLeavesZeroAtTheStartRunsFromThereOn) {
    for (const auto* solver : adaptive_solvers) {
        Session run(std::string("model: m\nstep: 0.5\nsolver: ") + solver +
                    "\nblocks:\n  t: {block: Clock}\n  s:\n    execution: enabled\n    outputs: [y]\n"
                    "    blocks:\n      u: {block: Constant}\n      x: {block: Integrator}\n"
                    "    connections: {u: x, x: y}\nconnections: {t: s.enable}\n");
        Log log(run, "s.y");
        run.trace("s.y", 4);
        ASSERT_GE(log.times.size(), 4u) << solver;
        for (std::size_t n = 0; n < log.times.size(); ++n)
            EXPECT_NEAR(log.values[n], log.times[n], 1e-6) << solver;
    }
}

TEST(Triggered, RunsAsOftenInABaseStepAsItsContinuousTriggerRises) {
    // Five periods in each base step, and one step of the delay per run.
    Session run(
        "model: m\nstep: 1\nsolver: dormand_prince45\nmax_step: 0.02\nblocks:\n"
        "  u: {block: Sine, frequency: 10*pi, phase: 0.1}\n  one: {block: Constant}\n"
        "  x: {block: Integrator}\n  s:\n    execution: triggered\n    outputs: [count]\n    blocks:\n"
        "      one: {block: Constant}\n      sum: {block: Sum}\n      past: {block: UnitDelay}\n"
        "    connections: {one: sum.u1, past: sum.u2, sum: [past, count]}\n"
        "connections: {u: s.trigger, one: x}\n");
    EXPECT_EQ(run.trace("s.count", 3), (Values{5, 10, 15}));
    const auto snapshot = run.simulation->snapshot();
    const Values rest = run.trace("s.count", 3);
    EXPECT_EQ(rest, (Values{20, 25, 30}));
    run.simulation->restore(snapshot);
    EXPECT_EQ(run.trace("s.count", 3), rest);
}

TEST(Triggered, AFunctionCallOfAContinuousSignalCountsOncePerStep) {
    Session run("model: m\nstep: 1\nsolver: dormand_prince45\nmax_step: 0.02\nblocks:\n"
                "  u: {block: Sine, frequency: 10*pi, phase: 0.1}\n  one: {block: Constant}\n"
                "  x: {block: Integrator}\n  s:\n    execution: triggered\n    trigger: function_call\n"
                "    outputs: [count]\n    blocks:\n"
                "      one: {block: Constant}\n      sum: {block: Sum}\n      past: {block: UnitDelay}\n"
                "    connections: {one: sum.u1, past: sum.u2, sum: [past, count]}\n"
                "connections: {u: s.trigger, one: x}\n");
    EXPECT_EQ(run.trace("s.count", 3), (Values{1, 2, 3}));
}

TEST(Events, KeepTheirToleranceWhereTheRelayActsOnItsState) {
    // A thermostat: x' = -x + 3 r between 1 and 2. It falls from 2 to 1 in ln 2, and rises from 1 to 2 in
    // ln 2.
    for (const auto* solver : adaptive_solvers)
        for (const auto* step : {"0.05", "0.25", "1"}) {
            Session run(
                std::string("model: m\nstep: ") + step + "\nsolver: " + solver +
                "\nblocks:\n  x: {block: Integrator, initial: 2}\n  sum: {block: Sum, signs: +-}\n"
                "  off: {block: Gain, K: -1}\n  r: {block: Relay, on_point: -1, off_point: -2, on_value: 3}\n"
                "connections: {x: [sum.u2, off], off: r, r: sum.u1, sum: x}\n");
            Log log(run, "r");
            run.trace("r", 4);
            const auto jumps = log.jumps();
            ASSERT_GE(jumps.size(), std::string(step) == "1" ? 5u : 0u) << solver;
            for (std::size_t n = 0; n < jumps.size(); ++n)
                EXPECT_NEAR(jumps[n], std::log(2.0) * static_cast<double>(n + 1), 1e-5)
                    << solver << " " << step;
        }
}

TEST(Events, SwitchARelayWhereItsStatePassesThePoint) {
    // x = exp(-t) passes 0.5 at ln 2, whatever the base step.
    for (const auto* solver : adaptive_solvers)
        for (const auto* step : {"0.25", "1"}) {
            Session run(std::string("model: m\nstep: ") + step + "\nsolver: " + solver +
                        "\nrelative_tolerance: 1e-9\nabsolute_tolerance: 1e-12\nblocks:\n"
                        "  x: {block: Integrator, initial: 1}\n  g: {block: Gain, K: -1}\n"
                        "  r: {block: Relay, on_point: 0.8, off_point: 0.5}\n"
                        "connections: {x: [g, r], g: x}\n");
            Log log(run, "r");
            run.trace("r", 4);
            const auto jumps = log.jumps();
            ASSERT_EQ(jumps.size(), 1u) << solver;
            EXPECT_NEAR(jumps[0], std::log(2.0), 1e-7) << solver << " " << step;
        }
}

namespace {

/// x' = -x, and how often its derivative was asked for.
class Counted final : public Block {
  public:
    using Block::Block;
    ContinuousState<double> x{this, "x", {.initial = {1}}};
    Output<double> y{this, "y"};
    Status output(Now at, Out to) const noexcept override {
        to[y] = at[x];
        return ok;
    }
    Status derivative(Now at, Rate to) const noexcept override {
        ++calls;
        to[x] = -at[x];
        return ok;
    }
    static inline int calls = 0;
};

} // namespace

TEST(Adaptive, BlocksThatRememberThePastCostNothingWhereNoDerivativeReadsThem) {
    Library blocks("");
    blocks.group("test").add<Counted>("Counted", "");
    for (const std::string solver : {"dormand_prince45", "cvode_adams"}) {
        const auto evaluations = [&](const std::string& reader) {
            Session run("model: m\nstep: 0.01\nsolver: " + solver +
                            "\nblocks:\n  c: {block: Counted}\n  past: {block: " + reader +
                            "}\nconnections: {c: past}\n",
                        &blocks);
            Counted::calls = 0;
            run.trace("c", 300);
            if (reader == "Derivative") {
                EXPECT_NEAR(run("past"), (std::exp(-2.99) - std::exp(-2.98)) / 0.01, 1e-4) << solver;
            }
            return Counted::calls;
        };
        const int least = evaluations("Gain");
        EXPECT_LT(least, 300) << solver;
        EXPECT_EQ(evaluations("Derivative"), least) << solver;
        EXPECT_EQ(evaluations("TransportDelay"), least) << solver;
    }
}

TEST(Adaptive, BlocksThatRememberThePastRestartNoSolver) {
    Library blocks("");
    blocks.group("test").add<Counted>("Counted", "");
    for (const std::string past : {"TransportDelay, delay: 0.05", "Derivative"}) {
        Session run("model: m\nstep: 0.01\nsolver: cvode_adams\nblocks:\n  c: {block: Counted}\n"
                    "  u: {block: Sine}\n  past: {block: " +
                        past + "}\n  x: {block: Integrator}\nconnections: {u: past, past: x}\n",
                    &blocks);
        Counted::calls = 0;
        run.trace("c", 300);
        // A restart takes a dozen small steps.
        EXPECT_LT(Counted::calls, (past == "Derivative" ? 10 : 4) * 300) << past; // its quotients differ
        EXPECT_NEAR(run("c"), std::exp(-2.99), 1e-4) << past;
    }
}

namespace {

/// Two clocks that ring at the same instant, each noting what it sees of the other: y = rings, seen = u in
/// the event.
class Bell final : public Block {
  public:
    using Block::Block;
    Parameter<double> time{this, "time", {.initial = {0.5}}};
    Input<double> u{this, "u", {.feedthrough = false}};
    Output<double> y{this, "y"};
    Output<double> seen{this, "seen"};
    DiscreteState<double> rings{this, "rings"};
    DiscreteState<double> heard{this, "heard", {.initial = {-1}}};
    Guard at_time_{this, "at_time"};
    Status output(Now at, Out to) const noexcept override {
        to[y] = at[rings];
        to[seen] = at[heard];
        return ok;
    }
    Status guards(Now at, Guards to) const noexcept override {
        to[at_time_] = at.time() - at[time];
        return ok;
    }
    Status event(Now at, After after) const noexcept override {
        after[rings] = at[rings] + at[at_time_]; // +1: it rose
        after[heard] = at[u];
        return ok;
    }
};

const Library& bells() {
    static const Library made = [] {
        Library l("");
        l.group("test").add<Bell>("Bell", "");
        return l;
    }();
    return made;
}

std::string with_plant(const std::string& solver, const std::string& blocks, const std::string& connections) {
    return "model: m\nstep: 0.4\nsolver: " + solver +
           "\nblocks:\n  one: {block: Constant, value: 1}\n  plant: {block: Integrator}\n" + blocks +
           "connections: {one: plant, " + connections + "}\n";
}

} // namespace

TEST(Events, OfSeveralBlocksDoNotSeeEachOther) {
    for (const auto* solver : {"dormand_prince45", "rk4"}) {
        Session run(with_plant(solver, "  a: {block: Bell}\n  b: {block: Bell}\n", "a.y: b.u, b.y: a.u"),
                    &bells());
        run.trace("a.y", 4);
        for (const char* name : {"a", "b"}) {
            EXPECT_EQ(run(std::string(name) + ".y"), 1) << solver;
            EXPECT_EQ(run(std::string(name) + ".seen"), 0) << solver << ": x⁻ of the other";
        }
    }
}

TEST(Events, AnswerAtTheSameInstantWhatTheyMakeCross) {
    // The bell's ring switches the relay, which thereby crosses no later than the bell.
    Session run(with_plant("dormand_prince45",
                           "  a: {block: Bell}\n  zero: {block: Constant, value: 0}\n"
                           "  r: {block: Relay, on_point: 0.5}\n",
                           "a.y: r, zero: a.u"),
                &bells());
    Log bell(run, "a.y"), relay(run, "r");
    run.trace("r", 4);
    ASSERT_EQ(bell.jumps().size(), 1u);
    EXPECT_EQ(relay.jumps(), bell.jumps());
    EXPECT_NEAR(bell.jumps()[0], 0.5, 1e-12);
}

TEST(Events, OfJumpsAtASampleHitActInItsStep) {
    // A discrete signal switches the relay at 0.8 s, in the outputs of that very step.
    for (const auto* solver : {"dormand_prince45", "rk4"}) {
        Session run(
            with_plant(solver,
                       "  u: {block: Step, time: 0.8, period: 0.4}\n  sum: {block: Sum, signs: ++}\n"
                       "  off: {block: Gain, K: 0}\n  r: {block: Relay, on_point: 0.5, on_value: 3}\n",
                       "u: sum.u1, plant: off, off: sum.u2, sum: r"));
        Log r(run, "r");
        run.trace("r", 4);
        ASSERT_EQ(r.jumps().size(), 1u) << solver;
        EXPECT_DOUBLE_EQ(r.jumps()[0], 0.8) << solver;
    }
}

TEST(Events, LeavingZeroIsNoCrossing) {
    EXPECT_EQ(crossing(0, 1), 0);
    EXPECT_EQ(crossing(0, -1), 0);
    EXPECT_EQ(crossing(-1, 0), 1);
    EXPECT_EQ(crossing(1, 0), -1);
    EXPECT_EQ(crossing(-1, 1), 1);
    EXPECT_EQ(crossing(1, 2), 0);
    EXPECT_EQ(crossing(NAN, 1), 0);
}

TEST(Events, AThousandInABaseStepEndTheRunByName) {
    Session run("model: m\nstep: 100\nsolver: dormand_prince45\nmax_step: 0.02\nblocks:\n"
                "  u: {block: Sine, frequency: 20*pi, phase: 0.1}\n  hit: {block: HitCrossing}\n"
                "  one: {block: Constant}\n  x: {block: Integrator}\nconnections: {u: hit, one: x}\n");
    EXPECT_FALSE(run.simulation->step());
    EXPECT_EQ(run.simulation->failure(),
              "hit: it jumps or crosses zero more often than 1000 times in one base step: give the model a "
              "shorter 'step', or let the signal change less often");
}

TEST(Adaptive, ChangedParametersActAtOnce) {
    Session run("model: m\nstep: 1\nsolver: cvode_adams\nblocks:\n  c: {block: Constant, value: 1}\n"
                "  x: {block: Integrator}\nconnections: {c: x}\n");
    run.trace("x", 1);
    run.simulation->set_parameter("c.value", {-3});
    Log x(run, "x");
    run.trace("x", 2);
    EXPECT_NEAR(x.values[0], 1, 1e-12);
    EXPECT_NEAR(x.values[1], -2, 1e-9);
}

TEST(Adaptive, ASolverThatFindsNoStepNamesTheBlockOfTheWorstState) {
    for (const auto* solver : {"dormand_prince45", "cvode_bdf"}) {
        Session run(std::string("model: m\nstep: 3\nsolver: ") + solver +
                    "\nblocks:\n  t: {block: Clock}\n  fine: {block: Integrator}\n"
                    "  x: {block: Integrator, initial: 1}\n  xx: {block: Square}\n"
                    "connections: {x: xx, xx: x, t: fine}\n"); // x = 1/(1 - t)
        EXPECT_FALSE(run.simulation->step());
        EXPECT_EQ(run.simulation->failure().substr(0, 3), "x: ") << run.simulation->failure();
    }
}

TEST(Adaptive, TolerancesAndTheLongestStepHaveDefaults) {
    const auto solver = [](const std::string& more) {
        return Session("model: m\nstep: 1\nsolver: cvode_bdf\n" + more + "blocks: {x: {block: Clock}}\n")
            .diagram.solver;
    };
    EXPECT_EQ(solver("").absolute_tolerance, 1e-9);
    EXPECT_EQ(solver("").relative_tolerance, 1e-6);
    EXPECT_EQ(solver("stop: 100\n").max_step, 2);
    EXPECT_EQ(solver("stop: 100\nmax_step: 7\n").max_step, 7);
    EXPECT_EQ(Session("model: m\nstep: 1\nblocks: {x: {block: Clock}}\n").diagram.solver.method,
              SolverMethod::rk4);
}
