// What measurements and commands suffer besides noise.
#include "bf/physics/scene.hpp"
#include "complaints.hpp"
#include "robots.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <vector>

namespace bf::physics::test::imperfections {

namespace {

constexpr double h = 1e-3;         // s
constexpr double I = 0.5, J = 0.1; // kg m2, of the wheel and of its rotor

/// A wheel on a motor, without gravity; the second robot, with sensors, swings.
SceneOptions wheel() {
    SceneOptions options;
    options.floor.enabled = false;
    options.gravity.setZero();
    SceneRobot robot{"wheel"};
    robot.options.urdf = write_urdf("wheel", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="rim"><inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.5" iyy="0.5" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="axle" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="rim"/></joint>)");
    robot.options.floating_base = false;
    robot.options.armature = {J};
    robot.options.imu_frame = "rim";
    options.robots = {robot};
    return options;
}

SceneOptions with(const std::function<void(SceneRobot&)>& change) {
    SceneOptions options = wheel();
    change(options.robots[0]);
    return options;
}

SceneSimulation simulate(const SceneOptions& options) {
    return SceneSimulation(std::make_shared<const Scene>(options));
}

/// All that blocks read of a robot.
std::vector<double> read(const Readings& all, const SceneSimulation& sim) {
    std::vector<double> values;
    for (const auto& part : {all.s, all.s_dot, all.s_ddot, all.tau, all.motor_position, all.motor_velocity,
                             all.motor_acceleration})
        values.insert(values.end(), part.data(), part.data() + part.size());
    for (const Eigen::Vector3d& part :
         {sim.imu_rpy(0), Eigen::Vector3d(sim.gyro(0)), Eigen::Vector3d(sim.accelerometer(0))})
        values.insert(values.end(), part.data(), part.data() + 3);
    return values;
}
std::vector<double> read(const SceneSimulation& sim) { return read(sim.readings(0), sim); }

/// Readings of `steps` under a torque that changes with time alone; the first ones are those of the start.
std::vector<std::vector<double>> run(SceneSimulation& sim, int steps) {
    std::vector<std::vector<double>> all{read(sim)};
    for (int k = 0; k < steps; ++k) {
        sim.set_torque(0, std::array{2.0 * std::sin(0.05 * k) + 0.3});
        EXPECT_TRUE(sim.step()) << sim.error();
        all.push_back(read(sim));
    }
    return all;
}
std::vector<std::vector<double>> run(const SceneOptions& options, int steps) {
    SceneSimulation sim = simulate(options);
    return run(sim, steps);
}

void make_everything_imperfect(RobotOptions& o) {
    o.noise = {1e-4, 1e-2, 0.1, 7};
    o.imperfections.delays = {0.002, 0.004};
    o.imperfections.dropout = 0.2;
    o.imperfections.backlash = {0.01};
    o.imperfections.encoder_resolution = {1e-3};
    o.imperfections.motor_encoder_resolution = {2e-3};
    o.imperfections.velocities_from_encoders = true;
}

} // namespace

TEST(Imperfections, DelayAllMeasurementsByTheSameTime) {
    const auto noisy = [](double delay) {
        return with([&](SceneRobot& robot) {
            robot.options.noise = {1e-3, 1e-2, 0.1, 5};
            robot.options.imperfections.delays.measurement = delay;
        });
    };
    const auto now = run(noisy(0), 100), late = run(noisy(0.005), 100);
    for (size_t k = 0; k < now.size(); ++k) EXPECT_EQ(late[k], now[k < 5 ? 0 : k - 5]) << k;
    EXPECT_NE(now[50], now[45]);

    SceneSimulation sim = simulate(noisy(0.005));
    for (size_t k = 0; k < 20; ++k) {
        EXPECT_EQ(sim.readings_at_loops(0).s[0], now[k][0]) << "the loops have theirs at once";
        sim.set_torque(0, std::array{2.0 * std::sin(0.05 * static_cast<double>(k)) + 0.3});
        ASSERT_TRUE(sim.step());
    }
}

TEST(Imperfections, DelayReferencesByPeriodsOfTheLoops) {
    const auto path = [](double delay, ControlMode mode) {
        SceneSimulation sim = simulate(with([&](SceneRobot& robot) {
            robot.loop_period = 2 * h;
            robot.options.imperfections.delays.command = delay;
        }));
        sim.set_mode(0, mode);
        std::vector<double> s;
        for (int k = 0; k < 60; ++k) {
            if (k == 10) sim.control(0).set_reference(Eigen::VectorXd::Constant(1, 0.4));
            EXPECT_TRUE(sim.step());
            s.push_back(sim.s(0)[0]);
        }
        return s;
    };
    for (const ControlMode mode :
         {ControlMode::torque, ControlMode::position_direct, ControlMode::impedance, ControlMode::current}) {
        const auto now = path(0, mode), late = path(0.006, mode);
        for (size_t k = 0; k < now.size(); ++k) EXPECT_EQ(late[k], k < 6 ? 0.0 : now[k - 6]) << k;
        EXPECT_GT(now.back(), 1e-4);
    }
}

TEST(Imperfections, DelayTorquesThatPassTheLoops) {
    JointControl control(
        *[] {
            const std::vector<std::string> joints{"a", "b"};
            return std::make_shared<Motors>(MotorOptions{}, joints, Eigen::Vector2d(1, 1));
        }(),
        2);
    for (int k = 1; k <= 5; ++k)
        EXPECT_EQ(control.pass(Eigen::Vector2d(k, -k)),
                  k <= 2 ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(k - 2, 2 - k));
    EXPECT_EQ(control.torques(), Eigen::Vector2d(3, -3));
    control.reset();
    EXPECT_EQ(control.pass(Eigen::Vector2d(9, 9)), Eigen::Vector2d(0, 0)) << "nothing is underway";
}

TEST(Imperfections, CountWholeTicksOfBothEncoders) {
    const double joint = 2e-3, motor = 0.05, ratio = -80;
    SceneSimulation exact = simulate(wheel()),
                    sim = simulate(with([&](SceneRobot&robot) {
                        robot.motors.gear_ratio = {ratio};
                        robot.options.imperfections.encoder_resolution = {joint};
                        robot.options.imperfections.motor_encoder_resolution = {motor};
                    }));
    int ticks = 0;
    for (int k = 0; k < 500; ++k) {
        for (SceneSimulation* one : {&exact, &sim}) {
            one->set_torque(0, std::array{std::sin(0.02 * k)});
            ASSERT_TRUE(one->step());
        }
        const double s = exact.s(0)[0];
        EXPECT_EQ(sim.s(0)[0], joint * std::round(s / joint));
        EXPECT_EQ(sim.readings(0).motor_position[0], motor * std::round(ratio * s / motor));
        EXPECT_EQ(sim.s_dot(0)[0], exact.s_dot(0)[0]);
        ticks = std::max(ticks, static_cast<int>(std::abs(sim.s(0)[0]) / joint));
    }
    EXPECT_GT(ticks, 20);
}

TEST(Imperfections, DifferenceWhatTheEncodersCount) {
    SceneSimulation sim = simulate(with([&](SceneRobot& robot) {
        robot.motors.gear_ratio = {100};
        robot.options.noise.velocity = 1.0; // which these velocities do not have
        robot.options.imperfections.encoder_resolution = {1e-3};
        robot.options.imperfections.velocities_from_encoders = true;
    }));
    EXPECT_EQ(sim.s_dot(0)[0], 0.0);
    bool moved = false;
    for (int k = 0; k < 300; ++k) {
        const double s = sim.s(0)[0], motor = sim.readings(0).motor_position[0];
        sim.set_torque(0, std::array{1.0});
        ASSERT_TRUE(sim.step());
        EXPECT_EQ(sim.s_dot(0)[0], (sim.s(0)[0] - s) / h);
        EXPECT_EQ(sim.readings(0).motor_velocity[0], (sim.readings(0).motor_position[0] - motor) / h);
        moved |= sim.s_dot(0)[0] == 1.0; // one tick
    }
    EXPECT_TRUE(moved);
    sim.reset();
    EXPECT_EQ(sim.s_dot(0)[0], 0.0);
}

TEST(Imperfections, ReadTheLastMeasurementsAgainWhereSomeAreLost) {
    for (const int delay : {0, 3}) {
        const auto lossy = [&](std::uint64_t seed) {
            return with([&](SceneRobot& robot) {
                robot.options.noise.seed = seed;
                robot.options.imperfections.dropout = 0.3;
                robot.options.imperfections.delays.measurement = delay * h;
            });
        };
        const auto now = run(wheel(), 4000), some = run(lossy(1), 4000), other = run(lossy(2), 4000);
        int lost = 0;
        const auto d = static_cast<size_t>(delay);
        for (size_t k = d + 1; k < now.size(); ++k) {
            if (some[k] == now[k - d]) continue;
            EXPECT_EQ(some[k], some[k - 1]) << k;
            ++lost;
        }
        EXPECT_NEAR(lost / 4000.0, 0.3, 4 * std::sqrt(0.3 * 0.7 / 4000)); // four standard deviations
        EXPECT_NE(some, other);
    }
}

TEST(Imperfections, LetTheMotorTurnAloneWithinTheBacklash) {
    const double b = 0.02;
    SceneSimulation sim = simulate(with([&](SceneRobot& robot) {
        robot.motors.gear_ratio = {50};
        robot.options.imperfections.backlash = {b};
    }));
    // The middle of the play is the start. v⁺ = v + h tau / J, x⁺ = x + h v⁺, until the motor meets a flank.
    const auto motor = [&] { return sim.readings(0).motor_position[0] / 50; };
    const auto gap = [&] { return motor() - sim.s(0)[0]; };
    int k = 0;
    for (; h * h / J * (k + 1) * (k + 2) / 2 < b / 2; ++k) {
        sim.set_torque(0, std::array{1.0});
        ASSERT_TRUE(sim.step());
        ASSERT_NEAR(motor(), h * h / J * (k + 1) * (k + 2) / 2, 1e-12);
        ASSERT_NEAR(sim.s(0)[0], 0.0, 1e-12);
        ASSERT_NEAR(sim.readings(0).motor_acceleration[0], 50 / J, 1e-9);
    }
    EXPECT_GT(k, 20);
    double impulse = h * k;
    const auto turn = [&](double tau, int steps) { // what the flanks exchange is internal
        for (int i = 0; i < steps; ++i) {
            sim.set_torque(0, std::array{tau});
            ASSERT_TRUE(sim.step());
            impulse += h * tau;
            ASSERT_NEAR(J * sim.readings(0).motor_velocity[0] / 50 + I * sim.s_dot(0)[0], impulse, 1e-9);
            ASSERT_LT(std::abs(gap()), b / 2 + 1e-3); // a step of the way at which they meet
        }
    };
    turn(1.0, 100);
    EXPECT_NEAR(gap(), b / 2, 1e-5);
    EXPECT_NEAR(sim.s_ddot(0)[0], 1.0 / (I + J), 1e-3) << "together";
    turn(-1.0, 400);
    EXPECT_NEAR(gap(), -b / 2, 1e-5) << "the other flank";
    EXPECT_NEAR(sim.s_ddot(0)[0], -1.0 / (I + J), 1e-3);
}

TEST(Imperfections, KnowTheLimitsOfPlayInFilesThatMeasureInDegrees) {
    const std::string file = BF_BINARY_DIRECTORY "/plays.xml";
    std::ofstream(file) << R"(<mujoco><compiler angle="degree"/><option gravity="0 0 0"/>
      <default><joint damping="3" stiffness="20" frictionloss="1"/></default>
      <worldbody><body name="stand"><geom size="0.1" mass="1"/><body name="rim"><joint name="axle" axis="0 0 1" stiffness="0"/>
        <geom type="box" size="0.2 0.2 0.05" mass="2"/></body></body></worldbody></mujoco>)";
    SceneOptions options = wheel();
    SceneRobot& robot = options.robots[0];
    robot.options.urdf = file;
    robot.options.imu_frame.clear();
    robot.options.imperfections.backlash = {0.1};
    SceneSimulation sim = simulate(options);
    for (int k = 0; k < 1000; ++k) {
        sim.set_torque(0, std::array{3.0});
        ASSERT_TRUE(sim.step());
    }
    EXPECT_NEAR(sim.readings(0).motor_position[0] - sim.s(0)[0], 0.05, 1e-5);
}

