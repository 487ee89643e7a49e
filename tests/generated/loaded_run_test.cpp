// A generated program in a shared library is a run like the interpreted model: recorded, replayed, saved
// alike.
#include "bf/blocks/standard.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/run/loaded.hpp"
#include "bf/run/recorder.hpp"
#include "bf/run/replay.hpp"
#include "bf/run/snapshot.hpp"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>
#include <unistd.h>

namespace bf {
namespace {

namespace fs = std::filesystem;

// Rates with an offset, continuous states, zero crossings that are answered inside the run, a trigger, types,
// a matrix, a variable and an input.
constexpr const char* text = R"(
model: many sides
step: 0.01
stop: 1
solver: rk4
variables: {k: 4}
inputs: [push]
blocks:
  wave: {block: Sine, frequency: 9}
  gain: {block: Gain, K: k}
  position: {block: Integrator, initial: 1}
  slow: {block: UnitDelay, initial: 0.5, period: 0.05, offset: 0.02}
  matrix: {block: Constant, value: "[1 2; 3 4]"}
  whole: {block: Constant, value: int16(7)}
  fired:
    execution: triggered
    trigger: rising
    inputs: [u]
    outputs: [n]
    blocks:
      sum: {block: Sum}
      last: {block: UnitDelay}
    connections: {u: sum.u1, last: sum.u2, sum: [last, n]}
connections:
  push: gain
  gain: [position, slow]
  wave: [fired.trigger, fired.u]
plots: {Both: [position, gain]}
record: ['*']
)";

std::string content(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

struct LoadedModel : ::testing::Test {
    LoadedModel() {
        fs::create_directories(folder);
        registry.add(standard_library());
        source.file = folder / "model.yaml";
        source.texts[source.file] = text;
        diagram = elaborate(formats::read_yaml_text(text, "model.yaml"), registry);
        codegen::write(codegen::generate(diagram), folder / "code");
        const std::string build = "cd " + (folder / "code").string() + " && " + BF_CXX +
                                  " -std=c++17 -O1 -Wall -Wextra -Werror -ffp-contract=off -fPIC -shared -I. "
                                  "-Iinclude many_sides*.cpp -o libmany_sides.so";
        is_built = std::system(build.c_str()) == 0;
    }
    ~LoadedModel() override { fs::remove_all(folder); }

    fs::path library() const { return folder / "code" / "libmany_sides.so"; }

    /// Steps with an input and two changes, recording everything with a checkpoint.
    void record(bf::Run& run, const fs::path& file) const {
        const auto push = find(run.inputs(), "push");
        Recorder recorder(run, run.recorded(), file, source);
        run.add_observer(recorder);
        run.start();
        for (int k = 0; k < 100; ++k) {
            const double u = 0.01 * k * k - 3;
            std::memcpy(push.data, &u, sizeof u);
            if (k == 40) {
                run.set_parameter("slow.initial", {9});
                run.set_parameter("wave.amplitude", {2.5});
                recorder.parameter_changed(k, "wave.amplitude", {2.5});
            }
            ASSERT_TRUE(run.step()) << run.failure();
        }
        run.stop();
        run.remove_observer(recorder);
        recorder.close();
    }

    const fs::path folder = fs::temp_directory_path() / ("bf_loaded_" + std::to_string(getpid()));
    Registry registry;
    ModelSource source;
    Diagram diagram;
    bool is_built = false;
};

TEST_F(LoadedModel, IsRecordedByteForByteAsTheInterpretedOneAndReplaysItsRecording) {
    ASSERT_TRUE(is_built);
    Simulation interpreted(diagram);
    LoadedRun generated(library());
    record(interpreted, folder / "interpreted.mcap");
    record(generated, folder / "generated.mcap");
    const std::string bytes = content(folder / "interpreted.mcap");
    EXPECT_GT(bytes.size(), 10000u);
    EXPECT_TRUE(bytes == content(folder / "generated.mcap")); // names, units, rates, plots, samples

    const auto recorded = recording::load(folder / "interpreted.mcap");
    LoadedRun again(library());
    Replay replay(again, recorded);
    replay.start();
    while (replay.step()) {
    }
    EXPECT_EQ(replay.difference(), "");
    EXPECT_EQ(replay.missing(), 0);
    EXPECT_GT(replay.samples(), 500);
    EXPECT_EQ(replay.played_back(), 1u); // push
}

TEST_F(LoadedModel, GoesOnFromASnapshotOfAnotherRunBitForBit) {
    ASSERT_TRUE(is_built);
    LoadedRun first(library()), second(library());
    first.start();
    first.set_parameter("k", {2});
    for (int k = 0; k < 37; ++k) ASSERT_TRUE(first.step());
    const auto snapshot = make_snapshot(first);
    second.start();
    restore_snapshot(second, snapshot, "s");
    EXPECT_EQ(second.steps(), 37);
    EXPECT_EQ(find(second.parameters(), "gain.K")[0], 2);
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(first.step() && second.step());
    const auto one = first.signals(), other = second.signals();
    for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].values(), other[i].values()) << one[i].path;
    const Simulation interpreted(diagram);
    EXPECT_NE(interpreted.fingerprint(), first.fingerprint()); // their snapshots do not fit
}

TEST_F(LoadedModel, RefusesWhatIsWrongByName) {
    ASSERT_TRUE(is_built);
    LoadedRun run(library());
    const auto text_of = [](auto&& f) -> std::string {
        try {
            f();
        } catch (const RunError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(
        text_of([&] { run.set_parameter("gain.k", {1}); }),
        "there is no parameter 'gain.k'; did you mean 'gain.K'?; parameters are called block.parameter");
    EXPECT_EQ(text_of([&] {
                  run.set_parameter("gain.K", {1, 2});
              }),
              "parameter 'gain.K' has 1 elements, not 2");
    EXPECT_EQ(text_of([&] { find(run.signals(), "gian"); }), "the run has no 'gian'; did you mean 'gain'?");
    // A block with one signal is found by its own path.
    EXPECT_EQ(find(Simulation(diagram).signals(), "gain").path, "gain.y");
    EXPECT_NE(text_of([&] { LoadedRun("/nowhere/lib.so"); }).find("cannot be opened"), std::string::npos);
}

} // namespace
} // namespace bf
