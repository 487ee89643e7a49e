#include "bf/service/playback.hpp"

#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "scenery.hpp"

#include <chrono>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <mutex>
#include <set>
#include <thread>

namespace {

using namespace bf::service;
using bf::LoadedModel;

constexpr const char* decay = "model: decay\n"
                              "step: 0.01\n"
                              "stop: 5\n"
                              "variables: {rate: -1}\n"
                              "blocks:\n"
                              "  x: {block: DiscreteIntegrator, initial: 1}\n"
                              "  slope: {block: Gain, K: rate}\n"
                              "connections:\n"
                              "  x: slope\n"
                              "  slope: x\n";

std::shared_ptr<const LoadedModel> loaded(const char* text) {
    return std::make_shared<const LoadedModel>(bf::load(bf::formats::read_yaml_text(text), "decay.yaml"));
}

/// Keeps what a playback tells.
struct Seen {
    std::mutex mutex;
    std::vector<std::pair<double, double>> samples;          ///< time and value, in the order of arrival
    std::vector<std::pair<double, double>> places;           ///< the same of the first world
    std::map<int, std::map<std::int64_t, double>> by_branch; ///< by step
    Playback::Listener listener() {
        return {[](const RunState&, std::int64_t) {},
                [this](const std::string& frame) {
                    const std::lock_guard lock(mutex);
                    for (std::size_t at = 0; at < frame.size();) {
                        std::uint32_t index = 0, n = 0, branch = 0;
                        double time = 0, value = 0;
                        std::memcpy(&index, &frame[at], 4);
                        std::memcpy(&branch, &frame[at + 4], 4);
                        std::memcpy(&n, &frame[at + 8], 4);
                        std::memcpy(&time, &frame[at + 12], 8);
                        std::memcpy(&value, &frame[at + 20], 8);
                        at += 20 + 8 * n;
                        (index < (1U << 31) ? samples : places).emplace_back(time, value);
                        if (index < (1U << 31))
                            by_branch[static_cast<int>(branch)][std::llround(time / 0.01)] = value;
                    }
                }};
    }
};

/// Waits until the run has come to rest.
RunState rest(const Playback& playback) {
    for (int i = 0; i < 3000; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        const RunState state = playback.state();
        if (i > 10 && state.state != Running::running) return state;
    }
    return playback.state();
}

TEST(Playback, RunsToTheEndAndGoesBackToAnyInstant) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    EXPECT_EQ(playback.state().state, Running::paused);
    playback.watch({0});
    playback.command({.action = Action::start});
    RunState end = rest(playback);
    EXPECT_EQ(end.state, Running::ended);
    EXPECT_NEAR(end.time, 5, 1e-9);
    for (const double time : {1.23, 0.0, 4.99, 2.0}) {
        playback.command({.action = Action::to, .time = time});
        const RunState there = rest(playback);
        EXPECT_EQ(there.state, Running::paused);
        EXPECT_NEAR(there.time, time, 1e-9);
        EXPECT_NEAR(there.reached, 5, 1e-9);
    }
}

TEST(Playback, GivesTheSamplesOfBfRunAgainAfterGoingBack) {
    const auto model = loaded(decay);
    bf::Simulation simulation(model->diagram);
    simulation.start();
    std::map<std::int64_t, double> expected; // by step
    const auto signals = simulation.signals();
    const auto x = static_cast<int>(&bf::find(signals, "x") - signals.data());
    while (simulation.time() < 5) {
        const auto step = simulation.steps();
        ASSERT_TRUE(simulation.step());
        expected[step] = signals[static_cast<std::size_t>(x)][0];
    }

    Seen seen;
    Playback playback(model, 1, seen.listener());
    playback.watch({x});
    playback.command({.action = Action::to, .time = 3.0});
    static_cast<void>(rest(playback));
    playback.command({.action = Action::to, .time = 0.5});
    static_cast<void>(rest(playback));
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    const std::lock_guard lock(seen.mutex);
    EXPECT_GT(seen.samples.size(), 20u);
    for (const auto& [time, value] : seen.samples)
        EXPECT_EQ(expected.at(std::llround(time / 0.01)), value) << time;
}

TEST(Playback, AChangedVariableMakesAnotherRunFromThere) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    playback.tune({"rate", {0}});
    EXPECT_NEAR(playback.state().reached, 1.0, 1e-9);
    playback.watch({0});
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    EXPECT_NEAR(playback.state().reached, 5, 1e-9);
    const std::lock_guard lock(seen.mutex);
    EXPECT_NEAR(seen.by_branch.at(1).rbegin()->second, std::pow(0.99, 100), 1e-12); // nothing decays any more
}

