// What a recording holds, what happens when the disk is full, and that it comes again.
#include "bf/engine/play_back.hpp"
#include "bf/matlab/value.hpp"
#include "bf/recording/reader.hpp"
#include "bf/run/replay.hpp"
#include "support.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <random>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bf::test {
namespace {

class RecorderTest : public testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = testing::TempDir() + "bf_recorder_XXXXXX";
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        folder = pattern;
        file = folder / "run.mcap";
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    /// Runs `steps` steps into the file; `between` is called before each.
    void record(Session& run, int steps, const std::function<void(Recorder&, int)>& between = {}) {
        Recorder recorder(*run.simulation, run.simulation->signals(), file);
        run.simulation->add_observer(recorder);
        for (int k = 0; k < steps; ++k) {
            if (between) between(recorder, k);
            if (!run.simulation->step()) break;
        }
        recorder.close();
    }

    /// "identical", or the first difference.
    std::string replay(const std::string& model, const recording::Recording& recording, double from = 0,
                       const Library* library = nullptr) {
        Session run(formats::read_yaml_text(model, "m.yaml"), library);
        play_back_devices(run.diagram, recording);
        Simulation simulation(run.diagram);
        Replay replay(simulation, recording);
        replay.start(from);
        first_step = simulation.steps();
        while (replay.step()) {
        }
        samples = replay.samples();
        missing = replay.missing();
        return replay.difference().empty() ? "identical" : replay.difference();
    }

    std::filesystem::path folder, file;
    std::int64_t first_step = -1, samples = 0, missing = 0;
};

const std::string model_text = R"m(
model: m
step: 0.1
inputs: [u]
blocks:
  sine: {block: Sine, frequency: "[3 5]", bias: 0.25}
  gain: {block: Gain, K: 2}
  slow: {block: DiscreteIntegrator, period: 0.3, offset: 0.1}
  plant: {block: Integrator}
  sum: {block: Sum}
  constant: {block: Constant, value: "[1 2; 3 4]"}
connections: {sine: gain, gain: [slow, plant], u: sum.u1, slow: sum.u2}
)m";

void set_input(Session& run, double value) {
    const auto end = run.diagram.inputs.at(0).end;
    *static_cast<double*>(run.simulation->context().data(end.node, end.slot)) = value;
}

TEST_F(RecorderTest, WritesEverySignalAtItsOwnRateWithTheValuesOfTheStep) {
    Session run(model_text), twin(model_text);
    record(run, 10);
    const auto recording = recording::load(file);
    EXPECT_TRUE(recording.complete) << recording.defect;
    const auto& gain = recording.channel("gain.y");
    const auto& slow = recording.channel("slow.y");
    const auto& constant = recording.channel("constant.y");
    ASSERT_EQ(gain.samples(), 10u);
    ASSERT_EQ(slow.samples(), 3u);
    ASSERT_EQ(constant.samples(), 1u);
    EXPECT_TRUE(constant.info.is_matrix);
    EXPECT_EQ(constant.values(1), Values{3});
    EXPECT_DOUBLE_EQ(slow.info.period, 0.3);
    for (std::size_t k = 0; k < 10; ++k) {
        EXPECT_EQ(gain.time_ns[k], static_cast<std::int64_t>(k) * 100'000'000);
        EXPECT_NEAR(gain.value(k, 1), 2 * (0.25 + std::sin(5 * 0.1 * static_cast<double>(k))), 1e-14);
    }
    for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(slow.time_ns[k], static_cast<std::int64_t>(100 + 300 * k) * 1'000'000);
}

