// Modes, loops and motors of the simulated robot, and the blocks that read and change them.
#include "BlockFactory/Core/Log.h"
#include "running.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <unistd.h>

namespace bf::toolbox::test::low_level {
namespace {

namespace fs = std::filesystem;

constexpr double h = 0.001;

enum class Worlds { mujoco, shared };

/// A folder with the robot: a joint on a fixed root, whose inertia is M, without gravity.
const fs::path& folder() {
    static const fs::path made = [] {
        const fs::path place = fs::path(testing::TempDir()) / ("low_level_" + std::to_string(getpid()));
        fs::create_directories(place);
        std::ofstream(place / "arm.urdf") << R"(<robot name="arm">
  <link name="root"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0 0.05 -0.2"/><mass value="1"/><inertia ixx="0.04" iyy="0.04" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="l_shoulder_yaw" type="revolute"><axis xyz="0 0.6 0.8"/><limit lower="-3" upper="3" effort="100" velocity="2"/>
    <parent link="root"/><child link="arm"/></joint></robot>)";
        return place;
    }();
    return made;
}

/// Settings of a MujocoWorld as attributes of a robot of a World, which have the same names.
std::string attributes(const std::string& settings) {
    static const std::regex setting(R"(, (\w+): "?\[?([^\]",]*)\]?"?)");
    return std::regex_replace(std::regex_replace(settings, setting, R"( $1="$2")"), std::regex(";"), " ");
}

/// The robot, in a world of its own or as one of a shared world.
class LowLevel : public testing::TestWithParam<Worlds> {
  protected:
    static std::string arm(const std::string& settings, const std::string& blocks,
                           const std::string& lines = {}, const std::string& inputs = {}) {
        std::string parts;
        if (GetParam() == Worlds::mujoco) {
            parts = "  robot: {block: WholeBodyToolbox/Configuration, robot: \"'" +
                    (folder() / "arm.urdf").string() +
                    "'\", floating_base: false, gravity: \"[0 0 0]\"}\n"
                    "  world: {block: WholeBodyToolbox/MujocoWorld, floor: false" +
                    settings + "}\n";
        } else {
            static int count = 0;
            const fs::path file = folder() / (std::to_string(++count) + ".xml");
            std::ofstream(file) << "<world gravity='0 0 0'><robot name='arm' file='arm.urdf'"
                                << attributes(settings) << "/></world>";
            parts = "  all: {block: WholeBodyToolbox/World, file: \"'" + file.string() +
                    "'\"}\n  robot: {block: WholeBodyToolbox/Configuration, world_robot: arm}\n"
                    "  world: {block: WholeBodyToolbox/WorldRobot, robot: arm}\n";
        }
        return "model: m\nstep: 0.001\n" + inputs + "blocks:\n" + parts + blocks +
               (lines.empty() ? "" : "connections:\n" + lines);
    }
    static double inertia();
};

std::string command(const std::string& type, const std::string& settings = {}) {
    return "  motors: {block: WholeBodyToolbox/SetReferences, control_type: " + type + settings + "}\n";
}

const std::string command_input = "inputs: {u: {shape: 1}}\n";
const std::string command_line = "  u: motors\n";

/// Inertia that the joint sees, from a torque of 1 Nm for one step.
double LowLevel::inertia() {
    Running run(arm("", command("Torque"), command_line, command_input));
    run.set("u", 1.0);
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(run.step());
    return 2 * h / run.scalar("world.s_dot");
}

std::string name_of(const testing::TestParamInfo<Worlds>& info) {
    return info.param == Worlds::mujoco ? "OfItsOwnWorld" : "OfASharedWorld";
}

using Modes = LowLevel;
using Imperfections = LowLevel;
using LowLevelPIDs = LowLevel;
using MotorParameters = LowLevel;
using Limits = LowLevel;

} // namespace

TEST_P(Modes, TorqueAcceleratesByTheInertia) {
    Running run(arm("", "  M: {block: WholeBodyToolbox/MassMatrix}\n", "  world.s: M.s\n"));
    ASSERT_TRUE(run.step());
    EXPECT_NEAR(inertia(), run.scalar("M"), 1e-3 * run.scalar("M")) << "as the rigid-body library has it";
}

TEST_P(Modes, PositionDirectAnswersAsTheDampedOscillatorOfItsGains) {
    // M s'' = P (r - s) - D s', critically damped: s = r (1 - (1 + w t) exp(-w t)).
    Running run(arm("", command("Position Direct"), command_line, command_input));
    run.set("u", 0.2);
    for (int k = 0; k < 200; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const double t = k * h, w = 30;
        EXPECT_NEAR(run.scalar("world.s"), 0.2 * (1 - (1 + w * t) * std::exp(-w * t)), 0.004) << k;
    }
}

TEST_P(Modes, ImpedanceIsASpringWithADamper) {
    // M s'' = K (r - s) - D s', critically damped at 10 rad/s where no gains are given.
    const double M = inertia();
    for (const double w : {10.0, 20.0}) {
        const std::string given =
            ", impedance_gains: \"[" + std::to_string(w * w * M) + " " + std::to_string(2 * w * M) + "]\"";
        Running run(arm(w == 10.0 ? "" : given, command("Impedance"), command_line, command_input));
        run.set("u", 0.2);
        for (int k = 0; k < 300; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            const double t = k * h;
            EXPECT_NEAR(run.scalar("world.s"), 0.2 * (1 - (1 + w * t) * std::exp(-w * t)), 0.003) << k;
        }
    }
}

TEST_P(Modes, PositionMovesAtItsReferenceSpeed) {
    Running run(arm(", position_gains: \"[200 0 10]\"", command("Position", ", reference_speed: 0.5"),
                    command_line, command_input));
    run.set("u", 0.2);
    for (int k = 0; k < 800; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const double ramp = std::min(0.2, 0.5 * k * h);
        EXPECT_NEAR(run.scalar("world.s"), ramp, 0.01) << k;
    }
    EXPECT_NEAR(run.scalar("world.s"), 0.2, 1e-4);
}

TEST_P(Modes, VelocityAcceleratesAtItsReferenceAcceleration) {
    Running run(arm(", position_gains: \"[500 0 20]\"", command("Velocity", ", reference_acceleration: 2"),
                    command_line, command_input));
    run.set("u", 0.4);
    for (int k = 0; k < 600; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_NEAR(run.scalar("world.s_dot"), std::min(0.4, 2 * k * h), 0.03) << k;
    }
    EXPECT_NEAR(run.scalar("world.s_dot"), 0.4, 1e-3);
}

TEST_P(Modes, PwmAndCurrentAreTorquesByTheMotor) {
    const double M = inertia();
    // M s'' = (pwm - k_bemf s') / k_tau.
    Running pwm(arm(", k_tau: 4, k_bemf: 2", command("PWM"), command_line, command_input));
    pwm.set("u", 1.0);
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(pwm.step());
        const double t = k * h, rate = 2 / (4 * M);
        EXPECT_NEAR(pwm.scalar("world.s_dot"), 0.5 * (1 - std::exp(-rate * t)), 0.01) << k;
    }
    Running current(arm(", torque_constant: 0.25", command("Current"), command_line, command_input));
    current.set("u", 2.0);
    ASSERT_TRUE(current.step());
    ASSERT_TRUE(current.step());
    EXPECT_NEAR(current.scalar("world.tau_measured"), 0.5, 1e-12);
}

TEST_P(Modes, AreSeenAtTheMotorsToo) {
    const auto measure = [](const std::string& name, const std::string& type) {
        return "  " + name + ": {block: WholeBodyToolbox/GetMeasurement, measured_type: " + type + "}\n";
    };
    Running run(arm(", gear_ratio: 100, torque_constant: 0.5, k_tau: 4, k_bemf: 2",
                    command("Torque") + measure("p", "Motor Position") + measure("v", "Motor Velocity") +
                        measure("a", "Motor Acceleration") + measure("joint", "Joints Acceleration") +
                        measure("i", "Motor Current") + measure("pwm", "Motor PWM"),
                    command_line, command_input));
    run.set("u", 0.3);
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(run.step());
    const double s_dot = run.scalar("world.s_dot"), tau = run.scalar("world.tau_measured");
    EXPECT_GT(std::abs(s_dot), 1e-3);
    EXPECT_DOUBLE_EQ(tau, 0.3) << "a loop that knows its motor gives the torque";
    EXPECT_DOUBLE_EQ(run.scalar("p"), 100 * run.scalar("world.s"));
    EXPECT_DOUBLE_EQ(run.scalar("v"), 100 * s_dot);
    EXPECT_DOUBLE_EQ(run.scalar("a"), 100 * run.scalar("joint"));
    EXPECT_DOUBLE_EQ(run.scalar("i"), tau / 0.5);
    EXPECT_DOUBLE_EQ(run.scalar("pwm"), 4 * tau + 2 * s_dot);
}

TEST_P(Imperfections, SeparateMotorsFromJointsAndBlocksFromBoth) {
    const auto measure = [](const std::string& name, const std::string& type) {
        return "  " + name + ": {block: WholeBodyToolbox/GetMeasurement, measured_type: " + type + "}\n";
    };
    const std::string blocks =
        command("Torque") + measure("p", "Motor Position") + measure("s", "Joints Position");
    const std::string settings =
        ", armature: 0.1, gear_ratio: 100, backlash: 0.02, encoder_resolution: 0.001, "
        "motor_encoder_resolution: 0.01";
    Running now(arm(settings, blocks, command_line, command_input));
    Running late(arm(settings + ", measurement_delay: 0.003, command_delay: 0.002", blocks, command_line,
                     command_input));
    Running lossy(arm(settings + ", dropout: 0.4", blocks, command_line, command_input));
    std::vector<double> s{0, 0, 0, 0, 0}, p = s;
    double widest = 0;
    int repeats = 0;
    for (int k = 0; k < 300; ++k) {
        for (Running* run : {&now, &late, &lossy}) {
            run->set("u", 0.5);
            ASSERT_TRUE(run->step()) << run->simulation.failure();
        }
        EXPECT_EQ(late.scalar("s"), s[s.size() - 5]) << k;
        EXPECT_EQ(late.scalar("world.s"), s[s.size() - 5]) << k;
        EXPECT_EQ(late.scalar("p"), p[p.size() - 5]) << k;
        repeats += k > 0 && lossy.scalar("p") == p.back();
        s.push_back(now.scalar("s"));
        p.push_back(now.scalar("p"));
        EXPECT_NEAR(std::remainder(s.back(), 0.001), 0, 1e-12);
        EXPECT_NEAR(std::remainder(p.back(), 0.01), 0, 1e-12);
        widest = std::max(widest, p.back() / 100 - s.back());
    }
    EXPECT_NEAR(widest, 0.01, 0.001) << "the motor leads by half of the backlash";
    EXPECT_GT(s.back(), 0.05);
    EXPECT_GT(repeats, 20) << "measurements got lost";
}

TEST_P(Imperfections, DelayTorquesToo) {
    const bool has_port = GetParam() == Worlds::mujoco;
    const auto path = [&](const std::string& delay) {
        const std::string motors = has_port ? "" : command("Torque");
        Running run(arm(delay, motors + "  tau: {block: Constant, value: 0.5}\n",
                        has_port ? "  tau: world.tau\n" : "  tau: motors\n"));
        std::vector<double> s;
        for (int k = 0; k < 50; ++k) {
            EXPECT_TRUE(run.step());
            s.push_back(run.scalar("world.s"));
        }
        return s;
    };
    const auto now = path(""), late = path(", command_delay: 0.004");
    for (std::size_t k = 0; k < now.size(); ++k) EXPECT_EQ(late[k], k < 4 ? 0 : now[k - 4]) << k;
    EXPECT_GT(now.back(), 1e-3);
}

TEST_P(Imperfections, ContinueASnapshotBitForBit) {
    Running run(arm(", armature: 0.1, backlash: 0.02, encoder_resolution: 0.001, measurement_delay: 0.003, "
                    "command_delay: 0.002, dropout: 0.3, velocities_from_encoders: true",
                    command("Velocity", ", reference_acceleration: 5"), command_line, command_input));
    const auto go_on = [&] {
        std::vector<double> path;
        for (int k = 0; k < 60; ++k) {
            EXPECT_TRUE(run.step());
            for (const char* signal : {"world.s", "world.s_dot", "world.tau_measured"})
                path.push_back(run.scalar(signal));
        }
        return path;
    };
    run.set("u", 0.4);
    const auto before = go_on();
    const auto snapshot = run.simulation.snapshot();
    const auto once = go_on();
    run.simulation.restore(snapshot);
    EXPECT_EQ(go_on(), once);
    EXPECT_NE(before, once);
}

TEST_P(Imperfections, AreRefusedWhereTheTimeStepDoesNotFit) {
    expect_contains(refusal(arm(", measurement_delay: 0.0015", "")),
                    "measurement_delay is 0.0015 s, which is no multiple of the time step, 0.001 s");
    expect_contains(refusal(arm(", dropout: 1", "")), "dropout is 1; it is a probability, from 0 to below 1");
    expect_contains(refusal(arm(", backlash: 0.1", "")), "its motor has no inertia");
}

TEST_P(Modes, BelongToOneBlockInAStep) {
    const std::string others = "  others: {block: WholeBodyToolbox/SetReferences, control_type: PWM}\n"
                               "  zero: {block: Constant, value: 0}\n";
    expect_contains(
        refusal(arm("", command("Torque") + others, command_line + "  zero: others\n", command_input)),
        "others: sets the references of the robot's joints, which motors sets in the same step");
    if (GetParam() == Worlds::shared) {
        expect_contains(
            refusal(arm("",
                        command("Torque") + "  part:\n    blocks:\n      same: {block: "
                                            "WholeBodyToolbox/WorldRobot, robot: arm}\n      zero: "
                                            "{block: Constant, value: 0}\n      send: {block: "
                                            "WholeBodyToolbox/SetReferences}\n    connections: "
                                            "{zero: send}\n",
                        command_line, command_input)),
            "part.send: sets the references of the robot's joints, which motors sets in the same step");
        return;
    }
    expect_contains(refusal(arm("", command("Torque"), "  u: [motors, world.tau]\n", command_input)),
                    "motors: sets the references of the robot's joints, which world sets in the same step");
}

/// Two blocks that take turns: while `first` is above 0 Torque, else PWM.
std::string by_turns(const std::string& settings) {
    std::string blocks = "  other: {block: Logic, operator: NOT}\n";
    for (const std::string mode : {"Torque", "PWM"})
        blocks += "  " + mode + ":\n    execution: enabled\n" + settings +
                  "    blocks:\n      zero: {block: Constant, value: 0}\n"
                  "      motors: {block: WholeBodyToolbox/SetReferences, control_type: " +
                  mode + "}\n    connections: {zero: motors}\n";
    return blocks;
}

TEST_P(Modes, AreSwitchedWhileTheRobotRunsByBlocksThatTakeTurns) {
    const std::string lines = "  first: [Torque.enable, other]\n  other: PWM.enable\n";
    for (const bool begins_anew : {true, false}) {
        Running run(
            arm("", by_turns(begins_anew ? "    states: reset\n" : ""), lines, "inputs: {first: {}}\n"));
        run.set("first", 1.0);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        run.set("first", 0.0);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        run.set("first", 1.0);
        if (begins_anew) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            continue;
        }
        ASSERT_FALSE(run.step());
        EXPECT_EQ(
            run.simulation.failure(),
            "Torque.motors: u has left its control mode; look for a fault of the robot, or let the subsystem "
            "reset its states when it is enabled, where another SetReferences drove the robot in between");
    }
}

