// Messages of any type, to and from programs of ROS 2 that are not ours.
#include "cycles.hpp"
#include "heap.hpp"
#include "messages.hpp"
#include "models.hpp"
#include "node.hpp"
#include "peer.hpp"
#include "told.hpp"

namespace bf::ros2::test {
namespace {

std::string publish(const std::string& settings) { return "  p: {block: Ros2/Publish" + settings + "}\n"; }
std::string subscribe(const std::string& settings) {
    return "  s: {block: Ros2/Subscribe" + settings + "}\n";
}

} // namespace

using Ros2Topics = Alone;
using Ros2Streams = Alone;
using Ros2Calls = Alone;

TEST_F(Ros2Calls, AreAnsweredByRclpyOnceForEachEdge) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(model("  c: {block: Ros2/Call, service: /lab/pause, type: std_srvs/srv/SetBool}\n",
                      "u: c.call, v: c.data", "u: {}, v: {}"));
    run.set("u", 1).set("v", 1);
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.scalar("c.pending"), 1) << "it waits until somebody offers the service";
    }
    Peer peer({"offer", "/lab/pause", "std_srvs/srv/SetBool", "a.success = r.data and k < 3"});
    ASSERT_EQ(peer.line(), "ready");
    const auto answered = [&] { return run.scalar("c.pending") == 0; };
    ASSERT_TRUE(steps_until(run, answered)) << run.simulation.failure();
    EXPECT_EQ(run.scalar("c.success"), 1);
    EXPECT_EQ(run.scalar("c.answered"), 1);
    for (const auto& [value, success] : {std::pair(0, 0), {1, 0}}) {
        run.set("u", 0);
        ASSERT_TRUE(run.step());
        run.set("u", 2).set("v", value);
        ASSERT_TRUE(run.step());
        ASSERT_TRUE(steps_until(run, answered)) << run.simulation.failure();
        EXPECT_EQ(run.scalar("c.success"), success);
    }
    for (int k = 0; k < 100; ++k, usleep(1000)) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(run.scalar("c.answered"), 3) << "a call that stays positive is one";
}

TEST_F(Ros2Calls, HaveTextsAndListsOfAnyLength) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const auto types = [](const std::string& size) {
        return model("  c: {block: Ros2/Call, service: /peer/get_parameter_types, type: "
                     "rcl_interfaces/srv/GetParameterTypes, texts: "
                     "\"{'names=use_sim_time,start_type_description_service'}\", sizes: "
                     "\"{'types=" +
                         size + "'}\"}\n",
                     "u: c.call", "u: {}");
    };
    Peer peer({"echo", "std_msgs/msg/Float64", "nothing", "1"}); // each node of rclpy offers it
    ASSERT_EQ(peer.line(), "ready");
    Running run(types("3"));
    run.set("u", 1);
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("c.answered") == 1; })) << run.simulation.failure();
    EXPECT_EQ(run.get("c.types"), Matrix(Eigen::Vector3d(1, 1, 0))) << "two booleans";
    EXPECT_EQ(run.scalar("c.types_length"), 2);
    Running small(types("1"));
    small.set("u", 1);
    EXPECT_FALSE(steps_until(small, [] { return false; }));
    expect_contains(
        small.simulation.failure(),
        "c: a message has 2 elements in 'types', but at most 1 are expected; raise argument 'sizes'");
}

TEST_F(Ros2Calls, CostTheStepNoHeapAndEndItWithoutAnAnswer) {
    Running run(model("  c: {block: Ros2/Call, service: /lab/nobody, timeout: 0.5}\n", "u: c.call", "u: {}"));
    for (int k = 0; k < 50; ++k, usleep(1000)) {
        run.set("u", k % 2);
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (bf::test::heap_is_counted() && k > 0) {
            ASSERT_EQ(bf::test::heap_calls(), before);
        }
    }
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(), "c: the service has not answered within argument 'timeout'");
}

