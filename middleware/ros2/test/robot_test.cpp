// Robots behind topics: ours that rclpy drives, and theirs that diagrams drive.
#include "bf/core/interrupt.hpp"
#include "bf/middleware/served_robot.hpp"
#include "bf/middleware/topic_robot.hpp"
#include "cycles.hpp"
#include "end.hpp"
#include "patience.hpp"
#include "peer.hpp"
#include "served.hpp"

#include <atomic>
#include <cmath>
#include <future>
#include <optional>

namespace bf::ros2::test {
namespace {

using middleware::HostOptions;
using middleware::test::diagram;
using middleware::test::expect_refusal_with;
using middleware::test::icub;
using middleware::test::icub_world;
using middleware::test::refusal_with;
using middleware::test::Served;
using middleware::test::waiting;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::unique_ptr<middleware::RobotEnd> end_in(const std::string& name_space, bool waits) {
    return make_end({.name = "robot", .name_space = name_space, .arguments = {}}, {}, waits);
}
/// A served robot whose time goes by the clock.
struct InRealTime : Served {
    explicit InRealTime(const std::string& name_space, double watchdog = 0.2)
        : Served(end_in(name_space, false),
                 diagram(icub + icub_world + "  sync: {block: WholeBodyToolbox/RealTimeSynchronizer}\n"),
                 {.waits = false, .watchdog = watchdog}) {
        run();
    }
};
/// Shows the robot of a world in the namespace /icub, too, with what is told of it.
std::unique_ptr<middleware::ServedRobot> show(const Served& served) {
    auto shown = middleware::make_served_robot("world",
                                               {.path = "world",
                                                .is_alone = true,
                                                .device = *served.device,
                                                .robot = *served.robot,
                                                .options = {},
                                                .host = {}},
                                               end_in("/icub", true));
    shown->start(0.001);
    return shown;
}
std::string remote(const std::string& blocks, const std::string& connections = "",
                   const std::string& settings = "") {
    std::string text =
        diagram(icub + "  world: {block: Ros2/Robot, period: 0.001, namespace: /icub, start_timeout: 30" +
                    settings + "}\n" + blocks,
                connections, "Ros2");
    return text;
}
std::vector<double> numbers_of(const std::string& line) {
    std::istringstream words(line);
    std::vector<double> all;
    for (double each; words >> each;) all.push_back(each);
    return all;
}

} // namespace

using Ros2Robot = Alone;
using Ros2Served = Alone;

TEST_F(Ros2Robot, IsDrivenByEffortsVelocitiesAndPositions) {
    for (const auto& [mode, reference, is_there] :
         std::vector<std::tuple<std::string, Eigen::Vector3d, std::function<bool(const Running&)>>>{
             {"Position Direct",
              {0.1, -0.5, 0.05},
              [](const Running& run) {
                  return (run.get("world.s") - Matrix(Eigen::Vector3d(0.1, -0.5, 0.05))).norm() < 0.02;
              }},
             {"Position",
              {0.1, -0.3, 0.05},
              [](const Running& run) {
                  return (run.get("world.s") - Matrix(Eigen::Vector3d(0.1, -0.3, 0.05))).norm() < 0.02;
              }},
             {"Velocity", {0, -0.2, 0}, [](const Running& run) { return run.get("world.s")(1) < -0.1; }},
             {"Torque", {0, -3, 0}, [](const Running& run) { return run.get("world.s")(1) < -0.1; }}}) {
        InRealTime served("/icub");
        Running run(remote("  c: {block: Constant, value: [" + std::to_string(reference[0]) + " " +
                               std::to_string(reference[1]) + " " + std::to_string(reference[2]) +
                               "]}\n  drive: {block: WholeBodyToolbox/SetReferences, control_type: " + mode +
                               "}\n",
                           "  c: drive\n"));
        bool is_done = false;
        for (int k = 0; k < 20'000 && !is_done; ++k) {
            ASSERT_TRUE(run.step()) << mode << ": " << run.simulation.failure();
            is_done = is_there(run);
        }
        EXPECT_TRUE(is_done) << mode << " " << run.get("world.s").transpose();
        EXPECT_LT(run.scalar("world.age"), 1);
        run.simulation.stop();
    }
}

/// The oracle is the world itself, which stands still.
TEST_F(Ros2Robot, MeasuresWhatItsTopicsSay) {
    Served served(end_in("/icub", true), diagram(icub + icub_world));
    served.run();
    const std::string imu = served.robot->sensors(middleware::Sensor::imu).at(0);
    Running run(
        remote("  w: {block: WholeBodyToolbox/GetSensor, sensor: foot}\n"
               "  i: {block: WholeBodyToolbox/GetSensor, kind: imu, sensor: base}\n",
               "", ", wrenches: \"{'foot=l_foot_ft_sensor/wrench'}\", imus: \"{'base=" + imu + "/imu'}\""));
    bool is_there = false;
    for (int k = 0; k < 5000 && !is_there; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        is_there = run.get("w.y").norm() > 0 && run.get("i.y").norm() > 0;
    }
    ASSERT_TRUE(is_there);
    Eigen::VectorXd wrench(6), base(12);
    ASSERT_TRUE(served.robot->read(middleware::Sensor::wrench, "l_foot_ft_sensor", wrench));
    ASSERT_TRUE(served.robot->read(middleware::Sensor::imu, imu, base));
    EXPECT_GT(wrench.head<3>().norm(), 1) << "the foot's weight";
    EXPECT_LT((run.get("w.y") - Matrix(wrench)).norm(), 1e-12);
    EXPECT_LT((run.get("i.y") - Matrix(base)).norm(), 1e-9) << "angles go through a quaternion";
}

TEST_F(Ros2Robot, HasTheTimeOfItsSimulator) {
    InRealTime served("/icub");
    usleep(1'000'000);
    Running run(remote("", "", ", use_sim_time: true"));
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    }
    const double time = run.scalar("world.time");
    served.end_run();
    EXPECT_GT(time, 0.5) << "it began before the diagram did";
    EXPECT_LE(time, served.time());
    EXPECT_NEAR(std::remainder(time, 1e-3), 0, 1e-9) << "a time of its states";
}