TEST_P(Modes, ContinueASnapshotBitForBit) {
    for (const std::string type : {"Position", "Velocity", "Torque"}) {
        Running run(arm(", position_gains: \"[200 50 10]\", torque_gains: \"[0.5 0.1 0.0001]\", k_bemf: 0.1",
                        command(type, ", reference_acceleration: 2"), command_line, command_input));
        run.set("u", 0.3);
        const auto go = [&] {
            std::vector<double> seen;
            for (int k = 0; k < 50; ++k) {
                EXPECT_TRUE(run.step());
                seen.push_back(run.scalar("world.s"));
            }
            return seen;
        };
        go();
        const auto snapshot = run.simulation.snapshot();
        const auto first = go();
        run.simulation.restore(snapshot);
        EXPECT_EQ(go(), first) << type;
    }
}

TEST_P(LowLevelPIDs, AreReadSetAndPutBack) {
    const std::string blocks = command("Position Direct") +
                               "  read: {block: WholeBodyToolbox/GetLowLevelPIDs}\n"
                               "  pid: {block: WholeBodyToolbox/SetLowLevelPID, joints: "
                               "\"{'l_shoulder_yaw'}\", set_I: false, P: 70, D: 3}\n";
    Running run(arm(", position_gains: \"[50 2 1]\"", blocks, command_line, command_input));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("read.P"), 50) << "it stands before the block that sets";
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("read.P"), 70);
    EXPECT_EQ(run.scalar("read.I"), 2) << "it was left as it is";
    EXPECT_EQ(run.scalar("read.D"), 3);
    run.simulation.set_parameter("pid.P", {80});
    ASSERT_TRUE(run.step());
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("read.P"), 80);
    run.simulation.stop();
    run.simulation.start();
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("read.P"), 50);
}

