#include "bf/physics/world.hpp"
#include "robots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <random>
#include <thread>

using namespace bf::physics;
using namespace bf::physics::test;

namespace {

constexpr double weight_of_icub = 33.061673 * 9.81;

std::vector<double> state_of(const Simulation& sim) {
    std::vector<double> state(static_cast<size_t>(sim.state_size()));
    sim.save(state.data());
    return state;
}

/// Stands for `steps`, with a torque disturbance that differs from step to step but not from run to run.
void stand(Simulation& sim, int steps, int first = 0) {
    HoldPosture hold(sim.world());
    for (int k = first; k < first + steps; ++k) {
        hold(sim);
        hold.tau[k % hold.tau.size()] += 2.0 * std::sin(0.37 * k);
        ASSERT_TRUE(sim.step({hold.tau.data(), static_cast<size_t>(hold.tau.size())})) << sim.error();
    }
}

double vertical_contact_force(const Simulation& sim) { return sim.foot_wrench(0)[2] + sim.foot_wrench(1)[2]; }

WorldOptions pendulum() {
    WorldOptions options;
    options.urdf = pendulum_urdf();
    options.floating_base = false;
    options.floor.enabled = false;
    options.initial_joints = {1.0};
    return options;
}

WorldOptions floating_icub() {
    WorldOptions options = icub_options();
    options.floor.enabled = false;
    return options;
}

} // namespace

TEST(Simulation, ComesToLieOnTheGroundWhereAllShapesTouchIt) {
    const auto limp = [](bool lands) {
        WorldOptions options = icub_options();
        options.lands = lands;
        Simulation sim = simulate(options);
        const std::vector<double> none(options.joints.size(), 0.0);
        for (int k = 0; k < 4000; ++k) EXPECT_TRUE(sim.step(none)) << sim.error();
        return std::pair{sim.w_H_b()(2, 3), sim.com()[2]};
    };
    const auto [base, com] = limp(true);
    EXPECT_GT(base, 0.02);
    EXPECT_GT(com, 0.02);
    EXPECT_LT(com, 0.35);
    EXPECT_LT(limp(false).second, 0.0) << "only its feet keep it";

    // Standing, nothing but the feet touches: the motion is the same.
    WorldOptions options = icub_options();
    options.lands = true;
    Simulation all = simulate(options), feet = simulate(icub_options());
    stand(all, 500);
    stand(feet, 500);
    EXPECT_EQ(Eigen::VectorXd(all.s()), Eigen::VectorXd(feet.s()));
    EXPECT_EQ(all.foot_wrench(0)[2], feet.foot_wrench(0)[2]);
}

TEST(Simulation, StandsUnderJointPdWithTheContactForcesCarryingTheWeight) {
    Simulation sim = simulate(icub_options());
    HoldPosture hold(sim.world());
    for (int k = 0; k < 2000; ++k) ASSERT_TRUE(sim.step(hold(sim))) << sim.error();
    EXPECT_NEAR(sim.time(), 2.0, 1e-9);
    EXPECT_NEAR(vertical_contact_force(sim), weight_of_icub, 0.01 * weight_of_icub);
    EXPECT_GT(sim.w_H_b()(2, 3), 0.55);
    for (int foot : {0, 1}) {
        EXPECT_LT(sim.foot_pose(foot)(2, 3), 1e-3);
        // centre of pressure (x, y) = (-m_y, m_x) / f_z within the spheres' rectangle
        const Vector6d wrench = sim.foot_wrench(foot);
        EXPECT_NEAR(-wrench[4] / wrench[2], 0.0265, 0.075);
        EXPECT_NEAR(wrench[3] / wrench[2], 0.0, 0.031);
    }
}

