// bf generate: writes a C++ project that computes what the model computes.
#include "bf/codegen/generate.hpp"
#include "session.hpp"
#include "verbs.hpp"

#include <cstdio>

namespace bf::tools {

void add_generate(CLI::App& app) {
    struct GenerateOptions {
        ModelOptions model;
        std::string folder;
    };
    auto* command =
        app.add_subcommand("generate", "write a C++ project that computes what the model computes");
    auto options = std::make_shared<GenerateOptions>();
    options->model.add_to(*command);
    command->add_option("-o,--output", options->folder, "folder of the project; must be empty or not exist")
        ->type_name("DIR")
        ->required();
    command->footer("Example: bf generate examples/two_rates/model.yaml -o two_rates_code");
    command->callback([options] {
        const LoadedModel loaded = load_model(options->model);
        codegen::Options how;
        how.folder = std::filesystem::absolute(options->model.file).parent_path().string();
        codegen::write(codegen::generate(loaded.diagram, how), options->folder);
        std::printf("%s in %s; build it with: cmake -S %s -B %s/build && cmake --build %s/build\n",
                    codegen::class_name(loaded.diagram).c_str(), options->folder.c_str(),
                    options->folder.c_str(), options->folder.c_str(), options->folder.c_str());
    });
}

} // namespace bf::tools
