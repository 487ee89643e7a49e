// bf deploy: the package alone runs the model.
#include "command.hpp"

#include <unistd.h>

namespace bf::tools {

namespace {

class Deploy : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("sine.yaml", sine_model);
    }
};

TEST_F(Deploy, APackageRunsInARootThatHoldsNothingElseThanAShell) {
    const auto deploy = bf("deploy sine.yaml -o root/sine --set Gain.Kp=0.5");
    ASSERT_EQ(deploy.code, 0) << deploy.err;
    EXPECT_CONTAINS(deploy.out, "root/sine (");
    EXPECT_EQ(bf("run sine.yaml --quiet --set Gain.Kp=0.5 --record here.mcap").code, 0);
    EXPECT_CONTAINS(read("root/sine/sine.service"), "ExecStart=/opt/sine/run --quiet --stop Inf\n");
    EXPECT_FALSE(exists("root/.sine.part"));
    const auto beside = bf("--version"); // from where it was made, and from elsewhere
    EXPECT_EQ(shell("cd / && '" + (folder / "root/sine/bf").string() + "' --version").out, beside.out);
    // Only root may change the root: a user becomes root in a namespace of his own.
    const std::string as_root = geteuid() == 0 ? "" : "$(command -v unshare) --map-root-user ";
    if (shell(as_root + "true").code != 0) GTEST_SKIP() << "this machine lets no user change the root";
    ASSERT_EQ(shell("cd root && mkdir bin lib64 && cp -L /bin/sh bin && cp -L /lib64/ld-linux-x86-64.so.2 "
                    "lib64 && cp -L "
                    "\"$(ldd /bin/sh | grep -o '/[^ ]*libc.so.6')\" lib64")
                  .code,
              0);
    const auto run = shell("env -i LD_LIBRARY_PATH=/lib64 " + as_root +
                           "$(command -v chroot) root /sine/run --quiet --priority 0 "
                           "--realtime-factor 10 --record /there.mcap");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_CONTAINS(run.out, "deadlines missed: ");
    bf("export here.mcap -o here.csv");
    bf("export root/there.mcap -o there.csv");
    EXPECT_EQ(lines("there.csv"), 101);
    EXPECT_EQ(read("there.csv"), read("here.csv"));
}

TEST_F(Deploy, TheUnitGrantsRealTimeAndLittleElse) {
    if (shell("command -v systemd-analyze").code != 0)
        GTEST_SKIP() << "Debian's package systemd has the tool";
    ASSERT_EQ(bf("deploy sine.yaml -o sine").code, 0);
    const auto security =
        shell("systemd-analyze security --offline=true --no-pager --threshold=30 sine/sine.service");
    EXPECT_EQ(security.code, 0) << security.out << security.err;
    EXPECT_CONTAINS(security.out, "Overall exposure level for sine.service: ");
    for (const char* granted : {"CapabilityBoundingSet=~CAP_SYS_(NICE|RESOURCE)",
                                "CapabilityBoundingSet=~CAP_IPC_LOCK", "RestrictRealtime="})
        EXPECT_CONTAINS(security.out, "\u2717 " + std::string(granted));
    const auto verify = shell("sed 's|/opt/sine/run|/bin/true|' sine/sine.service > there.service; "
                              "systemd-analyze verify ./there.service");
    EXPECT_EQ(verify.code, 0);
    EXPECT_EQ(verify.err, "");
}