TEST(Simulation, StartsUprightWithTheOriginMidwayBetweenTheSoles) {
    Simulation sim = simulate(icub_options());
    const Eigen::Matrix4d left = sim.foot_pose(0), right = sim.foot_pose(1);
    EXPECT_LT(std::hypot((left + right)(0, 3), (left + right)(1, 3)), 1e-12);
    EXPECT_NEAR(left(1, 3), 0.075, 0.002);
    EXPECT_NEAR((left + right)(1, 0), 0.0, 1e-12); // mean x axis forward
    EXPECT_GT((left + right)(0, 0), 1.9);
    EXPECT_NEAR(sim.w_H_b()(2, 2), 1.0, 1e-12);
    EXPECT_NEAR(sim.w_H_b()(0, 3), 0.017, 0.002);
    EXPECT_NEAR(sim.w_H_b()(2, 3), 0.606, 0.001);
    EXPECT_NEAR(sim.com()[0], 0.0265, 1e-3);
    double lowest = 1.0;
    for (int foot : {0, 1})
        for (const ContactShape& shape : four_spheres())
            lowest =
                std::min(lowest, (sim.foot_pose(foot) * shape.position.homogeneous())[2] - shape.size[0]);
    EXPECT_NEAR(lowest, -0.05e-3, 1e-12);
}

TEST(Simulation, WeighsWhatItsLinksWeigh) {
    EXPECT_NEAR(World(icub_options()).mass(), 33.061673, 1e-6);
    EXPECT_NEAR(World(pendulum()).mass(), 5.0, 1e-12);
}

TEST(Simulation, RepeatsBitForBit) {
    const auto world = std::make_shared<const World>(icub_options());
    Simulation first(world), second(world);
    stand(first, 500);
    stand(second, 500);
    EXPECT_EQ(state_of(first), state_of(second));
    second.reset();
    stand(second, 500);
    EXPECT_EQ(state_of(first), state_of(second));
}

TEST(Simulation, ContinuesBitForBitFromASavedState) {
    WorldOptions options = icub_options();
    options.noise = {1e-4, 1e-2, 0.2, 7};
    const auto world = std::make_shared<const World>(options);
    std::mt19937 random(42);
    for (int repetition = 0; repetition < 3; ++repetition) {
        const int instant = std::uniform_int_distribution(1, 300)(random);
        Simulation original(world);
        stand(original, instant);
        const std::vector<double> saved = state_of(original);
        stand(original, 200, instant);

        Simulation restored(world);
        stand(restored, 17); // its own history must not matter
        restored.restore(saved.data());
        EXPECT_EQ(state_of(restored), saved);
        stand(restored, 200, instant);
        EXPECT_EQ(state_of(restored), state_of(original));
    }
}

TEST(Simulation, MovesTheSameWhateverTheOrderOfJoints) {
    WorldOptions reversed = icub_options();
    std::reverse(reversed.joints.begin(), reversed.joints.end());
    std::reverse(reversed.initial_joints.begin(), reversed.initial_joints.end());
    Simulation a = simulate(icub_options()), b = simulate(reversed);
    HoldPosture hold_a(a.world()), hold_b(b.world());
    for (int k = 0; k < 300; ++k) {
        ASSERT_TRUE(a.step(hold_a(a)));
        ASSERT_TRUE(b.step(hold_b(b)));
    }
    EXPECT_LT((a.s() - b.s().reverse()).norm(), 1e-9);
    EXPECT_LT((a.tau() - b.tau().reverse()).norm(), 1e-6);
    EXPECT_LT((a.w_H_b() - b.w_H_b()).norm(), 1e-9);
    EXPECT_EQ(a.world().upper_limits(), b.world().upper_limits().reverse());
    EXPECT_GT(a.s()[6], 0.5); // the elbow is where the caller put it
}