TEST(Playback, TellsWhereThingsAreAtTheShownInstantWhileSomebodyLooks) {
    Seen seen;
    const auto model = loaded(decay);
    Playback playback(model, 1, seen.listener());
    playback.command({.action = Action::to, .time = 3.0});
    static_cast<void>(rest(playback));
    EXPECT_TRUE(seen.places.empty());
    playback.show(std::make_shared<Sceneries>(one_body(model->diagram, "x")));
    static_cast<void>(rest(playback));
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    {
        const std::lock_guard lock(seen.mutex);
        ASSERT_EQ(seen.places.size(), 2U);
        EXPECT_NEAR(seen.places[0].first, 3, 1e-12);
        EXPECT_NEAR(seen.places[0].second, std::pow(0.99, 300), 1e-12);
        EXPECT_NEAR(seen.places[1].first, 1, 1e-12);
        EXPECT_NEAR(seen.places[1].second, std::pow(0.99, 100), 1e-12);
    }
    playback.show(nullptr);
    playback.command({.action = Action::to, .time = 2.0});
    static_cast<void>(rest(playback));
    const std::lock_guard lock(seen.mutex);
    EXPECT_EQ(seen.places.size(), 2U);
}

TEST(Playback, RefusesAWrongChangeWithItsReason) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    EXPECT_THROW(playback.tune({"rat", {0}}), std::runtime_error);
    EXPECT_THROW(playback.tune({"rate", {0, 1}}), std::runtime_error);
    EXPECT_EQ(playback.state().state, Running::paused);
}

TEST(Playback, KeepsThePaceThatIsAskedFor) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::start, .factor = 1.0});
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    playback.command({.action = Action::pause});
    const double time = rest(playback).time;
    EXPECT_GT(time, 0.0);
    EXPECT_LT(time, 4.0); // and not to the end at once
}

TEST(Playback, StepsOnceAndStartsAnewAfterStop) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::step});
    EXPECT_NEAR(rest(playback).time, 0.01, 1e-12);
    playback.command({.action = Action::step});
    EXPECT_NEAR(rest(playback).time, 0.02, 1e-12);
    playback.command({.action = Action::stop});
    EXPECT_EQ(rest(playback).time, 0);
}

/// What a recording of these steps has of x, by step.
std::map<std::int64_t, double> recorded(const LoadedModel& model,
                                        const std::function<void(bf::Simulation&)>& before_step) {
    bf::Simulation simulation(model.diagram);
    simulation.start();
    std::map<std::int64_t, double> values;
    const auto signals = simulation.signals();
    while (simulation.time() < 5 - 0.005) {
        before_step(simulation);
        const auto step = simulation.steps();
        if (!simulation.step()) break;
        values[step] = bf::find(signals, "x")[0];
    }
    return values;
}

