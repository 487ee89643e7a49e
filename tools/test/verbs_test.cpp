// What every verb does with right input.
#include "bf/base/files.hpp"
#include "command.hpp"

#include <set>
#include <string>

namespace bf::tools {

namespace {

class Verbs : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("sine.yaml", sine_model);
    }
};

TEST_F(Verbs, PrintVersionAndHelp) {
    EXPECT_EQ(bf("--version").out, "bf " BF_VERSION "\n");
    const auto help = bf("--help");
    EXPECT_EQ(help.code, 0);
    for (const std::string verb :
         {"run", "check", "describe", "plot", "film", "export", "deploy", "doctor"}) {
        EXPECT_CONTAINS(help.out, "\n  " + verb);
        const auto own = bf(verb + " --help");
        EXPECT_EQ(own.code, 0);
        EXPECT_CONTAINS(own.out, "Example");
        EXPECT_EQ(own.err, "");
    }
}

TEST_F(Verbs, RunWritesRecordingAndSummary) {
    const auto run = bf("run sine.yaml --record run.mcap --summary run.json");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_CONTAINS(run.out, "largest         6\n");
    EXPECT_CONTAINS(run.out, "largest.passed  yes\n");
    EXPECT_CONTAINS(run.out, "bf plot run.mcap");
    EXPECT_CONTAINS(run.err, "t = 1.00 / 1 s");
    const auto summary = json("run.json");
    EXPECT_EQ(summary["model"], "sine");
    EXPECT_EQ(summary["outcome"], "finished");
    EXPECT_EQ(summary["steps"], 100);
    EXPECT_DOUBLE_EQ(summary["simulated_s"], 1.0);
    EXPECT_DOUBLE_EQ(summary["checks"]["largest"], 6.0); // 3 * 2 sin(2 pi 0.25)
    EXPECT_EQ(summary["checks"]["largest.passed"], true);
    EXPECT_EQ(files(), "run.json run.mcap sine.yaml");
}

TEST_F(Verbs, RunPrintsTheSummaryAsJsonAlone) {
    const auto run = bf("run sine.yaml --json --record run.mcap");
    EXPECT_EQ(nlohmann::json::parse(run.out)["steps"], 100);
}

TEST_F(Verbs, RunShowsNothingWhenQuietOrHeadless) {
    EXPECT_EQ(bf("run sine.yaml --quiet").err, "");
    EXPECT_EQ(bf("run sine.yaml --headless").err, "");
    // A second is over before so many blocks are read.
    std::string large = "model: large\nstep: 1\nstop: 1\nblocks:\n";
    for (int i = 0; i < 100'000; ++i)
        large += "  c" + std::to_string(i) + ": {block: Constant, value: \"sum(ones(1,50))\"}\n";
    write("large.yaml", large);
    EXPECT_CONTAINS(bf("check large.yaml").err, "elaborating large.yaml ... 1 s");
    EXPECT_EQ(bf("run large.yaml --quiet").err, "");
}

TEST_F(Verbs, RunShowsDisplayBlocksInTheProgressLine) {
    write("display.yaml",
          "model: display\nstep: 0.1\nstop: 1\nblocks:\n  one: {block: Constant, value: \"[1 2.5]\"}\n"
          "  speed: {block: Display}\nconnections:\n  one: speed\n");
    EXPECT_CONTAINS(bf("run display.yaml").err, "speed 1 2.5\n");
}

TEST_F(Verbs, StopIsAnExpressionAndWinsOverTheModel) {
    EXPECT_EQ(nlohmann::json::parse(bf("run sine.yaml --json --stop 2*Gain.Kp").out)["steps"], 400);
    EXPECT_EQ(nlohmann::json::parse(bf("run sine.yaml --json --set stop=3").out)["steps"], 300);
}

/// Sums its inputs: a scalar, a vector, a matrix and a whole number.
const std::string inputs_model = R"(model: sums
step: 0.1
stop: 0.6
inputs: {u: {shape: 1}, x: {shape: 2}, M: {shape: "[2 2]"}, n: {shape: 1, type: int8}}
blocks:
  gu: {block: Gain}
  gx: {block: Gain}
  gM: {block: Gain}
  gn: {block: Gain}
connections: {u: gu, x: gx, M: gM, n: gn}
record: [gu.y, gx.y, gM.y, gn.y]
)";

