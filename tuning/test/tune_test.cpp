#include "bf/tuning/tune.hpp"

#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <numbers>

namespace bf::tuning {
namespace {

using physics::Gains;

/// Its joint "swing" turns about a vertical axis, so that nothing but its inertia of 0.5 kg m2 has to be
/// moved.
constexpr const char* turntable = R"(
  <link name="stand"/>
  <link name="plate"><inertial><mass value="2"/>
    <inertia ixx="0.3" iyy="0.3" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="revolute"><axis xyz="0 0 1"/><parent link="stand"/><child link="plate"/>
    <limit lower="-3" upper="3" effort="EFFORT" velocity="10"/><dynamics damping="DAMPING" friction="FRICTION"/></joint>)";

std::filesystem::path urdf_of(std::string body, const std::string& name,
                              const std::map<std::string, std::string>& values = {}) {
    for (const auto& [word, value] : values)
        for (std::size_t at = body.find(word); at != body.npos; at = body.find(word))
            body.replace(at, word.size(), value);
    const std::filesystem::path file = std::filesystem::path(BF_BINARY_DIRECTORY) / (name + ".urdf");
    std::ofstream(file) << "<robot name=\"" << name << "\">" << body << "</robot>";
    return file;
}

std::unique_ptr<Bench> bench_of_urdf(const std::filesystem::path& urdf, const Eigen::MatrixXd& gains = {},
                                     bool floats = false, const std::vector<double>& pose = {}) {
    physics::WorldOptions options;
    options.urdf = urdf;
    options.floating_base = floats;
    options.base_link = "stand";
    options.motors.position_gains = gains;
    return bench_of(physics::World(options), 0.001, pose);
}

std::unique_ptr<Bench> turntable_bench(const std::string& name, const std::string& effort = "1000",
                                       const std::string& damping = "0", const std::string& friction = "0") {
    return bench_of_urdf(
        urdf_of(turntable, name, {{"EFFORT", effort}, {"DAMPING", damping}, {"FRICTION", friction}}));
}

/// Two links in a vertical plane that gravity pulls down, with the gains that are critical for 10 rad/s of
/// the whole arm.
constexpr const char* arm = R"(
  <link name="stand"/>
  <link name="upper"><inertial><origin xyz="0.3 0 0"/><mass value="3"/>
    <inertia ixx="0.01" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><axis xyz="0 1 0"/><parent link="stand"/><child link="upper"/>
    <limit lower="-3" upper="3" effort="200" velocity="10"/></joint>
  <joint name="elbow" type="revolute"><origin xyz="0.6 0 0"/><axis xyz="0 1 0"/><parent link="upper"/>
    <child link="fore"/><limit lower="-3" upper="3" effort="60" velocity="10"/></joint>)";

std::string complaint(const std::function<void()>& action) {
    try {
        action();
    } catch (const std::exception& error) {
        return error.what();
    }
    return {};
}

} // namespace

TEST(IdealResponse, SolvesItsEquationAndStartsAtRest) {
    for (const Goal goal : {Goal{20, 0.4}, Goal{7, 1}, Goal{12, 2.5}}) {
        const double h = 1e-4, w = goal.frequency;
        const auto y = [&](double t) { return ideal_response(goal, t); };
        EXPECT_EQ(y(0), 0);
        EXPECT_NEAR(y(h) / h, 0, 0.05 * w) << "at rest";
        for (const double t : {0.02, 0.1, 0.3}) {
            const double v = (y(t + h) - y(t - h)) / (2 * h), a = (y(t + h) - 2 * y(t) + y(t - h)) / (h * h);
            EXPECT_NEAR(a + 2 * goal.damping * w * v + w * w * y(t), w * w, 1e-5 * w * w) << t;
        }
        EXPECT_NEAR(y(100), 1, 1e-12);
    }
}

TEST(IdealResponse, HasTheOvershootThatItsDampingStandsFor) {
    const Goal goal{10, damping_of(0.163)};
    EXPECT_NEAR(goal.damping, 0.5, 2e-3) << "textbooks: 16.3 % at a damping ratio of 0.5";
    double largest = 0;
    for (double t = 0; t < 2; t += 1e-4) largest = std::max(largest, ideal_response(goal, t));
    EXPECT_NEAR(largest, 1.163, 1e-6);
}

