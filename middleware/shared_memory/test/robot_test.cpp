// Robots that one program serves and another one drives.
#include "bf/shared_memory/robot.hpp"
#include "cycles.hpp"
#include "heap.hpp"
#include "served.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <random>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <sys/wait.h>

namespace bf::shared_memory::test {
namespace {

using middleware::HostOptions;
using middleware::test::controller;
using middleware::test::icub;
using middleware::test::icub_world;
using middleware::test::seen;
using middleware::test::wires;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string folder() { return "/dev/shm/blockfactory-" + std::to_string(geteuid()) + "-robots/"; }

/// A name of this test alone.
std::string robot_name(const std::string& name) { return "test-" + std::to_string(getpid()) + "-" + name; }
std::string icub_at(const std::string& name, const std::string& settings = "") {
    return "  world: {block: SharedMemory/Robot, period: 0.001, name: " + robot_name(name) + settings + "}\n";
}
std::string diagram(const std::string& blocks, const std::string& connections = "") {
    return middleware::test::diagram(blocks, connections, "SharedMemory");
}

middleware::RobotDescription one_joint() {
    middleware::RobotDescription d;
    d.period = 0.001;
    d.joints = {"a"};
    for (auto* limits : {&d.position_min, &d.position_max, &d.velocity_min, &d.velocity_max})
        limits->setZero(1);
    return d;
}

/// The memory of a robot, for somebody who writes over it.
class Overwritten {
  public:
    explicit Overwritten(const std::string& name)
        : file(::open((folder() + robot_name(name)).c_str(), O_RDWR)) {
        std::int32_t words[2] = {};
        EXPECT_EQ(pread(file, words, sizeof words, 0), static_cast<ssize_t>(sizeof words));
        shmid_ds status{};
        EXPECT_EQ(shmctl(words[1], IPC_STAT, &status), 0);
        bytes = status.shm_segsz;
        memory = static_cast<char*>(shmat(words[1], nullptr, 0));
    }
    ~Overwritten() {
        shmdt(memory);
        ::close(file);
    }
    void write(std::size_t at, std::uint64_t word) const { std::memcpy(memory + at, &word, sizeof word); }