TEST_P(LowLevelPIDs, DecideHowTheRobotMoves) {
    // Twice the frequency of the default: M s'' = P (r - s) - D s'.
    const double M = inertia(), w = 60;
    Running run(arm("",
                    command("Position Direct") + "  pid: {block: WholeBodyToolbox/SetLowLevelPID, P: " +
                        std::to_string(w * w * M) + ", I: 0, D: " + std::to_string(2 * w * M) + "}\n",
                    command_line, command_input));
    run.set("u", 0.2);
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step());
        const double t = k * h;
        EXPECT_NEAR(run.scalar("world.s"), 0.2 * (1 - (1 + w * t) * std::exp(-w * t)), 0.008) << k;
    }
}

TEST_P(LowLevelPIDs, AreAsManyAsTheJoints) {
    const auto with = [](const std::string& settings) {
        return refusal(
            arm("", "  pid: {block: WholeBodyToolbox/SetLowLevelPID, I: 0, D: 0" + settings + "}\n"));
    };
    EXPECT_EQ(with(", P: 5"), "");
    for (const std::string joints : {"", ", joints: \"{'l_shoulder_yaw'}\""}) {
        expect_contains(with(joints + ", P: \"[1; 2; 3; 4]\""),
                        "parameter 'P' needs m = 4, but m is already 1");
        expect_contains(with(joints + ", P: \"ones(10000, 1)\""), "parameter 'P' needs m = 10000");
    }
    // Every length that a robot decides.
    expect_contains(refusal(arm("",
                                "  ik: {block: WholeBodyToolbox/InverseKinematics, com: true, max_speed: "
                                "\"[1; 2]\"}\n  c: {block: Constant, value: [0; 0; 0]}\n",
                                "  c: ik.com\n")),
                    "ik: parameter 'max_speed' needs n = 2, but n is already 1");
}

