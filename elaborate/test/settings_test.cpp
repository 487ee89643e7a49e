#include "support.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf::test {
namespace {

using Values = std::vector<double>;

Values value(const std::string& text, const std::string& variables = "", const Overrides& overrides = {}) {
    return elaborate_text("model: m\nstep: 0.1\n" + variables +
                              "blocks:\n  c: {block: Constant, value: " + text + "}\n",
                          overrides)
        .slot("c", "value")
        .initial;
}

TEST(Settings, AreMatlabExpressions) {
    EXPECT_EQ(value("2*3"), (Values{6}));
    EXPECT_EQ(value("\"[1 2; 3 4]\""), (Values{1, 3, 2, 4}));
    EXPECT_EQ(value("\"[[1, 2], [3, 4]]\""), (Values{1, 2, 3, 4}));
    EXPECT_EQ(value("1:2:7"), (Values{1, 3, 5, 7}));
    EXPECT_EQ(value("Gain.Kp*Gain.n(2)", "variables:\n  Gain: {Kp: 10, n: [1, 2*Gain.Kp]}\n"), (Values{200}));
    EXPECT_EQ(value("b", "variables: {a: 2, b: a + 1}\n"), (Values{3}));
}

TEST(Settings, EnumerationsAreNamedNumbers) {
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
enumerations:
  Mode: [idle, walk, stop]
  Phase: {left: 4, right: 2*Mode.stop + 5}
variables: {first: Mode.walk}
blocks:
  a: {block: Constant, value: first}
  b: {block: Constant, value: "[Phase.left Phase.right]"}
  is_walking: {block: Constant, value: first == Mode.walk}
  case: {block: SwitchCase, cases: [Mode.idle, Mode.walk]}
  s:
    inputs: {mode: {type: Mode}}
    enumerations: {Own: [zero, one]}
    blocks:
      g: {block: Gain, K: Own.one}
    connections: {mode: g}
connections: {a: [case, s]}
)m");
    EXPECT_STREQ(m.type("a"), "int32");
    EXPECT_EQ(m.slot("a", "value").initial, std::vector<double>{1});
    EXPECT_EQ(m.slot("b", "value").initial, (std::vector<double>{4, 9}));
    EXPECT_STREQ(m.type("is_walking"), "boolean");
    ASSERT_EQ(m.diagram.enumerated.size(), 1u);
    EXPECT_EQ(m.diagram.enumerated[0].names[2], (std::pair<double, std::string>(2, "stop")));
}

TEST(Settings, EnumerationsThatAreWrongAreRefused) {
    const auto wrong = [](const std::string& text) { return errors_of("model: m\nstep: 1\n" + text); };
    EXPECT_EQ(wrong("enumerations: {Mode: {a: 0.5}}\n"),
              "m.yaml:3:26: 'Mode.a' is 0.5; give a whole number of type int32");
    EXPECT_EQ(wrong("enumerations: {Mode: {a: 2^31}}\n"),
              "m.yaml:3:26: 'Mode.a' is 2147483648; give a whole number of type int32");
    EXPECT_EQ(wrong("enumerations: {Mode: []}\n"),
              "m.yaml:3:16: the enumeration 'Mode' has no values; list their names, e.g. [idle, walk]");
    EXPECT_EQ(wrong("enumerations: {Mode: [a]}\nvariables: {Mode: 1}\n"),
              "m.yaml:4:13: 'Mode' names both a variable and an enumeration; rename one of them");
    EXPECT_EQ(wrong("enumerations: {Mode: [a, a]}\n"),
              "m.yaml:3:26: a second variable 'a'; rename one of them");
    EXPECT_EQ(wrong("enumerations: {Mode: [idle]}\nblocks: {c: {block: Constant, value: Mode.walk}}\n")
                  .substr(0, 52),
              "m.yaml:4:38: c.value: 'Mode.walk': the struct has no");
    EXPECT_EQ(
        wrong("inputs: {u: {type: Mode}}\n"),
        "m.yaml:3:10: u: there is no type 'Mode'; types: double, single, int8, uint8, int16, uint16, int32, "
        "uint32, boolean, and the enumerations of the model");
}

TEST(Settings, VariablesAreOverriddenByName) {
    const std::string variables =
        "variables:\n  a: 2\n  Gain: {Kp: a, deep: {x: 1}}\n  b: Gain.Kp + Gain.deep.x\n";
    EXPECT_EQ(value("b", variables), (Values{3}));
    EXPECT_EQ(value("b", variables, {{"a", "5"}}), (Values{6}));
    EXPECT_EQ(value("b", variables, {{"Gain.Kp", "a^2"}}), (Values{5}));
    EXPECT_EQ(value("b", variables, {{"Gain.deep.x", "10"}}), (Values{12}));
    EXPECT_EQ(value("b", variables, {{"b", "[1 2]"}}), (Values{1, 2}));
    EXPECT_EQ(value("b", variables, {{"a", "5"}, {"a", "7"}}), (Values{8}));
}

