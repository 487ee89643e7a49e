// A diagram as a managed node, whose manager is a program of rclpy.
#include "heap.hpp"
#include "models.hpp"
#include "peer.hpp"

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

} // namespace

using Ros2Lifecycle = Alone;

TEST_F(Ros2Lifecycle, RunsWhatIsEnabledWhileTheNodeIsActive) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Running run(managed());
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_EQ(run.scalar("life.state"), 1);
    Peer events({"echo", "lifecycle_msgs/msg/TransitionEvent", "/lab/transition_event", "4"});
    ASSERT_EQ(events.line(), "ready");
    usleep(500'000); // each knows the other
    const auto steps = [&](int count) {
        const double before = run.scalar("works.sum");
        for (int k = 0; k < count; ++k) EXPECT_TRUE(run.step()) << run.simulation.failure();
        return run.scalar("works.sum") - before;
    };
    EXPECT_EQ(steps(5), 0);
    const auto change = [](const std::string& how) {
        return asked("change_state", "ChangeState", "r.transition." + how);
    };
    expect_contains(change("id=3"), "success=False"); // it is not configured
    expect_contains(change("label='configure'"), "success=True");
    EXPECT_EQ(steps(5), 0);
    EXPECT_EQ(run.scalar("life.state"), 2);
    expect_contains(change("id=3"), "success=True");
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("life.active"), 1);
    EXPECT_EQ(steps(5), 5);
    for (const auto& [id, label, from, to] :
         std::vector<std::tuple<int, std::string, int, int>>{{1, "configure", 1, 10},
                                                             {10, "transition_success", 10, 2},
                                                             {3, "activate", 2, 13},
                                                             {30, "transition_success", 13, 3}}) {
        const std::string event = events.line();
        expect_contains(event, "Transition(id=" + std::to_string(id) + ", label='" + label + "')");
        expect_contains(event, "start_state=lifecycle_msgs.msg.State(id=" + std::to_string(from) + ",");
        expect_contains(event, "goal_state=lifecycle_msgs.msg.State(id=" + std::to_string(to) + ",");
    }
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
    EXPECT_EQ(count(asked("get_transition_graph", "GetAvailableTransitions")), 7);
}

TEST_F(Ros2Lifecycle, CostsTheStepNoHeap) {
    Running run(managed(", begin: active"));
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
