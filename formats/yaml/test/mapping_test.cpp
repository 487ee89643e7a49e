// Settings that are mappings: the charts of state machines.
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"

#include <gtest/gtest.h>

namespace bf::formats {
namespace {

using namespace model;

const std::string machine = "model: m\n"
                            "step: 0.1\n"
                            "blocks:\n"
                            "  gain: {block: Gain, K: 2}\n"
                            "  machine:\n"
                            "    block: StateMachine\n"
                            "    chart: # of two states\n"
                            "      inputs: [u]\n"
                            "      states:\n"
                            "        # where it begins\n"
                            "        idle:\n"
                            "          entry: n = 0   # anew\n"
                            "          transitions:\n"
                            "            - {to: run, if: \"u > 0.5, n\", after: 1}\n"
                            "        run: {}\n"
                            "        'say \"hi\"':\n"
                            "connections: {gain: machine.u}\n";

Model read_text(const std::string& text) { return read_yaml_text(text, "m.yaml"); }
std::string chart(const Model& model) { return find(model, "machine")->find_setting("chart")->value.text; }

TEST(Mappings, AreKeptAsJsonInTheirOrder) {
    EXPECT_EQ(chart(read_text(machine)),
              R"({"inputs": ["u"], "states": {"idle": {"entry": "n = 0", "transitions": [{"to": "run", )"
              R"("if": "u > 0.5, n", "after": "1"}]}, "run": {}, "say \"hi\"": {}}})");
}

TEST(Mappings, AreReadBackAsTheyAreWritten) {
    const Model model = read_text(machine);
    const Model again = read_text(canonical_yaml(model));
    EXPECT_EQ(model, again) << canonical_yaml(model);
    EXPECT_EQ(canonical_yaml(again), canonical_yaml(model));
}

TEST(Mappings, KeepTheirTextWhereOtherThingsChange) {
    Model model = read_text(machine);
    EXPECT_EQ(write_yaml(model), machine);
    History history;
    history.edit(model, operations::Set{"gain", "K", "3"});
    std::string expected = machine;
    expected.replace(expected.find("K: 2"), 4, "K: 3");
    EXPECT_EQ(write_yaml(model), expected);
}

TEST(Mappings, AreWrittenWhereTheirStatesAreEditedAndReadBackAsTheyAre) {
    Model model = read_text(machine);
    History history;
    history.edit(model, operations::Rename{"machine.run", "go"});
    EXPECT_EQ(chart(model).find("run"), std::string::npos);
    const std::string text = write_yaml(model);
    EXPECT_EQ(read_text(text), model) << text;
    history.undo(model);
    EXPECT_EQ(write_yaml(model), machine);
}

TEST(Mappings, HaveEachKeyOnceAndStandAtChartsAlone) {
    const auto refusal = [](const std::string& text) -> std::string {
        try {
            read_text(text);
        } catch (const Errors& errors) {
            return errors.what();
        }
        return "nothing";
    };
    std::string twice = machine;
    twice.replace(twice.find("        run: {}"), 15, "        idle: {}");
    EXPECT_EQ(refusal(twice).substr(0, 47), "m.yaml:15:9: machine: a second 'idle'; remove o")
        << refusal(twice);
    EXPECT_NE(refusal("model: m\nblocks:\n  g:\n    block: Gain\n    K: {a: 1}\n")
                  .find("is an expression, not a mapping"),
              std::string::npos);
}

} // namespace
} // namespace bf::formats
