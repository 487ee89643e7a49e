// Triggered, reset, iterating and variant subsystems, buses, and algebraic loops.
#include "support.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace bf;
using namespace bf::test;

namespace {

/// Its values one after another, one per hit.
class Sequence final : public Block {
  public:
    using Block::Block;
    Argument<std::vector<double>> values{this, "values", {}};
    Output<double> y{this, "y"};
    Status output(Now at, Out to) const noexcept override {
        to[y] = (*values)[static_cast<std::size_t>(at.step()) % values->size()];
        return ok;
    }
};

const Library* library() {
    static const Library made = [] {
        Library l("");
        l.group("test").add<Sequence>("Sequence", "");
        return l;
    }();
    return &made;
}

class Steps : public Session {
  public:
    explicit Steps(const std::string& text) : Session(text, library()) {}
};

/// Counts inside a subsystem that the signal from a file-like list `u` controls.
std::string counter(const std::string& keys, const std::string& control, const std::string& u) {
    return "model: m\nstep: 1\nblocks:\n  u: {block: Sequence, values: " + u +
           "}\n  on: {block: Constant, value: 1}\n  s:\n" + keys +
           "    outputs: [y]\n    blocks:\n      one: {block: Constant, value: 1}\n      sum: {block: Sum, "
           "signs: ++}\n"
           "      past: {block: UnitDelay}\n    connections: {one: sum.u1, past: sum.u2, sum: [past, y]}\n"
           "connections: {" +
           control + "}\n";
}

const std::string pulses = "[0, 1, 1, -1, 0, 2, 0]";

std::string message(const std::string& text) {
    try {
        Steps run(text);
    } catch (const model::Errors& errors) {
        return errors.what();
    }
    return "no error";
}

} // namespace

TEST(Triggered, RunsOnceAtEachEdge) {
    const auto run = [](const std::string& edge) {
        Steps session(
            counter("    execution: triggered\n    trigger: " + edge + "\n", "u: s.trigger", pulses));
        return session.trace("s.y", 7);
    };
    EXPECT_EQ(run("rising"), (Values{0, 1, 1, 1, 1, 2, 2}));
    EXPECT_EQ(run("falling"), (Values{0, 0, 0, 1, 1, 1, 2}));
    EXPECT_EQ(run("either"), (Values{0, 1, 1, 2, 2, 3, 4}));
    EXPECT_EQ(run("function_call"), (Values{0, 1, 2, 2, 2, 3, 3}));
}

TEST(Triggered, ASignalThatBeginsHighIsNoEdge) {
    Steps session(counter("    execution: triggered\n", "u: s.trigger", "[1, 1, 0, 1]"));
    EXPECT_EQ(session.trace("s.y", 4), (Values{0, 0, 0, 1}));
}

TEST(Triggered, ItsPeriodIsTheTimeSinceItRanBefore) {
    Steps session(
        "model: m\nstep: 0.5\nblocks:\n  u: {block: Sequence, values: [0, 1, 0, 0, 1, 0, 1]}\n"
        "  s:\n    execution: triggered\n    outputs: [y]\n    blocks:\n      one: {block: Constant, value: "
        "1}\n"
        "      x: {block: DiscreteIntegrator}\n    connections: {one: x, x: y}\n"
        "connections: {u: s.trigger}\n");
    session.trace("s.y", 7);
    // Ran at 0.5, 2 and 3 s; the periods before them are 0, 1.5 and 1 s.
    EXPECT_DOUBLE_EQ(session("s.x.x"), 2.5);
}

/// Outputs of a block in a triggered subsystem that takes the time in at 0.5, 2 and 3 s.
Values triggered(const std::string& block) {
    Steps session("model: m\nstep: 0.5\nblocks:\n  u: {block: Sequence, values: [0, 1, 0, 0, 1, 0, 1]}\n"
                  "  t: {block: Clock}\n  s:\n    execution: triggered\n    inputs: [t]\n    outputs: [y]\n"
                  "    blocks:\n      x: {block: " +
                  block + "}\n    connections: {t: x, x: y}\nconnections: {t: s.t, u: s.trigger}\n");
    return session.trace("s.y", 7);
}

