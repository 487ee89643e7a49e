// What a chart may say, and what its table says of it.
#include "machine.hpp"

namespace bf::charts::test {
namespace {

Numbers values_after(const std::string& action,
                     const std::string& variables = R"({"x": 1, "y": 2, "z": 0})") {
    Machine m(lower(
        read(R"({"variables": )" + variables + R"(, "states": {"s": {"entry": )" + action + "}}}", "")));
    EXPECT_TRUE(m.step(0));
    return m.values;
}

TEST(Charts, SayWhichInputsTheyReadAndHow) {
    const Table table = lower(read(R"j({"inputs": ["whole", "parts", "both", "none"], "events": ["go"],
        "variables": ["n"], "states": {"s": {"entry": "n = whole + parts(2) + parts(3) - both + both(1)"}}})j",
                                   ""));
    ASSERT_EQ(table.reads.size(), 5u);
    EXPECT_TRUE(table.reads[0].whole && table.reads[0].element == 0);
    EXPECT_TRUE(!table.reads[1].whole && table.reads[1].element == 3);
    EXPECT_TRUE(table.reads[2].whole && table.reads[2].element == 1);
    EXPECT_TRUE(!table.reads[3].whole && table.reads[3].element == 0);
    EXPECT_TRUE(table.reads[4].whole) << "an event";
    EXPECT_EQ(table.ports, (std::vector<std::string>{"whole", "parts", "both", "none", "go"}));
}

TEST(Charts, FlatMachinesKeepTheNamesOfTheirStates) {
    const std::vector<std::string> names{"at rest", "on the way"};
    EXPECT_EQ(lower_flat(names, {1, 2, 0, 0}).states, names);
}

TEST(Charts, RefuseWhatAStateOfItsKindCannotHaveAlsoInTheFirstOne) {
    const std::string other = R"(, "z": {}}})";
    for (const auto& [state, why] :
         {std::pair<std::string, std::string>{
              R"({"final": true, "states": {"b": {}}})",
              "state 'a' has states inside, which only a plain or parallel state has"},
          {R"({"final": true, "transitions": ["z"]})",
           "state 'a' is final and has a transition; nothing leaves a final state"},
          {R"({"junction": true})", "state 'a' is a junction that nothing leaves; give it transitions"},
          {R"({"junction": true, "entry": "raise e", "transitions": ["z"]})",
           "state 'a' has actions, but is never active; let a transition `do` them"},
          {R"({"history": "deep"})",
           "state 'a' is a history and does not say where to go the first time; write `to: STATE`"},
          {R"({"history": "deep", "to": "z", "transitions": ["z"]})",
           "state 'a' is a history and has transitions; write `to: STATE`"},
          {R"({"regions": {}})", "state 'a' has no regions; give it at least one"},
          {R"({"regions": {"r": {"final": true}}})",
           "state 'a.r' is a final state among regions; put it into a region"}})
        EXPECT_NE(refusal(R"({"states": {"a": )" + state + other).find(why), std::string::npos)
            << state << "\n"
            << refusal(R"({"states": {"a": )" + state + other);
}

TEST(Charts, RefuseValuesOfTheWrongKindByStateAndKey) {
    for (const auto& [text, why] :
         {std::pair<std::string, std::string>{R"({"states": {"a": {"final": "maybe"}}})", "true or false"},
          {R"({"states": {"a": {"history": "long", "to": "a"}}})", "shallow or deep"},
          {R"({"states": {"a": {"transitions": "b"}}})", "a list of transitions"},
          {R"({"states": {"a": {"entry": {"x": 1}}}})", "a text"},
          {R"({"states": {"a": {"to": "a"}}})",
           "state 'a' has 'to', which a history has; a state has 'transitions: [{to: ...}]'"},
          {R"({"states": {"a": {"states": {"b": {}}, "regions": {"c": {}}}}})",
           "state 'a' has 'states' and 'regions'; regions are active at once, of states one is"},
          {R"({"states": {"a b": {}}})",
           "state 'a b' is no name; begin with a letter and go on with letters, digits and '_'"},
          {R"({"variables": {"n": "x"}, "states": {"a": {}}})", "the chart: variable 'n' begins with "},
          {R"({"states": ["a"]})", "but must be a mapping of names to states"}})
        EXPECT_NE(refusal(text).find(why), std::string::npos) << text << "\n" << refusal(text);
    EXPECT_EQ(refusal(R"({"states": {"a": {"final": false, "junction": "false", "exit": "raise e"}}})"),
              "nothing");
}

TEST(Charts, ActionsArePartedByCommasSemicolonsAndLinesOutsideOfBrackets) {
    EXPECT_EQ(values_after(R"j("x = 3, y = x + 1; z = max(x, y)")j"), (Numbers{3, 4, 4}));
    EXPECT_EQ(values_after(R"("x = 5 % not y = 9, z = 9\ny = 6")"), (Numbers{5, 6, 0}));
    EXPECT_EQ(values_after(R"(["x = 7", "z = x"])"), (Numbers{7, 2, 7}));
}

