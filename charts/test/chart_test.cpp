#include "machine.hpp"

#include <array>
#include <cmath>
#include <random>

namespace bf::charts::test {
namespace {

Machine machine(const std::string& text) { return Machine(lower(read(text, ""))); }

/// The rule of flat machines, as it is written down: the first row that leaves the state, whose condition
/// holds and whose time is over, at most one in a step.
struct Rows {
    std::vector<std::array<double, 4>> rows;
    double state = 1, entry = 0, in_state = 0;
    bool is_started = false, was_entered = false;

    void step(double time, double period, const Numbers& conditions) {
        was_entered = !is_started;
        in_state = is_started ? time - entry : 0;
        if (!is_started) entry = time;
        is_started = true;
        for (const auto& [from, to, condition, minimum] : rows)
            if (from == state && in_state + 1e-6 * period >= minimum &&
                (condition == 0 || conditions[static_cast<std::size_t>(condition) - 1] != 0)) {
                state = to;
                entry = time;
                in_state = 0;
                was_entered = true;
                return;
            }
    }
};

TEST(Charts, FlatMachinesAreRowsThatAreTriedInTheirOrder) {
    std::mt19937 random(5);
    const auto pick = [&](int n) { return static_cast<double>(random() % static_cast<unsigned>(n)); };
    for (int trial = 0; trial < 100; ++trial) {
        const int states = 1 + static_cast<int>(pick(6)), count = static_cast<int>(pick(12));
        Rows rows;
        Numbers numbers(static_cast<std::size_t>(4 * count));
        for (int i = 0; i < count; ++i) {
            rows.rows.push_back({1 + pick(states), 1 + pick(states), pick(4), 0.1 * pick(5)});
            for (int column = 0; column < 4; ++column)
                numbers[static_cast<std::size_t>(i + column * count)] =
                    rows.rows.back()[static_cast<std::size_t>(column)];
        }
        std::vector<std::string> names;
        for (int s = 1; s <= states; ++s) names.push_back("state " + std::to_string(s));
        Machine machine(lower_flat(names, numbers));
        for (int k = 0; k < 60; ++k) {
            const Numbers conditions{pick(2), pick(2), pick(2)};
            machine.inputs = {conditions};
            EXPECT_TRUE(machine.step(0.1 * k));
            rows.step(0.1 * k, 0.1, conditions);
            ASSERT_EQ(machine.state[0], rows.state) << trial << " " << k;
            ASSERT_EQ(machine.time_in_state[0], rows.in_state);
            ASSERT_EQ(machine.entered[0], rows.was_entered);
        }
    }
}

TEST(Charts, EnterAndLeaveStatesInStates) {
    Machine m = machine(R"({"variables": {"n": 0, "trace": 0}, "states": {
        "idle": {"entry": "n = n + 1", "exit": "trace = 10*trace + 1", "transitions": [{"to": "run", "after": 0.2}]},
        "run": {"entry": "trace = 10*trace + 2", "exit": "trace = 10*trace + 5", "during": "n = n + 10", "states": {
            "slow": {"entry": "trace = 10*trace + 3", "transitions": [{"to": "fast", "after": "0.2"}]},
            "fast": {"exit": "trace = 10*trace + 4",
                     "transitions": [{"to": "idle", "after": 0.1, "do": "trace = 10*trace + 6"}]}}}}})");
    const std::string expected[] = {"idle", "idle", "slow", "slow", "fast", "idle"};
    for (int k = 0; k < 6; ++k) {
        EXPECT_TRUE(m.step(0.1 * k));
        EXPECT_EQ(m.names(), expected[k]) << k;
    }
    EXPECT_EQ(m.values, (Numbers{22, 123456}))
        << "`during` ran twice, and not in the steps of entry and exit";
}