TEST(Triggered, IntegratorsWeighAnInputWithTheTimeThatItHeld) {
    for (const std::string block : {"DiscreteIntegrator, ", "DiscretePID, P: 0, I: 1, "}) {
        EXPECT_DOUBLE_EQ(triggered(block + "method: forward").back(), 1.5 * 0.5 + 1 * 2) << block;
        EXPECT_DOUBLE_EQ(triggered(block + "method: backward").back(), 1.5 * 2 + 1 * 3) << block;
        EXPECT_DOUBLE_EQ(triggered(block + "method: trapezoidal").back(),
                         1.5 * (0.5 + 2) / 2 + 1 * (2.0 + 3) / 2)
            << block;
    }
}

TEST(Triggered, ADifferenceQuotientIsZeroUntilTimeHasPassed) {
    EXPECT_EQ(triggered("DiscreteDerivative, gain: 2"), (Values{0, 0, 0, 0, 2, 2, 2}));
}

TEST(Triggered, OnlyWhileEnabled) {
    Steps session(counter("    execution: enabled_and_triggered\n", "u: s.trigger, on: s.enable", pulses));
    EXPECT_EQ(session.trace("s.y", 7), (Values{0, 1, 1, 1, 1, 2, 2}));
    Steps off(counter("    execution: enabled_and_triggered\n", "u: [s.trigger, s.enable]", "[0, 1, -1, 1]"));
    EXPECT_EQ(off.trace("s.y", 4), (Values{0, 1, 1, 2}));
}

TEST(Triggered, ContinuousStatesAreRefused) {
    EXPECT_EQ(
        message(
            "model: m\nstep: 1\nblocks:\n  u: {block: Clock}\n  s:\n    execution: triggered\n    blocks:\n"
            "      c: {block: Clock}\n      x: {block: Integrator}\n    connections: {c: x}\n"
            "connections: {u: s.trigger}\n"),
        "m.yaml:9:7: s.x: has a continuous state, but stands in a triggered subsystem; use its discrete "
        "counterpart");
}

TEST(Triggered, SnapshotsKeepTheEdge) {
    Steps session(counter("    execution: triggered\n    trigger: either\n", "u: s.trigger", pulses));
    session.trace("s.y", 3);
    const auto snapshot = session.simulation->snapshot();
    const auto first = session.trace("s.y", 6);
    session.simulation->restore(snapshot);
    EXPECT_EQ(session.trace("s.y", 6), first);
}

TEST(Reset, PutsStatesBackInTheStepOfTheEdge) {
    Steps session(counter("    reset: rising\n", "u: s.reset", pulses));
    EXPECT_EQ(session.trace("s.y", 7), (Values{1, 1, 2, 3, 4, 1, 2}));
    Steps level(counter("    reset: level_hold\n", "u: s.reset", pulses));
    EXPECT_EQ(level.trace("s.y", 7), (Values{1, 1, 1, 2, 3, 1, 2}));
}

TEST(Reset, UnconnectedControlsSayWhatTheyMean) {
    EXPECT_EQ(
        message(counter("    reset: rising\n", "", pulses)),
        "m.yaml:6:3: s: the subsystem's input 'reset' is not connected; connect a signal to it; an edge puts "
        "states back to their initial values");
}

TEST(Merge, HasTheOutputOfTheSubsystemThatRanLast) {
    const auto branch = [](const std::string& name, const std::string& value) {
        return "  " + name +
               ":\n    execution: enabled\n    outputs: [y]\n    blocks: {c: {block: Constant, value: " +
               value + "}, g: {block: Gain}}\n    connections: {c: g, g: y}\n";
    };
    Steps session(
        "model: m\nstep: 1\nblocks:\n  u: {block: Sequence, values: [2, 1, 3, 1]}\n"
        "  case: {block: SwitchCase, cases: [1, 2]}\n" +
        branch("a", "10") + branch("b", "20") +
        "  merge: {block: Merge}\n  after: {block: Gain, K: 2}\n"
        "connections: {u: case, case.y1: a.enable, case.y2: b.enable, a: merge.u1, b: merge.u2, merge: "
        "after}\n");
    EXPECT_EQ(session.trace("after", 4), (Values{40, 20, 20, 20}));
}

