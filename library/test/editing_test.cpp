// A run against the clock whose model is edited.
#include "bf/library/editing.hpp"

#include "bf/engine/handover.hpp"
#include "bf/run/replay.hpp"

#include <atomic>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <optional>
#include <thread>

namespace bf {
namespace {

namespace fs = std::filesystem;
using realtime::Edit;

std::string with(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

const std::string original = R"m(model: edited
step: 0.001
variables: {k: 2, offset: 0}
blocks:
  sine: {block: Sine, frequency: 70, bias: offset}
  gain: {block: Gain, K: k}
  slow: {block: DiscreteIntegrator, period: 0.003}
  fast: {block: DiscreteIntegrator}
  plant: {block: Integrator}
connections: {sine: gain, gain: [slow, fast, plant]}
)m";

/// Sees the integrators in each step; one that is not there is 0.
class Seen final : public Run::Observer {
  public:
    Seen(const Run& run, std::vector<double>& to, std::atomic<std::int64_t>& steps) : to_(to), steps_(steps) {
        const auto all = run.signals();
        for (const char* path : {"slow.y", "fast.y", "plant.y"}) {
            const auto found = std::ranges::find(all, path, &Quantity::path);
            signals_.push_back(found == all.end() ? std::nullopt : std::optional(*found));
        }
    }
    void observe(const Run&) noexcept override {
        for (const auto& signal : signals_) to_.push_back(signal ? (*signal)[0] : 0);
        ++steps_;
    }

  private:
    std::vector<std::optional<Quantity>> signals_;
    std::vector<double>& to_;
    std::atomic<std::int64_t>& steps_;
};

class Editing : public ::testing::Test {
  protected:
    Editing() {
        std::string name = (fs::temp_directory_path() / "bf_editing_XXXXXX").string();
        folder = ::mkdtemp(name.data());
        values.reserve(1'000'000);
        begin(original);
    }
    ~Editing() override {
        end();
        fs::remove_all(folder);
    }

    fs::path write(const std::string& text, const std::string& name = "model.yaml") const {
        std::ofstream(folder / name) << text;
        return folder / name;
    }
    /// Runs the model against the clock until `end`.
    void begin(const std::string& text, bool is_watched = false) {
        end();
        values.clear();
        steps = 0;
        edits.clear();
        model.emplace(load(write(text)));
        simulation.emplace(model->diagram);
        recorder.emplace(*simulation, simulation->recorded(), folder / "run.mcap", model->source,
                         recording::WriterOptions{.drop_when_full = true});
        editing.emplace(*model, *simulation, [this](bf::Run& next) { return recorder->continued(next); });
        realtime::RunnerOptions options;
        options.thread.locks_memory = false;
        if (is_watched) {
            options.watchdog = 3600ll * 1'000'000'000;
            options.on_stall = [](auto...) {};
        }
        runner.emplace(*simulation, options);
        runner->add_observer(see(*simulation));
        runner->add_observer(*recorder);
        loop = std::thread([this] { runner->run(1e9, [this](const auto&) { return !is_over; }); });
    }
    void end() {
        is_over = true;
        if (loop.joinable()) loop.join();
        is_over = false;
    }
    Seen& see(const bf::Run& run) { return *seen.emplace_back(std::make_unique<Seen>(run, values, steps)); }
    void wait_for_steps(std::int64_t more) const {
        for (const std::int64_t until = steps + more; steps < until;) std::this_thread::yield();
    }

    /// What becomes of an edit; where it is made the step before which the loop took it over is noted.
    realtime::Edited edit(const Edit& made, const std::vector<ParameterValue>& asked = {}) {
        auto found = editing->prepare(made, asked);
        if (!found.successor) return found;
        auto& succession = *runner->access().succession;
        std::vector<bf::Run::Observer*> observers = found.observers;
        observers.push_back(&see(found.successor->run()));
        succession.post(*found.successor, observers);
        std::optional<std::int64_t> step;
        while (!(step = succession.taken())) std::this_thread::yield();
        edits.push_back({*step, made.text, found.asked});
        recorder->edited(*step, "somebody", "an edit", editing->prepared());
        editing->finish(true);
        return found;
    }
    realtime::Edited edit(const std::string& text) { return edit(Edit{.text = text}); }

