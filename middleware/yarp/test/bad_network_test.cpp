// YARP over a network that loses, delays and turns round packets, and with servers that die, stall and begin
// again there: 10 % of the packets are lost, and the others take from 0 to 10 ms, whatever carrier they are
// of.
#include "bad_network.hpp"
#include "bf/middleware/clock.hpp"
#include "patience.hpp"
#include "program.hpp"
#include "running.hpp"
#include "served.hpp"
#include "stand.hpp"

#include <functional>
#include <optional>

namespace bf::yarp::test {
namespace {

using middleware::now;
using middleware::test::diagram;
using middleware::test::icub;
using middleware::test::icub_world;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;
using OtherProgram = middleware::test::Program;

constexpr const char* carriers[] = {"udp", "tcp", "fast_tcp"};
constexpr double soon = 60; ///< s, on a machine that has other things to do

/// The name server and the diagram are on this side, the robot's server on the other one.
class YarpBadNetwork : public YarpNetwork {
  protected:
    void SetUp() override {
        YarpNetwork::SetUp();
        if (IsSkipped()) return;
        way.emplace(middleware::test::BadWays{});
        if (!way->is_there()) GTEST_SKIP() << "this system has no tunnels";
        std::ofstream(folder_ / "yarp.conf") << "10.77.0.1 10000 yarp\n";
        names_ = std::make_unique<Program>(
            Program({"yarpserver", "--ip", "10.77.0.1", "--socket", "10000", "--read"}));
        ASSERT_TRUE(is_there("/root"));
        model_ = write("leg.yaml", diagram(icub + icub_world));
    }
    void TearDown() override {
        names_.reset();
        way.reset();
        YarpNetwork::TearDown();
    }
    /// Its words are read from it.
    std::unique_ptr<OtherProgram> serve(const std::vector<std::string>& more) const {
        std::vector<std::string> words{"/bin/sh", "-c",   "exec \"$@\" 2>&1", "sh",     BF_PROGRAM,
                                       "serve",   model_, "--yarp",           "icubSim"};
        words.insert(words.end(), more.begin(), more.end());
        return std::make_unique<OtherProgram>(words,
                                              middleware::test::ProgramOptions{.network = way->network()});
    }
    std::unique_ptr<OtherProgram> serve_by_the_clock(const std::string& silence) const {
        return serve({"--realtime", "--priority", "0", "--watchdog", "0", "--silence", silence});
    }
    /// What it says until then.
    static std::string says(OtherProgram& program, const std::string& what) {
        std::string all;
        for (std::string line; !(line = program.line()).empty();) {
            all += line + "\n";
            if (line.find(what) != std::string::npos) break;
        }
        return all;
    }
    static bool is_gone(const std::string& port) {
        for (const double end = now() + soon; now() < end; usleep(50'000))
            if (Program({"yarp", "exists", port}).wait() != 0) return true;
        return false;
    }
    static std::string driving(const std::string& carrier, const std::string& settings,
                               const std::string& mode, const std::string& references) {
        return diagram(icub +
                           "  world: {block: Yarp/Robot, period: 0.001, boards: \"{'left_leg'}\", "
                           "start_timeout: 60, carrier: " +
                           carrier + settings + "}\n  c: {block: Constant, value: [" + references +
                           "]}\n  drive: {block: WholeBodyToolbox/SetReferences, control_type: " + mode +
                           "}\n",
                       "  c: drive\n", "Yarp");
    }
    std::optional<middleware::test::BadNetwork> way;
    std::string model_;

  private:
    std::unique_ptr<Program> names_;
};

} // namespace

/// The knee turns by one velocity, so what goes back is an older state.
TEST_F(YarpBadNetwork, TurnsNothingRoundAndLeadsARobotToItsTarget) {
    const auto served = serve_by_the_clock("60");
    says(*served, "serves the robot");
    for (const std::string carrier : carriers) {
        {
            Running run(driving(carrier, ", timeout: 20, silence: 30", "Velocity", "0 -0.4 0"));
            double knee = 0;
            int seen = 0;
            for (int k = 0; k < 20'000 && run.get("world.s")(1) > -0.8; ++k) {
                ASSERT_TRUE(run.step()) << carrier << ": " << run.simulation.failure();
                const double next = run.get("world.s")(1);
                if (knee < -0.2) {
                    EXPECT_LE(next, knee + 1e-9) << carrier;
                }
                if (next < -0.2 && next > -0.8) { // it has its velocity, and is not at its limit
                    EXPECT_NEAR(run.get("world.s_dot")(1), -0.4, 0.05) << carrier;
                    seen += next != knee;
                }
                knee = next;
            }
            EXPECT_LE(knee, -0.8) << carrier;
            // By tcp, states wait for what is lost of those before.
            EXPECT_GT(seen, carrier == "udp" ? 10 : 0) << carrier;
        }
        Running run(driving(carrier, ", timeout: 20, silence: 30", "Position Direct", "0.1 -0.1 0.05"));
        const Matrix target = Eigen::Vector3d(0.1, -0.1, 0.05);
        for (int k = 0; k < 20'000 && (run.get("world.s") - target).norm() > 0.02; ++k) {
            ASSERT_TRUE(run.step()) << carrier << ": " << run.simulation.failure();
            ASSERT_LT(run.scalar("world.age"), 20);
        }
        EXPECT_LT((run.get("world.s") - target).norm(), 0.02) << carrier;
    }
    EXPECT_GT(way->lost(), 100);
    EXPECT_GT(way->carried(), 1000);
}

/// Each state is of its time, and each command has come before the robot goes on.
TEST_F(YarpBadNetwork, IsLedInLockstepToTheSameNumbers) {
    const std::string blocks = "  sine: {block: Sine, amplitude: [3 -2 1], frequency: 40, phase: 0.4}\n"
                               "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Torque}\n",
                      wires = "  sine: drive\n";
    for (const std::string carrier : carriers) {
        const auto served = serve({});
        says(*served, "serves the robot");
        Running direct(diagram(icub + icub_world + blocks, wires));
        Running run(diagram(icub +
                                "  world: {block: Yarp/Robot, period: 0.001, boards: \"{'left_leg'}\", "
                                "start_timeout: 60, timeout: 20, simulator: /clock/rpc, carrier: " +
                                carrier + "}\n" + blocks,
                            wires, "Yarp"));
        for (int k = 0; k < 20; ++k) {
            ASSERT_TRUE(direct.step());
            ASSERT_TRUE(run.step()) << carrier << ": " << run.simulation.failure();
            EXPECT_LT((run.get("world.s") - direct.get("world.s")).norm(), 1e-9) << carrier << " " << k;
            EXPECT_LT((run.get("world.s_dot") - direct.get("world.s_dot")).norm(), 1e-7) << carrier << k;
            EXPECT_NEAR(run.scalar("world.drift"), 0, 1e-9) << carrier;
        }
        EXPECT_GT(direct.get("world.s_dot").norm(), 0.1) << "it moves";
    }
}

TEST_F(YarpBadNetwork, TellsTheAgeOfWhatCameAndThatNothingComesAnyMore) {
    const auto served = serve_by_the_clock("6");
    says(*served, "serves the robot");
    for (const std::string carrier : carriers) {
        {
            Running run(driving(carrier, ", timeout: 10, silence: 20", "Torque", "0 -1 0"));
            double last = 0; // a moment before the last step
            for (int k = 0; k < 300; ++k) {
                last = now();
                ASSERT_TRUE(run.step()) << carrier << ": " << run.simulation.failure();
            }
            const double before = run.scalar("world.age"), cut = now();
            way->is_cut = true;
            double age = 0;
            while (run.step()) {
                age = run.scalar("world.age");
                EXPECT_LE(age, before + now() - last) << carrier;
            }
            // YARP's client tells states for 0.5 s. By tcp, a command waits for those before, and no state is
            // looked at meanwhile.
            EXPECT_GT(age, carrier == "udp" ? 0.1 : 0) << carrier;
            expect_contains(run.simulation.failure(), "YARP robot 'icubSim': no state for ");
            EXPECT_LT(now() - cut, soon) << carrier;
            expect_contains(says(*served, "no command"), "no command for 6 s; its joints hold");
            run.simulation.stop(); // comes back, whatever its thread waits for
            EXPECT_LT(now() - cut, soon) << carrier;
        }
        way->is_cut = false;
        Running next(driving(carrier, ", timeout: 10, silence: 20", "Position Direct", "0 0 0"));
        for (int k = 0; k < 100; ++k) {
            ASSERT_TRUE(next.step()) << carrier << ": " << next.simulation.failure();
        }
    }
}

TEST_F(YarpBadNetwork, EndsARunWhoseServerDiesOrStallsAndTheNextOneGoesOn) {
    for (const bool is_killed : {true, false}) {
        auto served = serve_by_the_clock("6");
        says(*served, "serves the robot");
        const std::string text = driving("udp", ", timeout: 10, silence: 20", "Torque", "0 -1 0");
        {
            Running run(driving("udp", ", timeout: 10, silence: 20, local: /first", "Torque", "0 -1 0"));
            for (int k = 0; k < 300; ++k) {
                ASSERT_TRUE(run.step()) << run.simulation.failure();
            }
            if (is_killed)
                served->end();
            else
                served->signal(SIGSTOP);
            const double begin = now();
            while (run.step()) ASSERT_LT(now() - begin, soon);
            expect_contains(run.simulation.failure(), "YARP robot 'icubSim': no state for ");
            run.simulation.stop();
            EXPECT_LT(now() - begin, soon);
        }
        // While there is none, or one that stands still.
        const double begin = now();
        expect_contains(refusal(middleware::test::waiting(text, "3")), "YARP robot 'icubSim': ");
        EXPECT_LT(now() - begin, soon);
        if (is_killed) {
            served = serve_by_the_clock("6");
            says(*served, "serves the robot");
        } else {
            served->signal(SIGCONT);
            // By its own watchdog, or since the run before lets them go, which comes first.
            expect_contains(says(*served, "its joints hold"), "its joints hold");
            // What the run before still waits for is answered now, and it lets the joints go.
            for (const std::string more : {"", ".1", ".2"})
                EXPECT_TRUE(is_gone("/first" + more + "/icubSim/left_leg/rpc:o"));
        }
        Running run(text);
        for (int k = 0; k < 100; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
    }
}

/// YARP still waits for an answer, in a thread, when the program ends.
TEST_F(YarpBadNetwork, LeavesNoProgramThatHangs) {
    const std::string text = driving("udp", ", timeout: 10, silence: 20", "Torque", "0 -1 0"),
                      model = write("drives.yaml", middleware::test::waiting(text, "20"));
    for (const bool is_begun : {true, false}) {
        auto served = serve_by_the_clock("6");
        says(*served, "serves the robot");
        if (!is_begun) served->signal(SIGSTOP);
        OtherProgram run({"/bin/sh", "-c", "exec \"$@\" 2>&1", "sh", BF_PROGRAM, "run", model, "--stop",
                          "600", "--quiet"});
        if (is_begun) {
            says(*served, "a controller has come");
            served->signal(SIGSTOP);
        }
        const double begin = now();
        const std::string said = says(run, "nothing of this kind"); // all that it says
        EXPECT_LT(now() - begin, 2 * soon) << said;
        expect_contains(said, "YARP robot 'icubSim': ");
        EXPECT_EQ(run.end(0), 1) << said;
    }
}

} // namespace bf::yarp::test
