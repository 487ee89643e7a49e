// bf edit, bf view: the page in which a model is drawn, checked, run and watched, and what of it stands in
// space.
#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/realtime/interrupt.hpp"
#include "bf/run/replay.hpp"
#include "bf/service/server.hpp"
#include "bf/service/service.hpp"
#include "files.hpp"
#include "robots.hpp"
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

struct PageOptions {
    std::uint16_t port = 0;
    bool no_browser = false;

    void add_to(CLI::App& app) {
        app.add_option("--port", port, "of 127.0.0.1; 0: any free one")
            ->type_name("PORT")
            ->capture_default_str();
        app.add_flag("--no-browser", no_browser, "only print the address");
    }
};

struct EditOptions : PageOptions {
    std::string file = ".", attach;
    bool shows_protocol = false, is_new = false;
};

struct ViewOptions : PageOptions {
    std::string file;
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

/// Until Ctrl-C. `part` is what of the page is shown, of `name`; `about` tells what an address is good for.
void serve(service::ServerOptions served, const PageOptions& options, const std::string& name,
           const char* part, const char* about) {
    served.page = shared_folder("page");
    if (!fs::exists(served.page / "index.html"))
        throw CommandError("the editor's page is not in " + served.page.string() +
                           "; build it with -DBF_EDITOR=ON, which needs the packages of scripts/deps");
    served.version = BF_VERSION;
    served.port = options.port;
    served.sceneries = scenery_maker();
    const InterruptGuard interrupt;
    service::Server server(served);
    const std::string address = server.address() + part;
    std::printf("%s is open at\n  %s\nCtrl-C ends. %s\n", escape::terminal(name).c_str(), address.c_str(),
                about);
    std::fflush(stdout);
    if (!options.no_browser) open_browser(address);
    const std::string lost = server.run([] { return InterruptGuard::signal() == 0; });
    if (!lost.empty()) throw CommandError(lost);
}

void execute(const EditOptions& options) {
    if (options.shows_protocol) {
        std::fputs(service::Service::typescript().c_str(), stdout);
        return;
    }
    const fs::path model = options.is_new ? made_model(options.file) : found_model(options.file);
    serve({.file = model, .page = {}, .version = {}, .attach = options.attach}, options, model.string(), "",
          "Whoever has this address may change the model.");
}

/// The page shows the mistakes of a wrong model.
void refuse_without_world(const Diagram& diagram) {
    if (!has_world(diagram))
        throw CommandError(diagram.name + " has no MujocoWorld or World block: there is nothing to look at");
}

void execute(const ViewOptions& options) {
    service::ServerOptions served;
    if (is_recording(options.file)) {
        if (!fs::exists(options.file)) throw CommandError("there is no recording " + options.file);
        refuse_without_world(load_model(recorded_source(load_recording(options.file))).diagram);
        served.recording = options.file;
    } else {
        served.file = found_model(options.file);
        const auto examined = examine_model({.file = served.file.string()});
        if (examined.diagnostics.empty()) refuse_without_world(examined.diagram);
    }
    serve(std::move(served), options, options.file, "#view", "Whoever has this address may look.");
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
    options->add_to(*command);
    command
        ->add_option("--attach", options->attach,
                     "watch, tune, start and stop a program that runs the model, instead of simulating it: "
                     "the address that bf run --realtime --serve or a generated program printed")
        ->type_name("ADDRESS");
    command->add_flag("--protocol", options->shows_protocol,
                      "only print what page and program say to each other, as TypeScript");
    command->footer("Example: bf edit docs/start/motor.yaml");
    command->callback([options] { execute(*options); });
}

void add_view(CLI::App& app) {
    auto* command = app.add_subcommand(
        "view", "show the robots of a recording, or of a model that runs, in three dimensions");
    auto options = std::make_shared<ViewOptions>();
    command
        ->add_option("FILE", options->file,
                     "MCAP file that bf run wrote, to be played; or model file, which runs as in bf edit")
        ->required()
        ->type_name("");
    options->add_to(*command);
    command->footer("A recording is shown with the model that it holds. Of a MujocoWorld it must have w_H_b "
                    "and s, of a World q.\n"
                    "Examples:\n"
                    "  bf view run.mcap\n"
                    "  bf view examples/two_robots/model.yaml");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