TEST(Charts, TakeOneTransitionInAStepAndSeeEventsInTheNextOne) {
    Machine m = machine(R"({"events": ["go"], "states": {
        "a": {"transitions": [{"to": "b", "on": "go"}]}, "b": {"entry": "raise on", "transitions": ["c"]},
        "c": {"transitions": [{"to": "d", "on": "on"}, {"to": "e"}]}, "d": {}, "e": {}}})");
    std::string seen;
    for (int k = 0; k < 6; ++k) {
        m.inputs = {{k == 2 ? 1. : 0.}};
        EXPECT_TRUE(m.step(0.1 * k));
        seen += m.names();
    }
    EXPECT_EQ(seen, "aabcee") << "the event lasts one step, in which the way to c is taken";
}

TEST(Charts, RegionsRunAtOnceAndTellEachOther) {
    Machine m = machine(R"({"states": {"walk": {"regions": {
        "left": {"states": {"stance": {"transitions": [{"to": "swing", "if": "right.stance", "after": 0.1}]},
                            "swing": {"transitions": [{"to": "stance", "after": 0.2, "do": "raise down"}]}}},
        "right": {"states": {"stance": {"transitions": [{"to": "swing", "on": "down"}]},
                             "swing": {"transitions": [{"to": "stance", "after": 0.2}]}}}}}}})");
    std::string seen;
    for (int k = 0; k < 7; ++k) {
        EXPECT_TRUE(m.step(0.1 * k));
        seen += (k ? "\n" : "") + m.names();
    }
    EXPECT_EQ(seen,
              "walk left.stance right.stance\nwalk left.swing right.stance\nwalk left.swing right.stance\n"
              "walk left.stance right.stance\nwalk left.swing right.swing\nwalk left.swing right.swing\n"
              "walk left.stance right.stance")
        << "walk.left.stance is called by as much of its path as no other state has";
}

TEST(Charts, AnEventOfWhatAStateDoesIsTakenInTheSameStepOfARunToCompletion) {
    Machine m = machine(R"({"run_to_completion": true, "states": {
        "a": {"during": "raise e", "transitions": [{"to": "b", "on": "e"}]}, "b": {}}})");
    EXPECT_TRUE(m.step(0));
    EXPECT_EQ(m.names(), "a") << "nothing is done in the step of the entry";
    EXPECT_TRUE(m.step(0.1));
    EXPECT_EQ(m.names(), "b");
}

TEST(Charts, WaysWithoutNumberAndHistoriesWithoutEndAreRefused) {
    std::string text = R"({"states": {"s": {"transitions": [{"to": "j0"}]}, "j40": {})";
    for (int i = 0; i < 40; ++i) {
        const std::string next = "{\"to\": \"j" + std::to_string(i + 1) + "\"";
        text += ", \"j" + std::to_string(i) + "\": {\"junction\": true, \"transitions\": [" + next +
                ", \"if\": \"p > 1\"}, " + next + "}]}";
    }
    text += R"(}, "parameters": ["p"]})";
    EXPECT_NE(refusal(text).find("more than 1000 ways lead through its junctions"), std::string::npos)
        << refusal(text);
    EXPECT_NE(refusal(R"({"states": {"s": {"transitions": [{"to": "h"}]},
        "p": {"states": {"a": {}, "h": {"history": "shallow", "to": "h"}}}}})")
                  .find("is a history and leads to"),
              std::string::npos);
}

TEST(Charts, RegionsAreActiveFromTheirEntryUntilTheyAreLeft) {
    Machine m = machine(R"({"variables": ["around", "first", "second", "last", "left"], "states": {
        "on": {"entry": "around = r1 + 2*r2", "exit": "left = r1 + 2*r2", "transitions": [{"to": "off", "after": 0.1}],
            "regions": {"r1": {"entry": "first = r1 + 2*r2", "exit": "last = r1 + 2*r2"},
                        "r2": {"entry": "second = r1 + 2*r2"}}},
        "off": {}}})");
    EXPECT_TRUE(m.step(0));
    EXPECT_EQ(m.values, (Numbers{0, 1, 3, 0, 0})) << "entered from the outside in, the first one first";
    EXPECT_TRUE(m.step(0.1));
    EXPECT_EQ(m.values, (Numbers{0, 1, 3, 1, 0})) << "left in the opposite order";
}

