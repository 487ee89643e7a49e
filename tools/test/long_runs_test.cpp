// Snapshots, replays, events, profiles and sweeps of the command.
#include "command.hpp"

#include "bf/recording/export.hpp"
#include "bf/recording/writer.hpp"

namespace bf::tools {

namespace {

class LongRuns : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("sine.yaml", sine_model);
        write("part.yaml",
              "model: part\ninputs: [u]\noutputs: [y]\nvariables: {k: 1}\nblocks:\n  g: {block: Gain, "
              "K: k}\nconnections: {u: g, g: y}\n");
        write(
            "loop.yaml",
            "model: loop\nstep: 0.01\nstop: 2\nvariables: {Kp: 3}\nblocks:\n"
            "  error: {block: Sum, signs: +-}\n  reference: {block: Step, time: 0.1}\n"
            "  part: {file: part.yaml, with: {k: Kp}}\n  slow: {block: DiscreteIntegrator, period: "
            "0.05, offset: 0.02}\n  plant: {block: Integrator}\n"
            "  final: {block: Check, kind: final}\n"
            "connections: {reference: error.u1, plant: [error.u2, slow, final], error: part, part: plant}\n");
    }
    void expect_same(const std::string& a, const std::string& b) {
        const auto difference =
            recording::first_difference(recording::load(folder / a), recording::load(folder / b));
        EXPECT_FALSE(difference) << difference->text;
    }
    void expect_error(const std::string& command, const std::string& text, int code = 1) const {
        const auto result = bf(command);
        EXPECT_EQ(result.code, code) << command;
        EXPECT_CONTAINS(result.err, text);
    }
};

TEST_F(LongRuns, ARunFromASnapshotGoesOnBitForBit) {
    ASSERT_EQ(bf("run loop.yaml --record whole.mcap --snapshot-at 0.73 --snapshot s.bin").code, 0);
    const auto rest = bf("run loop.yaml --from-snapshot s.bin --record rest.mcap --json");
    ASSERT_EQ(rest.code, 0) << rest.err;
    EXPECT_EQ(nlohmann::json::parse(rest.out)["steps"], 200 - 73);
    const auto whole = recording::load(folder / "whole.mcap"), tail = recording::load(folder / "rest.mcap");
    for (const auto& channel : tail.channels) {
        const auto& all = whole.channel(channel.name);
        if (channel.info.period == 0) continue;
        const std::size_t skipped = all.samples() - channel.samples();
        EXPECT_GT(skipped, 0u) << channel.name;
        EXPECT_EQ(channel.time_ns.front(), all.time_ns[skipped]);
        EXPECT_TRUE(std::equal(channel.data.begin(), channel.data.end(),
                               all.data.begin() + static_cast<std::ptrdiff_t>(skipped * all.info.bytes())))
            << channel.name;
    }
    const auto replay = bf("replay rest.mcap");
    EXPECT_EQ(replay.code, 0) << replay.err;
    EXPECT_CONTAINS(replay.out, "from 0.73 s to 1.99 s");
}

TEST_F(LongRuns, ASnapshotAtTheEndExtendsARun) {
    ASSERT_EQ(bf("run loop.yaml --stop 1 --snapshot s.bin").code, 0);
    const auto both = nlohmann::json::parse(bf("run loop.yaml --from-snapshot s.bin --json").out);
    const auto whole = nlohmann::json::parse(bf("run loop.yaml --json").out);
    EXPECT_EQ(both["checks"], whole["checks"]);
    EXPECT_EQ(both["simulated_s"], 1.0);
}

TEST_F(LongRuns, SnapshotsThatDoNotFitAreRefusedBeforeARecordingIsMade) {
    ASSERT_EQ(bf("run loop.yaml --snapshot s.bin").code, 0);
    expect_error("run sine.yaml --from-snapshot s.bin --record r.mcap",
                 "belongs to the model 'loop', not to 'sine'");
    expect_error("run loop.yaml --from-snapshot s.bin --record r.mcap", "give a later --stop");
    shell("head -c 100 s.bin > cut.bin");
    expect_error("run loop.yaml --from-snapshot cut.bin --record r.mcap", "it was cut");
    expect_error("run loop.yaml --from-snapshot sine.yaml --record r.mcap", "is no snapshot");
    expect_error("run loop.yaml --from-snapshot none.bin --record r.mcap", "No such file");
    expect_error("run loop.yaml --snapshot t.bin --snapshot-at 3", "not within the run, from 0 s to 2 s");
    expect_error("run loop.yaml --snapshot t.bin --snapshot-at -1", "--snapshot-at: Value -1 not in range",
                 2);
    expect_error("run loop.yaml --snapshot-at 1", "--snapshot", 2);
    expect_error("run loop.yaml --checkpoint-every 1", "--record", 2);
    expect_error("run loop.yaml --checkpoint-every 0 --record r.mcap", "is shorter than the base period");
    EXPECT_EQ(files(), "cut.bin loop.yaml part.yaml s.bin sine.yaml");
}

