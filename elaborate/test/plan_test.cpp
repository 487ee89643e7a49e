// Claims about the plan: what is called, how often, and what stands together.
#include "support.hpp"

#include "bf/kernels/elementwise.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

/// "[condition] a b#1 ?c {loop}" for each segment: a block's activity #1 is its second one, ?c the test of a
/// condition.
std::string text_of(const Diagram& d, const std::vector<Segment>& segments) {
    std::string text;
    for (const auto& segment : segments) {
        text += text.empty() ? "" : "\n";
        text += "[" + d.conditions[static_cast<std::size_t>(segment.condition)].path + "]";
        for (const auto& a : segment.activities)
            text += a.node >= 0 ? " " + d.nodes[static_cast<std::size_t>(a.node)].path +
                                      (a.index > 0 ? "#" + std::to_string(a.index) : "")
                    : a.loop >= 0 ? " {" + d.plan.loops[static_cast<std::size_t>(a.loop)].path + "}"
                                  : " ?" + d.conditions[static_cast<std::size_t>(a.condition)].path;
    }
    return text;
}

TEST(Plan, HasEveryRuleAndMethodOnceInItsPhase) {
    const auto m = elaborate_text(R"(model: m
step: 0.1
blocks:
  x: {block: LimitedIntegrator}
  u: {block: Sine}
  d: {block: UnitDelay, period: 0.2}
  slow: {block: UnitDelay, period: 0.2}
  pid: {block: DiscretePID, period: 0.1}
connections: {u: x, x: [d, pid], d: slow}
)");
    const Plan& plan = m.diagram.plan;
    const auto rules = [&](const char* path) -> const Declaration& {
        return m.node(path).block->declaration();
    };
    EXPECT_EQ(text_of(m.diagram, plan.derivatives), "[] x");
    std::string guards = "[] x";
    for (std::size_t i = 1; i < rules("x").guard_rules.size(); ++i) guards += " x#" + std::to_string(i);
    EXPECT_EQ(text_of(m.diagram, plan.guards), guards);
    std::string pid = "[] pid";
    for (std::size_t i = 1; i < rules("pid").update_rules.size(); ++i) pid += " pid#" + std::to_string(i);
    EXPECT_EQ(text_of(m.diagram, plan.updates), "[] x\n[] d slow\n" + pid)
        << "in document order, together what has one rate";
    ASSERT_EQ(rules("x").output_rules.size(), 2u);
    ASSERT_EQ(rules("pid").output_rules.size(), 3u);
    EXPECT_EQ(text_of(m.diagram, plan.outputs), "[] x x#1 u\n[] d slow\n[] pid pid#1 pid#2");
}

TEST(Plan, RunsWhatIsReadyAsLongAsASegmentGoesOn) {
    // b is of another rate and comes first in the document: a and c stand together nevertheless.
    const auto m = elaborate_text("model: m\nstep: 0.1\nblocks:\n  a: {block: Clock}\n"
                                  "  b: {block: Clock, period: 0.2}\n  c: {block: Clock}\n"
                                  "  e: {block: Gain, period: 0.2}\n  f: {block: Gain}\n"
                                  "connections: {a: e, c: f}\n");
    EXPECT_EQ(text_of(m.diagram, m.diagram.plan.outputs), "[] a c f\n[] b e");
}

TEST(Plan, LooksAtConditionsBeforeWhatTheyDecideAbout) {
    const auto m = elaborate_text(R"(model: m
step: 0.1
blocks:
  end: {block: Gain}
  merge: {block: Merge}
  a:
    execution: enabled
    outputs: [y]
    blocks: {t: {block: Clock}, g: {block: Gain}}
    connections: {t: g, g: y}
  b:
    execution: enabled
    outputs: [y]
    blocks:
      inner: {execution: enabled, outputs: [y], blocks: {t: {block: Clock}}, connections: {t: y}}
      on: {block: Clock}
    connections: {inner: y, on: inner.enable}
  one: {block: Clock}
  two: {block: Clock}
connections: {two: a.enable, one: b.enable, a: merge.u1, b: merge.u2, merge: end}
)");
    EXPECT_EQ(text_of(m.diagram, m.diagram.plan.outputs),
              "[] one two ?a ?b\n[a] a.t a.g a.y merge\n[b] b.on ?b.inner\n"
              "[b.inner] b.inner.t b.inner.y\n[b] b.y merge#1\n[] end");
}

