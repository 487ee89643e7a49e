// A connection to a robot, over a link that is none.
#include "bf/middleware/clock.hpp"
#include "bf/middleware/remote_robot.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>

namespace bf::middleware::test {
namespace {

/// A robot of one joint whose clock tells the time since 1970, as seconds and nanoseconds, and goes on by a
/// millisecond in each state, from some state on by some milliseconds ahead of that, until it stands still.
class ClockLink final : public RobotLink {
  public:
    explicit ClockLink(int is_ahead_from, int ahead = 5, int states = 1'000'000, double speed = 0,
                       double ageing = 0)
        : is_ahead_from_(is_ahead_from), ahead_(ahead), all_(states), speed_(speed), ageing_(ageing) {}
    RobotDescription start(double) override {
        RobotDescription robot;
        robot.joints = {"knee"};
        robot.period = 0.001;
        robot.measurements = 3; // positions and velocities
        for (auto* limits :
             {&robot.position_min, &robot.position_max, &robot.velocity_min, &robot.velocity_max})
            limits->setZero(1);
        return robot;
    }
    void stop() noexcept override {}
    bool take_state(double* state, Stamp& stamp) noexcept override {
        if (states_ == all_) return false;
        const int step = std::max(states_ - 1, 0); // the start takes a state, too
        const int ms = step + (step >= is_ahead_from_ ? ahead_ : 0);
        state[RobotLayout::time] = 1'795'000'000 + ms / 1000 + ms % 1000 * 1'000'000 / 1e9;
        state[RobotLayout::state_head + 1] = speed_;
        state[RobotLayout::age] = step * ageing_;
        stamp = {static_cast<std::uint64_t>(++states_), now()};
        return true;
    }
    bool take_gains(double*) noexcept override { return false; }
    void send_command(const double*) noexcept override {}
    void send_settings(const double*) noexcept override {}
    void wait(double) noexcept override {}
    bool is_gone() noexcept override { return false; }
    const std::string& name() const noexcept override { return name_; }

  private:
    const int is_ahead_from_, ahead_, all_;
    const double speed_, ageing_; ///< the latter in s for each state
    int states_ = 0;
    const std::string name_ = "clock";
};

/// A robot that sends its first state and its gains, and no more.
class SilentLink final : public RobotLink {
  public:
    struct Calls {
        int starts = 0, stops = 0, commands = 0;
    };
    SilentLink(Calls& calls, bool has_state) : calls_(calls), has_state_(has_state) {}
    RobotDescription start(double) override {
        ++calls_.starts;
        RobotDescription robot;
        robot.joints = {"knee"};
        robot.period = 0.001;
        robot.measurements = 3;
        robot.has_position_gains = robot.has_motor_parameters = true;
        for (auto* limits :
             {&robot.position_min, &robot.position_max, &robot.velocity_min, &robot.velocity_max})
            limits->setZero(1);
        return robot;
    }
    void stop() noexcept override { ++calls_.stops; }
    bool take_state(double*, Stamp& stamp) noexcept override {
        stamp = {1, now()};
        return std::exchange(has_state_, false);
    }
    bool take_gains(double*) noexcept override { return true; }
    void send_command(const double*) noexcept override { ++calls_.commands; }
    void send_settings(const double*) noexcept override { ++calls_.commands; }
    void wait(double) noexcept override {}
    bool is_gone() noexcept override { return false; }
    const std::string& name() const noexcept override { return name_; }

  private:
    Calls& calls_;
    bool has_state_;
    const std::string name_ = "silent";
};

} // namespace

TEST(RemoteConnection, StopsItsLinkWithoutAFarewellWhereItsStartFails) {
    for (const auto& [joint, has_state, why] :
         {std::tuple("hip", true, "silent: it has no joint 'hip'"),
          std::tuple("knee", false, "silent: it is there, but sends no state")}) {
        SilentLink::Calls calls;
        RemoteConnection robot(std::make_unique<SilentLink>(calls, has_state),
                               {.joints = {joint}, .start_timeout = 0.05});
        try {
            robot.start();
            ADD_FAILURE() << "it starts";
        } catch (const std::runtime_error& error) {
            EXPECT_EQ(std::string(error.what()).substr(0, std::strlen(why)), why);
        }
        EXPECT_EQ(calls.starts, 1);
        EXPECT_EQ(calls.stops, 1);
        EXPECT_FALSE(robot.begin_step()) << "it is closed";
        robot.stop();
        EXPECT_EQ(calls.stops, 1);
        EXPECT_EQ(calls.commands, 0);
    }
}

/// Nor is it given anything.
TEST(RemoteConnection, TellsNothingOfARobotThatHasFallenSilent) {
    SilentLink::Calls calls;
    RemoteConnection robot(std::make_unique<SilentLink>(calls, true), {.joints = {"knee"}, .timeout = 0.05});
    robot.set_period(0.001);
    robot.start();
    toolbox::MotorParameters motors(1);
    toolbox::Gains gains(1);
    Eigen::VectorXd values = Eigen::VectorXd::Zero(1);
    EXPECT_TRUE(robot.read_motor_parameters(motors)) << robot.error();
    EXPECT_TRUE(robot.read_gains(Loop::position, gains)) << robot.error();
    robot.end_step();
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    calls.commands = 0;
    EXPECT_FALSE(robot.read_motor_parameters(motors));
    EXPECT_FALSE(robot.read_gains(Loop::position, gains));
    EXPECT_FALSE(robot.read(Measurement::joint_position, values));
    EXPECT_FALSE(robot.write_motor_parameters(motors));
    EXPECT_FALSE(robot.write_gains(Loop::position, gains));
    EXPECT_FALSE(robot.write(ControlMode::torque, values));
    EXPECT_FALSE(robot.set_mode(ControlMode::torque));
    EXPECT_EQ(std::string(robot.error()).substr(0, 21), "silent: no state for ");
    EXPECT_EQ(calls.commands, 0);
}

TEST(RemoteConnection, TellsNoRoundoffOfTimesAsDrift) {
    RemoteConnection robot(std::make_unique<ClockLink>(2000), {.joints = {"knee"}});
    robot.set_period(0.001);
    robot.start();
    for (int k = 0; k < 1990; ++k) {
        ASSERT_TRUE(robot.begin_step()) << robot.error();
        ASSERT_EQ(robot.drift(), 0) << k;
        robot.end_step();
    }
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(robot.begin_step()) << robot.error();
        robot.end_step();
    }
    EXPECT_NEAR(robot.drift(), 0.004, 1e-6) << "the step has ended that it belongs to";
}