TEST_F(Verbs, InputsComeFromAFileAndAreReplayed) {
    write("sums.yaml", inputs_model);
    // 0.30000000000000004 is 3 * 0.1; of the two rows at 0.4 the second counts; nothing is read after the
    // end. The file begins with the mark of UTF-8, as spreadsheets write it.
    write("in.csv", "\xEF\xBB\xBFtime,\"u "
                    "(V)\",x[2],\"M[1][2]\",n\r\n0.1,1,2,3,4\r\n0.30000000000000004,-1.5,0,0,-128\r\n"
                    "0.4,7,7,7,7\r\n0.4,inf,1e-3,+2,0\r\n9,1,1,1,1\r\n");
    const auto run = bf("run sums.yaml --inputs in.csv --quiet --record r.mcap");
    ASSERT_EQ(run.code, 0) << run.err;
    bf("export r.mcap -o r.csv");
    EXPECT_EQ(read("r.csv").substr(read("r.csv").find('\n') + 1),
              "0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n"
              "0.1,1,0,2,0,0,3,0,4,1,0,2,0,0,3,0,4\n"
              "0.2,1,0,2,0,0,3,0,4,1,0,2,0,0,3,0,4\n"
              "0.3,-1.5,0,0,0,0,0,0,-128,-1.5,0,0,0,0,0,0,-128\n"
              "0.4,inf,0,0.001,0,0,2,0,0,inf,0,0.001,0,0,2,0,0\n"
              "0.5,inf,0,0.001,0,0,2,0,0,inf,0,0.001,0,0,2,0,0\n");
    EXPECT_EQ(bf("replay r.mcap").code, 0);
    const auto paced = bf("run sums.yaml --inputs in.csv --quiet --realtime --priority 0 --realtime-factor 5 "
                          "--record p.mcap");
    ASSERT_EQ(paced.code, 0) << paced.err;
    bf("export p.mcap -o p.csv");
    EXPECT_EQ(read("p.csv"), read("r.csv"));

    const auto refused = [&](const std::string& text, const std::string& reason) {
        write("in.csv", text);
        const auto wrong = bf("run sums.yaml --inputs in.csv --quiet");
        EXPECT_EQ(wrong.code, 1) << text;
        EXPECT_CONTAINS(wrong.err, "bf: in.csv:" + reason);
    };
    refused("t,u\n0,1\n", "1: the first column is the time and is called 'time', not 't'");
    refused(
        "time,v\n0,1\n",
        "1: the model has no input 'v'; it has u, x, M, n, with elements as x[1], M[1][2], counted from 1");
    refused("time,x[0],x[1]\n0,1,2\n", "1: the model has no input 'x[0]'");
    refused("time,x\n0,1\n", "1: the model has no input 'x'");
    refused("time,u,u (V)\n0,1,1\n", "1: a second column 'u (V)'");
    refused("time\n0\n", "1: there is no column besides the time");
    refused("time,u\n", "1: there is no row of values");
    refused("time,u\n0,1\n1\n", "3: 1 values, but there are 2 headings");
    refused("time,u\n0,one\n", "2: 'one' is no number");
    refused("time,u\n0,\n", "2: '' is no number");
    refused("time,u\n0,1\n-1,1\n", "3: the time -1 does not follow the one before");
    refused("time,u\nnan,1\n", "2: the time nan does not follow the one before");
    refused("time,u\n0,nan\n", "2: input 'u' must be a number, but is NaN");
    refused("time,n\n0,128\n", "2: input 'n' must be a whole number from -128 to 127, but is 128");
    EXPECT_CONTAINS(bf("run sums.yaml --inputs nowhere.csv").err,
                    "bf: cannot read the inputs in nowhere.csv");
    EXPECT_CONTAINS(bf("run sine.yaml --inputs in.csv").err, "the model has no input 'n'; it has none");
}

TEST_F(Verbs, SetChangesVariablesAndSettingsOfBlocks) {
    const auto largest = [&](const std::string& sets) {
        return nlohmann::json::parse(bf("run sine.yaml --json " + sets).out)["checks"]["largest"]
            .get<double>();
    };
    EXPECT_DOUBLE_EQ(largest("--set Gain.Kp=5"), 15.0);
    EXPECT_DOUBLE_EQ(largest("--set gain.K=7"), 14.0);
    EXPECT_DOUBLE_EQ(largest("--set Gain.Kp=5 --set gain.K=Gain.Kp"), 25.0);
    EXPECT_DOUBLE_EQ(largest("--set 'gain.K=max([1 2; 3 4](:))'"), largest("--set gain.K=4"));
}