/// y[i] = v where its input is read by one output alone, which it says itself.
struct Selective final : Block {
    using Block::Block;
    Input<double> u{this, "u"};
    Output<double> old{this, "old"}, now{this, "now"};
    bool feedthrough(int output, int) const override { return output == now.index(); }
    Status output(Now, Out) const noexcept override { return ok; }
};
struct Never final : Block {
    using Block::Block;
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    bool feedthrough(int, int) const override { return false; }
    Status output(Now, Out) const noexcept override { return ok; }
};
/// An output that is taken back by a later rule, of which it is one that completes it.
struct Twice final : Block {
    using Block::Block;
    Input<double> u{this, "u"}, v{this, "v"};
    Output<double> y{this, "y"};
    Workspace<double> w{this, "w"};
    OutputRule first{this, kernels::Copy{}, y, u};
    OutputRule second{this, kernels::Copy{}, w, v};
    OutputRule third{this, kernels::Add{}, y, y, w};
};

const Library& selective() {
    static const Library made = [] {
        Library l("");
        l.group("test").add<Selective>("Selective", "").add<Never>("Never", "").add<Twice>("Twice", "");
        return l;
    }();
    return made;
}

TEST(Plan, AMethodThatReadsAnInputForOneOutputComesAfterIt) {
    const auto m =
        elaborate_text("model: m\nstep: 0.1\nblocks:\n  s: {block: Selective}\n  n: {block: Never}\n"
                       "  t: {block: Clock}\nconnections: {t: s, s.now: n}\n",
                       {}, &selective());
    EXPECT_EQ(m.order(), (std::vector<std::string>{"n", "t", "s"}));
    EXPECT_EQ(
        errors_of("model: m\nstep: 0.1\nblocks:\n  s: {block: Selective}\nconnections: {s.old: s}\n", {},
                  &selective()),
        "m.yaml:4:3: s: algebraic loop: s.old -> s.u; break it with a block whose output does not depend "
        "on its input in the same step, e.g. a UnitDelay on one of these wires");
    EXPECT_EQ(errors_of("model: m\nstep: 0.1\nblocks:\n  n: {block: Never}\nconnections: {n: n}\n", {},
                        &selective()),
              "");
}

TEST(Plan, AReaderWaitsForTheRuleThatCompletesAnOutput) {
    const auto m = elaborate_text("model: m\nstep: 0.1\nblocks:\n  end: {block: Gain}\n  a: {block: Twice}\n"
                                  "  t: {block: Clock}\nconnections: {t: [a.u, a.v], a: end}\n",
                                  {}, &selective());
    EXPECT_EQ(text_of(m.diagram, m.diagram.plan.outputs), "[] t a a#1 a#2 end");
}