TEST(If, EnablesTheFirstTrueCondition) {
    Steps session(
        "model: m\nstep: 1\nblocks:\n  u: {block: Sequence, values: [5, 2, -1]}\n"
        "  big: {block: CompareToConstant, operator: '>', constant: 3}\n"
        "  small: {block: CompareToConstant, operator: '>', constant: 0}\n"
        "  if: {block: If, conditions: 2}\nconnections: {u: [big, small], big: if.u1, small: if.u2}\n");
    for (const auto& expected : {Values{1, 0, 0}, Values{0, 1, 0}, Values{0, 0, 1}}) {
        session.trace("if.y1", 1);
        EXPECT_EQ((Values{session("if.y1"), session("if.y2"), session("if.y3")}), expected);
    }
}

TEST(Loops, ForRunsItsUpdatesInEveryIteration) {
    // The sum of 1..n, begun anew in each step.
    Steps session(
        "model: m\nstep: 1\nblocks:\n  u: {block: Sequence, values: [4, 0, 10]}\n  s:\n"
        "    execution: for\n    states: reset\n    outputs: [y]\n    blocks:\n      i: {block: Iteration}\n"
        "      sum: {block: Sum, signs: ++}\n      past: {block: UnitDelay}\n"
        "    connections: {i: sum.u1, past: sum.u2, sum: [past, y]}\n"
        "  after: {block: Gain, K: 1}\nconnections: {u: s.iterations, s: after}\n");
    EXPECT_EQ(session.trace("after", 3), (Values{10, 10, 55})); // without iterations the output stays
}

TEST(Loops, EachIterationLooksAtTriggersAnew) {
    // cos(pi i) rises in the iterations 2 and 4; what stands inside the triggered subsystem runs then only.
    Steps session(
        "model: m\nstep: 1\nblocks:\n  s:\n    execution: for\n    iterations: 4\n    outputs: [y]\n    "
        "blocks:\n"
        "      i: {block: Iteration}\n      phase: {block: Gain, K: pi}\n"
        "      cos: {block: Trigonometry, function: cos}\n      t:\n        execution: triggered\n"
        "        outputs: [y]\n        blocks:\n          on: {block: Constant, value: 1}\n          inner:\n"
        "            execution: enabled\n            outputs: [y]\n            blocks:\n"
        "              one: {block: Constant, value: 1}\n              sum: {block: Sum, signs: ++}\n"
        "              past: {block: UnitDelay}\n"
        "            connections: {one: sum.u1, past: sum.u2, sum: [past, y]}\n"
        "        connections: {on: inner.enable, inner: y}\n"
        "    connections: {i: phase, phase: cos, cos: t.trigger, t: y}\n");
    EXPECT_EQ(session.trace("s.y", 3), (Values{2, 4, 6}));
}

TEST(Triggered, ARelaySwitchesInEachOfSeveralRunsAtOneInstant) {
    // cos(pi i) rises in the iterations 2, 4 and 6, in which the relay is off, on, and as it was.
    Steps session(
        "model: m\nstep: 1\nblocks:\n  s:\n    execution: for\n    iterations: 6\n    outputs: [y]\n    "
        "blocks:\n"
        "      i: {block: Iteration}\n      phase: {block: Gain, K: pi}\n"
        "      cos: {block: Trigonometry, function: cos}\n"
        "      u: {block: Lookup1D, breakpoints: [2, 4, 6], table: [0, 3, 2]}\n"
        "      t:\n        execution: triggered\n        inputs: [u]\n        outputs: [y]\n"
        "        blocks:\n          relay: {block: Relay, on_point: 2.5, off_point: 1.5}\n"
        "          sum: {block: Sum, signs: ++}\n          past: {block: UnitDelay}\n"
        "        connections: {u: relay, relay: sum.u1, past: sum.u2, sum: [past, y]}\n"
        "    connections: {i: [phase, u], phase: cos, cos: t.trigger, u: t.u, t: y}\n");
    EXPECT_EQ(session.trace("s.y", 3), (Values{2, 4, 6}));
}