TEST(Imperfections, AreThoseOfAWorldOfOneRobot) {
    WorldOptions options;
    static_cast<RobotOptions&>(options) = wheel().robots[0].options;
    options.floor.enabled = false;
    options.gravity.setZero();
    options.motors.gear_ratio = {100};
    make_everything_imperfect(options);
    SceneSimulation world(std::make_shared<const Scene>(options));
    SceneSimulation scene = simulate(with([](SceneRobot& robot) {
        make_everything_imperfect(robot.options);
        robot.motors.gear_ratio = {100};
    }));
    for (SceneSimulation* one : {&world, &scene}) {
        one->set_mode(0, ControlMode::position);
        one->control(0).set_trajectory_limit(ControlMode::position, 1.0);
        one->control(0).set_reference(Eigen::VectorXd::Constant(1, 0.5));
    }
    for (int k = 0; k < 400; ++k) {
        ASSERT_TRUE(world.step());
        ASSERT_TRUE(scene.step());
        ASSERT_NEAR(world.s(0)[0], scene.s(0)[0], 1e-12) << k;
        ASSERT_NEAR(world.readings(0).motor_position[0], scene.readings(0).motor_position[0], 1e-12) << k;
    }
    EXPECT_GT(world.s(0)[0], 0.1);
}

TEST(Imperfections, ContinueBitForBitFromASavedState) {
    SceneSimulation sim = simulate(with([](SceneRobot& robot) {
        make_everything_imperfect(robot.options);
        robot.loop_period = 2 * h;
    }));
    run(sim, 77);
    std::vector<double> state(static_cast<size_t>(sim.state_size()));
    sim.save(state.data());
    const auto expected = run(sim, 50);
    sim.restore(state.data());
    EXPECT_EQ(run(sim, 50), expected);
    SceneSimulation fresh = simulate(sim.scene().options());
    fresh.restore(state.data());
    EXPECT_EQ(run(fresh, 50), expected);
    sim.reset();
    EXPECT_EQ(run(sim, 50), run(sim.scene().options(), 50));
}