TEST(Simulation, MeasuresABaseVelocityThatIsTheDerivativeOfThePose) {
    WorldOptions options = floating_icub();
    options.base_link = "l_foot"; // far from the free joint
    options.time_step = 1e-5;
    Simulation sim = simulate(options);
    std::vector<double> tau(23, 0.0);
    tau[0] = 20.0;
    tau[11] = -15.0;
    for (int k = 0; k < 5000; ++k) ASSERT_TRUE(sim.step(tau));
    const Eigen::Matrix4d before = sim.w_H_b();
    const Vector6d v_before = sim.v_b();
    ASSERT_TRUE(sim.step(tau));
    const Vector6d v = 0.5 * (v_before + sim.v_b());
    const Eigen::Matrix4d rate = (sim.w_H_b() - before) / 1e-5;
    const Eigen::Matrix3d S =
        rate.topLeftCorner<3, 3>() * (0.5 * (sim.w_H_b() + before)).topLeftCorner<3, 3>().transpose();
    EXPECT_GT(v.norm(), 0.1);
    EXPECT_LT((v.head<3>() - rate.topRightCorner<3, 1>()).norm(), 1e-3 * v.norm());
    EXPECT_LT((v.tail<3>() - Eigen::Vector3d(S(2, 1), S(0, 2), S(1, 0))).norm(), 1e-3 * v.norm());
}

TEST(Simulation, FallsFreelyWithTheAccelerationOfGravity) {
    Simulation sim = simulate(floating_icub());
    const double height = sim.com()[2];
    const std::vector<double> tau(23, 0.0);
    for (int k = 0; k < 200; ++k) ASSERT_TRUE(sim.step(tau));
    // semi-implicit integration: z_k = z_0 - g dt² k (k + 1) / 2
    EXPECT_NEAR(sim.com()[2], height - 9.81e-6 * 200 * 201 / 2, 1e-9);
    EXPECT_NEAR(sim.v_b()[2], -9.81 * 0.2, 1e-9);
    EXPECT_LT(sim.accelerometer().norm(), 1e-9);
    EXPECT_LT(sim.ft_wrench(0).norm(), 1e-9);
    EXPECT_EQ(vertical_contact_force(sim), 0.0);
}

TEST(Simulation, GainsTheMomentumOfAPush) {
    Simulation sim = simulate(floating_icub());
    const std::vector<double> tau(23, 0.0), push{40.0, -25.0, 10.0, 1.0, 2.0, 3.0};
    const std::vector<double> none(6, 0.0);
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(sim.step(tau, push));
    ASSERT_TRUE(sim.step(tau, none));
    const Eigen::Vector3d before = sim.com();
    ASSERT_TRUE(sim.step(tau));
    const Eigen::Vector3d momentum = sim.world().mass() * (sim.com() - before) / 1e-3;
    const Eigen::Vector3d impulse =
        0.1 * Eigen::Vector3d(40, -25, 10) - weight_of_icub * 0.102 * Eigen::Vector3d::UnitZ();
    EXPECT_LT((momentum - impulse).norm(), 2e-3 * impulse.norm());
}