TEST_F(RecorderTest, HoldsSignalsOfDisabledSubsystemsAndConstantsOnce) {
    Session run(
        "model: m\nstep: 1\nblocks:\n  on: {block: Pulse, cycle: 4, width: 50}\n"
        "  c: {block: Constant, value: 3}\n  s:\n    execution: enabled\n    outputs: [y]\n    blocks:\n"
        "      t: {block: Clock}\n    connections: {t: y}\nconnections: {on: s.enable}\n");
    record(run, 8);
    const auto recording = recording::load(file);
    EXPECT_EQ(recording.channel("s.t.y").values(0), (Values{0, 1, 1, 1, 4, 5, 5, 5}));
    EXPECT_EQ(recording.channel("c.y").values(0), Values{3});
    EXPECT_TRUE(recording.channel("c.y").info.is_held);
}

TEST_F(RecorderTest, SeesWhatDisablingResetsBetweenTriggers) {
    Session run("model: m\nstep: 1\nblocks:\n  on: {block: Pulse, cycle: 8, width: 50}\n"
                "  fire: {block: Pulse, cycle: 2, width: 50, delay: 1}\n  t: {block: Clock}\n  s:\n"
                "    execution: enabled_and_triggered\n    inputs: [u]\n"
                "    outputs: {y: {when_disabled: reset, initial: 7}, held: {initial: 9}}\n"
                "    blocks: {g: {block: Gain}}\n    connections: {u: g, g: [y, held]}\n"
                "connections: {on: s.enable, fire: s.trigger, t: s.u}\n");
    record(run, 6);
    const auto recording = recording::load(file);
    EXPECT_EQ(recording.channel("s.y").values(0), (Values{7, 1, 1, 3, 7, 7}));
    EXPECT_EQ(recording.channel("s.held").values(0), (Values{1, 3}));
    EXPECT_TRUE(recording.channel("s.y").info.is_held);
}

TEST_F(RecorderTest, StoresTheOutputOfASubsystemWithTheSignalItIs) {
    Session run("model: m\nstep: 1\nblocks:\n  s:\n    outputs: [y]\n    blocks: {t: {block: Clock}}\n"
                "    connections: {t: y}\n");
    record(run, 3);
    const auto recording = recording::load(file);
    EXPECT_EQ(recording.channel("s.t.y").values(0), (Values{0, 1, 2}));
    EXPECT_EQ(recording.channel("s.y").values(0), (Values{0, 1, 2}));
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_TRUE((bytes.find("/s/t/y") == std::string::npos) != (bytes.find("/s/y") == std::string::npos));
}

TEST_F(RecorderTest, KeepsTheNamesOfAnEnumeration) {
    Session run(
        "model: m\nstep: 1\nenumerations: {Mode: [idle, walk], Far: {away: -7}}\nblocks:\n  s:\n"
        "    outputs: {mode: {type: Mode}}\n    blocks: {c: {block: Constant, value: Mode.walk}}\n"
        "    connections: {c: mode}\n  d: {block: UnitDelay, initial: Far.away}\nconnections: {s: d}\n");
    record(run, 2);
    const auto recording = recording::load(file);
    const std::vector<std::pair<double, std::string>> names{{0, "idle"}, {1, "walk"}};
    EXPECT_EQ(recording.channel("s.mode").info.names, names);
    EXPECT_EQ(recording.channel("s.mode").values(0), Values{1});
    EXPECT_TRUE(recording.channel("d.y").info.names.empty());
    EXPECT_EQ(recording.channel("d.y").values(0), (Values{-7, 1}));
}

TEST_F(RecorderTest, TellsHeldSignalsFromContinuousOnes) {
    Session run(model_text);
    record(run, 3);
    const auto recording = recording::load(file);
    EXPECT_FALSE(recording.channel("plant.y").info.is_held);
    EXPECT_FALSE(recording.channel("gain.y").info.is_held);
    EXPECT_TRUE(recording.channel("slow.y").info.is_held);
}