    const int file;
    std::size_t bytes = 0;
    char* memory = nullptr;
};

class Served : public middleware::test::Served {
  public:
    Served(const std::string& name, const std::string& model, HostOptions options = {})
        : middleware::test::Served(make_end(robot_name(name)), model, std::move(options)) {}
};

} // namespace

/// The oracle is the same diagram with the world in place of the robot that is served.
TEST(SharedMemoryRobot, IsTheServedOneBitForBitInEveryMode) {
    for (const std::string mode :
         {"Position", "Position Direct", "Velocity", "Torque", "PWM", "Current", "Impedance"}) {
        Running direct(diagram(icub + icub_world + controller(mode), wires));
        Served served("bits", diagram(icub + icub_world));
        served.run();
        Running remote(diagram(icub + icub_at("bits") + controller(mode), wires));
        for (int k = 0; k < 60; ++k) {
            ASSERT_TRUE(direct.step()) << direct.simulation.failure();
            ASSERT_TRUE(remote.step()) << remote.simulation.failure();
            for (const auto& signal : seen)
                ASSERT_EQ(remote.get(signal), direct.get(signal))
                    << mode << " " << signal << " in step " << k;
            ASSERT_EQ(remote.get("world.s"), direct.get("world.s"));
            ASSERT_NEAR(remote.scalar("world.time"), 0.001 * k, 1e-12);
            ASSERT_NEAR(remote.scalar("world.drift"), 0, 1e-12);
        }
        EXPECT_GT((direct.get("world.s") - Matrix::Zero(3, 1)).norm(), 1e-4) << "it moved";
    }
}

TEST(SharedMemoryRobot, DoesTheLastStepOfAControllerThatLeaves) {
    Served served("last", diagram(icub + icub_world));
    middleware::test::expect_the_last_step_to_be_done(served, icub_at("last"), "SharedMemory");
}

TEST(SharedMemoryRobot, TakesGainsAndMotorParametersAndGivesThemBack) {
    const std::string set =
        "  pid: {block: WholeBodyToolbox/SetLowLevelPID, P: [100 200 300], I: [0 0 0], D: [1 2 3]}\n"
        "  motors: {block: WholeBodyToolbox/SetMotorParameters, set_P: false, set_k_tau: true, k_tau: [2 3 "
        "4]}\n"
        "  read: {block: WholeBodyToolbox/GetLowLevelPIDs}\n";
    Served served("gains", diagram(icub + icub_world));
    toolbox::Gains before(3), after(3);
    ASSERT_TRUE(served.robot->read_gains(toolbox::Loop::position, before));
    served.run();
    {
        Running remote(diagram(icub + icub_at("gains") + set));
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(remote.step()) << remote.simulation.failure();
            ASSERT_EQ(remote.get("read.P"), Matrix(Eigen::Vector3d(100, 200, 300))) << "at once";
            ASSERT_EQ(remote.get("read.D"), Matrix(Eigen::Vector3d(1, 2, 3)));
        }
        served.end_run();
        toolbox::Gains given(3);
        served.robot->read_gains(toolbox::Loop::position, given);
        EXPECT_EQ(given.P, Eigen::Vector3d(100, 200, 300)) << "the robot has them";
        toolbox::MotorParameters motors(3);
        ASSERT_TRUE(served.robot->read_motor_parameters(motors));
        EXPECT_EQ(motors.k_tau, Eigen::Vector3d(2, 3, 4));
        served.run();
        remote.simulation.stop();
    }
    while (served.host->gone() == 0) std::this_thread::yield();
    served.end_run();
    ASSERT_TRUE(served.robot->read_gains(toolbox::Loop::position, after));
    EXPECT_EQ(after.P, before.P);
    EXPECT_EQ(served.events(), "came left");
}

TEST(SharedMemoryRobot, TakesNothingFromTheHeapInAStep) {
    if (!bf::test::heap_is_counted()) GTEST_SKIP();
    Served served("heap", diagram(icub + icub_world));
    served.run();
    Running remote(diagram(icub + icub_at("heap") + controller("Torque"), wires));
    for (int k = 0; k < 10; ++k) {
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(remote.step());
        if (k > 0) {
            ASSERT_EQ(bf::test::heap_calls(), before);
        }
    }
}

TEST(SharedMemoryRobot, RunsBesideItsControllerByTheClock) {
    HostOptions options;
    options.waits = false;
    options.watchdog = 0;
    Served served("clock", diagram(icub + icub_world), options);
    ASSERT_TRUE(served.step());
    Running remote(diagram(icub + icub_at("clock", ", clock: own") + controller("Torque"), wires));
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    for (int k = 0; k < 4; ++k) ASSERT_TRUE(served.step());
    EXPECT_EQ(served.robot->joint_in_other_mode(toolbox::ControlMode::torque), -1);
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    EXPECT_NEAR(remote.scalar("world.time"), 0.004, 1e-12);
    EXPECT_NEAR(remote.scalar("world.drift"), 0.003, 1e-12) << "four steps there, one here";
    EXPECT_GE(remote.scalar("world.age"), 0);
    ASSERT_TRUE(remote.step());
    const double age = remote.scalar("world.age");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_TRUE(remote.step());
    EXPECT_GE(remote.scalar("world.age"), age + 0.02) << "the same state grows older";
    remote.simulation.stop();
    EXPECT_GE(remote.scalar("world.worst_age"), 0.02);
}