TEST(Simulation, PushesAtTheCentreOfMassOfTheLink) {
    // Without gravity a force through the centre of a free link turns nothing.
    WorldOptions options;
    options.urdf = write_urdf("lump", R"(
      <link name="core"><inertial><origin xyz="0.1 0.2 0.3"/><mass value="2"/>
        <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="lid"><inertial><origin xyz="0 0 1"/><mass value="2"/>
        <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="glue" type="fixed"><parent link="core"/><child link="lid"/></joint>)");
    options.gravity.setZero();
    options.push_links = {"core", "lid"};
    Simulation sim = simulate(options);
    const std::vector<double> torque_free{0, 4, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0}; // equal forces on equal masses
    ASSERT_TRUE(sim.step({}, torque_free));
    EXPECT_NEAR(sim.v_b()[1], 2e-3, 1e-12);
    EXPECT_LT(sim.v_b().tail<3>().norm(), 1e-12);
    ASSERT_TRUE(sim.step({}, std::vector<double>{0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_GT(sim.v_b().tail<3>().norm(), 1e-4); // off the common centre
}

TEST(Simulation, TakesHoldOfABodyAtAPoint) {
    // A force at a point of a free body without gravity: F = m a, and r x F turns it about its centre.
    WorldOptions options;
    options.urdf = write_urdf("grabbed", R"(
      <link name="core"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
        <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>)");
    options.gravity.setZero();
    Simulation sim = simulate(options);
    EXPECT_EQ(sim.world().bodies(), std::vector<std::string>{"core"});
    ASSERT_TRUE(sim.step({}, {}, {1, {0.1, 0.5, 0}, {4, 0, 0}}));
    EXPECT_NEAR(sim.v_b()[5], -0.5 * 4 / 0.04 * 1e-3, 1e-9); // -r_y F_x / I_zz
    EXPECT_NEAR(sim.v_b()[0], 4.0 / 2 * 1e-3, 1e-9);
    const double before = sim.v_b()[5];
    ASSERT_TRUE(sim.step({}));
    EXPECT_NEAR(sim.v_b()[5], before, 1e-9); // it lets go
    EXPECT_FALSE(sim.step({}, {}, {2, {0, 0, 0}, {1, 0, 0}}));
    EXPECT_STREQ(sim.error(), "t = 0.002 s: a disturbance acts on body 2; the world has the bodies 1 to 1");
    sim.reset();
    EXPECT_FALSE(sim.step({}, {}, {1, {0, 0, 0}, {0, 1e11, 0}}));
    EXPECT_STREQ(
        sim.error(),
        "t = 0 s: the disturbance of 'core' has the component 1e+11; it must be finite and below 1e10");
}

TEST(Simulation, WarnsOfAStepThatIsLongForContacts) {
    WorldOptions options = pendulum();
    options.time_step = 0.005;
    EXPECT_TRUE(World(options).scene()->loop_warnings().empty());
    options.time_step = 0.01;
    EXPECT_EQ(
        World(options).scene()->loop_warnings(),
        std::vector<std::string>{"the world steps by 0.01 s, as its inputs do unless it has a period of its "
                                 "own; contacts and quick joints are coarse by more than 0.005 s: give it "
                                 "a shorter period"});
}

TEST(Simulation, KeepsTheEnergyOfAPendulum) {
    WorldOptions options = pendulum();
    options.time_step = 1e-4;
    options.integrator = Integrator::euler;
    Simulation sim = simulate(options);
    const double m = 2.0, l = 0.5, I = 0.03 + m * l * l;
    const auto energy = [&] {
        return 0.5 * I * sim.s_dot()[0] * sim.s_dot()[0] - m * 9.81 * l * std::cos(sim.s()[0]);
    };
    const double initial = energy(), scale = m * 9.81 * l;
    double fastest = 0.0, worst = 0.0;
    const std::vector<double> tau(1, 0.0);
    for (int k = 0; k < 50000; ++k) {
        ASSERT_TRUE(sim.step(tau));
        fastest = std::max(fastest, std::abs(sim.s_dot()[0]));
        worst = std::max(worst, std::abs(energy() - initial));
    }
    EXPECT_LT(worst, 1e-3 * scale);
    // ½ I ω² = m g l (1 - cos 1) at the bottom
    EXPECT_NEAR(fastest, std::sqrt(2 * scale * (1 - std::cos(1.0)) / I), 1e-3);
}

TEST(Simulation, MeasuresTheAccelerationOfTheEquationOfMotion) {
    Simulation sim = simulate(pendulum());
    // (I + m l²) s_ddot = tau - m g l sin s
    const auto expected = [](double s, double tau) { return (tau - 2.0 * 9.81 * 0.5 * std::sin(s)) / 0.53; };
    EXPECT_NEAR(sim.s_ddot()[0], expected(1.0, 0.0), 1e-9);
    for (int k = 0; k < 50; ++k) {
        const double s = sim.s()[0];
        ASSERT_TRUE(sim.step(std::vector<double>{0.7}));
        EXPECT_NEAR(sim.s_ddot()[0], expected(s, 0.7), 1e-9);
    }
}

TEST(Simulation, SharesAWorldBetweenThreads) {
    const auto world = std::make_shared<const World>(icub_options());
    Simulation alone(world), first(world), second(world);
    stand(alone, 300);
    std::thread other([&] { stand(first, 300); });
    stand(second, 300);
    other.join();
    EXPECT_EQ(state_of(first), state_of(alone));
    EXPECT_EQ(state_of(second), state_of(alone));
}

TEST(Simulation, StandsAFixedBaseWhereItIsTold) {
    WorldOptions options = pendulum();
    options.base_link = "tip";
    options.initial_w_H_b = Eigen::Matrix4d::Identity();
    (*options.initial_w_H_b)(0, 3) = 3.0;
    Simulation sim = simulate(options);
    EXPECT_LT((sim.w_H_b() - *options.initial_w_H_b).norm(), 1e-12);
    ASSERT_TRUE(sim.step(std::vector<double>{0.0}));
    EXPECT_NEAR(sim.s()[0], 1.0, 1e-3);
}

TEST(Simulation, ReadsForceTorqueSensorsThatCarryTheWeight) {
    Simulation sim = simulate(icub_options());
    HoldPosture hold(sim.world());
    for (int k = 0; k < 4000; ++k) ASSERT_TRUE(sim.step(hold(sim)));
    for (int foot : {0, 1}) {
        // The sensor's axes are the sole's, turned by half a turn about x; it sits above the sole's origin.
        const Vector6d wrench = sim.ft_wrench(foot);
        const Eigen::Matrix3d R =
            sim.foot_pose(foot).topLeftCorner<3, 3>() * Eigen::Vector3d(1, -1, -1).asDiagonal();
        const Eigen::Vector3d force = R * wrench.head<3>();
        const double foot_weight = 0.382866 * 9.81;
        EXPECT_NEAR(force.z(), sim.foot_wrench(foot)[2] - foot_weight, 0.3);
        EXPECT_NEAR(force.x(), sim.foot_wrench(foot)[0], 0.3);
        EXPECT_NEAR(force.y(), sim.foot_wrench(foot)[1], 0.3);
        const Eigen::Vector3d lever =
            sim.foot_pose(foot).topLeftCorner<3, 3>() * Eigen::Vector3d(-0.0035, 0, 0.004);
        const Eigen::Vector3d moment = R * wrench.tail<3>() + lever.cross(force);
        EXPECT_GT(std::abs(moment.y()), 1.0);
        EXPECT_LT((moment - sim.foot_wrench(foot).tail<3>()).norm(),
                  0.2); // of which 0.13 N m by the foot's weight
    }
    const double carried = -sim.ft_wrench(0)[2] - sim.ft_wrench(1)[2];
    EXPECT_NEAR(carried, (33.061673 - 2 * 0.382866) * 9.81, 1.0);
}

TEST(Simulation, MeasuresGravityAndRotationWithTheImu) {
    Simulation sim = simulate(icub_options());
    HoldPosture hold(sim.world());
    for (int k = 0; k < 3000; ++k) ASSERT_TRUE(sim.step(hold(sim)));
    EXPECT_LT((sim.imu_rotation() * sim.accelerometer() - Eigen::Vector3d(0, 0, 9.81)).norm(), 0.1);
    const Eigen::Vector3d rpy = sim.imu_rpy();
    const Eigen::Matrix3d R = (Eigen::AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(rpy[1], Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(rpy[0], Eigen::Vector3d::UnitX()))
                                  .toRotationMatrix();
    EXPECT_LT((R - sim.imu_rotation()).norm(), 1e-12);

    WorldOptions swinging = pendulum();
    swinging.imu_frame = "tip";
    Simulation swing = simulate(swinging);
    for (int k = 0; k < 300; ++k) ASSERT_TRUE(swing.step(std::vector<double>{0.0}));
    EXPECT_NEAR(swing.gyro()[1], swing.s_dot()[0], 1e-12);
    EXPECT_GT(std::abs(swing.gyro()[1]), 0.5);
}

TEST(Simulation, AppliesTorquesWithinTheEffortLimits) {
    Simulation sim = simulate(icub_options());
    std::vector<double> tau(23, 0.0);
    tau[14] = 1000.0;
    tau[20] = -3.0;
    ASSERT_TRUE(sim.step(tau));
    EXPECT_DOUBLE_EQ(sim.tau()[14], sim.world().effort_limits()[14]);
    EXPECT_NEAR(sim.world().effort_limits()[14], 37.0, 1e-12);
    EXPECT_DOUBLE_EQ(sim.tau()[20], -3.0);
}

TEST(Simulation, AddsNoiseOfTheGivenSizeToMeasurementsOnly) {
    WorldOptions noisy = pendulum();
    noisy.noise = {1e-3, 1e-2, 0.1, 3};
    Simulation clean = simulate(pendulum()), sim = simulate(noisy);
    const int steps = 4000;
    double square[3] = {}, mean = 0.0;
    for (int k = 0; k < steps; ++k) {
        ASSERT_TRUE(sim.step(std::vector<double>{0.5}));
        ASSERT_TRUE(clean.step(std::vector<double>{0.5}));
        square[0] += std::pow(sim.s()[0] - clean.s()[0], 2);
        square[1] += std::pow(sim.s_dot()[0] - clean.s_dot()[0], 2);
        square[2] += std::pow(sim.tau()[0] - clean.tau()[0], 2);
        mean += (sim.s()[0] - clean.s()[0]) / steps;
    }
    EXPECT_NEAR(std::sqrt(square[0] / steps), 1e-3, 5e-5);
    EXPECT_NEAR(std::sqrt(square[1] / steps), 1e-2, 5e-4);
    EXPECT_NEAR(std::sqrt(square[2] / steps), 0.1, 5e-3);
    EXPECT_NEAR(mean, 0.0, 5e-5);
    noisy.noise.seed = 4;
    EXPECT_NE(simulate(noisy).s()[0], simulate(pendulum()).s()[0]);
}

TEST(Simulation, ReportsInputsThatAreNotFinite) {
    Simulation sim = simulate(icub_options());
    std::vector<double> tau(23, 0.0);
    tau[14] = std::nan("");
    EXPECT_FALSE(sim.step(tau));
    EXPECT_STREQ(sim.error(),
                 "t = 0 s: the torque of joint 'l_knee' is nan; it must be finite and below 1e10");
    tau[14] = 0.0;
    EXPECT_FALSE(sim.step(tau)) << "a failed simulation stays failed";
    sim.reset();
    EXPECT_TRUE(sim.step(tau));
    EXPECT_STREQ(sim.error(), "");
    EXPECT_FALSE(sim.step(tau, std::vector<double>{0, INFINITY, 0, 0, 0, 0}));
    EXPECT_STREQ(sim.error(), "t = 0.001 s: the wrench on 'chest' has the component inf; it must be "
                              "finite and below 1e10");
    sim.reset();
    EXPECT_FALSE(sim.step(std::vector<double>(3)));
    EXPECT_STREQ(sim.error(), "step got 3 torques; the world has 23 joints");
}

TEST(Simulation, ReportsDivergenceInsteadOfRestarting) {
    Simulation sim = simulate(pendulum());
    const std::vector<double> saved = state_of(sim);
    ASSERT_FALSE(sim.step(std::vector<double>{9e9})); // 9e9 / 0.53 exceeds 1e10 rad/s²
    EXPECT_NE(std::string(sim.error()).find("the simulation diverged"), std::string::npos) << sim.error();
    EXPECT_NE(std::string(sim.error()).find("'swing'"), std::string::npos) << sim.error();
    EXPECT_NE(std::string(sim.error()).find("lower the gains or the time step"), std::string::npos);
    sim.restore(saved.data());
    EXPECT_TRUE(sim.step(std::vector<double>{0.0})) << sim.error();
}

TEST(FixedBase, CentreOfMassIsThatOfAllLinks) {
    WorldOptions options;
    options.urdf = pendulum_urdf();
    options.floating_base = false;
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    H.topRightCorner<3, 1>() << 0.4, -0.3, 0.2;
    options.initial_w_H_b = H;
    const Simulation sim = simulate(options);
    // 3 kg at the base and 2 kg at half a metre below the hinge, which is 1 m above it.
    const Eigen::Vector3d com =
        H.topLeftCorner<3, 3>() * Eigen::Vector3d(0, 0, 2 * 0.5 / 5) + H.topRightCorner<3, 1>();
    EXPECT_LT((sim.com() - com).norm(), 1e-12);
    EXPECT_LT((sim.w_H_b() - H).norm(), 1e-12);
}

TEST(FloatingBase, AllThatIsFixedToARootWithoutMassFalls) {
    WorldOptions options;
    options.floor.enabled = false;
    options.urdf = write_urdf("siblings", R"(
      <link name="root"/>
      <link name="a"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="b"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="i" type="fixed"><parent link="root"/><child link="a"/></joint>
      <joint name="j" type="fixed"><origin xyz="1 0 0"/><parent link="root"/><child link="b"/></joint>)");
    Simulation sim = simulate(options);
    const double height = sim.com()[2];
    EXPECT_NEAR(sim.com()[0], 0.4, 1e-12);
    for (int k = 0; k < 100; ++k) ASSERT_TRUE(sim.step({}));
    EXPECT_NEAR(sim.com()[2] - height, -0.5 * 9.81 * 0.1 * 0.1, 1e-3);
}

/// (I1 + k² I2) s_ddot = tau for two rotors of which the second turns k times as fast.
TEST(Followers, MoveWithTheirLeaderAndAddTheirInertia) {
    WorldOptions options;
    options.urdf = write_urdf("geared", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="wheel"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="pinion"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="slow" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="wheel"/></joint>
      <joint name="fast" type="continuous"><axis xyz="0 0 1"/><parent link="stand"/><child link="pinion"/>
        <mimic joint="slow" multiplier="-3" offset="0.2"/></joint>)");
    options.floating_base = false;
    options.joints = {"slow"};
    options.followers = {{"fast", "slow", -3.0, 0.2}};
    Simulation sim = simulate(options);
    ASSERT_TRUE(sim.step(std::array{2.8}));
    EXPECT_NEAR(sim.s_ddot()[0], 2.8 / (0.5 + 9 * 0.1), 1e-3);
    for (int k = 0; k < 500; ++k) ASSERT_TRUE(sim.step(std::array{2.8}));
    EXPECT_NEAR(sim.s_dot()[0], 2.0 * 0.501, 2e-3);
    options.followers = {{"fast", "", 1.0, 0.2}}; // locked
    Simulation locked = simulate(options);
    ASSERT_TRUE(locked.step(std::array{2.8}));
    EXPECT_NEAR(locked.s_ddot()[0], 2.8 / 0.5, 1e-9);
    options.followers.clear();
    options.joints = {"slow", "fast"}; // independent, whatever the URDF says
    Simulation free = simulate(options);
    ASSERT_TRUE(free.step(std::array{1.0, 1.0}));
    EXPECT_NEAR(free.s_ddot()[0], 1.0 / 0.5, 1e-9);
    EXPECT_NEAR(free.s_ddot()[1], 1.0 / 0.1, 1e-9);
}

TEST(Contact, TakesTheShapesOfTheUrdf) {
    const auto urdf = [](const std::string& collision) {
        return write_urdf("block", R"(<link name="block"><inertial><mass value="3"/>
          <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>)" +
                                       collision + "</link>");
    };
    WorldOptions options;
    options.feet = {{"block", {}, true}};
    options.urdf = urdf("");
    EXPECT_THROW(World{options}, std::runtime_error);
    for (const char* shape : {R"(<box size="0.4 0.2 0.1"/>)", R"(<cylinder radius="0.2" length="0.1"/>)"}) {
        options.urdf = urdf(std::string("<collision><origin xyz='0 0 0.02'/><geometry>") + shape +
                            "</geometry></collision>");
        Simulation sim = simulate(options);
        EXPECT_NEAR(sim.w_H_b()(2, 3), 0.03, 1e-4) << shape;
        for (int k = 0; k < 1000; ++k) ASSERT_TRUE(sim.step({}));
        EXPECT_NEAR(sim.foot_wrench(0)[2], 3 * 9.81, 0.1) << shape;
    }
}

TEST(Simulation, TurnsErrorsOfMujocoIntoExceptions) {
    const World world(pendulum());
    EXPECT_THROW(
        try { mju_error("told to"); } catch (const std::runtime_error& error) {
            EXPECT_STREQ(error.what(), "MuJoCo: told to");
            throw;
        },
        std::runtime_error);
}