TEST(Loops, StatesGoOnFromStepToStepUnlessReset) {
    Steps session(
        "model: m\nstep: 1\nblocks:\n  s:\n    execution: for\n    iterations: 3\n    outputs: [y]\n"
        "    blocks:\n      one: {block: Constant, value: 1}\n      sum: {block: Sum, signs: ++}\n"
        "      past: {block: UnitDelay}\n    connections: {one: sum.u1, past: sum.u2, sum: [past, y]}\n");
    EXPECT_EQ(session.trace("s.y", 3), (Values{3, 6, 9}));
}

TEST(Loops, WithStatesThatGoOnRunOncePerStepOfTheSolver) {
    // A count of iterations, in the continuous rate: x' = 3 from 0 s, 6 from 1 s, 9 from 2 s on.
    for (const std::string solver : {"rk4", "dormand_prince45", "cvode_bdf"}) {
        Steps session("model: m\nstep: 1\nsolver: " + solver +
                      "\nblocks:\n  t: {block: Clock}\n  s:\n    execution: for\n    iterations: 3\n"
                      "    inputs: [u]\n    outputs: [y]\n    blocks:\n      none: {block: Gain, K: 0}\n"
                      "      one: {block: Constant, value: 1}\n      sum: {block: Sum, signs: +++}\n"
                      "      past: {block: UnitDelay}\n    connections: {u: none, none: sum.u3, one: sum.u1, "
                      "past: sum.u2, sum: [past, y]}\n"
                      "  x: {block: Integrator}\nconnections: {t: s.u, s: x}\n");
        EXPECT_EQ(session.trace("s.y", 3), (Values{3, 6, 9})) << solver;
        EXPECT_NEAR(session.simulation->context().continuous_state()[0], 18, 1e-4) << solver;
    }
}

TEST(Loops, WhileGoesOnUntilItsConditionIsFalse) {
    // Heron's method for the square root of 2: ends when two iterates differ by less than 1e-12.
    const std::string heron =
        "model: m\nstep: 1\nblocks:\n  s:\n    execution: while\n    states: reset\n    outputs: [y]\n    "
        "blocks:\n"
        "      x: {block: UnitDelay, initial: 1}\n      two: {block: Constant, value: 2}\n"
        "      q: {block: Product, operations: '*/'}\n      mean: {block: Sum, signs: ++}\n      half: "
        "{block: Gain, K: 0.5}\n"
        "      d: {block: Sum, signs: +-}\n      abs: {block: Abs}\n"
        "      more: {block: CompareToConstant, operator: '>', constant: 1e-12}\n      w: {block: While, "
        "most: MOST}\n"
        "    connections: {two: q.u1, x: [q.u2, mean.u1, d.u2], q: mean.u2, mean: half, half: [x, d.u1, y], "
        "d: abs, "
        "abs: more, more: w.condition}\n";
    const auto with = [&](const std::string& most) {
        auto text = heron;
        return text.replace(text.find("MOST"), 4, most);
    };
    Steps session(with("50"));
    session.trace("s.y", 2);
    EXPECT_DOUBLE_EQ(session("s.y"), std::sqrt(2.0));
    Steps short_one(with("2"));
    EXPECT_FALSE(short_one.simulation->step());
    EXPECT_EQ(short_one.simulation->failure(), "s.w: the while loop around it did not end within 2 "
                                               "iterations: look at the condition of its While, or "
                                               "let it allow more");
}