TEST(Charts, HistoriesRememberAndTimersCount) {
    const auto seen = [](const std::string& kind) {
        Machine m = machine(R"({"events": ["stop", "go"], "variables": ["ticks"], "states": {
            "on": {"transitions": [{"to": "off", "on": "stop"}, {"every": 0.2, "do": "ticks = ticks + 1"}], "states": {
                "h": {"history": ")" +
                            kind + R"(", "to": "a"},
                "a": {"transitions": [{"to": "b", "after": 0.1}]},
                "b": {"states": {"b1": {"transitions": [{"to": "b2", "after": 0.1}]}, "b2": {}}}}},
            "off": {"transitions": [{"to": "h", "on": "go"}]}}})");
        std::string all;
        for (int k = 0; k < 9; ++k) {
            m.inputs = {{k == 3 ? 1. : 0.}, {k == 4 ? 1. : 0.}};
            EXPECT_TRUE(m.step(0.1 * k));
            all += m.names() + " ";
        }
        return all + std::to_string(static_cast<int>(m.values[0]));
    };
    EXPECT_EQ(seen("deep"), "a b1 b2 off b2 b2 b2 b2 b2 2");
    EXPECT_EQ(seen("shallow"), "a b1 b2 off b1 b2 b2 b2 b2 2");
}

/// SCXML 3.10: "deep" is all that was active in the state when it was left, wherever its history stands.
TEST(Charts, DeepHistoriesOfParallelStatesRememberRegionsThatAreParallel) {
    const std::string regions =
        R"("b": {"states": {"b1": {"transitions": [{"to": "b2", "on": "go"}]}, "b2": {}}},
                                   "c": {"states": {"c1": {"transitions": [{"to": "c2", "on": "go"}]}, "c2": {}}})";
    const auto history = [](const std::string& to) {
        return R"("h": {"history": "deep", "to": ")" + to + R"("})";
    };
    const std::string inner = R"("x": {"regions": {)" + regions + "}}";
    for (const std::string& inside :
         {history("x") + ", " + inner, history("x") + R"(, "idle": {}, "y": {"regions": {)" + inner + "}}",
          R"("x": {"regions": {)" + history("b1") + ", " + regions + "}}"}) {
        Machine m = machine(R"({"events": ["go", "out", "back"], "states": {
            "p": {"transitions": [{"to": "away", "on": "out"}], "regions": {)" +
                            inside + R"(}}, "away": {"transitions": [{"to": "h", "on": "back"}]}}})");
        for (const auto& [event, active] :
             {std::pair(-1, "b1 c1"), {0, "b2 c2"}, {1, "away"}, {2, "b2 c2"}}) {
            m.inputs = {{event == 0 ? 1. : 0.}, {event == 1 ? 1. : 0.}, {event == 2 ? 1. : 0.}};
            EXPECT_TRUE(m.step(0));
            EXPECT_NE(m.names().find(active), std::string::npos) << inside << m.names();
        }
    }
}

TEST(Charts, SendAtOnceWhatHasAComputedDelayBelowZero) {
    for (const double delay : {0., -1.}) {
        Machine m = machine(R"({"parameters": ["T"], "states": {
            "a": {"entry": "send e after T", "transitions": [{"to": "b", "on": "e"}]}, "b": {}}})");
        m.p = {delay};
        EXPECT_TRUE(m.step(0));
        EXPECT_TRUE(m.step(0.1));
        EXPECT_EQ(m.names(), "b") << delay;
    }
}

