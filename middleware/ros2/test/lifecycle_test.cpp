// A diagram as a managed node, whose manager is a program of rclpy.
#include "heap.hpp"
#include "models.hpp"
#include "peer.hpp"

#include <atomic>
#include <set>
#include <thread>

namespace bf::ros2::test {
namespace {

std::string managed(const std::string& settings = "") {
    return model(
        "  life: {block: Ros2/Lifecycle" + settings +
            "}\n  works:\n    execution: enabled\n    outputs: [y]\n    blocks: {one: {block: "
            "Constant, value: 1}, sum: {block: Sum}, past: {block: UnitDelay}}\n    connections: {one: "
            "sum.u1, past: sum.u2, sum: [past, y]}\n",
        "life.active: works.enable", "", ", name: lab");
}
std::string asked(const std::string& service, const std::string& type, const std::string& request = "None") {
    Peer peer({"call", "/lab/" + service, "lifecycle_msgs/srv/" + type, request});
    return peer.line();
}
std::string change(const std::string& how) {
    return asked("change_state", "ChangeState", "r.transition." + how);
}
/// The same while steps are done.
std::string change(Running& run, const std::string& how) {
    std::string answer;
    std::atomic<bool> is_there{false};
    std::thread asks([&] {
        answer = change(how);
        is_there = true;
    });
    while (!is_there && run.step()) usleep(1000);
    asks.join();
    return answer;
}

/// A node whose transitions fail by u and whose errors are v.
std::string fallible(const std::string& settings) {
    return model("  life: {block: Ros2/Lifecycle" + settings + "}\n", "u: life.failure, v: life.error",
                 "u: {}, v: {}", ", name: lab");
}

struct Events : Peer {
    explicit Events(int count)
        : Peer({"follow", "lifecycle_msgs/msg/TransitionEvent", "/lab/transition_event",
                std::to_string(count)}) {
        EXPECT_EQ(line(), "ready");
        usleep(500'000); // each knows the other
    }
    void expect(int id, const std::string& label, int from, int to) {
        const std::string event = line();
        expect_contains(event, "Transition(id=" + std::to_string(id) + ", label='" + label + "')");
        expect_contains(event, "start_state=lifecycle_msgs.msg.State(id=" + std::to_string(from) + ",");
        expect_contains(event, "goal_state=lifecycle_msgs.msg.State(id=" + std::to_string(to) + ",");
    }
};

} // namespace

using Ros2Lifecycle = Alone;

TEST_F(Ros2Lifecycle, RunsWhatIsEnabledWhileTheNodeIsActive) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(managed());
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_EQ(run.scalar("life.state"), 1);
    Events events(4);
    const auto steps = [&](int count) {
        const double before = run.scalar("works.sum");
        for (int k = 0; k < count; ++k) EXPECT_TRUE(run.step()) << run.simulation.failure();
        return run.scalar("works.sum") - before;
    };
    EXPECT_EQ(steps(5), 0);
    expect_contains(change("id=3"), "success=False"); // it is not configured
    expect_contains(change("label='configure'"), "success=True");
    EXPECT_EQ(steps(5), 0);
    EXPECT_EQ(run.scalar("life.state"), 2);
    expect_contains(change("id=3"), "success=True");
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("life.active"), 1);
    EXPECT_EQ(steps(5), 5);
    events.expect(1, "configure", 1, 10);
    events.expect(10, "transition_success", 10, 2);
    events.expect(3, "activate", 2, 13);
    events.expect(30, "transition_success", 13, 3);
    expect_contains(asked("get_state", "GetState"), "State(id=3, label='active')");
    expect_contains(change("id=4"), "success=True");
    EXPECT_EQ(steps(5), 0);
    expect_contains(change("label='shutdown'"), "success=True");
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("life.state"), 4);
    expect_contains(change("id=1"), "success=False"); // there is no way back
}

TEST_F(Ros2Lifecycle, TellsItsStatesAndTransitions) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(managed(", begin: inactive"));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    const std::string states = asked("get_available_states", "GetAvailableStates");
    for (const std::string label : {"unconfigured", "inactive", "active", "finalized", "errorprocessing"})
        expect_contains(states, "label='" + label + "'");
    const auto count = [](const std::string& text) {
        int all = 0;
        for (std::size_t at = 0; (at = text.find("TransitionDescription(", at)) != std::string::npos; ++at)
            ++all;
        return all;
    };
    const std::string now = asked("get_available_transitions", "GetAvailableTransitions");
    EXPECT_EQ(count(now), 3) << now;
    for (const std::string label : {"cleanup", "activate", "shutdown"})
        expect_contains(now, "label='" + label + "'");
    EXPECT_EQ(count(asked("get_transition_graph", "GetAvailableTransitions")), 25);
}

