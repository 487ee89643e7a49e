#include "bf/model/builder.hpp"
#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

TEST(Infer, ALoopThatTookTheWrongSizeSaysWhereFrom) {
    // Of two elements it is not told whether they are a row: the loop takes the size of what it begins with.
    const auto loop = [](const std::string& initial) {
        return "model: m\nstep: 0.1\nblocks:\n  t: {block: Clock}\n  x: {block: Mux, inputs: 2}\n"
               "  d: {block: Memory, initial: " +
               initial +
               "}\n  h: {block: Selector, indices: \"[1 2]\"}\n"
               "connections: {t: x.u1, x: d, d: h, h: x.u2}\n";
    };
    EXPECT_EQ(errors_of(loop("1")),
              "m.yaml:7:3: h: input 'u' of size scalar has no element 2; if the loop has another size than "
              "'d.initial', give that parameter as many elements as the signal");
    EXPECT_EQ(elaborate_text(loop("\"[1 1 1]\"")).size("x"), "[3]");
}

TEST(Infer, OneElementHasItsSizeBeforeTheLoopItComesFrom) {
    const auto m =
        elaborate_text("model: m\nstep: 0.1\nblocks:\n  t: {block: Clock}\n  x: {block: Mux, inputs: 3}\n"
                       "  d: {block: Memory, initial: 1}\n  h: {block: Selector, indices: 1}\n"
                       "connections: {t: [x.u1, x.u2], x: d, d: h, h: x.u3}\n");
    EXPECT_EQ(m.size("x"), "[3]");
    EXPECT_EQ(m.size("h"), "scalar");
}

TEST(Infer, ASingleNumberIsAllOfAMatrixThatNothingElseSizes) {
    const auto m =
        elaborate_text("model: m\nstep: 0.1\nsolver: rk4\nblocks:\n  u: {block: Constant, value: 1}\n"
                       "  p: {block: StateSpace, A: -2, B: 3, C: 4}\n  end: {block: Terminator}\n"
                       "connections: {u: p, p: end}\n");
    EXPECT_EQ(m.slot("p", "x").size.count(), 1);
    EXPECT_EQ(m.slot("p", "A").size.text(), "1x1");
}

TEST(Infer, LoopOfScalarsTakesTheSizeOfTheInitialValue) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  sum: {block: Sum, signs: "1"}
  add: {block: Sum}
  gain: {block: Gain, K: 0.5}
  delay: {block: UnitDelay}
connections:
  delay: gain
  gain: [add.u1, add.u2]
  add: [delay, sum]
)m");
    EXPECT_EQ(m.size("add"), "scalar");
    EXPECT_EQ(m.size("delay"), "scalar");
    EXPECT_EQ(m.size("gain"), "scalar");
}

TEST(Infer, LoopOfVectorsTakesTheSizeOfTheInitialValue) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  gain: {block: Gain, K: 0.5}
  delay: {block: UnitDelay, initial: [1, 2, 3]}
connections:
  delay: gain
  gain: delay
)m");
    EXPECT_EQ(m.size("gain"), "[3]");
    EXPECT_EQ(m.size("delay", "x"), "[3]");
}

TEST(Infer, LoopThroughALongDelayIsScalarWithAScalarInitialValue) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  gain: {block: Gain, K: 0.5}
  delay: {block: Delay, steps: 3, initial: 1}
connections:
  delay: gain
  gain: delay
)m");
    EXPECT_EQ(m.size("delay"), "scalar");
    EXPECT_EQ(m.size("delay", "past"), "3x1");
}

TEST(Infer, WiringDecidesBeforeInitialValuesDo) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  delay: {block: UnitDelay}
  add: {block: Sum}
  c: {block: Constant, value: [1, 2]}
connections:
  delay: add.u1
  c: add.u2
  add: delay
)m");
    EXPECT_EQ(m.size("delay"), "[2]");
}

TEST(Infer, SizesSpreadBackwardsFromReaders) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  zero: {block: Ground}
  delay: {block: UnitDelay}
  cross: {block: Cross}
connections:
  zero: delay
  delay: [cross.u1, cross.u2]
)m");
    EXPECT_EQ(m.size("zero"), "[3]");
}