TEST_F(Verbs, SetStandsBeforeTheModelToo) { EXPECT_EQ(bf("run --set Gain.Kp=1 sine.yaml").code, 0); }

TEST_F(Verbs, ParameterFilesHoldNestedNamesSequencesAndQuotedExpressions) {
    write(
        "p.yaml",
        "# tuned\nGain:\n  Kp: 2*sqrt(4)   # 4\n  Kd: 0\ngain: {K: \"max([1, 2; 3, 5])*[0; 1]\"}\nstop: 2\n");
    const auto run = nlohmann::json::parse(bf("run sine.yaml --json --params p.yaml").out);
    EXPECT_EQ(run["steps"], 200);
    EXPECT_DOUBLE_EQ(run["checks"]["largest"], 20.0);
    write("q.yaml", "gain.K: 1\n");
    const auto both =
        nlohmann::json::parse(bf("run sine.yaml --json --params p.yaml --params q.yaml --set stop=1").out);
    EXPECT_EQ(both["steps"], 100);
    EXPECT_DOUBLE_EQ(both["checks"]["largest"], 4.0);
}

TEST_F(Verbs, SequencesInParameterFilesAreRowsAndMatrices) {
    write("m.yaml",
          "model: m\nstep: 1\nvariables:\n  A: 0\n  b: 0\nblocks:\n  a: {block: Constant, value: A}\n"
          "  b: {block: Constant, value: b}\n");
    write("p.yaml", "A:\n  - [1, 2]\n  - [3, 4]\n  - [5, 6]\nb: [1, 2, 3]\n");
    const auto check = bf("check m.yaml --params p.yaml");
    EXPECT_EQ(check.code, 0) << check.err;
    EXPECT_CONTAINS(check.out, "y:3x2");
    EXPECT_CONTAINS(check.out, "y:[3]\n");
}

TEST_F(Verbs, CtrlCEndsARunWithARecordingAndASummary) {
    const auto run = shell("timeout --foreground --preserve-status -s INT 2 '" BF_PROGRAM
                           "' run sine.yaml --stop Inf --record run.mcap --summary run.json");
    EXPECT_EQ(run.code, 130) << run.err;
    EXPECT_CONTAINS(run.err, "interrupted");
    const auto summary = json("run.json");
    EXPECT_EQ(summary["outcome"], "interrupted");
    const auto exported = bf("export run.mcap -o run.csv");
    EXPECT_EQ(exported.code, 0);
    EXPECT_EQ(exported.err.find("not complete"), std::string::npos) << exported.err;
    EXPECT_EQ(lines("run.csv"), summary["steps"].get<int>() + 1); // a line of names
}

TEST_F(Verbs, CheckPrintsVariablesSizesRatesAndOrder) {
    const auto check = bf("check sine.yaml");
    EXPECT_EQ(check.code, 0);
    EXPECT_EQ(check.out, "sine: 3 blocks, base period 0.01 s, runs for 1 s\n\nrates\n  0.01 s\n\nvariables\n"
                         "  Gain.Kp  2\n  Gain.Kd  1\n\norder of outputs\n"
                         "    1  0.01 s  source  Sine  y:scalar\n"
                         "    2  0.01 s  gain    Gain  y:scalar\n");
    const auto json = nlohmann::json::parse(bf("check sine.yaml --json").out);
    EXPECT_EQ(json["blocks"].size(), 3u);
    EXPECT_EQ(json["order"], nlohmann::json({"source", "gain"}));
}

TEST_F(Verbs, CheckPrintsWhatAStepDoes) {
    const auto check = bf("check sine.yaml --program");
    EXPECT_EQ(check.code, 0) << check.err;
    EXPECT_CONTAINS(check.out, "outputs:\n    output source\n    output gain\n");
}

TEST_F(Verbs, CheckPrintsVariablesWithUnitsLimitsAndWhatTheyFollowFrom) {
    write("m.yaml", "model: m\nstep: 1\nvariables:\n"
                    "  K: {value: 3, minimum: 0, maximum: 5, unit: V s/rad, doc: of the speed}\n"
                    "  twice: 2*K\n  long: zeros(30, 30)\n  name: \"'icub'\"\nblocks: {}\n");
    EXPECT_CONTAINS(bf("check m.yaml --set K=4").out, "\nvariables\n"
                                                      "  K      4       V s/rad  of the speed; from 0 to 5\n"
                                                      "  twice  8                = 2*K\n"
                                                      "  long   30x30\n"
                                                      "  name   'icub'\n");
    const auto json = nlohmann::json::parse(bf("check m.yaml --json").out)["variables"];
    EXPECT_EQ(json[0], nlohmann::json({{"name", "K"},
                                       {"value", "3"},
                                       {"unit", "V s/rad"},
                                       {"doc", "of the speed"},
                                       {"limits", "from 0 to 5"}}));
    EXPECT_EQ(json.size(), 4u);
}