TEST_F(Ros2Lifecycle, GoesBackWhereATransitionFails) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(fallible(""));
    ASSERT_TRUE(run.step());
    Events events(8);
    run.set("u", 1);
    expect_contains(change(run, "id=1"), "success=False");
    events.expect(1, "configure", 1, 10);
    events.expect(11, "transition_failure", 10, 1);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("life.state"), 1);
    run.set("u", 0);
    expect_contains(change(run, "id=1"), "success=True");
    events.expect(1, "configure", 1, 10);
    events.expect(10, "transition_success", 10, 2);
    run.set("u", 1);
    expect_contains(change(run, "id=3"), "success=False");
    events.expect(3, "activate", 2, 13);
    events.expect(31, "transition_failure", 13, 2);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("life.state"), 2);
    EXPECT_EQ(run.scalar("life.active"), 0);
    expect_contains(change(run, "label='shutdown'"), "success=False"); // there is no way back from it
    events.expect(6, "shutdown", 2, 12);
    events.expect(51, "transition_failure", 12, 4);
}

TEST_F(Ros2Lifecycle, ShowsStepsWhatIsUnderWay) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(fallible(", begin: inactive"));
    std::set<double> seen;
    std::atomic<bool> is_there{false};
    std::thread asks([&] {
        expect_contains(change("id=3"), "success=True");
        is_there = true;
    });
    while (!is_there && run.step()) {
        seen.insert(run.scalar("life.state"));
        EXPECT_EQ(run.scalar("life.active"), run.scalar("life.state") == 3);
        usleep(1000);
    }
    asks.join();
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("life.state"), 3);
    EXPECT_TRUE(seen.contains(13)) << "activating";
}

TEST_F(Ros2Lifecycle, LeadsAnErrorThroughItsProcessing) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    for (const bool is_final : {false, true}) {
        Running run(fallible(is_final ? ", begin: active" : ", begin: active, on_error: unconfigured"));
        ASSERT_TRUE(run.step());
        Events events(is_final ? 2 : 8);
        EXPECT_EQ(run.scalar("life.active"), 1);
        run.set("v", 1);
        ASSERT_TRUE(run.step());
        run.set("v", 0); // what is an error in one step is one
        const int end = is_final ? 4 : 1;
        ASSERT_TRUE(steps_until(run, [&] { return run.scalar("life.state") == end; }));
        EXPECT_EQ(run.scalar("life.active"), 0);
        events.expect(99, "transition_error", 3, 15);
        if (is_final) {
            events.expect(61, "transition_failure", 15, 4);
            expect_contains(change(run, "id=1"), "success=False"); // there is no way back
            continue;
        }
        events.expect(60, "transition_success", 15, 1);
        expect_contains(asked("get_state", "GetState"), "State(id=1, label='unconfigured')");
        expect_contains(change(run, "id=1"), "success=True");
        events.expect(1, "configure", 1, 10);
        events.expect(10, "transition_success", 10, 2);
        run.set("v", 1).set("u", 1);
        expect_contains(change(run, "id=3"), "success=False");
        ASSERT_TRUE(steps_until(run, [&] { return run.scalar("life.state") == 4; }))
            << "it failed there, too";
    }
}

TEST_F(Ros2Lifecycle, FailsATransitionThatNoStepSees) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(fallible(""));
    ASSERT_TRUE(run.step());
    expect_contains(change("id=1"), "success=False");
    expect_contains(asked("get_state", "GetState"), "State(id=1, label='unconfigured')");
}

/// Wherever the failing block stands in the order of the step.
TEST_F(Ros2Lifecycle, IsFinalizedByTheErrorOfARunThatEnds) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const std::string life = "  life: {block: Ros2/Lifecycle, begin: active}\n",
                      fails = "  s: {block: Ros2/Subscribe, topic: nobody, timeout: 2}\n";
    for (const auto& blocks : {life + fails, fails + life, life}) {
        Running run(model(blocks, "", "", ", name: lab"));
        ASSERT_TRUE(run.step());
        Events events(2);
        if (blocks == life) { // and by nothing else
            run.simulation.stop();
            events.end();
            EXPECT_EQ(events.line(), "");
            continue;
        }
        while (run.step()) usleep(1000);
        expect_contains(run.simulation.failure(), "s: no message of 'nobody' came within");
        run.simulation.stop();
        events.expect(99, "transition_error", 3, 15);
        events.expect(61, "transition_failure", 15, 4);
    }
}

TEST_F(Ros2Lifecycle, CostsTheStepNoHeap) {
    Running run(fallible(", begin: active"));
    for (int k = 0; k < 20; ++k) {
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (bf::test::heap_is_counted() && k > 0) {
            ASSERT_EQ(bf::test::heap_calls(), before);
        }
    }
    EXPECT_EQ(run.scalar("life.active"), 1);
}

} // namespace bf::ros2::test