TEST_F(RecorderTest, AddsTheInputsOfTheRootAndChangedParameters) {
    Session run(model_text);
    Recorder recorder(*run.simulation, {}, file,
                      {"/models/m.yaml",
                       {{"/models/m.yaml", "text"}, {"/models/parts/p.yaml", "part"}},
                       {{"a", "1"}, {"b", "2*a"}}});
    run.simulation->add_observer(recorder);
    for (int k = 0; k < 4; ++k) {
        set_input(run, k * k);
        if (k == 2) {
            run.simulation->set_parameter("gain.K", {0.1});
            recorder.parameter_changed(k, "gain.K", {0.1});
        }
        ASSERT_TRUE(run.simulation->step());
    }
    recorder.close();
    const auto recording = recording::load(file);
    ASSERT_EQ(recording.channels.size(), 1u);
    EXPECT_EQ(recording.channel("u").values(), (Values{0, 1, 4, 9}));
    const auto& change = recording.metadata.at("parameter change 0");
    EXPECT_EQ(change.at("step"), "2");
    EXPECT_EQ(change.at("name"), "gain.K");
    EXPECT_EQ(change.at("values"), "0.1");
    const ModelSource source = recorded_source(recording);
    EXPECT_EQ(source.file, "/models/m.yaml");
    EXPECT_EQ(source.texts.at("/models/parts/p.yaml"), "part");
    EXPECT_EQ(source.texts.at("/models/m.yaml"), "text");
    EXPECT_EQ(source.overrides, (std::vector<std::pair<std::string, std::string>>{{"a", "1"}, {"b", "2*a"}}));
}

TEST_F(RecorderTest, AFullDiskIsReportedAndWhatWasWrittenIsReadable) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) { // a limit on the size of files stands for a small disk
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{3'000'000, 3'000'000};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        Session run(model_text);
        Recorder recorder(*run.simulation, run.simulation->signals(), file);
        run.simulation->add_observer(recorder);
        for (int k = 0; k < 2'000'000 && !recorder.failed(); ++k)
            if (!run.simulation->step()) ::_exit(2);
        const bool is_named = recorder.status().find("File too large") != std::string::npos;
        try {
            recorder.close();
        } catch (const std::exception&) {
            ::_exit(is_named ? 0 : 3);
        }
        ::_exit(4);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0);
    const auto recording = recording::load(file);
    EXPECT_FALSE(recording.complete);
    EXPECT_GT(recording.channel("gain.y").samples(), 1000u);
    EXPECT_EQ(replay(model_text, recording), "identical");
}

TEST_F(RecorderTest, AKilledRunIsReadableUpToItsLastChunk) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        Session run(model_text);
        Recorder recorder(*run.simulation, run.simulation->signals(), file);
        run.simulation->add_observer(recorder);
        for (int k = 0; k < 200'000; ++k) static_cast<void>(run.simulation->step());
        ::kill(::getpid(), SIGKILL);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status));
    const auto recording = recording::load(file);
    EXPECT_FALSE(recording.complete);
    EXPECT_GT(recording.channel("gain.y").samples(), 1000u);
    EXPECT_EQ(replay(model_text, recording), "identical");
}

