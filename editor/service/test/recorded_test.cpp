// What pages see of a recording that is looked at in place of a run.
#include "asking.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/library/load.hpp"
#include "bf/run/recorder.hpp"
#include "scenery.hpp"

#include <cmath>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>

namespace bf::service {
namespace {

class RecordedTest : public AskingTest {
  protected:
    /// 1 s with 11 samples of `part.double.y`, which the model calls `part.y`, too.
    void SetUp() override {
        std::ofstream(folder / "m.yaml") << "model: m\nstep: 0.1\nstop: 1\nblocks:\n  source: {block: Sine}\n"
                                            "  part:\n    inputs: [u]\n    outputs: [y]\n"
                                            "    blocks: {double: {block: Gain, K: 2}}\n"
                                            "    connections: {u: double, double: y}\n"
                                            "connections: {source: part}\nrecord: [part.y]\n";
        const LoadedModel loaded = load(folder / "m.yaml");
        Simulation run(loaded.diagram);
        Recorder recorder(run, run.recorded(), folder / "r.mcap", loaded.source);
        run.add_observer(recorder);
        run.start();
        ASSERT_TRUE(run.run_until(1)) << run.failure();
        recorder.close();
    }
    void open_recorded() {
        open("m.yaml", {}, folder / "r.mcap");
        const Json run = wait_for([](const Json& n) { return n["method"] == "run"; })["params"];
        EXPECT_EQ(run["state"], "paused");
        EXPECT_EQ(run["recorded"], why);
    }
    Json go(const Json& params) { return result("run", params); }
    const std::string why = "blocks of plugins do not run in a browser; what was recorded can be looked at";
};

TEST_F(RecordedTest, ItIsThereWithTheFirstCheckAndShowsItsEnd) {
    open("m.yaml", {}, folder / "r.mcap");
    EXPECT_EQ(result("hello", {{"protocol", protocol_version}})["run"]["state"], "none");
    const Json run = wait_for([](const Json& n) { return n["method"] == "run"; })["params"];
    EXPECT_EQ(run["time"], run["stop"]);
    EXPECT_EQ(run["time"], run["reached"]);
    EXPECT_NEAR(run["time"].get<double>(), 1, 0.11);
    EXPECT_EQ(result("hello", {{"protocol", protocol_version}})["run"], run);
}

TEST_F(RecordedTest, SignalsAreFoundByAllTheirNamesAndSamplesComeOnce) {
    open_recorded();
    const Json all = result("signals")["signals"];
    std::map<std::string, int> indices;
    for (const auto& signal : all) indices[signal["path"]] = signal["index"];
    EXPECT_EQ(indices, (std::map<std::string, int>{{"part.double.y", 0}, {"part.y", 0}}));
    const Json seen = result("watch", {{"paths", {"part.double.y", "source.y"}}});
    ASSERT_EQ(seen["signals"].size(), 1u);
    EXPECT_EQ(seen["signals"][0]["path"], "part.double.y");
    EXPECT_EQ(seen["unknown"], Json::array({"source.y"}));
    const auto bytes = sent_bytes;
    EXPECT_TRUE(bytes == 10 * (20 + 8) || bytes == 11 * (20 + 8)) << bytes;
    result("watch", {{"paths", {"part.y"}}});
    EXPECT_EQ(sent_bytes, bytes);
    page = 2;
    result("watch", {{"paths", {"part.y"}}});
    EXPECT_EQ(sent_bytes, 2 * bytes) << "which has none yet";
}

TEST_F(RecordedTest, AnyInstantIsLookedAtAndNothingRuns) {
    open_recorded();
    EXPECT_EQ(go({{"action", "to"}, {"time", 0.3}})["time"], 0.3);
    EXPECT_EQ(go({{"action", "to"}, {"time", 1e9}})["time"], go({{"action", "to"}, {"time", 5}})["stop"]);
    for (const char* action : {"start", "pause", "step", "stop", "pace", "until", "branch", "adopt"})
        EXPECT_EQ(refusal("run", {{"action", action}}), why) << action;
    EXPECT_EQ(refusal("tune", {{"name", "part.double.K"}, {"values", {3}}}), why);
}

TEST_F(RecordedTest, TheModelIsEditedAndTheRecordingStays) {
    open_recorded();
    result("edit", {{"operation", {{"do", "rename"}, {"path", "part"}, {"name", "other"}}}});
    checked();
    const Json all = result("signals")["signals"];
    EXPECT_EQ(all[0]["path"], "part.y"); // as it was recorded
    EXPECT_EQ(result("hello", {{"protocol", protocol_version}})["run"]["state"], "paused");
}

TEST_F(RecordedTest, TheModelMayBeThatOfTheRecordingWithItsValuesAndInNoFile) {
    {
        const LoadedModel loaded = load(folder / "m.yaml", {{"part.double.K", "3", {}}});
        Simulation run(loaded.diagram);
        Recorder recorder(run, run.recorded(), folder / "three.mcap", loaded.source);
        run.add_observer(recorder);
        run.start();
        ASSERT_TRUE(run.run_until(1)) << run.failure();
        recorder.close();
    }
    std::filesystem::remove(folder / "m.yaml");
    double gain = 0;
    open(
        "",
        [&](const Diagram& diagram) {
            for (const auto& node : diagram.nodes)
                if (node.path == "part.double")
                    gain = find(Simulation(diagram).parameters(), "part.double.K")[0];
            return one_body(diagram, "part.y");
        },
        folder / "three.mcap");
    const Json run = wait_for([](const Json& n) { return n["method"] == "run"; })["params"];
    EXPECT_EQ(run["recorded"], "this is a recording: it is looked at, and nothing is computed, of a run with "
                               "part.double.K = 3");
    EXPECT_EQ(run["time"], 0);
    EXPECT_EQ(result("hello", {{"protocol", protocol_version}})["document"]["file"], "m.yaml");
    EXPECT_EQ(result("scene", {{"is_wanted", true}})["worlds"].size(), 1u);
    EXPECT_EQ(gain, 3);
    // One world of one body, whose pose and centre of mass are 10 numbers.
    const auto bytes = sent_bytes;
    go({{"action", "to"}, {"time", 0.3}});
    EXPECT_EQ(sent_bytes - bytes, 20 + 8 * 10u);
    EXPECT_NEAR(last_value(10, 0), 3 * std::sin(0.3), 1e-12);
    result("edit", {{"operation", {{"do", "rename"}, {"path", "part"}, {"name", "other"}}}});
    checked();
    EXPECT_FALSE(std::filesystem::exists(folder / "m.yaml"));
}

TEST_F(RecordedTest, WhatARecordingLacksToBeShownIsNamed) {
    open(
        "", [](const Diagram& diagram) { return one_body(diagram, "source.y"); }, folder / "r.mcap");
    wait_for([](const Json& n) { return n["method"] == "run"; });
    const std::string failure = result("scene", {{"is_wanted", true}})["failure"];
    EXPECT_NE(failure.find("the recording does not tell where things are: "), std::string::npos) << failure;
    EXPECT_NE(failure.find("source.y"), std::string::npos) << failure;
}

TEST_F(RecordedTest, AFileThatIsNoRecordingIsRefused) {
    std::ofstream(folder / "no.mcap") << "nothing";
    EXPECT_THROW(open("m.yaml", {}, folder / "no.mcap"), std::runtime_error);
}

} // namespace
} // namespace bf::service