TEST_F(Ros2Robot, IsToldOfItsJointsInAnyOrderBySeveralPrograms) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const std::string type = "sensor_msgs/msg/JointState", topic = "/icub/joint_states";
    Peer knee({"send", type, topic, "100",
               "m.name=['other','l_knee']; m.position=[9.0,-0.5]; m.velocity=[9.0,0.7 if k%2==0 else "
               "float('nan')]; "
               "m.effort=[9.0,2.0]"});
    Peer others({"send", type, topic, "100",
                 "m.name=['l_ankle_roll','l_hip_pitch']; m.position=[0.1,0.2+1e-3*min(k,100)]; "
                 "m.velocity=[0.3,0.4]"});
    ASSERT_EQ(knee.line(), "ready");
    ASSERT_EQ(others.line(), "ready");
    Running run(remote(""));
    bool is_there = false;
    for (int k = 0; k < 20'000 && !is_there; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        is_there = std::abs(run.get("world.s")(0) - 0.3) < 1e-12;
    }
    EXPECT_EQ(run.get("world.s"), Matrix(Eigen::Vector3d(0.2 + 1e-3 * 100, -0.5, 0.1)));
    EXPECT_EQ(run.get("world.s_dot"), Matrix(Eigen::Vector3d(0.4, 0.7, 0.3)))
        << "what is no number is not taken";
    EXPECT_EQ(run.get("world.tau_measured"), Matrix(Eigen::Vector3d(0, 0, 0)))
        << "the effort of one joint is not that of all";
    others.end();
    for (int k = 0; k < 20'000 && run.step(); ++k) continue;
    expect_contains(run.simulation.failure(), "no state for 1");
}

