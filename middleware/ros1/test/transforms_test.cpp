// Transforms of tf, which rospy hears.
#include "master.hpp"
#include "running.hpp"

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string transforms(const std::string& settings, bool are_wired = true) {
    return std::string("model: m\nplugins: [Ros1]\nstep: 0.01\n") +
           (are_wired ? "inputs: {u: {shape: [4, 4]}, v: {shape: [4, 4]}}\n" : "") +
           "blocks:\n  node: {block: Ros1/Node}\n  t: {block: Ros1/PublishTransforms" + settings + "}\n" +
           (are_wired ? "connections: {u: t.base, v: t.left_hand}\n" : "");
}

} // namespace

using Ros1Transforms = WithMaster;

TEST_F(Ros1Transforms, AreThoseOfTheirMatrices) {
    Matrix quarter(4, 4); // about z, then 1, 2, 3 m away
    quarter << 0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1;
    for (const bool is_static : {false, true}) {
        Running run(transforms(std::string(", frame_id: map, children: \"{'base', 'left.hand'}\", stamp: "
                                           "model") +
                               (is_static ? ", static: true" : "")));
        run.set("u", quarter).set("v", Matrix::Identity(4, 4));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        Peer peer({"echo", "tf2_msgs/TFMessage", is_static ? "/tf_static" : "/tf", "1"});
        ASSERT_EQ(peer.line(), "ready");
        const std::string heard = line_while(peer, [&] { return run.step(); });
        expect_contains(heard, "frame_id: \"map\" |     child_frame_id: \"base\" |     transform:  |       "
                               "translation:  |         x: 1.0 |         y: 2.0 |         z: 3.0 |       "
                               "rotation:  |         x: 0.0 |         y: 0.0 |         z: 0.70710678");
        expect_contains(heard, "child_frame_id: \"left.hand\"");
        if (is_static) {
            expect_contains(heard, "secs: 0 |         nsecs:         0 |"); // it is sent once, and stays
        }
    }
}

/// roscpp keeps the last message of a topic for those who come later, not that of each block.
TEST_F(Ros1Transforms, StayAllWhereSeveralBlocksTellThem) {
    Running run(
        "model: m\nplugins: [Ros1]\nstep: 0.01\ninputs: {u: {shape: [4, 4]}}\nblocks:\n  node: {block: "
        "Ros1/Node}\n  a: {block: Ros1/PublishTransforms, children: \"{'first'}\", static: true}\n"
        "  b: {block: Ros1/PublishTransforms, children: \"{'second'}\", static: true}\n"
        "connections: {u: [a.first, b.second]}\n");
    run.set("u", Matrix::Identity(4, 4));
    for (int k = 0; k < 50; ++k, usleep(1000)) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    }
    Peer peer({"echo", "tf2_msgs/TFMessage", "/tf_static", "1"});
    ASSERT_EQ(peer.line(), "ready");
    const std::string both = peer.line();
    expect_contains(both, "child_frame_id: \"first\"");
    expect_contains(both, "child_frame_id: \"second\"");
}

TEST_F(Ros1Transforms, RefuseWhatAreNone) {
    const auto wrong = [](const std::string& settings) { return refusal(transforms(settings, false)); };
    expect_contains(wrong(", children: \"{'a b', 'a_b'}\""), "argument 'children' has the port 'a_b' twice");
    expect_contains(wrong(", children: \"{'world'}\""), "the frame 'world' cannot be in 'world'");
    expect_contains(wrong(", children: \"{}\""),
                    "argument 'children' names no frame; name some, such as base");
}

} // namespace bf::ros1::test
