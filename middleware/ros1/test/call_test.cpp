// Calls of services, which rospy answers.
#include "cycles.hpp"
#include "heap.hpp"
#include "master.hpp"
#include "running.hpp"

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string calling(const std::string& settings, const std::string& connections = "",
                    const std::string& inputs = "", const std::string& node = "Node") {
    return "model: m\nplugins: [Ros1]\nstep: 0.01\n" + (inputs.empty() ? "" : "inputs: {" + inputs + "}\n") +
           "blocks:\n  node: {block: Ros1/" + node + "}\n  c: {block: Ros1/Call" + settings + "}\n" +
           (connections.empty() ? "" : "connections: {" + connections + "}\n");
}

} // namespace

using Ros1Calls = WithMaster;

TEST_F(Ros1Calls, AreAnsweredByRospyOnceForEachEdge) {
    Running run(
        calling(", service: /lab/pause, type: std_srvs/SetBool", "u: c.call, v: c.data", "u: {}, v: {}"));
    run.set("u", 1).set("v", 1);
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.scalar("c.pending"), 1) << "it waits until somebody offers the service";
    }
    Peer peer({"offer", "/lab/pause", "std_srvs/SetBool", "a.success = r.data and k < 3"});
    ASSERT_EQ(peer.line(), "ready");
    const auto answered = [&] { return run.scalar("c.pending") == 0; };
    ASSERT_TRUE(steps_until(run, answered)) << run.simulation.failure();
    EXPECT_EQ(run.scalar("c.success"), 1);
    EXPECT_EQ(run.scalar("c.answered"), 1);
    for (const int value : {0, 1}) {
        run.set("u", 0);
        ASSERT_TRUE(run.step());
        run.set("u", 2).set("v", value);
        ASSERT_TRUE(run.step());
        ASSERT_TRUE(steps_until(run, answered)) << run.simulation.failure();
        EXPECT_EQ(run.scalar("c.success"), 0);
    }
    for (int k = 0; k < 100; ++k, usleep(1000)) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(run.scalar("c.answered"), 3) << "a call that stays positive is one";
    EXPECT_EQ(run.scalar("c.failed"), 0);
}

TEST_F(Ros1Calls, HaveTextsAndListsOfAnyLength) {
    Peer peer({"offer", "/lab/camera", "sensor_msgs/SetCameraInfo",
               "a.success = r.camera_info.distortion_model == 'plumb_bob' and list(r.camera_info.D) == [1.5, "
               "-2.5] and r.camera_info.K[8] == 9 and r.camera_info.width == 320"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(calling(", service: /lab/camera, type: sensor_msgs/SetCameraInfo, fields: "
                        "\"{'camera_info.D', 'camera_info.K', 'camera_info.width'}\", texts: "
                        "\"{'camera_info.distortion_model=plumb_bob'}\"",
                        "u: c.call, d: c.camera_info_D, k: c.camera_info_K, w: c.camera_info_width",
                        "u: {}, d: {shape: 2}, k: {shape: 9}, w: {}"));
    run.set("u", 1).set("d", Eigen::Vector2d(1.5, -2.5)).set("w", 320);
    run.set("k", Matrix(Eigen::VectorXd::LinSpaced(9, 1, 9)));
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("c.answered") == 1; })) << run.simulation.failure();
    EXPECT_EQ(run.scalar("c.success"), 1);
}

TEST_F(Ros1Calls, TellThatTheServiceFailsAndAreNotMadeAgain) {
    Peer peer({"offer", "/lab/fails", "std_srvs/Trigger", "a.success = True if k > 1 else 1 / 0"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(calling(", service: /lab/fails", "u: c.call", "u: {}"));
    run.set("u", 1);
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("c.failed") == 1; })) << run.simulation.failure();
    for (int k = 0; k < 100; ++k, usleep(1000)) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(run.scalar("c.pending"), 0);
    EXPECT_EQ(run.scalar("c.answered"), 0);
    run.set("u", 0);
    ASSERT_TRUE(run.step());
    run.set("u", 1);
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("c.answered") == 1; })) << run.simulation.failure();
    EXPECT_EQ(run.scalar("c.failed"), 1);
}

TEST_F(Ros1Calls, BreakOffWithTheRunAndWithTheServer) {
    for (const bool is_killed : {true, false}) {
        const std::string name = is_killed ? "/lab/dies" : "/lab/slow";
        Peer peer({"offer", name, "std_srvs/Trigger", "time.sleep(1000)"});
        ASSERT_EQ(peer.line(), "ready");
        Running run(calling(", service: " + name, "u: c.call", "u: {}"));
        run.set("u", 1);
        for (int k = 0; k < 500; ++k, usleep(1000)) {
            ASSERT_TRUE(run.step());
        }
        EXPECT_EQ(run.scalar("c.pending"), 1);
        if (is_killed) {
            peer.end();
            EXPECT_TRUE(steps_until(run, [&] { return run.scalar("c.failed") == 1; }));
        }
        run.simulation.stop(); // which would wait for 1000 s
    }
}

TEST_F(Ros1Calls, CostTheStepNoHeapAndEndItWithoutAnAnswer) {
    Running run(calling(", service: /lab/nobody, timeout: 0.5", "u: c.call", "u: {}"));
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

TEST_F(Ros1Calls, RefuseWhatServicesCannotBe) {
    const auto wrong = [](const std::string& settings) { return refusal(calling(settings)); };
    expect_contains(wrong(", type: std_srvs/Trigge"),
                    "argument 'type': there is no service std_srvs/Trigge in ");
    expect_contains(wrong(", type: Trigger"),
                    "'Trigger' is no type of service; write package/Type, such as std_srvs/SetBool");
    expect_contains(wrong(", type: std_srvs/SetBool, fields: \"{'date'}\""),
                    "std_srvs/SetBoolRequest has no numbers 'date'; it has data");
    expect_contains(wrong(", texts: \"{'a=b'}\""), "std_srvs/TriggerRequest has no text 'a'");
}

TEST_F(Ros1Calls, AreNoneOfABag) {
    const Folder folder;
    const std::string bag = folder.path / "drive.bag";
    Peer peer({"bag", bag, "none", "write('/x', 'std_msgs/Float64', 0, 'm.data = 1.0')"});
    ASSERT_EQ(peer.line(), "written");
    expect_contains(refusal(calling("", "u: c.call", "u: {}", "Bag, file: " + bag)),
                    "answers no calls of 'service'; give the block a Node");
}

TEST_F(Ros1Calls, LeaveNothingBehindHoweverOftenTheyStart) {
    Peer peer({"offer", "/lab/again", "std_srvs/Trigger", "a.success = True"});
    ASSERT_EQ(peer.line(), "ready");
    middleware::test::expect_no_leak([&] {
        Running run(calling(", service: /lab/again", "u: c.call", "u: {}"));
        run.set("u", 1);
        EXPECT_TRUE(steps_until(run, [&] { return run.scalar("c.answered") == 1; }))
            << run.simulation.failure();
        run.simulation.stop();
    });
}

} // namespace bf::ros1::test
