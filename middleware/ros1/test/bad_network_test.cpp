// ROS 1 over a network that loses 10 % of the packets and delays the others by 0 to 10 ms: the master and the
// diagram are on this side, the robot's server on the other one.
#include "bad_network.hpp"
#include "master.hpp"
#include "running.hpp"
#include "served.hpp"

#include <optional>
#include <sstream>

namespace bf::ros1::test {
namespace {

using middleware::now;
using middleware::test::diagram;
using middleware::test::icub;
using middleware::test::icub_world;
using toolbox::test::expect_contains;

class Ros1BadNetwork : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!has_master()) GTEST_SKIP() << "there is no rosmaster";
        // Programs that are started by this thread are in its network; other threads stay in theirs.
        if (!middleware::test::enter_network_of_our_own()) GTEST_SKIP() << "this system has no networks";
        way.emplace(middleware::test::BadWays{});
        if (!way->is_there()) GTEST_SKIP() << "this system has no tunnels";
        constexpr int port = 11311;
        master_.emplace(master_at(port),
                        middleware::test::ProgramOptions{.variables = variables("10.77.0.1")});
        ASSERT_TRUE(waits_for_answers(port)) << "rosmaster does not start";
    }
    void TearDown() override {
        master_.reset();
        way.reset();
        setns(before_, CLONE_NEWNET);
        close(before_);
    }
    Program serve(const std::string& options) const {
        return Program(said(std::string(BF_PROGRAM) + " serve " +
                            folder.write("leg.yaml", diagram(icub + icub_world)) + " --ros1 /icub " +
                            options),
                       {.variables = variables("10.77.0.2"), .network = way->network()});
    }
    /// The knee's last position is printed at the end.
    std::string model(const std::string& name, const std::string& robot, const std::string& references,
                      const std::string& mode) const {
        return folder.write(
            name,
            diagram(icub + robot + "  c: {block: " + references +
                        "}\n  drive: {block: WholeBodyToolbox/SetReferences, control_type: " + mode +
                        "}\n  knee: {block: Selector, indices: 2}\n  final: {block: Check, kind: final}\n",
                    "  c: drive\n  world.s: knee\n  knee: final\n",
                    robot.find("Ros1") == robot.npos ? "" : "Ros1"));
    }
    Program run(const std::string& model, const std::string& options) const {
        return Program(said(std::string(BF_PROGRAM) + " run " + model + " --quiet " + options),
                       {.variables = variables("10.77.0.1")});
    }
    static std::string robot(const std::string& settings) {
        return "  world: {block: Ros1/Robot, period: 0.001, namespace: /icub, start_timeout: 60" + settings +
               "}\n";
    }
    static std::string until_its_end(Program& program) {
        std::string all;
        for (std::string line; !(line = program.line()).empty();) all += line + "\n";
        return all;
    }
    /// Of what such a model prints.
    static double final_of(const std::string& said) {
        double value = std::nan("");
        const auto at = said.find("final ");
        EXPECT_NE(at, said.npos) << said;
        EXPECT_EQ(said.find("bf: "), said.npos) << said; // it has come to its end
        if (at != said.npos) std::istringstream(said.substr(at + 6)) >> value;
        return value;
    }
    std::optional<middleware::test::BadNetwork> way;
    const Folder folder;

  private:
    static std::map<std::string, std::string> variables(const std::string& address) {
        return {{"ROS_MASTER_URI", "http://10.77.0.1:11311"},
                {"ROS_IP", address},
                {"BLOCKFACTORY_PLUGIN_PATH", BF_PLUGIN_DIRECTORY}};
    }
    static std::vector<std::string> said(const std::string& command) {
        return {"/bin/sh", "-c", "exec " + command + " 2>&1"};
    }
    const int before_ = open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
    std::optional<Program> master_;
};

} // namespace

TEST_F(Ros1BadNetwork, LeadsARobotToItsTarget) {
    const Program served = serve("--realtime --priority 0 --overrun skip --silence 30 --watchdog 0");
    Program led = run(model("drives.yaml", robot(", silence: 30, timeout: 10"),
                            "Constant, value: [0.1 -0.5 0.05]", "Position Direct"),
                      "--stop 3");
    EXPECT_NEAR(final_of(until_its_end(led)), -0.5, 0.02);
    EXPECT_GT(way->lost(), 50);
    EXPECT_GT(way->carried(), 500);
}

/// Each state is of its time, and each command has come before the robot goes on. The oracle is the same
/// diagram with a world of its own.
TEST_F(Ros1BadNetwork, IsLedInLockstepToTheSameNumbers) {
    const Program served = serve("");
    const std::string sine = "Sine, amplitude: [3 -2 1], frequency: 40, phase: 0.4";
    Program direct = run(model("direct.yaml", icub_world, sine, "Torque"), "--stop 0.05"),
            led = run(model("led.yaml", robot(", timeout: 20, step_size: 0.001"), sine, "Torque"),
                      "--stop 0.05");
    const double expected = final_of(until_its_end(direct));
    EXPECT_GT(std::abs(expected), 0.01) << "it moves";
    EXPECT_EQ(final_of(until_its_end(led)), expected);
    EXPECT_GT(way->lost(), 10);
}

TEST_F(Ros1BadNetwork, EndsARunThatIsCutOffAndHoldsItsJoints) {
    Program served = serve("--realtime --priority 0 --overrun skip --silence 4 --watchdog 0");
    Program led =
        run(model("drives.yaml", robot(", silence: 10, timeout: 5"), "Constant, value: [0 -1 0]", "Torque"),
            "--stop Inf");
    std::string line;
    while (line.find("a controller has come") == line.npos) ASSERT_NE(line = served.line(), "");
    sleep(1);
    way->is_cut = true;
    const double cut = now();
    expect_contains(until_its_end(led), "ROS 1 robot in the namespace /icub: no state for ");
    EXPECT_LT(now() - cut, 60);
    expect_contains(served.line(), "no command for 4 s; its joints hold");
}

} // namespace bf::ros1::test
