// bf draw: a picture of a model, without a browser.
#include "bf/view/draw.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"
#include "files.hpp"
#include "picture.hpp"
#include "session.hpp"
#include "verbs.hpp"

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

struct PictureOptions {
    ModelOptions model;
    std::string output, system;
    std::vector<std::string> show;
    bool is_dark = false, draws_all = false;
};

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
        write_picture(editor::draw(model, system, examined.diagram, examined.diagnostics, show),
                      options.is_dark, file);
    };
    draw(options.system, output);
    if (options.draws_all)
        model::walk(model, [&](const std::string& path, const model::Block& block) {
            if (!block.content() && !model::has_chart(block)) return;
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
        ->add_option("--system", options->system,
                     "path of the subsystem or state machine to draw; otherwise the model itself")
        ->type_name("PATH");
    command->add_option("--show", options->show, "what stands beside wires: sizes, types, rates, units")
        ->delimiter(',')
        ->check(CLI::IsMember({"sizes", "types", "rates", "units"}).description(""))
        ->type_name("WHAT,...");
    command->add_flag("--dark", options->is_dark, "for a dark page");
    command->add_flag("--all", options->draws_all,
                      "a file for each subsystem and state machine, too: FILE_controller.svg");
    command->footer("A wrong model is drawn with its mistakes marked. Example: bf draw docs/start/motor.yaml "
                    "--show sizes,rates");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
