// A run that goes on as a run of another diagram.
#include "bf/engine/handover.hpp"
#include "support.hpp"

#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <random>

namespace bf::test {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

const std::vector<const char*> signals{"slow", "fast", "plant", "s.y", "t.y", "gain"};

Values everything(Session& run, int steps) {
    Values all;
    for (int k = 0; k < steps; ++k) {
        if (!run.simulation->step()) throw std::runtime_error(run.simulation->failure());
        for (const char* signal : signals)
            for (const double x : run.values(signal)) all.push_back(x);
    }
    return all;
}

/// A new block stands in front of the others, so that nodes, slots and flags have other numbers.
const std::string with_more = replaced(multirate, "blocks:\n",
                                       "blocks:\n  first: {block: UnitDelay, initial: \"[7 8 9]\"}\n"
                                       "  three: {block: Constant, value: \"[1 2 3]\"}\n");
const std::string with_more_wired =
    replaced(with_more, "connections: {sine:", "connections: {three: first, sine:");

TEST(Handover, AnotherDiagramGoesOnWithTheSameBitsWhereBothAreTheSame) {
    for (const int instant : {0, 1, 2, 3, 5, 8, 13}) {
        Session run(multirate), other(with_more_wired);
        if (instant > 0) everything(run, instant);
        other.simulation->go_on_from(*run.simulation);
        EXPECT_EQ(other.simulation->steps(), instant);
        EXPECT_EQ(everything(other, 20), everything(run, 20)) << instant;
        const Handover between = handover(*run.simulation, *other.simulation);
        EXPECT_TRUE(between.lost.empty());
        EXPECT_EQ(between.begun, std::vector<std::string>{"first.x"});
    }
}

TEST(Handover, SaysWhichStatesHaveNoPlaceInTheOtherDiagram) {
    const Session run(multirate), narrow(replaced(multirate, "\"[3 5]\"", "\"[3 5 7]\""));
    const Session without(
        replaced(replaced(multirate, "  fast: {block: DiscreteIntegrator}\n", ""), "fast, ", ""));
    const Session other(replaced(multirate, "fast: {block: DiscreteIntegrator}", "fast: {block: UnitDelay}"));
    EXPECT_EQ(handover(*run.simulation, *narrow.simulation).lost.front(),
              "'slow.x' is 3x1 double and was 2x1 double");
    EXPECT_EQ(handover(*run.simulation, *without.simulation).lost,
              (std::vector<std::string>{"'fast.x' is no longer there", "'fast.before' is no longer there"}));
    EXPECT_EQ(handover(*run.simulation, *other.simulation).begun, std::vector<std::string>{"fast.x"});
}

TEST(Handover, ParametersAndConstantsAreThoseOfTheNewDiagram) {
    Session run(multirate), other(replaced(multirate, "K: 2", "K: 4"));
    everything(run, 4);
    const double plant = run("plant");
    other.simulation->go_on_from(*run.simulation);
    everything(other, 1);
    everything(run, 1);
    EXPECT_EQ(other("gain"), 2 * run("gain"));
    EXPECT_EQ(other("plant"), run("plant")) << plant;
}

TEST(Handover, ATimeWithinAStepOfTheNewDiagramIsRefused) {
    Session run(multirate), other(replaced(replaced(multirate, "step: 0.1", "step: 0.2"),
                                           "period: 0.3, offset: 0.1", "period: 0.6, offset: 0.2"));
    everything(run, 3);
    try {
        other.simulation->go_on_from(*run.simulation);
        FAIL() << "it went on";
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(),
                     "t = 0.30000000000000004 s lies within a step of 0.2 s; go on from a multiple "
                     "of it, or start anew");
    }
    everything(run, 1);
    other.simulation->go_on_from(*run.simulation);
    EXPECT_EQ(other.simulation->steps(), 2);
}

// ---- blocks that have other paths

