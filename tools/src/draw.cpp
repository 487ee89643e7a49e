// bf draw: a picture of a model, without a browser.
#include "bf/view/draw.hpp"
#include "bf/base/escape.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"
#include "files.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <spawn.h>
#include <sys/wait.h>

extern char** environ;

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct PictureOptions {
    ModelOptions model;
    std::string output, system;
    std::vector<std::string> show;
    bool is_dark = false, draws_all = false;
};

/// SVG as another format, by librsvg.
void convert(const fs::path& svg, const fs::path& output, const std::string& format) {
    std::vector<std::string> words = {"rsvg-convert", "-f", format, "-o", output, svg};
    if (format == "png") words.insert(words.end() - 1, {"-z", "2"});
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_t child = 0;
    int status = 0;
    if (::posix_spawnp(&child, "rsvg-convert", nullptr, nullptr, arguments.data(), environ) != 0)
        throw CommandError(
            "rsvg-convert is missing, which makes PDF and PNG; apt install librsvg2-bin, or give a name "
            "that ends in .svg");
    if (::waitpid(child, &status, 0) != child || status != 0)
        throw CommandError("rsvg-convert failed; give a name that ends in .svg");
}

void write(const std::string& svg, const std::string& file) {
    const std::string format = fs::path(file).extension().string();
    OutputFile output(file);
    if (format == ".svg" || file == "/dev/stdout") {
        output.write(svg);
    } else if (format == ".pdf" || format == ".png") {
        const fs::path beside = output.path().string() + ".svg";
        OutputFile picture(beside);
        picture.write(svg);
        picture.commit();
        try {
            convert(beside, output.path(), format.substr(1));
        } catch (...) {
            fs::remove(beside);
            throw;
        }
        fs::remove(beside);
    } else {
        throw CommandError("cannot tell the format of " + file +
                           ": give a name that ends in .svg, .pdf or .png");
    }
    output.commit();
    if (file != "/dev/stdout") std::printf("%s\n", file.c_str());
}

void execute(const PictureOptions& options) {
    const ExaminedModel examined = examine_model(options.model);
    formats::Files texts = examined.source.texts;
    const model::Model model = formats::read_yaml(examined.source.file, texts);
    editor::DrawOptions show;
    for (const auto& what : options.show) {
        show.sizes |= what == "sizes";
        show.types |= what == "types";
        show.rates |= what == "rates";
        show.units |= what == "units";
    }
    const std::string output =
        !options.output.empty() ? options.output
                                : fs::path(options.model.file).replace_extension(".svg").filename().string();
    const auto draw = [&](const std::string& system, const std::string& file) {
        refuse_overwriting({{"-o", file}}, {options.model.file});
        write(editor::to_svg(editor::draw(model, system, examined.diagram, examined.diagnostics, show),
                             options.is_dark),
              file);
    };
    draw(options.system, output);
    if (options.draws_all)
        model::walk(model, [&](const std::string& path, const model::Block& block) {
            if (!block.is_subsystem() || !block.content()) return;
            const fs::path name = output;
            draw(path, (name.parent_path() / (name.stem().string() + "_" + path + name.extension().string()))
                           .string());
        });
    if (!examined.diagnostics.empty()) throw model::Errors(examined.diagnostics);
}

} // namespace

void add_draw(CLI::App& app) {
    auto* command = app.add_subcommand("draw", "draw a model as a picture");
    auto options = std::make_shared<PictureOptions>();
    options->model.add_to(*command);
    command
        ->add_option("-o,--output", options->output,
                     "SVG, PDF or PNG file; otherwise MODEL.svg in this folder")
        ->type_name("FILE");
    command
        ->add_option("--system", options->system, "path of the subsystem to draw; otherwise the model itself")
        ->type_name("PATH");
    command->add_option("--show", options->show, "what stands beside wires: sizes, types, rates, units")
        ->delimiter(',')
        ->check(CLI::IsMember({"sizes", "types", "rates", "units"}).description(""))
        ->type_name("WHAT,...");
    command->add_flag("--dark", options->is_dark, "for a dark page");
    command->add_flag("--all", options->draws_all, "a file for each subsystem, too: FILE_controller.svg");
    command->footer("A wrong model is drawn with its mistakes marked. Example: bf draw docs/start/motor.yaml "
                    "--show sizes,rates");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