/// A robot that waits has not been silent while nobody asked it for anything.
TEST(SharedMemoryRobot, IsNoOlderForHavingWaitedForItsController) {
    Served served("waited", diagram(icub + icub_world));
    served.run();
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    Running remote(
        diagram(icub + icub_at("waited", ", clock: own, timeout: 0.1") + controller("Torque"), wires));
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    EXPECT_EQ(remote.scalar("world.age"), 0);
    for (int k = 0; k < 2000 && remote.scalar("world.time") < 0.001; ++k, usleep(1000)) {
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    }
    served.end_run(); // and now it is asked
    bool goes_on = true;
    for (int k = 0; k < 2000 && goes_on; ++k, usleep(1000)) goes_on = remote.step();
    expect_contains(remote.simulation.failure(), "in shared memory: no state for 0.1");
    const std::string failure = remote.simulation.failure();
    remote.simulation.stop();
    EXPECT_EQ(remote.simulation.failure(), failure) << "the reason stays when all is closed";
}

TEST(SharedMemoryRobot, StepsByMultiplesOfTheRobotsPeriod) {
    Served served("period", diagram(icub + icub_world));
    served.run();
    const auto at = [&](const std::string& period) {
        return "model: m\nplugins: [WholeBodyToolbox, SharedMemory]\nstep: 0.0001\nblocks:\n" + icub +
               "  world: {block: SharedMemory/Robot, period: " + period + ", name: " + robot_name("period") +
               "}\n";
    };
    for (const std::string period : {"0.0005", "0.0015", "0.0007"})
        expect_contains(refusal(at(period)),
                        "in shared memory: it goes on by 0.001 s in each of its steps, and "
                        "this block by " +
                            period + " s; give the block the period of the robot");
}

TEST(SharedMemoryRobot, IsSeenAtTheTimesOfASlowerController) {
    for (const int ratio : {2, 3, 5}) {
        Served served("slower", diagram(icub + icub_world));
        served.run();
        middleware::test::expect_each_step_at_its_time(icub_at("slower"), "SharedMemory", ratio);
    }
}

