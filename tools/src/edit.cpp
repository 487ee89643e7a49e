// bf edit: the page in which a model is drawn, checked, run and watched.
#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/realtime/interrupt.hpp"
#include "bf/service/server.hpp"
#include "bf/service/service.hpp"
#include "files.hpp"
#include "scenery.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cstdio>
#include <spawn.h>
#include <unistd.h>

extern char** environ;

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct EditOptions {
    std::string file = ".", attach;
    std::uint16_t port = 0;
    bool no_browser = false, shows_protocol = false, is_new = false;
};

/// The desktop's browser, where there is a desktop.
void open_browser(const std::string& address) {
    if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
    std::string program = "xdg-open", argument = address;
    char* const arguments[] = {program.data(), argument.data(), nullptr};
    pid_t process = 0;
    static_cast<void>(::posix_spawnp(&process, program.c_str(), nullptr, nullptr, arguments, environ));
}

/// The first model of a folder, or the file itself.
fs::path found_model(const fs::path& place) {
    if (!fs::is_directory(place)) return place;
    std::vector<fs::path> models;
    for (const auto& entry : fs::directory_iterator(place))
        if (entry.path().extension() == ".yaml") models.push_back(entry.path());
    if (models.empty())
        throw CommandError("there is no model in the folder '" + place.string() + "'; bf edit --new " +
                           (place / "model.yaml").lexically_normal().string() + " makes one");
    return *std::min_element(models.begin(), models.end());
}

fs::path made_model(const fs::path& file) {
    if (file.extension() != ".yaml") throw CommandError("--new takes the name of a file that ends in .yaml");
    model::Model model{.name = file.stem().string()};
    model.step = {"0.001"};
    model.stop = {"10"};
    OutputFile output(file);
    output.write(formats::write_yaml(model));
    if (!output.commit_over({}))
        throw CommandError("the file '" + file.string() + "' exists; leave out --new to edit it");
    return file;
}

void execute(const EditOptions& options) {
    if (options.shows_protocol) {
        std::fputs(service::Service::typescript().c_str(), stdout);
        return;
    }
    const fs::path model = options.is_new ? made_model(options.file) : found_model(options.file);
    const fs::path page = shared_folder("page");
    if (!fs::exists(page / "index.html"))
        throw CommandError("the editor's page is not in " + page.string() +
                           "; build it with -DBF_EDITOR=ON, which needs the packages of scripts/deps");
    const InterruptGuard interrupt;
    service::Server server({.file = model,
                            .page = page,
                            .version = BF_VERSION,
                            .port = options.port,
                            .sceneries = scenery_maker(),
                            .attach = options.attach});
    std::printf("%s is open at\n  %s\nCtrl-C ends. Whoever has this address may change the model.\n",
                escape::terminal(model.string()).c_str(), server.address().c_str());
    std::fflush(stdout);
    if (!options.no_browser) open_browser(server.address());
    const std::string lost = server.run([] { return InterruptGuard::signal() == 0; });
    if (!lost.empty()) throw CommandError(lost);
}

} // namespace

void add_edit(CLI::App& app) {
    auto* command = app.add_subcommand("edit", "draw, check, run and watch a model in the browser");
    auto options = std::make_shared<EditOptions>();
    command
        ->add_option(
            "MODEL", options->file,
            "model file, or folder of models; what the page changes lands in the file at once; otherwise "
            "this folder")
        ->type_name("");
    command->add_flag("--new", options->is_new, "make the file first, an empty model");
    command->add_option("--port", options->port, "of 127.0.0.1; 0: any free one")
        ->type_name("PORT")
        ->capture_default_str();
    command
        ->add_option("--attach", options->attach,
                     "watch, tune, start and stop a program that runs the model, instead of simulating it: "
                     "the address "
                     "that bf run --realtime --serve or a generated program printed")
        ->type_name("ADDRESS");
    command->add_flag("--no-browser", options->no_browser, "only print the address");
    command->add_flag("--protocol", options->shows_protocol,
                      "only print what page and program say to each other, as TypeScript");
    command->footer("Example: bf edit docs/start/motor.yaml");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
