// A robot behind topics, which is a program of rospy.
#include "bf/core/interrupt.hpp"
#include "cycles.hpp"
#include "heap.hpp"
#include "master.hpp"
#include "running.hpp"

#include <functional>

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

using Ros1Robot = WithMaster;

std::string driving(const std::string& settings, const std::string& blocks = "",
                    const std::string& connections = "") {
    return "model: m\nplugins: [Ros1, WholeBodyToolbox]\nstep: 0.005\nblocks:\n  world: {block: Ros1/Robot, "
           "period: 0.005, joints: \"{'hip', 'knee'}\"" +
           std::string(settings.find("start_timeout") == std::string::npos ? ", start_timeout: 20" : "") +
           settings + "}\n" + blocks + (connections.empty() ? "" : "connections:\n" + connections);
}
std::string references(const std::string& mode, double hip, double knee) {
    return "  c: {block: Constant, value: [" + std::to_string(hip) + " " + std::to_string(knee) +
           "]}\n  drive: {block: WholeBodyToolbox/SetReferences, control_type: " + mode + "}\n";
}
} // namespace

TEST_F(Ros1Robot, IsDrivenInEachModeAndLetGo) {
    Peer peer({"robot", "/icub", "hip", "knee"});
    ASSERT_EQ(peer.line(), "ready");
    for (const auto& [mode, hip, knee] :
         std::vector<std::tuple<std::string, double, double>>{{"Torque", 0.5, -0.25},
                                                              {"Velocity", 0.5, -0.25},
                                                              {"Position Direct", 0.5, -0.25},
                                                              {"Position", 0.1, 0}}) {
        Running run(driving(", namespace: /icub", references(mode, hip, knee), "  c: drive\n"));
        const Eigen::Vector2d wanted(hip, knee);
        const auto is_there = [&, mode = mode] {
            const Matrix s = run.get("world.s"), s_dot = run.get("world.s_dot");
            if (mode == "Torque") return s_dot(0) > 0.2 && s_dot(1) < -0.1;
            return ((mode == "Velocity" ? s_dot : s) - Matrix(wanted)).norm() < 1e-9;
        };
        ASSERT_TRUE(steps_until(run, is_there)) << mode << ": " << run.simulation.failure();
        EXPECT_LT(run.scalar("world.age"), 1);
        run.simulation.stop();
        if (mode == "Torque" || mode == "Velocity") {
            EXPECT_EQ(peer.line(), "let go") << mode;
        }
    }
    EXPECT_EQ(peer.line(), "way 2.291831181") << "0.4 rad at 10 degrees per second";
}

/// `rosnode kill` leaves no actuator moving.
TEST_F(Ros1Robot, IsLetGoWhereTheNodeIsAskedToEnd) {
    Peer peer({"robot", "/killed", "hip", "knee"});
    ASSERT_EQ(peer.line(), "ready");
    Peer commands({"echo", "std_msgs/Float64MultiArray", "/killed/effort_controller/command", "1"});
    ASSERT_EQ(commands.line(), "ready");
    const Folder folder;
    Program run({BF_PROGRAM, "run",
                 folder.write("m.yaml", driving(", node: killed, namespace: /killed",
                                                references("Torque", 0.5, -0.25), "  c: drive\n")),
                 "--realtime", "--priority", "0", "--stop", "60", "--quiet"},
                {.variables = {{"BLOCKFACTORY_PLUGIN_PATH", BF_PLUGIN_DIRECTORY}}});
    expect_contains(commands.line(), "0.5");
    Peer({"kill", "/killed"}).line();
    EXPECT_EQ(peer.line(), "let go");
    EXPECT_EQ(run.end(0), 130);
}