TEST(Plan, SolvesEachAlgebraicLoopWhereItsInputsAreThere) {
    const auto m = elaborate_text(R"(model: m
step: 0.1
algebraic_loops: solve
inputs: [u]
blocks:
  end: {block: Gain}
  c: {block: Sum, signs: "+-"}
  d: {block: Gain, K: 0.25}
  a: {block: Sum, signs: "+-"}
  b: {block: Gain, K: 0.5}
  e: {block: Gain}
connections: {u: a.u1, a: b, b: [a.u2, c.u1], c: d, d: [e, end], e: c.u2}
)");
    const Plan& plan = m.diagram.plan;
    ASSERT_EQ(plan.loops.size(), 2u);
    EXPECT_EQ(text_of(m.diagram, plan.outputs), "[] {a} {c} end");
    EXPECT_EQ(plan.loops[0].path, "a");
    EXPECT_EQ(text_of(m.diagram, plan.loops[0].outputs), "[] a b");
    EXPECT_EQ(text_of(m.diagram, plan.loops[1].outputs), "[] c d e");
    const auto unknowns = [&](std::size_t loop) {
        std::vector<std::string> paths;
        for (const auto& end : plan.loops[loop].unknowns) paths.push_back(m.diagram.end_path(end));
        return paths;
    };
    EXPECT_EQ(unknowns(0), std::vector<std::string>{"b.y"}) << "what is read before it is written";
    EXPECT_EQ(unknowns(1), std::vector<std::string>{"e.y"});
    for (const auto& loop : plan.loops) EXPECT_EQ(loop.kind, Loop::Kind::algebraic);
}

TEST(Plan, DoesNotSolveLoopsOfSeveralRatesOrOfWholeNumbers) {
    const std::string
        loop = "  a: {block: Sum, signs: \"+-\"}\n  b: {block: Gain, K: 0.5}\n"
               "connections: {u: a.u1, a: b, b: a.u2}\n",
        text = "model: m\nstep: 0.1\nalgebraic_loops: solve\nblocks:\n",
        said =
            ": algebraic loop: a.y -> b.u, b.y -> a.u2 (not solved: that needs blocks of one rate, under one "
            "condition, with outputs of type double); break it with a block whose output does not depend "
            "on its input in the same step, e.g. a UnitDelay on one of these wires";
    EXPECT_EQ(errors_of(text + "  u: {block: Clock}\n" + loop), "");
    std::string slow = loop;
    slow.replace(slow.find("K: 0.5"), 6, "period: 0.2");
    EXPECT_EQ(errors_of(text + "  u: {block: Clock}\n" + slow), "m.yaml:6:3: a" + said);
    std::string whole = loop;
    whole.replace(whole.find("K: 0.5"), 6, "K: 2");
    whole.insert(whole.find("{u:") + 1, "t: u, ");
    EXPECT_EQ(errors_of(text + "  t: {block: Clock}\n  u: {block: Convert, type: int8}\n" + whole),
              "m.yaml:7:3: a" + said);
}

TEST(Plan, PutsTheBodyOfALoopInOrderAndRunsItAsAWhole) {
    const auto m = elaborate_text(R"(model: m
step: 0.1
blocks:
  end: {block: Gain}
  s:
    execution: for
    iterations: 3
    inputs: [u]
    outputs: [y]
    blocks:
      second: {block: Gain}
      first: {block: Gain}
      past: {block: UnitDelay}
      two: {block: Constant, value: 2}
      twice: {block: Product}
    connections: {u: first, first: second, second: [past, twice.u1], two: twice.u2, twice: y}
  t: {block: Clock}
connections: {t: s, s: end}
)");
    const Plan& plan = m.diagram.plan;
    ASSERT_EQ(plan.loops.size(), 1u);
    EXPECT_EQ(text_of(m.diagram, plan.outputs), "[] s.two\n[] t {s} end") << "what is constant runs before";
    EXPECT_EQ(text_of(m.diagram, plan.loops[0].outputs), "[] s.first s.second s.past s.twice");
    EXPECT_EQ(text_of(m.diagram, plan.loops[0].updates), "[] s.past");
    EXPECT_EQ(text_of(m.diagram, plan.updates), "");
    EXPECT_EQ(plan.loops[0].iterations, 3);
    EXPECT_FALSE(plan.loops[0].resets_states);
}

