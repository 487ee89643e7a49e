#include "bf/model/chart.hpp"

#include "bf/model/builder.hpp"
#include "bf/model/edit.hpp"
#include "edits.hpp"

#include <gtest/gtest.h>

namespace bf::model {
namespace {

using namespace operations;

constexpr const char* rows = "[1 2 1 0;\n 2 3 0 2*T;\n 3 1 2 0.5]";

Model machine(const std::string& transitions = rows, const std::string& states = "[idle, move, hold]") {
    Builder m("m");
    m.variable("T", 1);
    m.add("machine", "StateMachine", {{"states", states}, {"transitions", transitions}});
    Model model = m.build();
    model.layout.blocks = {{.path = "machine.move", .at = {1, 2}}};
    model.layout.wires = {{.path = "machine.move.1", .points = {{5, 6}}},
                          {.path = "machine.idle.3", .points = {{7, 8}}}};
    return model;
}

std::string text(const Model& model, const char* setting) {
    const Setting* const found = find(model, "machine")->find_setting(setting);
    return found ? found->value.text : "";
}

TEST(Chart, IsWhatTheSettingsSay) {
    const auto chart = chart_of(*find(machine(), "machine"));
    ASSERT_TRUE(chart);
    EXPECT_EQ(chart->states, (std::vector<std::string>{"idle", "move", "hold"}));
    ASSERT_EQ(chart->transitions.size(), 3u);
    EXPECT_EQ(chart->transitions[1].from, 1u);
    EXPECT_EQ(chart->transitions[1].to, 2u);
    EXPECT_EQ(chart->transitions[1].condition, "0");
    EXPECT_EQ(chart->transitions[1].minimum_time, "2*T");
    EXPECT_EQ(chart->name_of(2), "idle.3");
    const auto spaced = chart_of(*find(machine("[1, 2, max(1, 2), [1 2](1); 2 1 0 0;]"), "machine"));
    ASSERT_TRUE(spaced) << "brackets hold their blanks together";
    EXPECT_EQ(spaced->transitions[0].condition, "max(1, 2)");
    EXPECT_TRUE(chart_of(*find(machine(""), "machine"))->transitions.empty());
}

TEST(Chart, IsNotKnownWhereSettingsHaveToBeEvaluated) {
    for (const char* transitions :
         {"rows", "[1 2 0]", "[1 2 0 0; 2 1]", "[1 4 0 0]", "[0 1 0 0]", "[1.5 1 0 0]", "[n 1 0 0]",
          "[1 2 0 0] % note", "[1 2 0 2 * T]", "[1 2 0 )(]", "[[1 2 0 0]", "]["})
        EXPECT_FALSE(chart_of(*find(machine(transitions), "machine"))) << transitions;
    for (const char* states : {"{'a', 'b', 'c'}", "[]", "names(1)"})
        EXPECT_FALSE(chart_of(*find(machine(rows, states), "machine"))) << states;
    EXPECT_FALSE(chart_of(Block{.name = "g", .type = "Gain"}));
    Model model = machine();
    find(model, "machine")->settings.push_back({.name = "chart", .value = {.text = "{\"states\": {}}"}});
    EXPECT_FALSE(chart_of(*find(model, "machine"))) << "it has states in states";
}

TEST(Chart, StatesAreAddedRenamedAndRemovedWithTheirTransitions) {
    Model model = after(machine(), Add{"machine", {.name = "stop"}, {}, Point{10, 20}});
    EXPECT_EQ(text(model, "states"), "[idle, move, hold, stop]");
    EXPECT_EQ(model.layout.blocks.back().path, "machine.stop");
    model = after(machine(), Rename{"machine.move", "go"});
    EXPECT_EQ(text(model, "states"), "[idle, go, hold]");
    EXPECT_EQ(model.layout.blocks[0].path, "machine.go");
    EXPECT_EQ(model.layout.wires[0].path, "machine.go.1");
    model = after(machine(), Remove{"machine.move"});
    EXPECT_EQ(text(model, "states"), "[idle, hold]");
    EXPECT_EQ(text(model, "transitions"), "[2 1 2 0.5]");
    EXPECT_TRUE(model.layout.blocks.empty());
    ASSERT_EQ(model.layout.wires.size(), 1u);
    EXPECT_EQ(model.layout.wires[0].path, "machine.idle.1");
}

TEST(Chart, StatesAreTheSameOnesUnderOtherNames) {
    Model model = machine();
    History history;
    const auto before = [&](const std::string& path) {
        return path_before(history.moved().value(), path).value_or("nothing");
    };
    history.edit(model, Rename{"machine.move", "go"});
    EXPECT_EQ(before("machine.go"), "machine.move");
    EXPECT_EQ(before("machine.hold"), "machine.hold");
    EXPECT_TRUE(history.undo(model));
    EXPECT_EQ(before("machine.move"), "machine.go");
    history.edit(model, Batch{{Rename{"machine.idle", "tmp"}, Rename{"machine.move", "idle"},
                               Rename{"machine.tmp", "move"}, Rename{"machine", "law"}}});
    EXPECT_EQ(before("law"), "machine");
    EXPECT_EQ(before("law.idle"), "machine.move");
    EXPECT_EQ(before("law.move"), "machine.idle");
    EXPECT_EQ(before("law.hold"), "machine.hold") << "with the block";
    history.edit(model, Batch{{Remove{"law.hold"}, Rename{"law.idle", "hold"}}});
    EXPECT_EQ(before("law.hold"), "law.idle");
    history.edit(model, Set{"law", "states", "[move, hold]"});
    EXPECT_EQ(before("law.hold"), "law.hold") << "of a list that is written anew names are what is known";
    history.edit(model, Batch{{Rename{"law.move", "old"}, Add{"law", {.name = "move"}}}});
    EXPECT_EQ(before("law.old"), "law.move");
    EXPECT_EQ(before("law.move"), "nothing") << "another one has come there";
}

TEST(Chart, TheFirstStateStaysTheFirstOneOrBecomesAnother) {
    const Model model = after(machine(), Set{"machine.hold", "initial", "true"});
    EXPECT_EQ(text(model, "initial"), "3");
    EXPECT_EQ(text(after(model, Remove{"machine.move"}), "initial"), "2");
    EXPECT_EQ(text(after(model, Remove{"machine.hold"}), "initial"), "");
    EXPECT_EQ(text(after(model, Set{"machine.idle", "initial", "true"}), "initial"), "");
}

TEST(Chart, TransitionsAreAddedSetAndRemovedInTheSpellingOfTheOthers) {
    EXPECT_EQ(text(after(machine(), Connect{"machine", "hold", "move"}), "transitions"),
              "[1 2 1 0;\n 2 3 0 2*T;\n 3 1 2 0.5;\n 3 2 0 0]");
    EXPECT_EQ(text(after(machine(""), Connect{"machine", "hold", "hold"}), "transitions"), "[3 3 0 0]");
    EXPECT_EQ(text(after(machine("[1 2 0 0]"), Connect{"machine", "move", "idle"}), "transitions"),
              "[1 2 0 0; 2 1 0 0]");
    EXPECT_EQ(text(after(machine(), Set{"machine.hold.2", "minimum_time", "(3 * T)"}), "transitions"),
              "[1 2 1 0;\n 2 3 0 (3 * T);\n 3 1 2 0.5]");
    EXPECT_EQ(text(after(machine(), Set{"machine.idle.3", "condition"}), "transitions"),
              "[1 2 1 0;\n 2 3 0 2*T;\n 3 1 0 0.5]");
    const Model model = after(machine(), Disconnect{"machine", "idle", "move.1"});
    EXPECT_EQ(text(model, "transitions"), "[2 3 0 2*T;\n 3 1 2 0.5]");
    ASSERT_EQ(model.layout.wires.size(), 1u) << "bends follow the numbers of their rows";
    EXPECT_EQ(model.layout.wires[0].path, "machine.idle.2");
    EXPECT_EQ(text(after(machine(), Disconnect{"machine", {}, "idle.3"}), "transitions"),
              "[1 2 1 0;\n 2 3 0 2*T]");
    EXPECT_EQ(text(after(machine("[1 2 0 0]"), Disconnect{"machine", {}, "move.1"}), "transitions"), "[]");
}

/// What is wrong, without place and remedy.
std::string message(const Operation& operation, const Model& model = machine()) {
    const std::string text = refusal(operation, model);
    const auto begin = text.find(": ") + 2;
    return text.substr(begin, text.find("; ", begin) - begin);
}

TEST(Chart, RefusesWhatIsNoChartAnyMore) {
    EXPECT_EQ(message(Add{"machine", {.name = "move"}, {}, {}}), "there is a state 'move' already");
    EXPECT_EQ(message(Add{"machine", {.name = "a.b"}, {}, {}}), "'a.b' is no name for a state");
    EXPECT_EQ(message(Add{"machine", {.name = "g", .type = "Gain"}, {}, {}}),
              "a chart has states, and no blocks");
    EXPECT_EQ(message(Rename{"machine.move", "hold"}), "there is a state 'hold' already");
    EXPECT_EQ(message(Remove{"machine.mov"}), "there is no state 'mov'");
    EXPECT_EQ(message(Remove{"machine.idle"}, machine("", "[idle]")), "a chart has at least one state");
    EXPECT_EQ(message(Connect{"machine", "idle", "x"}), "there is no state 'x'");
    EXPECT_EQ(message(Disconnect{"machine", {}, "move.2"}), "there is no transition 'move.2'");
    EXPECT_EQ(message(Set{"machine.move.1", "condition", "1, 2 3"}),
              "'1, 2 3' is no single entry of a matrix");
    EXPECT_EQ(message(Set{"machine.move.1", "condition", "1] ["}), "'1] [' is no single entry of a matrix");
    EXPECT_EQ(message(Set{"machine.move.1", "K", "1"}), "there is no 'K' to set here");
    EXPECT_EQ(message(Move{"machine.x", {1, 2}}), "there is no state 'x'");
    EXPECT_EQ(message(Group{"machine", {"idle"}, "g"}), "the block is no subsystem");
    EXPECT_EQ(message(Rename{"machine.move.1", "go"}), "'move.1' is a transition, and no state");
    EXPECT_EQ(message(Bend{"machine.move.2", {{1, 2}}}), "there is no transition 'move.2'");
    EXPECT_EQ(message(PlacePort{"machine.move", "to", Side::top}), "a state has no ports");
}

TEST(Chart, SaysWhatOfItsSettingsIsNoChart) {
    const auto defect = [](const std::string& transitions, const std::string& states = "[a, b]") {
        const std::string all = message(Connect{"machine", "a", "b"}, machine(transitions, states)),
                          begin = "the chart cannot be edited: ";
        EXPECT_EQ(all.substr(0, begin.size()), begin);
        return all.substr(std::min(begin.size(), all.size()));
    };
    EXPECT_EQ(defect("rows"), "`transitions` is 'rows', which is evaluated first");
    EXPECT_EQ(defect("[1 2 0 0, 2 1 0]"), "row 1 of `transitions` has 7 entries, '1 2 0 0, 2 1 0'");
    EXPECT_EQ(defect("[1 2 0 0; 2]"), "row 2 of `transitions` has 1 entry, '2'");
    EXPECT_EQ(defect("[1 2 0 (0]"), "row 1 of `transitions` has a bracket too much");
    EXPECT_EQ(defect("[1 2 0 0; n 1 0 0]"), "row 2 leads from 'n', which is no number of a state");
    EXPECT_EQ(defect("[1 3 0 0]"), "row 1 leads to '3', which is no number of a state");
    EXPECT_EQ(defect("", "{'a', 'b'}"), "the state '{'a'' is an expression, which is evaluated first");
    EXPECT_EQ(defect("", "[a, b.c]"), "'b.c' is no name for a state");
    EXPECT_EQ(defect("", "[]"), "`states` has no names");
    EXPECT_EQ(defect("", "[a, b, 'a']"), "a second state 'a'");
    Model model = machine("rows");
    find(model, "machine")->settings[1].value.where = {std::make_shared<std::string>("m.yaml"), 7, 5};
    EXPECT_EQ(refusal(Connect{"machine", "idle", "move"}, model).substr(0, 23), "m.yaml:7:5: machine: th");
}

TEST(Chart, StatesMayHaveQuotesAndBrackets) {
    const Model model = machine("[1 2 0 0]", "[don't, 'lift (left)', \"say \\\"go\\\"\"]");
    EXPECT_EQ(chart_of(*find(model, "machine"))->states,
              (std::vector<std::string>{"don't", "lift (left)", "say \"go\""}));
    EXPECT_EQ(text(after(model, Rename{"machine.don't", "it's, now"}), "states"),
              "['it''s, now', 'lift (left)', \"say \\\"go\\\"\"]");
    EXPECT_EQ(text(after(model, Remove{"machine.lift (left)"}), "states"), "[don't, \"say \\\"go\\\"\"]");
    for (const std::string name :
         {"'", "''", "'a'", "\"", "a, b", "[x]", "it's", "a'b'c", "%", "- x", "\\"}) {
        const Model renamed = after(model, Rename{"machine.don't", name});
        EXPECT_EQ(chart_of(*find(renamed, "machine"))->states[0], name) << text(renamed, "states");
        EXPECT_EQ(text(after(renamed, Rename{"machine." + name, "don't"}), "states"), text(model, "states"));
    }
}

TEST(Chart, TellsWhatCanBeSetOfStatesAndTransitions) {
    const auto of_row = properties(machine(), "machine.hold.2");
    ASSERT_EQ(of_row.size(), 2u);
    EXPECT_EQ(of_row[1].name, "minimum_time");
    EXPECT_EQ(of_row[1].value, "2*T");
    EXPECT_EQ(properties(machine(), "machine.idle")[0].value, "true");
    EXPECT_FALSE(properties(machine(), "machine.move")[0].value);
}

// ---- with states in states

Model nested() {
    Model model = machine();
    Block& block = *find(model, "machine");
    block.settings = {
        {.name = "chart",
         .value = {
             .text =
                 R"x({"inputs": ["force"], "variables": {"up": "0"}, "outputs": ["work", "work.down"], "states": )x"
                 R"x({"idle": {"transitions": [{"to": "last", "if": "force > 2 & ~work", "do": "up = 1"}]}, )x"
                 R"x("work": {"initial": "down", "transitions": [{"to": "idle", "on": "done.state.work"}], )x"
                 R"x("states": {"last": {"history": "shallow", "to": "down"}, )x"
                 R"x("up": {"transitions": [{"to": "down"}, {"to": ["idle"], "on": ["a", "b"], "if": "work.down + down == up"}]}, )x"
                 R"x("down": {}}}}})x",
             .quotes = Quotes::literal}}};
    model.layout.blocks = {{.path = "machine.work.down", .at = {1, 2}}};
    model.layout.wires.clear();
    return model;
}
Model nested(const std::string& text) {
    Model model = nested();
    find(model, "machine")->settings[0].value.text = text;
    return model;
}
std::string chart(const Model& model) { return text(model, "chart"); }
bool has(const Model& model, const std::string& part) { return chart(model).find(part) != std::string::npos; }

TEST(NestedChart, StatesAreAddedAtEachLevel) {
    Model model = after(nested(), Add{"machine.work", {.name = "hold"}, {}, Point{10, 20}});
    EXPECT_TRUE(has(model, R"("down": {}, "hold": {}}}})")) << chart(model);
    EXPECT_EQ(model.layout.blocks.back().path, "machine.work.hold");
    model = after(model, Add{"machine.work.hold", {.name = "inside"}});
    EXPECT_TRUE(has(model, R"("hold": {"states": {"inside": {}}}}}})")) << chart(model);
    model = after(model, Add{"machine", {.name = "off"}});
    EXPECT_TRUE(has(model, R"(, "off": {}}})")) << chart(model);
    EXPECT_EQ(find(model, "machine")->find_setting("chart")->value.quotes, Quotes::literal);
}

TEST(NestedChart, WhateverNamesAStateFollowsItsNewName) {
    Model model = after(nested(), Rename{"machine.work.down", "low"});
    for (const char* part :
         {R"("outputs": ["work", "work.low"])", R"("initial": "low")", R"("history": "shallow", "to": "low")",
          R"([{"to": "low"}, )", R"("if": "work.low + low == up")", R"("low": {}}}}})"})
        EXPECT_TRUE(has(model, part)) << part << "\n" << chart(model);
    EXPECT_EQ(model.layout.blocks[0].path, "machine.work.low");
    model = after(nested(), Rename{"machine.work", "go"});
    for (const char* part : {R"("outputs": ["go", "go.down"])", R"("if": "force > 2 & ~go", "do": "up = 1")",
                             R"("on": "done.state.go")", R"("if": "go.down + down == up")"})
        EXPECT_TRUE(has(model, part)) << part << "\n" << chart(model);
    EXPECT_EQ(model.layout.blocks[0].path, "machine.go.down");
    model = after(nested(), Rename{"machine.work.up", "high"});
    EXPECT_TRUE(has(model, R"(down == up"}]})")) << "the variable has that name " << chart(model);
}

