// ROS 2 over networks that lose, delay and turn round packets, and programs that flood, stall and begin
// again.
#include "bad_network.hpp"
#include "models.hpp"
#include "peer.hpp"
#include "served.hpp"

#include <map>
#include <optional>
#include <sstream>

namespace bf::ros2::test {
namespace {

/// 10 % of the packets are lost, and the others take from 0 to 10 ms.
class Ros2BadNetwork : public Alone {
  protected:
    void SetUp() override {
        Alone::SetUp(); // from here on nobody else is in this network
        if (IsSkipped()) return;
        if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
        way.emplace(middleware::test::BadWays{});
        if (!way->is_there()) GTEST_SKIP() << "this system has no tunnels";
    }
    std::optional<middleware::test::BadNetwork> way;
    const Folder folder;
};

/// What programs in both networks do to hear each other.
constexpr const char* far_too = "ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET";

/// A model as a program of its own: libraries of ROS 2 choose their networks once in each.
class Ran {
  public:
    explicit Ran(const std::string& model, const std::string& options = "")
        : program_({"/usr/bin/env", far_too, "/bin/sh", "-c",
                    "exec " BF_PROGRAM " run " + model + " --quiet " + options + " 2>&1"}) {}
    /// Its checks by their names, as it prints them when it has ended; false: there is none.
    bool ends(std::map<std::string, double>& checks) {
        for (std::string line; !(line = program_.line()).empty();) {
            said += line + "\n";
            std::istringstream words(line);
            std::string name;
            double value = 0;
            if (words >> name >> value) checks[name] = value;
        }
        return !checks.empty();
    }
    std::string said;

