#include "support.hpp"

#include "bf/realtime/runner.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <future>

namespace bf::realtime {
namespace {

/// What happened, in order; the loop writes, the test reads after the run.
std::vector<std::string>& events() {
    static std::vector<std::string> list;
    return list;
}
std::function<void(std::int64_t)>& act() {
    static std::function<void(std::int64_t)> function;
    return function;
}

class Device final : public Block {
  public:
    using Block::Block;
    Argument<std::string> id{this, "id", {.initial = "d"}};
    Argument<int> fails_at{this, "fails_at", {.initial = -1}};
    Argument<bool> is_absent{this, "is_absent", {.initial = false}};
    Parameter<double> p{this, "p", {.initial = {1}}};
    Output<double> y{this, "y", {}};
    DiscreteState<double> x{this, "x", {}};
    void start(Now) const override {
        if (*is_absent) throw std::runtime_error("device " + *id + " is absent; plug it in");
        events().push_back("start " + *id);
    }
    Status output(Now at, Out out) const noexcept override {
        if (at.step() == *fails_at) return Status::failure("broke at step {}", static_cast<int>(at.step()));
        if (*id == "a" && act()) act()(at.step());
        out[y] = at[x];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[x] + at[p];
        return ok;
    }
    void stop(Now) const noexcept override { events().push_back("stop " + *id); }
};

const Library& devices() {
    static const Library library = [] {
        Library l("");
        l.group("test").add<Device>("Device", "");
        return l;
    }();
    return library;
}

/// Two devices at 2 ms.
std::string two(const std::string& settings = "") {
    return "model: m\nstep: 0.002\nblocks:\n  a: {block: Device, id: a" + settings +
           "}\n  b: {block: Device, id: b}\n";
}

class Running : public ::testing::Test {
  protected:
    void SetUp() override {
        events().clear();
        act() = {};
        options.thread.locks_memory = false;
    }
    /// Runs the model up to `stop` s; `monitor` may end it.
    void run(const std::string& text, double stop,
             std::function<bool(const Runner::Progress&)> monitor = {}) {
        loaded.emplace(text, &devices());
        simulation.emplace(loaded->diagram);
        runner.emplace(*simulation, options);
        for (auto* observer : observers) runner->add_observer(*observer);
        runner->run(stop, [&](const auto& progress) { return !monitor || monitor(progress); });
    }

