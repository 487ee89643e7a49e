#include "support.hpp"

#include <algorithm>
#include <gtest/gtest.h>

namespace bf::test {
namespace {

TEST(Rates, ASlowBlockReadsTheSampleOfItsHitAndHoldsItsOutput) {
    Session run(R"m(
model: m
step: 0.001
blocks:
  plant: {block: Counter}
  on: {block: Constant, value: true}
  controller: {block: Gain, K: 10, period: 0.01}
  late: {block: Gain, K: 10, period: 0.01, offset: 0.003}
connections:
  on: plant.u
  plant: [controller, late]
)m");
    Values fast, slow, late;
    for (int k = 0; k < 25; ++k) {
        fast.push_back(run.trace("plant", 1)[0]);
        slow.push_back(run("controller"));
        late.push_back(run("late"));
    }
    for (int k = 0; k < 25; ++k) {
        const auto i = static_cast<std::size_t>(k);
        EXPECT_EQ(fast[i], k + 1);
        EXPECT_EQ(slow[i], 10 * (k / 10 * 10 + 1)) << k;
        EXPECT_EQ(late[i], k < 3 ? 0 : 10 * ((k - 3) / 10 * 10 + 4)) << k;
    }
}

TEST(Rates, ASlowStateChangesOnlyAtItsHits) {
    Session run(R"m(
model: m
step: 1
blocks:
  t: {block: Clock}
  slow: {block: UnitDelay, initial: -1, period: 3}
connections: {t: slow}
)m");
    EXPECT_EQ(run.trace("slow", 8), (Values{-1, -1, -1, 0, 0, 0, 3, 3}));
}

TEST(Rates, PeriodOfABlockIsItsOwn) {
    Session run(R"m(
model: m
step: 0.5
blocks:
  one: {block: Constant, value: 1}
  i: {block: DiscreteIntegrator, period: 2}
connections: {one: i}
)m");
    EXPECT_EQ(run.trace("i", 9), (Values{0, 0, 0, 0, 2, 2, 2, 2, 4}));
}

TEST(Rates, BlocksInheritTheFastestRateTheyRead) {
    Session run(R"m(
model: m
blocks:
  slow: {block: Clock, period: 0.4}
  fast: {block: Clock, period: 0.2}
  other: {block: Clock, period: 0.3}
  a: {block: Gain}
  b: {block: Sum}
  c: {block: Sum}
  one: {block: Constant}
  d: {block: Sum}
connections:
  slow: [a, b.u1, c.u1, d.u1]
  fast: b.u2
  other: c.u2
  one: d.u2
)m");
    EXPECT_EQ(run.diagram.step, 0.1);
    const auto ticks = [&](const char* path) {
        const auto& node = run.diagram.nodes[static_cast<std::size_t>(run.diagram.find_node(path))];
        return run.diagram.rates[static_cast<std::size_t>(node.rate)].ticks;
    };
    EXPECT_EQ(ticks("a"), 4);
    EXPECT_EQ(ticks("b"), 2);
    EXPECT_EQ(ticks("c"), 1); // rates that do not nest meet in the base rate
    EXPECT_EQ(ticks("d"), 4); // a constant does not count
}

/// The rate of a block, in steps.
SampleRate rate_of(const Session& run, const char* path) {
    const auto& node = run.diagram.nodes[static_cast<std::size_t>(run.diagram.find_node(path))];
    return run.diagram.rates[static_cast<std::size_t>(node.rate)];
}

TEST(Rates, ThatDoNotNestMeetInTheirGreatestCommonDivisor) {
    Session run("model: m\nstep: 0.1\nblocks:\n  four: {block: Clock, period: 0.4}\n"
                "  six: {block: Clock, period: 0.6}\n  late: {block: Clock, period: 0.6, offset: 0.3}\n"
                "  odd: {block: Clock, period: 0.6, offset: 0.5}\n  a: {block: Sum}\n  b: {block: Sum}\n"
                "  c: {block: Sum}\n"
                "connections: {four: a.u1, six: [a.u2, b.u1], late: [b.u2, c.u1], odd: c.u2}\n");
    EXPECT_EQ(rate_of(run, "a"), (SampleRate{2, 0}));
    EXPECT_EQ(rate_of(run, "b"), (SampleRate{3, 0}));
    EXPECT_EQ(rate_of(run, "c"), (SampleRate{2, 1})); // 3, 9, 15, ... and 5, 11, 17, ...
}

TEST(Rates, AreTheSameWhateverTheOrderOfInputsAndBlocks) {
    std::vector<std::string> inputs{"u1", "u2", "u3"};
    do {
        std::vector<std::string> loop{"  x: {block: Sum}\n", "  y: {block: Sum}\n",
                                      "  z: {block: UnitDelay}\n"};
        do {
            Session run("model: m\nstep: 0.1\nblocks:\n" + loop[0] + loop[1] + loop[2] +
                        "  two: {block: Clock, period: 0.2}\n  four: {block: Clock, period: 0.4}\n"
                        "  six: {block: Clock, period: 0.6}\n  sum: {block: Sum, signs: +++}\n"
                        "connections:\n  two: sum." +
                        inputs[0] + "\n  four: [x.u1, sum." + inputs[1] + "]\n  six: [y.u1, sum." +
                        inputs[2] + "]\n  x: y.u2\n  y: z\n  z: x.u2\n");
            EXPECT_EQ(rate_of(run, "sum"), (SampleRate{2, 0}));
            for (const auto* path : {"x", "y", "z"})
                EXPECT_EQ(rate_of(run, path), (SampleRate{2, 0})) << path;
        } while (std::next_permutation(loop.begin(), loop.end()));
    } while (std::next_permutation(inputs.begin(), inputs.end()));
}

TEST(Rates, AReaderOfASubsystemThatAConstantCallsFollowsIt) {
    for (const std::string trigger : {"{block: Constant}", R"({block: Constant, value: "[1 0]"})"}) {
        Session run(
            "model: m\nstep: 0.5\nblocks:\n  call: " + trigger +
            "\n  sub:\n    execution: triggered\n    trigger: function_call\n    inputs: [go]\n"
            "    outputs: [y, z]\n    blocks:\n      c: {block: Clock}\n      inner:\n"
            "        execution: triggered\n        trigger: function_call\n        outputs: [y]\n"
            "        blocks: {c: {block: Clock}}\n        connections: {c: y}\n      h: {block: Gain}\n"
            "      one: {block: Constant}\n"
            "    connections: {one: inner.trigger, inner: h, c: y, h: z}\n  g: {block: Gain, K: 2}\n"
            "  gz: {block: Gain}\n  d: {block: UnitDelay}\n"
            "connections: {call: [sub.trigger, sub.go], sub.y: [g, d], sub.z: gz}\n");
        EXPECT_EQ(run.trace("g", 4), (Values{0, 1, 2, 3}));
        EXPECT_EQ(run("d"), 1);
        EXPECT_EQ(run("gz"), 1.5);
    }
}

TEST(Rates, APeriodOfASubsystemHoldsForWhatIsInside) {
    Session run(R"m(
model: m
step: 1
blocks:
  s:
    period: 2
    offset: 1
    outputs: [y, z]
    blocks:
      t: {block: Clock}
      own: {block: Clock, period: 3}
    connections: {t: y, own: z}
)m");
    EXPECT_EQ(run.trace("s.y", 4), (Values{0, 1, 1, 3}));
    run.simulation->start();
    EXPECT_EQ(run.trace("s.z", 5), (Values{0, 0, 0, 3, 3})); // the offset belongs to the subsystem's period
}

TEST(Rates, AnAtomicSubsystemComputesWhatItsBlocksWould) {
    const std::string inside = R"m(
    inputs: [u]
    outputs: [y]
    blocks:
      x: {block: UnitDelay}
      g: {block: Gain, K: 2}
    connections: {u: x, x: g, g: y}
  t: {block: Clock}
connections: {t: s}
)m";
    const std::string head = "model: m\nstep: 1\nblocks:\n  s:";
    EXPECT_EQ(Session(head + "\n    execution: atomic" + inside).trace("s", 4), (Values{0, 0, 2, 4}));
    EXPECT_EQ(Session(head + inside).trace("s", 4), (Values{0, 0, 2, 4}));
}

bool is_continuous(const Session& run, const std::string& path) {
    const auto& node = run.diagram.nodes[static_cast<std::size_t>(run.diagram.find_node(path))];
    return run.diagram.rates[static_cast<std::size_t>(node.rate)].is_continuous;
}

TEST(Rates, AreHitWhereTheStepLessTheOffsetIsAMultipleOfThePeriod) {
    Session run("model: m\nstep: 1\nblocks:\n  c: {block: CounterFree, period: 3, offset: 2}\n");
    for (int k = 0; k < 12; ++k) {
        run.trace("c", 1);
        const auto& node = run.diagram.nodes[0];
        EXPECT_EQ(run.simulation->is_hit(node.rate), k >= 2 && (k - 2) % 3 == 0) << k;
        EXPECT_EQ(run("c"), k < 2 ? 0 : (k - 2) / 3) << k;
    }
}

TEST(Rates, WithoutAStepTheGreatestCommonDivisorOfPeriodsAndOffsetsIsTaken) {
    const auto step = [](const std::string& times) {
        return Session("model: m\nblocks:\n" + times).diagram.step;
    };
    EXPECT_DOUBLE_EQ(step("  a: {block: Clock, period: 0.4}\n  b: {block: Clock, period: 0.6}\n"), 0.2);
    EXPECT_DOUBLE_EQ(step("  a: {block: Clock, period: 0.4, offset: 0.1}\n"), 0.1);
}

TEST(Rates, SourcesHaveTheBaseStep) {
    Session run("model: m\nstep: 0.1\nblocks:\n  a: {block: Clock}\n  b: {block: Clock, period: 0.2}\n");
    EXPECT_EQ(run.trace("a", 3), (Values{0, 0.1, 0.2}));
}

TEST(Rates, BlocksWithoutDiscreteStatesInheritTheContinuousRate) {
    Session run("model: m\nstep: 0.1\nblocks:\n  x: {block: Integrator}\n  u: {block: Sine}\n"
                "  g: {block: Gain}\n  d: {block: UnitDelay}\n  s: {block: Sine, period: 0.1}\n"
                "  after: {block: Gain}\nconnections: {u: x, x: [g, d], s: after}\n");
    for (const char* path : {"x", "u", "g"}) EXPECT_TRUE(is_continuous(run, path)) << path;
    for (const char* path : {"d", "s", "after"}) EXPECT_FALSE(is_continuous(run, path)) << path;
}

std::string two_rates(const std::string& transitions) {
    return "model: m\nstep: 1\nrate_transitions: " + transitions +
           "\nblocks:\n  t: {block: Clock}\n  slow: {block: Gain, period: 2}\n  fast: {block: Gain, K: 10, "
           "period: 1}\n"
           "connections: {t: slow, slow: fast}\n";
}

TEST(RateTransitions, AreFreeUnlessTheModelChecksThem) {
    Session run(two_rates("allowed"));
    EXPECT_EQ(run.trace("fast", 5), (Values{0, 0, 20, 20, 40}));
    try {
        Session checked(two_rates("checked"));
        FAIL();
    } catch (const model::Errors& errors) {
        EXPECT_STREQ(
            errors.what(),
            "m.yaml:6:3: slow: input 'u' at 2 s reads t.y at 1 s; put a RateTransition in between, or say "
            "`rate_transitions: inserted`\n"
            "m.yaml:7:3: fast: input 'u' at 1 s reads slow.y at 2 s; put a RateTransition in between, or say "
            "`rate_transitions: inserted`");
    }
}

TEST(RateTransitions, InsertedOnesDelayToTheFasterRateOnly) {
    Session run(two_rates("inserted"));
    EXPECT_EQ(run.trace("fast", 7), (Values{0, 0, 0, 0, 20, 20, 40}));
}

/// The oracle is the same model with RateTransitions of its own.
TEST(RateTransitions, InsertedOnesStandBetweenContinuousAndSampledBlocks) {
    const std::string
        head = "model: m\nstep: 0.1\nsolver: rk4\n",
        blocks = "blocks:\n  u: {block: Sine, frequency: 3, period: 0.5}\n  x: {block: Integrator}\n"
                 "  slow: {block: Gain, K: 2, period: 0.5}\n  same: {block: Gain, K: 3, period: 0.1}\n";
    Session inserted(head + "rate_transitions: inserted\n" + blocks +
                     "connections: {u: x, x: [slow, same]}\n"),
        own(head + "rate_transitions: checked\n" + blocks +
            "  delay: {block: RateTransition, mode: delay, period: 0.5}\n  hold: {block: RateTransition, "
            "period: 0.5}\nconnections: {u: delay, delay: x, x: [hold, same], hold: slow}\n");
    for (const char* path : {"x", "slow", "same"})
        EXPECT_EQ(inserted.trace(path, 20), own.trace(path, 20)) << path;
    EXPECT_NE(own.trace("x", 20).back(), 0);
    EXPECT_THROW(Session(head + "rate_transitions: checked\n" + blocks + "connections: {u: x, x: slow}\n"),
                 model::Errors);
}

TEST(RateTransitions, StandWhereTheModelDelaysASignalForAFasterReader) {
    for (const char* transitions : {"inserted", "checked"}) {
        std::string model = two_rates(transitions);
        model.replace(model.find("slow: fast"), 10, "slow: wait, wait: fast");
        model.replace(model.find("t: slow"), 7, "t: hold, hold: slow");
        model.insert(model.find("  slow:"), "  wait: {block: RateTransition, mode: delay, period: 2}\n"
                                            "  hold: {block: ZeroOrderHold, period: 2}\n");
        Session run(model);
        EXPECT_EQ(run.trace("fast", 7), (Values{0, 0, 0, 0, 20, 20, 40})) << transitions;
    }
}

} // namespace
} // namespace bf::test
