// Transforms between frames, as programs of ROS 1 that are not ours tell them, and as bags have them.
#include "cycles.hpp"
#include "frames.hpp"
#include "heap.hpp"
#include "master.hpp"
#include "told.hpp"

#include <cstring>

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string pose_of(const std::string& settings, const std::string& node = "Node") {
    return "model: m\nplugins: [Ros1]\nstep: 0.01\nblocks:\n  node: {block: Ros1/" + node +
           "}\n  s: {block: Ros1/SubscribeTransform" + settings + "}\n";
}

} // namespace

using Ros1Frames = WithMaster;

TEST_F(Ros1Frames, AreFollowedAlongTheirTree) {
    Peer peer({"frames", "200", middleware::test::moving_frames});
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", target: map, source: camera, start_timeout: 20"));
    int seen = 0;
    double last = -1;
    ASSERT_TRUE(steps_until(run, [&] {
        const double u = middleware::test::expect_the_moving_pose(run);
        seen += u != last;
        last = u;
        return seen > 20;
    })) << run.simulation.failure();
    EXPECT_EQ(run.scalar("s.valid"), 1);
    peer.end();
    usleep(300'000);
    const long before = bf::test::heap_calls();
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(bf::test::heap_calls(), before);
}

TEST_F(Ros1Frames, EndTheRunWhereTheyAreNotFoundOrTooOld) {
    expect_contains(refusal(pose_of(", target: map, start_timeout: 0.1")),
                    "s: the pose of 'base' in 'map' is not found within 0.1 s: no frames are told");
    Peer peer({"frames", "200", "tf('map', 'base', t)"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", target: map, source: bose, timeout: 2"));
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(),
                    "s: the transform is older than argument 'timeout': there is no "
                    "frame 'bose'; did you mean 'base'?");
}

TEST_F(Ros1Frames, LeaveOutMessagesOfAnotherType) {
    Peer peer({"send", "std_msgs/String", "/tf", "100", "m.data='no transform'"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(pose_of(", timeout: 5"));
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("s.left_out") > 0; }));
    EXPECT_EQ(run.scalar("s.valid"), 0);
}

TEST_F(Ros1Frames, LeaveNothingBehindHoweverOftenTheyStart) {
    Peer peer({"frames", "200", "tf('map', 'base', t)"});
    ASSERT_EQ(peer.line(), "ready");
    middleware::test::expect_no_leak([&] {
        Running run(pose_of(", target: map, source: base, start_timeout: 20"));
        EXPECT_TRUE(run.step());
        EXPECT_EQ(run.scalar("s.valid"), 1);
        run.simulation.stop();
    });
}

TEST(Ros1Bag, HasTheTransformsOfEachMoment) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rosbag";
    const Folder folder;
    const std::string file = folder.path / "tf.bag";
    Peer peer({"transforms", file});
    EXPECT_EQ(transforms_type()->md5(), peer.line()) << "as genpy has it";
    Running run(pose_of(", target: map, source: camera", "Bag, file: " + file));
    for (int k = 0; k <= 100; ++k) { // of 10 ms; messages come 0.03 s after their stamps
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const bool is_valid = k >= 20;
        EXPECT_EQ(run.scalar("s.valid"), is_valid) << k;
        if (!is_valid) {
            EXPECT_EQ(run.scalar("s.state"), 2) << "there is no camera yet";
            continue;
        }
        const int newest = std::min(k / 10, 9);
        const Matrix H = run.get("s.target_H_source");
        EXPECT_EQ(H(0, 3), newest) << k;
        EXPECT_EQ(H(2, 3), 1);
        EXPECT_NEAR(run.scalar("s.age"), 0.03 + 0.01 * (k - 10 * newest), 2e-6) << k;
    }
}

TEST(Ros1FrameMessages, AreRefusedWhereTheyEndTooSoon) {
    const auto type = transforms_type();
    const auto message = std::static_pointer_cast<Message>(type->make());
    std::vector<std::uint8_t> bytes{2, 0, 0, 0};
    for (std::size_t size = 4; size < 4 + 2 * (12 + 4 + 4 + 56); ++size) { // two transforms without names
        const std::vector<std::uint8_t> cut(
            bytes); // so that an address sanitizer sees what is read behind it
        EXPECT_THROW(type->decode(cut, *message), std::runtime_error) << size;
        bytes.push_back(0);
    }
    const std::uint32_t stamp[] = {1'700'000'000, 123'456'789}; // behind the number of transforms and seq
    std::memcpy(bytes.data() + 8, stamp, sizeof stamp);
    type->decode(bytes, *message);
    const auto frames = frames_of(*message, true);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[0].stamp, 1'700'000'000'123'456'789) << "to the ns, which no double of seconds has";
    EXPECT_EQ(frames[1].stamp, 0);
    EXPECT_TRUE(frames[1].is_static);
}

} // namespace bf::ros1::test
