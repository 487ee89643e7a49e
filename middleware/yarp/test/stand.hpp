// A network of YARP for a test: its name server, and programs of it and ours, which are ended by force.
#pragma once

#include "alone.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <vector>

namespace bf::yarp::test {

/// A program, of YARP unless its name has a slash. What it says goes to files of that name.
class Program {
  public:
    explicit Program(std::vector<std::string> words, const std::string& says = "/dev/null") {
        if (words.front().find('/') == std::string::npos)
            words.front() = BF_YARP_PREFIX "/bin/" + words.front();
        fflush(stdout);
        process_ = fork();
        if (process_ != 0) return;
        prctl(PR_SET_PDEATHSIG, SIGKILL); // it does not outlive a test that is ended
        if (freopen(says.c_str(), "a", stdout) == nullptr || freopen(says.c_str(), "a", stderr) == nullptr)
            _exit(1);
        std::vector<char*> arguments;
        for (auto& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        execv(arguments.front(), arguments.data());
        _exit(127);
    }
    Program(Program&& other) noexcept : process_(std::exchange(other.process_, 0)) {}
    ~Program() { end(); }
    void end() {
        if (process_ <= 0) return;
        kill(process_, SIGKILL);
        waitpid(process_, nullptr, 0);
        process_ = 0;
    }
    void halt() const { kill(process_, SIGSTOP); }
    void interrupt() const { kill(process_, SIGINT); }
    /// Its exit code.
    int wait() {
        int status = -1;
        waitpid(process_, &status, 0);
        process_ = 0;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }

    /// Has it ended well, within that many s? One that has not ended goes on.
    bool ends_well(double patience) {
        int status = -1;
        for (int tries = 0; tries < patience * 100; ++tries, usleep(10'000))
            if (waitpid(process_, &status, WNOHANG) == process_) {
                process_ = 0;
                return WIFEXITED(status) && WEXITSTATUS(status) == 0;
            }
        return false;
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
    /// Whether a port is there, as YARP's own program says.
    static bool is_there(const std::string& port) {
        for (int tries = 0; tries < 100; ++tries, usleep(50'000))
            if (Program({"yarp", "exists", port}).wait() == 0) return true;
        return false;
    }
    std::string write(const std::string& file, const std::string& text) const {
        std::ofstream(folder_ / file) << text;
        return folder_ / file;
    }
    std::string read(const std::string& file) const {
        std::ifstream in(folder_ / file);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::filesystem::path folder_;
};

} // namespace bf::yarp::test