TEST_F(Ros2Calls, RefuseWhatServicesCannotBe) {
    const auto wrong = [](const std::string& settings) {
        return refusal(model("  c: {block: Ros2/Call" + settings + "}\n"));
    };
    expect_contains(wrong(", type: std_srvs/srv/Trigge"),
                    "argument 'type': the package 'std_srvs' has no service 'srv/Trigge'; correct the type");
    expect_contains(wrong(", type: Trigger"),
                    "'Trigger' is no type of service; write package/srv/Type, such as std_srvs/srv/SetBool");
    expect_contains(wrong(", type: std_srvs/srv/SetBool, fields: \"{'date'}\""),
                    "std_srvs/srv/SetBool_Request has no numbers 'date'; it has data");
    expect_contains(wrong(", texts: \"{'a=b'}\""), "std_srvs/srv/Trigger_Request has no text 'a'");
}

TEST_F(Ros2Topics, AreHeardByRclpy) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(model(publish(", topic: states, type: sensor_msgs/msg/JointState, fields: \"{'position', "
                              "'velocity'}\", texts: \"{'name=hip,knee'}\", frame_id: base, stamp: model"),
                      "u: p.position, v: p.velocity", "u: {shape: 2}, v: {shape: 1}",
                      ", name: us, namespace: /robot, remap: \"{'states:=joint_states'}\""));
    run.set("u", Eigen::Vector2d(0.5, -0.25)).set("v", 3);
    Peer peer({"echo", "sensor_msgs/msg/JointState", "/robot/joint_states", "1"});
    ASSERT_EQ(peer.line(), "ready");
    const std::string heard = line_while(peer, [&] { return run.step(); });
    expect_contains(
        heard, "frame_id='base'), name=['hip', 'knee'], position=[0.5, -0.25], velocity=[3.0], effort=[])");
    const double time = run.simulation.time();
    const auto at = heard.find("nanosec=");
    ASSERT_NE(at, std::string::npos);
    const double stamp =
        std::stod(heard.substr(heard.find("sec=") + 4)) + 1e-9 * std::stod(heard.substr(at + 8));
    EXPECT_LE(stamp, time) << "time of the model";
    EXPECT_NEAR(std::remainder(stamp, 0.01), 0, 1e-9);
}

TEST_F(Ros2Topics, AreHeardFromRclpy) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Peer peer({"send", "sensor_msgs/msg/Imu", "/imu", "200",
               std::string(middleware::test::imu_values) +
                   "m.header.stamp.sec=7; m.header.stamp.nanosec=500000000"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(model(subscribe(", topic: /imu, type: sensor_msgs/Imu, frame_id: base, start_timeout: 20")));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    middleware::test::expect_the_imu(run);
    peer.end();
    middleware::test::expect_the_imu_to_stay(run);
}

TEST_F(Ros2Topics, HaveTheNearestNumberThatTheirTypeCanHold) {
    for (const auto& [type, given, expected] :
         std::vector<std::tuple<std::string, double, double>>{{"Bool", 2, 1},
                                                              {"Int8", 200, 127},
                                                              {"Int8", -2.5, -3},
                                                              {"UInt8", -1, 0},
                                                              {"Byte", 255, 255},
                                                              {"Char", 65, 65},
                                                              {"Int16", -40000, -32768},
                                                              {"UInt16", 40000.4, 40000},
                                                              {"Int32", 3e9, 2147483647.0},
                                                              {"UInt32", 3e9, 3e9},
                                                              {"Int64", -1e18, -1e18},
                                                              {"UInt64", 1e19, 1e19},
                                                              {"Float32", 0.1, 0.1F},
                                                              {"Float64", 0.1, 0.1}}) {
        Running run(model(publish(", topic: x, type: std_msgs/msg/" + type) +
                              subscribe(", topic: x, type: std_msgs/msg/" + type),
                          "u: p", "u: {}"));
        run.set("u", given);
        EXPECT_TRUE(steps_until(run, [&] { return run.scalar("s.received") > 0; }))
            << run.simulation.failure();
        EXPECT_EQ(run.scalar("s.data"), expected) << type << " of " << given;
    }
}

TEST_F(Ros2Topics, HaveTimesAndArraysOfAnyLength) {
    Running run(model(publish(", topic: x, type: sensor_msgs/msg/JointState, fields: \"{'effort', "
                              "'header.stamp'}\", stamp: none") +
                          subscribe(", topic: x, type: sensor_msgs/msg/JointState, fields: \"{'effort', "
                                    "'header.stamp'}\", sizes: \"{'effort=4'}\""),
                      "u: p.effort, t: p.header_stamp", "u: {shape: 3}, t: {}"));
    run.set("u", Eigen::Vector3d(1, 2, 3)).set("t", 1234.000000001);
    EXPECT_TRUE(steps_until(run, [&] { return run.scalar("s.received") > 0; })) << run.simulation.failure();
    EXPECT_EQ(run.get("s.effort"), Matrix(Eigen::Vector4d(1, 2, 3, 0)));
    EXPECT_EQ(run.scalar("s.effort_length"), 3);
    EXPECT_NEAR(run.scalar("s.header_stamp"), 1234.000000001, 1e-12);
}

TEST_F(Ros2Topics, CostTheStepNoHeapAndNoWaiting) {
    Running run(model(publish(", topic: x, type: geometry_msgs/msg/Twist") +
                          subscribe(", topic: x, type: geometry_msgs/msg/Twist"),
                      "u: p.linear", "u: {shape: 3}"));
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step());
    }
    const long before = bf::test::heap_calls();
    for (int k = 0; k < 200; ++k) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(bf::test::heap_calls(), before);
}

