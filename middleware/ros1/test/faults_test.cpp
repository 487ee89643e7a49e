// Robots of ROS 1 that die, begin again, stall, flood, send what is none, and whose time goes back.
#include "bf/middleware/clock.hpp"
#include "master.hpp"
#include "running.hpp"

#include <csignal>

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

using Ros1Faults = WithMaster;

std::string led_by_velocities(const std::string& name_space, const std::string& settings = "") {
    return "model: m\nplugins: [Ros1, WholeBodyToolbox]\nstep: 0.005\nblocks:\n  world: {block: Ros1/Robot, "
           "period: 0.005, joints: \"{'hip', 'knee'}\", start_timeout: 20, namespace: " +
           name_space + settings +
           "}\n  c: {block: Constant, value: [0.1 -0.1]}\n  drive: {block: "
           "WholeBodyToolbox/SetReferences, control_type: Velocity}\nconnections: {c: drive}\n";
}
/// Until it does not go on any more.
std::string failure(Running& run) {
    for (int k = 0; k < 20'000 && run.step(); ++k) continue;
    return run.simulation.failure();
}

} // namespace

TEST_F(Ros1Faults, ARobotThatDiesOrStallsEndsTheRunAndTheNextOneGoesOn) {
    for (const bool is_killed : {true, false}) {
        const std::string name_space = is_killed ? "/dies" : "/stalls";
        auto robot = std::make_unique<Peer>(std::vector<std::string>{"robot", name_space, "hip", "knee"});
        ASSERT_EQ(robot->line(), "ready");
        {
            Running run(led_by_velocities(name_space));
            for (int k = 0; k < 20; ++k) {
                ASSERT_TRUE(run.step()) << run.simulation.failure();
            }
            if (is_killed)
                robot->end();
            else
                robot->signal(SIGSTOP);
            const std::string why = failure(run);
            expect_contains(why, "ROS 1 robot in the namespace " + name_space + ": no state for 1");
            expect_contains(why, "look whether it stands still, or raise timeout");
        }
        if (is_killed) {
            robot = std::make_unique<Peer>(std::vector<std::string>{"robot", name_space, "hip", "knee"});
            ASSERT_EQ(robot->line(), "ready");
        } else {
            robot->signal(SIGCONT);
        }
        Running run(led_by_velocities(name_space));
        EXPECT_TRUE(steps_until(run, [&] { return run.get("world.s_dot")(0) == 0.1; }))
            << run.simulation.failure();
    }
}

/// What ends tells the master so.
TEST_F(Ros1Faults, AMasterThatHasStoppedAnsweringHoldsUpNoEnd) {
    const Folder folder;
    const std::string recording = folder.path / "r.mcap";
    Program run(
        {BF_PROGRAM, "run",
         folder.write("m.yaml", "model: m\nplugins: [Ros1]\nstep: 0.01\nblocks:\n  node: {block: Ros1/Node}\n"
                                "  c: {block: Constant, value: 1}\n  p: {block: Ros1/Publish, topic: a}\n"
                                "  q: {block: Ros1/Publish, topic: b}\nconnections: {c: [p, q]}\n"),
         "--realtime", "--priority", "0", "--stop", "3", "--quiet", "--record", recording},
        {.variables = {{"BLOCKFACTORY_PLUGIN_PATH", BF_PLUGIN_DIRECTORY}}});
    for (int tries = 0; tries < 3000 && access(recording.c_str(), R_OK) != 0; ++tries) usleep(10'000);
    sleep(1);
    master->signal(SIGSTOP);
    const auto begin = middleware::now();
    while (!run.line().empty()) continue; // until it has ended
    EXPECT_LT(middleware::now() - begin, 30);
    EXPECT_EQ(run.end(0), 0);
}

/// roscpp itself ends the program there.
TEST_F(Ros1Faults, AnAddressOfTheMasterThatIsNoneIsRefused) {
    const std::string right = std::getenv("ROS_MASTER_URI");
    for (const std::string wrong : {"", "junk", "https://localhost:11311", "http://localhost",
                                    "http://localhost:99999", "http://[::1]:11311"}) {
        setenv("ROS_MASTER_URI", wrong.c_str(), 1);
        expect_contains(
            refusal("model: m\nplugins: [Ros1]\nstep: 0.01\nblocks:\n  node: {block: Ros1/Node}\n"),
            "node: ROS_MASTER_URI is '" + wrong + "'; write it as http://localhost:11311");
    }
    setenv("ROS_MASTER_URI", right.c_str(), 1);
}

TEST_F(Ros1Faults, AMeasurementThatIsGoneAndATimeThatJumpsAheadEndTheRun) {
    const std::string numbers = "m.name=['hip','knee']; m.position=[0.1]*2; m.velocity=[0.1]*2; "
                                "m.header.stamp=rospy.Time(100+k//200, k%200*5000000); ";
    int number = 0;
    for (const auto& [changes, why] : std::vector<std::pair<std::string, std::string>>{
             {"m.velocity=m.velocity if k<1500 else []", "it tells no velocity of 'knee' any more"},
             {"m.velocity[1]=0.1 if k<1500 else float('inf')", "the velocity of 'knee' is inf"},
             {"m.header.stamp.secs+=0 if k<1500 else 1000", "its time jumped ahead from t = 10"}}) {
        const std::string name_space = "/gone" + std::to_string(++number);
        Peer robot(
            {"send", "sensor_msgs/JointState", name_space + "/joint_states", "200", numbers + changes});
        ASSERT_EQ(robot.line(), "ready");
        Running run("model: m\nplugins: [Ros1, WholeBodyToolbox]\nstep: 0.005\nblocks:\n  world: {block: "
                    "Ros1/Robot, period: 0.005, joints: \"{'hip', 'knee'}\", start_timeout: 20, use_stamps: "
                    "true, silence: 10, namespace: " +
                    name_space + "}\n");
        expect_contains(failure(run), why);
    }
}

TEST_F(Ros1Faults, ARobotThatAnotherNodeDrivesIsRefusedUntilThatEnds) {
    Peer robot({"robot", "/torn", "hip", "knee"});
    ASSERT_EQ(robot.line(), "ready");
    Peer other({"send", "std_msgs/Float64MultiArray", "/torn/velocity_controller/command", "50",
                "m.data=[0.0,0.0]"});
    ASSERT_EQ(other.line(), "ready");
    const std::string model = led_by_velocities("/torn");
    const std::string why = refusal_with("the node '/peer_", model);
    expect_contains(why, "the node '/peer_");
    expect_contains(why, "' sends commands to it; end it first");
    other.end(); // by force: the master still knows it
    Running run(model);
    EXPECT_TRUE(run.step()) << run.simulation.failure();
}

TEST_F(Ros1Faults, AFloodLeavesTheNewestStateToTheSteps) {
    Peer flood({"send", "sensor_msgs/JointState", "/flood/joint_states", "100000",
                "m.name=['hip','knee']; m.position=m.velocity=[float(k),float(k)]"});
    ASSERT_EQ(flood.line(), "ready");
    Running run(led_by_velocities("/flood", ", velocity: nobody/commands"));
    double last = 0;
    for (int k = 0; k < 100; ++k) {
        if (!run.step()) break;
        const Matrix s = run.get("world.s");
        ASSERT_GE(s(0), last);
        ASSERT_EQ(s, run.get("world.s_dot")) << "of one message";
        last = s(0);
    }
    EXPECT_GT(last, 100);
}
} // namespace bf::ros1::test
