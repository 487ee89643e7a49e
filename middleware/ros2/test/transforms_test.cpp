// Transforms between frames, as programs of ROS 2 that are not ours tell them.
#include "cycles.hpp"
#include "heap.hpp"
#include "models.hpp"
#include "peer.hpp"
#include "told.hpp"

namespace bf::ros2::test {
namespace {

std::string pose_of(const std::string& settings, const std::string& node = "") {
    return model("  s: {block: Ros2/SubscribeTransform" + settings + "}\n", "", "", node);
}
Peer told(const std::string& expression) { return Peer({"frames", "200", expression}); }

class Ros2Frames : public Alone {
  protected:
    void SetUp() override {
        Alone::SetUp();
        if (!IsSkipped() && !Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
        setenv("AMENT_PREFIX_PATH", BF_ROS2_MESSAGES, 1);
    }
    void TearDown() override { unsetenv("AMENT_PREFIX_PATH"); }
};

} // namespace

TEST_F(Ros2Frames, AreFollowedAlongTheirTree) {
    auto peer = told(std::string("still('base', 'head', 0, 0, 0, 1); ") + middleware::test::moving_frames);
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", target: map, source: camera, start_timeout: 20"));
    int seen = 0;
    double last = -1;
    ASSERT_TRUE(steps_until(run, [&] {
        EXPECT_EQ(run.scalar("s.valid"), 1);
        const double u = middleware::test::expect_the_moving_pose(run);
        seen += u != last;
        last = u;
        return seen > 20;
    })) << run.simulation.failure();
    EXPECT_EQ(run.scalar("s.state"), 0);
    EXPECT_EQ(run.scalar("s.jumps"), 0);
    peer.end();
    const Matrix H = run.get("s.target_H_source");
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("s.age") > 0.3; }));
    EXPECT_EQ(run.scalar("s.valid"), 1);
    EXPECT_LT((run.get("s.target_H_source") - H).cwiseAbs().maxCoeff(), 0.2) << "the last one stays";
}

TEST_F(Ros2Frames, StayForThoseWhoComeLaterWhereTheyAreStatic) {
    auto peer = told("still('base', 'camera', 0, 1, 2, 3) or still('base', 'head', 0, 0, 0, 5)");
    ASSERT_EQ(peer.line(), "ready");
    usleep(300'000);
    Running run(pose_of(", target: base, source: head, start_timeout: 20"));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("s.target_H_source")(2, 3), 5);
    EXPECT_EQ(run.scalar("s.age"), 0);
}

TEST_F(Ros2Frames, TellWhatIsWrongWithTheirTree) {
    auto peer = told(
        "k < 200 or tf('map', 'base', t); 200 <= k < 400 and tf('base', 'map', t); k >= 400 and tf('world', "
        "'map', t); k < 600 or tf('camera', 'base', t)");
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", target: map, source: base"));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("s.target_H_source"), Matrix(Eigen::Matrix4d::Identity()));
    EXPECT_EQ(run.scalar("s.valid"), 0);
    EXPECT_EQ(run.scalar("s.state"), 1) << "there is no map";
    for (const int state : {4, 0, 6}) {
        ASSERT_TRUE(steps_until(run, [&] { return run.scalar("s.state") == state; })) << state;
        EXPECT_EQ(run.scalar("s.valid"), state == 0);
    }
}

TEST_F(Ros2Frames, ForgetWhatMovesWhenTimeJumpsBack) {
    auto peer = told("tf('map', 'base', (k if k < 400 else k - 400) / 200, k)");
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", target: map, source: base, start_timeout: 20"));
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("s.jumps") == 1; }));
    EXPECT_GE(run.get("s.target_H_source")(0, 3), 400);
    EXPECT_EQ(run.scalar("s.valid"), 1);
}

/// Of a simulator that starts anew, whose time goes back by less than stamps may be out of order.
TEST_F(Ros2Frames, FollowTheClockOfASimulator) {
    auto peer = told("tf('map', 'base', 0.25, k)");
    ASSERT_EQ(peer.line(), "ready");
    const auto clock = [](const std::string& nanoseconds) {
        return Peer({"send", "rosgraph_msgs/msg/Clock", "/clock", "100", "m.clock.nanosec = " + nanoseconds});
    };
    Running run(pose_of(", target: map, source: base, start_timeout: 20", ", use_sim_time: true"));
    {
        const auto first = clock("750_000_000");
        ASSERT_TRUE(steps_until(run, [&] { return run.scalar("s.age") == 0.5; }));
        EXPECT_EQ(run.scalar("s.jumps"), 0);
    }
    const auto second = clock("500_000_000");
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("s.age") == 0.25; }));
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("s.jumps") == 1; }));
}

TEST_F(Ros2Frames, CostTheStepNoHeap) {
    auto peer = told("tf('map', 'base', t, k)");
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", target: map, source: base, start_timeout: 20, timeout: 10"));
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step());
    }
    // The other thread takes what it needs, so the one of the steps is counted while nothing comes.
    peer.end();
    usleep(300'000);
    const long before = bf::test::heap_calls();
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(bf::test::heap_calls(), before);
}

TEST_F(Ros2Frames, EndTheRunWhereTheyAreNotFoundOrTooOld) {
    expect_contains(refusal(pose_of(", target: map, start_timeout: 0.1")),
                    "s: the pose of 'base' in 'map' is not found within 0.1 s: no frames are told; start who "
                    "sends it, or correct the name");
    expect_contains(refusal(pose_of(", target: ''")),
                    "s: the arguments 'target' and 'source' are to name frames, such as world and base");
    auto peer = told("tf('map', 'base', t); tf('map', 'ba{s}e', t)");
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", target: map, source: hand, timeout: 5"));
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(),
                    "s: the transform is older than argument 'timeout': there is no "
                    "frame 'hand'; there are base, ba(s)e, map");
    Running silent(pose_of(", target: map, source: base, start_timeout: 20, timeout: 1"));
    ASSERT_TRUE(silent.step()) << silent.simulation.failure();
    peer.end();
    EXPECT_FALSE(steps_until(silent, [] { return false; }));
    expect_contains(silent.simulation.failure(), "'timeout': no newer one comes");
}

TEST_F(Ros2Frames, AreInTheRecordingAndReplayedWithoutRos) {
    const Folder folder;
    const auto file = folder.write("m.yaml", pose_of(", target: map, source: base, start_timeout: 20"));
    const std::string recording = folder.path / "run.mcap";
    {
        auto peer = told("tf('map', 'base', t, k)");
        ASSERT_EQ(peer.line(), "ready");
        Program run({BF_PROGRAM, "run", file, "--quiet", "--realtime", "--priority", "0", "--stop", "0.5",
                     "--record", recording});
        while (!run.line().empty()) { // until it has ended
        }
    }
    Program replay({BF_PROGRAM, "replay", recording});
    expect_contains(replay.line(), "identical: ");
}

TEST_F(Ros2Frames, LeaveNothingBehindHoweverOftenTheyStart) {
    auto peer = told("tf('map', 'base', t, k)");
    ASSERT_EQ(peer.line(), "ready");
    middleware::test::expect_no_leak([&] {
        Running run(pose_of(", target: map, source: base"));
        for (int k = 0; k < 100; ++k, usleep(1000)) EXPECT_TRUE(run.step());
        run.simulation.stop();
    });
}

} // namespace bf::ros2::test