TEST(SharedMemoryRobot, MendsWhatControllersKnowItBy) {
    Served served("mended", diagram(icub + icub_world));
    served.run();
    {
        const Overwritten memory("mended");
        std::memset(memory.memory, 'x', 20);
        std::memset(memory.memory + 256, 'x', 200);
        EXPECT_EQ(pwrite(memory.file, "damage", 6, 0), 6);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    Running remote(diagram(icub + icub_at("mended")));
    EXPECT_TRUE(remote.step()) << remote.simulation.failure();
}

/// The oracle is the same diagram with a world that no other program reaches.
TEST(SharedMemoryRobot, BelievesNoWordThatAnotherProgramWroteOver) {
    Running direct(diagram(icub + icub_world + controller("Torque"), wires));
    Served served("words", diagram(icub + icub_world));
    served.run();
    Running remote(diagram(icub + icub_at("words", ", timeout: 20") + controller("Torque"), wires));
    const Overwritten memory("words");
    std::mt19937_64 random(1);
    const auto expect_the_same_step = [&] {
        ASSERT_TRUE(direct.step());
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        for (const auto& signal : seen) ASSERT_EQ(remote.get(signal), direct.get(signal)) << signal;
        ASSERT_EQ(remote.get("world.s"), direct.get("world.s"));
    };
    for (int k = 0; k < 8; ++k) expect_the_same_step();
    for (std::size_t at = 0; at + 8 <= memory.bytes; at += 8)
        for (const std::uint64_t word : {random(), at % 16 == 0 ? ~std::uint64_t{0} : std::uint64_t{0}}) {
            memory.write(at, word);
            expect_the_same_step();
            ASSERT_FALSE(testing::Test::HasFailure()) << "word at " << at << " was " << word;
        }
    for (int k = 0; k < 20; ++k) { // all of it at once, and while both read and write
        for (std::size_t at = 0; at + 8 <= memory.bytes; at += 8) memory.write(at, random());
        expect_the_same_step();
        ASSERT_FALSE(testing::Test::HasFailure()) << k;
    }
    std::atomic<bool> goes_on{true};
    std::thread other([&] {
        for (; goes_on; usleep(200)) memory.write(random() % (memory.bytes / 8) * 8, random());
    });
    for (int k = 0; k < 50; ++k) expect_the_same_step();
    goes_on = false;
    other.join();
    remote.simulation.stop();
    while (served.host->gone() == 0) std::this_thread::yield();
    Running next(diagram(icub + icub_at("words") + controller("Torque"), wires));
    EXPECT_TRUE(next.step()) << next.simulation.failure();
}

TEST(SharedMemoryRobot, LivesOnWhereItsFileIsMadeShorterOrWrittenOver) {
    Served served("short", diagram(icub + icub_world));
    served.run();
    const Overwritten memory("short");
    const std::string noise(100, 'x');
    for (int left = 0; left <= 100; left += left < 10 ? 1 : 45) {
        Running remote(diagram(icub + icub_at("short") + controller("Torque"), wires));
        for (const bool is_written : {false, true}) {
            ASSERT_EQ(ftruncate(memory.file, left), 0);
            if (is_written) {
                ASSERT_EQ(pwrite(memory.file, noise.data(), static_cast<std::size_t>(left), 0), left);
            }
            for (int k = 0; k < 3; ++k) {
                ASSERT_TRUE(remote.step()) << remote.simulation.failure();
            }
        }
    }
}

/// As a system does at the end of a login. The controller that drives it is disturbed in nothing.
TEST(SharedMemoryRobot, IsFoundAgainWhereItsFileWasRemoved) {
    const std::string file = folder() + robot_name("removed");
    Served served("removed", diagram(icub + icub_world));
    served.run();
    const auto awaited = [&] {
        for (int ms = 0; ms < 5000 && !std::filesystem::exists(file); ++ms) usleep(1000);
        return std::filesystem::exists(file);
    };
    const auto wrong = [&] {
        return refusal(
            diagram(icub + icub_at("removed", ", start_timeout: 0.2") + controller("Torque"), wires));
    };
    {
        Running remote(diagram(icub + icub_at("removed") + controller("Torque"), wires));
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        for (int times = 0; times < 2; ++times) {
            std::filesystem::remove(file);
            ASSERT_TRUE(awaited());
            for (int k = 0; k < 5; ++k) ASSERT_TRUE(remote.step()) << remote.simulation.failure();
            expect_contains(wrong(), "another program (process " + std::to_string(getpid()) + ") drives it");
            EXPECT_THROW(make_end(robot_name("removed"))->start(one_joint()), std::runtime_error)
                << "there is one server of a name";
        }
    }
    while (served.host->gone() == 0) std::this_thread::yield();
    EXPECT_EQ(served.events(), "came left");
    std::filesystem::remove(file);
    ASSERT_TRUE(awaited());
    usleep(100'000); // the controller is known to be gone
    Running next(diagram(icub + icub_at("removed") + controller("Torque"), wires));
    EXPECT_TRUE(next.step()) << next.simulation.failure();
    next.simulation.stop();
    while (served.host->gone() == 1) std::this_thread::yield();
}

TEST(SharedMemoryRobot, IsTakenBackFromASilentController) {
    HostOptions options;
    options.waits = false;
    options.watchdog = 0.05;
    Served served("silent", diagram(icub + icub_world), options);
    ASSERT_TRUE(served.step());
    Running remote(diagram(icub + icub_at("silent", ", clock: own") + controller("Torque"), wires));
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    ASSERT_TRUE(served.step());
    ASSERT_TRUE(served.step());
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    EXPECT_EQ(served.events(), "came");
    std::this_thread::sleep_for(std::chrono::milliseconds(70));
    ASSERT_TRUE(served.step());
    EXPECT_EQ(served.events(), "silent");
    EXPECT_EQ(served.robot->joint_in_other_mode(toolbox::ControlMode::position), -1) << "it holds its joints";
    ASSERT_TRUE(served.step());
    EXPECT_FALSE(remote.step());
    expect_contains(remote.simulation.failure(),
                    "robot '" + robot_name("silent") +
                        "' in shared memory: its server has taken the joints back, since "
                        "no command came for 0.05 s");
    ASSERT_TRUE(served.step());
    EXPECT_EQ(served.events(), "") << "the old controller is not heard any more";
}

/// The part of a diagram that commands may be disabled, and enabled again. Positions stay what they are.
TEST(SharedMemoryRobot, HoldsJointsThatAreGivenNoReferencesUntilSomeComeAgain) {
    using Mode = toolbox::ControlMode;
    const auto part = [](const std::string& mode) {
        return "  u: {block: Constant, value: [0.3 -0.2 0.2]}\n"
               "  part:\n    execution: enabled\n    inputs: [u]\n    blocks:\n"
               "      drive: {block: WholeBodyToolbox/SetReferences, control_type: " +
               mode + "}\n    connections: {u: drive}\n";
    };
    for (const auto& [name, mode, is_limp, without] :
         {std::tuple("Velocity", Mode::velocity, false, Mode::position),
          std::tuple("Torque", Mode::torque, false, Mode::position),
          std::tuple("Velocity", Mode::velocity, true, Mode::torque),
          std::tuple("Position Direct", Mode::position_direct, false, Mode::position_direct)}) {
        HostOptions options;
        options.waits = false;
        options.idle_after = 0.05;
        if (is_limp) options.on_loss = middleware::OnLoss::limp;
        Served served("idle", diagram(icub + icub_world), options);
        ASSERT_TRUE(served.step());
        Running remote(diagram(icub + icub_at("idle", ", clock: own") + part(name),
                               "  u: part.u\n  on: part.enable\ninputs: [on]\n"));
        const auto steps = [&](bool is_on) { // 0.1 s
            remote.set("on", is_on);
            for (int k = 0; k < 10; ++k) {
                ASSERT_TRUE(remote.step()) << remote.simulation.failure();
                ASSERT_TRUE(served.step());
                std::this_thread::sleep_for(std::chrono::milliseconds(10));
            }
        };
        const auto is_in = [&](Mode asked) { return served.robot->joint_in_other_mode(asked) < 0; };
        for (const std::string came : {"came", ""}) {
            steps(true);
            EXPECT_TRUE(is_in(mode)) << name;
            EXPECT_EQ(served.events(), came) << name;
            steps(false);
            EXPECT_TRUE(is_in(without)) << name;
            EXPECT_EQ(served.events(), mode == without ? "" : "idle") << name;
        }
    }
}

TEST(SharedMemoryRobot, HoldsItsJointsUntilAControllerWasLostAndIsLimpThenWhereThatIsAsked) {
    HostOptions options;
    options.waits = false;
    options.watchdog = 0;
    options.on_loss = middleware::OnLoss::limp;
    Served served("limp", diagram(icub + icub_world), options);
    const auto is_in = [&](toolbox::ControlMode mode) { return served.robot->joint_in_other_mode(mode) < 0; };
    ASSERT_TRUE(served.step());
    EXPECT_TRUE(is_in(toolbox::ControlMode::position)) << "nobody has come";
    {
        Running remote(diagram(icub + icub_at("limp", ", clock: own") + controller("Velocity"), wires));
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        ASSERT_TRUE(served.step());
        EXPECT_TRUE(is_in(toolbox::ControlMode::velocity));
    }
    ASSERT_TRUE(served.step());
    EXPECT_TRUE(is_in(toolbox::ControlMode::torque)) << "the controller has left";
}

/// A controller that is killed leaves no word.
TEST(SharedMemoryRobot, HoldsItsJointsWhenTheControllerIsKilled) {
    for (const bool waits : {true, false}) {
        HostOptions options;
        options.waits = waits;
        options.watchdog = 0;
        Served served("killed", diagram(icub + icub_world), options);
        ASSERT_TRUE(waits || served.step());
        const std::string name = robot_name("killed");
        const pid_t child = fork();
        if (child == 0) try {
                auto link = make_link(name);
                const auto description = link->start(10);
                const middleware::RobotLayout at(description);
                std::vector<double> command(static_cast<std::size_t>(at.command_size()), 0.5);
                using Layout = middleware::RobotLayout;
                command[Layout::session] = 7;
                command[Layout::number] = command[Layout::mode_count] = command[Layout::references] = 1;
                command[Layout::until] = 0.0015;
                command[Layout::mode_asked] = static_cast<int>(toolbox::ControlMode::torque);
                command[Layout::limit] = command[Layout::given] = command[Layout::release] = 0;
                link->send_command(command.data());
                pause();
            } catch (const std::exception&) {
                _exit(1);
            }
        if (waits) served.run();
        std::string events;
        for (int k = 0; events != "came" && k < 20'000; ++k) {
            ASSERT_TRUE(waits || served.step());
            usleep(1000);
            events += served.events();
        }
        EXPECT_EQ(events, "came");
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
        for (int k = 0; events == "came" && k < 20'000; ++k) {
            ASSERT_TRUE(waits || served.step());
            usleep(1000);
            const auto more = served.events();
            events += more.empty() ? "" : " " + more;
        }
        EXPECT_EQ(events, "came died");
        served.end_run();
        EXPECT_EQ(served.robot->joint_in_other_mode(toolbox::ControlMode::position), -1);
    }
}

TEST(SharedMemoryRobot, EndsTheRunWhenItsServerIsGone) {
    auto served = std::make_unique<Served>("gone", diagram(icub + icub_world));
    served->run();
    Running remote(diagram(icub + icub_at("gone") + controller("Torque"), wires));
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    served.reset();
    while (remote.step()) continue;
    expect_contains(remote.simulation.failure(), "in shared memory: its server (process " +
                                                     std::to_string(getpid()) +
                                                     ") has ended; the last state is of t = 0");
    // Its successor is another robot.
    served = std::make_unique<Served>("gone", diagram(icub + icub_world));
    served->run();
    EXPECT_FALSE(remote.step());
    Running next(diagram(icub + icub_at("gone") + controller("Torque"), wires));
    EXPECT_TRUE(next.step()) << next.simulation.failure();
}

TEST(SharedMemoryRobot, EndsTheRunWhenItsServerStandsStill) {
    Served served("still", diagram(icub + icub_world));
    served.run();
    Running remote(diagram(icub + icub_at("still", ", timeout: 0.05") + controller("Torque"), wires));
    ASSERT_TRUE(remote.step()) << remote.simulation.failure();
    served.end_run(); // its memory is still there
    while (remote.step()) continue;
    expect_contains(remote.simulation.failure(), "in shared memory: no state for 0.");
    expect_contains(remote.simulation.failure(),
                    "look whether its server (process " + std::to_string(getpid()) + ") stands still");
}

TEST(SharedMemoryRobot, EndsTheRunWhereItsTimeGoesBack) {
    middleware::test::expect_end_where_time_goes_back(
        make_end(robot_name("again")), icub_at("again", ", joints: \"{'a'}\""), "SharedMemory");
}

TEST(SharedMemoryRobot, ShowsTheNewestStateOfAServerThatFloods) {
    middleware::test::expect_the_newest_of_a_flood(make_end(robot_name("flood")),
                                                   icub_at("flood", ", joints: \"{'a'}\""), "SharedMemory");
}

TEST(SharedMemoryRobot, SaysWhatDoesNotFit) {
    const std::string here = "world: robot '" + robot_name("wrong") + "' in shared memory: ";
    const std::string quick = ", start_timeout: 0.05";
    expect_contains(refusal(diagram(icub + icub_at("wrong", quick))),
                    here + "nobody serves it within 0.05 s; start it first, e.g. by bf serve MODEL --shm ");
    Served served("wrong", diagram(icub + icub_world));
    served.run();
    EXPECT_THROW(make_end(robot_name("wrong"))->start({}), std::runtime_error);
    const auto other = [&](const std::string& joints) {
        return refusal(diagram(icub_at("wrong", quick + ", joints: \"" + joints + "\"")));
    };
    expect_contains(
        other("{'l_hip_pitch', 'l_nee', 'l_ankle_roll'}"),
        here + "it has no joint 'l_nee'; did you mean 'l_knee'?; its joints are l_hip_pitch, l_knee, "
               "l_ankle_roll");
    expect_contains(other("{'l_knee'}"),
                    here + "it has 3 joints, and this diagram drives 1 of them; name all");
    // The order is that of the diagram.
    {
        Running turned(
            diagram(icub_at("wrong", ", joints: \"{'l_ankle_roll', 'l_knee', 'l_hip_pitch'}\"") +
                    "  limits: {block: WholeBodyToolbox/GetLimits, limit_type: ControlBoardPosition}\n"));
        ASSERT_TRUE(turned.step());
        Eigen::VectorXd minimum(3), maximum(3);
        ASSERT_TRUE(served.robot->read(toolbox::Limits::position, minimum, maximum));
        EXPECT_EQ(turned.get("limits.minimum"), Matrix(minimum.reverse()));
        expect_contains(refusal(diagram(icub + icub_at("wrong", quick))),
                        here + "another program (process " + std::to_string(getpid()) +
                            ") drives it; end that one first");
    }
    Running sensors(
        diagram(icub + icub_at("wrong") + "  x: {block: WholeBodyToolbox/GetSensor, sensor: r_foot}\n"));
    EXPECT_FALSE(sensors.step());
    expect_contains(
        sensors.simulation.failure(),
        "x: robot '" + robot_name("wrong") +
            "' in shared memory: it has no force/torque sensor 'r_foot'; it has l_foot_ft_sensor");
    expect_contains(refusal(diagram(icub + "  w: {block: SharedMemory/Robot, name: a/b, period: 0.001}\n")),
                    "the robot's name is 'a/b'; write up to 100 letters");
}

TEST(SharedMemoryRobot, SaysThatItsServerSendsNothing) {
    const auto quiet = make_end(robot_name("quiet"));
    quiet->start(one_joint());
    expect_contains(refusal(diagram(icub_at("quiet", ", start_timeout: 0.05, joints: \"{'a'}\""))),
                    "world: robot '" + robot_name("quiet") +
                        "' in shared memory: it is there, but sends no state; look whether it runs");
}

TEST(SharedMemoryRobot, DistrustsMemory) {
    const std::string here = "robot '" + robot_name("bad") + "' in shared memory: ";
    const auto refused = [&](const std::string& bytes) {
        auto served = make_end(robot_name("bad"));
        served->start(one_joint());
        {
            const Overwritten memory("bad");
            if (bytes.size() == 4)
                EXPECT_EQ(pwrite(memory.file, bytes.data(), 4, 0), 4);
            else
                std::memcpy(memory.memory + 256, bytes.data(), bytes.size());
        }
        return refusal(diagram(icub_at("bad", ", start_timeout: 0.05, joints: \"{'a'}\"")));
    };
    expect_contains(
        refused("OLD1"),
        here + "its memory is that of another version, or damaged; use the same BlockFactory on both sides");
    expect_contains(refused("{\"version\""),
                    here + "what it says of itself cannot be read; start its server anew");
    expect_contains(refused("[[[[[[[[[[[[["), here + "what it says of itself cannot be read");
    // Any number may stand where that of the memory should, also of memory that is another program's.
    const int other = shmget(IPC_PRIVATE, 100'000, IPC_CREAT | 0600);
    for (const std::int32_t memory : {-1, 0, other, INT32_MAX}) {
        auto served = make_end(robot_name("bad"));
        served->start(one_joint());
        {
            const Overwritten file("bad");
            EXPECT_EQ(pwrite(file.file, &memory, sizeof memory, 4), 4);
        }
        expect_contains(refusal(diagram(icub_at("bad", ", start_timeout: 0.05, joints: \"{'a'}\""))),
                        here + "its memory is ");
    }
    shmctl(other, IPC_RMID, nullptr);
    std::mt19937_64 random(1);
    for (std::size_t at = 0, end = 256; at < end; at += at < 256 ? 4 : 20)
        for (const std::uint32_t word : {static_cast<std::uint32_t>(random()), ~std::uint32_t{0}}) {
            auto served = make_end(robot_name("bad"));
            served->start(one_joint());
            {
                const Overwritten memory("bad");
                std::uint32_t text = 0;
                std::memcpy(&text, memory.memory + 4, sizeof text);
                end = 256 + text;
                std::memcpy(memory.memory + at, &word, sizeof word);
            }
            expect_contains(refusal(diagram(icub_at("bad", ", start_timeout: 0.01, joints: \"{'a'}\""))),
                            here);
        }
}

TEST(SharedMemoryRobot, RefusesReferencesThatAreNotFinite) {
    Served served("nan", diagram(icub + icub_world));
    auto link = make_link(robot_name("nan"));
    const auto description = link->start(1);
    using Layout = middleware::RobotLayout;
    const Layout at(description);
    std::vector<double> command(static_cast<std::size_t>(at.command_size()), std::nan("")),
        state(static_cast<std::size_t>(at.state_size()));
    command[Layout::session] = 7;
    command[Layout::number] = command[Layout::mode_count] = command[Layout::references] = 1;
    command[Layout::until] = 1;
    command[Layout::limit] = command[Layout::given] = command[Layout::release] = 0;
    const auto refused = [&](double mode) {
        command[Layout::mode_asked] = mode;
        ++command[Layout::session];
        link->send_command(command.data());
        EXPECT_TRUE(served.step());
        EXPECT_TRUE(served.step());
        middleware::Stamp stamp;
        EXPECT_TRUE(link->take_state(state.data(), stamp));
        EXPECT_EQ(state[Layout::owner], command[Layout::session]);
        return static_cast<middleware::Refusal>(static_cast<int>(state[Layout::refused]));
    };
    EXPECT_EQ(refused(static_cast<int>(toolbox::ControlMode::torque)), middleware::Refusal::references);
    for (const double mode : {-1.0, 99.0, 1e300, std::nan("")})
        EXPECT_EQ(refused(mode), middleware::Refusal::mode);
    link->stop();
}

TEST(SharedMemoryRobot, LeavesNoFileBehind) {
    const std::string file = folder() + robot_name("file");
    {
        Served served("file", diagram(icub + icub_world));
        EXPECT_EQ(access(file.c_str(), F_OK), 0);
    }
    EXPECT_NE(access(file.c_str(), F_OK), 0);
    // Starting and stopping again and again leaves nothing open.
    const auto descriptors = [] {
        int count = 0;
        for (int i = 0; i < 1024; ++i) count += fcntl(i, F_GETFD) >= 0;
        return count;
    };
    const int before = descriptors();
    middleware::RobotDescription d;
    d.period = 1;
    for (int k = 0; k < 1000; ++k) {
        auto end = make_end(robot_name("file"));
        end->start(d);
        auto link = make_link(robot_name("file"));
        link->start(1);
        link->stop();
    }
    EXPECT_EQ(descriptors(), before);
}

TEST(SharedMemoryRobot, CannotBeSaved) {
    Served served("snapshot", diagram(icub + icub_world));
    served.run();
    Running remote(diagram(icub + icub_at("snapshot")));
    ASSERT_TRUE(remote.step());
    try {
        remote.simulation.snapshot();
        ADD_FAILURE() << "saved";
    } catch (const std::exception& error) {
        expect_contains(error.what(), "world: its state lives outside and cannot be saved");
    }
}

TEST(SharedMemoryRobot, LeavesNothingBehindHoweverOftenBothSidesStart) {
    middleware::test::expect_no_leak([] {
        Served served("cycles", diagram(icub + icub_world));
        served.run();
        Running remote(diagram(icub + icub_at("cycles") + controller("Torque"), wires));
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        }
    });
}

} // namespace bf::shared_memory::test