TEST_F(Ros2Topics, RefuseWhatTheMessagesCannotBe) {
    expect_contains(refusal(model(publish(", type: sensor_msgs/msg/Imuu"))),
                    "argument 'type': the package 'sensor_msgs' has no message 'msg/Imuu'; correct the type");
    expect_contains(refusal(model(publish(", type: no_msgs/msg/Imu"))),
                    "there is no package of messages 'no_msgs' in " BF_ROS2_PREFIX
                    "; install it, or say by AMENT_PREFIX_PATH where it is");
    expect_contains(
        refusal(model(publish(", type: ../x/msg/Imu"))),
        "'../x/msg/Imu' is no type of message; write package/msg/Type, such as sensor_msgs/msg/Imu");
    expect_contains(
        refusal(model(subscribe(", type: geometry_msgs/msg/Twist, fields: \"{'linear', 'speed'}\""))),
        "argument 'fields': geometry_msgs/msg/Twist has no numbers 'speed'; it has linear, angular");
    expect_contains(
        refusal(model(subscribe(", type: sensor_msgs/msg/JointState, fields: \"{'position'}\""))),
        "argument 'sizes' is to say how many elements 'position' has at most, such as position=7");
    expect_contains(refusal(model(subscribe(", type: geometry_msgs/msg/Twist, sizes: \"{'linear=3'}\""))),
                    "has no 'linear' of any number of elements");
    expect_contains(refusal(model(publish(", type: geometry_msgs/msg/Twist, frame_id: base"))),
                    "geometry_msgs/msg/Twist has no text 'header.frame_id'");
    expect_contains(refusal(model(subscribe(", topic: nobody, start_timeout: 0.1"))),
                    "s: no message of 'nobody' came within 0.1 s; start who sends it");
    expect_contains(refusal("model: m\nplugins: [Ros2]\nstep: 0.01\nblocks:\n" + subscribe("")),
                    "ROS 2 node");
}