TEST_F(Verbs, DescribeListsLibrariesAndBlocks) {
    const auto all = bf("describe");
    EXPECT_EQ(all.code, 0);
    EXPECT_CONTAINS(all.out, "standard / math\n");
    EXPECT_CONTAINS(all.out, "WholeBodyToolbox / rigid body\n");
    EXPECT_EQ(bf("describe standard").out.find("WholeBodyToolbox"), std::string::npos);
    const auto qp = bf("describe WholeBodyToolbox/QP");
    EXPECT_CONTAINS(qp.out, "(only with use_lb: true)");
    for (const std::string what : {"", "Gain", "standard", "WholeBodyToolbox"})
        EXPECT_FALSE(nlohmann::json::parse(bf("describe --json " + what).out).empty());
    EXPECT_EQ(nlohmann::json::parse(bf("describe --json Gain").out)["name"], "Gain");
    EXPECT_CONTAINS(bf("describe Pulse").out, "part of the cycle that is high, in percent; from 0 to 100\n");
    EXPECT_CONTAINS(bf("describe CounterFree").out, "length of the counter; from 1 to 32\n");
    const auto pulse = nlohmann::json::parse(bf("describe --json Pulse").out);
    for (const auto& quantity : pulse["quantities"]) {
        if (quantity["name"] == "width") {
            EXPECT_EQ(quantity["minimum"], 0);
            EXPECT_EQ(quantity["maximum"], 100);
        }
        EXPECT_EQ(quantity.contains("minimum"), quantity["name"] == "width");
        EXPECT_EQ(quantity.contains("above"), quantity["name"] == "cycle");
    }
    EXPECT_EQ(nlohmann::json::parse(bf("describe --json CounterFree").out)["arguments"][0]["maximum"], 32);
}

TEST_F(Verbs, DoctorSaysWhatThereIs) {
    EXPECT_CONTAINS(bf("doctor").out, "plugin       yes  WholeBodyToolbox");
    EXPECT_CONTAINS(bf("doctor").out, "plugin       yes  WholeBodyCameras");
    const auto json = nlohmann::json::parse(bf("doctor --json").out);
    EXPECT_EQ(json["version"], BF_VERSION);
    std::set<std::string> plugins; // there may be those of middlewares, too
    for (const auto& plugin : json["plugins"]) plugins.insert(plugin["name"]);
    for (const std::string plugin : {"FMI", "SharedMemory", "Udp", "WholeBodyCameras", "WholeBodyToolbox"})
        EXPECT_TRUE(plugins.contains(plugin)) << plugin;
    EXPECT_EQ(json["middlewares"][0]["name"], "shared memory");
    EXPECT_EQ(json["middlewares"][0]["good"], true);
}

TEST_F(Verbs, PlotDrawsThePanelsOfTheModelOrTheSignalsNamed) {
    bf("run sine.yaml --record run.mcap");
    EXPECT_EQ(bf("plot run.mcap").out, "run.png\n");
    EXPECT_EQ(read("run.png").substr(1, 3), "PNG");
    EXPECT_EQ(bf("plot run.mcap 'source.*' source,gain.y -o two.svg").out, "two.svg\n");
    EXPECT_CONTAINS(read("two.svg"), "source,gain.y"); // the panel's title
    EXPECT_EQ(files(), "run.mcap run.png sine.yaml two.svg");
}

TEST_F(Verbs, PlotTellsWhichPanelsStayEmpty) {
    write("empty.yaml", "model: m\nstep: 0.1\nstop: 1\nblocks:\n  zero: {block: Constant, value: 0}\n"
                        "  none: {block: Gain, K: Inf}\nconnections: {zero: none}\n");
    ASSERT_EQ(bf("run empty.yaml --record run.mcap").code, 0);
    const auto drawn = bf("plot run.mcap zero none");
    EXPECT_EQ(drawn.code, 0);
    EXPECT_EQ(drawn.err, "none has no finite value: its panel is empty\n");
}