TEST(Loops, ForEachHasStatesForEachPart) {
    Steps session("model: m\nstep: 1\nblocks:\n  u: {block: Constant, value: [1, 2, 3, 4]}\n"
                  "  k: {block: Constant, value: 10}\n  s:\n    execution: for_each\n    iterations: 2\n"
                  "    inputs: {u: {each: true}, k: }\n    outputs: [y]\n    blocks:\n"
                  "      p: {block: Product, operations: '**'}\n      sum: {block: Sum, signs: ++}\n"
                  "      past: {block: UnitDelay}\n      g: {block: Gain, K: iteration}\n"
                  "    connections: {u: p.u1, k: p.u2, p: sum.u1, past: sum.u2, sum: [past, g], g: y}\n"
                  "connections: {u: s.u, k: s.k}\n");
    session.trace("s.y", 2);
    EXPECT_EQ(session.values("s.y"), (Values{20, 40, 120, 160}));
    EXPECT_EQ(session.values("s(2).past"), (Values{30, 40}));
}

TEST(Loops, ShowWhatRanInAnyOfTheirIterations) {
    Steps session(
        "model: m\nstep: 1\nblocks:\n  s:\n    execution: for\n    iterations: 3\n    outputs: [y]\n"
        "    blocks:\n      i: {block: Iteration}\n"
        "      two: {block: CompareToConstant, operator: '==', constant: 2}\n      t:\n"
        "        execution: triggered\n        inputs: [u]\n        outputs: [y]\n"
        "        blocks: {g: {block: Gain}}\n        connections: {u: g, g: y}\n"
        "    connections: {i: [two, t.u], two: t.trigger, t: y}\n");
    const auto end = session.diagram.find_signal("s.t.g");
    const int rate = session.diagram.nodes[static_cast<std::size_t>(end.node)].rate;
    EXPECT_TRUE(session.simulation->run_until([&](const Simulation& s) { return s.is_hit(rate); }, 1));
    EXPECT_EQ(session("s.y"), 2);
}

TEST(Variants, KeepOnlyWhatIsWanted) {
    const auto text = [](const std::string& mode) {
        return "model: m\nstep: 1\nvariables: {mode: " + mode +
               "}\nblocks:\n  u: {block: Constant, value: 3}\n"
               "  one: {block: Gain, K: 10, when: mode == 1}\n  two:\n    when: mode == 2\n    inputs: [u]\n"
               "    outputs: [y]\n    blocks: {g: {block: Gain, K: 100}}\n    connections: {u: g, g: y}\n"
               "  y: {block: Gain}\nconnections: {u: [one, two], one: y, two: y}\n";
    };
    EXPECT_EQ(Steps(text("1")).trace("y", 1), Values{30});
    EXPECT_EQ(Steps(text("2")).trace("y", 1), Values{300});
    EXPECT_EQ(message(text("3")), "m.yaml:13:3: y: input 'u' is not connected; connect a signal to it");
    const Steps recorded(text("1") + "record: [y, two.g, two.y, one]\n");
    EXPECT_EQ(recorded.simulation->diagram().recorded().size(), 2U) << "of what is left out nothing";
    EXPECT_NE(message(text("1") + "record: [twos.y]\n").find("there is no signal 'twos.y'"),
              std::string::npos);
}

