// Robots of ROS 1 that die, begin again, stall, flood, send what is none, and whose time goes back.
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
