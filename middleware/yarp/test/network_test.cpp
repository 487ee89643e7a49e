// A diagram drives boards of another program, which a name server knows.
#include "alone.hpp"
#include "running.hpp"

#include <csignal>
#include <sys/wait.h>

namespace bf::yarp::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

/// A program of YARP, which is ended by force.
class Program {
  public:
    explicit Program(std::vector<std::string> words) {
        words.front() = std::string(BF_YARP_PREFIX "/bin/") + words.front();
        fflush(stdout);
        process_ = fork();
        if (process_ != 0) return;
        if (freopen("/dev/null", "w", stdout) == nullptr || freopen("/dev/null", "w", stderr) == nullptr)
            _exit(1);
        std::vector<char*> arguments;
        for (auto& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        execv(arguments.front(), arguments.data());
        _exit(127);
    }
    ~Program() { end(); }
    void end() {
        if (process_ <= 0) return;
        kill(process_, SIGKILL);
        waitpid(process_, nullptr, 0);
        process_ = 0;
    }
    /// Its exit code.
    int wait() {
        int status = -1;
        waitpid(process_, &status, 0);
        process_ = 0;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }

  private:
    pid_t process_ = 0;
};

class YarpNetwork : public Alone {
  protected:
    void SetUp() override {
        Alone::SetUp();
        if (IsSkipped()) return;
        folder_ = std::filesystem::temp_directory_path() / ("bf_yarp_" + std::to_string(getpid()));
        std::filesystem::create_directories(folder_);
        setenv("YARP_CONFIG_HOME", folder_.c_str(), 1);
        setenv("YARP_DATA_HOME", folder_.c_str(), 1);
        std::ofstream(folder_ / "yarp.conf") << "127.0.0.1 10000 yarp\n";
    }
    void TearDown() override {
        if (!folder_.empty()) std::filesystem::remove_all(folder_);
    }
    static Program name_server() {
        return Program({"yarpserver", "--ip", "127.0.0.1", "--socket", "10000", "--read"});
    }
    Program boards() const {
        std::ofstream(folder_ / "leg.ini")
            << "device controlboardwrapper2\nsubdevice fakeMotionControl\nname "
               "/icubSim/left_leg\nperiod 5\n[GENERAL]\nJoints 3\n"
               "AxisName hip knee ankle\n";
        return Program({"yarpdev", "--from", folder_ / "leg.ini"});
    }
    /// Whether a port is there, as YARP's own program says.
    static bool is_there(const std::string& port) {
        for (int tries = 0; tries < 100; ++tries, usleep(50'000))
            if (Program({"yarp", "exists", port}).wait() == 0) return true;
        return false;
    }

  private:
    std::filesystem::path folder_;
};

const std::string robot =
    "model: m\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.005\ninputs: {u: {shape: 3}}\nblocks:\n"
    "  robot: {block: Yarp/Robot, boards: \"{'left_leg'}\", joints: \"{'ankle', 'hip', 'knee'}\", "
    "start_timeout: 20, silence: 5}\n"
    "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
    "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Position Direct}\n"
    "connections: {u: drive}\n";

} // namespace

TEST_F(YarpNetwork, LeadsToBoardsOfAnotherProgramUntilTheyAreKilled) {
    expect_contains(refusal(robot), "no YARP name server answers within 5 s; start yarpserver");
    const auto server = name_server();
    ASSERT_TRUE(is_there("/root"));
    expect_contains(refusal(robot),
                    "robot: YARP robot 'icubSim': there is no control board at /icubSim/left_leg");
    auto leg = boards();
    ASSERT_TRUE(is_there("/icubSim/left_leg/stateExt:o"));
    Running run(robot);
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

} // namespace bf::yarp::test