TEST(NeededInsideAStep, IsWhatDerivativesGuardsAndConditionsDependOn) {
    const std::string text = R"(blocks:
  u: {block: Sine}
  slope: {block: Gain}
  x: {block: Integrator}
  shown: {block: Gain}
  sign: {block: Sign}
  decides: {block: Gain}
  before: {block: Gain}
  sampled: {block: Gain, period: 0.2}
  sum: {block: Sum}
  part:
    execution: enabled
    inputs: [u]
    blocks: {g: {block: Gain}, end: {block: Terminator}}
    connections: {u: g, g: end}
connections: {u: slope, slope: sum.u1, sum: x, x: [shown, sign, decides, before, part.u], decides: part.enable,
  before: sampled, sampled: sum.u2}
)";
    const auto needed = [&](const std::string& solver) {
        const auto m = elaborate_text("model: m\nstep: 0.1\nsolver: " + solver + "\n" + text);
        const auto is_needed = m.diagram.needed_inside_a_step();
        std::string paths;
        for (std::size_t n = 0; n < is_needed.size(); ++n)
            if (is_needed[n]) paths += (paths.empty() ? "" : " ") + m.diagram.nodes[n].path;
        return paths;
    };
    EXPECT_EQ(needed("rk4"), "u slope x decides sampled sum part.g part.end");
    EXPECT_EQ(needed("dormand_prince45"), "u slope x sign decides sampled sum part.g part.end");
}

// ---- rates

std::string rate_of(const Elaborated& m, int rate) {
    const SampleRate& r = m.diagram.rates[static_cast<std::size_t>(rate)];
    return r.trigger > 0 ? "trigger" : std::to_string(r.ticks) + "+" + std::to_string(r.offset);
}

TEST(Rates, OfAnEnabledSubsystemsTestAreTheFastestInside) {
    const auto m =
        elaborate_text("model: m\nstep: 0.1\nblocks:\n  on: {block: Clock, period: 0.4}\n  s:\n"
                       "    execution: enabled\n    blocks:\n      a: {block: Clock, period: 0.6}\n"
                       "      b: {block: Clock, period: 0.4}\nconnections: {on: s.enable}\n");
    EXPECT_EQ(rate_of(m, m.diagram.conditions[1].rate), "2+0") << "hit wherever one of 0.4 s and 0.6 s is";
}

TEST(Rates, OfTheFirstBlockOfADocumentAreInheritedAsOthers) {
    const auto m = elaborate_text("model: m\nstep: 0.1\nblocks:\n  first: {block: Gain}\n"
                                  "  t: {block: Clock, period: 0.3, offset: 0.1}\nconnections: {t: first}\n");
    EXPECT_EQ(rate_of(m, m.node("first").rate), "3+1");
}

TEST(Rates, ThatDoNotNestMeetInTheGreatestCommonDivisorOfPeriodsAndOffsets) {
    const auto common = [](const std::string& a, const std::string& b) {
        const auto m = elaborate_text("model: m\nstep: 0.1\nblocks:\n  a: {block: Clock, " + a +
                                      "}\n  b: {block: Clock, " + b +
                                      "}\n  s: {block: Sum}\nconnections: {a: s.u1, b: s.u2}\n");
        return rate_of(m, m.node("s").rate);
    };
    EXPECT_EQ(common("period: 0.4", "period: 0.6"), "2+0");
    EXPECT_EQ(common("period: 0.4, offset: 0.3", "period: 0.4, offset: 0.1"), "2+1");
    EXPECT_EQ(common("period: 0.4, offset: 0.1", "period: 0.8, offset: 0.5"), "4+1");
    EXPECT_EQ(common("period: 0.4, offset: 0.1", "period: 0.4"), "1+0");
}

TEST(Rates, OfWhatReadsATriggeredSubsystemAreThoseOfTheTriggerWhereverThatStands) {
    for (const bool is_first : {true, false}) {
        const std::string fire = "  fire: {block: Pulse, cycle: 1, period: 0.2}\n";
        const auto m = elaborate_text("model: m\nstep: 0.1\nblocks:\n" + (is_first ? fire : "") +
                                      "  s:\n    execution: triggered\n    outputs: [y]\n"
                                      "    blocks: {t: {block: Clock}}\n    connections: {t: y}\n"
                                      "  after: {block: Gain}\n" +
                                      (is_first ? "" : fire) + "connections: {fire: s.trigger, s: after}\n");
        EXPECT_EQ(rate_of(m, m.node("after").rate), "2+0") << is_first;
        EXPECT_EQ(rate_of(m, m.diagram.conditions[1].rate), "2+0") << is_first;
        EXPECT_EQ(rate_of(m, m.diagram.conditions[1].triggered_rate), "trigger") << is_first;
    }
}