TEST(Buses, GroupSignalsAndGiveThemBackByName) {
    Steps session(
        "model: m\nstep: 1\nblocks:\n  p: {block: Constant, value: [1, 2]}\n  v: {block: Constant, value: "
        "3}\n"
        "  t: {block: Constant, value: 7}\n  inner: {block: BusCreator, signals: [position, velocity]}\n"
        "  outer: {block: BusCreator, signals: [state, temperature]}\n"
        "  hot: {block: BusAssignment, signals: [temperature]}\n  new: {block: Constant, value: 99}\n"
        "  s:\n    inputs: [bus]\n    outputs: [y]\n"
        "    blocks: {take: {block: BusSelector, signals: [state.velocity]}, g: {block: Gain, K: 2}}\n"
        "    connections: {bus: take, take: g, g: y}\n"
        "  take: {block: BusSelector, signals: [state, temperature]}\n"
        "  deep: {block: BusSelector, signals: [position]}\n"
        "  a: {block: Gain}\n  b: {block: Gain}\n"
        "connections: {p: inner.position, v: inner.velocity, inner: outer.state, t: outer.temperature, "
        "outer: [s.bus, hot.bus], new: hot.temperature, hot: take, take.state: deep, deep: a, "
        "take.temperature: b}\n");
    session.trace("b", 1);
    EXPECT_EQ(session.values("s.y"), Values{6});
    EXPECT_EQ(session.values("a"), (Values{1, 2}));
    EXPECT_EQ(session.values("b"), Values{99});
}

/// A bus {in: {a: [1; 2], b: t}, v: t} and a BusAssignment of one of its signals to 5.
std::string assignment(const std::string& signal, const std::string& port) {
    return "model: m\nstep: 1\nblocks:\n  t: {block: Clock}\n  p: {block: Constant, value: [1, 2]}\n"
           "  five: {block: Constant, value: 5}\n  in: {block: BusCreator, signals: [a, b]}\n"
           "  bus: {block: BusCreator, signals: [in, v]}\n  new: {block: BusAssignment, signals: [" +
           signal +
           "]}\n  take: {block: BusSelector, signals: [in.a, in.b, v]}\n"
           "  a: {block: Gain}\n  b: {block: Gain}\n  v: {block: Gain}\n"
           "connections: {t: [in.b, bus.v], p: in.a, in: bus.in, bus: new.bus, five: new." +
           port + ", new: take, take.a: a, take.b: b, take.v: v}\n";
}

TEST(Buses, AssignmentsReachIntoABusWithinABus) {
    Steps session(assignment("in.b", "b"));
    EXPECT_EQ(session.trace("b", 2), (Values{5, 5}));
    EXPECT_EQ(session.values("a"), (Values{1, 2}));
    EXPECT_EQ(session("v"), 1);
}

TEST(Buses, LeaveSubsystemsThatDoNotAlwaysRun) {
    const auto model = [](const std::string& port) {
        return "model: m\nstep: 1\nblocks:\n  t: {block: Clock}\n"
               "  on: {block: IntervalTest, lower: 1, upper: 2}\n  s:\n    execution: enabled\n"
               "    inputs: [t]\n    outputs: {all: {" +
               port +
               "}}\n    blocks: {g: {block: Gain, K: 10}, two: {block: Gain, K: 2}, in: {block: BusCreator, "
               "signals: [two]}, bus: {block: BusCreator, signals: [ten, in]}}\n"
               "    connections: {t: [g, two], g: bus.ten, two: in.two, in: bus.in, bus: all}\n"
               "  take: {block: BusSelector, signals: [ten, in.two]}\n  a: {block: Gain}\n  b: {block: "
               "Gain}\n"
               "connections: {t: [on, s.t], on: s.enable, s: take, take.ten: a, take.two: b}\n"
               "record: [s.all.ten, s.all.in.two]\n";
    };
    Steps held(model(""));
    EXPECT_EQ(held.trace("a", 5), (Values{0, 10, 20, 20, 20}));
    Steps reset(model("initial: -1, when_disabled: reset"));
    EXPECT_EQ(reset.trace("b", 5), (Values{-1, 2, 4, -1, -1}));
    EXPECT_EQ(reset("s.all.in.two"), -1);
}

