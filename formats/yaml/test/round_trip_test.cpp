#include "bf/formats/yaml.hpp"

#include "bf/model/builder.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>

namespace bf::formats {
namespace {

using namespace model;

const std::filesystem::path folder = BF_SOURCE_DIRECTORY "/tests/models/yaml";

std::string text_of(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

std::string rewritten(const std::string& text) {
    return canonical_yaml(read_yaml_text(text, (folder / "text.yaml").string()));
}

/// The value of setting `k` in a block written with it.
Expression setting(const std::string& value) {
    const Model model = read_yaml_text("model: m\nblocks:\n  a:\n    block: Gain\n    k: " + value + "\n");
    return model.root.blocks.at(0).settings.at(0).value;
}

class Canonical : public testing::TestWithParam<const char*> {};

TEST_P(Canonical, FilesAreWrittenAsTheyWereRead) {
    const std::filesystem::path file = folder / GetParam();
    ASSERT_GT(text_of(file).size(), 100u);
    EXPECT_EQ(canonical_yaml(read_yaml(file)), text_of(file));
}

INSTANTIATE_TEST_SUITE_P(Samples, Canonical, testing::Values("two_masses.yaml", "pd.yaml", "nested.yaml"),
                         [](const auto& parameter) {
                             return std::filesystem::path(parameter.param).stem().string();
                         });

TEST(Reader, KeepsStructureOrderAndPlaces) {
    const Model model = read_yaml(folder / "nested.yaml");
    EXPECT_EQ(model.name, "nested");
    EXPECT_EQ(model.doc, "Subsystems of every kind,\n\nwith comments at every position.");
    EXPECT_TRUE(model.record_all);
    EXPECT_EQ(model.plugins.at(0).name, "WholeBodyToolbox");
    const Variable& config = model.root.variables.at(0);
    EXPECT_EQ(config.fields.at(0).name, "t_step");
    EXPECT_EQ(config.fields.at(2).fields.at(0).value.text, "[-10, 10]");
    EXPECT_EQ(config.fields.at(2).fields.at(1).value.text, "{'l_knee', 'r_knee'}");

    const Block& pose = *find(model, "pose");
    EXPECT_EQ(pose.type, "WholeBodyToolbox/ForwardKinematics");
    EXPECT_EQ(pose.where.line, 22);
    EXPECT_EQ(pose.where.column, 3);
    EXPECT_EQ(pose.find_setting("frame")->value.text, "l_sole");
    EXPECT_EQ(pose.find_setting("frame")->value.where.column, 60);
    EXPECT_EQ(pose.find_setting("robot")->value.quotes, Quotes::twofold);
    EXPECT_EQ(find(model, "script")->find_setting("code")->value.text,
              "function y = f(u)\n% not a YAML comment: # neither\n  y = max(u, 0);\n\nend\n");

    const Block& controller = *find(model, "controller");
    EXPECT_EQ(controller.period->text, "2*Config.t_step");
    EXPECT_EQ(controller.system->execution, Execution::enabled);
    EXPECT_EQ(controller.system->states, States::reset);
    EXPECT_EQ(controller.system->outputs.at(0).when_disabled, WhenDisabled::reset);
    EXPECT_EQ(controller.system->outputs.at(0).initial->text, "zeros(23, 1)");
    EXPECT_EQ(controller.system->outputs.at(0).unit, "N*m");
    EXPECT_EQ(controller.system->connections.at(3).to.at(0).block, "");
    EXPECT_EQ(controller.system->connections.at(3).to.at(0).port, "tau");

    EXPECT_EQ(find(model, "elsewhere")->reference->with.at(0).name, "n");
    EXPECT_EQ(find(model, "elsewhere.gain")->type, "Gain");
    EXPECT_EQ(model.plots.at(1).title, "Ends: all");
    const Placement& drawn = model.layout.blocks.at(0);
    EXPECT_EQ(drawn.path, "controller");
    EXPECT_EQ(drawn.at, (Point{10, 20}));
    EXPECT_EQ(drawn.size, (Point{80, 40.5}));
    EXPECT_TRUE(model.layout.blocks.at(1).flipped);
    EXPECT_EQ(model.layout.wires.at(0).path, "controller.pd.u");
    EXPECT_EQ(model.layout.wires.at(0).points, (std::vector<Point>{{10, 20}, {10, 50}}));
    EXPECT_EQ(model.layout.notes.at(0).system, "controller");
    EXPECT_EQ(model.layout.notes.at(0).text, "Runs while enabled.");
    EXPECT_EQ(model.layout.displays.at(0).name, "Both ends");
    EXPECT_EQ(model.layout.displays.at(0).shows, Shows::heat_map);
    EXPECT_EQ(model.layout.displays.at(0).signals.at(1).path, "controller.pd");
}

TEST(Reader, TakesSequencesAsMatlabText) {
    EXPECT_EQ(setting("[1, 2, 3]").text, "[1, 2, 3]");
    EXPECT_EQ(setting("[1 2; 3 4]").text, "[1 2; 3 4]");
    EXPECT_EQ(setting("[[1, 2], [3, 4]]").text, "[1, 2; 3, 4]");
    EXPECT_EQ(setting("[[1 2],[3 4],]").text, "[1 2; 3 4]");
    EXPECT_EQ(setting("[[1;2], [3;4]]").text, "[[1;2], [3;4]]");
    EXPECT_EQ(setting("[a', b', 'it''s', x(1, 2)]").text, "[a', b', 'it''s', x(1, 2)]");
    EXPECT_EQ(setting("[]").text, "[]");
    EXPECT_EQ(setting("{'a', {1, 2}}").text, "{'a', {1, 2}}");
    EXPECT_EQ(setting("[1,  # one\n      2]").text, "[1, 2]");
    EXPECT_EQ(setting("[\n      [1, 2],\n      [3, 4]\n    ]").text, "[1, 2; 3, 4]");
    EXPECT_EQ(setting("\n      - 1\n      - a*b").text, "[1, a*b]");
    EXPECT_EQ(setting("\n      - [1, 2]\n      - [3, 4]").text, "[1, 2; 3, 4]");
    EXPECT_EQ(setting("\n      - [1]\n      - [3]").text, "[1; 3]");
}

TEST(Reader, TakesScalarsVerbatim) {
    for (const char* text :
         {"0x10", "1e-3", "true", "yes", "+-", "Config.t_step", "a(1,:)'", "-k/m", "1:3", "x == y"})
        EXPECT_EQ(setting(text).text, text);
    EXPECT_EQ(setting("'l_sole'").matlab(), "'l_sole'");
    EXPECT_EQ(setting("'l_sole'").text, "l_sole");
    EXPECT_EQ(setting("\"[1 2]*pi\"").matlab(), "[1 2]*pi");
    EXPECT_TRUE(setting("\"2\"").quoted());
    EXPECT_FALSE(setting("2").quoted());
}

TEST(Reader, ReadsWindowsLineEndsAndByteOrderMarks) {
    EXPECT_EQ(rewritten("\xef\xbb\xbfmodel: m\r\nstep: 1\r\n"), "model: m\nstep: 1\n");
}

TEST(Writer, PutsSimpleBlocksOnOneLineWhereTheyFit) {
    EXPECT_EQ(rewritten("model: m\nblocks: {a: {block: Gain, K: 2}}"),
              "model: m\nblocks:\n  a: {block: Gain, K: 2}\n");
    const std::string before = "model: m\nblocks:\n  a: {block: Gain, K: ";
    const std::string fits(110 - 2 - 20 - 1, 'x'); // "  a: {block: Gain, K: " has 22 columns, "}" one
    EXPECT_EQ(rewritten(before + fits + "}\n"), before + fits + "}\n");
    EXPECT_EQ(rewritten(before + fits + "x}\n"),
              "model: m\nblocks:\n  a:\n    block: Gain\n    K: " + fits + "x\n");
}

TEST(Writer, KeepsEveryCommentOfUncanonicalFiles) {
    const std::string text =
        "# 1\n\n\n# 2\nmodel:   m # 3\n"
        "inputs: [ # 4\n  q, # 5\n  # 6\n  nu] # 7\n"
        "blocks: # 8\n  a: { # 9\n    block: Gain, # 10\n    # 11\n    K: [1, # 12\n"
        "      # 13\n      2] # 14\n    } # 15\n"
        "     # 16\n  b: # 17\n    # 18\n    block: \"#no\" # 19\n"
        "connections:\n  # 20\n  q: # 21\n    # 22\n    a # 23\n  # 24\n  nu:\n  - b # 25\n  # 26\n"
        "record: # 27\n  - a # 28\nplots: {P: [a, # 29\n  b]} # 30\n# 31\n\n# 32\n\n";
    const std::string once = rewritten(text);
    for (int number = 1; number <= 32; ++number) {
        const std::string comment = "# " + std::to_string(number) + "\n";
        EXPECT_NE(once.find(comment), std::string::npos) << comment << once;
    }
    EXPECT_EQ(rewritten(once), once);
}

TEST(Writer, PutsTheCommentOfAMatrixBehindItsLastLine) {
    const std::string text = "model: m\nblocks:\n  a:\n    block: Gain\n    K: [0;\n        1/m]  # force\n";
    EXPECT_EQ(rewritten(text), text);
}

TEST(Writer, KeepsCommentsWhenAnEditChangesTheModel) {
    Model model = read_yaml(folder / "two_masses.yaml");
    set(*find(model, "plant"), "B", "[0; 2/m]");
    edit(model, operations::Rename{"scope", "display"});
    std::string expected = text_of(folder / "two_masses.yaml");
    auto replace = [&](std::string_view from, std::string_view to) {
        expected.replace(expected.find(from), from.size(), to);
    };
    replace("[0; 1/m]", "[0; 2/m]");
    replace("scope: {", "display: {");
    replace("error.u2, scope", "error.u2, display");
    EXPECT_EQ(canonical_yaml(model), expected);
}

TEST(Writer, KeepsWhatVariablesDeclare) {
    const std::string text =
        "model: m\n"
        "variables:\n"
        "  # of the hip\n"
        "  Gain: {Kp: {value: \"[1 2]\", minimum: 0, above: -1, maximum: 2*pi}, Kd: 3}  # Nm\n"
        "  K:\n"
        "    value: zeros(2, 1)\n"
        "    above: 0\n"
        "  m: {value: 2, unit: kg, doc: of the cart}\n"
        "  d: {value: 0.1, minimum: 0, unit: N s/m}\n"
        "  name: {text: 'l_sole', deep: {values: 1}}\n";
    EXPECT_EQ(rewritten(text), text);
    const Variable& gain = read_yaml_text(text).root.variables.at(0).fields.at(0);
    EXPECT_EQ(gain.value.text, "[1 2]");
    EXPECT_EQ(gain.minimum->text, "0");
    EXPECT_EQ(gain.above->text, "-1");
    EXPECT_EQ(gain.maximum->text, "2*pi");
    const Variable mass = read_yaml_text(text).root.variables.at(2);
    EXPECT_EQ(mass.unit, "kg");
    EXPECT_EQ(mass.doc, "of the cart");
    EXPECT_EQ(rewritten("model: m\nvariables:\n  # torque\n  K:\n    minimum: 0\n    value: 1  # Nm\n"),
              "model: m\nvariables:\n  # torque\n  K: {value: 1, minimum: 0}  # Nm\n");
}

TEST(Writer, KeepsASettingThatIsCalledFile) {
    const std::string text = "model: m\nblocks:\n  a: {block: SignalFromFile, file: a.csv}\n";
    EXPECT_EQ(rewritten(text), text);
    const Block block = std::move(read_yaml_text(text).root.blocks.at(0));
    EXPECT_FALSE(block.reference);
    EXPECT_EQ(block.settings.at(0).value.text, "a.csv");
}

TEST(Writer, WritesWhatABuilderMade) {
    Builder m{"built"};
    m.step(0.001).record({"a", "s.*"}).plot("Torque: all", {"a"});
    m.variable("k", "[1 2; 3 4]'");
    m.variable("Kp", 2, {.minimum = 0, .maximum = "10*pi"});
    m.variable("T", 0.5, {.above = 0, .unit = "s", .doc = "of the filter"});
    const End a = m.add("a", "Gain", {{"K", "[1 2; 3 4]"}, {"text", "'it''s'"}, {"odd", "f(a, b)"}});
    SystemBuilder s = m.atomic_subsystem("s", "0.01");
    s.connect(s.input("u"), s.output("y"));
    m.connect(a, s);
    const std::string text = canonical_yaml(m.build());
    EXPECT_EQ(text, "model: built\n"
                    "step: 0.001\n"
                    "variables:\n"
                    "  k: \"[1 2; 3 4]'\"\n"
                    "  Kp: {value: 2, minimum: 0, maximum: 10*pi}\n"
                    "  T: {value: 0.5, above: 0, unit: s, doc: of the filter}\n"
                    "blocks:\n"
                    "  a:\n"
                    "    block: Gain\n"
                    "    K: [1 2; 3 4]\n"
                    "    text: 'it''s'\n"
                    "    odd: f(a, b)\n"
                    "  s:\n"
                    "    period: 0.01\n"
                    "    execution: atomic\n"
                    "    inputs: [u]\n"
                    "    outputs: [y]\n"
                    "    blocks: {}\n"
                    "    connections:\n"
                    "      u: y\n"
                    "connections:\n"
                    "  a: s\n"
                    "record: [a, s.*]\n"
                    "plots:\n"
                    "  \"Torque: all\": [a]\n");
    EXPECT_EQ(rewritten(text), text);
}

} // namespace
} // namespace bf::formats