TEST_F(LongRuns, UntilEndsWithTheStepOfTheEvent) {
    const auto run = bf("run sine.yaml --until 'gain.y > 5' --record r.mcap --summary s.json");
    EXPECT_EQ(run.code, 0) << run.err;
    // 6 sin(2 pi t) > 5 first at asin(5/6) / (2 pi) = 0.1568 s.
    EXPECT_CONTAINS(run.out, "gain.y > 5 at t = 0.16 s");
    EXPECT_EQ(json("s.json")["steps"], 17);
    EXPECT_EQ(recording::load(folder / "r.mcap").channel("gain.y").samples(), 17u);
    EXPECT_DOUBLE_EQ(json("s.json")["until"]["time_s"].get<double>(), 0.16);
}

TEST_F(LongRuns, RecordingEndsWithItsClock) {
    write("m.yaml", "model: m\nstep: 1e9\nblocks:\n  r: {block: Ramp}\n");
    expect_error("run m.yaml --stop 1e11 --record r.mcap",
                 "its clock holds 292 years of nanoseconds; it holds the samples until t = 9e+09 s");
    EXPECT_EQ(recording::load(folder / "r.mcap").channel("r.y").samples(), 10u);
}

TEST_F(LongRuns, RecordingLeavesOutSignalsWithoutElements) {
    write("box.urdf",
          "<robot name='box'><link name='box'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' "
          "iyy='1' iyz='0' izz='1'/></inertial></link></robot>");
    write("m.yaml", "model: m\nstep: 0.001\nstop: 0.5\nplugins: [WholeBodyToolbox]\nrecord: all\nblocks:\n"
                    "  robot: {block: WholeBodyToolbox/Configuration, robot: \"'box.urdf'\"}\n"
                    "  world: {block: WholeBodyToolbox/MujocoWorld, floor: false}\n");
    const auto run = bf("run m.yaml --record r.mcap");
    EXPECT_EQ(run.code, 0) << run.err;
    const auto recording = recording::load(folder / "r.mcap");
    EXPECT_EQ(recording.channel("world.v_b").samples(), 500u);
    for (const auto& channel : recording.channels) EXPECT_NE(channel.name, "world.s");
}

TEST_F(LongRuns, UntilTakesNamesThatHoldSignsOfComparison) {
    write("m.yaml", "model: m\nstep: 1\nstop: 9\nblocks:\n  a >= b: {block: Ramp}\n");
    for (const std::string event : {"> 2.5", ">= 3", "==3", "~= 0"})
        EXPECT_CONTAINS(bf("run m.yaml --until 'a >= b.y " + event + "'").out,
                        "a >= b.y " + event + " at t = " + (event == "~= 0" ? "1" : "3") + " s");
    expect_error("run m.yaml --until 'a >= b.y'", "is no event");
}

TEST_F(LongRuns, UntilFailsWhenTheEventDoesNotHappenOrIsNone) {
    expect_error("run sine.yaml --until 'gain > 7'", "sine stopped at t = 1 s: gain > 7 did not happen");
    expect_error("run sine.yaml --until 'gain.x > 7'",
                 "the run has no 'gain.x'; did you mean 'gain.y'?; bf check");
    expect_error("run sine.yaml --until 'gain'",
                 "'gain' is no event; write SIGNAL, one of > >= < <= == ~=, and a number");
    expect_error("run sine.yaml --until 'gain > five'", "is no event");
    expect_error("run sine.yaml --until 'gain[3] > 5'",
                 "'gain[3]' is no element: 'gain' has only one; call it gain");
    write("v.yaml", "model: v\nstep: 1\nstop: 9\nblocks:\n  r: {block: Ramp, slope: \"[1 2]\"}\n  m: {block: "
                    "Constant, value: eye(2)}\n");
    expect_error("run v.yaml --until 'r > 3'",
                 "'r' is no element: 'r' has 2, counted from 1; name one, e.g. r[1]");
    expect_error("run v.yaml --until 'r[0] > 3'", "'r[0]' is no element: 'r' has 2, counted from 1");
    expect_error("run v.yaml --until 'm[1] > 3'", "has 2 x 2, counted from 1; name one, e.g. m[1][1]");
    EXPECT_CONTAINS(bf("run v.yaml --until 'r[2] >= 6'").out, "r[2] >= 6 at t = 3 s");
}

