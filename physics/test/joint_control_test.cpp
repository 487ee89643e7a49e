#include "bf/physics/scene.hpp"
#include "robots.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

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
    robot.loops.kp = {50.0};
    robot.loops.kd = {4.0};
    robot.loops.reference_speed = {0.8};
    robot.loops.torque_constant = {0.3};
    robot.loops.pwm_gain = {6.0};
    robot.loops.back_emf = {0.7};
    robot.loops.stiffness = {20.0};
    robot.loops.damping = {8.0};
    return options;
}

/// Response of I x'' + d x' + k x = 0 from x(0) = x0, x'(0) = v0, where it swings.
double swing(double k, double d, double x0, double v0, double t) {
    const double a = d / (2 * I), w = std::sqrt(k / I - a * a);
    return std::exp(-a * t) * (x0 * std::cos(w * t) + (v0 + a * x0) / w * std::sin(w * t));
}

/// Runs one second with one reference and compares the position.
void expect_motion(JointMode mode, double reference, const std::function<double(double)>& s) {
    SceneSimulation sim(std::make_shared<const Scene>(flywheel()));
    sim.scene().check_mode(0, mode);
    sim.set_mode(0, mode);
    sim.set_references(0, std::array{reference});
    for (int k = 1; k <= 10000; ++k) {
        ASSERT_TRUE(sim.step()) << sim.error();
        ASSERT_NEAR(sim.s(0)[0], s(1e-4 * k), 1e-3) << "t = " << 1e-4 * k;
    }
}

} // namespace

TEST(JointControl, TorqueAcceleratesEvenly) {
    expect_motion(JointMode::torque, 0.4, [](double t) { return 0.5 * 0.4 / I * t * t; });
}
TEST(JointControl, CurrentIsTorqueByItsConstant) {
    expect_motion(JointMode::current, 2.0, [](double t) { return 0.5 * 2.0 * 0.3 / I * t * t; });
}
TEST(JointControl, PwmComesToASpeedAsAMotorDoes) {
    expect_motion(JointMode::pwm, 0.5, [](double t) { // I v' = pwm_gain r - back_emf v
        const double v = 6.0 * 0.5 / 0.7, T = I / 0.7;
        return v * (t - T * (1 - std::exp(-t / T)));
    });
}
TEST(JointControl, PositionDirectSwingsToItsReference) {
    expect_motion(JointMode::position_direct, 1.0, [](double t) { return 1.0 + swing(50, 4, -1, 0, t); });
}
TEST(JointControl, ImpedanceIsASpringWithADamper) {
    // The damping ratio is 8 / (2 sqrt(20 0.5)) > 1: two real poles.
    expect_motion(JointMode::impedance, 1.0, [](double t) {
        const double a = 8 / (2 * I), b = std::sqrt(a * a - 20 / I), p = -a + b, q = -a - b;
        return 1.0 + (q * std::exp(p * t) - p * std::exp(q * t)) / (p - q);
    });
}
TEST(JointControl, VelocityFollowsWithoutALag) {
    // x = r t - s begins at 0 with velocity r, and I x'' + kd x' + kp x = 0.
    expect_motion(JointMode::velocity, 1.5, [](double t) { return 1.5 * t - swing(50, 4, 0, 1.5, t); });
}
TEST(JointControl, PositionGoesItsWayWithTheReferenceSpeed) {
    // On the way I s'' = kp (v t - s) - kd s': x = v t - s - kd v / kp.
    expect_motion(JointMode::position, 3.0, [](double t) {
        const double v = 0.8, lag = 4 * v / 50;
        return v * t - lag - swing(50, 4, -lag, v, t);
    });
    SceneSimulation sim(std::make_shared<const Scene>(flywheel(1e-3)));
    sim.set_mode(0, JointMode::position);
    sim.set_references(0, std::array{1.0});
    for (int k = 0; k < 5000; ++k) ASSERT_TRUE(sim.step());
    EXPECT_NEAR(sim.s(0)[0], 1.0, 1e-6) << "and stays there";
}
TEST(JointControl, HoldsItsTorqueForThePeriodOfTheLoop) {
    SceneOptions options = flywheel(1e-3);
    options.robots[0].loops.period = 0.01;
    SceneSimulation sim(std::make_shared<const Scene>(options));
    sim.set_mode(0, JointMode::position_direct);
    sim.set_references(0, std::array{1.0});
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
    for (const JointMode mode : {JointMode::position, JointMode::velocity, JointMode::pwm}) {
        SceneOptions options = flywheel(1e-3);
        options.robots[0].loops.period = 0.003;
        SceneSimulation sim(std::make_shared<const Scene>(options)),
            other(std::make_shared<const Scene>(options));
        sim.set_mode(0, mode);
        sim.set_references(0, std::array{0.7});
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
TEST(JointControl, NamesTheGainThatAModeNeeds) {
    SceneOptions options = flywheel();
    options.robots[0].loops = {};
    const Scene scene(options);
    scene.check_mode(0, JointMode::torque);
    for (const auto& [mode, gain] : {std::pair{JointMode::position, "kp"},
                                     {JointMode::velocity, "kd"},
                                     {JointMode::pwm, "pwm_gain"},
                                     {JointMode::current, "torque_constant"},
                                     {JointMode::impedance, "stiffness"}})
        EXPECT_THROW(
            try { scene.check_mode(0, mode); } catch (const std::runtime_error& error) {
                EXPECT_EQ(error.what(),
                          std::string("robot 'wheel' has no ") + gain +
                              " for its joint 'axle', which this control mode needs; give it in the "
                              "world's file");
                throw;
            },
            std::runtime_error);
    options.robots[0].loops.kp = {1, 2};
    EXPECT_THROW(Scene{options}, std::runtime_error);
    options.robots[0].loops.kp = {-1};
    EXPECT_THROW(Scene{options}, std::runtime_error);
    options.robots[0].loops.kp = {1};
    options.robots[0].loops.period = 1.5e-4;
    EXPECT_THROW(Scene{options}, std::runtime_error);
}

} // namespace bf::physics::test::joint_control
