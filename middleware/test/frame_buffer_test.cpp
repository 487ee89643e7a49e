// Transforms along a tree of frames, against products of matrices and closed forms.
#include "bf/middleware/frame_buffer.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

namespace bf::middleware::test {
namespace {

using State = FrameBuffer::State;
using Eigen::Isometry3d, Eigen::Quaterniond, Eigen::Vector3d, Eigen::AngleAxisd;

constexpr std::int64_t at(double seconds) { return static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

/// Frames, and the time at which messages come.
struct Frames : FrameBuffer {
    std::string tell(const std::string& parent, const std::string& child, double stamp,
                     const FramePose& pose = {}, bool is_static = false) {
        time += 0.01;
        return add({parent, child, at(stamp), pose, is_static}, time);
    }
    Found look(const std::string& target, const std::string& source) const {
        return find(target, source, time);
    }
    State state(const std::string& target, const std::string& source) const {
        return look(target, source).state;
    }
    std::string why(const std::string& target, const std::string& source) const {
        return look(target, source).why;
    }
    double time = 1000;
};

FramePose pose(const Vector3d& axis, double angle, const Vector3d& p) {
    return {Quaterniond(AngleAxisd(angle, axis.normalized())), p};
}
Isometry3d matrix(const FramePose& pose) {
    Isometry3d H = Isometry3d::Identity();
    H.linear() = pose.q.toRotationMatrix();
    H.translation() = pose.p;
    return H;
}
FramePose shifted(double x) { return {Quaterniond::Identity(), {x, 0, 0}}; }

const FramePose a = pose({1, 2, 3}, 0.7, {1, -2, 0.5}), b = pose({-1, 0, 2}, 2.5, {0.1, 0.2, 0.3}),
                c = pose({0, 1, 0}, -1.1, {4, 5, 6}), d = pose({3, 1, -1}, 3.0, {-1, 0, 2});

} // namespace

TEST(FrameBuffer, MultipliesThePosesAlongTheTree) {
    Frames frames;
    frames.tell("world", "base", 5, a);
    frames.tell("base", "arm", 5, b);
    frames.tell("arm", "hand", 5, c, true);
    frames.tell("base", "camera", 5, d);
    const Isometry3d A = matrix(a), B = matrix(b), C = matrix(c), D = matrix(d);
    const auto expect = [&](const std::string& target, const std::string& source, const Isometry3d& H) {
        const auto found = frames.look(target, source);
        ASSERT_EQ(found.state, State::found) << found.why;
        EXPECT_LT((matrix(found.pose).matrix() - H.matrix()).cwiseAbs().maxCoeff(), 1e-14)
            << target << " " << source;
        EXPECT_EQ(found.stamp, target == source ? std::nullopt : std::optional(at(5)));
    };
    expect("world", "hand", A * B * C);
    expect("hand", "world", (A * B * C).inverse());
    expect("camera", "hand", D.inverse() * B * C);
    expect("hand", "camera", C.inverse() * B.inverse() * D);
    expect("base", "hand", B * C);
    expect("arm", "base", B.inverse());
    expect("hand", "hand", Isometry3d::Identity());
    expect("/world", "/base", A);
}

/// A frame that turns at a constant rate and moves on a line is interpolated exactly.
TEST(FrameBuffer, InterpolatesAtTheNewestCommonTime) {
    Frames frames;
    const Vector3d axis = Vector3d(1, -1, 2).normalized(), v(0.5, -1, 2);
    const auto moving = [&](double t) { return pose(axis, 1.5 * t, v * t); };
    for (const double t : {1.0, 1.2, 1.5, 1.6}) frames.tell("world", "base", t, moving(t));
    for (const double t : {0.9, 1.3}) frames.tell("world", "map", t, shifted(t));
    auto found = frames.look("map", "base");
    ASSERT_EQ(found.state, State::found);
    EXPECT_EQ(found.stamp, at(1.3));
    EXPECT_LT((found.pose.p - (v * 1.3 - Vector3d(1.3, 0, 0))).norm(), 1e-12);
    EXPECT_LT(found.pose.q.angularDistance(moving(1.3).q), 1e-12);
    frames.tell("world", "map", 1.55, shifted(1.55));
    found = frames.look("base", "map");
    EXPECT_EQ(found.stamp, at(1.55));
    const Isometry3d H = matrix(moving(1.55)).inverse() * matrix(shifted(1.55));
    EXPECT_LT((matrix(found.pose).matrix() - H.matrix()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(frames.look("world", "base").stamp, at(1.6)) << "map is not in between";
}

TEST(FrameBuffer, TurnsTheShorterWay) {
    Frames frames;
    FramePose turned = pose({0, 0, 1}, 0.5, Vector3d::Zero());
    turned.q.coeffs() *= -1; // the same orientation
    frames.tell("world", "base", 0, {});
    frames.tell("world", "base", 1, turned);
    frames.tell("base", "tool", 0.5, {});
    EXPECT_NEAR(AngleAxisd(frames.look("world", "tool").pose.q).angle(), 0.25, 1e-12);
}

TEST(FrameBuffer, HasNoTimeWhereAllIsStatic) {
    Frames frames;
    frames.tell("base", "camera", 7, d, true);
    EXPECT_EQ(frames.look("base", "camera").state, State::found);
    EXPECT_FALSE(frames.look("base", "camera").stamp);
    frames.tell("world", "base", 100, a);
    EXPECT_EQ(frames.look("world", "camera").stamp, at(100)) << "a static frame holds at all times";
    frames.tell("base", "camera", 3, c, true);
    EXPECT_EQ(frames.look("base", "camera").pose.p, c.p) << "the newest that came";
}

TEST(FrameBuffer, PutsStampsInOrderAndTakesTheFirstOfEach) {
    Frames frames;
    for (const double t : {1.0, 1.4, 1.2}) frames.tell("world", "base", t, shifted(t * t));
    frames.tell("world", "base", 1.2, shifted(100));
    frames.tell("base", "tool", 1.1);
    EXPECT_NEAR(frames.look("world", "tool").pose.p.x(), (1 + 1.44) / 2, 1e-12);
    EXPECT_EQ(frames.look("world", "base").stamp, at(1.4));
}

TEST(FrameBuffer, KeepsTenSeconds) {
    Frames frames;
    for (int k = 0; k <= 200; ++k) frames.tell("world", "base", 0.1 * k, shifted(0.1 * k));
    frames.tell("base", "old", 10.05);
    EXPECT_NEAR(frames.look("world", "old").pose.p.x(), 10.05, 1e-9);
    frames.tell("base", "older", 9.95);
    EXPECT_EQ(frames.state("world", "older"), State::no_common_time);
    EXPECT_EQ(frames.why("world", "older"), "the newest of 'older' is 0.05 s older than the first of 'base'");
}

TEST(FrameBuffer, SaysWhichFrameIsMissing) {
    Frames frames;
    EXPECT_EQ(frames.why("world", "base"), "no frames are told");
    frames.tell("world", "l_sole", 1);
    frames.tell("map", "camera", 1);
    EXPECT_EQ(frames.state("word", "l_sole"), State::no_target);
    EXPECT_EQ(frames.why("word", "l_sole"), "there is no frame 'word'; did you mean 'world'?");
    EXPECT_EQ(frames.state("world", "hand"), State::no_source);
    EXPECT_EQ(frames.why("world", "hand"), "there is no frame 'hand'; there are camera, l_sole, map, world");
    EXPECT_EQ(frames.state("world", "camera"), State::apart);
    EXPECT_EQ(frames.why("l_sole", "camera"),
              "'l_sole' is in the tree of 'world', 'camera' in that of 'map'");
    frames.tell("world", "map", 1);
    EXPECT_EQ(frames.state("l_sole", "camera"), State::found);
}

TEST(FrameBuffer, RefusesLoopsUntilAParentChanges) {
    Frames frames;
    frames.tell("world", "a", 1);
    frames.tell("a", "b", 1);
    frames.tell("b", "c", 1);
    EXPECT_EQ(frames.state("world", "c"), State::found);
    frames.tell("c", "a", 2);
    EXPECT_EQ(frames.state("a", "c"), State::loop);
    EXPECT_EQ(frames.state("c", "world"), State::loop);
    EXPECT_EQ(frames.why("world", "c"), "frames are in a loop: 'c' in 'b' in 'a' in 'c'");
    frames.tell("c", "tool", 2);
    EXPECT_EQ(frames.state("world", "tool"), State::loop);
    frames.tell("world", "a", 3);
    EXPECT_EQ(frames.state("world", "c"), State::no_common_time);
    frames.tell("a", "b", 3);
    frames.tell("b", "c", 3);
    EXPECT_EQ(frames.state("world", "c"), State::found);
}

TEST(FrameBuffer, FollowsAFrameToAnotherParent) {
    Frames frames; // something is taken, and put down
    frames.tell("world", "hand", 1, shifted(5));
    frames.tell("world", "cup", 1, shifted(1));
    frames.tell("hand", "cup", 2, shifted(0.1));
    EXPECT_EQ(frames.state("world", "cup"), State::no_common_time) << "the hand was told before";
    frames.tell("world", "hand", 2, shifted(6));
    EXPECT_NEAR(frames.look("world", "cup").pose.p.x(), 6.1, 1e-12);
    EXPECT_EQ(frames.tell("world", "cup", 1.5, shifted(9)), "") << "late, of the time before";
    EXPECT_NEAR(frames.look("world", "cup").pose.p.x(), 6.1, 1e-12);
    frames.tell("world", "cup", 3, shifted(2));
    EXPECT_NEAR(frames.look("world", "cup").pose.p.x(), 2, 1e-12);
}

TEST(FrameBuffer, RefusesAFrameThatTwoParentsHave) {
    Frames frames;
    for (int k = 0; k < 5; ++k) {
        frames.tell("world", "base", 1 + 0.1 * k);
        frames.tell("map", "base", 1.05 + 0.1 * k);
    }
    EXPECT_EQ(frames.state("map", "base"), State::two_parents);
    EXPECT_EQ(frames.why("map", "base"), "'base' is told in 'map' and in 'world'");
    frames.tell("base", "hand", 1.45);
    EXPECT_EQ(frames.state("base", "hand"), State::found) << "the frame is not in between";
    frames.time += FrameBuffer::memory; // one of them stays alone
    frames.tell("map", "base", 1.6);
    EXPECT_EQ(frames.state("map", "base"), State::found);

    Frames late; // one of them is always behind the other
    for (int k = 0; k < 5; ++k) {
        late.tell("map", "base", 1.1 + 0.1 * k);
        late.tell("world", "base", 1 + 0.1 * k);
    }
    EXPECT_EQ(late.why("map", "base"), "'base' is told in 'map' and in 'world'");

    Frames still;
    for (int k = 0; k < 3; ++k) {
        still.tell("map", "base", 1.1 + 0.1 * k);
        still.tell("map", "base", 0, {}, true);
    }
    EXPECT_EQ(still.why("map", "base"), "'base' is told in 'map' and there as static, too");
}

TEST(FrameBuffer, ForgetsWhatMovesWhenTimeJumpsBack) {
    Frames frames;
    frames.tell("base", "camera", 0, d, true);
    for (const double t : {100.0, 100.5}) frames.tell("world", "base", t, shifted(t));
    frames.tell("world", "map", 100.5);
    EXPECT_EQ(frames.jumps(), 0);
    frames.tell("world", "base", 99.6, shifted(99.6)); // out of order
    EXPECT_EQ(frames.jumps(), 0);
    frames.tell("world", "base", 0.1, shifted(7));
    EXPECT_EQ(frames.jumps(), 1);
    EXPECT_EQ(frames.look("world", "base").stamp, at(0.1));
    EXPECT_EQ(frames.look("world", "base").pose.p.x(), 7);
    EXPECT_EQ(frames.state("world", "camera"), State::found) << "what is static stays";
    EXPECT_EQ(frames.state("map", "base"), State::apart) << "nobody has told the map since";
}

TEST(FrameBuffer, LeavesOutWhatIsNoTransform) {
    Frames frames;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(frames.tell("base", "base", 1), "the pose of 'base' in 'base' is of a frame in itself");
    EXPECT_EQ(frames.tell("/base", "base", 1), "the pose of 'base' in '/base' is of a frame in itself");
    EXPECT_EQ(frames.tell("base", "", 1), "the pose of '' in 'base' is of a frame without a name");
    for (const double x : {nan, 1e308, -1e308})
        EXPECT_EQ(frames.tell("world", "base", 1, shifted(x)),
                  "the pose of 'base' in 'world' is not finite, or farther than a pose can be");
    EXPECT_EQ(frames.tell("world", "base", 1, {Quaterniond(0, 0, 0, 0), {0, 0, 0}}),
              "the pose of 'base' in 'world' has a quaternion that is not of unit length");
    EXPECT_EQ(frames.why("world", "base"), "no frames are told");
    EXPECT_EQ(frames.tell("world", "base", 1, {Quaterniond(1.004, 0, 0, 0), {0, 0, 0}}), "");
    EXPECT_EQ(frames.look("world", "base").pose.q.w(), 1);
    for (int k = 0; k < 20'000; ++k) frames.tell("world", "f" + std::to_string(k), 1);
    EXPECT_EQ(frames.tell("world", "last", 1), "there are more than 10000 frames, without 'last'");
    EXPECT_EQ(frames.tell("world", "base", 2), "") << "one that is known";
}

} // namespace bf::middleware::test