TEST_F(LongRuns, ReplayIsIdenticalFromTheStartAndFromCheckpointsWithoutTheModelsFiles) {
    ASSERT_EQ(bf("run loop.yaml --record r.mcap --checkpoint-every 0.5 --set Kp=2.5").code, 0);
    shell("rm loop.yaml part.yaml");
    const auto all = bf("replay r.mcap -o again.mcap");
    EXPECT_EQ(all.code, 0) << all.err;
    EXPECT_CONTAINS(all.out, "identical: ");
    EXPECT_CONTAINS(all.out, "from 0 s to 1.99 s");
    expect_same("r.mcap", "again.mcap");
    EXPECT_CONTAINS(bf("replay r.mcap --from 1.2").out, "from 1 s to 1.99 s");
    EXPECT_CONTAINS(bf("replay r.mcap --from 0.6 --until 0.8").out, "from 0.5 s to 0.8 s");
    EXPECT_EQ(bf("replay again.mcap").code, 0);
}

TEST_F(LongRuns, TheBalancingICubGoesOnBitForBitFromSnapshotsAndCheckpoints) {
    const std::string model = "'" BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml' --quiet ";
    const auto run =
        bf("run " + model +
           "--stop 1.2 --record r.mcap --checkpoint-every 0.5 --snapshot s.bin --snapshot-at 0.75");
    ASSERT_EQ(run.code, 0) << run.err;
    for (const std::string from : {"0", "0.6", "0.8", "1.1"}) {
        const auto replay = bf("replay r.mcap --from " + from);
        EXPECT_EQ(replay.code, 0) << replay.err;
    }
    const auto whole = nlohmann::json::parse(bf("run " + model + "--stop 1.2 --json").out);
    const auto rest =
        nlohmann::json::parse(bf("run " + model + "--stop 1.2 --json --from-snapshot s.bin").out);
    EXPECT_EQ(rest["checks"], whole["checks"]);
    EXPECT_EQ(bf("run " + model + "--stop 0.9 --from-snapshot s.bin").code, 0)
        << "another stop is no other model";
}

TEST_F(LongRuns, ReplayRefusesADamagedModelAndReadsNoneFromTheDisk) {
    ASSERT_EQ(bf("run loop.yaml --record r.mcap").code, 0);
    std::string bytes = read("r.mcap");
    const std::string from = "K: k", to = "K: 2"; // in the text that the recording holds
    bytes.replace(bytes.find(from), from.size(), to);
    write("other.mcap", bytes);
    const auto replay = bf("replay other.mcap");
    EXPECT_EQ(replay.code, 1);
    EXPECT_CONTAINS(replay.err, "the checksum of the attachment 'model/part.yaml' is wrong");
    EXPECT_CONTAINS(replay.err, "part.yaml is not in the recording");
}

TEST_F(LongRuns, ReplayRefusesWhatItCannotReplay) {
    expect_error("replay none.mcap", "cannot open the recording 'none.mcap'");
    expect_error("replay loop.yaml", "is no recording");
    ASSERT_EQ(bf("run loop.yaml --record r.mcap").code, 0);
    expect_error("replay r.mcap --from 5", "the recording ends at 1.99 s, before 5 s");
    expect_error("replay r.mcap -o r.mcap", "is a file that is read");
    {
        recording::Writer writer(folder / "foreign.mcap");
        writer.close();
    }
    expect_error("replay foreign.mcap", "does not hold its model");
}

