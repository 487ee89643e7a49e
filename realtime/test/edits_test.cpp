// Edits of the model of a run, asked for by viewers that are not ours and prepared by a stand-in.
#include "support.hpp"

#include "bf/realtime/server.hpp"

#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sys/resource.h>

namespace bf::realtime {
namespace {

namespace fs = std::filesystem;

/// `count` grows by `one` in each step. A second model has no `old`, another one has it as a vector.
const std::string counting = R"m(model: counting
step: 0.001
variables: {k: 2}
blocks:
  one: {block: Constant, value: 1}
  sum: {block: Sum}
  count: {block: UnitDelay}
  clock: {block: Clock}
  gain: {block: Gain, K: k}
  old: {block: Clock}
connections: {one: sum.u1, count: sum.u2, sum: count, clock: gain}
)m";

/// Makes runs of the texts of edits. A text of one word is an answer: "wrong" throws, "doubtful" needs
/// somebody who accepts a loss and has no run. One that begins with "# hold" is prepared only when there is a
/// file "go" in the folder.
class StandIn final : public Editing {
  public:
    StandIn(Simulation& first, fs::path folder) : now_(&first), folder_(std::move(folder)) {}

    Edited prepare(const Edit& edit, const std::vector<ParameterValue>& asked) override {
        edits.push_back(edit);
        values.push_back(asked);
        niceness = ::getpriority(PRIO_PROCESS, 0); // of this thread
        if (edit.text.starts_with("# hold")) {
            std::ofstream(folder_ / "held");
            while (!fs::exists(folder_ / "go")) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            fs::remove(folder_ / "go");
        }
        if (edit.text == "wrong") throw std::runtime_error("it is wrong; write another one");
        if (edit.text == "doubtful")
            return {.lost = {"'a.x' is no longer there"}, .begun = {"b.x"}, .unclear = {"is c d?"}};
        next_ = &made_.emplace_back(edit.text, *now_);
        next_->simulation.start();
        return {.begun = {"what is new"}, .successor = next_, .asked = asked};
    }
    void finish(bool has_taken_over) override {
        finished.push_back(has_taken_over);
        if (!has_taken_over) return;
        now_->stop();
        now_ = &next_->simulation;
    }

    std::vector<Edit> edits;
    std::vector<std::vector<ParameterValue>> values; ///< that viewers have set before each
    std::vector<bool> finished;
    int niceness = 0;

  private:
    struct Made final : Successor {
        Made(const std::string& text, Simulation& before)
            : loaded(text), simulation(loaded.diagram, before) {}
        Run& run() override { return simulation; }
        void take_over() noexcept override { simulation.take_over(); }
        Loaded loaded;
        Simulation simulation;
    };
    Simulation* now_;
    Made* next_ = nullptr;
    std::deque<Made> made_;
    const fs::path folder_;
};

/// A loop of `counting` with a viewer of check_edits.py, which ends the loop and lives longer.
class Edits : public ::testing::Test {
  protected:
    void watch(const std::string& how) {
        std::string name = (fs::temp_directory_path() / "bf_edits_XXXXXX").string();
        const fs::path folder = ::mkdtemp(name.data());
        std::ofstream(folder / "model.yaml") << counting;
        editing.emplace(simulation, folder);
        if (served.editing == &none) served.editing = &*editing;
        served.on_edit = [&](std::int64_t step, const LogEntry& entry) {
            steps.push_back(step);
            entries.push_back(entry);
        };
        options.thread.locks_memory = false;
        runner.emplace(simulation, options);
        {
            Server server(simulation, simulation.signals(), runner->access(), served);
            runner->add_observer(server);
            std::atomic<int> code{-1};
            std::thread viewer([&] {
                code = std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/check_edits.py " + how +
                                    " '" + server.address() + server.token() + "' '" + folder.string() + "'")
                                       .c_str());
            });
            runner->run(1e9, [&](const auto&) { return code < 0; });
            if (ends_at_once) server.end("", false);
            viewer.join();
            EXPECT_EQ(code, 0) << "see the text above";
            if (!ends_at_once) server.end("", false);
            count = server.counts().edits;
        }
        EXPECT_EQ(runner->failure(), "");
        fs::remove_all(folder);
    }
    double last(const std::string& path) {
        const auto signals = runner->stepped().signals();
        return (*std::ranges::find(signals, path, &Quantity::path))[0];
    }

    class None final : public Editing {
        Edited prepare(const Edit&, const std::vector<ParameterValue>&) override { return {}; }
        void finish(bool) override {}
    } none; ///< stands for the one that is made with the folder
    Loaded loaded{counting};
    Simulation simulation{loaded.diagram};
    std::optional<StandIn> editing;
    RunnerOptions options;
    ServerOptions served{.where = "0", .is_controlled = true, .editing = &none};
    bool ends_at_once = false; ///< before the viewer goes
    std::optional<Runner> runner;
    std::vector<std::int64_t> steps; ///< from which edits act
    std::vector<LogEntry> entries;
    std::uint64_t count = 0; ///< of edits
};