TEST_F(Ros2Robot, HasTheTimeOfItsOwnJointsWhichDoesNotGoBack) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const std::string type = "sensor_msgs/msg/JointState", topic = "/icub/joint_states";
    const auto tells = [&](const std::string& names, const std::string& sec) {
        return Peer({"send", type, topic, "200",
                     "m.name=" + names + "; m.position=m.velocity=[0.1]*len(m.name); m.header.stamp.sec=" +
                         sec + "+k//200; m.header.stamp.nanosec=k%200*5000000"});
    };
    Peer first = tells("['l_hip_pitch','l_knee']", "100"), second = tells("['l_ankle_roll']", "50"),
         other = tells("['elbow']", "1000");
    for (auto* peer : {&first, &second, &other}) ASSERT_EQ(peer->line(), "ready");
    Running run(remote("", "", ", use_sim_time: true"));
    double last = 0;
    for (int k = 0; k < 300; ++k, usleep(1000)) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_GE(run.scalar("world.time"), last);
        last = run.scalar("world.time");
        ASSERT_LT(last, 500);
    }
    EXPECT_GE(last, 100);
}

TEST_F(Ros2Robot, EndsItsDiagramWhereAMeasurementIsGoneOrItsTimeJumpsAhead) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const std::string numbers = "m.name=['l_hip_pitch','l_knee','l_ankle_roll']; m.position=[0.1]*3; "
                                "m.header.stamp.sec=100+k//200; m.header.stamp.nanosec=k%200*5000000; "
                                "m.velocity=[0.1]*3; ";
    for (const auto& [changes, why] : std::vector<std::pair<std::string, std::string>>{
             {"m.velocity=m.velocity if k<2000 else []", "it tells no velocity of 'l_ankle_roll' any more"},
             {"m.velocity[1]=0.1 if k<2000 else float('inf')", "the velocity of 'l_knee' is inf"},
             {"m.header.stamp.sec+=0 if k<2000 else 1000", "its time jumped ahead from t = 10"}}) {
        Peer peer({"send", "sensor_msgs/msg/JointState", "/icub/joint_states", "200", numbers + changes});
        ASSERT_EQ(peer.line(), "ready");
        Running run(remote("", "", ", use_sim_time: true, silence: 10"));
        for (int k = 0; k < 20'000 && run.step(); ++k) continue;
        expect_contains(run.simulation.failure(), why);
    }
}

TEST_F(Ros2Robot, IsNotDrivenByTwoDiagrams) {
    InRealTime served("/icub");
    const std::string drive = "  c: {block: Constant, value: [0 0 0]}\n  drive: {block: "
                              "WholeBodyToolbox/SetReferences, control_type: Position Direct}\n";
    const std::string second = remote(drive, "  c: drive\n", ", node: second");
    {
        Running first(remote(drive, "  c: drive\n"));
        expect_refusal_with("the node '/icub/blockfactory' sends commands to it; end it first", second);
    }
    Running next(second);
    EXPECT_TRUE(next.step()) << next.simulation.failure();
}

/// A program that begins later does not see the one that was killed; this one does, and waits until it is
/// forgotten.
TEST_F(Ros2Robot, IsDrivenByWhoeverWaitsSoonAfterAnotherProgramWasKilled) {
    InRealTime served("/icub");
    const std::string drive = "  c: {block: Constant, value: [0 0 0]}\n  drive: {block: "
                              "WholeBodyToolbox/SetReferences, control_type: Position Direct}\n";
    const Folder folder;
    Program first({BF_PROGRAM, "run", folder.write("drive.yaml", remote(drive, "  c: drive\n")), "--stop",
                   "Inf", "--quiet"});
    for (int k = 0; k < 6000 && served.events() != "came"; ++k) usleep(10'000);
    const std::string next =
        waiting(remote(drive, "  c: drive\n", ", node: next"), "15"); // less than DDS's lease of 20 s
    std::atomic<bool> is_killed{false};
    const auto killed = std::async(std::launch::async, [&] {
        usleep(2'000'000);
        is_killed = true;
        first.end(SIGKILL);
    });
    Running run(next);
    EXPECT_TRUE(is_killed);
    EXPECT_TRUE(run.step()) << run.simulation.failure();
}

/// The oracle is a subscription of rclpy, which loses nothing.
TEST_F(Ros2Robot, ItsZerosArriveWhenARunEnds) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Peer states({"send", "sensor_msgs/msg/JointState", "/icub/joint_states", "200",
                 "m.name=['l_hip_pitch','l_knee','l_ankle_roll']; m.position=m.velocity=[0.1]*3"});
    Peer efforts({"hear", "std_msgs/msg/Float64MultiArray", "/icub/effort_controller/commands", "1000000"});
    for (auto* peer : {&states, &efforts}) ASSERT_EQ(peer->line(), "ready");
    const Folder folder;
    const std::string model =
        folder.write("ends.yaml", remote("  c: {block: Constant, value: [1 2 3]}\n  drive: {block: "
                                         "WholeBodyToolbox/SetReferences, control_type: Torque}\n",
                                         "  c: drive\n"));
    for (int k = 0; k < 20; ++k) {
        Program run({BF_PROGRAM, "run", model, "--stop", "0.02", "--quiet"});
        std::string line;
        while (line.find("[0.0, 0.0, 0.0]") == std::string::npos)
            ASSERT_NE(line = efforts.line(), "") << "in run " << k;
        run.line(); // when it has ended
    }
}

