#include "gnuplot.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <spawn.h>
#include <stdexcept>
#include <sys/wait.h>

extern char** environ;

namespace bf::recording {
namespace {

struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using TemporaryFile = std::unique_ptr<std::FILE, Close>;

TemporaryFile temporary_file() {
    TemporaryFile file(std::tmpfile());
    if (!file)
        throw std::runtime_error(std::string("cannot make a temporary file for gnuplot: ") +
                                 std::strerror(errno));
    return file;
}

} // namespace

// Files instead of pipes: neither side can wait for the other, and a gnuplot that dies early raises no
// SIGPIPE.
std::string run_gnuplot(const std::string& script) {
    const TemporaryFile input = temporary_file(), errors = temporary_file();
    if (std::fwrite(script.data(), 1, script.size(), input.get()) != script.size() ||
        std::fflush(input.get()) != 0)
        throw std::runtime_error(std::string("cannot write the script for gnuplot: ") + std::strerror(errno));
    std::rewind(input.get());

    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, ::fileno(input.get()), 0);
    ::posix_spawn_file_actions_adddup2(&actions, ::fileno(errors.get()), 1);
    ::posix_spawn_file_actions_adddup2(&actions, ::fileno(errors.get()), 2);
    char program[] = "gnuplot", no_settings[] = "-d"; // a user's own settings do not change our figures
    char* const arguments[] = {program, no_settings, nullptr};
    pid_t child = 0;
    const int error = ::posix_spawnp(&child, program, &actions, nullptr, arguments, environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (error != 0)
        throw std::runtime_error(std::string("cannot run gnuplot, which draws the figures: ") +
                                 std::strerror(error) +
                                 "; install it (Debian: gnuplot-nox) or add its folder to PATH");

    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
    std::rewind(errors.get());
    std::string text;
    char line[256];
    while (std::fgets(line, sizeof line, errors.get())) text += line;
    return text.empty() ? "it ended without a message" : text;
}

} // namespace bf::recording