/// Waits until all samples that are asked for were there.
template <class Is> bool wait(const Seen& seen, const Is& is) {
    for (int i = 0; i < 30'000; ++i) {
        {
            const std::lock_guard lock(const_cast<Seen&>(seen).mutex);
            if (is()) return true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
}

int index_of(const Playback& playback, const std::string& path) {
    for (const auto& signal : playback.signals())
        if (signal.path == path + ".y") return signal.index;
    throw std::runtime_error("there is no signal " + path);
}

TEST(Playback, ShowsAtAnInstantWhatARecordingHasThere) {
    const auto model = loaded(decay);
    const auto expected = recorded(*model, [](auto&) {});
    Seen seen;
    Playback playback(model, 1, seen.listener());
    playback.watch({index_of(playback, "x")});
    for (const double time : {0.0, 1.23, 0.5}) {
        playback.command({.action = Action::to, .time = time});
        static_cast<void>(rest(playback));
        const std::lock_guard lock(seen.mutex);
        EXPECT_EQ(seen.samples.back().first, time);
        EXPECT_EQ(seen.samples.back().second, expected.at(std::llround(time / 0.01)));
    }
}

TEST(Playback, ASignalThatIsWatchedLateHasAllItsSamples) {
    const auto model = loaded(decay);
    const auto expected = recorded(*model, [](auto&) {});
    Seen seen;
    Playback playback(model, 1, seen.listener());
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    playback.watch({index_of(playback, "x")});
    EXPECT_TRUE(wait(seen, [&] { return seen.by_branch[0].size() >= 500; }));
    EXPECT_EQ(playback.state().state, Running::ended);
    const std::lock_guard lock(seen.mutex);
    EXPECT_EQ(seen.by_branch[0], expected);
}

TEST(Playback, AConstantThatIsWatchedLateIsShown) {
    Seen seen;
    Playback playback(loaded("model: c\nstep: 0.01\nstop: 0.1\nblocks:\n  two: {block: Constant, value: 2}\n"
                             "  x: {block: DiscreteIntegrator}\nconnections:\n  two: x\n"),
                      1, seen.listener());
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    playback.watch({index_of(playback, "two")});
    EXPECT_TRUE(wait(seen, [&] { return !seen.samples.empty(); }));
    const std::lock_guard lock(seen.mutex);
    for (const auto& [time, value] : seen.samples) EXPECT_EQ(value, 2);
}

/// 300 000 steps of 1 ms: a pulse of one step every 50 s, from 20 s on, and the time that has passed.
constexpr const char* spikes = "model: spikes\nstep: 0.001\nstop: 300\nblocks:\n"
                               "  one: {block: Constant, value: 1}\n  time: {block: DiscreteIntegrator}\n"
                               "  spike: {block: Pulse, cycle: 50, width: 0.002, delay: 19.9995}\n"
                               "  end: {block: Terminator}\nconnections: {one: time, spike: end}\n";

TEST(Playback, ARunTooFastToBeSeenKeepsItsExtremesAndItsEnd) {
    for (const bool is_watched_late : {false, true}) {
        Seen spike, time;
        for (Seen* seen : {&spike, &time}) {
            Playback playback(loaded(spikes), 1, seen->listener());
            const int signal = index_of(playback, seen == &spike ? "spike" : "time");
            if (!is_watched_late) playback.watch({signal});
            playback.command({.action = Action::start});
            while (playback.state().state != Running::ended)
                std::this_thread::sleep_for(std::chrono::milliseconds(5));
            playback.watch({signal});
            EXPECT_TRUE(wait(
                *seen, [&] { return seen->samples.size() > 100 && seen->samples.back().first > 299.9985; }));
        }
        std::set<std::int64_t> high; // ms
        for (const auto& [at, value] : spike.samples)
            if (value == 1) high.insert(std::llround(at * 1000));
        EXPECT_EQ(high, (std::set<std::int64_t>{20'000, 70'000, 120'000, 170'000, 220'000, 270'000}))
            << is_watched_late;
        EXPECT_LT(spike.samples.size(), 300'000U) << "not all of them";
        EXPECT_NEAR(time.samples.back().second, 299.999, 1e-6);
        for (const auto& [at, value] : time.samples) EXPECT_NEAR(value, at, 1e-6);
    }
}

TEST(Playback, ASpanThatIsLookedAtHasAllItsSamplesAndAnInstantItsOwn) {
    Seen seen;
    Playback playback(loaded(spikes), 1, seen.listener());
    playback.command({.action = Action::to, .time = 200.0});
    while (playback.state().time < 199.9) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    playback.watch({index_of(playback, "time")});
    const auto among = [&](double from, double to) {
        std::map<std::int64_t, double> found;
        for (const auto& [time, value] : seen.samples)
            if (time > from - 1e-6 && time < to + 1e-6) found[std::llround(time * 1000)] = value;
        return found;
    };
    EXPECT_TRUE(wait(seen, [&] { return !among(199.999, 199.999).empty(); }));
    EXPECT_LT(among(69.99, 70.01).size(), 21U);
    playback.refine(69.99, 70.01);
    EXPECT_TRUE(wait(seen, [&] { return among(69.99, 70.01).size() == 21; }));
    for (const auto& [step, value] : seen.samples) EXPECT_NEAR(value, step, 1e-6);
    playback.refine(123.45678, 123.45678);
    EXPECT_TRUE(wait(seen, [&] { return among(123.456, 123.456).size() == 1; }));
    EXPECT_NEAR(among(123.456, 123.456).begin()->second, 123.456, 1e-6);
    EXPECT_TRUE(among(123.457, 123.460).empty()) << "and no more";
    seen.samples.clear();
    playback.refine(1e9, 1e9); // what was reached last
    EXPECT_TRUE(wait(seen, [&] { return !among(199.999, 199.999).empty(); }));
}

TEST(Playback, SamplesThatAreWantedAgainComeAgain) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    const int x = index_of(playback, "x");
    playback.watch({x});
    EXPECT_TRUE(wait(seen, [&] { return seen.by_branch[0].size() >= 500; }));
    seen.by_branch.clear();
    playback.watch({x});
    static_cast<void>(rest(playback));
    EXPECT_TRUE(seen.by_branch.empty());
    playback.watch({x}, {}, {x});
    EXPECT_TRUE(wait(seen, [&] { return seen.by_branch[0].size() >= 500; }));
}

TEST(Playback, AChangeInThePastKeepsWhatWasThereAsABranch) {
    const auto model = loaded(decay);
    const auto first = recorded(*model, [](auto&) {});
    const auto second = recorded(*model, [](bf::Simulation& run) {
        if (run.steps() == 100) run.set_parameter("slope.K", {-3});
        if (run.steps() == 300) run.set_parameter("slope.K", {1});
    });
    Seen seen;
    Playback playback(model, 1, seen.listener());
    const int x = index_of(playback, "x");
    playback.command({.action = Action::start});
    static_cast<void>(rest(playback));
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    playback.tune({"rate", {-2}});
    playback.tune({"rate", {-3}}); // the slider goes on
    playback.command({.action = Action::to, .time = 3.0});
    static_cast<void>(rest(playback));
    playback.tune({"rate", {1}}); // nothing was simulated from here on: no branch
    playback.command({.action = Action::start});
    RunState state = rest(playback);
    ASSERT_EQ(state.branches.size(), 2u);
    EXPECT_EQ(state.branch, 1);
    EXPECT_EQ(state.branches[1].parent, 0);
    EXPECT_NEAR(state.branches[1].from, 1, 1e-9);
    EXPECT_EQ(state.branches[1].cause, "rate = -3 … 1") << "what it began with, and what it came to";
    EXPECT_NEAR(state.branches[0].reached, 5, 1e-9);

    playback.watch({x}, {0});
    const auto is_there = [&] { return seen.by_branch[0].size() >= 500 && seen.by_branch[1].size() >= 400; };
    EXPECT_TRUE(wait(seen, is_there)) << seen.by_branch[0].size() << " " << seen.by_branch[1].size();
    for (const double time : {0.5, 4.0, 1.0, 2.5}) { // along the branch, from before it begins
        playback.command({.action = Action::to, .time = time});
        static_cast<void>(rest(playback));
    }
    playback.command({.action = Action::branch, .branch = 0});
    state = rest(playback);
    EXPECT_EQ(state.branch, 0);
    EXPECT_NEAR(state.time, 2.5, 1e-9);
    const std::lock_guard lock(seen.mutex);
    EXPECT_EQ(seen.by_branch[0], first);
    for (const auto& [step, value] : seen.by_branch[1]) EXPECT_EQ(value, second.at(step)) << step;
}

TEST(Playback, EarlierBranchesAreForgottenOnlyWhenThereAreTooMany) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::to, .time = 2.0});
    static_cast<void>(rest(playback));
    for (int i = 0; i < 20; ++i) {
        playback.command({.action = Action::branch, .branch = 0});
        playback.command({.action = Action::to, .time = 0.5});
        playback.tune({"rate", {-0.1 * i}});
        playback.command({.action = Action::step});
    }
    const RunState state = rest(playback);
    EXPECT_EQ(state.branches.size(), 16u);
    EXPECT_EQ(state.branches.front().index, 0); // all others come from it
    EXPECT_EQ(state.branches.back().index, 20);
    try {
        playback.command({.action = Action::branch, .branch = 1});
        FAIL() << "it is there";
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "there is no branch 1; it was forgotten");
    }
}