TEST(NestedChart, AStateIsRemovedWithWhatLeadsThere) {
    Model model = after(nested(), Remove{"machine.idle"});
    EXPECT_FALSE(has(model, "idle")) << chart(model);
    EXPECT_TRUE(has(model, R"("up": {"transitions": [{"to": "down"}]})")) << chart(model);
    model = after(nested(), Remove{"machine.work.down"});
    EXPECT_FALSE(has(model, R"("initial")")) << chart(model);
    EXPECT_TRUE(model.layout.blocks.empty());
}

TEST(NestedChart, TransitionsComeAndGoByTheStateThatTheyLeave) {
    Model model = after(nested(), Connect{"machine.work", "down", "up"});
    EXPECT_TRUE(has(model, R"("down": {"transitions": [{"to": "up"}]}})")) << chart(model);
    model = after(model, Disconnect{"machine.work", "up", "up.1"});
    EXPECT_TRUE(has(model, R"("up": {"transitions": [{"to": ["idle"])")) << chart(model);
    model = after(model, Disconnect{"machine", "work", "work.up.1"});
    EXPECT_TRUE(has(model, R"("up": {},)")) << chart(model);
}

TEST(NestedChart, ActionsAndConditionsAreProperties) {
    const auto value = [](const Model& model, const std::string& path, const std::string& name) {
        for (const auto& property : properties(model, path))
            if (property.name == name) return property.value.value_or("none");
        return std::string("unknown");
    };
    EXPECT_EQ(value(nested(), "machine.idle.1", "if"), "force > 2 & ~work");
    EXPECT_EQ(value(nested(), "machine.work.up.2", "on"), "[a, b]");
    EXPECT_EQ(value(nested(), "machine.work", "initial"), "down");
    EXPECT_EQ(value(nested(), "machine.work.down", "initial"), "unknown");
    EXPECT_EQ(value(nested(), "machine.work.last", "history"), "shallow");
    Model model = after(nested(), Set{"machine.work.down", "entry", "up = 0"});
    model = after(model, Set{"machine.work.up.2", "on", "[c, d]"});
    model = after(model, Set{"machine.work.up.2", "if", {}});
    model = after(model, Set{"machine.work.up.1", "after", "0.5"});
    for (const char* part : {R"("down": {"entry": "up = 0"})", R"({"to": ["idle"], "on": ["c", "d"]})",
                             R"({"to": "down", "after": "0.5"})"})
        EXPECT_TRUE(has(model, part)) << part << "\n" << chart(model);
}