TEST_F(Ros2Topics, EndTheRunWhereAMessageDoesNotFit) {
    const auto failure_of = [](const std::string& sent, const std::string& expected) {
        Running run(
            model(publish(", topic: x, type: sensor_msgs/msg/JointState, fields: \"{'position'}\"" + sent) +
                      subscribe(", topic: x, type: sensor_msgs/msg/JointState, sizes: \"{'position=2'}\"" +
                                expected),
                  "u: p", "u: {shape: 3}"));
        steps_until(run, [] { return false; });
        return run.simulation.failure();
    };
    expect_contains(failure_of("", ""),
                    "s: a message has 3 elements in 'position', but at most 2 are expected; raise "
                    "argument 'sizes'");
    expect_contains(failure_of(", frame_id: world", ", frame_id: base"),
                    "s: a message of 'x' is of another frame than 'base', which argument 'frame_id' says");
    Running silent(model(subscribe(", timeout: 0.05")));
    for (int k = 0; k < 1000 && silent.step(); ++k) usleep(1000);
    expect_contains(
        silent.simulation.failure(),
        "s: no message of 'topic' came within the timeout of 0.05 s; look whether its sender runs");
}

TEST_F(Ros2Topics, StayForThoseWhoComeLater) {
    Running first(model(publish(", topic: x, durability: transient_local"), "u: p", "u: {}"));
    first.set("u", 5);
    ASSERT_TRUE(first.step());
    Running later(model(subscribe(", topic: x, durability: transient_local, start_timeout: 20")));
    ASSERT_TRUE(later.step()) << later.simulation.failure();
    EXPECT_EQ(later.scalar("s.data"), 5);
}

TEST_F(Ros2Topics, LeaveNothingBehindHoweverOftenTheyStart) {
    int k = 0;
    middleware::test::expect_no_leak([&] {
        Running run(model(publish(", topic: x") + subscribe(", topic: x"), "u: p", "u: {}"));
        run.set("u", ++k);
        EXPECT_TRUE(steps_until(run, [&] { return run.scalar("s.received") > 0; }))
            << run.simulation.failure();
        EXPECT_EQ(run.scalar("s.data"), k);
        run.simulation.stop();
    });
}

TEST_F(Ros2Streams, AreTopicsOfNumbers) {
    Running run(model(
        "  w: {block: WholeBodyToolbox/StreamWrite, stream: /numbers, error_on_missing: false}\n"
        "  r: {block: WholeBodyToolbox/StreamRead, stream: /numbers, size: 2, error_on_missing: false}\n",
        "u: w", "u: {shape: 2}"));
    run.set("u", Eigen::Vector2d(1, -2));
    EXPECT_TRUE(steps_until(run, [&] { return run.get("r.timestamp")(0) > 0; })) << run.simulation.failure();
    EXPECT_EQ(run.get("r.y"), Matrix(Eigen::Vector2d(1, -2)));
    expect_contains(refusal(model("  r: {block: WholeBodyToolbox/StreamRead, stream: /nobody}\n")),
                    "r: nobody sends '/nobody'");
}

TEST_F(Ros2Streams, HaveTheTimeOfWhoeverSendsTheClock) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Peer peer({"send", "rosgraph_msgs/msg/Clock", "/clock", "100", "m.clock.sec=100+k"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(model("  t: {block: WholeBodyToolbox/NetworkClock}\n", "", "", ", use_sim_time: true"));
    EXPECT_TRUE(steps_until(run, [&] { return run.scalar("t.y") >= 110; })) << run.scalar("t.y");
    EXPECT_EQ(run.scalar("t.y"), std::floor(run.scalar("t.y")));
}

/// It begins with the first message, however late that is, and not at 0.
TEST_F(Ros2Streams, AreTheClockOfALoopFromTheFirstTimeThatIsTold) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Peer peer({"send", "rosgraph_msgs/msg/Clock", "/clock", "100", "m.clock.sec=100+k"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(model(
        "  t: {block: WholeBodyToolbox/NetworkClock}\n  sync: {block: WholeBodyToolbox/RealTimeSynchronizer, "
        "clock: network, interval: 3, report: true}\n",
        "", "", ", use_sim_time: true"));
    for (int k = 0; k < 4; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_EQ(run.scalar("sync.overruns"), 0);
    EXPECT_GE(run.scalar("t.y"), 109) << "three intervals after 100 s at the earliest";
}

} // namespace bf::ros2::test