    RunnerOptions options;
    std::vector<Simulation::Observer*> observers;
    std::optional<Loaded> loaded;
    std::optional<Simulation> simulation;
    std::optional<Runner> runner;
};
const std::vector<std::string> clean{"start a", "start b", "stop b", "stop a"};

TEST_F(Running, GoesToItsEndAndStopsBackwards) {
    run(two(), 0.1);
    EXPECT_EQ(simulation->steps(), 50);
    EXPECT_EQ(runner->statistics().steps, 50);
    EXPECT_EQ(runner->failure(), "");
    EXPECT_EQ(events(), clean);
    EXPECT_GE(runner->wall(), 49 * 0.002) << "no step before its release";
}

TEST_F(Running, KeepsTheClockOfTheFactor) {
    options.factor = 0.5;
    run(two(), 0.02);
    EXPECT_EQ(simulation->steps(), 10);
    EXPECT_EQ(runner->statistics().period, 4'000'000);
    EXPECT_GE(runner->wall(), 9 * 0.004);
}

TEST_F(Running, EndsAfterItsDurationOnTheClock) {
    options.duration = 0.05;
    run(two(), 1e9);
    EXPECT_LE(simulation->steps(), 25);
    EXPECT_GE(simulation->steps(), 1);
    EXPECT_EQ(events(), clean);
}

TEST_F(Running, ARequestToEndInTheMiddleOfAStepLetsTheStepEnd) {
    std::promise<void> inside, asked;
    act() = [&](std::int64_t step) {
        if (step != 3) return;
        inside.set_value();
        asked.get_future().wait();
    };
    int calls = 0;
    run(two(), 1e9, [&](const Runner::Progress& progress) {
        ++calls;
        if (calls == 1) inside.get_future().wait(); // and so the loop is asked to end while inside
        if (calls == 2) asked.set_value();
        EXPECT_TRUE(calls > 2 || progress.steps <= 3);
        return false;
    });
    EXPECT_EQ(simulation->steps(), 4);
    EXPECT_EQ(events(), clean);
    EXPECT_EQ(runner->failure(), "");
}

TEST_F(Running, AFailedStepIsNamedAndDevicesStop) {
    run(two(", fails_at: 4"), 1e9);
    EXPECT_EQ(runner->failure(), "a: broke at step 4");
    EXPECT_EQ(simulation->steps(), 4);
    EXPECT_EQ(events(), clean);
}

TEST_F(Running, ADeviceThatIsAbsentIsNamed) {
    try {
        run("model: m\nstep: 0.002\nblocks:\n  a: {block: Device, id: a}\n  b: {block: Device, id: b, "
            "is_absent: true}\n",
            1);
        FAIL();
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(), "b: device b is absent; plug it in");
    }
    EXPECT_EQ(events(), (std::vector<std::string>{"start a", "stop a"}));
}

TEST_F(Running, StrictMakesARefusalAnErrorBeforeTheFirstStep) {
    options.thread.cpu = 100'000;
    run(two(), 0.01);
    ASSERT_EQ(runner->refused().size(), 1u);
    EXPECT_EQ(simulation->steps(), 5);
    events().clear();
    options.is_strict = true;
    try {
        run(two(), 0.01);
        FAIL();
    } catch (const RunError& error) {
        EXPECT_NE(std::string(error.what()).find("processor 100000 was refused"), std::string::npos);
    }
    EXPECT_EQ(simulation->steps(), 0);
    EXPECT_EQ(events(), clean);
}

void wait_for(double seconds) { sleep_until(now() + static_cast<Nanoseconds>(seconds * 1e9)); }

TEST_F(Running, StopPolicySaysWhyItStopped) {
    options.overrun = Overrun::stop;
    act() = [](std::int64_t step) { wait_for(step == 3 ? 0.01 : 0); };
    run(two(), 1e9);
    EXPECT_NE(runner->failure().find(" missed its deadline by "), std::string::npos);
    EXPECT_NE(runner->failure().find("choose another --overrun"), std::string::npos);
    EXPECT_EQ(events(), clean);
}

TEST_F(Running, AStepThatAlwaysOverrunsEndsWhenAsked) {
    for (const auto policy : {Overrun::skip, Overrun::catch_up, Overrun::degrade}) {
        events().clear();
        options.overrun = policy;
        act() = [](std::int64_t) { wait_for(0.005); };
        run(two(), 1e9, [](const Runner::Progress& progress) { return progress.steps < 5; });
        EXPECT_EQ(runner->statistics().missed(), runner->statistics().steps);
        EXPECT_EQ(events(), clean);
    }
}

TEST_F(Running, ObserversAreLeftOutWhileDegraded) {
    struct Counter : Simulation::Observer {
        void observe(const bf::Run&) noexcept override { ++count; }
        int count = 0;
    } counter;
    observers = {&counter};
    options.overrun = Overrun::degrade;
    act() = [](std::int64_t step) { wait_for(step == 3 ? 0.01 : 0); };
    run(two(), 0.02);
    EXPECT_GE(runner->statistics().degraded, 6);
    EXPECT_EQ(counter.count + runner->statistics().degraded, runner->statistics().steps);
}

TEST_F(Running, ParametersChangeBetweenTwoSteps) {
    std::vector<double> seen;
    struct Reader : Simulation::Observer {
        void observe(const bf::Run& run) noexcept override {
            const auto& s = static_cast<const Simulation&>(run);
            seen->push_back(*static_cast<const double*>(s.context().data(end.node, end.slot)));
        }
        std::vector<double>* seen;
        Node::End end;
    } reader;
    loaded.emplace(two(), &devices());
    simulation.emplace(loaded->diagram);
    runner.emplace(*simulation, options);
    reader.seen = &seen;
    reader.end = loaded->diagram.find_signal("a.y");
    runner->add_observer(reader);
    auto& mailbox = runner->access().parameters;
    int posted = 0, results = 0;
    std::int64_t changed_before = -1;
    runner->run(1e9, [&](const Runner::Progress& progress) {
        if (const auto result = mailbox.take_result()) {
            EXPECT_TRUE(result->status);
            changed_before = result->step;
            ++results;
        }
        if (progress.steps > 10 && posted == 0) {
            EXPECT_TRUE(mailbox.post(simulation->prepare({{"a.p", {100}}, {"b.p", {3}}})));
            EXPECT_FALSE(mailbox.post({})) << "one at a time";
            ++posted;
        }
        return results == 0;
    });
    ASSERT_GT(seen.size(), 12u);
    const auto change =
        std::adjacent_find(seen.begin(), seen.end(), [](double a, double b) { return b - a == 100; });
    ASSERT_NE(change, seen.end());
    EXPECT_EQ(change - seen.begin(), changed_before) << "the first update with the new value is of that step";
    for (auto it = seen.begin(); it != change; ++it) EXPECT_EQ(it[1] - it[0], 1) << "before the change";
    for (auto it = change; it + 1 != seen.end(); ++it) EXPECT_EQ(it[1] - it[0], 100) << "after it";
}

TEST_F(Running, TheWatchdogNamesTheStepAndTheBlockThatHang) {
    std::atomic<std::int64_t> stalled{-1};
    std::string where;
    options.watchdog = 50'000'000;
    options.on_stall = [&](std::int64_t step, const std::string& block) {
        where = block;
        stalled = step;
    };
    act() = [&](std::int64_t step) {
        while (step == 3 && stalled < 0) wait_for(0.001);
    };
    run(two(), 0.01);
    EXPECT_EQ(stalled, 3);
    EXPECT_EQ(where, "a");
}

std::string refusal(const std::string& text) {
    Loaded loaded(text);
    Simulation simulation(loaded.diagram);
    try {
        Runner(simulation, {}).run(1, [](const auto&) { return true; });
    } catch (const RunError& error) {
        return error.what();
    }
    return {};
}

TEST(Runner, RefusesWhatHasNoBoundedTimeByName) {
    EXPECT_EQ(refusal("model: m\nstep: 0.01\nalgebraic_loops: solve\nblocks:\n  one: {block: Constant}\n"
                      "  sum: {block: Sum, signs: +-}\n  half: {block: Gain, K: 0.5}\n"
                      "connections: {one: sum.u1, sum: half, half: sum.u2}\n"),
              "the time of a step is not bounded:\n  sum: it stands in an algebraic loop, which is iterated "
              "until its "
              "equations hold, as often as that takes; put a UnitDelay into the loop");
    EXPECT_EQ(refusal("model: m\nstep: 0.01\nsolver: cvode_bdf\nblocks:\n  one: {block: Constant}\n"
                      "  x: {block: Integrator}\nconnections: {one: x}\n"),
              "the time of a step is not bounded:\n  the solver 'cvode_bdf' chooses its own steps, as many "
              "as it takes; "
              "choose one with fixed steps, e.g. solver: rk4");
}

TEST_F(Running, NothingIsStartedBeforeItsStart) {
    options.waits = true;
    int calls = 0;
    run(two(), 0.02, [&](const Runner::Progress& progress) {
        EXPECT_TRUE(calls >= 5 || (progress.steps == 0 && events().empty()));
        if (++calls == 5) runner->access().control.start();
        return true;
    });
    EXPECT_EQ(simulation->steps(), 10);
    EXPECT_EQ(events(), clean);
    events().clear();
    run(two(), 0.02, [](const auto&) { return false; });
    EXPECT_EQ(simulation->steps(), 0);
    EXPECT_TRUE(events().empty()) << "who is never started is not stopped either";
}

TEST_F(Running, AnEmergencyStopLetsNoFurtherStepBeginAndStopsTheBlocks) {
    act() = [&](std::int64_t step) {
        if (step == 3) runner->access().control.emergency_stop();
    };
    run(two(), 1e9);
    EXPECT_EQ(simulation->steps(), 4);
    EXPECT_EQ(events(), clean);
    EXPECT_EQ(runner->failure(), "");
}

TEST_F(Running, AnEmergencyStopInAStepThatHangsGivesUpSoon) {
    std::promise<std::pair<std::int64_t, std::string>> stalled;
    std::promise<void> over;
    options.watchdog = 3600ll * 1'000'000'000;
    options.on_stall = [&](std::int64_t step, const std::string& block) {
        stalled.set_value({step, block});
        over.set_value();
    };
    act() = [&](std::int64_t step) {
        if (step != 3) return;
        runner->access().control.emergency_stop();
        over.get_future().wait();
    };
    run(two(), 1e9);
    EXPECT_EQ(stalled.get_future().get(), std::pair(std::int64_t{3}, std::string("a")));
    EXPECT_EQ(events(), clean);
}

} // namespace
} // namespace bf::realtime