TEST_F(Verbs, PlotDashesOnlyWhatIsNamedAReference) {
    write("follow.yaml", R"m(model: m
step: 0.1
stop: 1
blocks:
  q_desired: {block: Sine}
  q: {block: Gain, K: 0.9}
  other: {block: Gain, K: 0.5}
connections: {q_desired: [q, other]}
)m");
    ASSERT_EQ(bf("run follow.yaml --record run.mcap").code, 0);
    const auto dashes = [&](const std::string& options) {
        EXPECT_EQ(bf("plot run.mcap -o plot.svg " + options).code, 0) << options;
        const std::string svg = read("plot.svg");
        int count = 0;
        for (auto at = svg.find("stroke-dasharray='"); at != std::string::npos;
             at = svg.find("stroke-dasharray='", at + 1))
            count += svg.substr(at + 18, 1) != "2"; // the grid is dotted
        return count;
    };
    const int none = dashes("q,other");
    EXPECT_EQ(dashes("other,q"), none);
    EXPECT_EQ(dashes("q_desired"), none) << "nothing follows it";
    const int one = dashes("q_desired,q");
    EXPECT_GT(one, none);
    EXPECT_EQ(dashes("q,q_desired,other"), one);
    EXPECT_EQ(dashes("q,other --reference other"), one);
    EXPECT_EQ(dashes("q,q_desired --reference other.y"), none);
    EXPECT_CONTAINS(bf("plot run.mcap --reference nope q").err, "the recording has no signal 'nope'");
}

TEST_F(Verbs, ExportWritesExactValues) {
    bf("run sine.yaml --record run.mcap");
    EXPECT_EQ(bf("export run.mcap -o run.csv").out, "run.csv\n");
    EXPECT_EQ(lines("run.csv"), 101);
    EXPECT_CONTAINS(read("run.csv"), "time (s),source.y,gain.y\n0,0,0\n");
    EXPECT_EQ(bf("export run.mcap -o run.mat").out, "run.mat\n");
    EXPECT_EQ(read("run.mat").substr(0, 10), "MATLAB 5.0");
    EXPECT_EQ(bf("export run.mcap -o /dev/stdout").out, read("run.csv"));
    EXPECT_EQ(shell("'" BF_PROGRAM "' export run.mcap -o /dev/stdout | cat").out, read("run.csv"));
    EXPECT_EQ(files(), "run.csv run.mat run.mcap sine.yaml");
}

TEST_F(Verbs, ExportPutsRatesInFilesOfTheirOwn) {
    write("rates.yaml",
          "model: rates\nstep: 0.1\nstop: 1\nblocks:\n  fast: {block: Clock}\n  slow: {block: Clock, period: "
          "0.5}\n");
    bf("run rates.yaml --record run.mcap");
    EXPECT_EQ(bf("export run.mcap -o run.csv").out, "run_fast.y.csv\nrun_slow.y.csv\n");
    EXPECT_EQ(lines("run_fast.y.csv"), 11);
    EXPECT_EQ(lines("run_slow.y.csv"), 3);
    EXPECT_EQ(files(), "rates.yaml run.mcap run_fast.y.csv run_slow.y.csv sine.yaml");
}