TEST(NestedChart, RefusesWhatCannotBeAndSaysWhatToDo) {
    for (const auto& [operation, expected] : std::vector<std::pair<Operation, std::string>>{
             {Add{"machine.work", {.name = "up"}},
              "machine: there is a state 'up' already; use another name"},
             {Add{"machine.work", {.name = "1st"}}, "machine.work: '1st' is no name for a state; it begins "
                                                    "with a letter and has letters, digits and "
                                                    "'_' alone"},
             {Rename{"machine.work.up", "down"},
              "machine: there is a state 'down' already; use another name"},
             {Remove{"machine.work.upp"},
              "machine: there is no state or transition 'work.upp'; did you mean 'work.up'?"},
             {Connect{"machine.work", "last", "up"},
              "machine: 'work.last' is a history, which has no transitions; set its `to`"},
             {Disconnect{"machine.work", "up", "up.7"},
              "machine: there is no transition 'work.up.7'; look at the chart"},
             {Set{"machine.work.up.1", "iff", "1"},
              "machine: there is no 'iff' to set here; did you mean 'if'?"}})
        EXPECT_EQ(refusal(operation, nested()), expected) << to_json(operation);
    Model model = nested();
    find(model, "machine")->settings[0].value.text = R"({"file": "plan.scxml"})";
    EXPECT_EQ(refusal(Add{"machine", {.name = "a"}}, model),
              "machine: its states stand in the file plan.scxml; edit that file");
}

