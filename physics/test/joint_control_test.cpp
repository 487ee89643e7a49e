#include "bf/physics/scene.hpp"
#include "complaints.hpp"
#include "robots.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <tuple>

namespace bf::physics::test::joint_control {

namespace {

constexpr double I = 0.5; // kg m2, about the joint

SceneOptions flywheel(double step = 1e-4) {
    SceneOptions options;
    options.time_step = step;
    options.floor.enabled = false;
    options.robots = {{"wheel"}};
    SceneRobot& robot = options.robots[0];
    robot.options.urdf = write_urdf("flywheel", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="wheel"><inertial><mass value="1"/><inertia ixx="0.5" iyy="0.5" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="axle" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="wheel"/></joint>)");
    robot.options.floating_base = false;
    robot.motors.position_gains = Eigen::RowVector3d(50.0, 0.0, 4.0);
    robot.motors.torque_constant = {0.3};
    robot.motors.k_tau = {2.0};
    robot.motors.k_bemf = {1.4};
    robot.motors.impedance_gains = Eigen::RowVector2d(20.0, 8.0);
    return options;
}

/// Response of I x'' + d x' + k x = 0 from x(0) = x0, x'(0) = v0, where it swings.
double swing(double k, double d, double x0, double v0, double t) {
    const double a = d / (2 * I), w = std::sqrt(k / I - a * a);
    return std::exp(-a * t) * (x0 * std::cos(w * t) + (v0 + a * x0) / w * std::sin(w * t));
}

void drive(SceneSimulation& sim, ControlMode mode, double reference) {
    sim.set_mode(0, mode);
    sim.control(0).set_reference(Eigen::VectorXd::Constant(1, reference));
}

/// Runs one second with one reference and compares the position.
void expect_motion(ControlMode mode, double reference, const std::function<double(double)>& s,
                   double limit = std::numeric_limits<double>::infinity(),
                   const SceneOptions& options = flywheel()) {
    SceneSimulation sim(std::make_shared<const Scene>(options));
    drive(sim, mode, reference);
    sim.control(0).set_trajectory_limit(mode, limit);
    for (int k = 1; k <= 10000; ++k) {
        ASSERT_TRUE(sim.step()) << sim.error();
        ASSERT_NEAR(sim.s(0)[0], s(1e-4 * k), 1e-3) << "t = " << 1e-4 * k;
    }
}

} // namespace

TEST(JointControl, TorqueAcceleratesEvenly) {
    expect_motion(ControlMode::torque, 0.4, [](double t) { return 0.5 * 0.4 / I * t * t; });
}
TEST(JointControl, CurrentIsTorqueByItsConstant) {
    expect_motion(ControlMode::current, 2.0, [](double t) { return 0.5 * 2.0 * 0.3 / I * t * t; });
}
TEST(JointControl, PwmComesToASpeedAsAMotorDoes) {
    expect_motion(ControlMode::pwm, 6.0, [](double t) { // I v' = (r - k_bemf v) / k_tau
        const double v = 6.0 / 1.4, T = I * 2.0 / 1.4;
        return v * (t - T * (1 - std::exp(-t / T)));
    });
}
TEST(JointControl, PositionDirectSwingsToItsReference) {
    expect_motion(ControlMode::position_direct, 1.0, [](double t) { return 1.0 + swing(50, 4, -1, 0, t); });
}
TEST(JointControl, ImpedanceIsASpringWithADamper) {
    // The damping ratio is 8 / (2 sqrt(20 0.5)) > 1: two real poles.
    expect_motion(ControlMode::impedance, 1.0, [](double t) {
        const double a = 8 / (2 * I), b = std::sqrt(a * a - 20 / I), p = -a + b, q = -a - b;
        return 1.0 + (q * std::exp(p * t) - p * std::exp(q * t)) / (p - q);
    });
}
TEST(JointControl, VelocityFollowsWithoutALag) {
    // x = r t - s begins at 0 with velocity r, and I x'' + D x' + P x = 0.
    expect_motion(ControlMode::velocity, 1.5, [](double t) { return 1.5 * t - swing(50, 4, 0, 1.5, t); });
}
TEST(JointControl, PositionGoesItsWayWithTheReferenceSpeed) {
    // On the way x = v t - s begins at 0 with velocity v, and I x'' + D x' + P x = 0.
    const double v = 0.8;
    expect_motion(
        ControlMode::position, 3.0, [&](double t) { return v * t - swing(50, 4, 0, v, t); }, v);
    SceneSimulation sim(std::make_shared<const Scene>(flywheel(1e-3)));
    drive(sim, ControlMode::position, 1.0);
    sim.control(0).set_trajectory_limit(ControlMode::position, v);
    for (int k = 0; k < 5000; ++k) ASSERT_TRUE(sim.step());
    EXPECT_NEAR(sim.s(0)[0], 1.0, 1e-6) << "and stays there";
}
TEST(JointControl, HoldsItsTorqueForThePeriodOfTheLoop) {
    SceneOptions options = flywheel(1e-3);
    options.robots[0].loop_period = 0.01;
    SceneSimulation sim(std::make_shared<const Scene>(options));
    drive(sim, ControlMode::position_direct, 1.0);
    double last = 0.0;
    for (int k = 0; k < 100; ++k) {
        const double s = sim.s(0)[0], s_dot = sim.s_dot(0)[0];
        ASSERT_TRUE(sim.step());
        if (k % 10 == 0)
            EXPECT_NEAR(sim.tau(0)[0], 50 * (1 - s) - 4 * s_dot, 1e-12) << k;
        else
            EXPECT_EQ(sim.tau(0)[0], last) << k;
        last = sim.tau(0)[0];
    }
}
TEST(JointControl, GoesOnBitForBitInEveryMode) {
    for (const ControlMode mode : {ControlMode::position, ControlMode::velocity, ControlMode::torque,
                                   ControlMode::pwm, ControlMode::impedance}) {
        SceneOptions options = flywheel(1e-3);
        options.robots[0].loop_period = 0.003;
        options.robots[0].motors.torque_gains = Eigen::RowVector3d(0.5, 0.1, 1e-4);
        SceneSimulation sim(std::make_shared<const Scene>(options)),
            other(std::make_shared<const Scene>(options));
        drive(sim, mode, 0.7);
        sim.control(0).set_trajectory_limit(mode, 0.5);
        for (int k = 0; k < 100; ++k) ASSERT_TRUE(sim.step());
        std::vector<double> state(static_cast<size_t>(sim.state_size()));
        sim.save(state.data());
        other.restore(state.data());
        for (int k = 0; k < 100; ++k) {
            ASSERT_TRUE(sim.step());
            ASSERT_TRUE(other.step());
            ASSERT_EQ(sim.s(0)[0], other.s(0)[0]);
        }
    }
}
TEST(JointControl, VelocityAcceleratesAtTheReferenceAcceleration) {
    // Until a t = r, x = a t^2 / 2 - s is at rest, but for I x'' + D x' + P x = I a.
    const double a = 1.2, still = I * a / 50;
    expect_motion(
        ControlMode::velocity, 3.0,
        [&](double t) { return 0.5 * a * t * t - still - swing(50, 4, -still, 0, t); }, a);
}
TEST(JointControl, DampsCriticallyWithoutGains) {
    const auto expect = [](ControlMode mode, double w) {
        SceneOptions options = flywheel();
        options.robots[0].motors = {};
        options.robots[0].options.armature = {0.25};
        expect_motion(
            mode, 1.0, [&](double t) { return 1.0 - (1.0 + w * t) * std::exp(-w * t); },
            std::numeric_limits<double>::infinity(), options);
    };
    expect(ControlMode::position_direct, 30);
    expect(ControlMode::impedance, 10);
}
TEST(JointControl, SeesTheInertiaOfFollowersToo) {
    WorldOptions options;
    options.urdf = write_urdf("geared", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="wheel"><inertial><mass value="1"/><inertia ixx="0.5" iyy="0.5" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="pinion"><inertial><mass value="1"/><inertia ixx="0.3" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="axle" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="wheel"/></joint>
      <joint name="shaft" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="pinion"/></joint>)");
    options.joints = {"axle"};
    options.followers = {{"shaft", "axle", -2.0, 0.0}};
    options.floating_base = false;
    options.armature = {0.1};
    SceneSimulation sim(std::make_shared<const Scene>(options));
    EXPECT_NEAR(sim.control(0).gains(Loop::position).P[0], 900.0 * (0.5 + 0.1 + 2.0 * 2.0 * 0.3), 1e-9);
}
TEST(JointControl, WarnsOfGainsExactlyWhereALoopCannotHoldThem) {
    struct Case {
        Eigen::RowVector3d gains; ///< P I D
        double loop_period;
        bool grows;
    };
    const std::vector<Case> cases{
        {{1, 0, 0.99 * 2 * I / 1e-3}, 0, false}, // D = 2 I / T
        {{1, 0, 1.01 * 2 * I / 1e-3}, 0, true},
        {{1, 0, 0.99 * 2 * I / 1e-2}, 1e-2, false},
        {{1, 0, 1.01 * 2 * I / 1e-2}, 1e-2, true},
        {{0.99 * 4 * I / 1e-6, 0, 0}, 0, false}, // P = 4 I / T^2
        {{1.01 * 4 * I / 1e-6, 0, 0}, 0, true},
        {{0.99 * 2 * I / 1e-6, 0, 0.99 * I / 1e-3}, 0, false},
        {{1.01 * 2 * I / 1e-6, 0, 1.01 * I / 1e-3}, 0, true},
        {{5000, 0, 25}, 1e-2, false}, // D = P T 9 / 20, as ten steps hold the torque
        {{5000, 0, 20}, 1e-2, true},
        {{50, 300, 4}, 0, false}, // the integral = P D / I
        {{50, 500, 4}, 0, true}};
    for (const Case& given : cases) {
        SceneOptions options = flywheel(1e-3);
        options.robots[0].loop_period = given.loop_period;
        options.robots[0].motors.position_gains = given.gains;
        const auto scene = std::make_shared<const Scene>(options);
        SceneSimulation sim(scene);
        drive(sim, ControlMode::position_direct, 1e-9);
        double early = 0.0, late = 0.0; // speeds
        for (int k = 0; k < 8000 && late <= 2 * early + 1e-6; ++k) {
            ASSERT_TRUE(sim.step()) << sim.error();
            double& greatest = k < 1000 ? early : late;
            greatest = std::max(greatest, std::abs(sim.s_dot(0)[0]));
            if (early > 1.0) break;
        }
        EXPECT_EQ(early > 1.0 || late > 2 * early, given.grows) << given.gains;
        EXPECT_EQ(scene->loop_warnings().size(), given.grows ? 1u : 0u) << given.gains;
    }
}
TEST(JointControl, WarnsOfATorqueLoopThatMultipliesItsError) {
    for (const auto& [P, I, D, grows] : {std::tuple{1.9, 0.0, 0.0, false},
                                         {2.1, 0.0, 0.0, true},
                                         {0.0, 3900.0, 0.0, false},
                                         {0.0, 4100.0, 0.0, true},
                                         {0.0, 0.0, 0.9e-3, false},
                                         {0.0, 0.0, 1.1e-3, true}}) {
        SceneOptions options = flywheel(1e-3);
        options.robots[0].motors.torque_gains = Eigen::RowVector3d(P, I, D);
        const auto scene = std::make_shared<const Scene>(options);
        SceneSimulation sim(scene);
        drive(sim, ControlMode::torque, 1e-6);
        for (int k = 0; k < 500; ++k) ASSERT_TRUE(sim.step()) << sim.error();
        EXPECT_EQ(std::abs(sim.tau(0)[0]) > 1e-4, grows) << P << " " << I << " " << D;
        EXPECT_EQ(scene->loop_warnings().size(), grows ? 1u : 0u) << P << " " << I << " " << D;
    }
}
TEST(JointControl, NamesRobotJointGainsAndRemedyOfAnUnstableLoop) {
    SceneOptions options = flywheel(1e-3);
    options.robots[0].where = "'world.xml', line 3";
    options.robots[0].motors.position_gains = Eigen::RowVector3d(5000, 0, 2000);
    options.robots[0].motors.impedance_gains = Eigen::RowVector2d(0, 2000);
    options.robots[0].motors.torque_gains = Eigen::RowVector3d(3, 0, 0);
    const Scene scene(options);
    ASSERT_EQ(scene.loop_warnings().size(), 3u);
    EXPECT_EQ(scene.loop_warnings()[0],
              "'world.xml', line 3: robot 'wheel': joint 'axle': its position_gains are P 5000, I 0, D 2000, "
              "which a loop of 0.001 s cannot hold with the inertia of 0.5 that the joint sees at the start; "
              "lower the gains (D is to be below 2 inertia / period, 1000, P below 4 inertia / period^2, "
              "2e+06), shorten the step or loop_period, or add armature; as it is, what disturbs the loop "
              "grows 3.0075-fold in each period");
    expect_contains(scene.loop_warnings()[1], {"its impedance_gains are K 0, D 2000, which a loop of"});
    EXPECT_EQ(scene.loop_warnings()[2],
              "'world.xml', line 3: robot 'wheel': joint 'axle': its torque_gains are P 3, I 0, D 0 at a "
              "k_tau of 2, but the loop measures the torque of its last period; keep P + 2 D / period + I "
              "period / 2 below k_tau; as it is, what disturbs the loop grows 1.5-fold in each period");
}
TEST(JointControl, RefusesWhatIsNoGainByItsNameAndJoint) {
    const auto complaint = [](auto&& change) {
        SceneOptions options = flywheel();
        change(options.robots[0]);
        try {
            const Scene scene(options);
        } catch (const std::runtime_error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(
        complaint([](SceneRobot& robot) { robot.motors.position_gains = Eigen::RowVector2d(1, 2); }),
        "robot 'wheel': 'position_gains' is 1x2; give finite rows P I D, one for all joints or one each");
    EXPECT_EQ(complaint([](SceneRobot& robot) { robot.motors.k_tau = {0.0}; }),
              "robot 'wheel': 'k_tau' has 0 for joint 'axle'; give a finite number other than 0");
    EXPECT_EQ(
        complaint([](SceneRobot& robot) {
            robot.motors.gear_ratio = {1, 2};
        }),
        "robot 'wheel': 'gear_ratio' has 2 elements, but there are 1 joints; give one for all or one each");
    EXPECT_EQ(
        complaint([](SceneRobot& robot) { robot.loop_period = 1.5e-4; }),
        "robot 'wheel': loop_period is 0.00015 s, which is no multiple of the time step, 0.0001 s; give a "
        "whole number of them");
}

TEST(JointControl, BeginsWithTheTorquesThatItIsPreloadedWith) {
    const Eigen::VectorXd s = Eigen::Vector2d(0.3, -0.2), rest = Eigen::Vector2d::Zero(),
                          tau = Eigen::Vector2d(4, 5);
    MotorOptions options;
    options.position_gains = (Eigen::MatrixXd(2, 3) << 10, 2, 1, 10, 0, 1).finished();
    JointControl control(Motors(options, {"a", "b"}, Eigen::Vector2d(1, 1)));
    control.set_mode(ControlMode::position_direct, s);
    control.preload(tau);
    control.set_reference(s);
    const Eigen::VectorXd torques = control.advance(0.001, s, rest, rest);
    EXPECT_DOUBLE_EQ(torques[0], 4);
    EXPECT_EQ(torques[1], 0) << "without I it has nothing to hold with";
}

} // namespace bf::physics::test::joint_control
