// Programs of ROS 2 that are not ours, and the network that the tests have for themselves.
#pragma once

#include "own_network.hpp"

#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <string>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace bf::ros2::test {

/// What tests of ROS 2 derive from.
class Alone : public ::testing::Test {
  protected:
    void SetUp() override {
        static const bool is_alone = middleware::test::enter_network_of_our_own();
        if (!is_alone) GTEST_SKIP() << "this system gives a program no network of its own";
    }
};

/// For the files of a test.
struct Folder {
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(path / name) << text;
        return path / name;
    }
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("bf_ros2_test_" + std::to_string(getpid()));
};

/// Another program, which is ended by force; in another network where one is given.
class Program {
  public:
    explicit Program(std::vector<std::string> words, int network = -1) {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0) return;
        process_ = fork();
        if (process_ == 0) {
            prctl(PR_SET_PDEATHSIG, SIGKILL); // it does not outlive a test that is ended
            if (network >= 0) setns(network, CLONE_NEWNET);
            dup2(ends[1], STDOUT_FILENO);
            setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", network >= 0 ? "SUBNET" : "LOCALHOST", 1);
            setenv("AMENT_PREFIX_PATH", BF_ROS2_MESSAGES ":" BF_ROS2_PREFIX, 1);
            setenv("PYTHONPATH", BF_ROS2_MESSAGES "/lib/python3.11/site-packages", 1);
            std::vector<char*> arguments;
            for (auto& word : words) arguments.push_back(word.data());
            arguments.push_back(nullptr);
            execv(arguments.front(), arguments.data());
            _exit(127);
        }
        close(ends[1]);
        out_ = ends[0];
    }
    ~Program() {
        end();
        close(out_);
    }
    void signal(int which) const { kill(process_, which); }
    /// Its exit code; -1: it has none.
    int end(int signal = SIGKILL) {
        if (process_ <= 0) return -1;
        kill(process_, signal);
        int status = 0;
        waitpid(process_, &status, 0);
        process_ = 0;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    /// What it prints next; empty when it has ended, or says nothing for a minute.
    std::string line() {
        for (;;) {
            if (const auto newline = text_.find('\n'); newline != std::string::npos) {
                const std::string first = text_.substr(0, newline);
                text_.erase(0, newline + 1);
                return first;
            }
            pollfd waits{out_, POLLIN, 0};
            char bytes[4096];
            if (poll(&waits, 1, 60'000) != 1) return "";
            const auto count = read(out_, bytes, sizeof bytes);
            if (count <= 0) return "";
            text_.append(bytes, static_cast<std::size_t>(count));
        }
    }

  private:
    pid_t process_ = 0;
    int out_ = -1;
    std::string text_;
};

/// test/peer.py. Its verbs are said there.
class Peer : public Program {
  public:
    explicit Peer(std::vector<std::string> words, int network = -1)
        : Program(with_python(std::move(words)), network) {}
    static bool is_there() { return access(BF_ROS2_PREFIX "/lib/python3.11/site-packages/rclpy", R_OK) == 0; }

  private:
    static std::vector<std::string> with_python(std::vector<std::string> words) {
        words.insert(words.begin(),
                     {BF_ROS2_PREFIX "/bin/python", BF_SOURCE_DIRECTORY "/middleware/ros2/test/peer.py"});
        return words;
    }
};

} // namespace bf::ros2::test