TEST(NestedChart, StaysAsItIsWrittenWhereItIsDrawnAnew) {
    const Model model = nested(R"({"states":{"a":{},"b":null}})");
    EXPECT_EQ(chart(after(model, Move{"machine.b", {1, 2}})), chart(model));
    EXPECT_EQ(refusal(Move{"machine.work.upp", {1, 2}}, nested()),
              "machine: there is no state or transition 'work.upp'; did you mean 'work.up'?");
}

TEST(NestedChart, RefusesWhatIsNoChart) {
    for (const auto& [text, expected] : std::vector<std::pair<std::string, std::string>>{
             {R"({"states": ["a"]})",
              "machine: the `states` of its chart are no mapping; edit it in the file"},
             {R"({"states": {"a": {"regions": "b"}}})",
              "machine: the `regions` of 'a' are no mapping; edit it in the file"},
             {R"({"states": {"a": {"states": {"b": "c"}}}})",
              "machine: the state 'a.b' is no mapping; edit it in the file"},
             {R"({"states": {"a": {"transitions": {"to": "a"}}}})",
              "machine: the `transitions` of 'a' are no list; edit it in the file"}})
        for (const Operation& operation :
             {Operation(Add{"machine", {.name = "d"}}), Operation(Connect{"machine", "a", "a"}),
              Operation(Set{"machine.a", "entry", "x = 1"}), Operation(Remove{"machine.a"}),
              Operation(Rename{"machine.a", "d"}), Operation(Disconnect{"machine", "a", "a.1"})})
            EXPECT_EQ(refusal(operation, nested(text)), expected) << to_json(operation);
    const std::string said = refusal(Set{"machine.idle", "entry", "\xff"}, nested());
    EXPECT_TRUE(said.starts_with("machine: the chart would be no JSON: ")) << said;
    EXPECT_TRUE(said.ends_with("; give texts in UTF-8")) << said;
    EXPECT_EQ(
        refusal(Connect{"machine", "", "idle"}, nested()),
        "machine: there is no state or transition ''; known are 'idle', 'work', 'work.last', 'work.up', "
        "'work.down'");
}

