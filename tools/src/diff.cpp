// bf diff: what differs between two models, in words and as a picture.
#include "bf/base/escape.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/compare.hpp"
#include "bf/view/draw.hpp"
#include "files.hpp"
#include "output.hpp"
#include "picture.hpp"
#include "session.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace bf::tools {

namespace {

namespace fs = std::filesystem;

struct DiffOptions {
    std::string before, after, output, system;
    bool as_json = false, is_dark = false;
};

void print_json(const std::vector<model::Distinction>& distinctions) {
    static const char* const kinds[] = {"added", "removed", "changed", "renamed"};
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const auto& d : distinctions)
        json.push_back({{"kind", kinds[static_cast<int>(d.kind)]},
                        {"path", d.path},
                        {"what", d.what},
                        {"before", d.before},
                        {"after", d.after}});
    std::fputs(to_text(json).c_str(), stdout);
}

/// The subsystem, or nothing where there is none of that path.
editor::Drawing draw(const std::string& file, const model::Model& model, const std::string& system) {
    if (!editor::may_draw(model, system)) return {};
    const ExaminedModel examined = examine_model({.file = file});
    return editor::draw(model, system, examined.diagram, examined.diagnostics);
}

void execute(const DiffOptions& options) {
    formats::Files texts;
    const model::Model before = formats::read_yaml(options.before, texts),
                       after = formats::read_yaml(options.after, texts);
    const auto distinctions = model::compare(before, after);
    if (options.as_json)
        print_json(distinctions);
    else
        for (const auto& distinction : distinctions)
            std::puts(escape::terminal(model::text_of(distinction)).c_str());
    if (!options.output.empty()) {
        refuse_overwriting({{"-o", options.output}}, {options.before, options.after});
        const std::string earlier = model::earlier_path(options.system, distinctions);
        const editor::Drawing left = draw(options.before, before, earlier),
                              right = draw(options.after, after, options.system);
        if (left.elements.empty() && right.elements.empty() && !options.system.empty())
            throw CommandError(options.system +
                               ": there is no subsystem of that path; look at the models' blocks");
        write_picture(editor::beside(left, right, distinctions, options.before, options.after),
                      options.is_dark, options.output);
    }
    if (!distinctions.empty()) throw CommandError(options.before + " and " + options.after + " differ");
}

} // namespace

void add_diff(CLI::App& app) {
    auto* command = app.add_subcommand("diff", "tell what differs between two models");
    auto options = std::make_shared<DiffOptions>();
    command->add_option("before", options->before, "model file")->required()->type_name("");
    command->add_option("after", options->after, "the later one")->required()->type_name("");
    command->add_flag("--json", options->as_json, "print as JSON");
    command
        ->add_option("-o,--output", options->output,
                     "SVG, PDF or PNG file with both side by side, what differs outlined")
        ->type_name("FILE");
    command
        ->add_option(
            "--system", options->system,
            "path of the subsystem or state machine to draw, in the later model; otherwise the model itself")
        ->needs("--output")
        ->type_name("PATH");
    command->add_flag("--dark", options->is_dark, "a picture for a dark page")->needs("--output");
    command->footer("Order of keys, comments and quotes do not count; values are compared as they are "
                    "written. The exit code is 1 if the models differ.\n"
                    "Example: git difftool --no-prompt --extcmd 'bf diff' HEAD~1 -- model.yaml");
    command->callback([options] { execute(*options); });
}

} // namespace bf::tools