std::size_t resident_bytes() {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages >> pages;
    return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

TEST_F(RecorderTest, AnHourDoesNotGrowMemory) {
    const std::string fast = "model: m\nstep: 0.01\nblocks:\n  sine: {block: Sine, frequency: \"1:8\"}\n  "
                             "gain: {block: Gain}\nconnections: {sine: gain}\n";
    Session run(fast);
    Recorder recorder(*run.simulation, run.simulation->signals(), file);
    run.simulation->add_observer(recorder);
    run.simulation->run_until(600);
    const std::size_t after_ten_minutes = resident_bytes();
    run.simulation->run_until(3600);
    const std::size_t after_an_hour = resident_bytes();
    recorder.close();
    EXPECT_GT(std::filesystem::file_size(file), 60'000'000u);
    EXPECT_LT(after_an_hour, after_ten_minutes + 2'000'000);
}

TEST_F(RecorderTest, ReplayIsIdenticalWithInputsAndChangedParameters) {
    Session run(model_text);
    record(run, 60, [&](Recorder& recorder, int k) {
        set_input(run, std::cos(k));
        if (k % 7 == 3) {
            run.simulation->set_parameter("gain.K", {0.1 * k});
            recorder.parameter_changed(k, "gain.K", {0.1 * k});
            run.simulation->set_parameter("constant.value", {1. * k, 2, 3, 4});
            recorder.parameter_changed(k, "constant.value", {1. * k, 2, 3, 4});
        }
    });
    const auto recording = recording::load(file);
    EXPECT_EQ(replay(model_text, recording), "identical");
    // Signals at 0.1 s: sine, gain, plant, sum; at 0.3 s: slow; a constant at the start and after 9 changes.
    EXPECT_EQ(samples, 4 * 60 + 20 + 1 + 9);
}

TEST_F(RecorderTest, ReplayStartsAtTheLastCheckpointBefore) {
    Session run(model_text);
    record(run, 60, [&](Recorder& recorder, int k) {
        set_input(run, std::cos(k));
        if (k > 0 && k % 20 == 0) recorder.checkpoint(*run.simulation);
    });
    const auto recording = recording::load(file);
    for (const auto& [from, step] : {std::pair{0.0, 0}, {1.9, 0}, {2.0, 20}, {3.0, 20}, {5.9, 40}}) {
        EXPECT_EQ(replay(model_text, recording, from), "identical") << from;
        EXPECT_EQ(first_step, step);
    }
    EXPECT_THROW(replay(model_text, recording, 7), RunError);
}

TEST_F(RecorderTest, ReplayIsIdenticalWhereSignalsOfOtherRatesHaveAnEvent) {
    // The relay answers at base steps, where `slow` has samples of its own, whichever of their rates is the
    // first.
    const std::string relay = "  relay: {block: Relay, on_value: -1, off_value: 1}\n",
                      slow = "  slow: {block: Sine, period: 0.1, frequency: 20, amplitude: 3}\n";
    for (const auto& blocks : {relay + slow, slow + relay})
        for (const auto* solver : {"rk4", "dormand_prince45", "cvode_bdf"}) {
            const std::string model = "model: m\nstep: 0.1\nsolver: " + std::string(solver) + "\nblocks:\n" +
                                      blocks +
                                      "  x: {block: Integrator}\n  sum: {block: Sum}\n"
                                      "connections: {x: sum.u1, slow: sum.u2, sum: relay, relay: x}\n";
            Session run(model);
            record(run, 60);
            const auto recording = recording::load(file);
            EXPECT_EQ(replay(model, recording), "identical") << solver;
            EXPECT_EQ(missing, 0) << "each step has its own sample";
            EXPECT_GT(recording.channel("relay.y").samples(), recording.channel("slow.y").samples())
                << solver;
        }
}

/// x leaves 0 at 0.2 s, so the trigger rises 2e-16 s after a base step: in the same nanosecond.
const std::string close_events = R"m(
model: m
step: 0.1
solver: dormand_prince45
blocks:
  x: {block: Integrator}
  s: {execution: triggered, trigger: rising, inputs: [u], outputs: [y], blocks: {h: {block: ZeroOrderHold}}, connections: {u: h, h: y}}
  jump: {block: Step, period: 0.1, time: 0.2}
connections: {jump: x, x: [s.u, s.trigger]}
)m";

TEST_F(RecorderTest, ReplayPairsSamplesOfOneNanosecondInTheirOrder) {
    Session run(close_events);
    record(run, 10, [&](Recorder& recorder, int k) {
        if (k == 2) recorder.checkpoint(*run.simulation);
    });
    auto recording = recording::load(file);
    const auto channel = [&](const std::string& name) -> recording::Channel& {
        return *std::find_if(recording.channels.begin(), recording.channels.end(),
                             [&](const auto& c) { return c.name == name; });
    };
    ASSERT_EQ(channel("s.h.y").time_ns, std::vector<std::int64_t>{200'000'000});
    EXPECT_EQ(channel("x.y").time_ns[2], channel("x.y").time_ns[3]);
    EXPECT_EQ(replay(close_events, recording), "identical");
    EXPECT_EQ(replay(close_events, recording, 0.2), "identical");
    EXPECT_EQ(first_step, 2);

    // An event just before a checkpoint has its nanosecond, too.
    auto& x = channel("x.y");
    const double before = -1e-17;
    x.time_ns.insert(x.time_ns.begin() + 2, x.time_ns[2]);
    const auto* bytes = reinterpret_cast<const std::byte*>(&before);
    x.data.insert(x.data.begin() + 2 * sizeof before, bytes, bytes + sizeof before);
    EXPECT_EQ(replay(close_events, recording, 0.2), "identical");
    EXPECT_EQ(replay(close_events, recording).substr(0, 8), "at 0.2 s");
}

