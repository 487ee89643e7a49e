// Goals of actions, whose servers are programs of rclpy.
#include "heap.hpp"
#include "models.hpp"
#include "peer.hpp"

#include <thread>

namespace bf::ros2::test {
namespace {

constexpr const char* moves = "for k in range(1, 4):\n"
                              "    f.position, f.error = k * 0.5, [float(k), -float(k)]\n"
                              "    h.publish_feedback(f)\n"
                              "    time.sleep(0.1)\n"
                              "r.reached, r.visited = g.target + sum(g.weights), [7, 8]\n"
                              "h.succeed()\n";

std::string goal(const std::string& settings = "") {
    return model("  a: {block: Ros2/SendGoal, action: /lab/move, type: lab_msgs/action/Move, sizes: "
                 "\"{'result.visited=3'}\"" +
                     settings + "}\n",
                 "u: a.start, v: a.goal_target, w: a.goal_weights, x: a.cancel",
                 "u: {}, v: {}, w: {shape: 2}, x: {}");
}

} // namespace

/// Their messages are made by scripts/ros2-messages.
class Ros2Goals : public Alone {
  protected:
    void SetUp() override {
        Alone::SetUp();
        if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
        setenv("AMENT_PREFIX_PATH", BF_ROS2_MESSAGES, 1);
    }
    void TearDown() override { unsetenv("AMENT_PREFIX_PATH"); }
};

TEST_F(Ros2Goals, HaveFeedbackAndAResultOfTheirServer) {
    Running run(goal(", texts: \"{'goal.frame=base'}\""));
    run.set("u", 1).set("v", 2.5).set("w", Eigen::Vector2d(1, 0.25));
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.scalar("a.active"), 1) << "it waits until there is a server";
        EXPECT_EQ(run.scalar("a.status"), 0);
    }
    Peer peer({"pursue", "/lab/move", "lab_msgs/action/Move", moves});
    ASSERT_EQ(peer.line(), "ready");
    std::vector<double> positions{0};
    const auto is_over = [&] {
        if (run.scalar("a.feedback_position") != positions.back()) {
            positions.push_back(run.scalar("a.feedback_position"));
            EXPECT_EQ(run.get("a.feedback_error"),
                      Matrix(Eigen::Vector2d(2 * positions.back(), -2 * positions.back())));
            EXPECT_EQ(run.scalar("a.status"), 2) << "it executes";
        }
        return run.scalar("a.active") == 0;
    };
    ASSERT_TRUE(steps_until(run, is_over)) << run.simulation.failure();
    EXPECT_EQ(peer.line(), "goal 2.5 [1.0, 0.25] base");
    EXPECT_EQ(positions, (std::vector<double>{0, 0.5, 1, 1.5}));
    EXPECT_EQ(run.scalar("a.status"), 4) << "it has succeeded";
    EXPECT_EQ(run.scalar("a.finished"), 1);
    EXPECT_EQ(run.scalar("a.result_reached"), 3.75);
    EXPECT_EQ(run.get("a.result_visited"), Matrix(Eigen::Vector3d(7, 8, 0)));
    EXPECT_EQ(run.scalar("a.result_visited_length"), 2);
    for (int k = 0; k < 50; ++k, usleep(1000)) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(run.scalar("a.finished"), 1) << "a start that stays positive is one";
}