TEST_F(LongRuns, AFullDiskEndsTheRunAndWhatWasWrittenCanBeReplayed) {
    const auto run =
        shell("ulimit -f 20000; '" BF_PROGRAM "' run loop.yaml --stop Inf --record r.mcap --summary s.json");
    EXPECT_EQ(run.code, 1) << run.err;
    EXPECT_CONTAINS(run.err,
                    "cannot write the recording 'r.mcap': File too large; raise the limit on the size of "
                    "files, or write less; it holds the samples until t = ");
    EXPECT_EQ(run.err.find("stopped at"), std::string::npos) << "the run was ahead of the recording";
    const double until = std::stod(run.err.substr(run.err.rfind("t = ") + 4));
    double last = 0;
    for (const auto& channel : recording::load(folder / "r.mcap").channels)
        if (channel.samples() > 0) last = std::max(last, channel.time(channel.samples() - 1));
    EXPECT_DOUBLE_EQ(last, until);
    EXPECT_EQ(json("s.json")["outcome"], "failed");
    const auto replay = bf("replay r.mcap");
    EXPECT_EQ(replay.code, 0) << replay.err;
    EXPECT_CONTAINS(replay.err, "r.mcap': the file ends");
}

TEST_F(LongRuns, CtrlCAtAnyMomentLeavesAReadableRecording) {
    for (int milliseconds = 1; milliseconds <= 400; milliseconds *= 2) {
        const auto run =
            shell("timeout --foreground --preserve-status -s INT " + std::to_string(milliseconds * 1e-3) +
                  " '" BF_PROGRAM "' run loop.yaml --stop Inf --quiet --record r.mcap --checkpoint-every 10");
        EXPECT_EQ(run.code, 130) << run.err;
        if (!exists("r.mcap")) continue; // it was still reading the model
        const auto recording = recording::load(folder / "r.mcap");
        shell("rm r.mcap");
        if (run.err.find("interrupted") == std::string::npos) continue; // before the first step
        EXPECT_TRUE(recording.complete) << milliseconds << " ms: " << recording.defect;
    }
}

TEST_F(LongRuns, ProfileShowsEveryBlockAndWritesATrace) {
    const auto run = bf("run loop.yaml --profile trace.json --summary s.json");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_CONTAINS(run.out, "per call");
    EXPECT_CONTAINS(run.out, "(the profiler itself, ");
    EXPECT_CONTAINS(run.out, "(all blocks of this period)");
    const auto profile = json("s.json")["profile"];
    int calls = 0;
    for (const auto& row : profile["blocks"])
        if (row["name"] == "part.g") calls = row["calls"];
    EXPECT_GE(calls, 200);
    int slices = 0;
    const auto trace = json("trace.json");
    for (const auto& event : trace["traceEvents"]) slices += event["ph"] == "X";
    EXPECT_EQ(slices, profile["calls"].get<int>());
    EXPECT_EQ(bf("run loop.yaml --profile").code, 0);
}

TEST_F(LongRuns, SweepMakesOneTableOfAllCombinations) {
    const auto sweep =
        bf("sweep loop.yaml --set Kp=1:3 --set 'reference.after={2 [5]}' --final slow -o t.csv --jobs 2");
    EXPECT_EQ(sweep.code, 0) << sweep.err;
    std::istringstream table(read("t.csv"));
    std::string line;
    std::getline(table, line);
    EXPECT_EQ(line, "run,Kp,reference.after,final,final.passed,slow,error");
    for (int run = 0; std::getline(table, line); ++run) {
        const std::string Kp = std::to_string(1 + run / 2), after = run % 2 ? "5" : "2";
        EXPECT_TRUE(line.starts_with(std::to_string(run) + "," + Kp + "," + after + ",")) << line;
        const auto single = nlohmann::json::parse(
            bf("run loop.yaml --json --set Kp=" + Kp + " --set reference.after=" + after).out);
        EXPECT_CONTAINS(line, "," + single["checks"]["final"].dump() + ",1,");
    }
    EXPECT_EQ(lines("t.csv"), 7);
    EXPECT_CONTAINS(sweep.out, "table in t.csv");
}

TEST_F(LongRuns, SweepIsTheSameForEveryNumberOfJobsAndDependsOnTheSeed) {
    const std::string sweep =
        "sweep loop.yaml --set Kp=1:2 --random 'reference.after~normal(3,0.1)' --random "
        "'reference.time~uniform(0.1,0.2)' --samples 6 ";
    for (const auto& [options, file] :
         {std::pair{"--jobs 1", "a.csv"}, {"--jobs 3", "b.csv"}, {"--seed 2", "c.csv"}})
        ASSERT_EQ(bf(sweep + options + " -o " + file).code, 0);
    EXPECT_EQ(read("a.csv"), read("b.csv"));
    EXPECT_NE(read("a.csv"), read("c.csv"));
    EXPECT_EQ(lines("a.csv"), 13);
}

