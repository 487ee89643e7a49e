// bf gradient: how what a run costs changes with parameters and initial states.
#include "bf/analysis/gradient.hpp"

#include "bf/base/escape.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cstdio>

namespace bf::tools {

namespace {

struct GradientArguments {
    ModelOptions model;
    analysis::GradientOptions options;
    bool at_end = false;
};

void execute(GradientArguments& arguments) {
    if (arguments.at_end) arguments.options.over = analysis::GradientOptions::Over::end;
    const LoadedModel loaded = load_model(arguments.model);
    const auto found = analysis::gradient(loaded.diagram, arguments.options);
    std::printf("cost  %s\n", number(found.cost).c_str());
    std::size_t width = 0, values = 0;
    for (std::size_t i = 0; i < found.names.size(); ++i) {
        width = std::max(width, found.names[i].size());
        values = std::max(values, number(found.at[static_cast<Eigen::Index>(i)]).size());
    }
    std::printf("gradient, %s\n", found.is_adjoint ? "by the adjoint" : "forward");
    for (std::size_t i = 0; i < found.names.size(); ++i) {
        const std::string &name = found.names[i], at = number(found.at[static_cast<Eigen::Index>(i)]);
        std::printf("  %s%s  at %s%s  %s\n", escape::terminal(name).c_str(),
                    std::string(width - name.size(), ' ').c_str(), at.c_str(),
                    std::string(values - at.size(), ' ').c_str(),
                    number(found.slopes[static_cast<Eigen::Index>(i)]).c_str());
    }
    if (!found.differenced.empty()) {
        std::string paths;
        for (const auto& path : found.differenced) paths += (paths.empty() ? "" : ", ") + path;
        std::printf("by central differences of single calls: %s\n", escape::terminal(paths).c_str());
    }
    if (found.has_corner)
        std::printf("a jump or corner was met on the way: the gradient is that of one side\n");
}

} // namespace

void add_gradient(CLI::App& app) {
    auto* command = app.add_subcommand(
        "gradient", "how what a run costs changes with parameters and initial states, exactly");
    auto arguments = std::make_shared<GradientArguments>();
    arguments->model.add_to(*command);
    command
        ->add_option("--cost", arguments->options.cost,
                     "a signal of one element, summed over the steps, each times its length")
        ->required()
        ->type_name("SIGNAL");
    command
        ->add_option("--by", arguments->options.by,
                     "a parameter, block.parameter, an initial state, block.state, or an input of the root; "
                     "may be repeated")
        ->required()
        ->type_name("NAME")
        ->allow_extra_args(false);
    command->add_option("--duration", arguments->options.duration, "of the run")
        ->type_name("SECONDS")
        ->capture_default_str();
    command->add_flag("--at-end", arguments->at_end, "the cost is the signal's value at the end");
    command
        ->add_option_function<std::string>(
            "--way",
            [arguments](const std::string& text) {
                const auto way = analysis::way_named(text);
                if (!way) throw CLI::ValidationError("--way", "is cheaper, forward or adjoint, not " + text);
                arguments->options.way = *way;
            },
            "forward along four parameters at a time, adjoint back from the cost to all of them at once, or "
            "cheaper, whichever of both is")
        ->type_name("WAY")
        ->default_str("cheaper");
    command->footer(
        "It is the gradient of the very numbers that a run with a solver of fixed steps computes.\n"
        "Example: bf gradient loop.yaml --cost error2 --by pid.P --by pid.I --duration 5");
    command->callback([arguments] { execute(*arguments); });
}

} // namespace bf::tools