TEST(Charts, TakeOfEventsDueAtOneInstantThatSentFirstFirst) {
    // Transitions name the events the other way round, and are read before actions of entry.
    const auto order = [](const std::string& entry, const std::vector<double>& times, int first_input) {
        Machine m = machine(R"({"run_to_completion": true, "events": ["one", "two"], "variables": ["order"],
            "states": {"s": {"entry": ")" +
                            entry + R"(", "transitions": [
                {"on": "b", "do": "order = 10*order + 2"}, {"on": "a", "do": "order = 10*order + 1"},
                {"on": "two", "do": "send b after 0.05"}, {"on": "one", "do": "send a after 0.2"}]}}})");
        for (std::size_t k = 0; k < times.size(); ++k) {
            const auto input = static_cast<int>(k) - first_input;
            m.inputs = {{input == 0 ? 1. : 0.}, {input == 1 ? 1. : 0.}};
            EXPECT_TRUE(m.step(times[k]));
        }
        return m.values[0];
    };
    EXPECT_EQ(order("send a after 0.3; send b after 0.3", {0, 0.1, 0.2, 0.3}, 9), 12);
    EXPECT_EQ(order("send b after 0.3; send a after 0.3", {0, 0.1, 0.2, 0.3}, 9), 21);
    EXPECT_EQ(order("send a after 0; send b after 0", {0}, 9), 12);
    EXPECT_EQ(order("send a after 0.29; send b after 0.26", {0, 0.3}, 9), 21) << "the earlier one of a step";
    EXPECT_EQ(order("send a after 0.3; send b after 0.3; cancel a; send a after 0.3", {0, 0.3}, 9), 21)
        << "what is sent anew counts from then on";
    ASSERT_GT(0.1 + 0.2, 0.25 + 0.05) << "of two roundings of one instant the order is not asked";
    EXPECT_EQ(order("order = 0", {0, 0.1, 0.25, 0.3}, 1), 12);
}

TEST(Charts, TakeOneTransitionOfAStateInAStepWhicheverTimesAreOver) {
    const auto counts = [](const std::string& transitions) {
        Machine m = machine(R"({"variables": ["fast", "slow"], "states": {"s": {"transitions": [)" +
                            transitions + R"(]}, "t": {}}})");
        for (int k = 0; k <= 20; ++k) EXPECT_TRUE(m.step(0.1 * k));
        return std::pair(m.values[0], m.values[1]);
    };
    const std::string fast = R"({"every": 0.1, "do": "fast = fast + 1"})",
                      slow = R"({"every": 0.5, "do": "slow = slow + 1"})";
    EXPECT_EQ(counts(fast + "," + slow), std::pair(20., 0.)) << "every period of it is missed";
    EXPECT_EQ(counts(slow + "," + fast), std::pair(16., 4.));
    EXPECT_EQ(
        counts(R"({"after": 1, "to": "t", "do": "slow = 1"}, {"after": 1, "to": "t", "do": "fast = 1"})"),
        std::pair(0., 1.));
    EXPECT_EQ(counts(fast + R"(, {"after": 1, "to": "t", "do": "slow = 1"})"), std::pair(20., 0.));
    EXPECT_EQ(counts(slow + R"(, {"after": 1, "to": "t", "do": "fast = fast + 1"})"), std::pair(1., 2.))
        << "an `after` is still over a step later";
}

TEST(Charts, EveryCountsPeriodsWhateverTheStep) {
    for (const double T : {0.1, 0.3, 0.25, 0.7}) {
        Machine m = machine(R"({"parameters": ["T"], "variables": ["n"], "states": {
            "s": {"transitions": [{"every": "T", "do": "n = n + 1"}]}}})");
        m.p = {T};
        for (int k = 0; k <= 100; ++k) {
            EXPECT_TRUE(m.step(0.1 * k));
            EXPECT_EQ(m.values[0], std::floor((0.1 * k + 1e-7) / T)) << T << " " << k;
        }
    }
}

TEST(Charts, JunctionsAreOneTransitionForEachWay) {
    Machine m = machine(R"({"inputs": ["u"], "variables": ["n"], "states": {
        "a": {"transitions": [{"to": "j", "if": "u > 0", "do": "n = n + 1"}]},
        "j": {"junction": true, "transitions": [{"to": "b", "if": "u > 10"}, {"to": "k", "do": "n = n + 10"}]},
        "k": {"junction": true, "transitions": [{"to": "c", "if": "u > 5", "do": "n = n + 100"}]},
        "b": {}, "c": {}}})");
    for (const double u : {0., 3., 7.}) {
        EXPECT_EQ(m.names(), u == 0 ? "-" : "a") << "no way leads through, so that nothing is done";
        m.inputs = {{u}};
        EXPECT_TRUE(m.step(0.1 * u));
    }
    EXPECT_EQ(m.names(), "c");
    EXPECT_EQ(m.values[0], 111);
}