TEST_F(Ros2Robot, IsLedInLockstepToTheSameNumbers) {
    for (const int ratio : {1, 3}) {
        Served served(end_in("/icub", true), diagram(icub + icub_world));
        served.run();
        middleware::test::expect_each_step_at_its_time(
            "  world: {block: Ros2/Robot, period: 0.001, namespace: /icub, start_timeout: 30, step_size: "
            "0.001}\n",
            "Ros2", ratio);
    }
}

TEST_F(Ros2Robot, EndsItsDiagramWhereItsServerDiesOrBeginsAgain) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const Folder folder;
    const std::string model = folder.write("leg.yaml", diagram(icub + icub_world));
    for (const bool is_killed : {true, false}) {
        Program served({BF_PROGRAM, "serve", model, "--ros2", "/icub", "--quiet"});
        Running run(remote("", "", ", step_size: 0.001"));
        for (int k = 0; k < 10; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
        if (is_killed) {
            served.end();
        } else {
            Peer reset({"call", "/icub/robot/reset", "std_srvs/srv/Trigger"});
            expect_contains(reset.line(), "success=True");
        }
        int steps = 0;
        while (run.step()) ASSERT_LT(++steps, 10) << "states of another time are not those of this one";
        expect_contains(run.simulation.failure(),
                        is_killed ? "no state for 1"
                                  : "it has begun again, as its time went back from t = 0.0");
    }
}

TEST_F(Ros2Robot, RefusesToStepWhatGoesByTheClock) {
    InRealTime served("/icub");
    expect_contains(
        refusal(remote("", "", ", step_size: 0.001")),
        "it does not stand still: the robot's time goes by the clock; serve it without --realtime");
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Peer states({"send", "sensor_msgs/msg/JointState", "/other/joint_states", "100",
                 "m.name=['l_hip_pitch','l_knee','l_ankle_roll']; m.position=m.velocity=[0.1]*3"});
    std::string text = remote("", "", ", step_size: 0.001");
    text.replace(text.find("/icub"), 5, "/other");
    expect_refusal_with("it has no services 'robot/step' and 'robot/pause'", text);
}

TEST_F(Ros2Robot, LeavesNothingBehindHoweverOftenBothSidesStart) {
    middleware::test::expect_no_leak([] {
        Served served(end_in("/icub", true), diagram(icub + icub_world));
        served.run();
        Running run(remote("  c: {block: Constant, value: [0 0 0]}\n  drive: {block: "
                           "WholeBodyToolbox/SetReferences, control_type: Torque}\n",
                           "  c: drive\n", ", step_size: 0.001"));
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
    });
}

TEST_F(Ros2Robot, SaysThatItsStartIsInterrupted) {
    static const volatile std::sig_atomic_t flag = SIGINT;
    look_for_interrupt(&flag);
    const std::string why = refusal(remote(""));
    look_for_interrupt(nullptr);
    EXPECT_TRUE(why.ends_with(interrupted)) << why;
}

