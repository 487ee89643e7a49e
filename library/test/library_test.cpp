#include "bf/library/load.hpp"
#include "bf/library/sweep.hpp"

#include "bf/base/files.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>
#include <utility>

namespace bf {
namespace {

namespace fs = std::filesystem;

/// A folder of its own, which goes with it.
class InAFolder : public testing::Test {
  protected:
    InAFolder() {
        std::string name = (fs::temp_directory_path() / "bf_library_XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
    }
    ~InAFolder() override { fs::remove_all(folder_); }

    fs::path write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name) << text;
        return folder_ / name;
    }
    std::string text_of(const fs::path& file) const {
        std::ostringstream text;
        text << std::ifstream(file).rdbuf();
        return text.str();
    }

    fs::path folder_;
};

/// x' = -a x from 1.
const std::string decay = "model: decay\nstep: 0.001\nstop: 1\nsolver: rk4\nvariables: {a: 1}\noutputs: [x]\n"
                          "blocks:\n  integral: {block: Integrator, initial: 1}\n"
                          "  slope: {block: Gain, K: -a}\n"
                          "connections: {integral: [slope, x], slope: integral}\n";

/// In the last step, which stands a base step before the end.
double last_x(const LoadedModel& loaded) {
    Simulation run(loaded.diagram);
    run.start();
    EXPECT_TRUE(run.run_until(loaded.diagram.stop)) << run.failure();
    const auto signals = run.signals();
    return find(signals, "x")[0];
}

std::string errors_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

using Load = InAFolder;

TEST_F(Load, TheLastChangeOfANameCounts) {
    const fs::path file = write("m.yaml", decay);
    EXPECT_NEAR(last_x(load(file)), std::exp(-0.999), 1e-12);
    EXPECT_NEAR(last_x(load(file, {{"a", "3"}, {"a", "2"}})), std::exp(-2 * 0.999), 1e-12);
    EXPECT_NEAR(last_x(load(file, {{"slope.K", "-3"}, {"stop", "0.5"}})), std::exp(-3 * 0.499), 1e-12);
}

TEST_F(Load, ErrorsNameFilePlaceAndRemedy) {
    const fs::path file = write("m.yaml", "model: m\nstep: 1\nblocks: {c: {block: Constnt}}\n");
    EXPECT_NE(errors_of([&] {
                  load(file);
              }).find(file.string() + ":3:21: c: there is no block 'Constnt'; did you mean 'Constant'?"),
              std::string::npos)
        << errors_of([&] { load(file); });
    EXPECT_NE(errors_of([&] { load(folder_ / "none.yaml"); }).find("none.yaml"), std::string::npos);
    EXPECT_NE(errors_of([&] {
                  load(write("d.yaml", decay), {{"b", "1"}});
              }).find("nothing is called 'b'"),
              std::string::npos);
}

TEST_F(Load, AnEditedModelStandsForItsFileWhichIsLeftAlone) {
    write("part.yaml", "model: part\nvariables: {g: 1}\ninputs: [u]\noutputs: [y]\n"
                       "blocks: {k: {block: Gain, K: g}}\nconnections: {u: k, k: y}\n");
    const std::string text = "model: m\nstep: 1\nstop: 1\nvariables: {v: 2}\noutputs: [x]\nblocks:\n"
                             "  one: {block: Constant}\n  part: {file: part.yaml, with: {g: v}}\n"
                             "connections: {one: part.u, part: x}\n";
    const fs::path file = write("m.yaml", text);
    model::Model model = formats::read_yaml(file);
    model.root.variables.at(0).value.text = "5";
    EXPECT_EQ(last_x(load(model, file)), 5);
    EXPECT_EQ(last_x(load(model, file, {{"v", "7"}})), 7);
    EXPECT_EQ(text_of(file), text);
}

TEST_F(Load, AModelThatIsThereBringsTheModelsItRefersToWhereverTheyStand) {
    const std::string half = "inputs: [u]\noutputs: [y]\nblocks: {k: {block: Gain, K: 0.5}}\n"
                             "connections: {u: k, k: y}\n";
    write("part.yaml", "model: part\n" + half);
    const fs::path file =
        write("m.yaml", "model: m\nstep: 1\nstop: 1\noutputs: [x]\nblocks:\n  one: {block: Constant}\n"
                        "  first: {file: part.yaml}\n  inside: {inputs: [u], outputs: [y], blocks: {again: "
                        "{file: part.yaml}}, connections: {u: again.u, again: y}}\n"
                        "connections: {one: first.u, first: inside.u, inside: x}\n");
    const model::Model model = formats::read_yaml(file);
    fs::remove(folder_ / "part.yaml");
    EXPECT_EQ(last_x(load(model, file)), 0.25);
}

TEST_F(Load, WhatARecordingHoldsNeedsNoFiles) {
    const LoadedModel loaded = load(write("m.yaml", decay), {{"a", "2"}});
    fs::remove(folder_ / "m.yaml");
    EXPECT_EQ(last_x(load(loaded.source)), last_x(loaded));
}

TEST_F(Load, ChangesAreReadByTheirPaths) {
    const auto changes = read_overrides(write("p.yaml", "Gain: {Kp: 1, Kd: '[1, 2]'}\nstop: 2*pi\n"));
    ASSERT_EQ(changes.size(), 3u);
    EXPECT_EQ(changes[0].name, "Gain.Kp");
    EXPECT_EQ(changes[2].name, "stop");
    EXPECT_EQ(changes[2].text, "2*pi");
}

TEST(PointsOfSweeps, VaryTheFirstAxisSlowestAndSamplesFastest) {
    const Points points{.axes = {{"a", {"1", "2"}}, {"b", {"x", "y", "z"}}},
                        .randoms = {{"r", Random::Kind::normal, 0, 1}},
                        .samples = 4,
                        .seed = 9};
    ASSERT_EQ(points.size(), 24u);
    EXPECT_EQ(points[0][0].second, "1");
    EXPECT_EQ(points[11][0].second, "1");
    EXPECT_EQ(points[12][0].second, "2");
    EXPECT_EQ(points[4][1].second, "y");
    for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(points[i][2], points[i + 4][2]) << i;
    EXPECT_NE(points[0][2], points[1][2]);
}

TEST(PointsOfSweeps, SamplesFollowTheirDistribution) {
    constexpr int n = 20000;
    const auto moments = [](const Random& random) {
        double mean = 0, square = 0;
        for (int i = 0; i < n; ++i) {
            const double x = random.sample(3, static_cast<std::uint64_t>(i));
            mean += x / n;
            square += x * x / n;
        }
        return std::pair(mean, square - mean * mean);
    };
    // Within five standard errors: of a mean sigma/sqrt(n), of a normal variance sigma^2 sqrt(2/n).
    const auto [mean, variance] = moments({"a", Random::Kind::normal, 2, 3});
    EXPECT_NEAR(mean, 2, 5 * 3 / std::sqrt(n));
    EXPECT_NEAR(variance, 9, 5 * 9 * std::sqrt(2.0 / n));
    const auto [middle, width] = moments({"a", Random::Kind::uniform, -1, 3});
    EXPECT_NEAR(middle, 1, 5 * std::sqrt(16.0 / 12 / n));
    EXPECT_NEAR(width, 16.0 / 12, 0.05);
    const auto [faces, spread] = moments({"a", Random::Kind::integers, 1, 6}); // a die
    EXPECT_NEAR(faces, 3.5, 5 * std::sqrt(35.0 / 12 / n));
    EXPECT_NEAR(spread, 35.0 / 12, 0.15);
}

TEST(PointsOfSweeps, LieBetweenTheirBoundsHoweverFarApart) {
    const Random wide{"a", Random::Kind::uniform, -1e308, 1.5e308};
    bool is_below = false, is_above = false;
    for (std::uint64_t i = 0; i < 100; ++i) {
        const double x = wide.sample(1, i);
        EXPECT_TRUE(wide.a <= x && x <= wide.b) << x;
        (x < 0 ? is_below : is_above) = true;
    }
    EXPECT_TRUE(is_below && is_above);
}

using Sweeps = InAFolder;

TEST_F(Sweeps, GiveWhatSingleRunsGive) {
    const fs::path file = write("m.yaml", decay);
    Sweep all{.file = file, .points = {.axes = {{"a", {"0.5", "1", "2"}}}}, .finals = {"slope"}, .jobs = 2};
    const auto rows = sweep(all);
    ASSERT_EQ(rows.size(), 3u);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        ASSERT_TRUE(rows[i] && rows[i]->error.empty());
        ASSERT_EQ(rows[i]->results.size(), 2u);
        EXPECT_EQ(rows[i]->results[0].first, "x");
        EXPECT_EQ(rows[i]->results[0].second, last_x(load(file, {{"a", all.points.axes[0].values[i]}})));
    }
}