TEST(Measure, TellsWhatClosedFormsSay) {
    const Goal goal{10, 0.5};
    Response response{.step = 0.2, .offset = 0.01, .time = {}, .position = {}, .torque = {}};
    for (int k = 1; k <= 20000; ++k) {
        response.time.push_back(k * 1e-4);
        response.position.push_back(0.15 * ideal_response(goal, k * 1e-4));
        response.torque.push_back(k == 7 ? -5 : 1);
    }
    const Measures found = measure(response);
    EXPECT_NEAR(found.overshoot, std::exp(-std::numbers::pi * 0.5 / std::sqrt(0.75)), 1e-4);
    EXPECT_NEAR(found.error, 0.2 + 0.01 - 0.15, 1e-5);
    EXPECT_EQ(found.torque, 5);
    // The last of the closed form's crossings of a level before a time, by bisection.
    const auto crossing = [&](double level, double from, double to) {
        const bool rises = ideal_response(goal, to) > level;
        while (to - from > 1e-9) {
            const double t = (from + to) / 2;
            (ideal_response(goal, t) > level) == rises ? to = t : from = t;
        }
        return to;
    };
    // Extremes are at k pi / (frequency sqrt(1 - damping²)), 0.163^k away from the end.
    const double half = std::numbers::pi / (10 * std::sqrt(0.75));
    EXPECT_NEAR(found.rise_time, crossing(0.9, 0, half) - crossing(0.1, 0, half), 2e-4);
    EXPECT_NEAR(found.settling_time, crossing(0.98, half, 3 * half), 2e-4)
        << "0.163² = 2.7 %, 0.163³ = 0.4 %";
}

TEST(Measure, KnowsWhatNeverComesToRest) {
    Response swings{.step = 1, .offset = 0, .time = {}, .position = {}, .torque = {}};
    for (int k = 1; k <= 1000; ++k) {
        swings.time.push_back(k * 0.01);
        swings.position.push_back(1 + 0.5 * std::sin(k * 0.2));
        swings.torque.push_back(0);
    }
    EXPECT_TRUE(std::isnan(measure(swings).settling_time));
}

TEST(Design, PutsThePolesWhereTheGoalAndTheIntegralWantThem) {
    const Plant plant{.inertia = 0.7, .damping = 0.3, .friction = 0, .stiffness = 5, .load = 0};
    const Goal goal{15, 0.6};
    const JointGains gains = design(plant, goal, 0.2);
    const double alpha = 0.2 * 15;
    for (const std::complex<double> s :
         {std::complex<double>(-alpha, 0), 15.0 * std::complex<double>(-0.6, 0.8)}) {
        const auto p = plant.inertia * s * s * s + (plant.damping + gains.D) * s * s +
                       (plant.stiffness + gains.P) * s + gains.I;
        EXPECT_LT(std::abs(p), 1e-9 * gains.P * std::abs(s));
    }
    EXPECT_EQ(design(plant, goal).I, 0);
}

TEST(Identify, FindsInertiaAndFrictionsOfAJoint) {
    const auto bench = turntable_bench("rubbing_turntable", "1000", "0.8", "1.5");
    const Plant plant = identify(*bench, holding_torques(*bench), 0, 0.1);
    EXPECT_NEAR(plant.inertia, 0.5, 0.01);
    // MuJoCo's Coulomb friction is a soft constraint, part of which looks as if it were viscous.
    EXPECT_NEAR(plant.damping, 0.8, 0.4);
    EXPECT_NEAR(plant.friction, 1.5, 0.2);
    EXPECT_NEAR(plant.load, 0, 1.6);
}

TEST(Identify, FindsLoadAndStiffnessOfGravity) {
    // Mass m at a distance l: load m g l cos s, and its slope.
    const auto bench = bench_of_urdf(urdf_of(arm, "arm"), {}, false, {-0.5, 0});
    const Eigen::VectorXd holding = holding_torques(*bench);
    const double g = 9.81, elbow = -1 * g * 0.2 * std::cos(0.5);
    EXPECT_NEAR(holding[1], elbow, 1e-3 * std::abs(elbow));
    EXPECT_NEAR(holding[0], -g * (3 * 0.3 + 1 * 0.8) * std::cos(0.5), 0.02);
    const Plant plant = identify(*bench, holding, 1, 0.05);
    EXPECT_NEAR(plant.inertia, 0.03 + 0.2 * 0.2, 0.002);
    EXPECT_NEAR(plant.stiffness, -g * 0.2 * std::sin(0.5), 1);
}

