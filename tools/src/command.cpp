#include "command.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/names.hpp"
#include "bf/base/open_file.hpp"
#include "bf/base/run_options.hpp"
#include "bf/model/location.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>
#include <sys/resource.h>
#include <vector>

namespace bf::tools {

namespace {

std::vector<std::string> verbs_of(const CLI::App& app) {
    std::vector<std::string> verbs;
    for (const auto* verb : app.get_subcommands({})) verbs.push_back(verb->get_name());
    return verbs;
}

/// What CLI11 says, and what was probably meant.
std::string usage_error(const CLI::App* app, const CLI::Error& error) {
    const CLI::App* asked = app;
    for (const auto* verb : app->get_subcommands()) asked = verb;
    std::string text = error.what(), hint, verbs;
    std::vector<std::string> options;
    for (const auto* option : asked->get_options())
        for (const auto& name : option->get_lnames()) options.push_back("--" + name);
    for (const auto& word : asked->remaining())
        if (word.starts_with("--")) hint += did_you_mean(word, options);
    if (asked != app) return "bf: " + text + hint + "\nSee bf " + asked->get_name() + " --help\n";
    for (const auto& verb : verbs_of(*app)) verbs += (verbs.empty() ? "" : ", ") + verb;
    for (const auto& word : app->remaining())
        if (!word.starts_with("-")) {
            text = "there is no verb '" + word + "'";
            hint = did_you_mean(word, verbs_of(*app));
            break;
        }
    return "bf: " + text + hint + "\nThe verbs are " + verbs + "; bf --help tells more\n";
}

/// Which folders code is taken from is for the user to say, on the command line or in the environment, and
/// never for a document.
void add_plugin_path(CLI::App& verb) {
    verb.add_option_function<std::vector<std::string>>(
            "--plugin-path",
            [](const std::vector<std::string>& folders) {
                const char* variable = "BLOCKFACTORY_PLUGIN_PATH";
                std::string path;
                for (const auto& folder : folders) path += folder + ":";
                if (const char* before = std::getenv(variable)) path += before;
                ::setenv(variable, path.c_str(), 1);
            },
            "folder where plugins are looked for before those of BLOCKFACTORY_PLUGIN_PATH; may be repeated")
        ->check(CLI::ExistingDirectory.description(""))
        ->type_name("FOLDER")
        ->allow_extra_args(false);
}

/// A shell's empty variable must not mean that an option was not given. The option with an empty value, or
/// "".
std::string empty_option_of(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i], before = argv[i - 1];
        if (word.empty() && before.starts_with("-")) return before;
        if (word.starts_with("--") && word.find('=') == word.size() - 1)
            return word.substr(0, word.size() - 1);
    }
    return "";
}

/// What the standard library says of a file, in our words.
std::string text_of_file_error(const std::filesystem::filesystem_error& error) {
    std::error_code gone;
    static_cast<void>(std::filesystem::current_path(gone));
    if (gone && !error.path1().is_absolute())
        return "the current folder is not there any more; change to another one";
    return "cannot use " + error.path1().string() + ": " + write_error(error.code().value());
}

/// Libraries of middlewares that can open no socket more abort or wait for ever, so a limit that is lower
/// than what they need is raised. False: it cannot be.
bool may_open_files() {
    constexpr rlim_t needed = 256;
    rlimit files{};
    if (::getrlimit(RLIMIT_NOFILE, &files) != 0 || files.rlim_cur >= needed) return true;
    files.rlim_cur = std::min(files.rlim_max, needed);
    return ::setrlimit(RLIMIT_NOFILE, &files) == 0 && files.rlim_cur == needed;
}

int exit_code(CLI::App& app, int argc, char** argv) {
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const model::Errors& errors) {
        const auto count = errors.diagnostics().size();
        std::fprintf(stderr, "%s\n", escape::terminal(errors.what()).c_str());
        if (count > 1) std::fprintf(stderr, "%zu errors\n", count);
        return 1;
    } catch (const Interrupted& interrupted) {
        std::fprintf(stderr, "bf: %s\n", escape::terminal(interrupted.what()).c_str());
        return 128 + interrupted.signal;
    } catch (const std::filesystem::filesystem_error& error) {
        std::fprintf(stderr, "bf: %s\n", escape::terminal(text_of_file_error(error)).c_str());
        return 1;
    } catch (const std::bad_alloc&) {
        std::fprintf(stderr, "bf: there is not enough memory; free some, or raise its limit\n");
        return 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bf: %s\n", escape::terminal(error.what()).c_str());
        return 1;
    }
    return 0;
}

} // namespace

int command(int argc, char** argv) {
    occupy_standard_streams();
    std::signal(SIGXFSZ, SIG_IGN); // writing past a limit on the size of files fails with a message instead
    if (!may_open_files()) {
        std::fprintf(stderr, "bf: %s\n", file_error(EMFILE).c_str());
        return 1;
    }
    CLI::App app{"BlockFactory: design, simulate and run robot controllers as block diagrams", "bf"};
    app.require_subcommand(1);
    app.set_version_flag("--version", "bf " BF_VERSION, "print the version");
    app.set_help_flag("-h,--help", "print this help");
    app.get_formatter()->column_width(34);
    app.failure_message(usage_error);
    app.footer(
        "bf VERB --help tells more. Exit codes: 0 success, 1 failure, 2 wrong usage, 130 interrupted; an "
        "interrupt is how bf edit and bf view end in order.\n"
        "Example: bf run examples/icub_balancing/balancing.yaml --stop 5");
    for (const auto add :
         {add_run,    add_replay,   add_sweep,       add_check,      add_describe,   add_plot,
          add_film,   add_export,   add_generate,    add_export_fmu, add_export_ssp, add_check_fmu,
          add_deploy, add_draw,     add_diff,        add_linearize,  add_responses,  add_frequency_response,
          add_trim,   add_gradient, add_sensitivity, add_edit,       add_view,       add_publish,
          add_serve,  add_tune,     add_doctor})
        add(app);
    for (auto* verb : app.get_subcommands({}))
        if (verb->get_name() != "plot" && verb->get_name() != "export") add_plugin_path(*verb);
    if (const std::string option = empty_option_of(argc, argv); !option.empty()) {
        std::fprintf(stderr, "bf: %s: %s\n", escape::terminal(option).c_str(), empty_option);
        return 2;
    }
    const int code = exit_code(app, argc, argv);
    show_warnings();
    if (std::fflush(stdout) != 0 || std::ferror(stdout)) {
        std::fprintf(stderr, "bf: cannot write the standard output: %s\n", std::strerror(errno));
        return code ? code : 1;
    }
    return code;
}

} // namespace bf::tools
