#include "bundle.hpp"
#include "model_parameters.hpp"
#include "robots.hpp"
#include "scenery.hpp"
#include "session.hpp"
#include "tune_loop.hpp"
#include "verbs.hpp"

namespace bf::tools {

std::filesystem::path urdf_of(const Resolution&) { return {}; }

bool has_world(const Diagram&) { return false; }

std::vector<std::filesystem::path> world_files_of(const Diagram&) { return {}; }

service::MakeSceneries scenery_maker() { return {}; }

std::unique_ptr<ModelParameters> serve_parameters(const std::string&, const std::string&, const LoadedModel&,
                                                  Simulation&, Recorder*) {
    throw CommandError("bf was built without robots and their middlewares; build it with BF_ROBOTS=ON to "
                       "show parameters to ROS");
}

namespace {

void add_missing(CLI::App& app, const char* verb, const std::string& what, const std::string& purpose) {
    app.add_subcommand(verb, what + ": not in this build")->allow_extras()->callback([purpose] {
        throw CommandError("bf was built without robots; build it with BF_ROBOTS=ON to " + purpose);
    });
}

} // namespace

void add_film(CLI::App& app) {
    add_missing(app, "film", "render recordings of physics worlds", "render films");
}
void add_serve(CLI::App& app) {
    add_missing(app, "serve", "let other programs drive the robots of a model", "serve robots");
}
void add_tune(CLI::App& app) {
    auto* command = app.add_subcommand(
        "tune", "find gains of a loop of a model; those of robots' joints: not in this build");
    auto options = std::make_shared<LoopTuning>();
    options->add_to(*command, "model file (.yaml)");
    command->get_option("--loop")->required();
    command->footer(loop_example);
    command->callback([options] { options->execute(); });
}

} // namespace bf::tools