TEST(Playback, TellsTheValuesOfTheShownBranchWhereTheyAreNotThoseOfTheModel) {
    const auto tuned = [](const RunState& state) {
        std::map<std::string, std::vector<double>> all;
        for (const auto& [name, values] : state.tuned) all[name] = values;
        return all;
    };
    using Values = std::map<std::string, std::vector<double>>;
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::to, .time = 2.0});
    EXPECT_EQ(tuned(rest(playback)), Values());
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    playback.tune({"rate", {-2}});
    EXPECT_EQ(tuned(playback.state()), (Values{{"rate", {-2}}, {"slope.K", {-2}}}));
    playback.tune({"rate", {-3}});
    EXPECT_EQ(tuned(playback.state()), (Values{{"rate", {-3}}, {"slope.K", {-3}}}));
    EXPECT_THROW(playback.tune({"rate", {1, 2}}), std::runtime_error);
    EXPECT_EQ(tuned(playback.state()), (Values{{"rate", {-3}}, {"slope.K", {-3}}}));
    playback.command({.action = Action::to, .time = 0.5});
    EXPECT_EQ(tuned(rest(playback)), Values()) << "before it was changed";

    // The document takes the value over: now the first branch has another one than it.
    std::string text = decay;
    text.replace(text.find("rate: -1"), 8, "rate: -3");
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    playback.edit(loaded(text.c_str()), 2, "rate = -3");
    EXPECT_EQ(tuned(rest(playback)), Values());
    playback.command({.action = Action::branch, .branch = 0});
    EXPECT_EQ(tuned(rest(playback)), (Values{{"rate", {-1}}, {"slope.K", {-1}}}));
}

