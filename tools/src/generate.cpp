// bf generate: writes a C++ project that computes what the model computes.
#include "bf/codegen/generate.hpp"
#include "session.hpp"
#include "ssp.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <set>

namespace bf::tools {

void add_generate(CLI::App& app) {
    struct GenerateOptions {
        ModelOptions model;
        std::string folder, sizes = "fixed", language;
        codegen::Options how;
    };
    auto* command =
        app.add_subcommand("generate", "write a C++ project that computes what the model computes");
    auto options = std::make_shared<GenerateOptions>();
    options->model.add_to(*command);
    command->add_option("-o,--output", options->folder, "folder of the project; must be empty or not exist")
        ->type_name("DIR")
        ->required();
    command
        ->add_option(
            "--language", options->language,
            "c++, or c: plain C11 without templates, for models of blocks that are arithmetic (c by default "
            "for --embedded, else c++)")
        ->type_name("LANGUAGE")
        ->check(CLI::IsMember(std::set<std::string>{"c++", "c"}).description(""));
    command->add_flag(
        "--embedded", options->how.embedded,
        "a library for microcontrollers: no program, heap or files; in C++ no exceptions either");
    command->add_flag(
        "--functions-per-rate", options->how.has_function_per_rate,
        "besides step() one function for each rate, for tasks of which a faster one interrupts a slower one");
    command->add_flag("--single", options->how.single, "embedded, or C: float instead of double");
    command
        ->add_option(
            "--sizes", options->sizes,
            "fixed when the code is generated, or runtime: found when the program starts (fixed by default)")
        ->type_name("WHEN")
        ->check(CLI::IsMember(std::set<std::string>{"fixed", "runtime"}).description(""));
    command->footer("Example: bf generate examples/two_rates/model.yaml -o two_rates_code");
    command->callback([options] {
        const LoadedModel loaded = load_model(options->model);
        const auto& diagram = loaded.diagram;
        options->how.has_runtime_sizes = options->sizes == "runtime";
        if (options->language.empty()) options->language = options->how.embedded ? "c" : "c++";
        if (options->language == "c") options->how.language = codegen::Language::c;
        const codegen::Options how = generation_options(loaded, options->how);
        const auto memory = codegen::memory_report(diagram, how);
        codegen::Files files = codegen::generate(diagram, how);
        for (const auto& [name, file] : fmus_of(diagram)) files["fmus/" + name] = read_text_file(file);
        codegen::write(files, options->folder);
        const char* folder = options->folder.c_str();
        std::printf("%s in %s; build it with: cmake -S %s -B %s/build && cmake --build %s/build\n",
                    codegen::class_name(diagram).c_str(), folder, folder, folder, folder);
        std::printf("memory [bytes]: inputs %zu, outputs %zu, parameters %zu, signals %zu, states %zu, "
                    "workspace %zu\n",
                    memory.inputs, memory.outputs, memory.parameters, memory.signals, memory.states,
                    memory.workspace);
        if (codegen::has_hosted_blocks(diagram) || options->how.has_runtime_sizes)
            std::printf(
                "some blocks are made at the start of the program: give CMake the installation of "
                "BlockFactory "
                "(-DCMAKE_PREFIX_PATH=PREFIX) and the program their plugins (BLOCKFACTORY_PLUGIN_PATH)\n");
    });
}

} // namespace bf::tools
