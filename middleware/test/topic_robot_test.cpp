// A robot behind topics that the test has itself.
#include "bf/core/block.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/remote_robot.hpp"
#include "bf/middleware/threaded_robot.hpp"
#include "bf/middleware/topic_end.hpp"
#include "bf/middleware/topic_robot.hpp"
#include "bf/middleware/turns.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <stdexcept>
#include <thread>
#include <unistd.h>
#include <utility>

namespace bf::middleware::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
using Numbers = std::vector<double>;

/// What goes over the network, and what a robot there does.
struct Network {
    std::map<std::string, std::vector<Numbers>> sent; ///< by topic
    std::function<void(const JointStates&)> states;
    bool takes_joints_back = false, answers = true, never_answers = false;
    std::function<std::string()> other_driver = [] { return ""; };
    int farewells = 0;
    std::function<void()> go_on = [] {}; ///< by a step, where it stands still otherwise

    void tell(const std::vector<std::string>& names, const Numbers& position, const Numbers& velocity,
              const Numbers& effort, double stamp = 0, std::uint64_t from = 0) const {
        states({names, position, velocity, effort, stamp, from});
    }
};

class Recorder final : public CommandTopic {
  public:
    Recorder(std::vector<Numbers>& to, const Network& network) : to_(to), its_(network) {}
    int readers() const noexcept override { return 1; }
    void send(std::span<const double> values, double) noexcept override {
        to_.emplace_back(values.begin(), values.end());
        its_.go_on();
    }

  private:
    std::vector<Numbers>& to_;
    const Network& its_;
};

class Topics final : public RobotTopics {
  public:
    Topics(Network& network, std::function<void()> opened) : its_(network), opened_(std::move(opened)) {}
    void open() override {
        while (its_.never_answers) std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    void close() noexcept override {}
    std::shared_ptr<void> hear_states(const std::string&,
                                      std::function<void(const JointStates&)> taken) override {
        its_.states = std::move(taken);
        opened_();
        return nullptr;
    }
    std::shared_ptr<void> hear_wrenches(
        const std::string&, std::function<void(const Eigen::Matrix<double, 6, 1>&, double)>) override {
        return nullptr;
    }
    std::shared_ptr<void> hear_imu(
        const std::string&, std::function<void(const Eigen::Matrix<double, 10, 1>&, double)>) override {
        return nullptr;
    }
    std::unique_ptr<CommandTopic> commands(const std::string& topic) override {
        return std::make_unique<Recorder>(its_.sent[topic], its_);
    }
    std::unique_ptr<CommandTopic> ways(const std::string& topic, const std::vector<std::string>&) override {
        return std::make_unique<Recorder>(its_.sent[topic], its_);
    }
    void halt(double) override {}
    bool step() noexcept override {
        its_.go_on();
        return true;
    }
    std::string refusal() const override { return ""; }
    std::string other_driver() override { return its_.other_driver(); }
    bool takes_joints_back() noexcept override { return its_.takes_joints_back; }
    bool let_go() noexcept override {
        if (!its_.takes_joints_back || !its_.answers) return false;
        ++its_.farewells;
        return true;
    }

  private:
    Network& its_;
    const std::function<void()> opened_;
};

/// What a served robot hears and is asked.
struct Offers {
    std::map<std::string, std::function<std::string(std::span<const double>)>> references;
    std::function<std::string(const JointTrajectory&)> trajectories;
    std::map<std::string, std::function<std::string(bool&)>> services;
};

/// Which nobody sees.
class Offered final : public ServedTopics {
  public:
    explicit Offered(Offers& offers) : its_(offers) {}
    void open(const RobotDescription&) override {}
    void close() noexcept override {}
    void hear_references(const std::string& topic,
                         std::function<std::string(std::span<const double>)> taken) override {
        its_.references[topic] = std::move(taken);
    }
    std::string node_of(std::uint64_t) const override { return ""; }
    void hear_trajectories(const std::string&,
                           std::function<std::string(const JointTrajectory&)> taken) override {
        its_.trajectories = std::move(taken);
    }
    void offer(const std::string& name, std::function<std::string(bool&)> answer) override {
        its_.services[name] = std::move(answer);
    }
    void offer(const std::string&, std::function<std::string(bool, bool&)>) override {}
    void add(const std::shared_ptr<Sender>&) override {}
    Bell& bell() noexcept override { return bell_; }
    void send_states(const JointStates&) override {}
    void send_wrench(int, const Eigen::Matrix<double, 6, 1>&, double) override {}
    void send_imu(int, const Eigen::Matrix<double, 10, 1>&, double) override {}
    void send_time(double) override {}
    int readers() const noexcept override { return 0; }
    int writers() const noexcept override { return 0; }
    bool has_double() const noexcept override { return false; }