const std::string two = R"m(
model: m
step: 0.1
blocks:
  one: {block: Constant, value: 1}
  a: {block: DiscreteIntegrator, initial: 5}
  b: {block: DiscreteIntegrator, initial: 50, gain: 2}
  s:
    execution: enabled
    inputs: [u]
    outputs: [y]
    blocks:
      c: {block: DiscreteIntegrator, initial: 500}
    connections: {u: c, c: y}
  on: {block: Pulse, period: 0.4, width: 0.2}
connections: {one: [a, b, s.u], on: s.enable}
)m";

/// Letters stand for names.
std::string renamed(std::string text, const std::map<std::string, std::string>& names) {
    std::string result;
    for (std::size_t i = 0; i < text.size();) {
        std::size_t end = i;
        while (end < text.size() && std::isalnum(static_cast<unsigned char>(text[end]))) ++end;
        const std::string word = text.substr(i, std::max<std::size_t>(end - i, 1));
        const auto found = names.find(word);
        result += found == names.end() ? word : found->second;
        i += word.size();
    }
    return result;
}

TEST(Handover, StatesFollowBlocksThatHaveOtherPaths) {
    const std::map<std::string, std::string> names{{"a", "b"}, {"b", "a"}, {"s", "t"}, {"c", "d"}};
    Session run(two), alone(two), other(renamed(two, names));
    run.trace("a", 7);
    alone.trace("a", 7);
    const std::map<std::string, std::string> before{{"a", "b"}, {"b", "a"}, {"t", "s"}, {"t.d", "s.c"}};
    const Origin origin = [&](const std::string& path) -> std::optional<std::string> {
        const auto found = before.find(path);
        return found == before.end() ? path : found->second;
    };
    EXPECT_TRUE(handover(*run.simulation, *other.simulation, origin).lost.empty());
    EXPECT_TRUE(handover(*run.simulation, *other.simulation, origin).begun.empty());
    EXPECT_FALSE(handover(*run.simulation, *other.simulation).lost.empty()) << "by their paths";
    other.simulation->go_on_from(*run.simulation, origin);
    for (int k = 0; k < 12; ++k) {
        alone.trace("a", 1);
        other.trace("a", 1);
        EXPECT_EQ(other("b"), alone("a"));
        EXPECT_EQ(other("a"), alone("b"));
        EXPECT_EQ(other("t.d"), alone("s.c")) << k;
    }
}

TEST(Handover, TwoBlocksThatAreWhatTheOtherOneWasHavePerhapsExchangedTheirNames) {
    using Pairs = std::vector<std::pair<std::string, std::string>>;
    const Session run(two), same(two), more(replaced(two, "gain: 2", "gain: 3"));
    const Session crossed(renamed(two, {{"a", "b"}, {"b", "a"}}));
    EXPECT_EQ(exchanged(run.diagram, same.diagram), Pairs());
    EXPECT_EQ(exchanged(run.diagram, more.diagram), Pairs());
    EXPECT_EQ(exchanged(run.diagram, crossed.diagram), (Pairs{{"a", "b"}}));
    const std::string chain = R"m(
model: m
step: 0.1
blocks:
  one: {block: Constant}
  f: {inputs: [u], outputs: [y], blocks: {x: {block: UnitDelay}}, connections: {u: x, x: y}}
  g: {inputs: [u], outputs: [y], blocks: {x: {block: UnitDelay}}, connections: {u: x, x: y}}
connections: {one: f, f: g}
)m";
    const Session straight(chain), turned(renamed(chain, {{"f", "g"}, {"g", "f"}}));
    EXPECT_EQ(exchanged(straight.diagram, turned.diagram), (Pairs{{"f", "g"}})) << "subsystems, in a row";
}

// ---- numbers that stand for names

/// A chart whose state is `run` from 0.4 s on, beside a signal that holds it between its hits.
std::string chart(const std::string& states, const std::string& transitions, const std::string& more = "") {
    return "model: m\nstep: 0.1\nblocks:\n  c: {block: StateMachine, period: 0.2, states: " + states +
           ", transitions: \"" + transitions + "\"" + more +
           "}\n  fast: {block: Gain, period: 0.1}\nconnections: {c.state: fast}\n";
}
const std::string four = chart("[idle, fill, run, trip]", "[1 2 0 0.2; 2 3 0 0.2; 3 4 0 1; 4 1 0 0.4]");

