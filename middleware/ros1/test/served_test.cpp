// Our world as a robot of ROS 1, which rospy drives.
#include "master.hpp"
#include "running.hpp"
#include "served.hpp"

#include <Eigen/Geometry>
#include <sstream>

namespace bf::ros1::test {
namespace {

using middleware::test::diagram;
using middleware::test::icub;
using middleware::test::icub_world;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

/// `bf serve` of a robot in a namespace, whose messages come with what it prints.
class Serving {
  public:
    explicit Serving(const std::string& name_space, const std::string& options = "",
                     const std::string& blocks = "")
        : program_({"/bin/sh", "-c",
                    "exec '" BF_PROGRAM "' serve '" +
                        folder_.write("leg.yaml",
                                      diagram(icub + icub_world + blocks, "", blocks.empty() ? "" : "Ros1")) +
                        "' --ros1 " + name_space + " " + options + " 2>&1"}) {}
    std::string line() {
        for (;;) // a busy computer is told what takes long
            if (const auto next = program_.line(); next.find("elaborating") == std::string::npos) return next;
    }
    int end(int signal) { return program_.end(signal); }
    const Folder& folder() const { return folder_; }

  private:
    const Folder folder_;
    Program program_;
};

std::vector<double> numbers_of(const std::string& line) {
    std::istringstream words(line);
    std::vector<double> all;
    for (double each; words >> each;) all.push_back(each);
    return all;
}

std::string called(const std::string& service, const std::string& type, const std::string& request = "None") {
    Peer peer({"call", service, type, request});
    return peer.line();
}
std::string seen(const std::string& type, const std::string& topic, const std::string& expression) {
    Peer peer({"see", type, topic, expression});
    return peer.line();
}

} // namespace

using Ros1Served = WithMaster;

/// The oracle is the world in a diagram that computes the same efforts.
TEST_F(Ros1Served, IsLedByRospyStepByStepToTheNumbersOfADiagram) {
    constexpr int steps = 200;
    Running direct(diagram(icub + icub_world +
                               "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
                               "  s_dot: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints "
                               "Velocity}\n"
                               "  P: {block: Gain, K: -20}\n  D: {block: Gain, K: 1}\n"
                               "  law: {block: Sum, signs: +-}\n"
                               "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Torque}\n",
                           "  s: P\n  s_dot: D\n  P: law.u1\n  D: law.u2\n  law: drive\n"));
    Serving served("/led");
    Peer peer({"effort", "/led", "20", "1", std::to_string(steps)});
    ASSERT_EQ(peer.line(), "ready");
    for (int k = 0; k < steps; ++k) {
        ASSERT_TRUE(direct.step()) << direct.simulation.failure();
        const std::string line = peer.line();
        const auto numbers = numbers_of(line);
        ASSERT_EQ(numbers.size(), 4U) << line;
        EXPECT_NEAR(numbers[0], 1e-3 * k, 1e-9) << "every step is seen once";
        const Matrix s = direct.get("s.y");
        for (int i = 0; i < 3; ++i) EXPECT_EQ(numbers[static_cast<std::size_t>(i) + 1], s(i)) << k;
    }
    EXPECT_GT(direct.get("s.y").norm(), 1e-4) << "it moved";
    expect_contains(served.line(), "serves the ROS 1 robot in the namespace /led");
    expect_contains(served.line(), "a controller has come");
    EXPECT_EQ(served.end(SIGINT), 130);
}

/// The oracle is the world in a diagram, which stands at its begin.
TEST_F(Ros1Served, ShowsItsSensorsAndItsTime) {
    Running direct(diagram(icub + icub_world +
                           "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
                           "  wrench: {block: WholeBodyToolbox/GetSensor, sensor: l_foot_ft_sensor}\n"
                           "  imu: {block: WholeBodyToolbox/GetSensor, kind: imu}\n"));
    ASSERT_TRUE(direct.step()) << direct.simulation.failure();
    Serving served("/seen");
    const auto names = seen("sensor_msgs/JointState", "/seen/joint_states", "(*m.name, len(m.effort))");
    EXPECT_EQ(names, "('l_hip_pitch', 'l_knee', 'l_ankle_roll', 3)");
    const auto wrench = numbers_of(
        seen("geometry_msgs/WrenchStamped", "/seen/l_foot_ft_sensor/wrench",
             "' '.join(repr(getattr(v, i)) for v in (m.wrench.force, m.wrench.torque) for i in 'xyz')"));
    ASSERT_EQ(wrench.size(), 6U);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(wrench[static_cast<std::size_t>(i)], direct.get("wrench.y")(i));
    const auto topic = seen("sensor_msgs/JointState", "/seen/joint_states",
                            "[t for t, _ in rospy.get_published_topics('/seen') if t.endswith('/imu')][0]");
    const auto imu = numbers_of(
        seen("sensor_msgs/Imu", topic,
             "' '.join(repr(getattr(v, i)) for v in (m.linear_acceleration, m.angular_velocity) for i in "
             "'xyz') + ' ' + ' '.join(repr(getattr(m.orientation, i)) for i in 'wxyz')"));
    ASSERT_EQ(imu.size(), 10U);
    const Matrix base = direct.get("imu.y");
    for (int i = 0; i < 6; ++i) EXPECT_EQ(imu[static_cast<std::size_t>(i)], base(3 + i)) << i;
    const Eigen::Matrix3d R = Eigen::Quaterniond(imu[6], imu[7], imu[8], imu[9]).toRotationMatrix();
    EXPECT_LT((R - Eigen::AngleAxisd(base(2), Eigen::Vector3d::UnitZ()) *
                       Eigen::AngleAxisd(base(1), Eigen::Vector3d::UnitY()) *
                       Eigen::AngleAxisd(base(0), Eigen::Vector3d::UnitX()).toRotationMatrix())
                  .norm(),
              1e-12);
    EXPECT_EQ(seen("rosgraph_msgs/Clock", "/clock", "m.clock.to_sec()"), "0.0");
}

TEST_F(Ros1Served, IsSteppedPausedAndTakenBackByItsServices) {
    Serving served("/called");
    expect_contains(called("/called/robot/step", "std_srvs/Trigger"), "success: True");
    expect_contains(called("/called/robot/step", "std_srvs/Trigger"), "success: True");
    EXPECT_EQ(seen("rosgraph_msgs/Clock", "/clock", "m.clock.to_nsec()"), "2000000");
    expect_contains(called("/called/robot/pause", "std_srvs/SetBool", "r.data = False"), "success: True");
    usleep(300'000);
    expect_contains(called("/called/robot/pause", "std_srvs/SetBool", "r.data = True"), "success: True");
    const auto stands = [] { return seen("rosgraph_msgs/Clock", "/clock", "m.clock.to_sec()"); };
    const std::string then = stands();
    EXPECT_GT(std::stod(then), 0.1) << "it ran while it was not paused";
    EXPECT_EQ(stands(), then);
    expect_contains(called("/called/robot/reset", "std_srvs/Trigger"), "success: True");
    EXPECT_EQ(stands(), "0.0");
}

TEST_F(Ros1Served, RefusesToStepWhatGoesByTheClock) {
    Serving served("/clocked", "--realtime --priority 0 --overrun skip");
    EXPECT_EQ(
        called("/clocked/robot/step", "std_srvs/Trigger"),
        "success: False | message: \"the robot's time goes by the clock; serve it without --realtime\"");
}

TEST_F(Ros1Served, IsLedInLockstepByADiagramToTheSameNumbers) {
    for (const int ratio : {1, 3}) {
        const std::string name = "/lock" + std::to_string(ratio);
        Serving served(name);
        middleware::test::expect_each_step_at_its_time(
            "  world: {block: Ros1/Robot, period: 0.001, namespace: " + name +
                ", start_timeout: 30, step_size: 0.001}\n",
            "Ros1", ratio);
    }
}

TEST_F(Ros1Served, TellsThatItsControllerHasLeftWhichEndsInOrder) {
    for (const std::string way : {"", "--realtime --priority 0 --overrun skip --watchdog 0"})
        for (const std::string mode : {"Torque", "Position", ""}) {
            if (!way.empty() && mode.empty()) continue; // who only looks neither comes nor leaves
            Serving served("/left_by", way);
            const std::string drive =
                "  c: {block: Constant, value: [0 0 0]}\n  drive: {block: WholeBodyToolbox/SetReferences, "
                "control_type: " +
                mode + "}\n";
            Program run({BF_PROGRAM, "run",
                         served.folder().write(
                             "drive.yaml",
                             diagram(icub +
                                         "  world: {block: Ros1/Robot, period: 0.001, namespace: /left_by, "
                                         "start_timeout: 60" +
                                         (way.empty() ? ", step_size: 0.001}\n" : "}\n") +
                                         (mode.empty() ? "" : drive),
                                     mode.empty() ? "" : "  c: drive\n", "Ros1")),
                         "--stop", "Inf", "--quiet"});
            expect_contains(served.line(), "serves the ");
            expect_contains(served.line(), "a controller has come");
            EXPECT_EQ(run.end(SIGINT), 130);
            expect_contains(served.line(), "the controller has left; its joints hold");
        }
}

TEST_F(Ros1Served, TellsThatItsControllerHasDiedWhichIsKilled) {
    Serving served("/killed");
    Peer peer({"effort", "/killed", "20", "1", "1000000"});
    ASSERT_EQ(peer.line(), "ready");
    ASSERT_NE(peer.line(), "");
    expect_contains(served.line(), "serves the ");
    expect_contains(served.line(), "a controller has come");
    peer.end();
    expect_contains(served.line(), "the controller has died; its joints hold");
}

TEST_F(Ros1Served, TellsOfTwoControllers) {
    Serving served("/torn_too");
    expect_contains(served.line(), "serves the ");
    const auto sends = [](const std::string& topic) {
        return std::make_unique<Peer>(std::vector<std::string>{
            "send", "std_msgs/Float64MultiArray", "/torn_too/" + topic + "/command", "50", "m.data=[0.0]*3"});
    };
    const auto one = sends("effort_controller"), other = sends("velocity_controller");
    expect_contains(served.line(), "a controller has come");
    const std::string told = served.line();
    expect_contains(told, ": the node '/peer_");
    expect_contains(told, "' and the node '/peer_");
    expect_contains(told, "' send commands to it by turns; end one of them");
}

TEST_F(Ros1Served, EndsItsDiagramWhereItsServerDies) {
    auto served = std::make_unique<Serving>("/dies");
    Running run(diagram(icub + "  world: {block: Ros1/Robot, period: 0.001, namespace: /dies, start_timeout: "
                               "30, step_size: 0.001}\n",
                        "", "Ros1"));
    for (int k = 0; k < 10; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    }
    served->end(SIGKILL);
    int steps = 0;
    while (run.step()) ASSERT_LT(++steps, 10);
    expect_contains(run.simulation.failure(), "no state for 1");
}

TEST_F(Ros1Served, RefusesADiagramThatStepsWhatGoesByTheClock) {
    Serving served("/goes", "--realtime --priority 0 --overrun skip");
    expect_contains(served.line(), "serves the ");
    expect_contains(
        refusal(
            diagram(icub + "  world: {block: Ros1/Robot, period: 0.001, namespace: /goes, start_timeout: 30, "
                           "step_size: 0.001}\n",
                    "", "Ros1")),
        "it does not stand still: the robot's time goes by the clock; serve it without --realtime");
}

TEST_F(Ros1Served, FollowsATrajectoryToItsEndAndStaysThere) {
    Serving served("/path", "--realtime --priority 0 --overrun skip");
    Peer peer({"path", "/path", "l_knee", "-0.4"});
    EXPECT_NEAR(std::stod(peer.line()), -0.4, 0.03);
    peer.end();
    usleep(500'000);
    EXPECT_NEAR(std::stod(seen("sensor_msgs/JointState", "/path/joint_states", "m.position[1]")), -0.4, 0.03)
        << "who sent it is gone, and its joints stay";
}

TEST_F(Ros1Served, LeavesOutWhatIsOfAnotherRobot) {
    for (const auto& [what, words] : std::vector<std::pair<std::string, std::vector<std::string>>>{
             {"a trajectory that names 'elbow', but the joints are l_hip_pitch, l_knee, l_ankle_roll",
              {"send", "trajectory_msgs/JointTrajectory", "/left/joint_trajectory_controller/command", "50",
               "m.joint_names=['elbow']"}},
             {"nan for the joint 'l_knee'",
              {"send", "std_msgs/Float64MultiArray", "/left/effort_controller/command", "50",
               "m.data=[1.0,float('nan'),2.0]"}}}) {
        Serving served("/left");
        expect_contains(served.line(), "serves the ");
        Peer peer(words);
        const std::string told = served.line();
        expect_contains(told, "left out what came to the topic '/left/");
        expect_contains(told, "_controller/command': the node '/peer_");
        expect_contains(told, " sends " + what);
        expect_contains(told, "; so are those that follow");
    }
}

TEST_F(Ros1Served, LeavesOutMessagesOfAnotherType) {
    Serving served("/other");
    expect_contains(served.line(), "serves the ");
    Peer text({"send", "std_msgs/String", "/other/effort_controller/command", "50", "m.data='x'"});
    const std::string told = served.line();
    expect_contains(told,
                    "left out what came to the topic '/other/effort_controller/command': the node '/peer_");
    expect_contains(
        told, " sends std_msgs/String (992ce8a1687cec8c8bd883ec73ca41d1), not std_msgs/Float64MultiArray");
}

TEST_F(Ros1Served, IsTheOnlyOneOfItsName) {
    auto first = std::make_unique<Serving>("/twice");
    expect_contains(first->line(), "serves the ");
    const std::string refusal = "another program is the node '/twice/robot' of ROS 1; end it, or give this "
                                "one another name or namespace";
    {
        Serving second("/twice");
        expect_contains(second.line(), refusal);
    }
    first->end(SIGKILL); // the master still knows it
    Serving third("/twice");
    expect_contains(third.line(), "serves the ");
}

/// A program is one node of ROS 1, whose name its diagram says.
TEST_F(Ros1Served, IsShownBesideWhatItsDiagramTells) {
    Serving served("/both", "",
                   "  node: {block: Ros1/Node, name: lab}\n"
                   "  p: {block: Ros1/Publish, topic: told, latch: true}\n");
    expect_contains(called("/both/robot/step", "std_srvs/Trigger"), "success: True");
    EXPECT_EQ(seen("std_msgs/Float64", "/told", "m._connection_header['callerid']"), "/lab");
    EXPECT_EQ(seen("sensor_msgs/JointState", "/both/joint_states", "m._connection_header['callerid']"),
              "/lab");
}

TEST_F(Ros1Served, BeginsNotAgainWhereItIsRecorded) {
    const Folder folder;
    Serving served("/recorded", "--record " + (folder.path / "run.mcap").string());
    expect_contains(called("/recorded/robot/reset", "std_srvs/Trigger"),
                    "success: False | message: \"this model does not begin again: it is recorded");
}

} // namespace bf::ros1::test