TEST(Buses, AreJoinedSignalBySignalWhereTheyLeaveForEach) {
    const std::string model =
        "model: m\nstep: 1\nblocks:\n  u: {block: Constant, value: [1, 2]}\n  s:\n    execution: for_each\n"
        "    iterations: 2\n    inputs: {u: {each: true}}\n    outputs: [all]\n    blocks: {ten: {block: "
        "Gain, K: "
        "10}, in: {block: BusCreator, signals: [u]}, bus: {block: BusCreator, signals: [ten, in]}}\n"
        "    connections: {u: [ten, in.u], ten: bus.ten, in: bus.in, bus: all}\n"
        "  take: {block: BusSelector, signals: [ten, in.u]}\n  a: {block: Gain}\n  b: {block: Gain}\n"
        "connections: {u: s.u, s: ";
    Steps session(model + "take, take.ten: a, take.u: b}\nrecord: [s.all.ten]\n");
    session.trace("a", 1);
    EXPECT_EQ(session.values("a"), (Values{10, 20}));
    EXPECT_EQ(session.values("b"), (Values{1, 2}));
    EXPECT_EQ(session.values("s.all.ten"), (Values{10, 20}));
    EXPECT_EQ(message(model + "[take, a], take.ten: b}\n"),
              "m.yaml:11:61: s(1): 'bus' is a bus of ten, in; take a signal out of it with a BusSelector");
}

TEST(Buses, AreMergedSignalBySignal) {
    const auto branch = [](const std::string& name, const std::string& K) {
        return "  " + name +
               ":\n    execution: enabled\n    inputs: [t]\n    outputs: [all]\n    blocks: {g: {block: "
               "Gain, K: " +
               K +
               "}, in: {block: BusCreator, signals: [t]}, bus: {block: BusCreator, signals: [g, in]}}\n"
               "    connections: {t: [g, in.t], g: bus.g, in: bus.in, bus: all}\n";
    };
    const std::string model =
        "model: m\nstep: 1\nblocks:\n  t: {block: Clock}\n  if: {block: If}\n"
        "  late: {block: CompareToConstant, operator: '>', constant: 1}\n" +
        branch("ten", "10") + branch("two", "2") +
        "  m: {block: Merge}\n  take: {block: BusSelector, signals: [g, in.t]}\n"
        "  a: {block: Gain}\n  b: {block: Gain}\n"
        "connections: {t: [late, ten.t, two.t], late: if.u1, if.y1: ten.enable, if.y2: two.enable,\n"
        "  ten: m.u1, two: m.u2, take.g: a, m: ";
    Steps session(model + "take, take.t: b}\nrecord: [m.g, m.in.t]\n");
    EXPECT_EQ(session.trace("a", 4), (Values{0, 2, 20, 30}));
    EXPECT_EQ(session("b"), 3);
    EXPECT_EQ(session("m.in.t"), 3);
    std::string wider = model;
    const std::string two = "[g, in]}}", more = "[g, in, g2]}, g2: {block: Clock}}";
    wider.replace(wider.rfind(two), two.size(), more).replace(wider.rfind("g: bus.g"), 0, "g2: bus.g2, ");
    EXPECT_TRUE(message(wider + "take, take.t: b}\n")
                    .find("m: the bus of input 2 has a signal 'g2', that of the first has none; merge buses "
                          "of the same signals") != std::string::npos)
        << message(wider + "take, take.t: b}\n");
    EXPECT_TRUE(message(model + "[take, b]}\n")
                    .find("'m' is a bus of g, in.t; take a signal out of it with a BusSelector") !=
                std::string::npos);
}

TEST(Buses, MistakesNameTheBusAndItsSignals) {
    const std::string begin = "model: m\nstep: 1\nblocks:\n  p: {block: Constant, value: 1}\n"
                              "  bus: {block: BusCreator, signals: [position]}\n  g: {block: Gain}\n";
    EXPECT_EQ(message(begin + "connections: {p: bus.position, bus: g}\n"),
              "m.yaml:7:32: 'bus' is a bus of position; take a signal out of it with a BusSelector");
    EXPECT_EQ(
        message(begin + "  s: {block: BusSelector, signals: [positon]}\n"
                        "connections: {p: bus.position, bus: s, s: g}\n"),
        "m.yaml:5:3: bus: the bus has no signal 'positon'; did you mean 'position'?; its signals: position");
    EXPECT_EQ(message(begin + "  s: {block: BusSelector, signals: [position]}\n"
                              "connections: {p: [bus.position, s], s: g}\n"),
              "m.yaml:8:15: 'p' is no bus, so it has no signal 'position'; connect a BusCreator");
    EXPECT_EQ(message(assignment("in.bb", "bb")), "m.yaml:9:3: new: the bus has no signal 'in.bb'; did you "
                                                  "mean 'in.b'?; its signals: in.a, in.b, v");
    EXPECT_EQ(message(begin + "  s: {block: BusSelector, signals: [one.x, two.x]}\nconnections: {p: g}\n"),
              "m.yaml:7:3: s: 'signals' has two that are called 'x'; put one into another BusSelector");
}