TEST(NestedChart, WhatLeadsToARemovedStateAloneGoesWithIt) {
    Model model = after(nested(), Remove{"machine.work.down"});
    EXPECT_FALSE(has(model, "last")) << "a history without a state to go to is refused " << chart(model);
    EXPECT_TRUE(has(model, R"("outputs": ["work"])")) << chart(model);
    EXPECT_TRUE(has(model, R"("idle": {})")) << "its transition led to the history " << chart(model);
    const Model fork = nested(
        R"({"variables": ["b"], "outputs": ["b", "b.c"], "states": {"a": {"transitions": ["f", {"to": "b"}]}, )"
        R"("f": {"junction": true, "transitions": [{"to": "b"}, "b.c"]}, "b": {"states": {"c": {}, "d": {}}}}})");
    EXPECT_EQ(chart(after(fork, Remove{"machine.b"})),
              R"({"variables": ["b"], "outputs": ["b"], "states": {"a": {}}})")
        << "the first output is the variable";
    EXPECT_TRUE(
        has(after(fork, Remove{"machine.b.c"}), R"("f": {"junction": true, "transitions": [{"to": "b"}]})"));
    const Model one = nested(R"({"outputs": "b", "states": {"a": {}, "b": {}}})");
    EXPECT_EQ(chart(after(one, Remove{"machine.b"})), R"({"states": {"a": {}}})");
    EXPECT_EQ(refusal(Remove{"machine.a"},
                      nested(R"({"states": {"a": {}, "f": {"junction": true, "transitions": ["a"]}}})")),
              "machine: a chart has at least one state; add another one first");
}