TEST_F(Ros2Robot, SaysWhatIsMissing) {
    const auto wrong = [](const std::string& settings) { return waiting(remote("", "", settings), "2"); };
    expect_contains(refusal(wrong("")),
                    "world: ROS 2 robot in the namespace /icub: no message came on the topic 'joint_states' "
                    "within 1.6 s; start the robot, or correct namespace and states");
    expect_contains(refusal(wrong(", imus: \"{'base'}\"")), "the sensor 'base' is not given as name=topic");
    InRealTime served("/icub");
    const std::string why =
        refusal_with("tells nothing of r_knee", wrong(", joints: \"{'l_knee', 'r_knee'}\""));
    expect_contains(why, "the topic 'joint_states' tells nothing of r_knee within ");
    expect_contains(why, " s; it has l_hip_pitch, l_knee, l_ankle_roll");
    Running deaf(
        remote("  c: {block: Constant, value: [0 0 0]}\n  drive: {block: WholeBodyToolbox/SetReferences, "
               "control_type: Torque}\n",
               "  c: drive\n", ", effort: nobody/commands"));
    for (int k = 0; k < 5000 && deaf.step(); ++k) continue;
    expect_contains(deaf.simulation.failure(), "ROS 2 robot in the namespace /icub: it refuses the mode "
                                               "Torque: nobody listens to 'nobody/commands'");
}