TEST_F(Verbs, FilmMakesPicturesAndFilms) {
    write("robot.yaml", R"(model: robot
plugins: [WholeBodyToolbox]
step: 0.001
stop: 0.2
blocks:
  robot: {block: WholeBodyToolbox/Configuration, robot: iCubGazeboV2_5, joints: [torso_pitch, l_elbow]}
  world: {block: WholeBodyToolbox/MujocoWorld, feet: [l_sole, r_sole]}
record: [world.*]
)");
    const auto run = bf("run robot.yaml --record run.mcap");
    ASSERT_EQ(run.code, 0) << run.err;
    const auto film = bf("film run.mcap --picture end.png -o film.mp4 --width 64 --height 48 --fps 10");
    EXPECT_EQ(film.code, 0) << film.err;
    EXPECT_EQ(film.out, "end.png\nfilm.mp4\n");
    EXPECT_CONTAINS(film.err, "frame 2 of 2");
    EXPECT_EQ(read("end.png").substr(1, 3), "PNG");
    EXPECT_EQ(read("film.mp4").substr(4, 4), "ftyp");
    EXPECT_EQ(files(), "end.png film.mp4 robot.yaml run.mcap sine.yaml");

    const auto nothing = bf("film run.mcap");
    EXPECT_EQ(nothing.code, 1);
    EXPECT_CONTAINS(nothing.err, "say what to make: -o FILE.mp4");
    const auto late = bf("film run.mcap -o late.mp4 --from 7");
    EXPECT_EQ(late.code, 1);
    EXPECT_CONTAINS(late.err, "--from 7 is after the end");
    EXPECT_CONTAINS(bf("film run.mcap --picture no.png --from 7").err, "--from 7 is after the end");
    EXPECT_CONTAINS(bf("film run.mcap -o no.mp4 --at 0.1").err, "--at is the instant of a picture");
    for (const std::string option : {"--azimuth NaN", "--look-at NaN", "--look-at Inf", "--azimuth -Inf"}) {
        const auto outside = bf("film run.mcap --picture no.png " + option);
        EXPECT_EQ(outside.code, 2) << option;
        EXPECT_CONTAINS(outside.err, option.substr(0, option.find(' ')));
    }
    EXPECT_FALSE(exists("no.png"));
    bf("run sine.yaml --record sine.mcap");
    EXPECT_CONTAINS(bf("film sine.mcap -o other.mp4").err, "sine has no MujocoWorld or World block");
    for (const std::string file : {"sine.mcap", "sine.yaml"}) {
        const auto seen = bf("view --no-browser " + file, "timeout 60");
        EXPECT_EQ(seen.code, 1) << file;
        EXPECT_CONTAINS(seen.err, "has no MujocoWorld or World block: there is nothing to look at");
    }
    std::string less = read("robot.yaml");
    write("less.yaml", less.replace(less.find("world.*"), 7, "world.s"));
    bf("run less.yaml --record less.mcap");
    const auto other = bf("film less.mcap -o other.mp4");
    EXPECT_EQ(other.code, 1);
    EXPECT_CONTAINS(other.err, "world.w_H_b");
    EXPECT_FALSE(exists("other.mp4"));

    const auto both = bf("film run.mcap run.mcap --picture both.png --width 120 --height 48 --com --support "
                         "--trail l_elbow_1 --trail l_sole --follow root_link --at 0.1");
    EXPECT_EQ(both.out, "both.png\n") << both.err;
    EXPECT_CONTAINS(bf("film run.mcap --picture no.png --trail nose").err, "the world has no body 'nose'");
    EXPECT_CONTAINS(bf("film run.mcap run.mcap --picture no.png --width 20").err,
                    "--width 20 is too little for 2 recordings");
}

TEST_F(Verbs, TuneWritesTheGainsOfTheRobotThatIsMeant) {
    write("arm.urdf", read_text_file(BF_SOURCE_DIRECTORY "/examples/two_robots/arm.urdf"));
    const std::string head = "<world step=\"0.001\">\n  <!-- <robot name=\"left\" file=\"old.urdf\"/> -->\n";
    const std::string left = "  <robot name=\"left\" file=\"arm.urdf\" initial=\"0 -0.6 2.2\"";
    const std::string rest = "/>\n  <robot name='right' file='arm.urdf' position='1 0 0'/>\n</world>\n";
    write("world.xml", head + left + rest);
    const auto tuned = bf("tune world.xml --robot left --frequency 15 -o tuned.xml");
    ASSERT_EQ(tuned.code, 0) << tuned.err;
    const std::string text = read("tuned.xml"), before = head + left + " position_gains=\"";
    ASSERT_EQ(text.substr(0, before.size()), before);
    EXPECT_EQ(text.substr(text.find('"', before.size())), "\"" + rest);

    const auto on_its_stop = bf("tune world.xml --robot left --pose 0,-0.6,0 -o stop.xml");
    EXPECT_EQ(on_its_stop.code, 1);
    EXPECT_CONTAINS(on_its_stop.err, "joint 'bend' ");
    EXPECT_FALSE(exists("stop.xml"));
    EXPECT_CONTAINS(bf("tune world.xml --robot left --frequency 1e-9").err,
                    "--frequency 1e-9 is no NUMBER and no JOINT=NUMBER of 0.1 rad/s or more");
    EXPECT_CONTAINS(bf("tune world.xml --robot left --integral 1e-9").err,
                    "integral is 1e-09; it must be 0, or 0.01 to 1");
    for (const std::string option : {"--params nofile", "--set a=1"})
        EXPECT_CONTAINS(bf("tune world.xml --robot left " + option).err,
                        "--set and --params change what a model says, but world.xml is the file of a World");
}

} // namespace

} // namespace bf::tools
