#include "bf/service/playback.hpp"

#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "scenery.hpp"

#include <chrono>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <mutex>
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
    std::vector<std::pair<double, double>> samples; ///< time and value, in the order of arrival
    std::vector<std::pair<double, double>> places;  ///< the same of the first world
    Playback::Listener listener() {
        return {[](const RunState&) {},
                [this](const std::string& frame) {
                    const std::lock_guard lock(mutex);
                    for (std::size_t at = 0; at < frame.size();) {
                        std::uint32_t index = 0, n = 0;
                        double time = 0, value = 0;
                        std::memcpy(&index, &frame[at], 4);
                        std::memcpy(&n, &frame[at + 4], 4);
                        std::memcpy(&time, &frame[at + 8], 8);
                        std::memcpy(&value, &frame[at + 16], 8);
                        (index < (1U << 31) ? samples : places).emplace_back(time, value);
                        at += 16 + 8 * n;
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
    Playback playback(loaded(decay), seen.listener());
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
    Playback playback(model, seen.listener());
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
    Playback playback(loaded(decay), seen.listener());
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    playback.command({.action = Action::to, .time = 1.0});
    static_cast<void>(rest(playback));
    playback.tune({"rate", {0}});
    EXPECT_NEAR(playback.state().reached, 1.0, 1e-9);
    playback.watch({0});
    playback.command({.action = Action::start});
    EXPECT_EQ(rest(playback).state, Running::ended);
    const std::lock_guard lock(seen.mutex);
    EXPECT_NEAR(seen.samples.back().second, std::pow(0.99, 100), 1e-12); // nothing decays any more
}

TEST(Playback, TellsWhereThingsAreAtTheShownInstantWhileSomebodyLooks) {
    Seen seen;
    const auto model = loaded(decay);
    Playback playback(model, seen.listener());
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
        EXPECT_NEAR(seen.places[0].first, 2.99, 1e-12);
        EXPECT_NEAR(seen.places[0].second, std::pow(0.99, 299), 1e-12);
        EXPECT_NEAR(seen.places[1].first, 0.99, 1e-12);
        EXPECT_NEAR(seen.places[1].second, std::pow(0.99, 99), 1e-12);
    }
    playback.show(nullptr);
    playback.command({.action = Action::to, .time = 2.0});
    static_cast<void>(rest(playback));
    const std::lock_guard lock(seen.mutex);
    EXPECT_EQ(seen.places.size(), 2U);
}

TEST(Playback, RefusesAWrongChangeWithItsReason) {
    Seen seen;
    Playback playback(loaded(decay), seen.listener());
    EXPECT_THROW(playback.tune({"rat", {0}}), std::runtime_error);
    EXPECT_THROW(playback.tune({"rate", {0, 1}}), std::runtime_error);
    EXPECT_EQ(playback.state().state, Running::paused);
}

TEST(Playback, KeepsThePaceThatIsAskedFor) {
    Seen seen;
    Playback playback(loaded(decay), seen.listener());
    playback.command({.action = Action::start, .factor = 1.0});
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    playback.command({.action = Action::pause});
    const double time = rest(playback).time;
    EXPECT_GT(time, 0.0);
    EXPECT_LT(time, 4.0); // and not to the end at once
}

TEST(Playback, StepsOnceAndStartsAnewAfterStop) {
    Seen seen;
    Playback playback(loaded(decay), seen.listener());
    playback.command({.action = Action::step});
    EXPECT_NEAR(rest(playback).time, 0.01, 1e-12);
    playback.command({.action = Action::step});
    EXPECT_NEAR(rest(playback).time, 0.02, 1e-12);
    playback.command({.action = Action::stop});
    EXPECT_EQ(rest(playback).time, 0);
}

} // namespace