TEST(Charts, TakeTheFirstBranchWhoseConditionHolds) {
    const auto taken = [](int x) {
        const std::string start = "{\"x\": " + std::to_string(x) + ", \"y\": 0}";
        return values_after(
                   R"("if x < 1, y = 10; elseif x < 2, if x > 0, y = 20, end; else, y = 30; end; y = y + 1")",
                   start)
            .at(1);
    };
    EXPECT_EQ(taken(0), 11);
    EXPECT_EQ(taken(1), 21);
    EXPECT_EQ(taken(2), 31);
    const auto wrong = [](const std::string& action) {
        return refusal(R"({"variables": ["x"], "states": {"a": {"entry": ")" + action + R"("}}})");
    };
    EXPECT_EQ(wrong("end"), "state 'a', entry: 'end' has no `if` before it");
    EXPECT_EQ(wrong("else, x = 1"), "state 'a', entry: 'else' has no `if` before it");
    EXPECT_EQ(wrong("if x, x = 1, else, x = 2, else, x = 3, end"),
              "state 'a', entry: 'else' stands behind the `else`");
    EXPECT_EQ(wrong("if x, if x, x = 1, else, x = 2, end, else, x = 3, end"), "nothing")
        << "each `if` has an `else` of its own";
    EXPECT_EQ(wrong("x = "),
              "state 'a', entry: 'x =' is no statement; write `variable = formula`, `raise event`, "
              "`send event after formula`, `cancel event` or `if formula`");
    EXPECT_EQ(wrong("raise 3"), "state 'a', entry: 'raise 3' is no statement; write `raise EVENT`");
    EXPECT_EQ(wrong("send e"),
              "state 'a', entry: 'send e' is no statement; write `send EVENT after SECONDS`");
}

TEST(Charts, VariablesMayBeCalledAsStatementsBegin) {
    EXPECT_EQ(values_after(R"("raise = 4; raised = raise + 1; end_ = 6")",
                           R"({"raise": 0, "raised": 0, "end_": 0})"),
              (Numbers{4, 5, 6}));
}

TEST(Charts, ACancelledEventDoesNotComeAndOthersDo) {
    Machine m(lower(read(R"({"variables": ["came"], "states": {"s": {
        "entry": "send one after 0.2; send two after 0.2; cancel one",
        "transitions": [{"on": "one", "do": "came = came + 1"}, {"on": "two", "do": "came = came + 10"}]}}})",
                         "")));
    for (int k = 0; k < 6; ++k) EXPECT_TRUE(m.step(0.1 * k));
    EXPECT_EQ(m.values, Numbers{10});
}

TEST(Charts, HaveTheirStatesByPathAndTheirTransitionsAsArcsThoseOfJunctionsAtTheEnd) {
    const Chart chart = read(R"({"states": {
        "a": {"states": {"b": {"transitions": ["c", {"to": ["p.r1.x", "p.r2.y"], "on": "go"}]}, "c": {}}},
        "j": {"junction": true, "transitions": ["p"]},
        "p": {"transitions": [{"on": "go", "do": "raise e"}],
              "regions": {"r1": {"states": {"x": {}}}, "r2": {"states": {"y": {}}}}}}, "events": ["go"]})",
                             "");
    EXPECT_EQ(state_paths(chart),
              (std::vector<std::string>{"a", "a.b", "a.c", "p", "p.r1", "p.r1.x", "p.r2", "p.r2.y"}))
        << "a junction is never active";
    std::vector<std::pair<std::string, std::vector<std::string>>> found;
    for (const auto& arc : arcs(chart)) found.emplace_back(arc.from, arc.to);
    using Goals = std::vector<std::string>;
    EXPECT_EQ(found, (std::vector<std::pair<std::string, Goals>>{
                         {"a.b", {"a.c"}}, {"a.b", {"p.r1.x", "p.r2.y"}}, {"p", {}}, {"j", {"p"}}}));
}

TEST(Charts, ListTheStatesWhereNoneIsNearTheOneThatIsMissing) {
    EXPECT_EQ(
        refusal(R"({"states": {"a": {"transitions": ["quite.else"], "states": {"b": {}}}, "c": {}}})"),
        "state 'a', transition 1 (to 'quite.else'): there is no state 'quite.else'; the states are a, a.b, "
        "c");
}

TEST(Charts, SuggestThePathThatIsNearTheOneThatIsMissing) {
    EXPECT_EQ(
        refusal(R"({"states": {"walk": {"states": {"left": {}}}, "c": {"transitions": ["walk.lefft"]}}})"),
        "state 'c', transition 1 (to 'walk.lefft'): there is no state 'walk.lefft'; did you mean "
        "'walk.left'?");
}

TEST(Charts, LabelsTellAllThatATransitionNeedsAndDoes) {
    EXPECT_EQ(label_of({.to = {"b"},
                        .events = {"go", "stop"},
                        .condition = "u > 1",
                        .after = "0.2",
                        .every = "3",
                        .action = "n = n + 1\nraise e"}),
              "go, stop [u > 1] after 0.2 s every 3 s / n = n + 1;raise e");
    EXPECT_EQ(label_of({.to = {"b"}}), "");
    EXPECT_EQ(label_of({.to = {"b"}, .action = "raise e"}), "/ raise e");
}

TEST(Charts, FormulasKnowTimeAndPeriodAndHowLongAStateIsActive) {
    Machine m(lower(read(R"({"variables": ["now", "dt", "since"], "states": {
        "a": {"transitions": [{"to": "b", "after": 0.2}]},
        "b": {"during": "now = time; dt = period; since = time_in_state"}}})",
                         "")));
    for (int k = 0; k < 6; ++k) EXPECT_TRUE(m.step(0.1 * k));
    EXPECT_NEAR(m.values[0], 0.5, 1e-12);
    EXPECT_NEAR(m.values[1], 0.1, 1e-12);
    EXPECT_NEAR(m.values[2], 0.3, 1e-12);
}

} // namespace
} // namespace bf::charts::test