TEST(Tune, FindsTheGainsThatAreRightInClosedFormForASingleInertia) {
    for (const Goal goal : {Goal{20, 1}, Goal{10, 0.5}}) {
        const auto bench = turntable_bench("turntable", "1000", "0.4");
        const auto joints = tune(*bench, {.goals = {goal}});
        ASSERT_EQ(joints.size(), 1u);
        const double w = goal.frequency, J = 0.5;
        EXPECT_NEAR(joints[0].after.P / (J * w * w), 1, 0.04);
        EXPECT_NEAR((joints[0].after.D + 0.4) / (2 * goal.damping * w * J), 1, 0.04);
        EXPECT_EQ(joints[0].after.I, 0) << "nothing pulls at it";
        EXPECT_EQ(joints[0].remark, "");
        const Measures& found = joints[0].measures_after;
        const double overshoot = goal.damping < 1 ? std::exp(-std::numbers::pi * 0.5 / std::sqrt(0.75)) : 0;
        EXPECT_NEAR(found.overshoot, overshoot, 0.01);
        EXPECT_NEAR(found.rise_time * w, goal.damping < 1 ? 1.639 : 3.358, 0.06);
        EXPECT_NEAR(found.error, 0, 2e-4);
    }
}

TEST(Tune, ComesNearerToTheGoalThanTheGivenGainsAndLeavesNoErrorUnderLoad) {
    Eigen::MatrixXd soft(2, 3);
    soft << 150, 0, 10, 20, 0, 0.5;
    const auto bench = bench_of_urdf(urdf_of(arm, "loaded_arm"), soft);
    const Goal goal{15, 1};
    for (const auto& joint : tune(*bench, {.goals = {goal}})) {
        EXPECT_GT(std::abs(joint.measures_before.error), 0.02) << joint.name << " hangs";
        EXPECT_LT(std::abs(joint.measures_after.error), 2e-3) << joint.name;
        EXPECT_GT(joint.after.I, 0);
        EXPECT_LT(joint.measures_after.overshoot, 0.15);
        const auto distance = [&](const Response& response) {
            double most = 0;
            for (std::size_t k = 0; k < response.time.size() && response.time[k] < 0.5; ++k)
                most = std::max(most, std::abs(response.position[k] / response.step -
                                               ideal_response(goal, response.time[k])));
            return most;
        };
        EXPECT_LT(distance(joint.response_after), 0.12) << joint.name;
        EXPECT_LT(distance(joint.response_after), distance(joint.response_before)) << joint.name;
    }
}

TEST(Tune, AsksForNoMoreTorqueThanThereIs) {
    const auto bench = turntable_bench("weak_turntable", "4");
    const auto joints = tune(*bench, {.goals = {Goal{40, 1}}});
    EXPECT_LE(joints[0].measures_after.torque, 0.8 * 4 * 1.05);
    // P step = J w² step is the torque at the beginning.
    EXPECT_NEAR(joints[0].goal.frequency, std::sqrt(0.8 * 4 / (0.5 * 0.05)), 0.25);
    EXPECT_NE(joints[0].remark.find("a step of 0.05 rad may take 3.2 Nm"), std::string::npos)
        << joints[0].remark;
}

TEST(Tune, StepsAwayFromALimit) {
    const auto bench = bench_of_urdf(
        urdf_of(turntable, "turntable_at_its_limit",
                {{"EFFORT", "1000"}, {"DAMPING", "0"}, {"FRICTION", "0"}, {"upper=\"3\"", "upper=\"0\""}}));
    const auto joints = tune(*bench);
    EXPECT_EQ(joints[0].response_after.step, -0.05);
    EXPECT_NEAR(joints[0].after.P, 0.5 * 20 * 20, 8);
}

TEST(Tune, GivesAnIntegralToAJointThatGravityPullsBackOnTheWayAlone) {
    const auto bench = bench_of_urdf(urdf_of(arm, "hanging_arm"), {}, false, {std::numbers::pi / 2, 0});
    EXPECT_NEAR(holding_torques(*bench)[0], 0, 1e-6);
    const auto joints = tune(*bench, {.goals = {Goal{8, 1}}, .most_trials = 10});
    // Without it the step would end short of its reference by k / (P + k), k = m g l.
    EXPECT_GT(9.81 * 1.7 / (joints[0].after.P + 9.81 * 1.7), 0.1);
    EXPECT_GT(joints[0].after.I, 0);
    EXPECT_LT(std::abs(joints[0].measures_after.error), 2e-3);
}