TEST_F(Ros1Robot, HasSensorsAndItsOwnTime) {
    Peer peer({"robot", "/lab", "hip", "knee"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(
        driving(", namespace: /lab, use_stamps: true, wrenches: \"{'foot=foot'}\", imus: \"{'base=imu'}\"",
                "  foot: {block: WholeBodyToolbox/GetSensor, kind: wrench, sensor: foot}\n"
                "  imu: {block: WholeBodyToolbox/GetSensor, kind: imu, sensor: base}\n"));
    ASSERT_TRUE(steps_until(run, [&] { return run.get("foot")(2) != 0 && run.get("imu")(2) != 0; }))
        << run.simulation.failure();
    EXPECT_EQ(run.get("foot"), Matrix((Eigen::VectorXd(6) << 0, 0, 300, 2, 0, 0).finished()));
    const Matrix imu = run.get("imu");
    EXPECT_NEAR(imu(2), M_PI / 2, 1e-12) << "yaw";
    EXPECT_EQ(imu(5), 9.81);
    EXPECT_EQ(imu(7), -1);
    EXPECT_NEAR(std::remainder(run.scalar("world.time"), 0.002), 0, 1e-9) << "that of the headers";
}

TEST_F(Ros1Robot, HasTheTimeOfItsOwnJointsWhichDoesNotGoBack) {
    const auto tells = [](const std::string& joint, const std::string& seconds) {
        return Peer({"send", "sensor_msgs/JointState", "/times/joint_states", "200",
                     "m.name=['" + joint + "']; m.position=m.velocity=[0.1]; m.header.stamp=rospy.Time(" +
                         seconds + "+k//200, k%200*5000000)"});
    };
    Peer first = tells("hip", "100"), second = tells("knee", "50"), other = tells("elbow", "1000");
    for (auto* peer : {&first, &second, &other}) ASSERT_EQ(peer->line(), "ready");
    Running run(driving(", namespace: /times, use_stamps: true"));
    double last = 0;
    for (int k = 0; k < 100; ++k, usleep(1000)) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_GE(run.scalar("world.time"), last);
        last = run.scalar("world.time");
        ASSERT_LT(last, 500);
    }
    EXPECT_GE(last, 100);
}

TEST_F(Ros1Robot, CostsTheStepNoHeap) {
    Peer peer({"robot", "/quick", "hip", "knee"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(driving(", namespace: /quick", references("Velocity", 0.1, 0.1), "  c: drive\n"));
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    }
    const long before = bf::test::heap_calls();
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    }
    EXPECT_EQ(bf::test::heap_calls(), before);
    peer.end();
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(), "ROS 1 robot in the namespace /quick");
}

TEST_F(Ros1Robot, LeavesNothingBehindHoweverOftenItStarts) {
    Peer peer({"robot", "/cycles", "hip", "knee"});
    ASSERT_EQ(peer.line(), "ready");
    middleware::test::expect_no_leak([] {
        Running run(driving(", namespace: /cycles", references("Velocity", 0.1, 0.1), "  c: drive\n"));
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
    });
}

TEST_F(Ros1Robot, HasVelocitiesOnlyWhereAllJointsTellThem) {
    Peer hip({"send", "sensor_msgs/JointState", "/some/joint_states", "100",
              "m.name=['hip']; m.position=[0.5]; m.velocity=[0.25]"});
    Peer knee({"send", "sensor_msgs/JointState", "/some/joint_states", "100",
               "m.name=['knee']; m.position=[-0.5]"});
    ASSERT_EQ(hip.line(), "ready");
    ASSERT_EQ(knee.line(), "ready");
    Running run(driving(", namespace: /some"));
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(), "it measures no joint velocities");
}

TEST_F(Ros1Robot, TellsNotWhatWasWrongInARunBefore) {
    Peer robot({"robot", "/again", "hip", "knee"});
    ASSERT_EQ(robot.line(), "ready");
    Running run(driving(", start_timeout: 10, namespace: /again"));
    run.simulation.stop();
    robot.end();
    const auto why = [&]() -> std::string {
        try {
            run.simulation.start();
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    };
    {
        Peer other({"send", "std_msgs/String", "/again/joint_states", "100", "m.data='x'"});
        ASSERT_EQ(other.line(), "ready");
        expect_contains(why(), "sends std_msgs/String");
    }
    expect_contains(why(), "no message came on the topic 'joint_states'");
}

TEST_F(Ros1Robot, SaysThatItsStartIsInterrupted) {
    static const volatile std::sig_atomic_t flag = SIGINT;
    look_for_interrupt(&flag);
    const std::string why = refusal(driving(", namespace: /nobody"));
    look_for_interrupt(nullptr);
    EXPECT_TRUE(why.ends_with(interrupted)) << why;
}

TEST_F(Ros1Robot, IsRefusedWhereItIsNotThereOrAnother) {
    expect_contains(refusal(driving(", start_timeout: 3, namespace: /nobody")),
                    "no message came on the topic 'joint_states' within 2.4 s; start the robot, or correct "
                    "namespace and states");
    Peer peer({"robot", "/small", "hip"});
    ASSERT_EQ(peer.line(), "ready");
    const std::string why = refusal_with("tells nothing of knee", driving(", namespace: /small"));
    expect_contains(why, "the topic 'joint_states' tells nothing of knee within ");
    expect_contains(why, " s; it has hip");
    Peer other({"send", "std_msgs/String", "/other/joint_states", "100", "m.data='x'"});
    ASSERT_EQ(other.line(), "ready");
    expect_refusal_with(
        "sends std_msgs/String (992ce8a1687cec8c8bd883ec73ca41d1), not sensor_msgs/JointState",
        driving(", namespace: /other"));
    expect_contains(refusal(driving(", imus: \"{'a'}\"")), "the sensor 'a' is not given as name=topic");
}

} // namespace bf::ros1::test
