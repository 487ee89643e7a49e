// A run whose model stands behind functions of C.
#include "bf/run/loaded.hpp"

#include "counting_run.hpp"

#include <dlfcn.h>
#include <functional>
#include <gtest/gtest.h>
#include <memory>

namespace bf::test {
namespace {

const std::string folder = std::string(BF_BINARY_DIRECTORY) + "/test_libraries/";

std::string error_of(const std::function<void()>& f) {
    try {
        f();
    } catch (const RunError& error) {
        return error.what();
    }
    return "none";
}

/// What is seen: the steps that were made, y, and which of the rates 0 ... 3 are hit.
struct Look final : Run::Observer {
    void observe(const Run& run) noexcept override {
        std::string rates;
        for (int rate = 0; rate < 4; ++rate) rates += run.is_hit(rate) ? '1' : '0';
        seen.push_back(std::to_string(run.steps()) + " " +
                       std::to_string(int(find(run.signals(), "counter")[0])) + " " + rates +
                       (run.shows_event() ? " event" : ""));
    }
    std::vector<std::string> seen;
};

struct Loaded : ::testing::Test {
    bf_run_model model;
    bf_run_library library = counting_run();
    std::unique_ptr<LoadedRun> run = std::make_unique<LoadedRun>(library, model);
};

TEST_F(Loaded, TablesSayWhatTheLibrarySays) {
    const auto signals = run->signals();
    ASSERT_EQ(signals.size(), 2u);
    const auto &y = signals[0], &m = signals[1];
    EXPECT_EQ(y.path, "counter.y");
    EXPECT_EQ(y.info.unit, "rad");
    EXPECT_EQ(y.info.doc, "a count");
    EXPECT_EQ(y.info.names, (std::vector<std::pair<double, std::string>>{{0, "off"}, {2, "on"}}));
    EXPECT_EQ(y.rate, 1);
    EXPECT_TRUE(y.info.is_held && !y.info.is_matrix);
    EXPECT_EQ(y.info.period, 0.5);
    EXPECT_EQ(m.info.type, recording::ElementType::Single);
    EXPECT_EQ(std::pair(m.info.rows, m.info.cols), std::pair(2u, 3u));
    EXPECT_TRUE(m.info.is_matrix && !m.info.is_held);
    EXPECT_EQ(m.values(), (std::vector<double>{1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(run->inputs().at(0).path, "u");
    EXPECT_EQ(run->outside().at(0).data, reinterpret_cast<std::byte*>(&model.u));
    EXPECT_EQ(run->parameters().at(1).info.element_names, (std::vector<std::string>{"left", "", "right"}));
    EXPECT_EQ(run->variables().at(0).path, "k");
    EXPECT_EQ(run->variables().at(0).values, std::vector<double>{4});
    EXPECT_EQ(run->name(), "counting");
    EXPECT_EQ(run->stop_time(), 30);
    EXPECT_EQ(run->fingerprint(), 77u);
}

TEST_F(Loaded, RatesAndPlotsAreThoseOfTheLibrary) {
    const auto rates = run->rates();
    ASSERT_EQ(rates.size(), 4u);
    EXPECT_TRUE(rates[1].period == 0.5 && !rates[1].is_continuous);
    EXPECT_TRUE(rates[2].period == 0 && rates[2].is_continuous);
    const auto plots = run->plots();
    ASSERT_EQ(plots.size(), 2u);
    EXPECT_EQ(plots[0].title, "Both");
    EXPECT_EQ(plots[0].signals, (std::vector<std::string>{"counter.y", "m.y"}));
    EXPECT_EQ(plots[1].signals, std::vector<std::string>{"m.y"});
}

TEST_F(Loaded, ChecksTellTruthFromNumbers) {
    const auto checks = run->checks();
    ASSERT_EQ(checks.size(), 2u);
    EXPECT_TRUE(checks[0].name == "has_counted" && checks[0].value == 1 && checks[0].is_boolean);
    EXPECT_TRUE(checks[1].name == "error" && checks[1].value == 0.25 && !checks[1].is_boolean);
}

TEST_F(Loaded, ObserversLookBetweenTheHalvesOfAStep) {
    Look look;
    run->add_observer(look);
    run->start();
    for (int k = 0; k < 2; ++k) EXPECT_TRUE(run->step());
    EXPECT_EQ(look.seen, (std::vector<std::string>{"0 0 0110", "1 2 0111"}))
        << "steps, y, rates that are hit";
    EXPECT_EQ(model.calls, "iouou");
    EXPECT_EQ(run->time(), 1);
    model.fails = 'u';
    EXPECT_FALSE(run->step());
    EXPECT_EQ(look.seen.size(), 3u);
    model.fails = 'o';
    EXPECT_FALSE(run->step());
    EXPECT_EQ(look.seen.size(), 3u) << "outputs that failed are not shown";
    EXPECT_EQ(model.calls, "iouououo");
    EXPECT_EQ(run->failure(), "counter: it lost count");
}

TEST_F(Loaded, AnEventHitsTheContinuousRateAndWhatItTriggers) {
    Look look;
    run->show_event(look);
    model.steps = 1;
    run->show_event(look);
    EXPECT_EQ(look.seen, (std::vector<std::string>{"0 0 0010 event", "1 0 0011 event"}));
    EXPECT_FALSE(run->shows_event());
}

TEST_F(Loaded, AStartEndsTheRunBeforeAndOneThatFailsIsEndedAtOnce) {
    run->stop();
    EXPECT_EQ(model.calls, "") << "nothing has begun";
    run->start();
    run->start();
    run->stop();
    run->stop();
    EXPECT_EQ(model.calls, "itit");
    model.fails = 'i';
    EXPECT_EQ(error_of([&] { run->start(); }), "counter: it lost count");
    EXPECT_EQ(model.calls, "itit"
                           "it");
    model.fails = 0;
    run->start();
    run.reset();
    EXPECT_EQ(model.calls, "itit"
                           "it"
                           "it")
        << "and the model of another is not destroyed";
}

TEST_F(Loaded, AFailureNamesItsBlockWhereThereIsOne) {
    EXPECT_EQ(run->failure(), "");
    model.failure = "it is late";
    EXPECT_EQ(run->failure(), "it is late") << "the library names none";
    model.failed_block = "";
    EXPECT_EQ(run->failure(), "it is late");
    model.failed_block = "a.b";
    EXPECT_EQ(run->failure(), "a.b: it is late");
}

TEST_F(Loaded, ParametersChangeTogetherAndKeepWhatTheModelGave) {
    auto change = run->prepare({{"counter.gain", {5}}, {"v.w", {7, 8, 9}}});
    EXPECT_EQ(model.gain, 2) << "so far it is only prepared";
    EXPECT_TRUE(run->apply(change));
    EXPECT_EQ(model.gain, 5);
    const auto parameters = run->parameters();
    EXPECT_EQ(parameters[1].values(), (std::vector<double>{7, 8, 9}));
    EXPECT_EQ(read_value(parameters[0].given.data(), Type::float64, 0), 2);
    EXPECT_EQ(read_value(parameters[1].given.data(), Type::float64, 2), 3);
    auto wrong = run->prepare({{"counter.gain", {6}}, {"v.w", {-1, 0, 0}}});
    EXPECT_FALSE(run->apply(wrong));
    EXPECT_STREQ(wrong.refusal, "it must not be negative");
    EXPECT_EQ(model.gain, 5);
    EXPECT_EQ(run->follow({{"k", {3}}}).at(0).values, std::vector<double>{3});
}

TEST_F(Loaded, ParametersOfAnotherNameOrLengthAreRefused) {
    EXPECT_EQ(error_of([&] {
                  run->prepare({{"counter.gian", {1}}});
              }),
              "there is no parameter 'counter.gian'; did you mean 'counter.gain'?; parameters are called "
              "block.parameter");
    EXPECT_EQ(error_of([&] { run->prepare({{"v.w", {1, 2}}}); }), "parameter 'v.w' has 3 elements, not 2");
    EXPECT_EQ(error_of([&] { run->prepare({{"k", {1, 2}}}); }), "parameter 'k' has 1 elements, not 2");
    EXPECT_EQ(error_of([&] { run->prepare({{"k", {1}}}); }), "none") << "variables are asked for, too";
}

TEST_F(Loaded, ASnapshotGoesOnUnlessAStepFailedOrTheModelCannotBeSaved) {
    model.steps = 12;
    const auto snapshot = run->snapshot();
    model.steps = 3;
    run->restore(snapshot);
    EXPECT_EQ(run->steps(), 12);
    EXPECT_EQ(error_of([&] { run->restore(std::vector<std::byte>(9)); }),
              "the snapshot has 9 bytes, but this program's have 8; it belongs to another model");
    model.failure = "it lost count";
    EXPECT_EQ(error_of([&] { run->snapshot(); }),
              "counting: a step failed, so there is no state to go on from");
    library.snapshot_size = 0;
    EXPECT_EQ(
        error_of([&] { run->snapshot(); }),
        "counting: it holds blocks that generated code makes through the factory, whose state cannot be "
        "saved; save the interpreted model");
}

TEST(LoadedLibrary, ShowsItsEventsAndItsModelEndsWithTheRun) {
    const std::string file = folder + "CountingRun.so";
    void* const handle = dlopen(file.c_str(), RTLD_NOW);
    ASSERT_NE(handle, nullptr) << dlerror();
    auto& model = *reinterpret_cast<bf_run_v1_function>(dlsym(handle, "bf_run_v1"))()->create();
    {
        LoadedRun run(file);
        Look look;
        run.add_observer(look);
        run.start();
        for (int k = 0; k < 2; ++k) EXPECT_TRUE(run.step());
        EXPECT_EQ(look.seen, (std::vector<std::string>{"0 0 0110", "1 2 0011 event", "1 2 0111"}));
        EXPECT_FALSE(run.shows_event());
        EXPECT_EQ(read_value(run.parameters().at(0).given.data(), Type::float64, 0), 2);
    }
    EXPECT_EQ(model.calls, "iououtd") << "at last terminated and destroyed";
    model.has_memory = false;
    EXPECT_EQ(error_of([&] { LoadedRun run(file); }), file + ": there is no memory for the model");
    dlclose(handle);
}

TEST(LoadedLibrary, ThatHoldsNoRunIsRefusedByName) {
    EXPECT_EQ(error_of([&] { LoadedRun run(folder + "NoRun.so"); }),
              folder +
                  "NoRun.so exports no bf_run_v1, so it holds no run; bf generate without --embedded and "
                  "--sizes=runtime writes projects whose library does");
    EXPECT_TRUE(error_of([&] {
                    LoadedRun run(folder + "nowhere.so");
                }).starts_with("the library " + folder + "nowhere.so cannot be opened: "));
    EXPECT_TRUE(error_of([&] {
                    LoadedRun run(BF_SOURCE_DIRECTORY "/README.md");
                }).starts_with("the library cannot be opened: "));
}

} // namespace
} // namespace bf::test