TEST_F(Ros2Served, TellsThatItsControllerHasLeftWhichEndsInOrder) {
    for (const bool is_led : {true, false})
        for (const std::string mode : {"Torque", "Position", ""}) {
            std::optional<InRealTime> by_the_clock;
            std::optional<Served> led;
            Served& served = is_led ? led.emplace(end_in("/icub", true), diagram(icub + icub_world))
                                    : by_the_clock.emplace("/icub", 0);
            if (is_led) led->run();
            const std::string drive =
                "  c: {block: Constant, value: [0 0 0]}\n  drive: {block: WholeBodyToolbox/SetReferences, "
                "control_type: " +
                mode + "}\n";
            Running run(remote(mode.empty() ? "" : drive, mode.empty() ? "" : "  c: drive\n",
                               is_led ? ", step_size: 0.001" : ""));
            for (int k = 0; k < 50; ++k) {
                ASSERT_TRUE(run.step()) << run.simulation.failure();
            }
            run.simulation.stop();
            std::string events;
            for (int k = 0; k < 300 && events.find("left") == std::string::npos; ++k, usleep(10'000))
                if (const auto next = served.events(); !next.empty())
                    events += (events.empty() ? "" : " ") + next;
            usleep(300'000); // its topics go, too
            EXPECT_EQ(events + served.events(), is_led || !mode.empty() ? "came left" : "")
                << mode << (is_led ? " led" : "") << ": who only looks neither comes nor leaves";
        }
}

TEST_F(Ros2Served, TellsThatItsControllerHasDiedWhichIsKilled) {
    Served served(end_in("/icub", true), diagram(icub + icub_world));
    served.run();
    const Folder folder;
    Program run({BF_PROGRAM, "run", folder.write("look.yaml", remote("", "", ", step_size: 0.001")), "--stop",
                 "Inf", "--quiet"});
    std::string events;
    const auto wait_for = [&](const std::string& event) {
        for (int k = 0; k < 6000 && events.find(event) == std::string::npos; ++k, usleep(10'000))
            events += served.events();
    };
    wait_for("came");
    run.end(SIGKILL);
    wait_for("died");
    EXPECT_EQ(events, "camedied");
}

TEST_F(Ros2Served, IsSteppedByEachCommandOfAProgramThatIsNotOurs) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    std::vector<std::string> runs;
    for (int k = 0; k < 2; ++k) {
        Served served(end_in("/icub", true), diagram(icub + icub_world));
        served.run();
        Peer peer({"effort", "/icub", "20", "1", "200"});
        ASSERT_EQ(peer.line(), "ready");
        std::string all, line;
        for (int i = 0; i < 200; ++i) {
            line = peer.line();
            const auto numbers = numbers_of(line);
            ASSERT_EQ(numbers.size(), 4U) << line;
            EXPECT_NEAR(numbers[0], 1e-3 * i, 1e-9) << "every step is seen once";
            all += line + "\n";
        }
        runs.push_back(all);
        Peer next({"call", "/icub/robot/step", "std_srvs/srv/Trigger"});
        expect_contains(next.line(), "success=True");
        EXPECT_EQ(served.events(), "came died came") << "the next one is another controller";
    }
    EXPECT_EQ(runs[0], runs[1]) << "every run is the same, to the last digit";
}

/// It answers what comes, whatever the time of it is, as a state that comes twice would show.
TEST_F(Ros2Served, ShowsEachStateOnceToAProgramThatIsSometimesLate) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Served served(end_in("/icub", true), diagram(icub + icub_world));
    served.run();
    Peer peer({"answer", "/icub", "20", "0.3"});
    ASSERT_EQ(peer.line(), "ready");
    Peer other({"echo", "sensor_msgs/msg/JointState", "/icub/joint_states", "1"});
    for (int i = 0; i < 20; ++i) {
        const auto numbers = numbers_of(peer.line());
        ASSERT_EQ(numbers.size(), 4U);
        EXPECT_NEAR(numbers[0], 1e-3 * i, 1e-9);
    }
    for (int k = 0; k < 200 && served.time() < 0.0195; ++k) usleep(10'000);
    usleep(300'000);
    EXPECT_NEAR(served.time(), 0.02, 1e-9) << "there is a step for each answer";
    Peer late({"echo", "sensor_msgs/msg/JointState", "/icub/joint_states", "1"});
    EXPECT_EQ(late.line(), "ready");
    expect_contains(late.line(), "nanosec=20000000"); // what stands is there for those who come
}

TEST_F(Ros2Served, FollowsATrajectoryToItsEndAndStaysThere) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    InRealTime served("/icub");
    Peer peer({"path", "/icub", "l_knee", "-0.4"});
    EXPECT_NEAR(std::stod(peer.line()), -0.4, 0.03);
    usleep(500'000);
    EXPECT_EQ(served.events(), "came") << "who sent it is gone, and its joints stay";
}

TEST_F(Ros2Served, LeavesOutWhatIsOfAnotherRobot) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Served served(end_in("/icub", true), diagram(icub + icub_world));
    served.run();
    const auto waits_for = [&](std::uint64_t count) {
        for (int k = 0; k < 2000 && served.end->counts().rejected < count; ++k) usleep(10'000);
        return served.end->counts().rejected >= count;
    };
    {
        Peer size({"send", "std_msgs/msg/Float64MultiArray", "/icub/effort_controller/commands", "50",
                   "m.data=[1.0,2.0]"});
        EXPECT_TRUE(waits_for(3));
    }
    Peer names({"send", "trajectory_msgs/msg/JointTrajectory",
                "/icub/joint_trajectory_controller/joint_trajectory", "50", "m.joint_names=['elbow']"});
    EXPECT_TRUE(waits_for(served.end->counts().rejected + 3));
    EXPECT_EQ(served.events(), "");
    EXPECT_EQ(served.time(), 0) << "it stands still";
    names.end();
    Peer nan({"send", "std_msgs/msg/Float64MultiArray", "/icub/effort_controller/commands", "50",
              "m.data=[1.0,float('nan'),2.0]"});
    EXPECT_TRUE(waits_for(served.end->counts().rejected + 3));
    EXPECT_EQ(served.events(), "") << "it takes the robot from nobody";
}

TEST_F(Ros2Served, TellsWhatItHasLeftOut) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Served served(end_in("/other", true), diagram(icub + icub_world));
    const auto shown = show(served);
    EXPECT_EQ(shown->take_news(), "");
    const auto news = [&] {
        std::string its;
        for (int k = 0; k < 2000 && its.empty(); ++k, usleep(10'000)) its = shown->take_news();
        return its;
    };
    const std::string efforts = "/icub/effort_controller/commands";
    std::optional<Peer> peer;
    const auto sends = [&](const std::string& data) {
        peer.emplace(std::vector<std::string>{"send", "std_msgs/msg/Float64MultiArray", efforts, "50",
                                              "m.data=" + data});
    };
    sends("[1.0,2.0]");
    EXPECT_EQ(news(), "left out what came to the topic '" + efforts +
                          "': the node '/peer' sends 2 numbers, but the joints are l_hip_pitch, l_knee, "
                          "l_ankle_roll; so are those that follow");
    sends("[1.0,float('nan'),2.0]");
    EXPECT_EQ(news(), "left out what came to the topic '" + efforts +
                          "': the node '/peer' sends nan for the joint 'l_knee'; so are those that follow");
    usleep(200'000);
    EXPECT_EQ(shown->take_news(), "") << "each is told once";
}

TEST_F(Ros2Served, TellsOfTwoControllers) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Served served(end_in("/other", true), diagram(icub + icub_world));
    const auto shown = show(served);
    const auto sends = [](const std::string& topic) {
        return std::make_unique<Peer>(std::vector<std::string>{"send", "std_msgs/msg/Float64MultiArray",
                                                               "/icub/" + topic + "/commands", "50",
                                                               "m.data=[0.0]*3"});
    };
    const auto one = sends("effort_controller");
    ASSERT_EQ(one->line(), "ready");
    usleep(1'000'000);
    EXPECT_EQ(shown->take_news(), "") << "it is alone";
    const auto other = sends("velocity_controller"); // whatever their topics are
    std::string news;
    for (int k = 0; k < 3000 && news.empty(); ++k, usleep(10'000)) news = shown->take_news();
    EXPECT_EQ(news, "the node '/peer' and the node '/peer' send commands to it by turns; end one of them");
}

TEST_F(Ros2Served, TellsOfAnotherRobotOfItsName) {
    Served served(end_in("/other", true), diagram(icub + icub_world));
    const auto one = show(served);
    usleep(500'000);
    EXPECT_EQ(one->take_news(), "") << "it is alone";
    const auto other = show(served);
    for (const auto& each : {one.get(), other.get()}) {
        std::string news;
        for (int k = 0; k < 1000 && news.empty(); ++k, usleep(10'000)) news = each->take_news();
        EXPECT_EQ(news,
                  "another program shows a robot of the same name, and controllers see both by turns; end "
                  "it, or give one of them another name");
    }
}

TEST_F(Ros2Served, IsSteppedByItsService) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    Served served(end_in("/icub", true), diagram(icub + icub_world));
    served.run();
    Peer one({"call", "/icub/robot/step", "std_srvs/srv/Trigger"});
    expect_contains(one.line(), "success=True");
    Peer two({"call", "/icub/robot/step", "std_srvs/srv/Trigger"});
    expect_contains(two.line(), "success=True");
    usleep(100'000);
    EXPECT_NEAR(served.time(), 0.002, 1e-9);
    Peer on({"call", "/icub/robot/pause", "std_srvs/srv/SetBool", "r.data=False"});
    expect_contains(on.line(), "success=True");
    Peer off({"call", "/icub/robot/pause", "std_srvs/srv/SetBool", "r.data=True"});
    expect_contains(off.line(), "success=True");
    usleep(100'000);
    const double time = served.time();
    EXPECT_GT(time, 0.1) << "it ran while it was not paused";
    usleep(100'000);
    EXPECT_EQ(served.time(), time);
}

TEST_F(Ros2Served, BeginsAgainToTheSameRun) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const Folder folder;
    const std::string model = folder.write("leg.yaml", diagram(icub + icub_world));
    const auto reset = [] {
        Peer call({"call", "/icub/robot/reset", "std_srvs/srv/Trigger"});
        return call.line();
    };
    {
        Program served({BF_PROGRAM, "serve", model, "--ros2", "/icub", "--quiet"});
        std::vector<std::string> runs;
        for (int k = 0; k < 2; ++k) {
            if (k > 0) expect_contains(reset(), "success=True");
            Peer peer({"effort", "/icub", "20", "1", "50"});
            ASSERT_EQ(peer.line(), "ready");
            std::string all;
            for (int i = 0; i < 50; ++i) all += peer.line() + "\n";
            runs.push_back(all);
        }
        EXPECT_EQ(runs[0].substr(0, 4), "0.0 ");
        EXPECT_EQ(runs[0], runs[1]);
    }
    Program recorded(
        {BF_PROGRAM, "serve", model, "--ros2", "/icub", "--quiet", "--record", folder.path / "run.mcap"});
    expect_contains(reset(), "success=False, message='this model does not begin again: it is recorded");
}

} // namespace bf::ros2::test