TEST_P(Modes, ClampReferencesHoweverLargeToTheEffortLimits) {
    for (const std::string type :
         {"Torque", "Position", "Position Direct", "Velocity", "PWM", "Current", "Impedance"})
        for (const double reference : {1e9, 1.1e10, -1e300}) {
            Running run(arm("", command(type), command_line, command_input));
            run.set("u", reference);
            for (int k = 0; k < 3; ++k) ASSERT_TRUE(run.step()) << type << ' ' << run.simulation.failure();
            EXPECT_LE(std::abs(run.scalar("world.tau_measured")), 100) << type;
            if (type == "Position" || type == "Velocity") continue; // they go there slowly
            EXPECT_EQ(run.scalar("world.tau_measured"), std::copysign(100.0, reference)) << type;
        }
}

TEST_P(LowLevelPIDs, WarnAtThePeriodThatTheyHave) {
    using blockfactory::core::Log;
    const double most = 2 * inertia() / h; // D that a loop of a period h holds
    for (const double D : {0.9 * most, 1.1 * most}) {
        Log::getSingleton().clear();
        const Running run(arm(", position_gains: \"[0 0 " + std::to_string(D) + "]\"", ""));
        const std::string warnings = Log::getSingleton().getWarnings();
        if (D < most)
            EXPECT_EQ(warnings, "");
        else
            expect_contains(warnings, "joint 'l_shoulder_yaw': its position_gains are P 0, I 0, D ");
    }
    if (GetParam() == Worlds::mujoco) { // whose period is that of its block
        Log::getSingleton().clear();
        const Running run(
            arm(", period: 0.01, position_gains: \"[0 0 " + std::to_string(0.2 * most) + "]\"", ""));
        expect_contains(Log::getSingleton().getWarnings(), "which a loop of 0.01 s cannot hold");
    }
    Log::getSingleton().clear();
}