TEST(Handover, AChartKeepsItsActiveStateByNameWhateverItsNumber) {
    for (const int instant : {5, 6, 9}) { // between hits and at one
        for (const auto& [text, run_is] :
             {std::pair(chart("[fill, run, trip]", "[1 2 0 0.2; 2 3 0 1]"), 2.0),
              {chart("[trip, run, fill, idle]", "[4 3 0 0.2; 3 2 0 0.2; 2 1 0 1; 1 4 0 0.4]", ", initial: 4"),
               2.0},
              {chart("[before, idle, fill, wait, run, trip]", "[2 3 0 0.2; 3 5 0 0.2; 5 6 0 1; 6 2 0 0.4]"),
               5.0}}) {
            Session run(four), other(text);
            run.trace("fast", instant);
            ASSERT_EQ(run("fast"), 3) << "it runs";
            EXPECT_EQ(handover(*run.simulation, *other.simulation).lost, std::vector<std::string>());
            other.simulation->go_on_from(*run.simulation);
            for (int k = instant; k < 14; ++k) { // until it trips after 1 s in `run`
                run.trace("fast", 1);
                other.trace("fast", 1);
                EXPECT_EQ(other("fast"), run_is) << k;
                EXPECT_EQ(other("c.time_in_state"), run("c.time_in_state"));
            }
            other.trace("fast", 2);
            EXPECT_NE(other("fast"), run_is) << "from where it leaves it as it would have";
        }
    }
}

TEST(Handover, AChartWhoseActiveStateIsGoneBeginsAnewAndIsSaidBefore) {
    Session run(four), other(chart("[idle, fill, trip]", "[1 2 0 0.6; 3 1 0 0.4]"));
    run.trace("fast", 6);
    ASSERT_EQ(run("fast"), 3);
    EXPECT_EQ(handover(*run.simulation, *other.simulation).lost,
              std::vector<std::string>{"'c.x' is 'run', which is no longer there: 'c' then begins anew"});
    other.simulation->go_on_from(*run.simulation);
    EXPECT_EQ(other.trace("fast", 8), (Values{1, 1, 1, 1, 1, 1, 2, 2})) << "0.6 s after its first step";
}

TEST(Handover, AStateThatIsRenamedStaysActiveWhereThatIsKnown) {
    const std::string renamed_chart = chart(
        "[idle, run, fill, stop]", "[1 2 0 0.2; 2 3 0 9; 3 4 0 1; 4 1 0 0.4]"); // fill and run exchanged
    Session run(four), other(renamed_chart), by_hand(renamed_chart);
    run.trace("fast", 6);
    const std::map<std::string, std::string> before{
        {"c.run", "c.fill"}, {"c.fill", "c.run"}, {"c.stop", "c.trip"}};
    const Origin origin = [&](const std::string& path) -> std::optional<std::string> {
        const auto found = before.find(path);
        return found == before.end() ? path : found->second;
    };
    EXPECT_TRUE(handover(*run.simulation, *other.simulation, origin).lost.empty());
    other.simulation->go_on_from(*run.simulation, origin);
    by_hand.simulation->go_on_from(*run.simulation);
    EXPECT_EQ(other.trace("fast", 1), Values{3});
    EXPECT_EQ(by_hand.trace("fast", 1), Values{2}) << "names are all that is known";
}

TEST(Handover, ANumberThatWasSetStandsForTheSameStateInAnEditedChart) {
    const Session run(four);
    using Asked = std::vector<ParameterValue>;
    const auto still = [&](const std::string& states, const PathSince& path_since) {
        const Session other(chart(states, "[1 2 0 1]"));
        Asked all = still_asked(run.diagram, other.diagram, {{"c.initial", {3}}}, path_since);
        return all.empty() ? 0 : all.at(0).values.at(0);
    };
    const PathSince same = [](const std::string& path) { return path; };
    EXPECT_EQ(still("[idle, fill, run, trip]", same), 3);
    EXPECT_EQ(still("[idle, run, trip]", same), 2);
    EXPECT_EQ(still("[idle, fill, trip]", same), 0) << "there is no such state any more";
    EXPECT_EQ(still("[fill, run, trip]", same), 0) << "the model gives another one than before";
    EXPECT_EQ(still("[idle, go, trip]", [](const auto& p) { return p == "c.run" ? "c.go" : p; }), 2);
}

