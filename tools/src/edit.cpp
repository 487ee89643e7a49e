// bf edit: the page in which a model is drawn, checked, run and watched.
#include "bf/base/escape.hpp"
#include "bf/realtime/interrupt.hpp"
#include "bf/service/server.hpp"
#include "bf/service/service.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <dlfcn.h>
#include <spawn.h>
#include <unistd.h>

extern char** environ;

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct EditOptions {
    std::string file;
    std::uint16_t port = 0;
    bool no_browser = false, shows_protocol = false;
};

/// Beside the libraries of this program: a build has the folders of an installation.
fs::path page_folder() {
    Dl_info core{};
    if (::dladdr(reinterpret_cast<const void*>(&did_you_mean), &core) == 0) return {};
    return fs::path(core.dli_fname).parent_path().parent_path() / "share" / "blockfactory" / "page";
}

/// The desktop's browser, where there is a desktop.
void open_browser(const std::string& address) {
    if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
    std::string program = "xdg-open", argument = address;
    char* const arguments[] = {program.data(), argument.data(), nullptr};
    pid_t process = 0;
    static_cast<void>(::posix_spawnp(&process, program.c_str(), nullptr, nullptr, arguments, environ));
}

void execute(const EditOptions& options) {
    if (options.shows_protocol) {
        std::fputs(service::Service::typescript().c_str(), stdout);
        return;
    }
    if (options.file.empty()) throw CommandError("name the model to edit, such as docs/start/motor.yaml");
    const fs::path page = page_folder();
    if (!fs::exists(page / "index.html"))
        throw CommandError("the editor's page is not in " + page.string() +
                           "; build it with -DBF_EDITOR=ON, which needs the packages of scripts/deps");
    const InterruptGuard interrupt;
    service::Server server({.file = options.file, .page = page, .version = BF_VERSION, .port = options.port});
    std::printf("%s is open at\n  %s\nCtrl-C ends. Whoever has this address may change the model.\n",
                escape::terminal(options.file).c_str(), server.address().c_str());
    std::fflush(stdout);
    if (!options.no_browser) open_browser(server.address());
    server.run([] { return InterruptGuard::signal() == 0; });
}

} // namespace

void add_edit(CLI::App& app) {
    auto* command = app.add_subcommand("edit", "draw, check, run and watch a model in the browser");
    auto options = std::make_shared<EditOptions>();
    command->add_option("MODEL", options->file, "model file; what the page changes lands in it at once")
        ->type_name("");
    command->add_option("--port", options->port, "of 127.0.0.1; 0: any free one")
        ->type_name("PORT")
        ->capture_default_str();
    command->add_flag("--no-browser", options->no_browser, "only print the address");
    command->add_flag("--protocol", options->shows_protocol,
                      "only print what page and program say to each other, as TypeScript");
    command->footer("Example: bf edit docs/start/motor.yaml");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
