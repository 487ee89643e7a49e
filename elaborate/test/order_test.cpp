#include "bf/kernels/elementwise.hpp"
#include "bf/model/builder.hpp"
#include "support.hpp"

#include <algorithm>
#include <gtest/gtest.h>

namespace bf::test {
namespace {

using Paths = std::vector<std::string>;

TEST(Order, DataComeBeforeTheirReaders) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  c: {block: Gain}
  b: {block: Gain}
  a: {block: Clock}
connections:
  a: b
  b: c
)m");
    EXPECT_EQ(m.order(), (Paths{"a", "b", "c"}));
}

TEST(Order, TiesAreBrokenByDocumentOrder) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  z: {block: Clock}
  y: {block: Clock}
  x: {block: Clock}
  a: {block: Gain}
  b: {block: Gain}
connections:
  x: [a]
  z: [b]
)m");
    EXPECT_EQ(m.order(), (Paths{"z", "y", "x", "a", "b"}));
}

TEST(Order, DoesNotDependOnTheOrderOfConnections) {
    const std::string blocks = R"m(
model: m
step: 0.1
blocks:
  t: {block: Clock}
  a: {block: Gain}
  b: {block: Gain}
  s: {block: Sum}
connections:
)m";
    const auto one = elaborate_text(blocks + "  t: [a, b]\n  a: s.u1\n  b: s.u2\n");
    const auto other = elaborate_text(blocks + "  b: s.u2\n  a: s.u1\n  t: [b, a]\n");
    EXPECT_EQ(one.order(), (Paths{"t", "a", "b", "s"}));
    EXPECT_EQ(one.order(), other.order());
}

TEST(Order, UnitDelayBreaksALoopAlsoInsideASubsystem) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  add: {block: Sum}
  one: {block: Constant}
  memory:
    execution: atomic
    inputs: [u]
    outputs: [y]
    blocks:
      delay: {block: UnitDelay}
    connections:
      u: delay
      delay: y
connections:
  one: add.u1
  memory: add.u2
  add: memory
)m");
    EXPECT_EQ(m.order(), (Paths{"one", "memory.delay", "add"}));
}

/// Two outputs, of which only the second depends on the input in the same step.
class Split final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "u", {}};
    Output<double> old{this, "old", {}};
    Output<double> now{this, "now", {}};
    DiscreteState<double> x{this, "x", {}};
    OutputRule rule_old{this, kernels::Copy{}, old, x};
    OutputRule rule_now{this, kernels::Copy{}, now, u};
    UpdateRule rule{this, kernels::Copy{}, next(x), u};
};

/// A method block that says which output depends on its input.
class Told final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "u", {.feedthrough = false}};
    Output<double> y{this, "y", {}};
    Status output(Now, Out out) const noexcept override {
        out[y] = 1;
        return ok;
    }
};

/// Its second rule reads only what its first one left in a workspace.
class TwoStages final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "u", {}};
    Output<double> y{this, "y", {}};
    Workspace<double> w{this, "w", {}};
    OutputRule first{this, kernels::Copy{}, w, u};
    OutputRule second{this, kernels::Copy{}, y, w};
    OutputRule third{this, kernels::Negate{}, y, y};
};

const Library& more() {
    static const Library library = [] {
        Library l("");
        l.group("test").add<Split>("Split", "").add<Told>("Told", "").add<TwoStages>("TwoStages", "");
        return l;
    }();
    return library;
}

TEST(Order, FeedthroughHoldsPerRuleSoThereIsNoArtificialLoop) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  gain: {block: Gain}
  split: {block: Split}
connections:
  split.old: gain
  gain: split
)m",
                                  {}, &more());
    EXPECT_EQ(m.order(), (Paths{"split", "gain", "split"}));
}

TEST(Order, MethodBlocksSayWhatFeedsThrough) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  gain: {block: Gain}
  told: {block: Told}
connections:
  told: gain
  gain: told
)m",
                                  {}, &more());
    EXPECT_EQ(m.order(), (Paths{"told", "gain"}));
}

TEST(Order, RulesThatShareMemoryKeepTheirOrder) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  end: {block: Gain}
  two: {block: TwoStages}
  source: {block: Clock}
connections:
  source: two
  two: end
)m",
                                  {}, &more());
    EXPECT_EQ(m.order(), (Paths{"source", "two", "two", "two", "end"}));
    int last = -1;
    for (const auto& segment : m.diagram.plan.outputs)
        for (const auto& a : segment.activities)
            if (m.diagram.nodes[static_cast<std::size_t>(a.node)].path == "two") {
                EXPECT_EQ(a.index, last + 1);
                last = a.index;
            }
}

TEST(Order, LoopIsNamedPortByPort) {
    EXPECT_EQ(
        errors_of(R"m(
model: m
step: 0.1
blocks:
  c: {block: Constant}
  a: {block: Sum}
  b:
    inputs: [u]
    outputs: [y]
    blocks:
      gain: {block: Gain}
    connections: {u: gain, gain: y}
  d: {block: Gain}
connections:
  c: a.u1
  a: b
  b: d
  d: a.u2
)m"),
        "m.yaml:6:3: a: algebraic loop: a.y -> b.gain.u, b.gain.y -> d.u, d.y -> a.u2; break it with a block "
        "whose output does not depend on its input in the same step, e.g. a UnitDelay on one of these wires");
}

TEST(Order, EveryLoopIsReported) {
    const std::string remedy =
        "; break it with a block whose output does not depend on its input in the same step, "
        "e.g. a UnitDelay on one of these wires";
    EXPECT_EQ(errors_of(R"m(
model: m
step: 0.1
blocks:
  a: {block: Gain}
  b: {block: Gain}
  c: {block: Sum}
connections:
  a: [a, c.u1]
  b: b
  c: c.u2
)m"),
              "m.yaml:5:3: a: algebraic loop: a.y -> a.u" + remedy +
                  "\nm.yaml:6:3: b: algebraic loop: b.y -> b.u" + remedy +
                  "\nm.yaml:7:3: c: algebraic loop: c.y -> c.u2" + remedy);
}

TEST(Order, LoopThroughAnEnableNamesIt) {
    EXPECT_EQ(errors_of(R"m(
model: m
step: 0.1
blocks:
  s:
    execution: enabled
    outputs: [y]
    blocks:
      t: {block: Clock}
    connections: {t: y}
connections:
  s: s.enable
)m"),
              "m.yaml:9:7: s.t: algebraic loop: s.t.y -> s.y.u, s.y.y -> s.enable; break it with a block "
              "whose output does "
              "not depend "
              "on its input in the same step, e.g. a UnitDelay on one of these wires");
}

TEST(Order, AConditionIsLookedAtBeforeTheBlocksUnderIt) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  s:
    execution: enabled
    outputs: [y]
    blocks:
      t: {block: Clock}
    connections: {t: y}
  end: {block: Gain}
  on: {block: Clock}
connections:
  on: s.enable
  s: end
)m");
    EXPECT_EQ(m.order(), (Paths{"on", "?s", "s.t", "s.y", "end"}));
}

} // namespace
} // namespace bf::test
