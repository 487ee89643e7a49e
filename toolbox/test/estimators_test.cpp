#include "bf/base/numbers.hpp"
#include "bf/dynamics/lie.hpp"

#include "running.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <fstream>
#include <random>
#include <unistd.h>

namespace bf::toolbox::test {
namespace {

/// An iCub on its feet whose joints are held where `moves` says, with noise of its sensors and `x` beside it.
std::string held_icub(const std::string& block, const std::string& inputs, const std::string& connections,
                      const std::string& of_world = "", const std::string& others = "") {
    const std::string posture =
        "[0.033; 0; 0; -0.354; 0.5; 0; 0.801; -0.354; 0.5; 0; 0.801; 0.208; 0.011; -0.002; -0.499; -0.292; "
        "-0.012; 0.208; 0.011; -0.002; -0.5; -0.292; -0.012]";
    return "model: m\nstep: 0.001\ninputs: {" + inputs + "}\nvariables: {start: \"" + posture +
           "\"}\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, joints: \"" + icub_joints +
           "\"}\n  world: {block: WholeBodyToolbox/MujocoWorld, feet: \"{'l_sole', 'r_sole'}\", imu_frame: "
           "imu_frame, "
           "initial_joints: start, position_gains: \"[ones(3,1)*[300 0 8]; ones(8,1)*[30 0 1]; "
           "ones(12,1)*[500 0 10]]\"" +
           of_world + "}\n" + others +
           "  swing: {block: Sine, amplitude: \"[0.1; 0.05; 0.2; 0.2; 0.1; 0.1; 0.2; -0.2; 0.1; 0.1; 0.2; "
           "zeros(12,1)]\", frequency: "
           "3, bias: start}\n  send: {block: WholeBodyToolbox/SetReferences, control_type: Position Direct}\n"
           "  imu: {block: WholeBodyToolbox/GetSensor, kind: imu}\n"
           "  gyro: {block: Selector, indices: [7 8 9]}\n  accel: {block: Selector, indices: [4 5 6]}\n"
           "  noise: {block: RandomNormal, variance: \"[1e-4 1e-4 1e-4]\", seed: 3}\n  noisy: {block: Sum}\n"
           "  rpy: {block: Selector, indices: [1 2 3]}\n  turn: {block: RotationFromRollPitchYaw}\n"
           "  x: {block: WholeBodyToolbox/" +
           block +
           "}\nconnections:\n  swing: send\n  imu: [gyro, accel, rpy]\n  rpy: turn\n  gyro: noisy.u1\n  "
           "noise: noisy.u2\n" +
           connections;
}

/// Base pose of its first step.
Transform begin_of_held_icub() {
    Running run(held_icub("LegOdometry", "c: {shape: 2}",
                          "  world.s: x.s\n  world.s_dot: x.s_dot\n  c: x.contacts\n"));
    EXPECT_TRUE(run.step()) << run.simulation.failure();
    return run.get("world.w_H_b");
}

/// How far an estimate is from the truth: position [m], orientation [rad].
Eigen::Vector2d distance(const Matrix& estimate, const Matrix& truth) {
    const Vector6 e = dynamics::pose_error(Transform(estimate), Transform(truth));
    return {e.head<3>().norm(), e.tail<3>().norm()};
}

} // namespace

TEST(MomentumObserverBlock, FindsThePushOnAHandThatMoves) {
    Running run(
        "model: m\nstep: 0.001\ninputs: {push: {shape: 6}}\nblocks:\n  robot: {block: "
        "WholeBodyToolbox/Configuration, "
        "floating_base: false, joints: \"{'r_shoulder_pitch', 'r_shoulder_roll', 'r_shoulder_yaw', "
        "'r_elbow', "
        "'r_wrist_prosup', 'r_wrist_pitch', 'r_wrist_yaw'}\"}\n  world: {block: "
        "WholeBodyToolbox/MujocoWorld, "
        "joint_damping: 0, joint_friction: 0, initial_joints: \"[-0.3 0.4 0.1 0.9 0 0 0]\", push_links: "
        "\"{'r_hand'}\"}\n"
        "  goal: {block: Sine, amplitude: 0.2, frequency: 4, bias: \"[-0.3; 0.4; 0.1; 0.9; 0; 0; 0]\"}\n"
        "  hold: {block: WholeBodyToolbox/JointImpedance, stiffness: 20, damping: 2}\n"
        "  x: {block: WholeBodyToolbox/MomentumObserver, frames: \"{'r_hand'}\", gain: 100, damping: 1e-4}\n"
        "connections:\n  push: world.push_r_hand\n  goal: hold.s_target\n  hold.tau: world.tau\n"
        "  world.s: [x.s, hold.s]\n  world.s_dot: [x.s_dot, hold.s_dot]\n  world.tau_measured: x.tau\n");
    const Vector3 force(2, -3, 1);
    Vector6 push = Vector6::Zero();
    for (int k = 0; k < 500; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_LT(run.get("x.r").norm(), 0.02) << "nothing pushes";
    push.head<3>() = force;
    run.set("push", push);
    Vector3 mean = Vector3::Zero();
    for (int k = 0; k < 500; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (k < 100) continue;
        EXPECT_LT((run.get("x.f_r_hand").topRows<3>() - force).norm(), 0.3) << k;
        mean += run.get("x.f_r_hand").topRows<3>() / 400;
    }
    EXPECT_LT((mean - force).norm(), 0.03 * force.norm());
}

TEST(MomentumObserverBlock, KnowsThatTheGroundCarriesTheRobot) {
    const std::string wires =
        "  world.s: x.s\n  world.s_dot: x.s_dot\n  world.w_H_b: x.w_H_b\n  world.v_b: x.v_b\n"
        "  world.tau_measured: x.tau\n";
    Running unknown(held_icub("MomentumObserver, gain: 50", "", wires)),
        known(held_icub(
            "MomentumObserver, gain: 50, known: \"{'l_sole', 'r_sole'}\"", "",
            wires + "  world.wrench_l_sole: x.known_l_sole\n  world.wrench_r_sole: x.known_r_sole\n"));
    double left = 0;
    for (int k = 0; k < 1500; ++k) {
        ASSERT_TRUE(unknown.step() && known.step()) << unknown.simulation.failure();
        if (k >= 750) left = std::max(left, known.get("x.r").topRows<6>().norm());
    }
    const Matrix feet = unknown.get("world.wrench_l_sole") + unknown.get("world.wrench_r_sole");
    EXPECT_NEAR(unknown.get("x.r")(2, 0), feet(2, 0), 0.05 * feet(2, 0));
    EXPECT_GT(unknown.get("x.r")(2, 0), 200);
    EXPECT_LT(left, 5) << "the measured wrenches explain it";
}

TEST(ContactWrenchesBlock, FindsWhatTheGroundExertsAndTheTorquesOfTheJoints) {
    Running run(held_icub(
        "ContactWrenches, sensors: \"{'l_leg_ft_sensor', 'r_foot_ft_sensor'}\", contacts: \"{'l_sole', "
        "'r_sole', "
        "'chest'}\"",
        "",
        "  world.s: x.s\n  world.s_dot: x.s_dot\n  world.w_H_b: x.w_H_b\n  world.v_b: x.v_b\n  left: "
        "x.ft_l_leg_ft_sensor\n"
        "  right: x.ft_r_foot_ft_sensor\n",
        ", ft_sensors: \"{'l_leg_ft_sensor', 'r_foot_ft_sensor'}\", joint_damping: 0, joint_friction: 0",
        "  left: {block: WholeBodyToolbox/GetSensor, sensor: l_leg_ft_sensor}\n  right: {block: "
        "WholeBodyToolbox/GetSensor, sensor: r_foot_ft_sensor}\n"));
    for (int k = 0; k < 1500; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
    // Sensors and torques are of the last interval, and accelerations are left out: small beside the weight
    // of 320 N.
    for (const std::string sole : {"l_sole", "r_sole"}) {
        const Matrix found = run.get("x.f_" + sole), truth = run.get("world.wrench_" + sole);
        EXPECT_GT(truth(2, 0), 80);
        EXPECT_LT((found - truth).topRows<3>().norm(), 2) << sole;
        EXPECT_LT((found - truth).bottomRows<3>().norm(), 1) << sole;
    }
    EXPECT_LT(run.get("x.f_chest").topRows<3>().norm(), 10) << "nothing pushes the chest";
    EXPECT_LT((run.get("x.tau") - run.get("world.tau_measured")).cwiseAbs().maxCoeff(), 1.5);
}

TEST(LegOdometryBlock, FollowsTheBaseOverFeetThatTakeTurns) {
    Running run(held_icub("LegOdometry", "c: {shape: 2}, start: {shape: \"[4 4]\"}",
                          "  world.s: x.s\n  world.s_dot: x.s_dot\n  c: x.contacts\n  start: x.w_H_b_0\n"));
    const Transform begin = begin_of_held_icub();
    run.set("start", begin);
    double moved = 0;
    for (int k = 0; k < 1500; ++k) {
        const bool left = k / 100 % 3 != 1, right = k / 100 % 3 != 2;
        run.set("c", Eigen::Vector2d(left, right));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Eigen::Vector2d away = distance(run.get("x.w_H_b"), run.get("world.w_H_b"));
        EXPECT_LT(away[0], 3e-3) << k;
        EXPECT_LT(away[1], 1e-2) << k;
        if (k > 50) { // after the first jerk
            EXPECT_LT((run.get("x.v_b") - run.get("world.v_b")).norm(), 0.1) << k;
        }
        if (k / 100 % 3 == 1 && k % 100 > 2) {
            EXPECT_EQ(run.scalar("x.stance"), 2);
        }
        moved = std::max(moved, (run.get("world.w_H_b") - begin).norm());
    }
    EXPECT_GT(moved, 3e-3) << "there was something to follow";
}

TEST(LegOdometryBlock, TakesTheOrientationOfItsSensor) {
    Running run(held_icub(
        "LegOdometry, imu: imu_frame", "c: {shape: 2}, start: {shape: \"[4 4]\"}",
        "  world.s: x.s\n  world.s_dot: x.s_dot\n  c: x.contacts\n  start: x.w_H_b_0\n  turn: x.w_R_imu\n"));
    Transform wrong = Transform::Identity();
    wrong.topLeftCorner<3, 3>() = Eigen::AngleAxisd(0.3, Vector3::UnitX()).toRotationMatrix();
    run.set("start", wrong).set("c", Eigen::Vector2d(1, 0));
    for (int k = 0; k < 500; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_LT(distance(run.get("x.w_H_b"), run.get("world.w_H_b"))[1], 1e-9) << k;
    }
}

/// With an orientation that is measured, feet are points: a tripod of prismatic legs whose feet stand rises
/// straight up, whichever of them stand, and a sensor that turns turns the base about what stands.
TEST(LegOdometryBlock, TakesFeetForPointsWhereItsSensorTurns) {
    const std::string path = "/tmp/bf_toolbox_tripod_" + std::to_string(getpid()) + ".urdf";
    const std::string inertial =
        "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";
    std::string urdf = "<robot name='tripod'><link name='trunk'>" + inertial + "</link>";
    const std::vector<std::string> places{"1 0 0", "-0.5 0.8 0", "-0.5 -0.8 0"};
    for (int i = 0; i < 3; ++i) {
        const std::string foot = "foot_" + std::to_string(i + 1);
        urdf += "<link name='" + foot + "'>" + inertial + "</link><joint name='leg_" + std::to_string(i + 1) +
                "' type='revolute'><origin xyz='" + places[static_cast<std::size_t>(i)] +
                "'/><parent link='trunk'/><child link='shin_" + std::to_string(i + 1) +
                "'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='9' velocity='9'/></joint><link "
                "name='shin_" +
                std::to_string(i + 1) + "'>" + inertial + "</link><joint name='end_" + std::to_string(i + 1) +
                "' type='fixed'><origin xyz='0.5 0 0'/><parent link='shin_" + std::to_string(i + 1) +
                "'/><child link='" + foot + "'/></joint>";
    }
    std::ofstream(path) << urdf << "</robot>";
    const auto model = [&](bool has_gyroscope) {
        return "model: m\nstep: 0.001\ninputs: {c: {shape: 3}, ds: {shape: 3}, R: {shape: \"[3 3]\"}, w: "
               "{shape: 3}}\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, robot: \"'" +
               path + "'\"}\n  s: {block: Constant, value: \"zeros(3,1)\"}\n" +
               (has_gyroscope ? "" : "  end: {block: Terminator}\n") +
               "  x: {block: WholeBodyToolbox/LegOdometry, frames: \"{'foot_1', 'foot_2', 'foot_3'}\", imu: "
               "trunk}\nconnections:\n  s: x.s\n  ds: x.s_dot\n  c: x.contacts\n  R: x.w_R_imu\n  w: " +
               (has_gyroscope ? "x.gyroscope" : "end") + "\n";
    };
    const Eigen::Matrix3d level = Eigen::Matrix3d::Identity();
    for (const Vector3& standing : {Vector3(1, 1, 1), Vector3(1, 0, 0), Vector3(1, 1, 0)}) {
        // Shins of 0.5 m that lie along x sink by 0.1 m/s at their ends, when they turn by 0.2 rad/s about y.
        Running run(model(false));
        run.set("c", standing).set("ds", Vector3::Constant(0.2)).set("R", level);
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            EXPECT_LT((run.get("x.v_b") - Vector6::Unit(2) * 0.1).norm(), 1e-12) << standing.transpose();
        }
    }
    // About the foot at (1.5, 0, 0), the trunk turns by w about z: its velocity is w x (-1.5, 0, 0).
    const double w = 0.4;
    Vector6 expected = Vector6::Zero();
    expected[1] = -1.5 * w;
    expected[5] = w;
    for (const bool has_gyroscope : {true, false}) {
        Running run(model(has_gyroscope));
        run.set("c", Vector3(1, 0, 0)).set("w", Vector3(0, 0, w));
        for (int k = 0; k < 3; ++k) {
            const Eigen::Matrix3d R =
                Eigen::AngleAxisd((k - 2) * w * 0.001, Vector3::UnitZ()).toRotationMatrix();
            run.set("R", R);
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
        EXPECT_LT((run.get("x.v_b") - expected).norm(), 1e-9) << has_gyroscope;
    }
    unlink(path.c_str());
}

TEST(LegOdometryBlock, RefusesWhatHasNoFeet) {
    const auto with = [](const std::string& settings, const std::string& of_robot) {
        return refusal("model: m\nstep: 0.01\nblocks:\n  robot: {block: WholeBodyToolbox/Configuration, "
                       "joints: \"{'l_knee'}\"" +
                       of_robot + "}\n  x: {block: WholeBodyToolbox/" + settings + "}\n");
    };
    expect_contains(with("LegOdometry", ", floating_base: false"),
                    "x: the robot's base is fixed and needs no estimate");
    expect_contains(with("LegOdometry, frames: \"{}\"", ""), "x: argument 'frames' is empty");
    expect_contains(with("LegOdometry, frames: \"{'l_sol'}\"", ""), "x: frame 'l_sol' is not a link");
    expect_contains(with("ContactEKF", ", floating_base: false"),
                    "x: the robot's base is fixed and needs no estimate");
    expect_contains(with("ContactEKF, imu: nose", ""), "x: frame 'nose' is not a link");
    expect_contains(with("ContactWrenches, sensors: \"{'l_knee'}\"", ""),
                    "x: 'l_knee' is no fixed joint of '");
    expect_contains(with("ContactWrenches, sensors: \"{'l_foot_ft_sensor', 'l_foot_ft_sensor'}\"", ""),
                    "x: 'l_foot_ft_sensor' is cut twice");
    expect_contains(with("ContactWrenches, contacts: \"{'hand'}\"", ""), "x: frame 'hand' is not a link");
    expect_contains(with("MomentumObserver, frames: \"{'hand'}\"", ""), "x: frame 'hand' is not a link");
    const std::string twice = ", frames: \"{'l_sole', 'r_sole', 'l_sole'}\"";
    expect_contains(with("LegOdometry" + twice, ""),
                    "x: argument 'frames' names 'l_sole' twice; name it once");
    expect_contains(with("ContactEKF" + twice, ""),
                    "x: argument 'frames' names 'l_sole' twice; name it once");
    expect_contains(with("MomentumObserver, frames: \"{'l_sole'}\", known: \"{'l_sole'}\"", ""),
                    "x: arguments 'frames' and 'known' together names 'l_sole' twice");
}

TEST(ContactEkfBlock, FindsTheTiltOfARobotThatMovesAndItsBias) {
    std::string text =
        held_icub("ContactEKF, imu: imu_frame, gyroscope_noise: 5e-4, accelerometer_noise: 0.02, "
                  "contact_noise: 0.002, initial_deviation: [0.1 0.05 0.01 0.03 0.01]",
                  "c: {shape: 2}, start: {shape: \"[4 4]\"}",
                  "  world.s: x.s\n  world.s_dot: x.s_dot\n  c: x.contacts\n  start: x.w_H_b_0\n  noisy: "
                  "off\n  off: x.gyroscope\n  accel: x.accelerometer\n");
    text.replace(text.find("  x: {block"), 0, "  off: {block: Bias, bias: \"[0.01; -0.02; 0.015]\"}\n");
    Transform start = begin_of_held_icub();
    const Transform truth = start;
    start.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(0.08, Vector3::UnitY()).toRotationMatrix() * truth.topLeftCorner<3, 3>();
    Running run(text);
    run.set("start", start).set("c", Eigen::Vector2d(1, 1));
    for (int k = 0; k < 3000; ++k) {
        run.set("c", Eigen::Vector2d(k / 200 % 3 != 1, k / 200 % 3 != 2));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    }
    const Transform estimate = run.get("x.w_H_b"), world = run.get("world.w_H_b");
    const Vector3 down = estimate.topLeftCorner<3, 3>().transpose() * Vector3::UnitZ() -
                         world.topLeftCorner<3, 3>().transpose() * Vector3::UnitZ();
    EXPECT_LT(down.norm(), 0.01) << "the tilt is observable";
    EXPECT_LT(distance(estimate, world)[0], 0.06);
    EXPECT_LT((run.get("x.v_b") - run.get("world.v_b")).norm(), 0.1);
    EXPECT_LT((run.get("x.bias").topRows<2>() - Eigen::Vector2d(0.01, -0.02)).norm(), 0.006);
    EXPECT_GT(run.get("x.covariance").diagonal().minCoeff(), -1e-12);
}

TEST(ContactEkfBlock, IsAsSureAsItIsRight) {
    // The normalised estimation error squared e' P^-1 e of what is observable: tilt and velocity. Its mean is
    // 5, their number, where the covariance is that of the errors. Over a seed's 600 correlated samples it
    // varies widely.
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const auto about = [&](double deviation) -> Vector3 {
        return deviation * Vector3{normal(random), normal(random), normal(random)}; // in this order
    };
    const Eigen::Matrix<double, 5, 1> deviation{0.05, 0.05, 0.001, 0.01, 0.05};
    double mean = 0, largest_tilt = 0, largest_speed = 0;
    const int seeds = 6;
    for (int seed = 1; seed <= seeds; ++seed) {
        const Vector3 gyroscope_bias = about(deviation[3]), accelerometer_bias = about(deviation[4]);
        const auto list = [](const Vector3& v) {
            return "\"[" + number_text(v[0]) + "; " + number_text(v[1]) + "; " + number_text(v[2]) + "]\"";
        };
        const std::string number = std::to_string(seed);
        std::string text = held_icub(
            "ContactEKF, imu: root_link, gyroscope_noise: 3.2e-4, accelerometer_noise: 3.2e-3, "
            "contact_noise: 3e-4, "
            "joint_noise: 2e-4, kinematics_noise: 5e-5, initial_deviation: [0.05 0.05 0.001 0.01 0.05]",
            "start: {shape: \"[4 4]\"}",
            "  world.s: x.s\n  world.s_dot: x.s_dot\n  both: x.contacts\n  start: x.w_H_b_0\n  noisy: off\n  "
            "off: "
            "x.gyroscope\n  accel: pushed.u1\n  shake: pushed.u2\n  pushed: x.accelerometer\n",
            ", noise: [2e-4 1e-2 0], seed: " + number,
            "  off: {block: Bias, bias: " + list(gyroscope_bias) +
                "}\n  both: {block: Constant, value: \"[1; 1]\"}\n"
                "  shake: {block: RandomNormal, mean: " +
                list(accelerometer_bias) + ", variance: \"[0.01; 0.01; 0.01]\", seed: 1" + number +
                "}\n  pushed: {block: Sum}\n");
        text.replace(text.find("imu_frame: imu_frame"), 20, "imu_frame: root_link");
        text.replace(text.find("seed: 3}"), 8, "seed: 2" + number + "}");
        Running run(text);
        Transform start = begin_of_held_icub();
        const Vector3 tilt = about(deviation[0]);
        start.topLeftCorner<3, 3>() = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()).toRotationMatrix() *
                                      start.topLeftCorner<3, 3>();
        run.set("start", start);
        for (int k = 0; k < 1200; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            if (k < 600) continue;
            const Transform estimate = run.get("x.w_H_b"), truth = run.get("world.w_H_b");
            const Eigen::Matrix3d R =
                estimate.topLeftCorner<3, 3>() * truth.topLeftCorner<3, 3>().transpose();
            const Eigen::AngleAxisd turn(R);
            const Vector3 xi = turn.angle() * turn.axis();
            const Vector3 v = run.get("x.v_b").topRows<3>() - R * run.get("world.v_b").topRows<3>();
            Eigen::Matrix<double, 5, 1> e;
            e << xi.head<2>(), v;
            const Matrix P = run.get("x.covariance");
            Eigen::Matrix<double, 5, 5> of_these;
            const int at[] = {0, 1, 3, 4, 5};
            for (int i = 0; i < 5; ++i)
                for (int j = 0; j < 5; ++j) of_these(i, j) = P(at[i], at[j]);
            mean += e.dot(of_these.llt().solve(e)) / (600.0 * seeds);
            largest_tilt = std::max(largest_tilt, xi.head<2>().norm());
            largest_speed = std::max(largest_speed, v.norm());
        }
    }
    EXPECT_GT(mean, 1.5);
    EXPECT_LT(mean, 15);
    EXPECT_LT(largest_tilt, 0.02);
    EXPECT_LT(largest_speed, 0.03);
}

} // namespace bf::toolbox::test