TEST_F(Ros2Goals, AreRejectedAbortedAndFollowEachOther) {
    Peer peer({"pursue", "/lab/move", "lab_msgs/action/Move",
               "r.reached = -g.target\nh.abort() if g.target == 5 else h.succeed()\n"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(goal());
    run.set("w", Eigen::Vector2d(1, 1));
    int count = 0;
    for (const auto& [target, status] : {std::pair(-1.0, -1), {5.0, 6}, {6.0, 4}}) {
        run.set("u", 0);
        ASSERT_TRUE(run.step());
        run.set("u", 1).set("v", target);
        ASSERT_TRUE(run.step());
        ASSERT_TRUE(steps_until(run, [&] { return run.scalar("a.active") == 0; }))
            << run.simulation.failure();
        EXPECT_EQ(run.scalar("a.status"), status);
        EXPECT_EQ(run.scalar("a.finished"), ++count);
        EXPECT_EQ(run.scalar("a.result_reached"), target < 0 ? 0 : -target);
    }
}

TEST_F(Ros2Goals, AreCanceledByTheirInputAndByTheEndOfTheRun) {
    Peer peer({"pursue", "/lab/move", "lab_msgs/action/Move",
               "while not h.is_cancel_requested:\n    time.sleep(0.01)\nr.reached = "
               "9.0\nh.canceled()\nsay('over')\n"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(goal());
    run.set("w", Eigen::Vector2d(1, 1)).set("u", 1).set("v", 1);
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("a.status") == 2; })) << run.simulation.failure();
    EXPECT_EQ(peer.line(), "goal 1.0 [1.0, 1.0] ");
    run.set("x", 1).set("u", 0);
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("a.active") == 0; })) << run.simulation.failure();
    EXPECT_EQ(peer.line(), "cancel");
    EXPECT_EQ(peer.line(), "over");
    EXPECT_EQ(run.scalar("a.status"), 5);
    EXPECT_EQ(run.scalar("a.result_reached"), 9);
    run.set("x", 0).set("u", 1);
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("a.status") == 2; })) << run.simulation.failure();
    EXPECT_EQ(peer.line(), "goal 1.0 [1.0, 1.0] ");
    run.simulation.stop();
    EXPECT_EQ(peer.line(), "cancel");
    EXPECT_EQ(peer.line(), "over");
}

TEST_F(Ros2Goals, EndTheRunWhoseServerDies) {
    Peer peer({"pursue", "/lab/move", "lab_msgs/action/Move", "time.sleep(100)\n"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(goal(", timeout: 3"));
    run.set("w", Eigen::Vector2d(1, 1)).set("u", 1).set("v", 1);
    ASSERT_TRUE(steps_until(run, [&] { return run.scalar("a.status") == 2; })) << run.simulation.failure();
    peer.end();
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(), "a: no word on the goal came within argument 'timeout'");
}

TEST_F(Ros2Goals, CostTheStepNoHeap) {
    Running run(goal());
    run.set("w", Eigen::Vector2d(1, 1));
    for (int k = 0; k < 50; ++k, usleep(1000)) {
        run.set("u", k % 2).set("x", k % 3);
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (bf::test::heap_is_counted() && k > 0) {
            ASSERT_EQ(bf::test::heap_calls(), before);
        }
    }
}

TEST_F(Ros2Goals, RefuseWhatActionsCannotBe) {
    const auto wrong = [](const std::string& settings) {
        return refusal(model("  a: {block: Ros2/SendGoal" + settings + "}\n"));
    };
    expect_contains(wrong(""), "argument 'type': '' is no type of action; write package/action/Type, such as "
                               "control_msgs/action/FollowJointTrajectory");
    expect_contains(wrong(", type: lab_msgs/action/Mov"),
                    "argument 'type': the package 'lab_msgs' has no action 'action/Mov'; correct the type");
    const auto its = [&](const std::string& settings) { return wrong(", type: lab_msgs/Move" + settings); };
    expect_contains(
        its(", fields: \"{'goal_id.uuid'}\""),
        "argument 'fields': lab_msgs/action/Move_SendGoal_Request has no numbers 'goal_id.uuid'; it "
        "has goal.target, goal.weights");
    expect_contains(its(", answer_fields: \"{'result.speed'}\""), "has no numbers 'result.speed'; it has "
                                                                  "result.reached, result.visited");
    expect_contains(its(", answer_fields: \"{'status'}\""),
                    "'status' is neither of the feedback nor of the result; write it as feedback.field or "
                    "result.field");
    expect_contains(its(", action: ''"), "argument 'action': '' is no name of ROS 2: ");
}

} // namespace bf::ros2::test