// ---- periods that change

/// Integrals of 1 by all rules, of which the period changes, beside others that keep theirs.
std::string integrals(const std::string& period) {
    return "model: m\nstep: 0.1\nblocks:\n  one: {block: Constant}\n  ramp: {block: Clock, period: 0.1}\n"
           "  forward: {block: DiscreteIntegrator, period: " +
           period + "}\n  backward: {block: DiscreteIntegrator, method: backward, period: " + period +
           "}\n  trapezoidal: {block: DiscreteIntegrator, method: trapezoidal, period: " + period +
           "}\n  pid: {block: DiscretePID, P: 0, I: 1, D: 0, period: " + period +
           "}\n  slope: {block: DiscreteDerivative, period: " + period +
           "}\n  steady: {block: DiscreteIntegrator, period: 0.3}\n"
           "connections: {one: [forward, backward, trapezoidal, pid, steady], ramp: slope}\n";
}

TEST(Handover, IntegralsStayRightWheneverAPeriodChanges) {
    const std::vector<int> ticks{1, 3, 7, 2, 10, 4, 3, 1, 5}; // of 0.1 s
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
        std::vector<std::unique_ptr<Session>> runs;
        std::map<std::string, double> ahead; // of the time: backward counts the first period at its beginning
        for (int edit = 0; edit < 8; ++edit) {
            const int now = ticks[random() % ticks.size()];
            const std::string period = "0.1*" + std::to_string(now);
            runs.push_back(std::make_unique<Session>(integrals("\"" + period + "\"")));
            Session& run = *runs.back();
            if (edit > 0) run.simulation->go_on_from(*runs[runs.size() - 2]->simulation);
            for (int left = static_cast<int>(random() % 15); left > 0; --left) {
                const auto step = run.simulation->steps();
                ASSERT_TRUE(run.simulation->step());
                const double t = static_cast<double>(step) * 0.1;
                EXPECT_NEAR(run("steady"), 0.3 * static_cast<double>(step / 3), 1e-9);
                if (step % now != 0) continue;
                for (const char* integral : {"forward", "backward", "trapezoidal", "pid"}) {
                    const double y = run(integral);
                    if (step == 0) ahead[integral] = y - t;
                    EXPECT_NEAR(y - t, ahead[integral], 1e-9) << integral << " at " << t << ", " << period;
                }
                EXPECT_NEAR(run("slope"), step > 0 ? 1 : 0, 1e-9) << "at " << t << ", " << period;
            }
        }
    }
}

TEST(Handover, APeriodThatChangesTwiceBeforeAHitCountsAll) {
    Session slow(integrals("1")), between(integrals("\"0.7\"")), fast(integrals("\"0.3\""));
    slow.trace("forward", 32); // hit at 3 s
    between.simulation->go_on_from(*slow.simulation);
    between.trace("forward", 2); // would be hit at 3.5 s
    fast.simulation->go_on_from(*between.simulation);
    const Values y = fast.trace("forward", 6);
    EXPECT_NEAR(y[1], 3, 1e-9);   // 3.5 s
    EXPECT_NEAR(y[2], 3.6, 1e-9); // 3.6 s
    EXPECT_NEAR(y[5], 3.9, 1e-9);
}

TEST(Handover, TheFirstHitIsComputedAgainFromASnapshot) {
    Session run(integrals("1")), other(integrals("\"0.3\""));
    run.trace("forward", 14);
    other.simulation->go_on_from(*run.simulation);
    const auto snapshot = other.simulation->snapshot();
    const Values first = other.trace("forward", 9);
    other.simulation->restore(snapshot);
    EXPECT_EQ(other.trace("forward", 9), first);
    EXPECT_NEAR(first[1], 1.5, 1e-9);
}

} // namespace
} // namespace bf::test