TEST(Infer, ScalarsExpandToTheSizeOfTheSignal) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  c: {block: Constant, value: [1, 2, 3]}
  one: {block: Constant}
  sum: {block: Sum}
  delay: {block: UnitDelay, initial: 7}
  gain: {block: Gain, K: 2}
connections:
  c: [sum.u1, gain]
  one: sum.u2
  sum: delay
)m");
    EXPECT_EQ(m.size("sum"), "[3]");
    EXPECT_EQ(m.size("delay"), "[3]");
    EXPECT_EQ(m.size("delay", "initial"), "scalar");
    EXPECT_EQ(m.size("gain"), "[3]");
}

TEST(Infer, RowsAndColumnsAreOneDimensionalUnlessKept) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  row: {block: Constant, value: [1, 2, 3]}
  kept: {block: Constant, value: [1, 2, 3], vector_1d: false}
  matrix: {block: Constant, value: "[1 2; 3 4]"}
)m");
    EXPECT_EQ(m.size("row"), "[3]");
    EXPECT_EQ(m.size("kept"), "1x3");
    EXPECT_EQ(m.size("matrix"), "2x2");
}

TEST(Infer, TypesFollowTheWires) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  truth: {block: Constant, value: true}
  small: {block: Constant, value: "int8([1 2])"}
  truth_delay: {block: UnitDelay}
  small_delay: {block: UnitDelay}
  plain: {block: Constant}
connections:
  truth: truth_delay
  small: small_delay
)m");
    EXPECT_STREQ(m.type("truth_delay"), "boolean");
    EXPECT_STREQ(m.type("small_delay", "x"), "int8");
    EXPECT_STREQ(m.type("plain"), "double");
}

TEST(Infer, RootInputsTakeWhatTheyDeclareElseWhatReadersNeed) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
variables: {n: 2}
inputs:
  matrix: {shape: "[n 3]"}
  vector: {shape: n, type: int32}
  read: {}
  free: {}
outputs: [y]
blocks:
  a: {block: Terminator}
  b: {block: Terminator}
  cross: {block: Cross}
  c: {block: Gain}
connections:
  matrix: a
  vector: b
  read: [cross.u1, cross.u2]
  free: c
  cross: y
)m");
    EXPECT_EQ(m.size("matrix"), "2x3");
    EXPECT_EQ(m.size("vector"), "[2]");
    EXPECT_STREQ(m.type("vector"), "int32");
    EXPECT_EQ(m.size("read"), "[3]");
    EXPECT_EQ(m.size("free"), "scalar");
    ASSERT_EQ(m.diagram.inputs.size(), 4u);
    EXPECT_EQ(m.diagram.inputs[2].path, "read");
    ASSERT_EQ(m.diagram.outputs.size(), 1u);
    EXPECT_EQ(m.diagram.end_path(m.diagram.outputs[0].end), "cross.y");
}

TEST(Infer, PortsOfSubsystemsDecideWhereTheWiringDoesNot) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
blocks:
  s:
    outputs:
      y: {shape: 4, type: single}
    blocks:
      zero: {block: Ground}
    connections:
      zero: y
  end: {block: Terminator}
connections:
  s: end
)m");
    EXPECT_EQ(m.size("s.zero"), "[4]");
    EXPECT_STREQ(m.type("s.zero"), "single");
}

/// The peer benchmark's diagram: 1,010 blocks and a constant.
TEST(Infer, SettlesTheLongLoopOfScalars) {
    model::Builder b{"loop"};
    b.step(0.001);
    b.add("one", "Constant", {{"value", 1}});
    model::End last = {"d9"};
    for (int i = 0; i < 500; ++i) {
        const auto gain = b.add("g" + std::to_string(i), "Gain", {{"K", 0.999}});
        const auto sum = b.add("s" + std::to_string(i), "Sum");
        b.connect(last, gain);
        b.connect(gain, sum["u1"]);
        b.connect({"one"}, sum["u2"]);
        last = sum;
    }
    for (int i = 0; i < 10; ++i) {
        const auto delay = b.add("d" + std::to_string(i), "UnitDelay");
        b.connect(last, delay);
        last = delay;
    }
    const auto m = elaborate_model(b.build());
    EXPECT_EQ(m.size("g0"), "scalar");
    EXPECT_EQ(m.size("s499"), "scalar");
}

} // namespace
} // namespace bf::test