TEST(Imperfections, AreRefusedByNameValueAndRemedy) {
    const auto complaint = [](const std::function<void(RobotOptions&)>& change) {
        return complaint_of([&] { simulate(with([&](SceneRobot& robot) { change(robot.options); })); });
    };
    expect_contains(complaint([](auto& o) { o.imperfections.dropout = 1.0; }),
                    {"robot 'wheel'", "dropout is 1; it is a probability, from 0 to below 1"});
    expect_contains(complaint([](auto& o) { o.imperfections.backlash = {-0.1}; }),
                    {"backlash holds -0.1; it must be finite, not negative, and at most 1e10"});
    expect_contains(complaint([](auto& o) {
                        o.imperfections.encoder_resolution = {1, 2};
                    }),
                    {"encoder_resolution holds 2 values; give none, one for all joints"});
    expect_contains(complaint([](auto& o) { o.imperfections.delays.measurement = 0.0025; }),
                    {"robot 'wheel': measurement_delay is 0.0025 s, which is no multiple of the time step, "
                     "0.001 s; give a whole number of them"});
    expect_contains(complaint([](auto& o) { o.imperfections.delays.command = 0.0025; }),
                    {"command_delay is 0.0025 s, which is no multiple of the period of the loops"});
    expect_contains(complaint([](auto& o) {
                        o.armature.clear();
                        o.imperfections.backlash = {0.1};
                    }),
                    {"joint 'axle' has backlash, but its motor has no inertia", "give armature"});
    const std::string file = BF_BINARY_DIRECTORY "/two_joints.xml";
    std::ofstream(file) << R"(<mujoco><worldbody><body name="cart"><joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/><geom size="0.1" mass="1"/></body></worldbody></mujoco>)";
    expect_contains(complaint([&](auto& o) {
                        o.urdf = file;
                        o.imu_frame.clear();
                        o.imperfections.backlash = {0.1};
                    }),
                    {"joint 'x' has backlash, but its link has several joints"});
}

} // namespace bf::physics::test::imperfections