TEST(Tune, RemarksInWhatAStepFallsShort) {
    const auto bench = turntable_bench("sticking_turntable", "1000", "0", "1.5");
    const auto without = tune(*bench, {.goals = {Goal{20, 1}}, .integral = 0, .most_trials = 3});
    EXPECT_GT(std::abs(without[0].measures_after.error), 0.0025);
    EXPECT_NE(without[0].remark.find(" rad away from its reference"), std::string::npos) << without[0].remark;
}

TEST(Tune, GivesTheSameGainsEachTime) {
    const auto gains = [] {
        const auto bench = bench_of_urdf(urdf_of(arm, "same_arm"));
        std::vector<double> all;
        for (const auto& joint : tune(*bench, {.goals = {Goal{}}, .most_trials = 10}))
            for (const double gain : {joint.after.P, joint.after.I, joint.after.D}) all.push_back(gain);
        return all;
    };
    EXPECT_EQ(gains(), gains());
}

TEST(Bench, HoldsABaseThatFloats) {
    const std::string standing = std::string(arm).replace(
        std::string(arm).find("<link name=\"stand\"/>"), 20,
        "<link name=\"stand\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" "
        "ixz=\"0\" iyz=\"0\"/></inertial></link>");
    const auto bench = bench_of_urdf(urdf_of(standing, "floating_arm"), {}, true);
    EXPECT_TRUE(bench->is_held());
    EXPECT_NEAR(holding_torques(*bench)[1], -9.81 * 0.2, 0.01) << "and gravity pulls at it";
    EXPECT_FALSE(bench_of_urdf(urdf_of(arm, "standing_arm"))->is_held());
}

TEST(Bench, BeginsAtRestWhateverTheGainsAre) {
    const auto bench = bench_of_urdf(urdf_of(arm, "resting_arm"));
    const Eigen::VectorXd holding = holding_torques(*bench);
    for (const double integral : {0.0, 50.0}) {
        Gains gains = bench->safe();
        gains.I.setConstant(integral);
        bench->begin(gains, holding);
        const Eigen::VectorXd start = bench->s();
        for (int k = 0; k < 500; ++k) bench->step();
        EXPECT_LT((bench->s() - start).norm(), 1e-4) << integral;
    }
}

TEST(Bench, TakesARobotOutOfAScene) {
    physics::SceneRobot robot{.name = "arm"};
    robot.options.urdf = urdf_of(arm, "scene_arm");
    robot.options.floating_base = false;
    robot.options.base_link = "stand";
    physics::SceneRobot other = robot;
    other.name = "other";
    other.motors.position_gains = Eigen::RowVector3d(40, 1, 2);
    other.loop_period = 0.004;
    physics::SceneOptions options;
    options.robots = {robot, other};
    const physics::Scene scene(options);
    const auto bench = bench_of(scene, 1);
    EXPECT_EQ(bench->given().P[1], 40);
    EXPECT_EQ(bench->loop_period(), 0.004);
    EXPECT_NEAR(holding_torques(*bench)[1], -9.81 * 0.2, 0.01);
    const auto joints = tune(*bench, {.goals = {Goal{100, 1}}, .most_trials = 3});
    EXPECT_EQ(joints[1].goal.frequency, 50);
    EXPECT_EQ(joints[1].remark, "lowered to 50 rad/s: its loop runs every 0.004 s");
}