TEST_P(LowLevelPIDs, BelongToOneBlockInAStep) {
    const auto both = [](const std::string& first, const std::string& second) {
        const auto block = [](const std::string& type) { return "{block: WholeBodyToolbox/" + type + "}\n"; };
        return refusal(arm("", "  a: " + block(first) + "  b: " + block(second)));
    };
    const std::string names = ", joints: \"{'l_shoulder_yaw'}\"";
    expect_contains(
        both("SetLowLevelPID, set_I: false, set_D: false", "SetLowLevelPID" + names),
        "b: sets P of joint 'l_shoulder_yaw' in its Position loop, which a sets in the same step");
    EXPECT_EQ(both("SetLowLevelPID, set_P: false", "SetLowLevelPID, set_I: false, set_D: false"), "");
    EXPECT_EQ(both("SetLowLevelPID", "SetLowLevelPID, control_type: Torque"), "");
    expect_contains(both("SetMotorParameters, set_P: false, set_k_tau: true, k_tau: 1",
                         "SetMotorParameters, set_P: false, set_k_tau: true, k_tau: 2"),
                    "b: sets k_tau of the robot's motors, which a sets in the same step");
}

TEST_P(LowLevelPIDs, RefuseWhatTheRobotDoesNotHave) {
    const auto with = [](const std::string& settings) {
        return refusal(arm("", "  pid: {block: WholeBodyToolbox/SetLowLevelPID" + settings + "}\n"));
    };
    expect_contains(with(", joints: \"{'l_shoulder_ya'}\""),
                    "pid: there is no joint 'l_shoulder_ya' to set gains of; did you mean 'l_shoulder_yaw'?");
    expect_contains(with(", joints: \"{'l_shoulder_yaw', 'l_shoulder_yaw'}\""),
                    "names 'l_shoulder_yaw' twice");
    expect_contains(with(", control_type: Current"), "control_type");
    Running run(arm("", "  pid: {block: WholeBodyToolbox/SetLowLevelPID, P: 1, I: 0}\n"));
    EXPECT_FALSE(run.step());
    expect_contains(
        run.simulation.failure(),
        "pid: D was not given; give the gain, or keep the robot's by set_P, set_I or set_D: false");
    expect_contains(refusal(arm(", position_gains: \"[1 2 3; 4 5 6]\"", "")),
                    "'position_gains' is 2x3; give finite rows P I D");
    expect_contains(refusal(arm(", k_tau: 0", "")), "'k_tau' has 0 for joint 'l_shoulder_yaw'");
    expect_contains(refusal(arm(", gear_ratio: \"[1 2]\"", "")),
                    "'gear_ratio' has 2 elements, but there are 1 joints");
}

