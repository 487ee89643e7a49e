#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

/// A subsystem enabled in the steps 2, 3, 6, 7 that counts its own steps.
std::string counter(const std::string& execution, const std::string& output) {
    return R"m(
model: m
step: 0.25
blocks:
  on: {block: Pulse, delay: 0.5}
  s:
)m" + execution +
           "    outputs: {y: {" + output + R"m(}}
    blocks:
      one: {block: Constant, value: 1}
      add: {block: Sum}
      x: {block: UnitDelay}
    connections:
      one: add.u1
      x: add.u2
      add: [x, y]
connections: {on: s.enable}
)m";
}
const std::string held = "    execution: enabled\n", reset = held + "    states: reset\n";

TEST(Conditions, OutputsAreHeldAndStatesGoOn) {
    EXPECT_EQ(Session(counter(held, "")).trace("s", 9), (Values{0, 0, 1, 2, 2, 2, 3, 4, 4}));
}
TEST(Conditions, OutputsStartAtTheirInitialValue) {
    EXPECT_EQ(Session(counter(held, "initial: -5")).trace("s", 9), (Values{-5, -5, 1, 2, 2, 2, 3, 4, 4}));
}
TEST(Conditions, OutputsAreResetToTheirInitialValue) {
    EXPECT_EQ(Session(counter(held, "when_disabled: reset, initial: -5")).trace("s", 9),
              (Values{-5, -5, 1, 2, -5, -5, 3, 4, -5}));
}
TEST(Conditions, StatesAreResetOnEnabling) {
    EXPECT_EQ(Session(counter(reset, "")).trace("s", 9), (Values{0, 0, 1, 2, 2, 2, 1, 2, 2}));
}

TEST(Conditions, InitialOutputIsInheritedFromAConstantAndAnInitialCondition) {
    Session run(R"m(
model: m
step: 1
blocks:
  off: {block: Constant, value: [0, 0]}
  s:
    execution: enabled
    outputs: [a, b, c, d]
    blocks:
      five: {block: Constant, value: [5, 6]}
      first: {block: InitialCondition, value: 7}
      t: {block: Clock}
      inner:
        execution: enabled
        outputs: {y: {initial: 9}}
        blocks: {t: {block: Clock}}
        connections: {t: y}
    connections: {five: a, t: [first, inner.enable, d], first: b, inner: c}
connections: {off: s.enable}
)m");
    run.trace("s.a", 1);
    EXPECT_EQ(run.values("s.a"), (Values{5, 6}));
    EXPECT_EQ(run("s.b"), 7);
    EXPECT_EQ(run("s.c"), 9);
    EXPECT_EQ(run("s.d"), 0);
}

TEST(Conditions, AnyElementAboveZeroEnables) {
    Session run(R"m(
model: m
step: 1
blocks:
  ramp: {block: Ramp, initial: "[-3 -1 -9]"}
  s: {execution: enabled, outputs: [y], blocks: {t: {block: Clock}}, connections: {t: y}}
connections: {ramp: s.enable}
)m");
    EXPECT_EQ(run.trace("s", 5), (Values{0, 0, 2, 3, 4})); // at 0 it is not above 0
}

TEST(Conditions, InsideADisabledSubsystemNothingRunsWhateverItsOwnControl) {
    Session run(R"m(
model: m
step: 0.25
blocks:
  on: {block: Pulse, delay: 0.5}
  always: {block: Constant, value: 1}
  s:
    execution: enabled
    inputs: [e]
    outputs: {y: {}, own: {}}
    blocks:
      inner:
        execution: enabled
        states: reset
        outputs: [y]
        blocks:
          one: {block: Constant}
          add: {block: Sum}
          x: {block: UnitDelay}
        connections: {one: add.u1, x: add.u2, add: [x, y]}
    connections: {e: inner.enable, inner: y, enable: own}
connections: {on: s.enable, always: s.e}
)m");
    // Enabling the outer subsystem enables the inner one anew, which resets its states.
    EXPECT_EQ(run.trace("s.y", 9), (Values{0, 0, 1, 2, 2, 2, 1, 2, 2}));
    EXPECT_EQ(run("s.own"), 1);
}

TEST(Conditions, ReadersSeeTheResetInTheSameStep) {
    std::string text = counter(held, "when_disabled: reset, initial: -5");
    text.replace(text.find("  on:"), 5, "  reader: {block: Gain, K: 2}\n  on:");
    text.replace(text.find("connections: {on"), 16, "connections: {s: reader, on");
    EXPECT_EQ(Session(text).trace("reader", 6), (Values{-10, -10, 2, 4, -10, -10}));
}

TEST(Conditions, ADelayedAssertionInsideStopsOneStepLater) {
    Session run(R"m(
model: m
step: 1
blocks:
  t: {block: Clock}
  small: {block: CompareToConstant, operator: "<", constant: 3}
  on: {block: Constant, value: true}
  s:
    execution: enabled
    inputs: [u]
    blocks:
      x: {block: UnitDelay, initial: true}
      must: {block: Assertion}
    connections: {u: x, x: must}
connections: {t: small, small: s.u, on: s.enable}
)m");
    int steps = 0;
    while (run.simulation->step()) ++steps;
    EXPECT_EQ(steps, 4); // violated at 3, tested at 4
    EXPECT_EQ(run.simulation->failure().substr(0, 8), "s.must: ");
}

TEST(Conditions, AreLookedAtWhenTheirBlocksMayRun) {
    Session run(R"m(
model: m
step: 0.25
blocks:
  on: {block: Pulse, delay: 0.25, width: 25}
  s:
    execution: enabled
    period: 0.5
    outputs: [y]
    blocks: {t: {block: Clock}}
    connections: {t: y}
connections: {on: s.enable}
)m");
    // The pulse is high in steps 1, 5, 9, ...: never when the subsystem's rate is hit.
    EXPECT_EQ(run.trace("s", 10), (Values(10, 0.0)));
}

} // namespace
} // namespace bf::test