TEST(Charts, TellsWhereAStepDoesNotEnd) {
    Machine m = machine(R"({"run_to_completion": true, "states": {"a": {"transitions": ["b"]},
                                                                   "b": {"transitions": ["a"]}}})");
    EXPECT_FALSE(m.step(0));
    Machine events = machine(R"({"run_to_completion": true, "variables": ["n"], "states": {
        "a": {"entry": "raise x; raise x", "transitions": [{"on": "x", "do": "raise x; raise x"}]}}})");
    EXPECT_FALSE(events.step(0));
    Machine timers = machine(R"({"run_to_completion": true, "states": {
        "a": {"entry": "send tick after 0", "transitions": [{"on": "tick", "do": "send tick after 0"}]}}})");
    EXPECT_FALSE(timers.step(0)) << "what is sent without a delay is due in the same step";
}

TEST(Charts, NameWhatIsWrongWithStateAndTransition) {
    EXPECT_EQ(refusal("chart"),
              "'chart' is no chart; write it as a mapping, `chart: {states: {...}}`, or as JSON");
    const auto umlauts = [](int count) {
        std::string text;
        for (int i = 0; i < count; ++i) text += "\u00e4";
        return text;
    };
    EXPECT_EQ(refusal("x" + umlauts(60)),
              "'x" + umlauts(14) + " ... (121 bytes) ... " + umlauts(5) +
                  "' is no chart; write it as a mapping, `chart: {states: {...}}`, or as JSON")
        << "no character is cut";
    EXPECT_EQ(refusal("{}"), "the chart has no states; write `states: {idle: {}}`");
    EXPECT_EQ(refusal(R"({"states": {"a": {"entri": "x = 1"}}})"),
              "state 'a' has no 'entri'; did you mean 'entry'?");
    EXPECT_EQ(refusal(R"({"states": {"idle": {"transitions": [{"to": "rum", "if": "1"}]}, "run": {}}})"),
              "state 'idle', transition 1 (to 'rum'): there is no state 'rum'; did you mean 'run'?");
    EXPECT_EQ(
        refusal(
            R"({"states": {"a": {"transitions": [{"to": "a", "if": "sped > 1"}]}}, "inputs": ["speed"]})"),
        "state 'a', transition 1 (to 'a'), if: 'sped > 1', character 1: unknown variable or "
        "function 'sped'; formulas know time_in_state, time, period, the names of states, speed");
    EXPECT_EQ(refusal(R"({"states": {"a": {"entry": "m = 1"}}, "variables": ["n"]})"),
              "state 'a', entry: there is no variable 'm' to assign to; did you mean 'n'?");
    EXPECT_EQ(refusal(R"({"states": {"a": {"entry": "go faster"}}})"),
              "state 'a', entry: 'go faster' is no statement; write `variable = formula`, `raise event`, "
              "`send event "
              "after formula`, `cancel event` or `if formula`");
    EXPECT_EQ(
        refusal(R"({"states": {"a": {"transitions": [{"to": "b", "on": "go"}]}, "b": {}}})"),
        "state 'a', transition 1 (to 'b'): nothing is the event 'go'; name it among the 'events', which are "
        "inputs, or raise it in an action");
    EXPECT_EQ(
        refusal(
            R"({"states": {"j": {"junction": true, "transitions": ["j"]}, "a": {"transitions": ["j"]}}})"),
        "state 'a', transition 1 (to 'j'): leads in a circle through state 'j'");
    EXPECT_EQ(refusal(R"({"states": {"p": {"regions": {"x": {"states": {"x1": {}, "x2": {}}}, "y": {}}},
                                     "a": {"transitions": [{"to": ["x1", "x2"]}]}}})"),
              "state 'a', transition 1 (to 'x1 x2'): state 'p.x.x1' and state 'p.x.x2' are never active at "
              "once; goals "
              "lie in different regions");
    for (const std::string period : {"0", "-1", "2 - 3"})
        EXPECT_EQ(
            refusal(R"({"states": {"a": {"transitions": [{"to": "a", "every": ")" + period + R"("}]}}})"),
            "state 'a', transition 1 (to 'a'): the period `every` is " +
                std::string(period == "0" ? "0" : "-1") + ", but must be more than 0");
    EXPECT_EQ(refusal(R"({"states": {"a": {"entry": "send e after -1"}}})"),
              "state 'a', entry: the delay of 'e' is -1, but must not be negative");
    EXPECT_EQ(
        refusal(R"({"events": ["done.state.a"], "states": {"a": {"states": {"b": {"final": true}}}}})"),
        "state 'a': 'done.state.a' is an input, which the chart cannot raise; give its own event another "
        "name");
    EXPECT_EQ(
        refusal(R"({"states": {"a": {"transitions": [{"after": 1}], "entry": "if n"}}, "variables": ["n"]})"),
        "state 'a', entry: an `if` has no `end`");
}