TEST_F(Deploy, TheUnitHandsKeysToAUserWhoOwnsNone) {
    write("talks.yaml", "model: talks\nplugins: [Udp]\nstep: 0.01\nstop: 0.05\nblocks:\n"
                        "  lab: {block: Udp/Streams, address: \"'0'\", key: \"'keys/lab.key'\"}\n"
                        "  home: {block: Udp/Streams, address: \"'0'\"}\n"
                        "  away: {when: false, block: Udp/Streams, key: \"'away.key'\"}\n");
    ASSERT_EQ(shell("mkdir keys && echo 0123456789abcdef | tee keys/lab.key streams.key > away.key").code, 0);
    ASSERT_EQ(bf("deploy talks.yaml -o talks").code, 0);
    EXPECT_EQ(shell("find talks -name '*.key'").out, "") << "no package holds a secret";
    const auto unit = read("talks/talks.service");
    EXPECT_CONTAINS(unit, "DynamicUser=yes\n");
    EXPECT_CONTAINS(unit, "\nLoadCredential=lab.key:/etc/credstore/lab.key\n"
                          "LoadCredential=streams.key:/etc/credstore/streams.key\n");
    ASSERT_EQ(bf("deploy sine.yaml -o sine").code, 0);
    EXPECT_EQ(read("sine/sine.service").find("LoadCredential"), std::string::npos);
    if (shell("command -v systemd-analyze").code == 0) {
        EXPECT_EQ(shell("sed 's|/opt/talks/run|/bin/true|' talks/talks.service > there.service; "
                        "systemd-analyze verify ./there.service")
                      .err,
                  "");
    }
    // What systemd does: the keys stand in a folder that this user alone enters, and others seem to read
    // them.
    shell(
        "mkdir given && echo 0123456789abcdef | tee given/lab.key > given/streams.key && chmod 440 given/*");
    const auto run = shell("CREDENTIALS_DIRECTORY=$PWD/given talks/run --quiet --priority 0");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_FALSE(exists("talks/model/streams.key")) << "none is made";
    const auto without = shell("mkdir none; CREDENTIALS_DIRECTORY=$PWD/none talks/run --quiet --priority 0");
    EXPECT_EQ(without.code, 1) << "the package has no folder keys";
    EXPECT_CONTAINS(without.err, "the key file ");
}

TEST_F(Deploy, ThePackageMakesNoSystemCallThatTheUnitForbids) {
    if (shell("command -v systemd-analyze strace && strace true").code != 0)
        GTEST_SKIP() << "scripts/deps test installs strace; Debian's package systemd has the other tool";
    ASSERT_EQ(bf("deploy sine.yaml -o sine").code, 0);
    const auto run = shell("strace -f -qq -o calls sine/run --quiet --stop 0.1 --serve 0 --record run.mcap");
    ASSERT_EQ(run.code, 0) << run.err;
    write("judge.py", R"py(
import re, subprocess
listed = {}
for line in subprocess.run(["systemd-analyze", "syscall-filter", "--no-pager"], text=True,
                           capture_output=True).stdout.splitlines():
    if line.startswith("@"):
        group = listed.setdefault(line.strip(), [])
    elif line.startswith("    ") and not line.strip().startswith("#"):
        group.append(line.strip())
def calls(name):
    return set().union(*[calls(n) if n.startswith("@") else {n} for n in listed[name]])
# systemd itself allows these, for it begins the program.
allowed = (calls("@system-service") - calls("@privileged")) | calls("@default") | {"execve"}
made = set(re.findall(r"^\d+ +(\w+)\(", open("calls").read(), re.M))
assert {"sched_setscheduler", "mlockall"} <= made, made
assert made <= allowed, made - allowed
)py");
    const auto judge = shell("python3 judge.py");
    EXPECT_EQ(judge.code, 0) << judge.err;
}

TEST_F(Deploy, TheServiceManagerHearsOfTheFirstStepAndOfThoseThatFollow) {
    ASSERT_EQ(bf("deploy sine.yaml -o sine").code, 0);
    write("manager.py", R"py(
import os, socket, subprocess, sys
listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
listener.bind("notify")
listener.settimeout(30)
program = subprocess.Popen(["sine/run", "--quiet", "--stop", "Inf", "--priority", "0", "--record", "run.mcap"],
                           env={**os.environ, "NOTIFY_SOCKET": os.path.abspath("notify"), "WATCHDOG_USEC": "400000"})
assert listener.recv(100) == b"READY=1"
for _ in range(5):
    assert listener.recv(100) == b"WATCHDOG=1"
program.terminate()
while (heard := listener.recv(100)) == b"WATCHDOG=1":
    pass
assert heard == b"STOPPING=1"
sys.exit(program.wait(30))
)py");
    const auto run = shell("python3 manager.py");
    EXPECT_EQ(run.code, 143) << run.err;
    EXPECT_EQ(bf("replay run.mcap").code, 0) << "the recording is whole";
}

