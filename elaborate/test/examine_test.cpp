// What can be known of a model that is wrong.
#include "support.hpp"

#include <algorithm>
#include <gtest/gtest.h>

namespace bf::test {
namespace {

struct Found : Elaborated {
    std::vector<model::Diagnostic> diagnostics;
    bool says(const std::string& path, const std::string& part) const {
        return std::any_of(diagnostics.begin(), diagnostics.end(), [&](const auto& d) {
            return d.path == path && d.text().find(part) != std::string::npos;
        });
    }
    bool knows(const std::string& path, const std::string& name = "y") const {
        return slot(path, name).size_known;
    }
};

Found examined(const std::string& text) {
    Found found{{std::make_unique<Registry>(), {}}, {}};
    found.registry->add(standard_library());
    Examined result = examine(formats::read_yaml_text(text, "m.yaml"), *found.registry);
    found.diagram = std::move(result.diagram);
    found.diagnostics = std::move(result.diagnostics);
    return found;
}

TEST(Examine, KnowsSizesTypesAndRatesAroundAMistake) {
    const Found model = examined(R"(model: m
step: 0.1
blocks:
  v: {block: Constant, value: "int16([1 2 3]) "}
  p: {block: Pulse, period: 0.5, cycle: 1, width: 50}
  typo: {block: Gian}
  a: {block: Gain}
  slow: {block: Gain, period: 0.2}
  after: {block: Gain}
connections:
  v: a
  p: slow
  typo: after
)");
    ASSERT_EQ(model.diagnostics.size(), 1u);
    EXPECT_TRUE(model.says("typo", "did you mean 'Gain'"));
    EXPECT_EQ(model.size("a"), "[3]");
    EXPECT_STREQ(model.type("a"), "int16");
    EXPECT_EQ(model.node("a").rate, constant_rate);
    EXPECT_EQ(model.rate("slow").ticks, 2);
    EXPECT_TRUE(model.knows("slow"));
    EXPECT_FALSE(model.knows("after")) << "which reads what could not be made";
    EXPECT_EQ(model.diagram.find_node("typo"), -1);
    const auto order = model.order();
    EXPECT_LT(std::find(order.begin(), order.end(), "p"), std::find(order.begin(), order.end(), "slow"));
}

TEST(Examine, ReportsMistakesOfAllStagesTogether) {
    const Found model = examined(R"(model: m
step: 0.1
blocks:
  typo: {block: Gian}
  two: {block: Constant, value: "[1 2]"}
  three: {block: Constant, value: "[1 2 3]"}
  sum: {block: Sum}
  open: {block: Gain}
  g: {block: Gain}
  h: {block: Gain}
  odd: {block: Clock, period: 0.25}
connections:
  two: sum.u1
  three: sum.u2
  g: h
  h: g
)");
    EXPECT_EQ(model.diagnostics.size(), 5u);
    EXPECT_TRUE(model.says("typo", "there is no block 'Gian'"));
    EXPECT_TRUE(model.says("sum", "cannot be combined element by element"));
    EXPECT_TRUE(model.says("open", "input 'u' is not connected"));
    EXPECT_TRUE(model.says("g", "algebraic loop"));
    EXPECT_TRUE(model.says("odd", "is no multiple of the base period"));
    const auto& all = model.diagnostics;
    EXPECT_TRUE(std::is_sorted(all.begin(), all.end(), [](const auto& a, const auto& b) {
        return a.where.line < b.where.line;
    })) << "in document order";
}

TEST(Examine, SaysNothingThatMerelyFollowsFromAMistake) {
    // The block that could not be made may have named the sample time, the size and the rate.
    const Found model = examined(R"(model: m
rate_transitions: checked
blocks:
  typo: {block: Gian, period: 0.1}
  g: {block: Gain}
  s: {block: Sum}
  slow: {block: UnitDelay, period: 0.4}
  fast: {block: UnitDelay, period: 0.2}
connections:
  typo: [g, s.u1, fast]
  g: [s.u2, slow]
)");
    EXPECT_EQ(model.diagnostics.size(), 1u);
}

TEST(Examine, OfARightModelIsItsElaboration) {
    const std::string text =
        "model: m\nstep: 0.1\nblocks:\n  t: {block: Clock}\n  g: {block: Gain}\nconnections:\n  t: g\n";
    const Found model = examined(text);
    EXPECT_TRUE(model.diagnostics.empty());
    EXPECT_EQ(model.order(), elaborate_text(text).order());
    EXPECT_EQ(model.rate("g"), elaborate_text(text).rate("g"));
}

TEST(Examine, EndsForConditionsMergesAndLoopsWithoutWires) {
    const Found model = examined(R"(model: m
step: 0.1
blocks:
  merge: {block: Merge}
  on:
    execution: enabled
    inputs: {u: {}}
    outputs: {y: {}}
    blocks: {g: {block: Gain}}
    connections: {u: g, g: y}
  called:
    execution: triggered
    outputs: {y: {}}
    blocks: {c: {block: Clock}}
    connections: {c: y}
  again:
    execution: while
    outputs: {y: {}}
    blocks: {i: {block: Iteration}}
    connections: {i: y}
  end: {block: Terminator}
connections:
  on: merge.u1
  merge: end
  called: on.u
)");
    EXPECT_FALSE(model.diagnostics.empty());
    EXPECT_TRUE(model.says("on", "enable"));
}

} // namespace
} // namespace bf::test