// ---- the document's words

TEST(Diagram, KeepsTheSettingsAndTheBlocksOfTheModel) {
    const auto m = elaborate_text("model: pendulum\nstep: 0.25\nstop: 8\nsolver: heun\nnon_finite: error\n"
                                  "algebraic_loops: solve\nrelative_tolerance: 1e-3\n"
                                  "absolute_tolerance: 1e-4\nblocks:\n"
                                  "  s: {doc: around, blocks: {g: {block: Constant, value: 2}}}\n"
                                  "  t: {block: Clock, doc: time}\n");
    const Diagram& d = m.diagram;
    EXPECT_EQ(d.name, "pendulum");
    EXPECT_EQ(d.step, 0.25);
    EXPECT_EQ(d.stop, 8);
    EXPECT_EQ(d.solver.method, SolverMethod::heun);
    EXPECT_EQ(d.solver.relative_tolerance, 1e-3);
    EXPECT_EQ(d.solver.absolute_tolerance, 1e-4);
    EXPECT_EQ(d.solver.max_step, 8 / 50.0);
    EXPECT_TRUE(d.refuses_non_finite && d.solves_algebraic_loops);
    const DiagramNode& g = m.node("s.g");
    EXPECT_EQ(g.type, "Constant");
    EXPECT_EQ(g.doc, "around") << "of the nearest subsystem";
    EXPECT_EQ(g.where.line, 10);
    EXPECT_EQ(m.node("t").doc, "time");
    const auto plain = elaborate_text("model: m\nstep: 1\nblocks: {t: {block: Clock}}\n");
    EXPECT_FALSE(plain.diagram.refuses_non_finite || plain.diagram.solves_algebraic_loops);
    EXPECT_EQ(plain.diagram.solver.method, SolverMethod::rk4);
    EXPECT_TRUE(std::isinf(plain.diagram.stop) && std::isinf(plain.diagram.solver.max_step));
}

TEST(Diagram, APathOfASubsystemMeansItsOnlyOutputAlsoBesideNamedSignals) {
    const auto m = elaborate_text(R"(model: m
step: 1
blocks:
  one:
    outputs: [y]
    signals: {half: g}
    blocks: {t: {block: Clock}, g: {block: Gain, K: 0.5}}
    connections: {t: [y, g]}
  two:
    outputs: [y, z]
    signals: {half: g}
    blocks: {t: {block: Clock}, g: {block: Gain, K: 0.5}}
    connections: {t: [y, g], g: z}
)");
    const auto& d = m.diagram;
    EXPECT_EQ(d.end_path(d.find_signal("one")), "one.t.y");
    EXPECT_EQ(d.end_path(d.find_signal("one.half")), "one.g.y");
    EXPECT_EQ(d.find_signal("two").node, -1);
}

TEST(Diagram, FindsNoNodeOfAnotherName) {
    const auto m = elaborate_text("model: m\nstep: 1\nblocks: {t: {block: Clock}, g: {block: Gain}}\n"
                                  "connections: {t: g}\n");
    EXPECT_EQ(m.diagram.find_node("g"), 1);
    EXPECT_EQ(m.diagram.find_node("h"), -1);
    EXPECT_EQ(m.diagram.find_node(""), -1);
}