TEST_F(Deploy, APackageBringsItsRobotAndPlugin) {
    write("robot.yaml",
          "model: robot\nplugins: [WholeBodyToolbox]\nstep: 0.01\nstop: 0.05\nblocks:\n  robot: {block: "
          "WholeBodyToolbox/Configuration, robot: iCubGazeboV2_5, joints: [torso_pitch]}\n  s: {block: "
          "Constant, value: 0.1}\n  frame: {block: WholeBodyToolbox/RelativeTransform, frame1: l_sole, "
          "frame2: r_sole}\nconnections: {s: frame.s}\n");
    const auto deploy = bf("deploy robot.yaml -o package");
    ASSERT_EQ(deploy.code, 0) << deploy.err;
    EXPECT_TRUE(exists("package/lib/blockfactory/WholeBodyToolbox.so"));
    EXPECT_TRUE(exists("package/share/iCub/robots/iCubGazeboV2_5/model.urdf"));
    const auto run = shell("package/run --quiet --priority 0");
    EXPECT_EQ(run.code, 0) << run.err;

    // As an installation for that machine would do, the package serves for others.
    const auto again = bf("deploy robot.yaml --prefix package -o again");
    EXPECT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(shell("diff -r package again").out, "");
    const std::string other = shell("uname -m").out == "aarch64\n" ? "x86_64" : "aarch64";
    const auto foreign = bf("deploy robot.yaml --prefix package -o foreign --target " + other);
    EXPECT_EQ(foreign.code, 1);
    EXPECT_CONTAINS(foreign.err, "there is no BlockFactory for " + other +
                                     " in package, which these blocks need:\n  robot (");
    shell("rm again/lib/ld-linux*");
    EXPECT_CONTAINS(bf("deploy robot.yaml --prefix again -o without").err,
                    "glibc's dynamic loader, ld-linux*, is not among the libraries of again/bin/bf");
    std::filesystem::remove(folder / "package/lib/blockfactory/WholeBodyToolbox.so");
    const auto without = bf("deploy robot.yaml --prefix package -o without");
    EXPECT_EQ(without.code, 1);
    EXPECT_CONTAINS(without.err, "there is no plugin package/lib/blockfactory/WholeBodyToolbox.so for ");
    EXPECT_EQ(files(), "again package robot.yaml sine.yaml");
}

TEST_F(Deploy, APackageHoldsAllThatTheModelReads) {
    for (const char* name : {"sub", "sub/deep"}) std::filesystem::create_directory(folder / name);
    write("data.csv", "0,1\n0.1,2\n");
    write("other.csv", "0,1\n0.1,2\n");
    write("sub/deep/alt.csv", "0,1\n0.1,2\n");
    write("sub/pass.yaml", "model: pass\ninputs: [u]\noutputs: [y]\nblocks: {}\nconnections: {u: y}\n");
    write("sub/alt.yaml", "model: alt\nblocks: {f: {block: SignalFromFile, file: deep/alt.csv}}\n");
    write("m.yaml", "model: m\nstep: 0.01\nstop: 0.1\nvariables: {mode: 1, name: \"'other.csv'\"}\nblocks:\n"
                    "  f: {block: SignalFromFile, file: data.csv}\n  g: {block: SignalFromFile, file: name}\n"
                    "  pass: {file: sub/pass.yaml}\n  alt: {file: sub/alt.yaml, when: mode == 2}\n"
                    "connections: {f: pass}\n");
    const auto deploy = bf("deploy m.yaml -o package");
    ASSERT_EQ(deploy.code, 0) << deploy.err;
    EXPECT_CONTAINS(deploy.out, "checked in an empty root");
    for (const char* file : {"data.csv", "other.csv", "sub/pass.yaml", "sub/alt.yaml", "sub/deep/alt.csv"})
        EXPECT_TRUE(exists(std::string("package/model/") + file)) << file;
    for (const char* gone : {"data.csv", "other.csv", "sub", "m.yaml"})
        std::filesystem::remove_all(folder / gone);
    for (const std::string mode : {"1", "2"}) {
        const auto run = shell("package/run --quiet --priority 0 --set mode=" + mode);
        EXPECT_EQ(run.code, 0) << run.err;
    }
}