TEST(AlgebraicLoops, AreSolvedWhereTheModelAsksForIt) {
    // y = cos(k y), z = u - z/2: two loops, the second behind the first.
    const std::string text =
        "model: m\nstep: 1\nblocks:\n  c: {block: Trigonometry, function: cos}\n"
        "  z: {block: Sum, signs: +-}\n  h: {block: Gain, K: 0.5}\n  after: {block: Gain, K: 3}\n"
        "connections: {c: [c, z.u1], z: [h, after], h: z.u2}\n";
    EXPECT_NE(message(text).find("algebraic loop: c.y -> c.u"), std::string::npos) << message(text);
    Steps session("algebraic_loops: solve\n" + text);
    session.trace("after", 2);
    EXPECT_NEAR(session("c"), 0.7390851332151607, 1e-10); // the Dottie number
    EXPECT_NEAR(session("after"), 0.7390851332151607 * 2, 1e-10);
}

TEST(AlgebraicLoops, AreSolvedHoweverFarTheirSolutionIs) {
    for (const char* c : {"20", "-50", "1e6", "-1e12", "1e30"}) {
        Steps session(std::string("model: m\nstep: 1\nalgebraic_loops: solve\nblocks:\n"
                                  "  c: {block: Constant, value: ") +
                      c +
                      "}\n  a: {block: Sum, signs: +-}\n  h: {block: Gain, K: 0.5}\n"
                      "connections: {c: a.u1, a: h, h: a.u2}\n");
        session.trace("a", 2);
        EXPECT_NEAR(session("a"), std::stod(c) / 1.5, 1e-10 * std::abs(std::stod(c)));
    }
}

TEST(AlgebraicLoops, RunAllRulesOfAnOutputThatIsMadeInPlace) {
    // y[k] = y[k-1] + T (e[k-1] + e[k]) with e = u - y and T = 0.1: the bilinear transform of 2 e/s.
    Steps session(
        "model: m\nstep: 0.1\nalgebraic_loops: solve\nblocks:\n  u: {block: Constant, value: 0.01}\n"
        "  e: {block: Sum, signs: +-}\n  g: {block: Gain, K: 2}\n"
        "  b: {block: DiscreteIntegrator, method: trapezoidal}\n"
        "connections: {u: e.u1, e: g, g: b, b: e.u2}\n");
    double before = 0, y = 0;
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(session.simulation->step());
        y = (y + 0.1 * (before + 0.01)) / 1.1;
        before = 0.01 - y;
        EXPECT_NEAR(session("b"), y, 1e-12) << k;
    }
}

TEST(AlgebraicLoops, WithoutASolutionEndTheRunByName) {
    // y = y^2 + 1 has no real solution.
    Steps session("model: m\nstep: 1\nalgebraic_loops: solve\nblocks:\n  one: {block: Constant, value: 1}\n"
                  "  s: {block: Sum, signs: ++}\n  p: {block: Product, operations: '**'}\n"
                  "connections: {one: s.u1, s: [p.u1, p.u2], p: s.u2}\n");
    EXPECT_FALSE(session.simulation->step());
    EXPECT_EQ(session.simulation->failure().substr(0, 77),
              "s: the algebraic loop through it has no solution that Newton's method finds (");
}