TEST(Charts, AskWhichOfTwoIsMeantByAName) {
    EXPECT_EQ(refusal(R"({"variables": ["a", "v"], "states": {"a": {"entry": "v = a"}}})"),
              "state 'a', entry: 'a', character 1: 'a' is a number of the chart and state 'a', too; give one "
              "of them "
              "another name");
    EXPECT_EQ(refusal(R"({"variables": ["v"], "states": {"time": {"entry": "v = time"}}})"),
              "state 'time', entry: 'time', character 1: 'time' is what formulas know anyway and state "
              "'time', too; "
              "give one of them another name");
    EXPECT_EQ(refusal(R"({"variables": {"a": 1}, "states": {"a": {"entry": "a = 2"}, "time": {}}})"),
              "nothing")
        << "an action assigns to variables alone, and nothing asks for the state";
}

TEST(Charts, WhatIsDueHappensEvenIfAnInputOfThatStepSendsItAnew) {
    Machine m = machine(R"({"run_to_completion": true, "events": ["again"], "variables": ["came"],
        "states": {"s": {"entry": "send late after 0.2",
                         "transitions": [{"to": "s", "on": "again"}, {"on": "late", "do": "came = came + 1"}]}}})");
    const auto step = [&](double time, double again) {
        m.inputs[0] = {again};
        EXPECT_TRUE(m.step(time));
        return m.values[0];
    };
    EXPECT_EQ(step(0, 0), 0);
    EXPECT_EQ(step(0.1, 1), 0) << "sent anew, for 0.3 s";
    EXPECT_EQ(step(0.2, 0), 0);
    EXPECT_EQ(step(0.3, 1), 1) << "its time has come";
    EXPECT_EQ(step(0.4, 0), 1);
    EXPECT_EQ(step(0.5, 0), 2) << "and that of the one that was sent then";
}

TEST(Charts, ChooseNoMoreTransitionsAtOnceThanAStepHasPlacesFor) {
    const auto parallel = [](int count) {
        std::string regions;
        for (int i = 0; i < count; ++i)
            regions += (i > 0 ? ", \"r" : "\"r") + std::to_string(i) +
                       R"(": {"states": {"a": {"transitions": ["b"]}, "b": {}}})";
        return "{\"regions\": {" + regions + "}}";
    };
    Machine most = machine("{\"states\": {\"p\": " + parallel(32) + "}}");
    EXPECT_TRUE(most.step(0));
    for (std::size_t r = 1; r < most.state.size(); ++r)
        EXPECT_EQ(most.table.states[static_cast<std::size_t>(most.state[r]) - 1],
                  "r" + std::to_string(r - 1) + ".b");
    EXPECT_EQ(refusal("{\"states\": {\"p\": " + parallel(33) + "}}"),
              "the chart has 33 states without states inside that can be active at once; 32 are the most, "
              "join regions");
    EXPECT_EQ(refusal("{\"states\": {\"p\": " + parallel(20) + ", \"q\": " + parallel(20) + "}}"), "nothing")
        << "of states that are never active at once the larger number counts";
}

TEST(Charts, AreNotDeeperThanTheirReader) {
    std::string deep = "{}";
    for (int i = 0; i < 5000; ++i) deep = "{\"states\": {\"a\": " + deep + "}}";
    EXPECT_EQ(refusal(deep), "state 'a' is nested too deeply; 50 levels are the most");
}

} // namespace
} // namespace bf::charts::test