TEST(Bench, HoldsTheBaseOfAnMjcfThatFloats) {
    const auto file = [](const std::string& name, const std::string& joint) {
        const auto path = std::filesystem::path(BF_BINARY_DIRECTORY) / (name + ".xml");
        std::ofstream(path)
            << R"(<mujoco><compiler angle="radian"/><worldbody><body name="trunk" pos="0 0 1">)" << joint
            << R"(<geom size="0.2" mass="1"/><site name="s"/>
          <body name="arm"><joint name="swing" axis="0 0 1" range="-3 3"/><inertial mass="2" pos="0 0 0" diaginertia="0.3 0.3 0.5"/>
          </body></body></worldbody><actuator><motor joint="swing" ctrlrange="-100 100"/></actuator>
          <sensor><gyro site="s"/></sensor><keyframe><key name="home" qpos=")"
            << (joint.find("free") == joint.npos ? "" : "0 0 2 1 0 0 0 ")
            << (joint.find("turn") == joint.npos ? "" : "0 ") << R"(0.4"/></keyframe></mujoco>)";
        physics::SceneOptions options;
        options.robots = {{.name = "arm"}};
        options.robots[0].options.urdf = path;
        options.robots[0].key = "home";
        return options;
    };
    const physics::Scene floating(file("floating", "<freejoint name='root'/>")),
        standing(file("standing", ""));
    const auto held = bench_of(floating, 0), fixed = bench_of(standing, 0);
    EXPECT_TRUE(held->is_held());
    EXPECT_FALSE(fixed->is_held());
    EXPECT_EQ(held->s()[0], 0.4) << "of the key frame";
    const auto joints = tune(*held), same = tune(*fixed);
    EXPECT_NEAR(joints[0].plant.inertia, 0.5, 1e-3) << "without what the base would give way";
    EXPECT_EQ(joints[0].after.P, same[0].after.P);
    EXPECT_EQ(joints[0].after.D, same[0].after.D);
    const physics::Scene turning(file("turning", "<joint name='turn' axis='0 0 1'/>"));
    EXPECT_EQ(complaint([&] { bench_of(turning, 0); }), "the base link 'trunk' of robot 'arm' moves with its "
                                                        "joints; make the link that stands still the base "
                                                        "link");
}

TEST(Tune, SaysWhatItCannotDo) {
    const auto bench = turntable_bench("complaining_turntable");
    EXPECT_EQ(
        complaint([&] {
            static_cast<void>(tune(*bench, {.goals = {Goal{-1, 9}, Goal{}}, .step = 0}));
        }),
        "tuning:\n- there are 2 goals for 1 joints; give one for all or one each\n- a frequency is -1; "
        "it must be 0.1 rad/s or more\n- a damping ratio is 9; it must be 0.2 to 5\n- step is 0; it must "
        "not be zero (rad)");
    EXPECT_EQ(complaint([&] { bench_of_urdf(urdf_of(arm, "posed_arm"), {}, false, {1}); }),
              "the pose has 1 positions, but the robot has 2 joints");
    physics::SceneOptions options;
    options.robots = {{.name = "arm"}};
    options.robots[0].options.urdf = urdf_of(arm, "posed_arm");
    options.robots[0].options.floating_base = false;
    const physics::Scene scene(options);
    EXPECT_EQ(
        complaint([&] {
            bench_of(scene, 0, {0.1, 0});
        }),
        "no pose can be chosen, as the base link 'upper' moves with the joints; make the link that stands "
        "still the base link");
    const auto stuck = turntable_bench("stuck_turntable", "1", "0", "50");
    EXPECT_EQ(complaint([&] { static_cast<void>(tune(*stuck)); }),
              "joint 'swing' does not move; look at its limits, its effort limit and its friction");
    const auto lying = bench_of_urdf(urdf_of(
        std::string(arm).replace(std::string(arm).rfind("upper=\"3\""), 9, "upper=\"0\""), "lying_arm"));
    EXPECT_EQ(
        complaint([&] { static_cast<void>(tune(*lying)); }),
        "joint 'elbow' lies on its stop at 0 rad, which carries it; choose a pose away from its limits");
    const auto hanging =
        bench_of_urdf(urdf_of(arm, "slowly_hanging_arm"), {}, false, {std::numbers::pi / 2, 0});
    EXPECT_EQ(complaint([&] {
                  static_cast<void>(tune(*hanging, {.goals = {Goal{1, 1}}}));
              }),
              "joint 'shoulder' is held at 1.57 rad by more than its goal asks for, as by gravity; choose a "
              "greater frequency, or another pose");
    const auto heavy = bench_of_urdf(urdf_of(
        std::string(arm).replace(std::string(arm).find("effort=\"60\""), 11, "effort=\"2.2\""), "heavy_arm"));
    EXPECT_EQ(complaint([&] { static_cast<void>(tune(*heavy)); }),
              "joint 'elbow' takes 1.96 Nm to be held, of 1.76 Nm that it may take; choose another pose or a "
              "greater share of torque");
}

} // namespace bf::tuning