TEST(Playback, AnEditedModelGoesOnFromThereWithItsStates) {
    const auto model = loaded(decay);
    std::string text = decay;
    text.replace(text.find("blocks:\n"), 8, "blocks:\n  more: {block: Gain, K: 7}\n");
    text.replace(text.find("connections:\n"), 13, "connections:\n  x: more\n");
    text.replace(text.find("  x: slope\n"), 11, "");
    text.replace(text.find("  x: more\n"), 10, "  x: [slope, more]\n");
    Seen seen;
    Playback playback(model, 1, seen.listener());
    playback.command({.action = Action::to, .time = 2.0});
    static_cast<void>(rest(playback));
    playback.edit(loaded(text.c_str()), 2, "add more");
    RunState state = rest(playback);
    EXPECT_FALSE(state.edit);
    EXPECT_EQ(playback.revision(), 2);
    ASSERT_EQ(state.branches.size(), 2u);
    EXPECT_EQ(state.branches[1].cause, "add more");
    EXPECT_NEAR(state.time, 2, 1e-9);
    const int x = index_of(playback, "x"), more = index_of(playback, "more");
    playback.watch({x, more}, {0, 1});
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    EXPECT_TRUE(wait(seen, [&] { return seen.by_branch[0].size() >= 200; }));
    playback.watch({x}, {0, 1});
    const auto expected = recorded(*model, [](auto&) {});
    {
        const std::lock_guard lock(seen.mutex);
        EXPECT_EQ(seen.by_branch[1].at(300), 7 * expected.at(300)); // more was sampled last
        EXPECT_EQ(seen.by_branch[0].rbegin()->first, 199);
    }
    playback.command({.action = Action::to, .time = 1.0}); // the history before the edit
    state = rest(playback);
    EXPECT_NEAR(state.time, 1, 1e-9);
    EXPECT_EQ(state.branch, 1);
}

TEST(Playback, AnEditThatLosesAStateSaysSoBeforeAndWaits) {
    std::string text = decay;
    text.replace(text.find("  x: {block: DiscreteIntegrator"), 31, "  x: {block: UnitDelay");
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::to, .time = 2.0});
    static_cast<void>(rest(playback));
    playback.edit(loaded(text.c_str()), 2, "another block");
    RunState state = rest(playback);
    ASSERT_TRUE(state.edit);
    EXPECT_EQ(state.edit->refusal, "");
    EXPECT_EQ(state.edit->lost,
              (std::vector<std::string>{"'x.x' is no longer there", "'x.before' is no longer there"}));
    EXPECT_EQ(state.edit->begun, std::vector<std::string>{"x.x"});
    EXPECT_EQ(state.branches.size(), 1u);
    EXPECT_EQ(playback.revision(), 1);
    playback.command({.action = Action::adopt});
    state = rest(playback);
    EXPECT_FALSE(state.edit);
    EXPECT_EQ(state.branches.size(), 2u);
    EXPECT_EQ(playback.revision(), 2);
    playback.edit(loaded(decay), 3, "undo"); // what was lost is there again
    state = rest(playback);
    EXPECT_FALSE(state.edit);
    ASSERT_EQ(state.branches.size(), 2u);
    EXPECT_EQ(playback.revision(), 3);
    const int x = index_of(playback, "x");
    playback.watch({x});
    const auto expected = recorded(*loaded(decay), [](auto&) {});
    EXPECT_TRUE(wait(seen, [&] { return !seen.samples.empty() && seen.samples.back().first == 2.0; }));
    EXPECT_EQ(seen.samples.back().second, expected.at(200));
}

TEST(Playback, AnEditThatChangesNothingOfTheRunMakesNoBranch) {
    std::string text = decay;
    text += "layout:\n  blocks:\n    x: {x: 100, y: 20}\n";
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::to, .time = 2.0});
    static_cast<void>(rest(playback));
    playback.edit(loaded(text.c_str()), 2, "move x");
    EXPECT_EQ(rest(playback).branches.size(), 1u);
    EXPECT_EQ(playback.revision(), 2);
}

