// Other programs, and files for them.
#pragma once

#include <chrono>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <map>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <string>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace bf::middleware::test {

/// For the files of a test.
struct Folder {
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(path / name) << text;
        return path / name;
    }
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("bf_middleware_test_" + std::to_string(getpid()));
};

/// Where another program runs.
struct ProgramOptions {
    std::map<std::string, std::string> variables = {}; ///< of its environment, beside ours
    int network = -1;                                  ///< -1: ours
};

/// Another program, which is ended by force, and with the test at the latest.
class Program {
  public:
    explicit Program(std::vector<std::string> words, const ProgramOptions& options = {}) {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) != 0) return;
        process_ = fork();
        if (process_ == 0) {
            prctl(PR_SET_PDEATHSIG, SIGKILL);
            if (options.network >= 0) setns(options.network, CLONE_NEWNET);
            dup2(ends[1], STDOUT_FILENO);
            for (const auto& [name, value] : options.variables) setenv(name.c_str(), value.c_str(), 1);
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
            const auto count = ::read(out_, bytes, sizeof bytes);
            if (count <= 0) return "";
            text_.append(bytes, static_cast<std::size_t>(count));
        }
    }

  private:
    pid_t process_ = 0;
    int out_ = -1;
    std::string text_;
};

/// What it says next, while steps are done until it has, or until they fail.
inline std::string line_while(Program& program, const std::function<bool()>& step) {
    auto line = std::async(std::launch::async, [&] { return program.line(); });
    while (line.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready && step()) continue;
    return line.get();
}

} // namespace bf::middleware::test
