// What can be known of a model that is wrong.
#include "support.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <set>

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

TEST(Examine, NamesSignalsAndStillKnowsASubsystemByItsOnlyOutput) {
    const Found model = examined(R"(model: m
step: 0.1
blocks:
  t: {block: Clock}
  outer:
    inputs: [u]
    outputs: [y]
    blocks:
      inner:
        inputs: [u]
        outputs: [y]
        blocks: {twice: {block: Gain, K: 2}, more: {block: Gain, K: 3}}
        connections: {u: twice, twice: more, more: y}
        signals: {doubled: twice, given: u}
    connections: {u: inner, inner: y}
connections: {t: outer}
signals: {time: t.y}
record: [time, outer.inner.doubled, outer.inner, outer]
)");
    ASSERT_TRUE(model.diagnostics.empty()) << model.diagnostics[0].text();
    const auto end = [&](const std::string& path) {
        return model.diagram.end_path(model.diagram.find_signal(path));
    };
    EXPECT_EQ(end("time"), "t.y");
    EXPECT_EQ(end("outer.inner.doubled"), "outer.inner.twice.y");
    EXPECT_EQ(end("outer.inner.given"), "t.y");
    EXPECT_EQ(end("outer.inner"), "outer.inner.more.y");
    EXPECT_EQ(end("outer"), "outer.inner.more.y");
    EXPECT_EQ(model.diagram.record.size(), 4u);
}

TEST(Examine, TellsOpenPortsAndTheVariableThatIsWrong) {
    const Found model = examined(R"(model: m
step: 0.1
variables:
  Gain: {Kp: {value: 7, maximum: 5}, Kd: nothing}
blocks:
  s: {block: Sum}
)");
    for (const auto& d : model.diagnostics) EXPECT_EQ(d.is_open, d.path == "s") << d.text();
    std::multiset<std::string> variables;
    for (const auto& d : model.diagnostics) variables.insert(d.variable);
    EXPECT_EQ(variables, (std::multiset<std::string>{"", "", "Gain.Kd", "Gain.Kp"}));
}

TEST(Examine, GivesFieldsOfAStructToAFileOneByOne) {
    auto part = std::make_shared<model::Model>(
        formats::read_yaml_text("model: part\nvariables:\n  Gain: {Kp: 1, Kd: 2*Gain.Kp}\noutputs: [y]\n"
                                "blocks: {c: {block: Constant, value: Gain.Kd}}\nconnections: {c: y}\n"));
    model::Model user = formats::read_yaml_text("model: m\nstep: 0.1\nvariables: {k: 5}\nblocks: {}\n");
    user.root.blocks.push_back({.name = "b"});
    user.root.blocks[0].reference.emplace(model::Reference{.file = "part.yaml", .model = part});
    const auto value = [&](std::vector<model::Variable> fields) {
        user.root.blocks[0].reference->with = {{.name = "Gain", .fields = std::move(fields)}};
        Registry registry;
        registry.add(standard_library());
        const Examined found = examine(user, registry);
        EXPECT_TRUE(found.diagnostics.empty()) << found.diagnostics[0].text();
        for (const auto& definition : found.diagram.definitions)
            if (definition.path == "b.Gain.Kd") return definition.value.to_text();
        return std::string();
    };
    EXPECT_EQ(value({{.name = "Kd", .value = {.text = "k"}}}), "5");
    EXPECT_EQ(value({{.name = "Kp", .value = {.text = "1"}}, {.name = "Kd", .value = {.text = "8"}}}), "8");
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