  private:
    Offers& its_;
    Bell bell_{};
};

/// Of the joints hip and knee; `first` is what comes when it starts.
struct Driven {
    explicit Driven(std::function<void(Network&)> first, double patience = 0.5, double step_size = 0)
        : driver(make_topic_robot(std::make_unique<Topics>(network, [this, first] { first(network); }),
                                  {.kind = "robot",
                                   .joints = {"hip", "knee"},
                                   .states = "joint_states",
                                   .commands = {"effort", "velocity", "position", "way"},
                                   .wrenches = {},
                                   .imus = {},
                                   .is_clock = false,
                                   .patience = patience,
                                   .step_size = step_size})) {}
    std::string refusal() {
        try {
            driver.robot->start();
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    }
    std::string left_out() const {
        toolbox::RobotConnection::ErrorText text;
        driver.left_out(text);
        return text;
    }
    Eigen::Vector2d read(Measurement what) {
        Eigen::VectorXd values = Eigen::Vector2d(nan, nan);
        return driver.robot->read(what, values) ? Eigen::Vector2d(values) : Eigen::Vector2d(nan, nan);
    }
    Network network;
    WaitingDriver driver;
};

struct Owner : Block {
    ThreadArguments thread{this};
};

void rest(double time) { std::this_thread::sleep_for(std::chrono::duration<double>(time)); }
void well(Network& network) { network.tell({"hip", "knee"}, {1, 2}, {0.1, 0.2}, {3, 4}); }

} // namespace

TEST(TopicRobot, TakesNoStateInWhichAMeasurementIsMissingThatWasThere) {
    const std::vector<std::string> names{"hip", "knee"};
    struct Bad {
        std::vector<std::string> names;
        Numbers position, velocity, effort;
        std::string why;
    };
    for (const Bad& bad : std::vector<Bad>{
             {names, {9, 9}, {inf, 9}, {9, 9}, "the velocity of 'hip' is inf"},
             {names, {9, 9}, {}, {9, 9}, "it tells no velocity of 'knee' any more"},
             {names, {9, 9}, {9, 9}, {9, nan}, "the effort of 'knee' is nan"},
             {names, {9, 9}, {9, 9}, {}, "it tells no effort of 'knee' any more"},
             {names, {9, nan}, {9, 9}, {9, 9}, "the position of 'knee' is nan"},
             {names, {9}, {9, 9}, {9, 9}, "it has 2 names and 1 positions"},
             {{}, {9, 9}, {9, 9}, {9, 9}, "it has 0 names and 2 positions"},
             {{"hip", "knee", "hip"}, {9, 9, 9}, {9, 9, 9}, {9, 9, 9}, "it names 'hip' twice"}}) {
        Driven robot(well);
        robot.driver.robot->start();
        robot.network.tell({"elbow"}, {nan}, {}, {});
        robot.network.tell(names, {1, 2}, {0.1, 0.2}, {3, 4});
        EXPECT_EQ(robot.left_out().find("left out"), std::string::npos) << "those of others do not count";
        const double before = now();
        rest(0.2);
        robot.network.tell(bad.names, bad.position, bad.velocity, bad.effort);
        EXPECT_GE(robot.driver.robot->age(), now() - before - 0.05) << bad.why;
        EXPECT_TRUE(std::isnan(robot.read(Measurement::joint_position)[1])) << bad.why;
        EXPECT_EQ(robot.left_out(), "what came was left out: " + bad.why);
        well(robot.network);
        EXPECT_EQ(robot.read(Measurement::joint_velocity), Eigen::Vector2d(0.1, 0.2));
    }
}

TEST(TopicRobot, TakesWhatWasNeverTold) {
    Driven robot([](Network& network) { network.tell({"knee", "hip"}, {2, 1}, {nan, nan}, {}); });
    robot.driver.robot->start();
    EXPECT_EQ(robot.read(Measurement::joint_position), Eigen::Vector2d(1, 2));
    robot.network.tell({"knee"}, {3}, {}, {});
    EXPECT_EQ(robot.read(Measurement::joint_position), Eigen::Vector2d(1, 3));
    rest(0.2);
    robot.network.tell({"knee"}, {3}, {}, {});
    EXPECT_EQ(robot.left_out(), "what came told nothing of 'hip'");
}

TEST(TopicRobot, TakesNoStateOfAJointOfWhichTwoProgramsTellByTurns) {
    Driven robot(well);
    robot.driver.robot->start();
    const auto tell = [&](const char* joint, double position, std::uint64_t from) {
        robot.network.tell({joint}, {position}, {0}, {0}, 0, from);
    };
    for (int k = 0; k < 3; ++k) {
        tell("hip", k, 7);
        tell("knee", k, 8);
    }
    EXPECT_EQ(robot.read(Measurement::joint_position), Eigen::Vector2d(2, 2)) << "each joint has one";
    tell("hip", 3, 9); // as after a restart
    tell("hip", 4, 9);
    EXPECT_EQ(robot.read(Measurement::joint_position), Eigen::Vector2d(4, 2));
    rest(0.01);
    tell("knee", 5, 8);
    tell("hip", 5, 7);
    EXPECT_EQ(robot.left_out(),
              "what came was left out: two programs tell of 'hip' by turns; end one of them");
    EXPECT_EQ(robot.read(Measurement::joint_position), Eigen::Vector2d(4, 5));
}

TEST(TopicRobot, SaysAtItsStartWhatWasLeftOut) {
    Driven robot([](Network& network) { network.tell({"hip", "knee"}, {nan, 2}, {}, {}); });
    EXPECT_EQ(robot.refusal(),
              "the topic 'joint_states' tells nothing of hip within 0.5 s: what came was left "
              "out: the position of 'hip' is nan");
    Driven nameless([](Network& network) { network.tell({}, {1, 2}, {}, {}); });
    EXPECT_NE(nameless.refusal().find("left out: it has 0 names and 2 positions"), std::string::npos);
}

TEST(TopicRobot, LetsItsJointsFallWhereNobodyHoldsThemAndNotWhereARobotOfOursDoes) {
    for (const bool is_ours : {true, false})
        for (const bool answers : {true, false})
            for (const bool is_taken_back : {true, false}) {
                Driven robot(well);
                robot.network.takes_joints_back = is_ours;
                robot.network.answers = answers;
                robot.driver.robot->start();
                ASSERT_TRUE(robot.driver.robot->set_mode(ControlMode::torque));
                ASSERT_TRUE(robot.driver.robot->write(ControlMode::torque, Eigen::Vector2d(5, 6)));
                if (is_taken_back) { // as a host does it
                    ASSERT_TRUE(robot.driver.robot->set_mode(ControlMode::position));
                    robot.read(Measurement::joint_position);
                }
                robot.driver.robot->stop();
                const auto& efforts = robot.network.sent["effort"];
                const bool is_held = is_ours && answers;
                EXPECT_EQ(efforts.size(), is_held ? 1U : 2U) << is_ours << answers << is_taken_back;
                EXPECT_EQ(efforts.back(), is_held ? Numbers({5, 6}) : Numbers({0, 0}));
                EXPECT_EQ(robot.network.farewells, is_held ? 1 : 0);
            }
}

TEST(TopicRobot, IsNotLeftWhereOnlyItsModeChanges) {
    Driven robot(well);
    robot.network.takes_joints_back = true;
    auto& its = *robot.driver.robot;
    its.start();
    for (const auto mode : {ControlMode::torque, ControlMode::position, ControlMode::velocity}) {
        ASSERT_TRUE(its.set_mode(mode));
        ASSERT_TRUE(its.write(mode, Eigen::Vector2d(5, 6)));
        robot.read(Measurement::joint_position);
        EXPECT_EQ(robot.network.farewells, 0);
    }
    its.stop();
    EXPECT_EQ(robot.network.farewells, 1);
}

TEST(TopicRobot, IsCommandedInTheOrderOfItsStatesWhereItIsOneOfOurs) {
    for (const bool is_ours : {true, false}) {
        Driven robot([](Network& network) { network.tell({"knee", "hip"}, {2, 1}, {0.2, 0.1}, {4, 3}); });
        robot.network.takes_joints_back = is_ours;
        auto& its = *robot.driver.robot;
        its.start();
        for (const auto& [mode, topic] :
             {std::pair(ControlMode::torque, "effort"), std::pair(ControlMode::position_direct, "position"),
              std::pair(ControlMode::position, "way")}) {
            ASSERT_TRUE(its.set_mode(mode));
            ASSERT_TRUE(its.write(mode, Eigen::Vector2d(5, 6)));
            const bool is_sorted = is_ours && mode != ControlMode::position;
            EXPECT_EQ(robot.network.sent[topic].back(), is_sorted ? Numbers({6, 5}) : Numbers({5, 6}))
                << topic << ": ways carry names";
        }
    }
    Driven part([](Network& network) { network.tell({"knee", "hip", "toe"}, {2, 1, 0}, {0, 0, 0}, {}); });
    part.network.takes_joints_back = true;
    part.driver.robot->start();
    EXPECT_FALSE(part.driver.robot->set_mode(ControlMode::torque)) << "its commands are of all joints";
    EXPECT_STREQ(part.driver.robot->error(), "robot: the diagram has not all joints of 'joint_states'");
}

/// What the destructors of globals take away, the call may still use.
TEST(ThreadedRobot, LetsAProgramEndWithoutDestructorsOfGlobalsWhereACallNeverComesBack) {
    const auto ends = [] {
        std::atexit([] { ::_exit(3); }); // as those destructors, it is called behind what came later
        Driven robot(well);
        robot.network.never_answers = true;
        const Owner owner;
        const auto link = make_threaded_link("robot", std::move(robot.driver), owner.thread);
        try {
            link->start(0.1);
        } catch (const std::runtime_error&) {
            link->stop();
        }
        std::exit(7);
    };
    EXPECT_EXIT(ends(), testing::ExitedWithCode(7), "");
}

/// As one does whose first step fails before it commands.
TEST(TopicRobot, LetsARobotGoThatItWasToCommandOrHasMadeToStandStill) {
    for (const double step_size : {0.0, 0.001})
        for (const bool commands : {true, false}) {
            Driven robot(well, 0.5, step_size);
            robot.network.takes_joints_back = true;
            if (commands) robot.driver.expect_commands();
            robot.driver.robot->start();
            EXPECT_FALSE(std::isnan(robot.read(Measurement::joint_position)[0]));
            robot.driver.robot->stop();
            EXPECT_EQ(robot.network.farewells, commands || step_size > 0 ? 1 : 0)
                << "who only listens disturbs no controller";
        }
}

TEST(TopicRobot, DisturbsNoControllerThatHasComeMeanwhile) {
    Driven robot(well);
    robot.network.takes_joints_back = true;
    robot.driver.expect_commands();
    robot.driver.robot->start();
    robot.network.other_driver = [] { return "/another"; };
    robot.driver.robot->stop();
    EXPECT_EQ(robot.network.farewells, 0);
    robot.network.other_driver = []() -> std::string { return ""; };
    robot.driver.robot->start();
    robot.network.other_driver = []() -> std::string { throw std::runtime_error("nobody answers"); };
    robot.driver.robot->stop();
    EXPECT_EQ(robot.network.farewells, 0) << "nor any of whom nothing is known";
}

class TopicEndOf : public ::testing::TestWithParam<bool> {
  protected:
    TopicEndOf() {
        RobotDescription robot;
        robot.joints = {"hip"};
        robot.modes = 1u << static_cast<int>(ControlMode::torque) |
                      1u << static_cast<int>(ControlMode::position_direct);
        robot.measurements = 1u << static_cast<int>(Measurement::joint_position);
        robot.period = 0.25;
        end->start(robot);
        at = RobotLayout(robot);
        state.resize(static_cast<std::size_t>(at.state_size()));
        command.resize(static_cast<std::size_t>(at.command_size()));
        end->show_state(state.data(), 0);
    }
    bool takes() {
        Stamp stamp;
        return end->take_command(command.data(), stamp);
    }
    void release() {
        bool is_done = false;
        EXPECT_EQ(topics.services.at("release")(is_done), "");
        EXPECT_TRUE(is_done);
    }
    Offers topics;
    const std::unique_ptr<RobotEnd> end = make_topic_end(
        "robot", std::make_unique<Offered>(topics), {"effort", "velocity", "position", "way"}, GetParam());
    RobotLayout at{RobotDescription()};
    Numbers state, command;
};
INSTANTIATE_TEST_SUITE_P(TimeThatStandsStillOrGoesByTheClock, TopicEndOf, ::testing::Bool());

TEST_P(TopicEndOf, HasWhoLetsGoBeforeItsFirstCommandComeAndLeave) {
    release();
    EXPECT_TRUE(takes());
    EXPECT_EQ(command[RobotLayout::release], 1);
    EXPECT_NE(command[RobotLayout::session], 0);
    EXPECT_FALSE(takes()) << "once";
}

TEST_P(TopicEndOf, AsksForTheModeOfEachControllerOnce) {
    double session = 0;
    for (const bool is_first : {true, false}) {
        for (const double effort : {1.0, 2.0}) {
            topics.references.at("effort")(Numbers{effort});
            ASSERT_TRUE(takes());
            EXPECT_EQ(command[RobotLayout::mode_count], 1) << is_first << effort;
            EXPECT_EQ(command[RobotLayout::mode_asked], static_cast<double>(ControlMode::torque));
            EXPECT_EQ(command[RobotLayout::references], effort) << "counted";
            EXPECT_EQ(command[RobotLayout::command_head], effort);
        }
        EXPECT_NE(std::exchange(session, command[RobotLayout::session]), command[RobotLayout::session]);
        release();
        ASSERT_TRUE(takes());
    }
}

/// A line to 1 within a second, and the place where it ends from then on.
TEST_P(TopicEndOf, FollowsATrajectoryByAReferenceInEachStep) {
    topics.trajectories({{"hip"}, {{1, {1}, {}}}});
    for (int k = 0; k < 6; ++k) {
        state[RobotLayout::time] = 0.25 * k;
        end->show_state(state.data(), 0);
        ASSERT_TRUE(takes()) << k;
        EXPECT_FALSE(takes()) << k << ": once in a step";
        EXPECT_NEAR(command[RobotLayout::command_head], std::min(0.25 * (k + 1), 1.0), 1e-12) << k;
        EXPECT_EQ(command[RobotLayout::mode_asked], static_cast<double>(ControlMode::position_direct));
        EXPECT_EQ(command[RobotLayout::mode_count], 1);
        state[RobotLayout::owner] = command[RobotLayout::session];
    }
}

TEST_P(TopicEndOf, SaysWhatItLeavesOutWhichTakesTheRobotFromNobody) {
    const auto& efforts = topics.references.at("effort");
    EXPECT_EQ(efforts(Numbers{1, 2}), "2 numbers, but the joints are hip");
    EXPECT_EQ(efforts(Numbers{}), "0 numbers, but the joints are hip");
    EXPECT_EQ(efforts(Numbers{std::nan("")}), "nan for the joint 'hip'");
    EXPECT_EQ(topics.trajectories({{"another"}, {{1, {1}, {}}}}),
              "a trajectory that names 'another', but the joints are hip");
    EXPECT_EQ(topics.trajectories({{"hip"}, {{1, {1, 2}, {}}}}),
              "a trajectory whose point 1 has 2 positions, but its joints are hip");
    EXPECT_FALSE(takes());
    EXPECT_EQ(efforts(Numbers{1}), "");
    EXPECT_EQ(topics.trajectories({{"hip"}, {{1, {1}, {}}}}), "");
    EXPECT_TRUE(takes());
}

/// References that came before were not reached yet.
TEST_P(TopicEndOf, BeginsATrajectoryWhereTheJointsAre) {
    topics.references.at("position")(Numbers{1});
    ASSERT_TRUE(takes());
    EXPECT_EQ(command[RobotLayout::command_head], 1);
    state[RobotLayout::owner] = command[RobotLayout::session];
    state[RobotLayout::time] = 0.25;
    state[static_cast<std::size_t>(at.measurement(Measurement::joint_position))] = 0.1;
    end->show_state(state.data(), 0);
    topics.trajectories({{"hip"}, {{1, {0.2}, {}}}});
    ASSERT_TRUE(takes());
    EXPECT_NEAR(command[RobotLayout::command_head], 0.125, 1e-12);
}

/// As the host does from one that was silent.
TEST_P(TopicEndOf, HasWhomItWasTakenFromLeaveNoSecondTime) {
    topics.references.at("effort")(Numbers{1});
    ASSERT_TRUE(takes());
    state[RobotLayout::owner] = command[RobotLayout::session];
    end->show_state(state.data(), 0);
    state[RobotLayout::owner] = 0;
    end->show_state(state.data(), 0);
    release();
    EXPECT_EQ(takes(), GetParam()) << "where its time stands still nobody is silent";
    release();
    EXPECT_TRUE(takes()) << "the next one";
    EXPECT_EQ(command[RobotLayout::release], 1);
}

/// The controller's step is two of the robot's, which come after it has stopped.
TEST(ThreadedRobot, DoesTheLastStepToItsEndWhereItIsLed) {
    std::atomic<int> done{0};
    const auto tell = [&](const Network& network) {
        network.tell({"hip", "knee"}, {1, 2}, {0, 0}, {0, 0}, 0.001 * done);
    };
    Driven driven(tell, 5, 0.001);
    driven.network.takes_joints_back = true; // no zeros at the end
    driven.network.go_on = [&] {
        rest(0.02);
        ++done;
        tell(driven.network);
    };
    const auto& sent = driven.network.sent["effort"];
    const Owner owner;
    RemoteConnection robot(make_threaded_link("robot", std::move(driven.driver), owner.thread),
                           {.joints = {"hip", "knee"}});
    robot.set_period(0.002);
    robot.start();
    ASSERT_TRUE(robot.set_mode(ControlMode::torque)) << robot.error();
    for (const int k : {1, 2}) {
        ASSERT_TRUE(robot.write(ControlMode::torque, Eigen::Vector2d(k, k))) << robot.error();
        robot.end_step();
    }
    ASSERT_TRUE(robot.begin_step()) << robot.error();
    EXPECT_EQ(done, 4) << "it is the time of the third step";
    ASSERT_TRUE(robot.write(ControlMode::torque, Eigen::Vector2d(3, 3))) << robot.error();
    robot.stop();
    EXPECT_EQ(done, 4) << "which did not end";
    EXPECT_EQ(sent.size(), 2U);
    EXPECT_EQ(sent.back(), Numbers({2, 2}));
    robot.start();
    ASSERT_TRUE(robot.set_mode(ControlMode::torque)) << robot.error();
    ASSERT_TRUE(robot.write(ControlMode::torque, Eigen::Vector2d(4, 4))) << robot.error();
    robot.end_step();
    robot.stop();
    EXPECT_EQ(done, 6) << "the first step of the next run is its last";
}

/// As where somebody else asks a robot that stands still between steps to begin again.
TEST(TopicRobot, SaysThatItHasBegunAgainWhereItIsLed) {
    const auto tell = [](const Network& network, double stamp) {
        network.tell({"hip", "knee"}, {1, 2}, {0, 0}, {0, 0}, stamp);
    };
    Driven driven([&](const Network& network) { tell(network, 0.5); }, 5, 0.001);
    driven.network.go_on = [&] { tell(driven.network, 0); };
    const Owner owner;
    RemoteConnection robot(make_threaded_link("robot", std::move(driven.driver), owner.thread),
                           {.joints = {"hip", "knee"}});
    robot.set_period(0.001);
    robot.start();
    ASSERT_TRUE(robot.set_mode(ControlMode::torque)) << robot.error();
    ASSERT_TRUE(robot.write(ControlMode::torque, Eigen::Vector2d(1, 1))) << robot.error();
    robot.end_step();
    EXPECT_FALSE(robot.begin_step());
    EXPECT_STREQ(robot.error(),
                 "robot: it has begun again, as its time went back from t = 0.5 s to t = 0 s; start "
                 "this run anew; the last state is of t = 0.5 s");
}

TEST(TopicRobot, IsNotDrivenByTwo) {
    Driven robot(well);
    robot.network.other_driver = [] { return "/other"; };
    EXPECT_EQ(robot.refusal(), "the node '/other' sends commands to it; end it first, or wait until it is "
                               "forgotten where it was killed");
    EXPECT_TRUE(robot.network.sent["effort"].empty());
    Driven later(well, 10);
    later.network.other_driver = [asked = 0]() mutable { return ++asked < 100 ? "/other" : ""; };
    EXPECT_EQ(later.refusal(), "") << "it waits until the other one has ended";
}

TEST(Turns, AreTwoWhereOneSendsBetweenCommandsOfAnother) {
    Turns one, then, both;
    for (int k = 0; k < 10; ++k) one.sent(1);
    for (int k = 0; k < 10; ++k) then.sent(k < 5 ? 1 : 2);
    EXPECT_FALSE(one.are_two());
    EXPECT_FALSE(then.are_two()) << "the second came when the first had gone";
    for (int k = 0; k < 3; ++k) both.sent(1 + k % 2);
    EXPECT_TRUE(both.are_two());
}

TEST(TopicRobot, AcceleratesAtMostAsItIsTold) {
    Driven robot(well);
    auto& its = *robot.driver.robot;
    its.start();
    const double begin = now();
    ASSERT_TRUE(its.set_mode(ControlMode::velocity));
    ASSERT_TRUE(its.set_trajectory_limit(ControlMode::velocity, 4));
    auto& sent = robot.network.sent["velocity"];
    do {
        ASSERT_TRUE(its.write(ControlMode::velocity, Eigen::Vector2d(0.4, -0.1)));
        EXPECT_LE(sent.back()[0], 4 * (now() - begin));
        rest(0.005);
    } while (sent.back()[0] < 0.4);
    EXPECT_GE(now() - begin, 0.1) << "0.4 rad/s at 4 rad/s2";
    EXPECT_EQ(sent.back(), Numbers({0.4, -0.1}));
}

} // namespace bf::middleware::test