TEST(NestedChart, BendsStayWithTheirTransitions) {
    const auto wires = [](const Model& model) {
        std::string all;
        for (const Bends& bends : model.layout.wires)
            all += bends.path.substr(8) + " by " + std::to_string(static_cast<int>(bends.points[0].x)) + ", ";
        return all;
    };
    Model bent = nested();
    bent.layout.wires = {{.path = "machine.work.up.1", .points = {{1, 2}}},
                         {.path = "machine.work.up.2", .points = {{3, 4}}},
                         {.path = "machine.work.up.2.2", .points = {{5, 6}}},
                         {.path = "machine.work.1", .points = {{7, 8}}}};
    const std::string kept = "work.up.1 by 3, work.up.1.2 by 5, work.1 by 7, ";
    EXPECT_EQ(wires(after(bent, Disconnect{"machine.work", "up", "up.1"})), kept);
    EXPECT_EQ(wires(after(bent, Remove{"machine.work.down"})), kept);
    EXPECT_EQ(wires(after(bent, Remove{"machine.idle"})), "work.up.1 by 1, ");
    Model fork = nested(R"({"states": {"a": {}, "b": {}, "f": {"junction": true, "transitions": ["b"]}}})");
    fork.layout.blocks = {{.path = "machine.f"}};
    fork.layout.wires = {{.path = "machine.f.1", .points = {{1, 2}}}};
    fork = after(fork, Remove{"machine.b"});
    EXPECT_TRUE(fork.layout.blocks.empty() && fork.layout.wires.empty());
}