TEST_F(Sweeps, OfModelsThatFailHaveAnError) {
    const fs::path file =
        write("m.yaml", "model: m\nstep: 1\nstop: 3\nnon_finite: error\nvariables: {v: 1}\nblocks:\n"
                        "  t: {block: Clock, period: 1}\n  left: {block: Bias, bias: -v}\n"
                        "  inverse: {block: Reciprocal}\nconnections: {t: left, left: inverse}\n");
    const auto rows = sweep({.file = file, .points = {.axes = {{"v", {"9", "2", "nothing"}}}}});
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[0]->error, "");
    EXPECT_NE(rows[1]->error.find("inverse: its output y is not finite"), std::string::npos)
        << rows[1]->error;
    EXPECT_EQ(rows[1]->failed_at, 2);
    EXPECT_NE(rows[2]->error.find("unknown variable or function 'nothing'"), std::string::npos);
    EXPECT_LT(rows[2]->failed_at, 0);
}

/// Kills the processes that this one has started.
void kill_children() {
    const std::string own = std::to_string(::getpid());
    std::ifstream children("/proc/self/task/" + own + "/children");
    for (pid_t child; children >> child;) ::kill(child, SIGKILL);
}

TEST_F(Sweeps, OfRunsThatCrashHaveTheReasonAndGoOn) {
    bool has_killed = false;
    const auto rows =
        sweep({.file = write("m.yaml", decay), .points = {.axes = {{"stop", {"1e9", "1"}}}}, .jobs = 1},
              [&](std::size_t) {
                  if (!std::exchange(has_killed, true)) kill_children();
                  return true;
              });
    ASSERT_EQ(rows.size(), 2u);
    ASSERT_TRUE(rows[0] && rows[1]);
    EXPECT_EQ(rows[0]->error, "the run crashed: Killed");
    EXPECT_EQ(rows[1]->error, "");
}

TEST_F(Sweeps, EndWhereTheCallerSaysSo) {
    Sweep all{.file = write("m.yaml", decay), .points = {}, .overrides = {{"stop", "1e6"}}, .jobs = 1};
    const auto rows = sweep(all, [](std::size_t) { return false; });
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_FALSE(rows[0]);
}

} // namespace
} // namespace bf
