#include "committed.hpp"

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <optional>
#include <set>
#include <spawn.h>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

extern char** environ;

namespace bf::service {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t largest_file = 64 << 20; ///< bytes, as of a file that is read

/// What a program prints, where it ends with 0. `arguments` begin with its name.
std::optional<std::string> printed(std::vector<std::string> arguments) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return {};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    pid_t child = 0;
    const int problem = ::posix_spawnp(&child, pointers[0], &actions, nullptr, pointers.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    std::string text;
    std::array<char, 65536> part{};
    ssize_t count = 0;
    while (problem == 0 && text.size() <= largest_file) {
        count = ::read(ends[0], part.data(), part.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) break;
        text.append(part.data(), static_cast<std::size_t>(count));
    }
    ::close(ends[0]); // which ends a program that prints more
    if (problem != 0) return {};
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (count != 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0) return {};
    return text;
}

/// The blob as it is: no filter, hook or program that a repository names is run, nor one that would fetch an
/// object that a partial clone lacks.
std::optional<std::string> blob(const fs::path& file) {
    return printed({"env", "GIT_ALLOW_PROTOCOL=none", "git", "-C", file.parent_path().string(), "cat-file",
                    "blob", "HEAD:./" + file.filename().string()});
}

/// Why there is no blob of the file, and what to do about it.
std::string why_not(const fs::path& file) {
    const std::string other = "compare with another file", name = "'" + file.filename().string() + "'",
                      folder = file.parent_path().string();
    if (!printed({"git", "--version"}))
        return "git is not installed, which knows the last commit of " + name + "; install it, or " + other;
    if (!printed({"git", "-C", folder, "rev-parse", "--git-dir"}))
        return "the folder '" + folder + "' of " + name + " is in no git repository; " + other;
    return "git has no last commit of " + name + "; commit it, or " + other;
}

} // namespace

model::Model committed(const fs::path& file) {
    const fs::path opened = fs::absolute(file).lexically_normal();
    const auto text = blob(opened);
    if (!text) throw std::runtime_error(why_not(opened));
    formats::Files texts{{opened, *text}};
    std::set<fs::path> asked{opened};
    for (;;) { // what it refers to is known once it is read
        formats::Files read = texts;
        model::Model model = formats::read_yaml(opened, read);
        bool is_more = false;
        for (const auto& [other, now] : read)
            if (asked.insert(other).second) {
                is_more = true;
                texts[other] = blob(other).value_or(now);
            }
        if (!is_more) return model;
    }
}

} // namespace bf::service