TEST(NestedChart, FormulasFollowWhereTheyNameAState) {
    const auto renamed = [](const std::string& action, const std::string& others = "") {
        const Model model =
            nested("{" + others + R"("states": {"go": {"states": {"in": {}}}, "b": {"entry": ")" + action +
                   R"("}}})");
        const std::string now = chart(after(model, Rename{"machine.go", "run"})), head = R"("entry": ")";
        const std::size_t begin = now.find(head) + head.size();
        return now.substr(begin, now.find('"', begin) - begin);
    };
    EXPECT_EQ(renamed("x = go + go.in + 2*go"), "x = run + run.in + 2*run");
    EXPECT_EQ(renamed("raise go; send go after 2*go; cancel go; raise go.in; if go, x = 1; end"),
              "raise go; send go after 2*run; cancel go; raise go.in; if run, x = 1; end")
        << "events have names of their own";
    EXPECT_EQ(renamed("x = go % go"), "x = run % go");
    EXPECT_EQ(renamed("x = strcmp('go', 'in')"), "x = strcmp('go', 'in')");
    EXPECT_EQ(renamed("x = go(1, go) + a.go"), "x = go(1, run) + a.go")
        << "states are no functions or fields";
    EXPECT_EQ(renamed("x = go", R"("inputs": "go", )"), "x = go") << "the input has that name";
    EXPECT_EQ(renamed("x = go", R"("parameters": ["go"], )"), "x = go");
    EXPECT_EQ(renamed("x = go", R"("variables": "go", "outputs": "go", )"), "x = go");
    const std::string lists =
        chart(after(nested(R"({"variables": ["go"], "outputs": ["go", "b"], "begin": "x = b", )"
                           R"("states": {"go": {}, "b": {"during": ["x = b"], )"
                           R"("transitions": ["b", {"do": ["x = b"]}]}}})"),
                    Rename{"machine.b", "c"}));
    EXPECT_EQ(lists, R"({"variables": ["go"], "outputs": ["go", "c"], "begin": "x = c", )"
                     R"("states": {"go": {}, "c": {"during": ["x = c"], )"
                     R"("transitions": ["c", {"do": ["x = c"]}]}}})");
    EXPECT_TRUE(has(
        after(nested(R"({"inputs": "a", "outputs": "a", "states": {"a": {}}})"), Rename{"machine.a", "b"}),
        R"("inputs": "a", "outputs": "b")"))
        << "inputs are no outputs";
    EXPECT_TRUE(has(after(nested(R"({"variables": ["a"], "outputs": "a", "states": {"a": {}}})"),
                          Rename{"machine.a", "b"}),
                    R"("outputs": "a")"))
        << "which is the variable";
    EXPECT_TRUE(has(
        after(
            nested(
                R"({"states": {"a": {"states": {"x": {}, "y": {"transitions": [{"to": "x", "if": "z"}]}}}, )"
                R"("z": {}}})"),
            Rename{"machine.z", "w"}),
        R"("if": "w")"));
}

} // namespace
} // namespace bf::model