TEST_F(RecorderTest, ReplayMissesASampleOfTheLastInstant) {
    Session run(model_text);
    record(run, 11);
    auto recording = recording::load(file);
    auto& slow = *std::find_if(recording.channels.begin(), recording.channels.end(),
                               [&](const auto& c) { return c.name == "slow.y"; });
    slow.time_ns.push_back(1'100'000'000);
    slow.data.insert(slow.data.end(), slow.data.end() - sizeof(double), slow.data.end());
    EXPECT_EQ(replay(model_text, recording),
              "at 1.1 s 'slow.y' has a sample in the recording, but none in the replay");
}

TEST_F(RecorderTest, ReplayNamesTheFirstSignalThatDiffers) {
    Session run(model_text);
    record(run, 20);
    auto recording = recording::load(file);
    const auto channel = [&](const std::string& name) -> recording::Channel& {
        return *std::find_if(recording.channels.begin(), recording.channels.end(),
                             [&](const auto& c) { return c.name == name; });
    };
    const auto change = [&](const std::string& name, std::size_t sample, std::size_t element, double value) {
        auto& c = channel(name);
        std::memcpy(&c.data[sample * c.info.bytes() + element * sizeof value], &value, sizeof value);
    };
    const double was = channel("gain.y").value(15, 1);
    change("gain.y", 17, 0, 7);
    EXPECT_EQ(replay(model_text, recording).substr(0, 23), "at 1.7 s 'gain.y[1]' is");
    change("gain.y", 15, 1, 8);
    EXPECT_EQ(replay(model_text, recording),
              "at 1.5 s 'gain.y[2]' is " + matlab::number_text(was) + ", in the recording 8");
    change("constant.y", 0, 2, -0.0);
    EXPECT_EQ(replay(model_text, recording), "at 0 s 'constant.y[1][2]' is 2, in the recording -0");
}

TEST_F(RecorderTest, ReplayRefusesSignalsOfAnotherSizeOrName) {
    Session run(model_text);
    record(run, 5);
    const auto refused = [&](const std::string& from, const std::string& to) -> std::string {
        std::string other = model_text;
        other.replace(other.find(from), from.size(), to);
        try {
            replay(other, recording::load(file));
        } catch (const RunError& error) {
            return error.what();
        }
        return "";
    };
    const std::string another = "' of the recording has another type or size";
    for (const auto* frequency : {"3", "[3 5 7]"})
        EXPECT_EQ(refused("\"[3 5]\"", "\"" + std::string(frequency) + "\""), "the signal 'sine.y" + another)
            << "fewer or more elements";
    EXPECT_EQ(refused("[1 2; 3 4]", "int8([1 2; 3 4])"), "the signal 'constant.y" + another);
    EXPECT_EQ(refused("  constant:", "  renamed:"),
              "the model has no signal 'constant.y', but the recording has");
}

TEST_F(RecorderTest, KeepsWhatWasSetInItsOrder) {
    Session run(model_text);
    std::vector<std::pair<std::string, std::string>> given;
    for (int i = 0; i < 120; ++i) given.emplace_back("v" + std::to_string(120 - i), std::to_string(i));
    { const Recorder recorder(*run.simulation, {}, file, {"/m.yaml", {{"/m.yaml", "text"}}, given}); }
    std::vector<std::pair<std::string, std::string>> kept;
    for (const auto& [name, metadata] : recording::load(file).metadata)
        if (name == "overrides")
            for (const auto& [numbered, value] : metadata) kept.emplace_back(numbered.substr(4), value);
    EXPECT_EQ(kept, given);
}

TEST_F(RecorderTest, KeepsThePlotsOfTheModelInTheirOrder) {
    std::string plots = model_text + "plots:\n";
    for (int i = 9; i > 0; --i) plots += "  panel" + std::to_string(i) + ": [gain.y, slow]\n";
    Session run(plots);
    record(run, 1);
    std::string titles;
    for (const auto& [name, metadata] : recording::load(file).metadata)
        if (name == "plots")
            for (const auto& [title, signals] : metadata) {
                titles += title.substr(title.find(' ') + 1) + " ";
                EXPECT_EQ(signals, "gain.y\nslow");
            }
    EXPECT_EQ(titles, "panel9 panel8 panel7 panel6 panel5 panel4 panel3 panel2 panel1 ");
}

TEST_F(RecorderTest, ReplayFindsAnotherModelInTheFirstSampleItChanges) {
    Session run(model_text);
    record(run, 20);
    std::string other = model_text;
    other.replace(other.find("K: 2"), 4, "K: 3");
    const auto recording = recording::load(file);
    EXPECT_EQ(replay(other, recording).substr(0, 21), "at 0 s 'gain.y[1]' is");
    other = model_text;
    other.replace(other.find("period: 0.3"), 11, "period: 0.4");
    EXPECT_EQ(replay(other, recording),
              "at 0.4 s 'slow.y' has a sample in the recording, but none in the replay");
}

/// A device: what it measures does not come again.
class Sensor final : public Block {
  public:
    struct Wire {
        std::mt19937 noise{std::random_device()()};
    };
    using Block::Block;
    OutsideState<Wire> wire{this, [] { return std::make_shared<Wire>(); }};
    Output<double> y{this, "y", {}};
    static inline int opened = 0;
    void start(Now) const override { ++opened; }
    Status output(Now at, Out out) const noexcept override {
        out[y] = static_cast<double>(at[wire].noise());
        return ok;
    }
};

const std::string with_device =
    "model: m\nstep: 0.1\nblocks:\n  sensor: {block: Sensor, period: 0.2}\n  sum: "
    "{block: DiscreteIntegrator}\nconnections: {sensor: sum}\n";

TEST_F(RecorderTest, ReplayTakesOutputsOfDevicesFromTheRecordingAndOpensNone) {
    Library library("");
    library.group("test").add<Sensor>("Sensor", "");
    {
        Session run(with_device, &library);
        Recorder recorder(*run.simulation,
                          run.simulation->quantities({{"sum", run.diagram.find_signal("sum")}}), file);
        run.simulation->add_observer(recorder);
        run.trace("sum", 30);
        recorder.close();
    }
    const auto recording = recording::load(file);
    EXPECT_EQ(recording.channel("sensor.y").samples(), 15u) << "recorded although nobody asked";
    Sensor::opened = 0;
    EXPECT_EQ(replay(with_device, recording, 0, &library), "identical");
    EXPECT_EQ(Sensor::opened, 0);
    EXPECT_EQ(samples, 15);
}

TEST_F(RecorderTest, ReplayRefusesADeviceThatWasNotRecorded) {
    Library library("");
    library.group("test").add<Sensor>("Sensor", "");
    Session run(with_device, &library);
    {
        recording::Writer writer(file);
        const auto id = writer.add_channel("sum.y", {});
        writer.begin();
        const double x = 0;
        writer.append(id, 0, &x);
        writer.close();
    }
    try {
        replay(with_device, recording::load(file), 0, &library);
        FAIL();
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(),
                     "sensor.y: comes from a device, which a replay does not open, and is not in "
                     "the recording");
    }
}

} // namespace
} // namespace bf::test