TEST_F(Deploy, APackageThatCannotStartIsNone) {
    write("data.csv", "0,1\n0.1,2\n");
    write("m.yaml", "model: m\nstep: 0.01\nstop: 0.1\nblocks: {f: {block: SignalFromFile, file: " +
                        (folder / "data.csv").string() + "}}\n");
    ASSERT_EQ(bf("check m.yaml").code, 0);
    const auto deploy = bf("deploy m.yaml -o package");
    EXPECT_EQ(deploy.code, 1);
    EXPECT_CONTAINS(deploy.err, "the package would not start on another computer; its own check says:\n");
    EXPECT_CONTAINS(deploy.err, "data.csv");
    EXPECT_EQ(files(), "data.csv m.yaml sine.yaml");
}

TEST_F(Deploy, AModelThatCannotRunInRealTimeIsRefused) {
    write("m.yaml", "model: m\nstep: 0.01\nsolver: dormand_prince45\nblocks:\n  u: {block: Sine}\n"
                    "  x: {block: Integrator}\nconnections: {u: x}\n");
    const auto deploy = bf("deploy m.yaml -o package");
    EXPECT_EQ(deploy.code, 1);
    EXPECT_CONTAINS(deploy.err,
                    "the package would run in real time: the time of a step is not bounded:\n  the "
                    "solver 'dormand_prince45' chooses its own steps");
    EXPECT_EQ(files(), "m.yaml sine.yaml");
}

TEST_F(Deploy, TheGeneratedProgramRunsOnAnotherProcessor) {
    if (shell("command -v aarch64-linux-gnu-g++ qemu-aarch64 cmake").code != 0)
        GTEST_SKIP() << "scripts/deps test installs g++-aarch64-linux-gnu and qemu-user";
    const auto deploy = bf("deploy sine.yaml --target aarch64 -o package");
    ASSERT_EQ(deploy.code, 0) << deploy.err;
    EXPECT_EQ(read("package/bin/sine").substr(18, 1), "\xb7") << "ELF machine 183";
    EXPECT_CONTAINS(read("package/sine.service"), "ExecStart=/opt/sine/run --stop Inf\n");
    const auto run = shell("qemu-aarch64 package/bin/sine");
    EXPECT_EQ(run.code, 0) << run.err;
    const auto here = nlohmann::json::parse(bf("run sine.yaml --quiet --json").out);
    const auto equals = run.out.find(" = ");
    ASSERT_NE(equals, std::string::npos) << run.out;
    EXPECT_NEAR(std::stod(run.out.substr(equals + 3)), here["checks"]["largest"], 1e-12);
}

TEST_F(Deploy, WrongInputLeavesNothingBehind) {
    const auto refused = [&](const std::string& arguments, const std::string& text, int code = 1) {
        const auto result = bf("deploy " + arguments);
        EXPECT_EQ(result.code, code) << arguments;
        EXPECT_CONTAINS(result.err, text);
    };
    refused("sine.yaml -o .",
            "cannot write the folder .: the folder is not empty; empty it or name another one");
    refused("sine.yaml -o sine.yaml", "cannot write the folder sine.yaml: it is a file; name a folder");
    refused("nowhere.yaml -o package", "there is no model file nowhere.yaml");
    refused("sine.yaml -o package --target vax", "--target", 2);
    refused("sine.yaml", "--output is required", 2);
    refused("sine.yaml -o /proc/nowhere/package", "cannot write the folder /proc/nowhere/package: ");
    std::filesystem::create_directory(folder / "other");
    write("other/arm.urdf",
          "<robot name=\"arm\"><link name=\"base\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" "
          "ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link></robot>");
    std::filesystem::create_directory(folder / "models");
    write("models/arm.yaml",
          "model: arm\nplugins: [WholeBodyToolbox]\nstep: 1\nstop: 1\nblocks:\n  robot: {block: "
          "WholeBodyToolbox/Configuration, robot: ../other/arm.urdf}\n");
    refused("models/arm.yaml -o package", "put it beside the model");
    EXPECT_EQ(files(), "models other sine.yaml");
}

} // namespace

} // namespace bf::tools
