// Linearising where blocks jump, have a corner, or no derivative.
#include "linear.hpp"

namespace bf::analysis::test {
namespace {

TEST(Linearize, SaysWhichSideOfAKinkItTook) {
    const std::string text = R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  limit: {block: Saturate, lower: 0, upper: 1}
connections: {u: limit, limit: y}
)m";
    const auto system = linear(text);
    EXPECT_EQ(system.kinks, std::vector<std::string>{"limit"});
    expect_near(system.D, matrix_of({{1}}));
}

/// c + u through a block.
LinearSystem beside(const std::string& c, const std::string& block) {
    return linear(
        "model: m\nstep: 0.1\ninputs: [u]\noutputs: [y]\nblocks:\n  c: {block: Constant, value: " + c +
        "}\n  s: {block: Sum}\n  b: {block: " + block + "}\nconnections: {c: s.u1, u: s.u2, s: b, b: y}\n");
}

TEST(Linearize, NamesCornersAndJumpsWhereItTakesOneSide) {
    struct Case {
        const char *c, *block;
        double slope;
    };
    for (const auto& [c, block, slope] :
         {Case{"0", "Sign", 0}, Case{"0", "Abs", 1}, Case{"1", "DeadZone, start: -1, end: 1", 0},
          Case{"1", "\"Fcn\", expression: \"max(u1, 1)\"", 1}, Case{"0.5", "Round", 0},
          Case{"1", "Lookup1D, breakpoints: [0, 1, 2], table: [0, 1, 5]", 1}}) {
        const auto at = beside(c, block);
        EXPECT_EQ(at.kinks, std::vector<std::string>{"b"}) << block;
        EXPECT_NEAR(at.D(0, 0), slope, 1e-6) << block;
        EXPECT_TRUE(beside("0.3", block).kinks.empty()) << block;
    }
}

/// The derivative is 0 there, which is not that of the model as it was meant.
TEST(Linearize, NamesBlocksThatGiveIntegersOnAPath) {
    const auto system = linear(R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  i: {block: Convert, type: int32}
  d: {block: Convert, type: double}
  still: {block: Constant, value: 2.5}
  aside: {block: Convert, type: int32}
  back: {block: Convert, type: double}
  s: {block: Sum}
connections: {u: i, i: d, d: s.u1, still: aside, aside: back, back: s.u2, s: y}
)m");
    EXPECT_EQ(system.kinks, std::vector<std::string>{"i"}) << "nothing that moves comes to the other one";
    expect_near(system.D, matrix_of({{0}}));
}

TEST(Linearize, ExponentsMayDependOnTheInput) {
    for (const int e : {1, 2, 3, -1})
        EXPECT_NEAR(beside(std::to_string(e), "Fcn, expression: \"2^u1\"").D(0, 0),
                    std::pow(2.0, e) * std::numbers::ln2, 1e-12)
            << e;
    EXPECT_EQ(beside("0", "Fcn, expression: \"u1^2\"").D(0, 0), 0);
}

TEST(Linearize, WhatIsNoNumberHasNoDerivative) {
    EXPECT_THROW(beside("-1", "Log"), std::runtime_error);
    EXPECT_THROW(beside("2", "Fcn, expression: \"(-2)^u1\""), std::runtime_error);
}

} // namespace
} // namespace bf::analysis::test
