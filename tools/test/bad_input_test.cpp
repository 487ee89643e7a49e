// Wrong input of every kind: a message that says where and what, a non-zero exit code, nothing half-written.
#include "command.hpp"

namespace bf::tools {

namespace {

class BadInput : public Command {
  protected:
    /// Writes m.yaml with these blocks, and what follows them.
    void model(const std::string& blocks, const std::string& more = "") const {
        write("m.yaml",
              "model: m\nplugins: [WholeBodyToolbox]\nstep: 0.1\nstop: 1\nblocks:\n" + blocks + more);
    }
    void expect_error(const std::string& command, const std::string& text, int code = 1) const {
        const auto result = bf(command);
        EXPECT_EQ(result.code, code) << command;
        EXPECT_CONTAINS(result.err, text);
    }
    /// The model is refused with this text, by every verb that reads it and before a recording is made.
    void expect_refused(const std::string& text) const {
        expect_error("check m.yaml", text);
        expect_error("run m.yaml --record r.mcap --summary s.json", text);
        EXPECT_FALSE(exists("r.mcap") || exists("s.json"));
    }
};

const std::string robot =
    "  robot: {block: WholeBodyToolbox/Configuration, robot: iCubGazeboV2_5, joints: [torso_pitch]}\n";

TEST_F(BadInput, UnknownBlock) {
    model("  a: {block: Gian}\n");
    expect_refused("m.yaml:6:14: a: there is no block 'Gian'; did you mean 'Gain'");
}

TEST_F(BadInput, OldBlockThatMisbehaves) {
    const auto run = [&](const std::string& misdeed) {
        write("m.yaml", "model: m\nplugins: [LegacyPlugin]\nstep: 0.1\nstop: 0.3\nblocks:\n"
                        "  c: {block: Constant, value: \"[1 2 3]\"}\n"
                        "  x: {block: LegacyPlugin/Misbehaves, misdeed: " +
                            misdeed + "}\nconnections: {c: x}\n");
        return bf("run m.yaml", "BLOCKFACTORY_PLUGIN_PATH=" BF_TEST_PLUGINS);
    };
    const std::string block = "plugin 'LegacyPlugin', block 'Misbehaves', ";
    const auto refused = run("configureSizeAndPorts returns false");
    EXPECT_EQ(refused.code, 1);
    // Its ports are not known, so nothing is said of its connections.
    EXPECT_EQ(refused.err,
              "m.yaml:7:3: x: " + block + "configureSizeAndPorts: returned false: refused on purpose\n");
    // What does not end a run is told all the same.
    const auto leaving = run("terminate returns false");
    EXPECT_EQ(leaving.code, 0);
    EXPECT_CONTAINS(leaving.err, "bf: warning: " + block + "terminate: returned false: refused on purpose\n");
    EXPECT_CONTAINS(run("shrinks").err, "bf: warning: " + block + "output: Only 2 of the 3 elements");
    EXPECT_CONTAINS(run("shrinks").err, " (3 times)\n");
}

TEST_F(BadInput, UnknownPort) {
    model("  a: {block: Constant}\n  b: {block: Gain}\n", "connections:\n  a: b.v\n");
    expect_refused("m.yaml:9:6: b: there is no input 'v'; did you mean 'u'?");
}

TEST_F(BadInput, UnknownParameter) {
    model("  a: {block: Constant, valu: 3}\n");
    expect_refused("m.yaml:6:24: a: the block has no argument or parameter 'valu'; did you mean 'value'?");
}

TEST_F(BadInput, UnknownFrame) {
    model(robot + "  f: {block: WholeBodyToolbox/RelativeTransform, frame1: l_sole, frame2: r_soul}\n"
                  "  s: {block: Constant, value: 0}\n",
          "connections:\n  s: f.s\n");
    expect_refused("m.yaml:7:3: f: frame 'r_soul' is not a link of robot 'iCub'; most similar: 'r_sole'");
}

TEST_F(BadInput, UnknownJoint) {
    model("  robot: {block: WholeBodyToolbox/Configuration, robot: iCubGazeboV2_5, joints: [torso_pich]}\n");
    expect_refused("m.yaml:6:3: robot: joint 'torso_pich' of");
    expect_refused("most similar: 'torso_pitch'");
}

TEST_F(BadInput, WrongSize) {
    model("  a: {block: Constant, value: \"[1 2]\"}\n  b: {block: Constant, value: \"[1 2 3]\"}\n  c: "
          "{block: Sum}\n",
          "connections:\n  a: c.u1\n  b: c.u2\n");
    expect_refused("m.yaml:8:3: c: ");
    expect_refused("input 'u1' of size [2] and input 'u2' of size [3] cannot be combined");
}

TEST_F(BadInput, WrongType) {
    model("  a: {block: Constant, value: int8(1)}\n  b: {block: Constant, value: true}\n  c: {block: Sum}\n",
          "connections:\n  a: c.u1\n  b: c.u2\n");
    expect_refused(
        "must be of type int8 like the other quantities of its kind, but is wired to type boolean");
}

TEST_F(BadInput, WrongUnit) {
    model(robot + "  t: {block: Clock}\n"
                  "  f: {block: WholeBodyToolbox/RelativeTransform, frame1: l_sole, frame2: r_sole}\n",
          "connections:\n  t: f.s\n");
    expect_refused("f: input 's' is in rad, but is wired to t.y in s; convert the signal");
}

TEST_F(BadInput, AlgebraicLoop) {
    model("  a: {block: Sum}\n  c: {block: Constant}\n  b: {block: Gain, K: 2}\n",
          "connections:\n  c: a.u1\n  a: b\n  b: a.u2\n");
    expect_refused("algebraic loop: a.y -> b.u, b.y -> a.u2; break it with");
}

TEST_F(BadInput, MissingUrdf) {
    model("  robot: {block: WholeBodyToolbox/Configuration, robot: nowhere.urdf}\n");
    expect_refused("robot: robot description 'nowhere.urdf' was not found; searched in:");
}

TEST_F(BadInput, MissingMesh) {
    write("arm.urdf", R"(<robot name="arm"><link name="base"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<visual><geometry><mesh filename="nowhere.stl"/></geometry></visual></link>
<joint name="j" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<link name="tip"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
</link></robot>)");
    model("  robot: {block: WholeBodyToolbox/Configuration, robot: arm.urdf}\n"
          "  world: {block: WholeBodyToolbox/MujocoWorld, period: 0.001}\n",
          "record: [world.w_H_b, world.s]\n");
    EXPECT_EQ(bf("run m.yaml --set step=0.001 --set stop=0.01 --record r.mcap").code, 0) << read(".err");
    expect_error("film r.mcap -o film.mp4", "nowhere.stl");
    expect_error("film r.mcap -o film.avi", "-o film.avi: the name of this file ends in .mp4");
    expect_error("film r.mcap --picture p.jpg", "--picture p.jpg: the name of this file ends in .png");
    expect_error("film r.mcap --picture arm.urdf", "--picture arm.urdf: the name of this file ends");
    EXPECT_FALSE(exists("film.mp4"));
}

const std::string qp = R"(  t: {block: Clock}
  half: {block: Constant, value: 0.55}
  left: {block: Sum, signs: +-}
  root: {block: Sqrt}
  H: {block: Constant, value: "[1 0; 0 1]"}
  A: {block: Constant, value: "[1 0]", vector_1d: false}
  zero: {block: Constant, value: 0}
  g: {block: Gain, K: "[1; 1]"}
  qp: {block: WholeBodyToolbox/QP, use_lbA: true, stop_when_fails: true}
)";
/// A run that fails at t = 0.6 s, in the outputs of step 6: steps 0 to 5 are complete, in recording and
/// summary.
class FailedStep : public BadInput {
  protected:
    void expect_failure(const std::string& text) const {
        expect_error("run m.yaml --record r.mcap --summary s.json", "m stopped at t = 0.6 s: " + text);
        EXPECT_EQ(json("s.json")["steps"], 6);
        EXPECT_EQ(json("s.json")["outcome"], "failed");
        EXPECT_CONTAINS(json("s.json")["failure"].get<std::string>(), text);
        EXPECT_EQ(files(), "m.yaml r.mcap s.json");
        EXPECT_EQ(bf("export r.mcap -o r.csv").err, "");
        EXPECT_EQ(lines("r.csv"), 1 + recorded) << read("r.csv");
    }
    int recorded = 6;
};

TEST_F(FailedStep, InfeasibleQpIsNamed) {
    model(qp,
          "connections:\n  half: left.u1\n  t: [left.u2, g]\n  left: [root, qp.ubA]\n  H: qp.H\n  A: qp.A\n"
          "  zero: qp.lbA\n  g: qp.g\nrecord: [t.y]\n");
    expect_failure("qp: lbA(1) is above ubA(1)");
}

TEST_F(FailedStep, NotFiniteQpIsNamed) {
    model(qp, "connections:\n  half: [left.u1, qp.ubA]\n  t: left.u2\n  left: root\n  root: g\n  H: qp.H\n"
              "  A: qp.A\n  zero: qp.lbA\n  g: qp.g\nrecord: [t.y]\n");
    expect_failure("qp: g(1) is not finite; look at what computes g");
}

TEST_F(FailedStep, StateThatBecomesNanIsNamed) {
    model("  t: {block: Clock}\n  half: {block: Constant, value: 0.55}\n  left: {block: Sum, signs: +-}\n"
          "  root: {block: Sqrt}\n  x: {block: UnitDelay}\n",
          "connections:\n  half: left.u1\n  t: left.u2\n  left: root\n  root: x\nrecord: [t.y]\n");
    recorded = 7; // the outputs of the step are seen before its update fails
    expect_failure("x: a state became NaN: look at the block's inputs in this step");
}

TEST_F(BadInput, TruncatedYaml) {
    model("  a: {block: Constant, value: [1, 2\n");
    expect_refused("m.yaml:6:1: the YAML syntax is wrong: end of sequence flow not found; close the bracket");
}

TEST_F(BadInput, MissingPlugin) {
    write("m.yaml", "model: m\nplugins: [WholeBodyToolbx]\nstep: 1\nstop: 1\nblocks: {}\n");
    expect_refused("m.yaml:2:11: plugin 'WholeBodyToolbx' was not found: searched ");
    expect_refused("did you mean 'WholeBodyToolbox'?; set BLOCKFACTORY_PLUGIN_PATH");
}

TEST_F(BadInput, PluginThatCannotBeLoaded) {
    write("m.yaml", "model: m\nplugins: [Broken]\nstep: 1\nstop: 1\nblocks: {}\n");
    const std::string environment = "BLOCKFACTORY_PLUGIN_PATH=.";
    const auto refused = [&](const std::string& text) {
        const auto check = bf("check m.yaml", environment);
        EXPECT_EQ(check.code, 1);
        EXPECT_CONTAINS(check.err, text);
    };
    const std::string compile = "c++ -shared -fPIC -o Broken.so -x c++ p.cpp";
    write("p.cpp", "int nothing = 0;");
    ASSERT_EQ(shell(compile).code, 0);
    refused("has no symbol bf_plugin_v1: it is no BlockFactory plugin");
    write("p.cpp", "void nowhere(); extern \"C\" void bf_plugin_v1() { nowhere(); }");
    ASSERT_EQ(shell(compile).code, 0);
    refused("undefined symbol: _Z7nowherev");
    write("Broken.so", "no library");
    refused("Broken.so cannot be loaded: ");
    const std::string test_plugins =
        "BLOCKFACTORY_PLUGIN_PATH=" + std::string(BF_BINARY_DIRECTORY) + "/test_plugins";
    const auto throws = bf("describe Throws", test_plugins);
    EXPECT_EQ(throws.code, 0);
    EXPECT_CONTAINS(throws.err, "left out: block 'Throws/Thrower' cannot be made: no motor");
    EXPECT_CONTAINS(throws.err, "left out: block 'Throws/NumberThrower' cannot be made: the constructor");
    write("throws.yaml", "model: m\nstep: 1\nstop: 1\nblocks: {t: {block: Throws/Thrower}}\n");
    EXPECT_CONTAINS(bf("run throws.yaml", test_plugins).err,
                    "t: block 'Throws/Thrower' cannot be made: no motor");

    const auto doctor = bf("doctor", environment);
    EXPECT_EQ(doctor.code, 1);
    EXPECT_CONTAINS(doctor.out, "plugin       NO   ");
    const auto listed = nlohmann::json::parse(bf("doctor --json", environment).out)["plugins"].size();
    EXPECT_EQ(listed, nlohmann::json::parse(bf("doctor --json").out)["plugins"].size() + 1);
    write("Udp.so", "no library"); // it is found before the one that can be loaded
    const auto tried = bf("doctor", environment).out;
    EXPECT_CONTAINS(tried, "middleware   NO   UDP, plugin Udp\n");
    EXPECT_CONTAINS(tried.substr(tried.find("UDP, plugin Udp")), "Udp.so cannot be loaded: ");
    EXPECT_CONTAINS(bf("doctor").out, "middleware   yes  UDP, plugin Udp\n");
    const auto describe = bf("describe", environment);
    EXPECT_EQ(describe.code, 0);
    EXPECT_CONTAINS(describe.err, "left out: plugin ");
    EXPECT_CONTAINS(describe.out, "standard / math");
}

TEST_F(BadInput, FilesThatCannotBeWritten) {
    write("m.yaml", sine_model);
    expect_error("run m.yaml --record no/r.mcap", "cannot create the recording 'no/r.mcap': No such file");
    expect_error("run m.yaml --record r.mcap --summary no/s.json", "cannot write no/s.json: No such file");
    EXPECT_FALSE(exists("r.mcap")) << "the summary is tried before the run";
    bf("run m.yaml --record r.mcap");
    expect_error("export r.mcap -o no/r.csv", "cannot write no/r.csv: No such file");
    expect_error("export r.mcap -o no/r.mat", "cannot write no/r.mat: No such file");
    expect_error("plot r.mcap -o no/r.png", "cannot write no/r.png: No such file");
    expect_error("plot r.mcap -o r.jpg", "bf: figures are .png or .svg files, not '.jpg'");
    expect_error("plot r.mcap ''", "the recording has no signal ''");
    EXPECT_EQ(files(), "m.yaml r.mcap");
}

TEST_F(BadInput, FilesThatTheRunReadsAreNotOverwritten) {
    write("m.yaml", sine_model);
    write("p.yaml", "step: 0.1\n");
    for (const std::string option : {"--record", "--summary", "--snapshot", "--profile"})
        for (const std::string file : {"m.yaml", "./p.yaml"})
            expect_error("run m.yaml --params p.yaml " + option + " " + file,
                         option + " " + file + " is a file that is read; give another name");
    expect_error("sweep m.yaml -o m.yaml", "-o m.yaml is a file that is read");
    EXPECT_EQ(bf("check m.yaml --params p.yaml").code, 0);
}

TEST_F(BadInput, TwoOutputsAreNotOneFile) {
    write("m.yaml", sine_model);
    expect_error("run m.yaml --record a.x --summary a.x",
                 "--summary a.x is the file of --record; give another name");
    expect_error("run m.yaml --record a.x --snapshot ./a.x", "--snapshot ./a.x is the file of --record");
    expect_error("run m.yaml --summary a.x --profile $PWD/a.x", "is the file of --summary");
    EXPECT_EQ(files(), "m.yaml");
    EXPECT_EQ(bf("run m.yaml --record /dev/null --summary /dev/null").code, 0);
    bf("run m.yaml --record r.png");
    expect_error("plot r.png", "-o r.png is a file that is read; give another name");
    expect_error("replay r.png -o r.png", "-o r.png is a file that is read");
    EXPECT_EQ(bf("replay r.png").code, 0);
}

TEST_F(BadInput, OneRunAtATimeRecordsIntoAFile) {
    write("m.yaml", sine_model);
    const auto both = shell("'" BF_PROGRAM "' run m.yaml --quiet --realtime --duration 0.8 --priority 0 "
                            "--record r.mcap & sleep 0.4; '" BF_PROGRAM "' run m.yaml --record r.mcap; wait");
    EXPECT_CONTAINS(both.err,
                    "cannot create the recording 'r.mcap': another program is writing it; give another");
    EXPECT_EQ(bf("replay r.mcap").code, 0);
    EXPECT_EQ(bf("run m.yaml --record r.mcap").code, 0) << "which nobody writes any more";
}

TEST_F(BadInput, NoInputIsWrittenByAnotherOption) {
    write("m.yaml", sine_model);
    bf("run m.yaml --stop 0.5 --snapshot s.bin");
    for (const std::string option : {"record", "summary", "profile", "snapshot"})
        expect_error("run m.yaml --from-snapshot s.bin --" + option + " s.bin",
                     "s.bin is a file that is read");
    write("rates.yaml", "model: m\nstep: 0.1\nstop: 1\nrecord: all\nblocks:\n  a: {block: Clock}\n"
                        "  b: {block: Clock, period: 0.2}\n");
    bf("run rates.yaml --record x_a.y.csv"); // a recording, whatever its name says
    expect_error("export x_a.y.csv -o x.csv", "-o x_a.y.csv is a file that is read");
    expect_error("export x_a.y.csv -o /dev/stdout", "signals of different rates go to a file each");
    EXPECT_EQ(bf("replay x_a.y.csv").code, 0);
}

TEST_F(BadInput, NoFileThatABlockReadsIsWritten) {
    const std::string table = "time,y\n0,1\n1,2\n";
    write("table.csv", table);
    write("part.yaml", "model: part\nblocks:\n  data: {block: SignalFromFile, file: \"'table.csv'\"}\n");
    write("m.yaml", "model: m\nstep: 0.1\nstop: 1\nrecord: all\nvariables: {k: 1}\nblocks:\n"
                    "  p: {file: part.yaml}\n  g: {block: Gain, K: k}\n  c: {block: Constant}\n"
                    "connections: {c: g}\n");
    ASSERT_EQ(bf("run m.yaml --record r.mcap").code, 0);
    for (const std::string file : {"table.csv", "part.yaml", "./m.yaml"}) {
        for (const std::string option : {"--record ", "--summary ", "--snapshot ", "--profile "})
            expect_error("run m.yaml " + option + file, option + file + " is a file that is read");
        expect_error("replay r.mcap -o " + file, "-o " + file + " is a file that is read");
        expect_error("sweep m.yaml --set k=1:2 --final g.y -o " + file,
                     "-o " + file + " is a file that is read");
    }
    EXPECT_EQ(read("table.csv"), table);
}

TEST_F(BadInput, NoFileTakesThePlaceOfAClosedStream) {
    write("m.yaml", sine_model);
    EXPECT_EQ(shell("'" BF_PROGRAM "' run m.yaml --record r.mcap --summary s.json 0>&- 1>&- 2>&-").code, 0);
    EXPECT_EQ(bf("replay r.mcap").code, 0);
    EXPECT_EQ(read("s.json").front(), '{');
}

TEST_F(BadInput, WhatStandardOutputHoldsAlreadyStays) {
    write("m.yaml", sine_model);
    bf("run m.yaml --record r.mcap");
    const std::string program = "'" BF_PROGRAM "' ";
    for (const std::string command :
         {"export r.mcap -o /dev/stdout", "run m.yaml --quiet --summary /dev/fd/1",
          "run m.yaml --quiet --summary /proc/self/fd/1"}) {
        const std::string text = shell("echo first; " + program + command + "; echo last").out;
        EXPECT_TRUE(text.starts_with("first\n") && text.ends_with("\nlast\n") && text.size() > 100) << text;
    }
}

TEST_F(BadInput, FullDisk) {
    write("m.yaml", sine_model);
    // Links, so that a mistake here could replace nothing but them.
    for (const char* name : {"full.mcap", "full.json", "full.csv", "full.mat"})
        std::filesystem::create_symlink("/dev/full", folder / name);
    const auto run = bf("run m.yaml --record full.mcap --summary s.json");
    EXPECT_EQ(run.code, 1);
    EXPECT_CONTAINS(run.err, "cannot write the recording 'full.mcap': No space left on device; free space, "
                             "or write to another disk; it holds no samples");
    EXPECT_EQ(json("s.json")["outcome"], "failed");
    EXPECT_EQ(run.out.find("recorded in"), std::string::npos);
    expect_error("run m.yaml --summary full.json", "cannot write full.json: No space left on device");
    bf("run m.yaml --record r.mcap");
    expect_error("export r.mcap -o full.csv", "No space left on device");
    expect_error("export r.mcap -o full.mat", "full.mat");
    const auto check = shell("'" BF_PROGRAM "' check m.yaml > /dev/full");
    EXPECT_EQ(check.code, 1);
    EXPECT_CONTAINS(check.err, "cannot write the standard output: No space left on device");
    EXPECT_EQ(files(), "full.csv full.json full.mat full.mcap m.yaml r.mcap s.json");
}

TEST_F(BadInput, FewFilesThatMayBeOpen) {
    const auto few = shell("ulimit -n 100; '" BF_PROGRAM "' --version");
    EXPECT_EQ(few.code, 1);
    EXPECT_EQ(few.err, "bf: this program may open too few files; raise that limit, as by ulimit -n 1024\n");
    EXPECT_EQ(shell("ulimit -Sn 20; '" BF_PROGRAM "' --version").code, 0) << "it is raised";
}

TEST_F(BadInput, PipesAndDevicesAreNotReadForEver) {
    write("m.yaml", sine_model);
    ASSERT_EQ(bf("run m.yaml --quiet --record r.mcap").code, 0);
    ASSERT_EQ(shell("mkfifo p p.mcap p.csv p.mat p.svg").code, 0);
    const std::string regular = "it is no regular file, which has an end; write its content to one";
    for (const std::string verb : {"export p -o x.csv", "plot p", "replay p"})
        expect_error(verb, "cannot open the recording 'p': " + regular);
    expect_error("run m.yaml --from-snapshot p", "cannot read p: " + regular);
    expect_error("run p", "cannot read the model p: " + regular);
    expect_error("check /dev/zero", "cannot read the model /dev/zero: " + regular);
    expect_error("check .", "cannot read the model .: it is a folder; give the name of a file");
    write("file.yaml", "model: m\nstep: 0.1\nstop: 1\nblocks:\n  s: {file: p}\n");
    expect_error("check file.yaml", "file.yaml:5:13: s: cannot read 'p': " + regular);
    write("m.yaml", sine_model);
    for (const auto& [file, why] :
         {std::pair{"/dev/zero", regular.c_str()}, {"/tmp", "it is a folder; give the name of a file"}}) {
        model("  r: {block: WholeBodyToolbox/Configuration, robot: " + std::string(file) +
              ", joints: [a]}\n");
        expect_error("check m.yaml", "robot description '" + std::string(file) + "' cannot be read: " + why);
    }
    write("m.yaml", sine_model);
    const std::string unread = ": no program reads this pipe; start one that does, or give a file";
    expect_error("run m.yaml --summary p", "cannot write p" + unread);
    expect_error("run m.yaml --record p", "cannot create the recording 'p'" + unread);
    expect_error("export r.mcap -o p.csv", "cannot write p.csv" + unread);
    expect_error("export r.mcap -o p.mat", "cannot write p.mat" + unread);
    expect_error("plot r.mcap -o p.svg", "cannot write p.svg" + unread);
    EXPECT_EQ(shell("'" BF_PROGRAM "' run m.yaml --quiet --record p & cat p > got.mcap; wait $!").code, 0);
    EXPECT_EQ(bf("replay got.mcap").code, 0);
    EXPECT_EQ(bf("export r.mcap -o /dev/stdout").out.substr(0, 4), "time");
    EXPECT_EQ(files(), "file.yaml got.mcap m.yaml p p.csv p.mat p.mcap p.svg r.mcap");
}

TEST_F(BadInput, RingsOfLinksAndFoldersThatAreGone) {
    write("m.yaml", sine_model);
    ASSERT_EQ(bf("run m.yaml --quiet --record r.mcap").code, 0);
    ASSERT_EQ(shell("ln -s b a; ln -s a b; ln -s b.csv a.csv; ln -s a.csv b.csv").code, 0);
    const std::string ring = ": its symbolic links lead in a ring; remove one of them";
    expect_error("run a", "cannot read the model a" + ring);
    expect_error("plot a", "cannot open the recording 'a'" + ring);
    expect_error("run m.yaml --params a", "cannot read a" + ring);
    expect_error("run m.yaml --summary a", "cannot write a" + ring);
    expect_error("run m.yaml --record a", "cannot create the recording 'a'" + ring);
    expect_error("export r.mcap -o a.csv", "cannot write a.csv" + ring);
    expect_error("generate m.yaml -o a", "cannot write the folder a" + ring);
    const std::string whole = folder / "m.yaml";
    for (const std::string& arguments :
         {std::string("run ../m.yaml"), "generate " + whole + " -o x", "deploy " + whole + " -o x"}) {
        const auto outcome = shell("mkdir gone && cd gone && rmdir ../gone && '" BF_PROGRAM "' " + arguments);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_CONTAINS(outcome.err, "the current folder is not there any more; change to another one");
        EXPECT_EQ(outcome.err.find("filesystem error"), std::string::npos) << outcome.err;
    }
}

TEST_F(BadInput, LinksAreWrittenThrough) {
    write("m.yaml", sine_model);
    std::filesystem::create_symlink("target.json", folder / "link.json");
    EXPECT_EQ(bf("run m.yaml --summary link.json").code, 0);
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.json"));
    EXPECT_EQ(json("target.json")["steps"], 100);
}

TEST_F(BadInput, MissingModel) { expect_error("run nowhere.yaml", "there is no model file nowhere.yaml"); }

TEST_F(BadInput, ModelWithoutAStopTime) {
    write("m.yaml", "model: m\nstep: 1\nblocks:\n  t: {block: Clock}\n");
    expect_error("run m.yaml", "m does not say when it ends: give --stop SECONDS");
    expect_error("run m.yaml --stop -1", "'stop' is -1; give a number of seconds from 0 to Inf");
    expect_error("run m.yaml --stop soon", "unknown variable or function 'soon'");
}

TEST_F(BadInput, NamesToSet) {
    write("m.yaml", sine_model);
    expect_error("run m.yaml --set Gian.Kp=3", "nothing is called 'Gian.Kp'; did you mean 'Gain.Kp'");
    expect_error("run m.yaml --set gain.K=[1", "gain.K: '[1': this '[' is never closed");
    expect_error("run m.yaml --set Gain", "--set: 'Gain' is no NAME=EXPRESSION, e.g. --set Gain.Kp=10", 2);
    expect_error("run m.yaml --set =3", "'=3' is no NAME=EXPRESSION", 2);
    expect_error("run m.yaml --set gain.K=", "'gain.K=' is no NAME=EXPRESSION", 2);
}

TEST_F(BadInput, ParameterFiles) {
    write("m.yaml", sine_model);
    expect_error("run m.yaml --params nowhere.yaml", "cannot read nowhere.yaml: No such file or directory");
    write("p.yaml", "Gain:\n  Kx: 5\ngain.K: 3+\nstop: [1, 2]\n");
    expect_error("run m.yaml --params p.yaml",
                 "p.yaml:2:7: nothing is called 'Gain.Kx'; did you mean 'Gain.Kp'");
    expect_error("run m.yaml --params p.yaml", "p.yaml:3:11: gain.K: '3+': expected a value");
    expect_error("run m.yaml --params p.yaml", "p.yaml:4:7: 'stop' is [1 2]; give a number of seconds");
    expect_error("run m.yaml --params p.yaml", "3 errors");
    write("p.yaml", "Gain: {Kp: 5\n");
    expect_error("run m.yaml --params p.yaml", "p.yaml:1:1: the YAML syntax is wrong");
    write("p.yaml", "- 1\n");
    expect_error("run m.yaml --params p.yaml", "p.yaml:1:1: expected variables, a mapping");
    write("p.yaml", "");
    expect_error("run m.yaml --params p.yaml", "p.yaml:1:1: expected variables, a mapping");
    write("p.yaml", "Gain.Kp: 0.2\nGain: {Kp: 0.3}\n");
    expect_error("run m.yaml --params p.yaml",
                 "p.yaml:2:12: a second 'Gain.Kp'; remove or rename one; the first is at p.yaml:1:");
    write("p.yaml", "\xEF\xBB\xBFstop: 0.5\n");
    EXPECT_EQ(bf("run m.yaml --params p.yaml").code, 0);
}

TEST_F(BadInput, ValuesOutsideOfTheirLimits) {
    model("  p: {block: Pulse, width: -1}\n  q: {block: WholeBodyToolbox/QP, max_iterations: 0}\n");
    expect_refused("m.yaml:6:28: p: parameter 'width' must be from 0 to 100, but is -1");
    expect_refused("m.yaml:7:3: q: argument 'max_iterations' must be at least 1, but is 0");
    write("m.yaml", "model: m\nstep: 0.1\nstop: 1\nvariables: {T: {value: 2, maximum: 5}}\nblocks: {p: "
                    "{block: Pulse, cycle: T}}\n");
    expect_error("run m.yaml --set p.width=200", "p: parameter 'width' must be from 0 to 100, but is 200");
    expect_error("run m.yaml --set T=0",
                 "m.yaml:5:35: p: parameter 'cycle' must be greater than 0, but is 0");
    expect_error("run m.yaml --set T=6", "variable 'T' must be at most 5, but is 6");
    write("p.yaml", "p.width: 100\nT: 6\n");
    expect_error("run m.yaml --params p.yaml", "p.yaml:2:4: variable 'T' must be at most 5, but is 6");
    write("p.yaml", "p:\n  width: 100\n  cycle: -1\n");
    expect_error("run m.yaml --params p.yaml",
                 "p.yaml:3:10: p: parameter 'cycle' must be greater than 0, but is -1");
    EXPECT_EQ(bf("run m.yaml --set p.width=100").code, 0);
}

TEST_F(BadInput, CheckPrintsErrorsAsJson) {
    model("  a: {block: Gian}\n  b: {block: Constant, valu: 3}\n  c: {block: Constant, value: \"[1 2]\"}\n");
    const auto check = bf("check m.yaml --json");
    EXPECT_EQ(check.code, 1);
    const auto json = nlohmann::json::parse(check.out);
    const auto& blocks = json["blocks"]; // what is known all the same
    const auto c = std::find_if(blocks.begin(), blocks.end(), [](const auto& b) { return b["path"] == "c"; });
    ASSERT_NE(c, blocks.end());
    EXPECT_EQ((*c)["quantities"].back()["size"], "[2]");
    const auto& errors = json["errors"];
    ASSERT_EQ(errors.size(), 2u);
    EXPECT_EQ(errors[0]["line"], 6);
    EXPECT_EQ(errors[0]["path"], "a");
    EXPECT_EQ(errors[1]["line"], 7);
}

TEST_F(BadInput, RecordingsThatAreCutOrNone) {
    write("m.yaml", sine_model);
    bf("run m.yaml --record r.mcap");
    const std::string whole = read("r.mcap");
    std::ofstream(folder / "cut.mcap", std::ios::binary) << whole.substr(0, whole.size() - 100);
    const auto exported = bf("export cut.mcap -o cut.csv");
    EXPECT_EQ(exported.code, 1);
    EXPECT_CONTAINS(exported.err, "cut.mcap is not complete: ");
    EXPECT_CONTAINS(exported.err,
                    "bf: cut.csv holds only what could be read of cut.mcap, which is not complete\n");
    expect_error("export cut.mcap -o cut.mat", "cut.mat holds only what could be read of cut.mcap");
    expect_error("plot cut.mcap", "cut.png holds only what could be read of cut.mcap");
    EXPECT_TRUE(exists("cut.mat") && exists("cut.png"));
    EXPECT_CONTAINS(exported.err, "the recording was cut");
    EXPECT_EQ(lines("cut.csv"), 101) << "only the index at the end is lost";
    std::ofstream(folder / "stub.mcap", std::ios::binary) << whole.substr(0, 60);
    expect_error("plot stub.mcap", "stub.mcap holds no signal");
    write("none.mcap", "hello\n");
    expect_error("plot none.mcap", "'none.mcap' is no recording: it does not start with the MCAP signature");
    expect_error("plot nowhere.mcap", "cannot open the recording 'nowhere.mcap': No such file or directory");
    expect_error("plot r.mcap nope", "the recording has no signal 'nope'; it has: source.y, gain.y");
    expect_error("export r.mcap -o r.xls",
                 "cannot tell the format of r.xls: give a name that ends in .csv or .mat");
}

TEST_F(BadInput, NumbersAreReadByOneRule) {
    write("m.yaml", sine_model);
    for (const std::string good :
         {"--set largest.at_most=Inf", "--set largest.at_most=-inf", "--set gain.K=1d3", "--stop 1D0"})
        EXPECT_EQ(bf("run m.yaml --quiet " + good).code, 0) << good;
    const std::string large = "'1e400' is beyond the largest number, 1.8e308; write Inf for infinity";
    expect_error("run m.yaml --set gain.K=1e400", large);
    expect_error("run m.yaml --stop 1e400", large);
    write("p.yaml", "gain.K: 1e400\n");
    expect_error("run m.yaml --params p.yaml", large);
    expect_error("run m.yaml --set gain.K=NaN", "parameter 'K' must be a number, but is NaN");
    expect_error("run m.yaml --realtime --duration 1e400", "--duration: " + large, 2);
    expect_error("run m.yaml --until 'gain.y > nan'", "'gain.y > nan' is no event");
    EXPECT_EQ(bf("run m.yaml --quiet --until 'gain.y < 1d3'").code, 0);
}

TEST_F(BadInput, TimesThatARunCannotHave) {
    write("m.yaml", sine_model);
    expect_error("run m.yaml --stop \"'x'\"", "'stop' is 'x'; give a number of seconds from 0 to Inf");
    expect_error("run m.yaml --stop '[]'", "give a number of seconds from 0 to Inf");
    expect_error("run m.yaml --set step=1e300",
                 "'step' is 1e+300; give a positive number of seconds up to 1e9");
    expect_error(
        "run m.yaml --set step=1e-300",
        "a run of 1 s has more than 2^53 steps of 1e-300 s; give a longer 'step', or a shorter 'stop'");
    expect_error("run m.yaml --stop 1e300", "a run of 1e+300 s has more than 2^53 steps of 0.01 s");
    for (const std::string every : {"0", "1e-12", "0.0099"})
        expect_error("run m.yaml --record r.mcap --checkpoint-every " + every,
                     "--checkpoint-every " + every +
                         " s is shorter than the base period; give at least 0.01 s");
    EXPECT_EQ(bf("run m.yaml --quiet --record r.mcap --checkpoint-every 1e300").code, 0);
    model("  c: {block: Clock, period: \"'x'\"}\n");
    expect_error("check m.yaml", "'period' must be a finite number, not 'x'");
}

TEST_F(BadInput, EmptyValuesAreNone) {
    write("m.yaml", sine_model);
    for (const std::string option :
         {"stop", "inputs", "record", "summary", "snapshot", "from-snapshot", "until", "profile", "params"})
        expect_error("run m.yaml --" + option + " ''",
                     "--" + option + ": the value is empty; give one, or leave the option out", 2);
    expect_error("run m.yaml --ros2 motor",
                 "--ros2: write a namespace that begins with /, such as / or /icub", 2);
    expect_error("run m.yaml --realtime --serve 0 --ros2 /motor", "--serve excludes --ros2", 2);
    expect_error("run m.yaml --ros1 motor",
                 "--ros1: write a namespace that begins with /, such as / or /icub", 2);
    expect_error("run m.yaml --ros1 /motor --ros2 /motor", "--ros1 excludes --ros2", 2);
    expect_error("run m.yaml --realtime --serve 0 --token ''", "--token: the value is empty", 2);
    expect_error("run m.yaml --realtime --serve ''", "--serve: the value is empty", 2);
    expect_error("run m.yaml --profile=", "--profile: the value is empty", 2);
    expect_error("export r.mcap -o ''", "-o: the value is empty", 2);
    EXPECT_EQ(files(), "m.yaml");
}

TEST_F(BadInput, WrongUsageExitsWithTwo) {
    expect_error("", "A subcommand is required\nThe verbs are run, replay", 2);
    expect_error("runn m.yaml", "there is no verb 'runn'; did you mean 'run'?", 2);
    expect_error("run", "MODEL is required\nSee bf run --help", 2);
    expect_error("run m.yaml --record ''", "--record: the value is empty; give one, or leave the option out",
                 2);
    expect_error("run m.yaml --stpo 3", "--stpo; did you mean '--stop'?\nSee bf run --help", 2);
    expect_error("film r.mcap -o f.mp4 --fps 0", "--fps: Value 0 not in range", 2);
    for (const std::string option : {"realtime-factor", "duration", "watchdog"})
        expect_error("run m.yaml --realtime --" + option + " nan", "--" + option + ": Value nan not in range",
                     2);
    expect_error("sweep m.yaml -j 0", "--jobs: ", 2);
    expect_error("describe Gian", "there is no block 'Gian'; did you mean 'Gain'");
    expect_error("describe standrd", "there is no library or block 'standrd'; did you mean 'standard'?");
    expect_error("describe --markdown", "--markdown writes the page of one library");
}

} // namespace

} // namespace bf::tools
