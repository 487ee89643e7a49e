// Replays of recordings that were damaged, or that another run made.
#include "bf/recording/reader.hpp"
#include "bf/run/recorder.hpp"
#include "bf/run/replay.hpp"
#include "support.hpp"

#include <algorithm>
#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf::test {
namespace {

struct DamagedRecording : testing::Test {
    DamagedRecording() { std::filesystem::create_directories(folder); }
    ~DamagedRecording() override { std::filesystem::remove_all(folder); }

    recording::Recording recorded(const std::string& model, int steps) {
        Session run(model);
        Recorder recorder(*run.simulation, run.simulation->signals(), folder / "run.mcap");
        run.simulation->add_observer(recorder);
        for (int k = 0; k < steps && run.simulation->step(); ++k) {
        }
        run.simulation->remove_observer(recorder);
        recorder.close();
        return recording::load(folder / "run.mcap");
    }

    /// "identical", the first difference, or why it is refused.
    static std::string replayed(const std::string& model, const recording::Recording& recording,
                                double from = 0) {
        Session run(formats::read_yaml_text(model, "m.yaml"));
        try {
            Replay replay(*run.simulation, recording);
            replay.start(from);
            while (replay.step()) {
            }
            return replay.difference().empty() ? "identical" : replay.difference();
        } catch (const RunError& error) {
            return error.what();
        }
    }

    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("bf_damaged_" + std::to_string(getpid()));
};

const std::string ramp = "model: m\nstep: 0.1\nblocks:\n  t: {block: Clock, period: 0.1}\n"
                         "  other: {block: Clock, period: 0.1}\n";

TEST_F(DamagedRecording, ATimeThatNoRunReachesIsRefused) {
    const auto with_last_at = [&](const std::string& model, double time) {
        auto recording = recorded(model, 3);
        recording.channels.front().time_ns.back() = static_cast<std::int64_t>(time * 1e9);
        return replayed(model, recording);
    };
    const std::string ending = ramp + "stop: 1\n", damaged = "the recording is damaged: it has ";
    EXPECT_EQ(with_last_at(ending, 1.3), damaged + "a sample at 1.3 s, but the run ends at 1 s");
    EXPECT_EQ(with_last_at(ending, 1.1).substr(0, 8), "at 1.1 s")
        << "the last step of the run is not refused";
    EXPECT_EQ(with_last_at(ramp, 2345678.5), damaged + "no sample between 0.2 s and 2345678.5 s");
    EXPECT_EQ(with_last_at(ramp, 900.5).substr(0, 10), "at 900.5 s") << "signals may rest for long";
}

TEST_F(DamagedRecording, NumbersOfChangesAreRefusedWhereTheyAreNone) {
    auto recording = recorded(ramp, 3);
    const auto changed = [&](const std::string& number, const std::string& step, const std::string& values) {
        auto damaged = recording;
        damaged.metadata.emplace(
            "parameter change " + number,
            std::map<std::string, std::string>{{"step", step}, {"name", "t.period"}, {"values", values}});
        return replayed(ramp, damaged);
    };
    EXPECT_EQ(changed("0", "2x", "1"), "the recording is damaged: '2x' in parameter change 0 is no number");
    EXPECT_EQ(changed("0", "1", "1 y 3"), "the recording is damaged: 'y' in parameter change 0 is no number");
    EXPECT_EQ(changed("two", "1", "1"),
              "the recording is damaged: 'two' in parameter change two is no number");
    EXPECT_EQ(changed("0", "9", "1"), "identical") << "what is changed after the last sample is not seen";
}

TEST_F(DamagedRecording, WithoutSamplesOrBeforeItsEndThereIsNothingToCompare) {
    auto recording = recorded(ramp, 3);
    EXPECT_EQ(replayed(ramp, recording, 7), "the recording ends at 0.2 s, before 7 s");
    EXPECT_EQ(replayed(ramp, recording, 0.2), "identical");
    for (auto& channel : recording.channels) channel.time_ns.clear(), channel.data.clear();
    EXPECT_EQ(replayed(ramp, recording), "the recording holds no samples, so there is nothing to compare");
}

TEST_F(DamagedRecording, AReplayThatFailsWhereTheRecordingGoesOnDiffers) {
    const std::string model = "model: m\nstep: 0.1\n@blocks:\n  t: {block: Clock, period: 0.1}\n"
                              "  f: {block: Fcn, expression: 1/(u - 0.5)}\nconnections: {t: f}\n";
    const auto with = [&](const std::string& line) {
        return std::string(model).replace(model.find('@'), 1, line);
    };
    const std::string strict = with("non_finite: error\n"), lenient = with("");
    const std::string difference = replayed(strict, recorded(lenient, 9));
    EXPECT_TRUE(difference.starts_with("at 0.5 s the replay fails, and the recording goes on: f: its output"))
        << difference;
    EXPECT_EQ(replayed(strict, recorded(strict, 9)), "identical") << "it ends in the same way";
}

TEST_F(DamagedRecording, ThatHoldsNoModelSaysSo) {
    const auto refusal = [](const recording::Recording& recording) -> std::string {
        try {
            return recorded_source(recording).file.string();
        } catch (const RunError& error) {
            return error.what();
        }
    };
    const std::string none = "the recording does not hold its model, so it cannot be run again; bf run "
                             "--record makes recordings that do";
    EXPECT_EQ(refusal(recorded(ramp, 1)), none);
    auto recording = recorded(ramp, 1);
    recording.metadata.emplace("run", std::map<std::string, std::string>{{"file", "/m.yaml"}});
    EXPECT_EQ(refusal(recording), none) << "its name alone";
    recording.complete = false;
    recording.defect = "it ends within a record";
    EXPECT_EQ(refusal(recording),
              "the recording was cut or damaged before its model, so it cannot be run again "
              "(it ends within a record); record it again");
}

} // namespace
} // namespace bf::test