    struct Made {
        std::int64_t step;
        std::string text;
        std::vector<ParameterValue> asked;
    };
    /// The same by a simulation that is edited at the same steps.
    std::vector<double> simulated() {
        std::vector<double> all;
        std::atomic<std::int64_t> count{0};
        std::vector<std::unique_ptr<LoadedModel>> models;
        std::vector<std::unique_ptr<Simulation>> runs;
        const auto add = [&](const std::string& text) -> Simulation& {
            models.push_back(std::make_unique<LoadedModel>(load(write(text, "again.yaml"))));
            runs.push_back(std::make_unique<Simulation>(models.back()->diagram));
            seen.push_back(std::make_unique<Seen>(*runs.back(), all, count));
            runs.back()->add_observer(*seen.back());
            runs.back()->start();
            return *runs.back();
        };
        Simulation* run = &add(original);
        for (std::size_t next = 0; all.size() < values.size();) {
            for (; next < edits.size() && edits[next].step == run->steps(); ++next) {
                Simulation& other = add(edits[next].text);
                other.go_on_from(*run);
                set_again(other, edits[next].asked);
                run = &other;
            }
            if (!run->step()) throw std::runtime_error(run->failure());
        }
        return all;
    }

    fs::path folder;
    std::optional<LoadedModel> model;
    std::optional<Simulation> simulation;
    std::optional<Recorder> recorder;
    std::optional<SimulationEditing> editing;
    std::optional<realtime::Runner> runner;
    std::vector<std::unique_ptr<Seen>> seen;
    std::vector<double> values; ///< that the loop computed
    std::atomic<std::int64_t> steps{0};
    std::vector<Made> edits;
    std::atomic<bool> is_over{false};
    std::thread loop;
};

const std::string two_blocks = with(original, "blocks:\n",
                                    "blocks:\n  first: {block: UnitDelay}\n"
                                    "  half: {block: Gain, K: 0.5}\n");
const std::string more = with(two_blocks, "{sine: gain,", "{sine: half, half: [gain, first],");

TEST_F(Editing, ARunThatIsEditedManyTimesEqualsASimulationEditedAtTheSameSteps) {
    const std::vector<std::string> texts{with(original, "k: 2", "k: -3"), more, original,
                                         with(more, "K: 0.5", "K: 0.25"),
                                         with(original, "period: 0.003", "period: 0.004")};
    for (const bool is_watched : {false, true}) {
        begin(original, is_watched);
        for (int k = 0; k < 25; ++k) {
            wait_for_steps(k % 7);
            const auto found =
                edit(Edit{.text = texts[static_cast<std::size_t>(k) % texts.size()], .accepts_loss = true});
            EXPECT_EQ(found.refusal, "");
        }
        wait_for_steps(20);
        end();
        ASSERT_EQ(edits.size(), 25u);
        EXPECT_GT(edits.back().step, edits.front().step);
        EXPECT_EQ(values, simulated());
        EXPECT_GT(std::ranges::count_if(values, [](double x) { return x != 0; }), 100);
        EXPECT_EQ(runner->failure(), "");
        EXPECT_EQ(runner->stepped().steps() * 3, static_cast<std::int64_t>(values.size()));
    }
}

TEST_F(Editing, ARunMissesNoMoreDeadlinesThanWithoutAnEdit) {
    const auto missed = [&](bool is_edited) {
        begin(original);
        for (int k = 0; k < 20; ++k) {
            if (is_edited) {
                EXPECT_EQ(edit(k % 2 == 0 ? more : with(more, "K: 0.5", "K: 0.25")).refusal, "");
            } else {
                wait_for_steps(5);
            }
            wait_for_steps(10);
        }
        end();
        return static_cast<double>(runner->statistics().missed()) /
               static_cast<double>(runner->statistics().steps);
    };
    // Others may use the machine, too: in one of several rounds they disturb the edited run least.
    double with_edits = 1, without = 0;
    for (int round = 0; round < 10 && with_edits > without; ++round) {
        without = missed(false);
        with_edits = missed(true);
        EXPECT_EQ(edits.size(), 20u);
    }
    EXPECT_LE(with_edits, without);
}

TEST_F(Editing, WhatWouldBeLostIsSaidBeforeAndWhatBeginsToo) {
    const std::string without =
        with(with(original, "  fast: {block: DiscreteIntegrator}\n", ""), "fast, ", "");
    const auto asked = edit(without);
    EXPECT_EQ(asked.successor, nullptr);
    EXPECT_EQ(asked.lost,
              (std::vector<std::string>{"'fast.x' is no longer there", "'fast.before' is no longer there"}));
    EXPECT_TRUE(edits.empty());
    EXPECT_EQ(edit(Edit{.text = without, .accepts_loss = true}).lost.size(), 2u);
    EXPECT_EQ(edits.size(), 1u);
    EXPECT_EQ(edit(more).begun, (std::vector<std::string>{"first.x", "fast.x", "fast.before"}));
    EXPECT_EQ(edits.size(), 2u);
    EXPECT_EQ(edit(with(more, "model: edited", "model: edited\ndoc: nothing that is computed")).successor,
              nullptr);
}

TEST_F(Editing, StatesFollowBlocksThatAreRenamed) {
    const auto rename = [](std::string text) {
        for (std::size_t at; (at = text.find("plant")) != std::string::npos;) text.replace(at, 5, "motor");
        return text;
    };
    wait_for_steps(10);
    Edit made{.text = rename(original), .origins = {{"motor", "plant"}}};
    const auto found = edit(made);
    EXPECT_EQ(found.refusal, "");
    EXPECT_TRUE(found.lost.empty() && found.begun.empty());
    made.origins.clear();
    made.text = original;
    EXPECT_EQ(edit(made).lost, std::vector<std::string>{"'motor.x' is no longer there"});
}

TEST_F(Editing, ValuesThatWereSetStayUnlessTheEditGivesThem) {
    const std::vector<ParameterValue> asked{{"k", {5}}, {"offset", {1}}, {"fast.gain", {3}}};
    const auto found = edit(Edit{.text = with(more, "offset: 0", "offset: 4")}, asked);
    ASSERT_EQ(found.asked.size(), 2u);
    EXPECT_EQ(found.asked[0].path, "k");
    EXPECT_EQ(found.asked[1].path, "fast.gain");
    wait_for_steps(5);
    end();
    const auto parameters = runner->stepped().parameters();
    EXPECT_EQ(find(parameters, "gain.K")[0], 5);
    EXPECT_EQ(find(parameters, "sine.bias")[0], 4);
    EXPECT_EQ(find(parameters, "fast.gain")[0], 3);
    EXPECT_EQ(values, simulated());
}

TEST_F(Editing, ValuesOfABlockThatIsGoneDoNotGoToAnotherOneOfItsName) {
    // What was called fast is called late, and one that was not there before is called fast.
    const std::string both = with(with(original, "  fast:", "  late: {block: DiscreteIntegrator}\n  fast:"),
                                  "fast, ", "late, fast, ");
    const std::vector<ParameterValue> asked{{"fast.gain", {3}}};
    const auto found =
        edit(Edit{.text = both, .origins = {{"late", "fast"}, {"fast", {}}}, .accepts_loss = true}, asked);
    ASSERT_EQ(found.asked.size(), 1u) << found.refusal;
    EXPECT_EQ(found.asked[0].path, "late.gain");
    const auto replaced =
        edit(Edit{.text = original, .origins = {{"fast", {}}}, .accepts_loss = true}, asked);
    EXPECT_NE(replaced.successor, nullptr) << replaced.refusal;
    EXPECT_TRUE(replaced.asked.empty());
}

TEST_F(Editing, WrongModelsAreRefusedWithTheTextOfACheckAndTheRunGoesOn) {
    const auto refusal = [&](const std::string& text) { return edit(text).refusal; };
    EXPECT_NE(refusal(with(original, "Gain, K: k", "Gian, K: k")).find("did you mean 'Gain'"),
              std::string::npos);
    EXPECT_NE(refusal("{").find("model.yaml:1"), std::string::npos);
    EXPECT_NE(refusal("").size(), 0u);
    EXPECT_EQ(
        refusal(with(with(original, "step: 0.001", "step: 0.002"), "period: 0.003", "period: 0.004")),
        "the edited model has a step of 0.002 s, and the program keeps its period of 0.001 s; start it anew");
    EXPECT_NE(refusal(with(original, "step: 0.001\n", "step: 0.001\nsolver: cvode_bdf\n"))
                  .find("the time of a step is not bounded"),
              std::string::npos);
    EXPECT_EQ(
        refusal(with(original, "step: 0.001\n", "step: 0.001\nplugins: [WholeBodyToolbox]\n")),
        "the program has not loaded the plugin 'WholeBodyToolbox'; start it anew with the edited model");
    EXPECT_TRUE(edits.empty());
    wait_for_steps(5);
    end();
    EXPECT_EQ(values, simulated());
}

TEST_F(Editing, NoModelIsReadFromTheDisk) {
    const fs::path part = write("model: part\nstep: 0.001\ninputs: [u]\noutputs: [y]\n"
                                "blocks: {g: {block: Gain, K: 3}}\nconnections: {u: g, g: y}\n",
                                "part.yaml");
    const std::string uses = with(with(original, "blocks:\n", "blocks:\n  part: {file: part.yaml}\n"),
                                  "{sine: gain,", "{sine: [gain, part],");
    EXPECT_NE(edit(uses).refusal.find("part.yaml' is not given with the model"), std::string::npos);
    EXPECT_NE(edit(with(uses, "part.yaml", "/etc/passwd")).refusal.find("/etc/passwd' is not given"),
              std::string::npos);
    std::ostringstream text;
    text << std::ifstream(part).rdbuf();
    fs::remove(part);
    EXPECT_EQ(edit(Edit{.text = uses, .files = {{"part.yaml", text.str()}}}).refusal, "");
    EXPECT_EQ(edits.size(), 1u);
}

TEST_F(Editing, NoFileIsReadThatTheProgramDoesNotUse) {
    write("time,y\n0,1\n1,2\n", "own.csv");
    write("time,y\n0,1\n1,2\n", "other.csv");
    const auto reads = [&](const std::string& file) {
        return with(original, "blocks:\n", "blocks:\n  table: {block: SignalFromFile, file: " + file + "}\n");
    };
    begin(reads("own.csv"));
    const auto refusal = [&](const std::string& file) { return edit(reads(file)).refusal; };
    const std::string why =
        "table: it names a file that the program does not use; start the program anew with "
        "this model";
    for (const char* file : {"other.csv", "/etc/passwd", "./other.csv", "../../../../../../../../etc/passwd"})
        EXPECT_NE(refusal(file).find(why), std::string::npos) << file << ": " << refusal(file);
    EXPECT_EQ(refusal("./own.csv"), "");
    EXPECT_EQ(edit(with(reads("own.csv"), "k: 2", "k: 3")).refusal, "");

    const std::string named = folder.string();
    folder = fs::relative(folder); // as the program was started, so that the file's name is relative, too
    begin(reads("own.csv"));
    EXPECT_EQ(edit(with(reads("own.csv"), "k: 2", "k: 3")).refusal, "");
    EXPECT_NE(refusal("other.csv").find(why), std::string::npos);
    end();
    folder = named;
}

TEST_F(Editing, OneThatTheLoopDoesNotTakeAnyMoreIsForgotten) {
    auto found = editing->prepare(Edit{.text = more}, {});
    ASSERT_NE(found.successor, nullptr);
    end();
    auto& succession = *runner->access().succession;
    succession.post(*found.successor, {&see(found.successor->run())});
    EXPECT_FALSE(succession.taken());
    succession.withdraw();
    editing->finish(false);
    EXPECT_EQ(&runner->stepped(), &*simulation);
    EXPECT_EQ(values, simulated());
}

TEST_F(Editing, ARecordingGoesOnWithWhatIsStillThereAndItsReplayEndsAtTheEdit) {
    wait_for_steps(20);
    const std::string other =
        with(with(more, "  slow: {block: DiscreteIntegrator, period: 0.003}\n", ""), "slow, ", "");
    edit(Edit{.text = other, .accepts_loss = true});
    wait_for_steps(20);
    end();
    recorder->close();
    ASSERT_EQ(recorder->dropped(), 0u);
    const auto recording = recording::load(folder / "run.mcap");
    const std::int64_t step = edits.at(0).step;
    for (const auto& channel : recording.channels) {
        EXPECT_EQ(channel.name.find("first"), std::string::npos);
        const bool goes_on = channel.name != "slow.y";
        EXPECT_EQ(channel.time_ns.back() >= step * 1'000'000, goes_on) << channel.name;
        if (channel.name != "fast.y") continue;
        ASSERT_EQ(channel.samples() * 3, values.size());
        for (std::size_t k = 0; k < channel.samples(); ++k) {
            double x = 0;
            std::memcpy(&x, channel.sample(k).data(), sizeof x);
            EXPECT_EQ(x, values[3 * k + 1]) << k;
        }
    }
    std::map<std::string, std::string> texts;
    for (const auto& attachment : recording.attachments) texts[attachment.name] = attachment.text();
    EXPECT_EQ(texts.at("model"), original);
    EXPECT_EQ(texts.at("edit 0/model"), other);
    EXPECT_EQ(recording.metadata.at("edit 0").at("who"), "somebody");

    const LoadedModel again = load(recorded_source(recording));
    Simulation run(again.diagram);
    Replay replay(run, recording);
    replay.start();
    while (replay.step()) {
    }
    EXPECT_EQ(replay.difference(), "");
    EXPECT_EQ(run.steps(), step);
    EXPECT_EQ(replay.edited(), static_cast<double>(step) * 0.001);
    EXPECT_LT(replay.end(), *replay.edited());
}

TEST_F(Editing, ARecordingGoesOnUnderTheNamesThatTheModelGivesToWhatItRecords) {
    const std::string names = "record: [sine, slow.y]\n";
    begin(original + names);
    wait_for_steps(20);
    edit(more + names);
    wait_for_steps(20);
    end();
    recorder->close();
    const auto recording = recording::load(folder / "run.mcap");
    ASSERT_EQ(recording.channels.size(), 2u);
    for (const auto& channel : recording.channels)
        EXPECT_GT(channel.time_ns.back(), edits.at(0).step * 1'000'000) << channel.name;
}

TEST_F(Editing, ViewersThatAreNotOursEditAndAreTold) {
    end();
    const fs::path file = write(original);
    model.emplace(load(file));
    simulation.emplace(model->diagram);
    editing.emplace(*model, *simulation);
    realtime::RunnerOptions options;
    options.thread.locks_memory = false;
    runner.emplace(*simulation, options);
    std::int64_t last = -1;
    std::vector<std::string> known; // the text of the model from each step on
    realtime::Server server(*simulation, simulation->signals(), runner->access(),
                            {.where = "0",
                             .is_controlled = true,
                             .editing = &*editing,
                             .on_edit = [&](std::int64_t step, const auto&) {
                                 EXPECT_GE(step, last);
                                 last = step;
                                 known.push_back(editing->prepared().texts.at(editing->prepared().file));
                             }});
    runner->add_observer(server);
    std::atomic<int> code{-1};
    std::thread viewer([&] {
        code = std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/library/test/check_edits.py '" +
                            server.address() + server.token() + "' '" + file.string() + "'")
                               .c_str());
    });
    runner->run(1e9, [&](const auto&) { return code < 0; });
    viewer.join();
    EXPECT_EQ(code, 0) << "see the text above";
    EXPECT_GE(known.size(), 4u);
    EXPECT_EQ(server.counts().edits, known.size());
    EXPECT_EQ(runner->failure(), "");
}

} // namespace
} // namespace bf