TEST(Playback, WhatWasTunedStaysUnlessTheEditGivesIt) {
    std::string other = decay, given = decay;
    other.replace(other.find("initial: 1"), 10, "initial: 2");
    given.replace(given.find("rate: -1"), 8, "rate: -4");
    for (const bool is_given : {false, true}) {
        Seen seen;
        Playback playback(loaded(decay), 1, seen.listener());
        playback.watch({index_of(playback, "slope")});
        playback.command({.action = Action::to, .time = 1.0});
        static_cast<void>(rest(playback));
        playback.tune({"rate", {-2}});
        playback.command({.action = Action::step});
        playback.edit(loaded((is_given ? given : other).c_str()), 2, "edit");
        static_cast<void>(rest(playback));
        playback.watch({index_of(playback, "x"), index_of(playback, "slope")});
        static_cast<void>(rest(playback));
        const std::lock_guard lock(seen.mutex);
        const auto n = seen.samples.size();
        ASSERT_GT(n, 2u);
        EXPECT_EQ(seen.samples[n - 1].second, (is_given ? -4 : -2) * seen.samples[n - 2].second);
    }
}

TEST(Playback, RunsUntilAnEventAndShowsItsInstant) {
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.watch({index_of(playback, "x")});
    playback.command({.action = Action::until, .event = "x < 0.5"});
    RunState state = rest(playback);
    EXPECT_EQ(state.state, Running::paused);
    EXPECT_NEAR(state.time, 0.69, 1e-9); // 0.99^69 is the first power below 0.5
    EXPECT_NEAR(seen.samples.back().second, std::pow(0.99, 69), 1e-12);
    playback.command({.action = Action::until, .event = "x < 0.5"}); // it holds already
    EXPECT_EQ(rest(playback).state, Running::ended);
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    playback.command({.action = Action::until, .event = "x"});
    EXPECT_NEAR(rest(playback).time, 1.01, 1e-9);
    try {
        playback.command({.action = Action::until, .event = "y > 1"});
        FAIL() << "it is a signal";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("'y'"), std::string::npos) << error.what();
    }
    EXPECT_EQ(playback.state().state, Running::paused);
}

TEST(Playback, AStartAtTheBeginningAfterAnEditIsAnotherRun) {
    std::string text = decay;
    text.replace(text.find("initial: 1"), 10, "initial: 3");
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::start});
    static_cast<void>(rest(playback));
    playback.edit(loaded(text.c_str()), 2, "set x.initial = 3");
    EXPECT_EQ(rest(playback).branches.size(), 1u);
    playback.command({.action = Action::to, .time = 3.0});
    EXPECT_TRUE(rest(playback).edit) << "it may go on from there";
    playback.command({.action = Action::stop});
    playback.watch({index_of(playback, "x")});
    playback.command({.action = Action::start});
    const RunState state = rest(playback);
    EXPECT_EQ(state.branches.back().parent, -1);
    EXPECT_TRUE(wait(seen, [&] { return seen.by_branch[state.branch].contains(0); }));
    EXPECT_EQ(seen.by_branch[state.branch].at(0), 3);
}

TEST(Playback, AStartAtTheBeginningAfterAnEditWasTakenBackLeavesTheBranchOfThatEdit) {
    std::string text = decay;
    text.replace(text.find("rate: -1"), 8, "rate: -2");
    Seen seen;
    Playback playback(loaded(decay), 1, seen.listener());
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    playback.edit(loaded(text.c_str()), 2, "set_variable rate = -2");
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).branch, 1);
    playback.edit(loaded(decay), 3, "undo");
    playback.command({.action = Action::to, .time = 3.0});
    EXPECT_TRUE(rest(playback).edit);
    playback.command({.action = Action::stop});
    playback.watch({index_of(playback, "x")});
    playback.command({.action = Action::start});
    const RunState state = rest(playback);
    EXPECT_EQ(state.branches.back().parent, -1);
    EXPECT_EQ(state.branch, state.branches.back().index);
    EXPECT_FALSE(state.edit);
    EXPECT_TRUE(wait(seen, [&] { return seen.by_branch[state.branch].contains(499); }));
    EXPECT_NEAR(seen.by_branch[state.branch].at(499), std::pow(0.99, 499), 1e-12);
}

} // namespace