TEST(RemoteConnection, EndsWhereTheTimeThatLeadsItGoesBack) {
    for (const bool follows : {true, false}) {
        RemoteConnection robot(std::make_unique<ClockLink>(50, -40),
                               {.joints = {"knee"}, .follows = follows});
        robot.set_period(0.001);
        robot.start();
        int steps = 0;
        for (; steps < 100 && robot.begin_step(); ++steps) robot.end_step();
        if (follows) {
            EXPECT_EQ(steps, 50);
            EXPECT_STREQ(robot.error(),
                         "clock: its time went back from t = 1.795e+09 s to t = 1.795e+09 s, so "
                         "it has begun again; start this run anew");
        } else {
            EXPECT_EQ(steps, 100) << "its own clock leads it";
            EXPECT_NEAR(robot.drift(), -0.041, 0.002);
        }
    }
}

TEST(RemoteConnection, EndsWhereTheTimeThatLeadsItJumpsAhead) {
    for (const int ahead : {500, 2000}) // ms, where the timeout is a second
        for (const bool follows : {true, false}) {
            RemoteConnection robot(std::make_unique<ClockLink>(50, ahead),
                                   {.joints = {"knee"}, .follows = follows});
            robot.set_period(0.001);
            robot.start();
            int steps = 0;
            for (; steps < 100 && robot.begin_step(); ++steps) robot.end_step();
            if (follows && ahead > 1000) {
                EXPECT_EQ(steps, 50);
                EXPECT_STREQ(robot.error(), "clock: its time jumped ahead from t = 1795000000.049 s to t = "
                                            "1795000002.050 s; start this run anew");
            } else {
                EXPECT_EQ(steps, 100) << robot.error();
            }
        }
}

TEST(RemoteConnection, SaysWhichMeasurementIsNotFinite) {
    Eigen::VectorXd values(1);
    for (const auto& [speed, name] :
         {std::pair(0.5, ""), std::pair(std::nan(""), "nan"), std::pair(HUGE_VAL, "inf")}) {
        RemoteConnection robot(std::make_unique<ClockLink>(2000, 5, 100, speed), {.joints = {"knee"}});
        robot.set_period(0.001);
        robot.start();
        EXPECT_TRUE(robot.read(Measurement::joint_position, values)) << robot.error();
        EXPECT_EQ(robot.read(Measurement::joint_velocity, values), std::isfinite(speed));
        if (!std::isfinite(speed)) {
            EXPECT_EQ(std::string(robot.error()),
                      "clock: it sends joint velocities that are not finite: " + std::string(name) +
                          " of 'knee'; look at what it measures");
        }
    }
}

TEST(RemoteConnection, EndsWhereStatesComeOfWhatWasMeasuredLongAgo) {
    RemoteConnection robot(std::make_unique<ClockLink>(2000, 5, 1'000'000, 0, 0.1),
                           {.joints = {"knee"}, .timeout = 0.95});
    robot.set_period(0.001);
    robot.start();
    int steps = 0;
    for (; steps < 100 && robot.begin_step(); ++steps) robot.end_step();
    EXPECT_EQ(steps, 10) << "of which the first two are of one state";
    EXPECT_EQ(std::string(robot.error()).substr(0, 20), "clock: no state for ");
}

/// Steps come as fast as they can, where the robot's time is ahead of them.
TEST(RemoteConnection, WaitsNoLongerThanItsTimeoutBehindTheLastState) {
    RemoteConnection robot(std::make_unique<ClockLink>(10, 250, 20), {.joints = {"knee"}, .timeout = 0.3});
    robot.set_period(0.001);
    robot.start();
    int steps = 0;
    for (; steps < 300 && robot.begin_step(); ++steps) {
        std::this_thread::sleep_for(std::chrono::milliseconds(3));
        robot.end_step();
    }
    EXPECT_LT(steps, 200) << "there is time enough of the last state";
    EXPECT_EQ(std::string(robot.error()).substr(0, 20), "clock: no state for ");
}

} // namespace bf::middleware::test
