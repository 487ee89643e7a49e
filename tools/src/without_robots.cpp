#include "robots.hpp"
#include "scenery.hpp"
#include "session.hpp"
#include "verbs.hpp"

namespace bf::tools {

std::filesystem::path urdf_of(const Resolution&) { return {}; }

service::MakeSceneries scenery_maker() { return {}; }

void add_film(CLI::App& app) {
    auto* command = app.add_subcommand("film", "render a recording of a physics world: not in this build");
    command->allow_extras()->callback([] {
        throw CommandError("bf was built without robots; build it with BF_ROBOTS=ON to render films");
    });
}

} // namespace bf::tools