TEST(Settings, OfBlocksAndTimesAreOverriddenByName) {
    EXPECT_EQ(value("1", "", {{"c.value", "[4 5]"}}), (Values{4, 5}));
    const auto m = elaborate_text(R"m(
model: m
step: 0.1
stop: 2
blocks:
  s:
    variables: {k: 2}
    outputs: [y]
    blocks:
      g: {block: Constant, value: k}
      d: {block: Delay}
    connections: {g: d, d: y}
)m",
                                  {{"s.k", "9"}, {"s.d.steps", "4"}, {"step", "0.2"}, {"stop", "Inf"}});
    EXPECT_EQ(m.slot("s.g", "value").initial, (Values{9}));
    EXPECT_EQ(m.size("s.d", "past"), "4x1");
    EXPECT_EQ(m.diagram.step, 0.2);
    EXPECT_TRUE(std::isinf(m.diagram.stop));
}

/// Shows what text arguments became.
class Texts final : public Block {
  public:
    using Block::Block;
    Argument<std::string> one{this, "one", {.initial = ""}};
    Argument<std::vector<std::string>> many{this, "many", {.initial = {}}};
};

TEST(Settings, TextsArePlainQuotedFromVariablesOrLists) {
    Library library("");
    library.group("test").add<Texts>("Texts", "");
    const auto text = [&](const std::string& setting) {
        const auto m = elaborate_text("model: m\nstep: 1\nvariables:\n  name: '''l_sole'''\n  Robot: {foot: "
                                      "'r_sole', all: \"{'a', 'b'}\"}\n"
                                      "blocks:\n  t: {block: Texts, " +
                                          setting + "}\n",
                                      {}, &library);
        const auto& block = dynamic_cast<const Texts&>(*m.node("t").block);
        std::string result = *block.one;
        for (const auto& item : *block.many) result += "|" + item;
        return result;
    };
    EXPECT_EQ(text("one: l_sole"), "l_sole");
    EXPECT_EQ(text("one: 'l_sole'"), "l_sole");
    EXPECT_EQ(text("one: \"l_sole\""), "l_sole");
    EXPECT_EQ(text("one: Robot.foot"), "r_sole");
    EXPECT_EQ(text("one: 'Robot.foot'"), "Robot.foot");
    EXPECT_EQ(text("many: [a, b c]"), "|a|b c");
    EXPECT_EQ(text("many: \"{'a', 'b'}\""), "|a|b");
    EXPECT_EQ(text("many: Robot.all"), "|a|b");
    EXPECT_EQ(text("many: ['a, b', it's, 'it''s', \"c\"]"), "|a, b|it's|it's|c");
    EXPECT_EQ(text("many: \"'a', 'b'\""), "|a|b");
}