TEST_P(MotorParameters, MakeTheTorqueLoopWrongByWhatTheyMissTheMotor) {
    // The loop sends PWM = 3 tau, the motor makes (3 tau - 2 s') / 4 of it.
    const double M = inertia();
    Running run(arm(", k_tau: 4, k_bemf: 2",
                    command("Torque") + "  motor: {block: WholeBodyToolbox/SetMotorParameters, set_P: false, "
                                        "set_k_tau: true, k_tau: 3, set_bemf: true, bemf: 0}\n",
                    command_line, command_input));
    run.set("u", 0.1);
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (k < 2) continue; // the first torque is that of the loop as it was
        const double rate = 2 / (4 * M), last = 0.3 / 2;
        EXPECT_NEAR(run.scalar("world.s_dot"), last * (1 - std::exp(-rate * k * h)), 0.005) << k;
    }
}

TEST_P(MotorParameters, AreFiniteAndDoNotSwitchTheTorqueOff) {
    const auto with = [](const std::string& settings) {
        return refusal(
            arm("", "  motor: {block: WholeBodyToolbox/SetMotorParameters, set_P: false" + settings + "}\n"));
    };
    EXPECT_EQ(with(", set_k_tau: true, k_tau: -2, set_bemf: true"), "");
    EXPECT_EQ(with(", k_tau: 0"), "") << "it is not set";
    expect_contains(with(", set_k_tau: true"),
                    "motor: argument 'k_tau' has 0 elements, but there are 1 joints");
    expect_contains(with(", set_k_tau: true, k_tau: 0"),
                    "motor: argument 'k_tau' has 0; give finite numbers other than 0");
    expect_contains(with(", set_k_tau: true, k_tau: nan"),
                    "motor: argument 'k_tau' has nan; give finite numbers other than 0");
    expect_contains(with(", set_bemf: true, bemf: inf"),
                    "motor: argument 'bemf' has inf; give finite numbers");
}