TEST_F(Edits, ARunGoesOnBetweenTwoStepsAndItsViewersAreTold) {
    watch("made");
    ASSERT_EQ(steps.size(), 2u);
    EXPECT_EQ(count, 2u);
    EXPECT_EQ(editing->finished, (std::vector<bool>{true, true}));
    EXPECT_GE(editing->niceness, 10) << "the thread of an edit gives way";
    // It counts by ones up to the first edit, by threes to the second one, and then by fives.
    const auto n = static_cast<double>(runner->stepped().steps() - 1);
    const auto first = static_cast<double>(steps[0]), second = static_cast<double>(steps[1]);
    EXPECT_GT(first, 0);
    EXPECT_EQ(last("count.y"), first + 3 * (second - first) + 5 * (n - second));
    EXPECT_EQ(entries[0].what, "edit: threes");
    EXPECT_EQ(entries[1].what.size(), 6u + 80u) << "a long name is cut";
    EXPECT_TRUE(entries[0].who.starts_with("page 1 of ada@desk at 127.0.0.1:")) << entries[0].who;
    EXPECT_GE(entries[0].time, (first - 1) * 0.001);
}

TEST_F(Edits, WhoPreparesThemIsToldWhatTheViewerKnowsAndWhatWasSet) {
    watch("told");
    const auto& edits = editing->edits;
    ASSERT_EQ(edits.size(), 4u);
    EXPECT_EQ(edits[0].text, "doubtful");
    EXPECT_EQ(edits[0].files, (std::map<std::string, std::string>{{"part.yaml", "a text"}}));
    EXPECT_EQ(edits[0].origins,
              (std::map<std::string, std::optional<std::string>>{{"new", {}}, {"motor", "plant"}}));
    EXPECT_TRUE(edits[0].is_by_hand);
    EXPECT_FALSE(edits[0].accepts_loss);
    EXPECT_FALSE(edits[0].is_late) << "it knows of all edits: none";
    EXPECT_FALSE(edits[1].is_by_hand);
    EXPECT_TRUE(edits[1].accepts_loss);
    EXPECT_TRUE(edits[1].is_late) << "it knows of another number of edits";
    EXPECT_TRUE(edits[1].origins.empty());
    EXPECT_TRUE(edits[3].is_late) << "there was one meanwhile";
    // The newest value of each, the last one that was set at the end.
    std::vector<std::pair<std::string, double>> set;
    for (const auto& value : editing->values[2]) set.emplace_back(value.path, value.values.at(0));
    EXPECT_EQ(set, (std::vector<std::pair<std::string, double>>{{"k", 4}, {"gain.K", 6}}));
    EXPECT_EQ(editing->values[3].size(), 2u) << "what holds in the edited run";
    EXPECT_TRUE(editing->values[0].empty());
}

TEST_F(Edits, ValuesThatAreSetMeanwhileWaitForTheEditAndHoldAfterIt) {
    watch("meanwhile");
    EXPECT_EQ(find(runner->stepped().parameters(), "gain.K")[0], 9);
    EXPECT_EQ(find(runner->stepped().parameters(), "one.value")[0], 3);
    EXPECT_EQ(find(simulation.parameters(), "gain.K")[0], 2) << "the run before is left alone";
    EXPECT_EQ(editing->finished, std::vector<bool>{true});
}

TEST_F(Edits, WrongOnesAreRefusedWithTheReasonAndTheRunGoesOn) {
    watch("refused");
    EXPECT_EQ(editing->edits.size(), 4u) << "those that make no sense come to nobody";
    EXPECT_EQ(&runner->stepped(), &simulation);
    EXPECT_EQ(last("count.y"), static_cast<double>(simulation.steps() - 1));
    EXPECT_TRUE(editing->finished.empty());
    EXPECT_EQ(count, 0u);
}

TEST_F(Edits, AnEditOfALongModelDelaysNothingElseThatItsViewerAsksFor) {
    watch("long");
    EXPECT_EQ(editing->edits.at(0).text.size(), 3'000'000u);
}

TEST_F(Edits, HaveModelsOfFourMebibytesAtMost) {
    watch("longest");
    EXPECT_EQ(editing->edits.size(), 1u);
}

TEST_F(Edits, GoOnFromARunThatIsThere) {
    options.waits = true;
    watch("waiting");
    EXPECT_TRUE(editing->edits.empty());
}

TEST_F(Edits, OneThatComesTooLateForTheLoopIsForgotten) {
    watch("late");
    EXPECT_EQ(editing->finished, std::vector<bool>{false});
    EXPECT_EQ(&runner->stepped(), &simulation);
    EXPECT_TRUE(steps.empty());
}

TEST_F(Edits, AProgramThatEndsForgetsTheOneThatIsPrepared) {
    ends_at_once = true;
    watch("ending");
    EXPECT_EQ(editing->finished, std::vector<bool>{false});
    EXPECT_EQ(&runner->stepped(), &simulation);
    EXPECT_EQ(count, 0u);
}

TEST_F(Edits, AreNotOfferedWhereNobodyMakesThem) {
    served.editing = nullptr;
    watch("nobody");
}

TEST_F(Edits, AreNotForThoseWhoLookAlone) {
    served.is_controlled = false;
    watch("look");
    EXPECT_TRUE(editing->edits.empty());
}

} // namespace
} // namespace bf::realtime
