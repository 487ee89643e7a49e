// bf check-fmu: what is wrong with an FMU, of whatever tool.
#include "bf/fmi/check.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bf::tools {

namespace {

namespace fs = std::filesystem;

struct CheckFmuOptions {
    std::string file;
    double timeout = 60;
    bool runs_nothing = false;
};

/// What the process of the FMU says, a line each: '>' what it does next, '-' a problem, '.' that it did all.
std::vector<std::string> let_run(const fs::path& file, double timeout) {
    const fmi::TemporaryFolder folder("check"); // around what the process leaves behind where it is killed
    void* const page = ::mmap(nullptr, fmi::LocalInstance::longest_name, PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    int ends[2];
    if (page == MAP_FAILED || ::pipe(ends) != 0)
        throw CommandError(std::string("cannot check the FMU: ") + std::strerror(errno));
    auto* const function = static_cast<char*>(page); // that is being called
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
        ::close(ends[0]);
        ::prctl(PR_SET_PDEATHSIG, SIGKILL); // nobody waits for it where the check is ended
        fmi::UnderWay::leave_to_others();
        ::setenv("TMPDIR", folder.path().c_str(), 1);
        const auto say = [&](char mark, const std::string& text) {
            if (mark == '>') function[0] = '\0'; // of what was done before
            std::string line = mark + text;
            std::replace(line.begin() + 1, line.end(), '\n', ' ');
            line += '\n';
            [[maybe_unused]] const bool is_said = ::write(ends[1], line.data(), line.size()) > 0;
        };
        try {
            const fmi::Description d = fmi::description_of(file);
            const double step =
                (d.co_simulation ? d.co_simulation->internal_step : d.step).value_or(d.step.value_or(0.01));
            for (const auto kind : {fmi::Kind::co_simulation, fmi::Kind::model_exchange}) {
                const bool steps = kind == fmi::Kind::co_simulation;
                if (!(steps ? d.co_simulation : d.model_exchange)) continue;
                const std::string of = d.co_simulation && d.model_exchange
                                           ? (steps ? " in co-simulation" : " in model exchange")
                                           : "";
                say('>', "its opening" + of);
                const fmi::Library library(file, kind);
                for (const auto& name : library.missing()) say('-', "its library lacks the function " + name);
                for (const auto& problem : fmi::problems_of_run(
                         library, step, [&](const std::string& what) { say('>', what + of); }, function))
                    say('-', problem + of);
            }
            say('>', "its closing");
            say('.', "");
        } catch (const std::exception& error) {
            say('-', error.what());
            say('.', "");
        }
        ::_exit(0);
    }
    ::close(ends[1]);
    std::string text;
    bool is_late = child < 0;
    for (char part[4096]; !is_late;) {
        pollfd waits{ends[0], POLLIN, 0};
        const int ready = ::poll(&waits, 1, static_cast<int>(1000 * timeout));
        if (ready < 0 && errno == EINTR) continue;
        if (ready <= 0) {
            is_late = true;
            ::kill(child, SIGKILL);
            break;
        }
        const auto count = ::read(ends[0], part, sizeof part);
        if (count <= 0) break;
        text.append(part, static_cast<std::size_t>(count));
    }
    ::close(ends[0]);
    int status = 0;
    while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    std::vector<std::string> problems;
    std::string doing = "its opening";
    bool is_complete = false;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        if (text[at] == '.')
            is_complete = true;
        else if (text[at] == '>')
            doing = text.substr(at + 1, end - at - 1);
        else if (std::string problem = text.substr(at + 1, end - at - 1);
                 std::find(problems.begin(), problems.end(), problem) == problems.end())
            problems.push_back(std::move(problem));
        at = end + 1;
    }
    function[fmi::LocalInstance::longest_name - 1] = '\0';
    const std::string its = function[0] ? function : "it";
    ::munmap(page, fmi::LocalInstance::longest_name);
    if (is_late)
        problems.push_back(its + " did not return within " + number(timeout) + " s, at " + doing);
    else if (WIFSIGNALED(status))
        problems.push_back(its + " crashed (" + ::strsignal(WTERMSIG(status)) + "), at " + doing);
    else if (!is_complete || WEXITSTATUS(status) != 0)
        problems.push_back(its + " ended the process, at " + doing);
    return problems;
}

void execute(const CheckFmuOptions& options) {
    const fmi::Description d = fmi::description_of(options.file);
    std::vector<std::string> problems = fmi::problems_of(d);
    {
        const fmi::TemporaryFolder folder("check");
        fmi::extract(options.file, folder.path());
        for (auto& problem : fmi::problems_of_terminals(folder.path(), options.file, d))
            problems.push_back(std::move(problem));
    }
    if (!options.runs_nothing) {
        const Waiting waiting("running " + options.file);
        for (auto& problem : let_run(options.file, options.timeout)) problems.push_back(std::move(problem));
    }
    const auto needs_tool = [](const auto& interface) { return interface && interface->needs_tool; };
    std::printf("%s: FMI %d.0, %s, %zu variables%s%s\n", options.file.c_str(), d.version,
                d.co_simulation && d.model_exchange ? "co-simulation and model exchange"
                : d.co_simulation                   ? "co-simulation"
                                                    : "model exchange",
                d.variables.size(),
                needs_tool(d.co_simulation) || needs_tool(d.model_exchange) ? ", needs the tool that made it"
                                                                            : "",
                problems.empty() ? "; nothing is wrong" : "");
    if (problems.empty()) return;
    std::string text = options.file + ": " + std::to_string(problems.size()) +
                       (problems.size() == 1 ? " thing is wrong" : " things are wrong");
    for (const auto& problem : problems) text += "\n  " + problem;
    throw CommandError(text);
}

} // namespace

void add_check_fmu(CLI::App& app) {
    auto* command = app.add_subcommand("check-fmu", "find out what is wrong with an FMU");
    auto options = std::make_shared<CheckFmuOptions>();
    command->add_option("FMU", options->file, "file of an FMU (.fmu), of whatever tool")
        ->required()
        ->type_name("");
    command->add_option("--timeout", options->timeout, "s that one function may take (60 by default)")
        ->type_name("S")
        ->check(between(0.001, 1e6));
    command->add_flag("--description-only", options->runs_nothing, "run nothing of it");
    command->footer(
        "It runs the FMU, which is a program, in a process of its own. Exit code 1: something is wrong.\n"
        "Example: bf check-fmu controller.fmu");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
