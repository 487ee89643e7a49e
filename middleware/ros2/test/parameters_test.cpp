// Parameters of running models, which rclpy's own client sees and changes.
#include "peer.hpp"
#include "served.hpp"

namespace bf::ros2::test {
namespace {

using toolbox::test::expect_contains;

/// What the client prints for each expression.
std::vector<std::string> answers(const std::string& node, const std::vector<std::string>& expressions) {
    std::vector<std::string> words{"parameters", node}, lines;
    words.insert(words.end(), expressions.begin(), expressions.end());
    Peer peer(words);
    for (std::size_t i = 0; i < expressions.size(); ++i) lines.push_back(peer.line());
    return lines;
}

} // namespace

using Ros2Parameters = Alone;

TEST_F(Ros2Parameters, AreVariablesAndParametersOfARun) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const Folder folder;
    const std::string model = folder.write("tuned.yaml", R"yaml(model: tuned
step: 0.001
variables:
  K: {value: 2, minimum: 0, maximum: 10, doc: of both}
  T: 0.002
  on: true
blocks:
  b: {block: Constant, value: on}
  w: {block: Constant, value: "K*[1 2]"}
  s: {block: Sine, period: T}
  a: {block: Gain, K: 3}
connections: {w: a}
record: [a.y]
)yaml");
    const std::string recording = folder.path / "run.mcap";
    Program run({BF_PROGRAM, "run", model, "--stop", "Inf", "--realtime", "--priority", "0", "--overrun",
                 "skip", "--quiet", "--ros2", "/lab", "--record", recording});
    Peer events({"echo", "rcl_interfaces/msg/ParameterEvent", "/parameter_events", "100"});
    ASSERT_EQ(events.line(), "ready");
    const auto first = answers("/lab/model", {"c.list_parameters()", "c.list_parameters(['w'], 1)",
                                              "c.get_parameters(['K', 'w.value', 'a.K', 'none'])",
                                              "c.describe_parameters(['K', 'T', 'w.value'])",
                                              "c.get_parameter_types(['K', 'w.value', 'on', 'b.value'])"});
    expect_contains(first[0], "names=['K', 'T', 'on', 'b.value', 'w.value', 's.");
    expect_contains(first[0], "'a.K'], prefixes=['a', 'b', 's', 'w']");
    expect_contains(first[1], "names=['w.value']");
    expect_contains(first[2], "type=3, bool_value=False, integer_value=0, double_value=2.0");
    expect_contains(first[2], "double_array_value=[2.0, 4.0]");
    expect_contains(first[2], "ParameterValue(type=0,");
    expect_contains(first[3], "name='K', type=3, description='of both', additional_constraints=");
    expect_contains(first[3], "FloatingPointRange(from_value=0.0, to_value=10.0, step=0.0)");
    expect_contains(first[3], "read_only=True");
    expect_contains(first[4], "types=[3, 8, 1, 1]");

    const auto set = answers(
        "/lab/model",
        {"c.set_parameters([P('K', 5.0)])", "c.get_parameters(['K', 'w.value'])",
         "c.set_parameters([P('K', 11.0)])", "c.set_parameters([P('T', 3.0)])",
         "c.set_parameters([P('w.valeu', 3.0), P('a.K', -1)])", "c.set_parameters([P('K', 'much')])",
         "c.set_parameters([P('w.value', [1.0, 2.0, 3.0])])",
         "c.set_parameters_atomically([P('a.K', 7.0), P('K', -1.0)])", "c.get_parameters(['a.K', 'K'])",
         "c.set_parameters_atomically([P('a.K', 7.0), P('K', 1.0)])", "c.get_parameters(['a.K', 'w.value'])",
         "c.set_parameters([P('on', False)])", "c.get_parameters(['b.value'])"});
    expect_contains(set[0], "successful=True");
    expect_contains(set[1], "double_value=5.0");
    expect_contains(set[1], "double_array_value=[5.0, 10.0]");
    expect_contains(set[2], "successful=False");
    expect_contains(set[2], "10");
    expect_contains(set[3], "successful=False, reason=\"'T' is fixed while the model runs: ");
    expect_contains(set[4], "reason=\"there is no parameter 'w.valeu'; list_parameters has all\"");
    expect_contains(set[4], "successful=True");
    expect_contains(set[5], "'K' is of type double, and is given string");
    expect_contains(set[6], "successful=False");
    expect_contains(set[7], "successful=False");
    expect_contains(set[8], "double_value=-1.0"); // and 5
    expect_contains(set[8], "double_value=5.0");
    expect_contains(set[9], "successful=True");
    expect_contains(set[10], "double_value=7.0");
    expect_contains(set[10], "double_array_value=[1.0, 2.0]");
    expect_contains(set[11], "successful=True");
    expect_contains(set[12], "type=1, bool_value=False");
    std::string event;
    for (int k = 0; k < 50 && event.find("/lab/model") == std::string::npos; ++k) event = events.line();
    expect_contains(event, "node='/lab/model'");
    expect_contains(event, "name='K'");
    expect_contains(event, "name='w.value'"); // which follows from it

    EXPECT_EQ(run.end(SIGINT), 130);
    Program replay({BF_PROGRAM, "replay", recording});
    expect_contains(replay.line(), "identical"); // so the changes are in the recording
}

TEST_F(Ros2Parameters, AreChangedBeforeTheNextStepOfARobotThatStandsStill) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const Folder folder;
    const std::string model = folder.write(
        "leg.yaml", middleware::test::diagram(middleware::test::icub + middleware::test::icub_world +
                                              "  c: {block: Constant, value: 1}\n"));
    Program served({BF_PROGRAM, "serve", model, "--ros2", "/icub", "--quiet"});
    const auto two =
        answers("/icub/model", {"c.set_parameters([P('c.value', 2.0)])", "c.get_parameters(['c.value'])",
                                "c.set_parameters([P('c.value', 3.0)])"});
    expect_contains(two[0], "successful=True");
    expect_contains(two[1], "double_value=2.0");
    expect_contains(two[2], "waits for the next step");
    Peer step({"call", "/icub/robot/step", "std_srvs/srv/Trigger"});
    expect_contains(step.line(), "success=True");
    const auto then = answers("/icub/model", {"c.set_parameters([P('c.value', 3.0)])"});
    expect_contains(then[0], "successful=True");
}

} // namespace bf::ros2::test
