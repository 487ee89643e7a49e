// bf serve: who may drive the robots of a model.
#include "command.hpp"

namespace bf::tools {
namespace {

class Serve : public Command {
  protected:
    /// A robot's description with one joint, and a model with its world and other blocks.
    void SetUp() override {
        Command::SetUp();
        write(
            "arm.urdf",
            R"(<robot name="arm"><link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="bob"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="continuous"><axis xyz="0 1 0"/><parent link="stand"/><child link="bob"/></joint></robot>)");
        model("arm.yaml", "");
    }
    void model(const std::string& file, const std::string& more) {
        write(file,
              "model: arm\nplugins: [WholeBodyToolbox, SharedMemory]\nstep: 0.001\nstop: 0.01\nblocks:\n"
              "  robot: {block: WholeBodyToolbox/Configuration, robot: arm.urdf, floating_base: false}\n"
              "  world: {block: WholeBodyToolbox/MujocoWorld}\n" +
                  more);
    }
    const std::string name = "serve-" + std::to_string(getpid());
};

} // namespace

TEST_F(Serve, LetsOneDiagramDriveTheRobotOfAnother) {
    model("drive.yaml",
          "  tau: {block: Constant, value: 0.5}\n  set: {block: WholeBodyToolbox/SetReferences}\n"
          "connections: {tau: set.u}\n");
    std::string drive = read("drive.yaml");
    drive.replace(drive.find("connections"), 0, "  s: {block: WholeBodyToolbox/GetMeasurement}\n");
    drive += "record: [s, tau]\n";
    drive.replace(drive.find("WholeBodyToolbox/MujocoWorld"), 28,
                  "SharedMemory/Robot, period: 0.001, name: " + name);
    write("drive.yaml", drive);
    const auto both =
        shell("'" BF_PROGRAM "' serve arm.yaml --once --record world.mcap --shm " + name +
              " & '" BF_PROGRAM
              "' run drive.yaml --quiet --record run.mcap; code=$?; wait $!; exit $((code + $?))");
    EXPECT_EQ(both.code, 0) << both.err;
    const auto replayed = bf("replay run.mcap");
    EXPECT_EQ(replayed.code, 0) << replayed.err << "a measurement is an output of a device";
    EXPECT_NE(replayed.out.find("identical"), std::string::npos) << replayed.out;
    const auto of_server = bf("replay world.mcap");
    EXPECT_EQ(of_server.code, 1);
    EXPECT_NE(of_server.err.find("the recording is of a robot that was served (--shm " + name +
                                 "), and what its controllers commanded is not in it"),
              std::string::npos)
        << of_server.err;
    EXPECT_NE(both.err.find("  serves the robot '" + name + "' in shared memory\n"), std::string::npos)
        << both.err;
    EXPECT_NE(both.err.find("a controller has come\n"), std::string::npos) << both.err;
    EXPECT_NE(both.err.find("the controller has left; its joints hold\n"), std::string::npos) << both.err;
    EXPECT_NE(both.out.find("world.worst_age"), std::string::npos) << "the report has it: " << both.out;
}

/// The oracle is the world in the diagram.
TEST_F(Serve, LetsOneDiagramOrSeveralDriveAllRobotsOfAWorld) {
    write("two.xml", "<world step=\"0.001\"><robot name=\"left\" file=\"arm.urdf\" position=\"0 1 0\"/>"
                     "<robot name=\"right\" file=\"arm.urdf\" position=\"0 -1 0\"/></world>\n");
    const auto two = [&](const std::string& stop, const std::string& world, const std::string& law,
                         const std::vector<std::string>& sides) {
        std::string text =
                        "model: two\nplugins: [WholeBodyToolbox, SharedMemory]\nstep: 0.001\nstop: " + stop +
                        "\nblocks:\n",
                    record;
        if (world.empty()) text += "  world: {block: WholeBodyToolbox/World, file: two.xml}\n";
        for (const auto& side : sides) {
            text += "  " + side + ":\n    blocks:\n      robot: {block: " +
                    (world.empty() ? "WholeBodyToolbox/WorldRobot, robot: " + side
                                   : world + name + "." + side + ".robot") +
                    "}\n      its: {block: WholeBodyToolbox/Configuration, robot: arm.urdf, floating_base: "
                    "false}\n" +
                    law;
            record += (record.empty() ? "" : ", ") + side + ".s";
        }
        return text + (law.empty() ? "" : "record: [" + record + "]\n");
    };
    const std::string law =
                          "      s: {block: WholeBodyToolbox/GetMeasurement}\n"
                          "      u: {block: Sine, amplitude: 2, frequency: 9}\n"
                          "      set: {block: WholeBodyToolbox/SetReferences}\n    connections: {u: set.u}\n",
                      robot = "SharedMemory/Robot, period: 0.001, name: ";
    write("served.yaml", two("Inf", "", "", {"left", "right"}));
    write("direct.yaml", two("0.02", "", law, {"left", "right"}));
    write("both.yaml", two("0.02", robot, law, {"left", "right"}));
    write("left.yaml", two("0.01", robot, law, {"left"}));
    write("right.yaml", two("0.02", robot, law, {"right"}));
    const std::string serve = "'" BF_PROGRAM "' serve served.yaml --once --shm " + name + " & ",
                      run = "timeout 60 '" BF_PROGRAM "' run --quiet ";
    const auto one = shell(run + "direct.yaml --record direct.mcap; " + serve + run +
                           "both.yaml --record both.mcap; code=$?; wait $!; exit $((code + $?))");
    EXPECT_EQ(one.code, 0) << one.err;
    EXPECT_EQ(bf("export direct.mcap -o direct.csv").code, 0);
    EXPECT_EQ(bf("export both.mcap -o both.csv").code, 0);
    const auto column = [&](const std::string& file, const std::string& signal) {
        std::istringstream lines(read(file));
        std::vector<std::string> values;
        int wanted = -1;
        for (std::string line; std::getline(lines, line);) {
            std::istringstream cells(line);
            int k = 0;
            for (std::string cell; std::getline(cells, cell, ','); ++k) {
                if (cell == signal) wanted = k;
                if (k == wanted) values.push_back(cell);
            }
        }
        return values;
    };
    for (const std::string signal : {"left.s (rad)", "right.s (rad)"}) {
        EXPECT_EQ(column("both.csv", signal), column("direct.csv", signal));
        EXPECT_EQ(column("both.csv", signal).size(), 21) << "a name and a number for each step";
    }
    const auto several =
        shell(serve + "server=$!; " + run + "left.yaml & left=$!; " + run +
              "right.yaml; code=$?; wait $left; code=$((code + $?)); wait $server; exit $((code + $?))");
    EXPECT_EQ(several.code, 0) << several.err << "whoever goes on does so without the one who has ended";
}

/// The controller of both lets one go behind the other, and the next one comes to both.
TEST_F(Serve, SeesThatAControllerOfTwoRobotsHasLeftBoth) {
    write("two.xml", "<world step=\"0.001\"><robot name=\"left\" file=\"arm.urdf\" position=\"0 1 0\"/>"
                     "<robot name=\"right\" file=\"arm.urdf\" position=\"0 -1 0\"/></world>\n");
    const auto both = [&](const std::string& rest, const std::function<std::string(std::string)>& robot) {
        std::string text = "model: two\nplugins: [WholeBodyToolbox, SharedMemory]\nstep: 0.001\n" + rest;
        for (const std::string side : {"left", "right"})
            text += "  " + side + ":\n    blocks:\n      robot: {block: " + robot(side) +
                    "}\n      its: {block: WholeBodyToolbox/Configuration, robot: arm.urdf, floating_base: "
                    "false}\n";
        return text;
    };
    write("served.yaml",
          both("blocks:\n  world: {block: WholeBodyToolbox/World, file: two.xml}\n",
               [](const std::string& side) { return "WholeBodyToolbox/WorldRobot, robot: " + side; }));
    write("both.yaml", both("stop: 0.01\nblocks:\n", [&](const std::string& side) {
              return "SharedMemory/Robot, period: 0.001, name: " + name + "." + side + ".robot";
          }));
    const std::string run = "timeout 60 '" BF_PROGRAM "' run --quiet both.yaml";
    const auto twice = shell("'" BF_PROGRAM "' serve served.yaml --shm " + name + " & server=$!; " + run +
                             " && sleep 0.3 && " + run +
                             "; code=$?; sleep 0.3; kill -INT $server; wait $server; exit $code");
    EXPECT_EQ(twice.code, 0) << twice.err;
    EXPECT_EQ(twice.err.find("has died"), std::string::npos) << twice.err;
    for (const std::string side : {"left", "right"}) {
        std::string expected;
        for (const char* what : {"a controller has come", "the controller has left; its joints hold",
                                 "a controller has come", "the controller has left; its joints hold"})
            expected += std::string(what) + "\n";
        std::istringstream lines(twice.err);
        std::string told;
        const std::string start = "  robot '" + name + "." + side + ".robot' in shared memory: ";
        for (std::string line; std::getline(lines, line);)
            if (line.starts_with(start)) told += line.substr(start.size()) + "\n";
        EXPECT_EQ(told, expected) << side;
    }
}

TEST_F(Serve, IsWaitedForUntilCtrlC) {
    const auto drive = [&](const std::string& plugin, const std::string& settings) {
        write("drive.yaml", "model: arm\nplugins: [WholeBodyToolbox, " + plugin +
                                "]\nstep: 0.001\nstop: 1000\nblocks:\n"
                                "  robot: {block: WholeBodyToolbox/Configuration, robot: arm.urdf, "
                                "floating_base: false}\n  world: {block: " +
                                plugin + "/Robot, period: 0.001, timeout: 600, start_timeout: 600, " +
                                settings + "}\n");
    };
    const auto run = [&](const std::string& options, const std::string& when) {
        const auto ended = shell("'" BF_PROGRAM "' run drive.yaml --quiet --summary run.json " + options +
                                 " 2> run.err & run=$!; " + when + "; kill -INT $run; wait $run");
        EXPECT_EQ(ended.code, 130) << options << read("run.err");
        EXPECT_CONTAINS(read("run.err"), "interrupted\n");
        EXPECT_EQ(json("run.json")["outcome"], "interrupted");
    };
    write("robot.key", "0123456789abcdef\n");
    std::filesystem::permissions(folder / "robot.key", std::filesystem::perms::owner_read);
    const auto until = [](const std::string& text, const std::string& file) {
        return "for k in $(seq 600); do grep -q '" + text + "' " + file + " && break; sleep 0.05; done";
    };
    const std::string is_waiting = until("waits for", "run.err");
    for (const std::string options : {"", "--realtime --priority 0 --record run.mcap"}) {
        drive("SharedMemory", "name: nobody-" + name);
        run(options, is_waiting);
        drive("Udp", "address: \"'" + std::to_string(20'000 + getpid() % 10'000) + "'\", key: robot.key");
        run(options, is_waiting);
    }
    drive("SharedMemory", "name: " + name);
    const auto served =
        shell("'" BF_PROGRAM "' serve arm.yaml --stop Inf --shm " + name +
              " 2> served.err & server=$!; '" BF_PROGRAM "' run drive.yaml --quiet & run=$!; " +
              until("has come", "served.err") +
              "; kill -STOP $server; sleep 0.3; kill -INT $run; wait $run; code=$?; kill -KILL $server; "
              "exit $code");
    EXPECT_EQ(served.code, 130) << served.err;
    EXPECT_CONTAINS(served.err, " s: interrupted\n");
}

TEST_F(Serve, LetsWhoeverHasTheKeyDriveItOverUdp) {
    const std::string port = std::to_string(20'000 + getpid() % 10'000);
    const auto driving = [&](const std::string& key) {
        write("drive.yaml",
              "model: arm\nplugins: [WholeBodyToolbox, Udp]\nstep: 0.001\nstop: 0.01\nblocks:\n"
              "  robot: {block: WholeBodyToolbox/Configuration, robot: arm.urdf, floating_base: false}\n"
              "  world: {block: Udp/Robot, period: 0.001, start_timeout: 2, address: \"'" +
                  port + "'\", key: \"'" + key +
                  "'\"}\n"
                  "  tau: {block: Constant, value: 0.5}\n  set: {block: WholeBodyToolbox/SetReferences}\n"
                  "connections: {tau: set.u}\n");
        return "'" BF_PROGRAM "' run drive.yaml --quiet";
    };
    write("other.key", "0123456789abcdef\n");
    const std::string serve = "chmod 600 other.key; '" BF_PROGRAM "' serve arm.yaml --once --udp " + port +
                              " --key good.key & while [ ! -s good.key ]; do sleep 0.05; done; ";
    const auto both = shell(serve + driving("good.key") + "; code=$?; wait $!; exit $((code + $?))");
    EXPECT_EQ(both.code, 0) << both.err;
    EXPECT_NE(both.err.find("  serves the robot at " + port + " (UDP)\n"), std::string::npos) << both.err;
    EXPECT_NE(both.err.find("the controller has left; its joints hold\n"), std::string::npos) << both.err;
    EXPECT_EQ(both.err.find("left out a datagram"), std::string::npos) << both.err;
    EXPECT_NE(both.out.find("world.worst_age"), std::string::npos) << both.out;
    const auto other = shell(serve + driving("other.key") + "; code=$?; kill $!; wait $!; exit $code");
    EXPECT_EQ(other.code, 1) << other.err;
    EXPECT_NE(other.err.find("nobody answers within 2 s"), std::string::npos) << other.err;
    EXPECT_NE(other.err.find("(UDP): left out a datagram that has another key"), std::string::npos)
        << other.err;
}

TEST_F(Serve, RefusesWhatCannotBeServed) {
    const auto refused = [&](const std::string& arguments, int code, const std::string& text) {
        const auto outcome = bf("serve " + arguments, "timeout 60");
        EXPECT_EQ(outcome.code, code) << arguments;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
    };
    model("driven.yaml",
          "  tau: {block: Constant, value: 0.5}\n  set: {block: WholeBodyToolbox/SetReferences}\n"
          "connections: {tau: set.u}\n");
    refused("driven.yaml --shm " + name, 1,
            "set drives the robot 'world', which can have one controller alone; serve a model without it");
    model("wired.yaml", "  tau: {block: Constant, value: 0.5}\nconnections: {tau: world.tau}\n");
    refused("wired.yaml --shm " + name, 1, "world.tau drives the robot 'world'");
    write("none.yaml", "model: none\nstep: 1\nblocks: {c: {block: Constant}}\n");
    refused("none.yaml --shm " + name, 1,
            "none.yaml has no robot to serve; give it a MujocoWorld, or a WorldRobot in a World");
    refused("arm.yaml --shm a/b", 2, "the robot's name is 'a/b'; write up to 100 letters");
    refused("arm.yaml", 2, "--shm");
    refused("arm.yaml --yarp a/b", 2, "the robot's name is 'a/b'; write letters, digits, _ and -");
    refused("arm.yaml --board x=y --shm " + name, 2, "--board requires --yarp");
    refused("arm.yaml --silence 1 --shm " + name, 2, "--silence requires --realtime");
    refused("arm.yaml --udp 9000", 2, "--key");
    refused("arm.yaml --udp here --key k", 2, "'here' is no address; write PORT, or HOST:PORT");
    refused("arm.yaml --udp 9000 --key k --shm " + name, 2, "--udp");
    refused("arm.yaml --ros1 arm", 2, "write a namespace that begins with /, such as / or /icub");
    refused("arm.yaml --ros2 arm", 2, "write a namespace that begins with /, such as / or /icub");
    refused("arm.yaml --on-loss fall --shm " + name, 2, "--on-loss");
    const auto second =
        shell("'" BF_PROGRAM "' serve arm.yaml --quiet --stop 1 --realtime --priority 0 --shm " + name +
              " & sleep 0.4; '" BF_PROGRAM "' serve arm.yaml --shm " + name + "; code=$?; wait; exit $code");
    EXPECT_EQ(second.code, 1);
    EXPECT_NE(second.err.find("another program serves a robot of that name; end it, or choose another name"),
              std::string::npos)
        << second.err;
}

TEST_F(Serve, IsInterruptedWhileItWaits) {
    const auto ended = shell("'" BF_PROGRAM "' serve arm.yaml --shm " + name +
                             " & one=$!; sleep 0.5; kill -TERM $one; wait $one");
    EXPECT_EQ(ended.code, 143) << ended.err;
}

} // namespace bf::tools
