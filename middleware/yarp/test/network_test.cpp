// A diagram drives boards of another program, which a name server knows.
#include "../../test/served.hpp"
#include "bf/core/interrupt.hpp"
#include "patience.hpp"
#include "running.hpp"
#include "stand.hpp"

#include <future>

namespace bf::yarp::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

class YarpBoards : public YarpNetwork {
  protected:
    Program boards() const {
        return Program({"yarpdev", "--from",
                        write("leg.ini", "device controlboardwrapper2\nsubdevice fakeMotionControl\nname "
                                         "/icubSim/left_leg\nperiod 5\n[GENERAL]\nJoints 3\n"
                                         "AxisName hip knee ankle\n")});
    }
};

const std::string robot =
    "model: m\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.005\ninputs: {u: {shape: 3}}\nblocks:\n"
    "  robot: {block: Yarp/Robot, boards: \"{'left_leg'}\", joints: \"{'ankle', 'hip', 'knee'}\", "
    "start_timeout: 20, silence: 5}\n"
    "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
    "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Position Direct}\n"
    "connections: {u: drive}\n";

} // namespace

TEST_F(YarpBoards, LeadsToBoardsOfAnotherProgramUntilTheyAreKilled) {
    expect_contains(refusal(robot), "no YARP name server answers; start yarpserver");
    // Nor does one where nobody has said where it is.
    setenv("YARP_CONFIG_HOME", (folder_ / "none").c_str(), 1);
    Program unknown({BF_PROGRAM, "serve",
                     write("world.yaml",
                           middleware::test::diagram(middleware::test::icub + middleware::test::icub_world)),
                     "--yarp", "icubSim"},
                    folder_ / "said");
    EXPECT_EQ(unknown.wait(), 1);
    expect_contains(read("said"), "no YARP name server is known; start `yarpserver --write`");
    setenv("YARP_CONFIG_HOME", folder_.c_str(), 1);
    const auto server = name_server();
    ASSERT_TRUE(is_there("/root"));
    const double asked = middleware::now();
    expect_contains(refusal(middleware::test::waiting(robot, "2")),
                    "robot: YARP robot 'icubSim': there is no control board at "
                    "/icubSim/left_leg within start_timeout (2 s); start the robot's");
    EXPECT_GT(middleware::now() - asked, 1.7);
    static std::string waits;
    listen_to_waits([](const char* what) { waits += what; });
    auto starts = std::async(std::launch::async, [] { return std::make_unique<Running>(robot); });
    usleep(1'000'000);
    auto leg = boards();
    const auto started = starts.get();
    Running& run = *started;
    listen_to_waits(nullptr);
    EXPECT_EQ(waits, "the control board /icubSim/left_leg of YARP robot 'icubSim'");
    const Eigen::Vector3d target(0.1, 0.2, -0.3);
    run.set("u", target);
    double error = 1;
    for (int k = 0; k < 1000 && error > 1e-9; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        error = (run.get("s.y") - Matrix(target)).norm();
    }
    EXPECT_LT(error, 1e-9) << run.get("s.y");
    EXPECT_LT(run.scalar("robot.age"), 1);
    leg.end();
    int steps = 0;
    while (run.step() && ++steps < 2000) continue;
    expect_contains(run.simulation.failure(), "YARP robot 'icubSim': no state for 1");
    expect_contains(run.simulation.failure(), "look whether it stands still, or raise timeout");
    // Boards that are there again are driven again.
    auto again = boards();
    ASSERT_TRUE(is_there("/icubSim/left_leg/stateExt:o"));
    run.simulation.stop();
    Running next(robot);
    next.set("u", target);
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(next.step()) << next.simulation.failure();
    }
}

/// YARP itself would, for ever.
TEST_F(YarpBoards, LeaveARunWhoseClockNobodyTellsAtTimeZero) {
    const auto server = name_server();
    ASSERT_TRUE(is_there("/root"));
    const std::string model =
        write("told.yaml", "model: told\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.01\nblocks:\n"
                           "  network: {block: Yarp/Network}\n"
                           "  w: {block: WholeBodyToolbox/StreamWrite, stream: /w}\n"
                           "  t: {block: WholeBodyToolbox/NetworkClock}\n"
                           "connections: {t: w}\n");
    const auto run = [&](const std::string& clock) {
        setenv("YARP_CLOCK", clock.c_str(), 1);
        Program program({BF_PROGRAM, "run", model, "--stop", "0.1", "--quiet"}, folder_ / "said");
        unsetenv("YARP_CLOCK");
        return program.ends_well(20);
    };
    EXPECT_TRUE(run("/clock"));
    EXPECT_FALSE(run("clock"));
    expect_contains(read("said"), "YARP_CLOCK is 'clock'; write it as the name of a port, such as /clock");
}

} // namespace bf::yarp::test