TEST(Ports, HaveTheLengthOrTheRowsAndColumnsThatTheirShapeSays) {
    const auto with_shape = [](const std::string& shape, const std::string& value) {
        return "model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: \"" + value +
               "\"}\n  s:\n    inputs: {u: {shape: \"" + shape + "\"}}\n    blocks: {g: {block: Gain}}\n" +
               "    connections: {u: g}\nconnections: {c: s.u}\n";
    };
    for (const auto& [shape, value, size] : {std::tuple("1", "7", "scalar"),
                                             {"3", "[1 2 3]", "[3]"},
                                             {"[2 3]", "[1 2 3; 4 5 6]", "2x3"},
                                             {"[1 1]", "eye(1)", "1x1"}})
        EXPECT_EQ(errors_of(with_shape(shape, value)), "") << shape;
    for (const char* shape : {"0", "-1", "1.5", "1e7", "[2 0]", "[0 2]", "[2 3 4]", "[]"}) {
        const std::string said = errors_of(with_shape(shape, "1"));
        EXPECT_NE(said.find("'shape' is "), std::string::npos) << shape << ": " << said;
        EXPECT_NE(said.find("; give the length of a 1-D signal, or [rows columns] of a matrix"),
                  std::string::npos)
            << shape << ": " << said;
    }
}

TEST(Loops, HaveAWholeNumberOfIterations) {
    const auto with = [](const std::string& iterations) {
        return "model: m\nstep: 1\nblocks:\n  s:\n    execution: for\n    iterations: \"" + iterations +
               "\"\n    blocks: {t: {block: Clock}}\n";
    };
    for (const char* right : {"1", "2", "100000"}) EXPECT_EQ(errors_of(with(right)), "") << right;
    for (const char* wrong : {"0", "-1", "2.5", "100001"})
        EXPECT_EQ(errors_of(with(wrong)), "m.yaml:6:17: s: 'iterations' is " + std::string(wrong) +
                                              "; give a whole number from 1 to 100000")
            << wrong;
}

TEST(Variants, AreKeptWhereTheirConditionIsNotZero) {
    for (const auto& [when, is_kept] : {std::pair("true", true),
                                        {"false", false},
                                        {"0", false},
                                        {"1", true},
                                        {"2", true},
                                        {"-0.5", true},
                                        {"n == 3", true},
                                        {"n == 4", false}}) {
        const auto m = elaborate_text("model: m\nstep: 1\nvariables: {n: 3}\nblocks:\n  t: {block: Clock}\n"
                                      "  v: {block: Clock, when: \"" +
                                      std::string(when) + "\"}\n");
        EXPECT_EQ(m.diagram.find_node("v") >= 0, is_kept) << when;
        EXPECT_GE(m.diagram.find_node("t"), 0);
    }
}

TEST(Merge, TakesOverAtTheRateOfEachInput) {
    const auto m = elaborate_text(R"(model: m
step: 0.1
blocks:
  first: {block: Clock, period: 0.2}
  a:
    execution: enabled
    outputs: [y]
    blocks: {t: {block: Clock}}
    connections: {t: y}
  merge: {block: Merge}
  on: {block: Clock}
connections: {on: a.enable, first: merge.u1, a: merge.u2}
)");
    EXPECT_EQ(text_of(m.diagram, m.diagram.plan.outputs), "[] first merge\n[] on ?a\n[a] a.t a.y merge#1");
}

TEST(Definitions, NameVariablesThatNoParameterOfAFunctionHides) {
    const auto m = elaborate_text("model: m\nstep: 0.1\nvariables: {k: 2, a: 3}\nblocks:\n"
                                  "  c: {block: Constant, value: \"arrayfun(@(k) k + a, [1 2])\"}\n");
    EXPECT_EQ(m.slot("c", "value").initial, (std::vector<double>{4, 5}));
    bool is_seen = false;
    for (const auto& definition : m.diagram.definitions) {
        if (definition.path != "c.value") continue;
        is_seen = true;
        ASSERT_EQ(definition.uses.size(), 1u);
        EXPECT_EQ(definition.uses[0].first, "a");
    }
    EXPECT_TRUE(is_seen);
}

} // namespace
} // namespace bf::test