  private:
    Program program_;
};

std::string heard(const std::string& name, const std::string& settings) {
    const std::string check = ": {block: Check, kind: ";
    return "  " + name + ": {block: Ros2/Subscribe, topic: /" + name + ", start_timeout: 30" + settings +
           "}\n  " + name + "_before: {block: UnitDelay}\n  " + name +
           "_change: {block: Sum, signs: '+-'}\n  " + name + "_back" + check +
           "minimum, from_time: 0.015}\n  " + name + "_first" + check + "minimum}\n  " + name + "_last" +
           check + "final}\n  " + name + "_had" + check + "minimum}\n  " + name + "_has" + check + "final}\n";
}
std::string wired(const std::string& name) {
    return "  " + name + ".data: [" + name + "_before, " + name + "_change.u1, " + name + "_first, " + name +
           "_last]\n  " + name + "_before: " + name + "_change.u2\n  " + name + "_change: " + name +
           "_back\n  " + name + ".received: [" + name + "_had, " + name + "_has]\n";
}

} // namespace

TEST_F(Ros2BadNetwork, LosesNothingReliableAndTurnsNothingRound) {
    Peer good({"send", "std_msgs/msg/Float64", "/good", "100", "m.data=float(k)", "1000"}, way->network()),
        fast({"send", "std_msgs/msg/Float64", "/fast", "100", "m.data=float(k)"}, way->network());
    ASSERT_EQ(good.line(), "ready");
    ASSERT_EQ(fast.line(), "ready");
    const std::string model = folder.write(
        "hears.yaml",
        "model: hears\nplugins: [Ros2]\nstep: 0.01\nstop: 5\nblocks:\n  node: {block: Ros2/Node}\n" +
            heard("good", ", depth: 1000") + heard("fast", ", reliability: best_effort") + "connections:\n" +
            wired("good") + wired("fast"));
    Ran ran(model, "--realtime --priority 0 --watchdog 0");
    std::map<std::string, double> checks;
    const bool has_run = ran.ends(checks);
    if (ran.said.find("no message of") != std::string::npos) GTEST_SKIP() << ran.said;
    ASSERT_TRUE(has_run) << ran.said;
    for (const std::string name : {"good", "fast"}) {
        EXPECT_GE(checks.at(name + "_back"), 0) << ran.said;
        const double sent = checks.at(name + "_last") - checks.at(name + "_first"),
                     came = checks.at(name + "_has") - checks.at(name + "_had");
        if (name == "good") {
            EXPECT_EQ(came, sent) << ran.said; // what is behind a loss waits until that is mended
        } else {
            EXPECT_GT(sent, 100) << ran.said;
            EXPECT_LT(came, 0.98 * sent) << ran.said;
            EXPECT_GT(came, 0.5 * sent) << ran.said;
        }
    }
    EXPECT_GT(way->lost(), 50);
    EXPECT_GT(way->carried(), 500);
}

TEST_F(Ros2BadNetwork, LeadsARobotToItsTarget) {
    using middleware::test::diagram, middleware::test::icub, middleware::test::icub_world;
    const std::string robot = folder.write("leg.yaml", diagram(icub + icub_world));
    Program served({"/usr/bin/env", far_too, BF_PROGRAM, "serve", robot, "--ros2", "/icub", "--realtime",
                    "--priority", "0", "--silence", "10", "--watchdog", "0", "--quiet"},
                   way->network());
    const std::string model = folder.write(
        "drives.yaml",
        diagram(icub + "  world: {block: Ros2/Robot, period: 0.01, namespace: /icub, start_timeout: 30, "
                       "silence: 10, timeout: 5}\n"
                       "  c: {block: Constant, value: [0.1 -0.5 0.05]}\n"
                       "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Position Direct}\n"
                       "  knee: {block: Selector, indices: 2}\n  final: {block: Check, kind: final}\n"
                       "  age: {block: Check, kind: maximum}\n",
                "  c: drive\n  world.s: knee\n  knee: final\n  world.age: age\n", "Ros2"));
    // Programs may find each other too late here, which is what they say then.
    for (int tries = 0; tries < 3; ++tries) {
        std::map<std::string, double> checks;
        Ran ran(model, "--stop 3");
        const bool has_run = ran.ends(checks);
        if (!has_run || ran.said.find("it refuses the mode Position Direct") != std::string::npos) continue;
        EXPECT_NEAR(checks.at("final"), -0.5, 0.02) << ran.said;
        EXPECT_LT(checks.at("age"), 5) << ran.said;
        return;
    }
    GTEST_SKIP() << "they do not find each other in time";
}

using Ros2Faults = Alone;

TEST_F(Ros2Faults, AFloodLeavesTheNewestToTheSteps) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Peer flood({"send", "std_msgs/msg/Float64", "/x", "100000", "m.data=float(k)"});
    ASSERT_EQ(flood.line(), "ready");
    Running run(model("  s: {block: Ros2/Subscribe, topic: /x, start_timeout: 30}\n"));
    double last = -1;
    for (int k = 0; k < 100; ++k, usleep(10'000)) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_GE(run.scalar("s.data"), last);
        last = run.scalar("s.data");
    }
    EXPECT_GT(run.scalar("s.received"), 100) << "more than there are steps";
}

/// librcl and Fast DDS end the program there.
TEST_F(Ros2Faults, AMiddlewareAndADomainThatAreNotThereAreRefusedByNodesAlone) {
    const Folder folder;
    const std::string run = "run --stop 1 " + folder.write("node.yaml", model(""));
    const auto said = [](const std::string& variable, const std::string& verb) {
        Program program({"/bin/sh", "-c", variable + " exec " BF_PROGRAM " " + verb + " 2>&1"});
        std::string all;
        for (std::string line; !(line = program.line()).empty();) all += line + "\n";
        return all;
    };
    toolbox::test::expect_contains(
        said("RMW_IMPLEMENTATION=rmw_none_cpp", run),
        "node: RMW_IMPLEMENTATION asks for 'rmw_none_cpp', which ROS 2 does not have here; unset it");
    toolbox::test::expect_contains(said("RMW_IMPLEMENTATION=rmw_none_cpp", "describe Ros2/Subscribe"),
                                   "topic");
    toolbox::test::expect_contains(said("ROS_DOMAIN_ID=233", run),
                                   "node: ROS_DOMAIN_ID is 233; domains have numbers from 0 to 232");
}

TEST_F(Ros2Faults, AServerThatStallsEndsTheRunAndGoesOnWithTheNextOne) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const Folder folder;
    using middleware::test::diagram, middleware::test::icub, middleware::test::icub_world;
    Program served({BF_PROGRAM, "serve", folder.write("leg.yaml", diagram(icub + icub_world)), "--ros2",
                    "/icub", "--realtime", "--priority", "0", "--watchdog", "0", "--quiet"});
    const std::string text = diagram(
        icub +
            "  world: {block: Ros2/Robot, period: 0.001, namespace: /icub, start_timeout: 30, silence: 0}\n",
        "", "Ros2");
    {
        Running run(text);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        served.signal(SIGSTOP);
        while (run.step()) continue;
        toolbox::test::expect_contains(run.simulation.failure(), "no state for 1");
    }
    served.signal(SIGCONT);
    Running run(text);
    EXPECT_TRUE(run.step()) << run.simulation.failure();
}

/// By the clock it commands nothing then, and has come all the same.
TEST_F(Ros2Faults, AControllerWhoseFirstStepFailsEndsWhatServesARobotOnce) {
    const Folder folder;
    using middleware::test::diagram, middleware::test::icub, middleware::test::icub_world;
    Program served({BF_PROGRAM, "serve", folder.write("leg.yaml", diagram(icub + icub_world)), "--ros2",
                    "/icub", "--once", "--realtime", "--priority", "0", "--watchdog", "0", "--quiet"});
    {
        Running run(diagram(icub + "  world: {block: Ros2/Robot, period: 0.001, namespace: /icub, "
                                   "start_timeout: 30, silence: 0}\n"
                                   "  zero: {block: Constant, value: 0}\n  must: {block: Assertion}\n"
                                   "  drive: {block: WholeBodyToolbox/SetReferences}\n"
                                   "  c: {block: Constant, value: [0 0 0]}\n",
                            "  zero: must\n  c: drive\n", "Ros2"));
        EXPECT_FALSE(run.step());
        toolbox::test::expect_contains(run.simulation.failure(), "does not hold");
    }
    while (!served.line().empty()) continue; // until it has ended
    EXPECT_EQ(served.end(), 0);
}

} // namespace bf::ros2::test