TEST(Settings, WithOverridesVariablesOfASubsystemInAnotherFile) {
    const std::filesystem::path folder =
        std::filesystem::path(testing::TempDir()) / ("bf_with_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "inner.yaml") << "model: inner\noutputs: [y]\nvariables: {k: 1, n: 2*k}\nblocks:\n"
                                            "  c: {block: Constant, value: \"[k n]\"}\nconnections: {c: y}\n";
    std::ofstream(folder / "outer.yaml")
        << "model: outer\nstep: 1\nvariables: {k: 5}\nblocks:\n"
           "  a: {file: inner.yaml}\n  b: {file: inner.yaml, with: {k: 3*k}}\n";
    const auto m = elaborate_model(formats::read_yaml(folder / "outer.yaml"));
    EXPECT_EQ(m.slot("a.c", "value").initial, (Values{1, 2}));
    EXPECT_EQ(m.slot("b.c", "value").initial, (Values{15, 30}));
}

/// What is wrong with variables that may have limits, written on the third line.
std::string wrong_variables(const std::string& variables, const Overrides& overrides = {}) {
    return errors_of("model: m\nstep: 0.1\nvariables: " + variables +
                         "\nblocks: {s: {variables: {k: {value: 1, maximum: 9}}, blocks: {}}}\n",
                     overrides);
}

TEST(Settings, VariablesAreHeldToTheLimitsOfTheirDeclaration) {
    const std::string variables = "{n: 2, Gain: {Kp: {value: 1, minimum: 0, maximum: 50*n}, row: {value: "
                                  "\"[1 2]\", above: 0}}, w: {value: n, minimum: 1}}";
    EXPECT_EQ(wrong_variables(variables), "");
    EXPECT_EQ(wrong_variables(variables, {{"Gain.Kp", "0"}, {"Gain.row", "[1e-9 7]"}, {"s.k", "9"}}), "");
    EXPECT_EQ(wrong_variables("{K: {value: -1, minimum: 0, maximum: 100}}"),
              "m.yaml:3:24: variable 'K' must be from 0 to 100, but is -1");
    const model::Location there{std::make_shared<const std::string>("p.yaml"), 7, 2};
    EXPECT_EQ(wrong_variables(variables, {{"Gain.Kp", "101", there}}),
              "p.yaml:7:2: variable 'Gain.Kp' must be from 0 to 100, but is 101");
    EXPECT_EQ(wrong_variables(variables, {{"Gain.row", "[3 0]"}}),
              "variable 'Gain.row' must be greater than 0, but element 2 is 0");
    EXPECT_EQ(wrong_variables(variables, {{"Gain", "struct('Kp', NaN, 'row', 1)", there}}),
              "p.yaml:7:2: variable 'Gain.Kp' must be from 0 to 100, but is NaN");
    EXPECT_EQ(wrong_variables(variables, {{"n", "0.5", there}}),
              "m.yaml:3:114: variable 'w' must be at least 1, but is 0.5")
        << "what follows is held, too";
    EXPECT_EQ(wrong_variables(variables, {{"s.k", "10", there}}),
              "p.yaml:7:2: variable 's.k' must be at most 9, but is 10");
    EXPECT_EQ(wrong_variables("{K: {value: unknown_name, minimum: 1}}").find("must be"), std::string::npos);
}

TEST(Settings, LimitsOfVariablesThatAreWrongAreRefused) {
    EXPECT_EQ(wrong_variables("{K: {value: 2, minimum: 3, maximum: 1}}"),
              "m.yaml:3:13: variable 'K' must be from 3 to 1, which no number is; let 'maximum' be the "
              "greatest of its limits");
    EXPECT_EQ(wrong_variables("{K: {value: 2, above: 2, maximum: 2}}"),
              "m.yaml:3:13: variable 'K' must be greater than 2 and at most 2, which no number is; let "
              "'maximum' be the greatest of its limits");
    EXPECT_EQ(wrong_variables("{K: {value: 2, minimum: 2, maximum: 2}}"), "");
    EXPECT_EQ(wrong_variables("{K: {value: 2, minimum: 'low'}}"),
              "m.yaml:3:36: K: 'minimum' must be a finite number, not 'low'");
    EXPECT_EQ(wrong_variables("{K: {value: 2, maximum: \"[1 2]\"}}"),
              "m.yaml:3:36: K: 'maximum' must be a finite number, not [1 2]");
    EXPECT_EQ(wrong_variables("{K: {value: 2, maximum: 0/0}}"),
              "m.yaml:3:36: K: 'maximum' must be a finite number, not NaN");
    EXPECT_EQ(wrong_variables("{K: {value: 'high', maximum: 1}}"),
              "m.yaml:3:24: variable 'K' must be a number, not 'high'; its declaration gives it limits");
}

TEST(Settings, ReferencesKeepToTheLimitsOfTheFileThatDeclaresThem) {
    const std::filesystem::path folder =
        std::filesystem::path(testing::TempDir()) / ("bf_with_limits_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "inner.yaml")
        << "model: inner\nvariables:\n  top: 4\n"
           "  k: {value: 1, maximum: top}\n  Gain: {Kp: {value: 1, minimum: 0}}\nblocks: {}\n";
    std::ofstream(folder / "outer.yaml")
        << "model: outer\nstep: 1\nvariables: {k: 5, Gain: {Kp: -2}}\n"
           "blocks:\n  a: {file: inner.yaml}\n  b: {file: inner.yaml, with: {k: k}}\n"
           "  c: {file: inner.yaml, with: {Gain: Gain}}\n  d: {file: inner.yaml, with: {Gain: {Kp: -3}}}\n";
    const auto file = (folder / "outer.yaml").string();
    std::string found;
    try {
        elaborate_model(formats::read_yaml(file));
    } catch (const model::Errors& errors) {
        found = errors.what();
    }
    EXPECT_EQ(found, file + ":6:35: variable 'b.k' must be at most 4, but is 5\n" + file +
                         ":7:38: variable 'c.Gain.Kp' must be at least 0, but is -2\n" + file +
                         ":8:43: variable 'd.Gain.Kp' must be at least 0, but is -3");
    std::filesystem::remove_all(folder);
}

TEST(Signals, AreFoundByPathAliasAndPattern) {
    const auto m = elaborate_text(R"m(
model: m
step: 1
inputs: [r]
outputs: [y]
blocks:
  s:
    inputs: [u]
    outputs: [v]
    blocks: {g: {block: Gain}, h: {block: Gain}}
    connections: {u: [g, h], g: v}
  end: {block: Terminator}
connections: {r: s, s: [end, y]}
record: [s, "*.g.y", s.*, end, r, y]
)m");
    std::vector<std::string> paths, ends;
    for (const auto& signal : m.diagram.record) {
        paths.push_back(signal.path);
        ends.push_back(m.diagram.end_path(signal.end));
    }
    EXPECT_EQ(paths, (std::vector<std::string>{"s", "s.g.y", "s.g.y", "s.h.y", "s.v", "end", "r", "y"}));
    EXPECT_EQ(ends, (std::vector<std::string>{"s.g.y", "s.g.y", "s.g.y", "s.h.y", "s.g.y", "s.g.y", "r.y",
                                              "s.g.y"}));
}

} // namespace
} // namespace bf::test