TEST_P(MotorParameters, SendGainsOfSignalsWhereTheyChange) {
    const std::string blocks =
        command("Torque") +
        "  read: {block: WholeBodyToolbox/GetLowLevelPIDs, control_type: Torque}\n"
        "  motor: {block: WholeBodyToolbox/SetMotorParameters, set_D: true, control_type: "
        "Torque}\n";
    Running run(arm("", blocks, "  u: motors\n  p: motor.P\n  d: motor.D\n",
                    "inputs: {u: {shape: 1}, p: {shape: 1}, d: {shape: 1}}\n"));
    run.set("p", 2.0).set("d", 0.5);
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("read.P"), 2);
    EXPECT_EQ(run.scalar("read.I"), 0);
    EXPECT_EQ(run.scalar("read.D"), 0.5);
    run.set("p", 3.0);
    ASSERT_TRUE(run.step());
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("read.P"), 3);
    run.set("p", std::nan(""));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(), "motor: P is not finite; look at what computes it");
    expect_contains(
        refusal(arm("", "  motor: {block: WholeBodyToolbox/SetMotorParameters, set_P: false, "
                        "set_k_tau: true, k_tau: \"[1 2]\"}\n")),
        "motor: argument 'k_tau' has 2 elements, but there are 1 joints; give one for all or one each");
}

TEST_P(Limits, OfTheModelHaveVelocities) {
    Running run(arm("", "  limits: {block: WholeBodyToolbox/GetLimits, limit_type: ModelVelocity}\n"));
    ASSERT_TRUE(run.step());
    EXPECT_GT(run.scalar("limits.maximum"), 0);
    EXPECT_EQ(run.scalar("limits.minimum"), -run.scalar("limits.maximum"));
}

#define BF_IN_BOTH_WORLDS(suite)                                                                             \
    INSTANTIATE_TEST_SUITE_P(Robot, suite, testing::Values(Worlds::mujoco, Worlds::shared), name_of)
BF_IN_BOTH_WORLDS(Modes);
BF_IN_BOTH_WORLDS(Imperfections);
BF_IN_BOTH_WORLDS(LowLevelPIDs);
BF_IN_BOTH_WORLDS(MotorParameters);
BF_IN_BOTH_WORLDS(Limits);

} // namespace bf::toolbox::test::low_level