/// Its run fails when a ramp reaches the variable.
constexpr const char* fails_at_limit =
    "model: s\nstep: 0.1\nstop: 1\nvariables: {limit: 1}\nblocks:\n  x: {block: Ramp}\n  low: {block: "
    "CompareToConstant, operator: <, constant: limit}\n  stop: {block: Assertion}\nconnections: {x: "
    "low, low: stop}\n";

TEST_F(LongRuns, AFailedRunIsARowWithItsError) {
    write("stop.yaml", fails_at_limit);
    const auto sweep = bf("sweep stop.yaml --set 'limit={0.35 2}' -o t.csv");
    EXPECT_EQ(sweep.code, 0) << sweep.err;
    EXPECT_CONTAINS(read("t.csv"), "at t = 0.4 s: stop: ");
    EXPECT_CONTAINS(read("t.csv"), "\n1,2,\n");
    EXPECT_CONTAINS(
        sweep.out,
        "    0   0.35  failed\n    1      2\n  1 of 2 runs failed\n    run 0: at t = 0.4 s: stop: ");
}

TEST_F(LongRuns, SweepSaysEveryErrorOnceWithItsRuns) {
    write("stop.yaml", fails_at_limit);
    const auto sweep = bf("sweep stop.yaml --set 'limit={2 0.35 0.55}' --set 'step={0.1 0}'");
    EXPECT_EQ(sweep.code, 0) << sweep.err;
    EXPECT_CONTAINS(sweep.out,
                    "\n  5 of 6 runs failed\n"
                    "    run 1 and 2 more: 'step' is 0; give a positive number of seconds up to 1e9\n"
                    "    run 2 and 1 more: at t = 0.4 s: stop: the asserted condition does not hold\n");
    expect_error("sweep stop.yaml --set limit=0.1:0.1:0.3",
                 "3 of 3 runs failed\n    run 0 and 2 more: at t = 0.1 s: stop: ");
}

TEST_F(LongRuns, SweepRefusesWrongValues) {
    expect_error("sweep loop.yaml --set Kp", "is no NAME=VALUES");
    expect_error("sweep loop.yaml --set Kp=[]", "has no values");
    expect_error("sweep loop.yaml --set 'Kp=[1 2; 3 4]'", "matrices that are values stand in braces");
    expect_error("sweep loop.yaml --set Kp=1:2 --set Kp=3", "'Kp' is set twice");
    expect_error("sweep loop.yaml --set 'Kp=1:1e5' --set 'stop=1:20'", "at most 1000000");
    expect_error("sweep loop.yaml --random 'Kp=3'", "is no distribution");
    expect_error("sweep loop.yaml --random 'Kp~normel(1,2)'",
                 "there is no distribution 'normel'; did you mean 'normal'");
    expect_error("sweep loop.yaml --random 'Kp~normal(1,-2)'", "the deviation is negative");
    expect_error("sweep loop.yaml --random 'Kp~uniform(x,2)'",
                 "'x' in --random 'Kp~uniform(x,2)' is no number");
    expect_error("sweep loop.yaml --samples 3", "would repeat the same runs");
    expect_error("sweep none.yaml --set Kp=1", "there is no model file none.yaml");
    expect_error("sweep loop.yaml --set Kq=1:2", "2 of 2 runs failed\n    run 0 and 1 more: ");
    EXPECT_FALSE(exists("t.csv"));
}

TEST_F(LongRuns, CtrlCLeavesTheTableOfTheRunsThatAreDone) {
    const auto sweep = shell("timeout --foreground --preserve-status -s INT 2 '" BF_PROGRAM
                             "' sweep loop.yaml --set 'stop=1:5000' --jobs 2 --quiet -o t.csv");
    EXPECT_EQ(sweep.code, 130) << sweep.err;
    EXPECT_CONTAINS(sweep.err, "t.csv holds them");
    EXPECT_GT(lines("t.csv"), 1);
    EXPECT_EQ(read("t.csv").back(), '\n');
}

} // namespace
} // namespace bf::tools
