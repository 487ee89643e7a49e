// bf trim: an operating point of a model.
#include "bf/analysis/trim.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"
#include "bf/run/snapshot.hpp"
#include "files.hpp"
#include "session.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace bf::tools {

namespace {

struct TrimArguments {
    ModelOptions model;
    std::vector<std::string> free, hold, target, bound;
    std::string output;
};

double number_in(const std::string& option, const std::string& text, const std::string& number) {
    std::size_t end = 0;
    double value = 0;
    try {
        value = std::stod(number, &end);
    } catch (const std::exception&) {
    }
    if (end != number.size() || number.empty() || std::isnan(value))
        throw CommandError(option + " " + text + " has no number where it needs one; write NAME=" +
                           (option == "--bound" ? "LOWER:UPPER, of which one may be left out" : "VALUE"));
    return value;
}

/// "NAME=TEXT".
std::pair<std::string, std::string> parts_of(const std::string& option, const std::string& text) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0) number_in(option, text, "");
    return {text.substr(0, equals), text.substr(equals + 1)};
}

std::vector<analysis::NamedNumber> numbers_of(const std::string& option,
                                              const std::vector<std::string>& texts) {
    std::vector<analysis::NamedNumber> all;
    for (const auto& text : texts) {
        const auto [name, value] = parts_of(option, text);
        all.emplace_back(name, number_in(option, text, value));
    }
    return all;
}

void execute(const TrimArguments& arguments) {
    analysis::TrimOptions options{.free = arguments.free,
                                  .hold = numbers_of("--hold", arguments.hold),
                                  .target = numbers_of("--target", arguments.target)};
    for (const auto& text : arguments.bound) {
        const auto [name, range] = parts_of("--bound", text);
        const auto colon = range.find(':');
        if (colon == std::string::npos || range.size() == 1) number_in("--bound", text, "");
        analysis::TrimOptions::Bounds bounds{.name = name};
        if (colon > 0) bounds.lower = number_in("--bound", text, range.substr(0, colon));
        if (colon + 1 < range.size()) bounds.upper = number_in("--bound", text, range.substr(colon + 1));
        options.bounds.push_back(std::move(bounds));
    }
    const LoadedModel loaded = load_model(arguments.model);
    if (!arguments.output.empty()) refuse_overwriting({{"-o", arguments.output}}, files_of(loaded));
    Simulation run(loaded.diagram);
    run.start();
    const auto found = analysis::trim(run, options);
    std::size_t width = 0;
    for (const auto* list : {&found.free, &found.residuals})
        for (const auto& [name, value] : *list) width = std::max(width, name.size());
    const auto print = [&](const char* title, const std::vector<analysis::NamedNumber>& list) {
        std::printf("%s\n", title);
        for (const auto& [name, value] : list)
            std::printf("  %s%s  %s\n", escape::terminal(name).c_str(),
                        std::string(width - name.size(), ' ').c_str(), number(value).c_str());
    };
    print("found", found.free);
    print("residuals", found.residuals);
    for (const auto& what : found.held) std::fprintf(stderr, "held: %s\n", escape::terminal(what).c_str());
    if (arguments.output.empty()) return;
    OutputFile file(arguments.output);
    const auto bytes = make_snapshot(run);
    std::ofstream out(file.path(), std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) throw CommandError("cannot write " + arguments.output + ": the disk is full or gone");
    file.commit();
    std::printf("%s\n", arguments.output.c_str());
}

} // namespace

void add_trim(CLI::App& app) {
    auto* command = app.add_subcommand(
        "trim", "find an operating point of a model: states and inputs at which nothing moves");
    auto arguments = std::make_shared<TrimArguments>();
    arguments->model.add_to(*command);
    const auto add = [&](const char* name, std::vector<std::string>& to, const char* what, const char* type) {
        command->add_option(name, to, what)->type_name(type)->allow_extra_args(false);
    };
    add("--free", arguments->free, "an input of the root that may change; states may, too; may be repeated",
        "INPUT");
    add("--hold", arguments->hold, "a state, block.state, or an input that keeps this value", "NAME=VALUE");
    add("--target", arguments->target, "a signal that shall have this value", "SIGNAL=VALUE");
    add("--bound", arguments->bound, "limits of a free input or of a state; one of them may be left out",
        "NAME=LOWER:UPPER");
    command->add_option("-o,--output", arguments->output, "snapshot there, for --from-snapshot")
        ->type_name("FILE");
    command->footer(
        "As many numbers are free as there are equations: each state rests, and each target holds.\n"
        "Example: bf trim pendulum.yaml --free u --target angle=0.5 --bound u=-10:10 -o held.snapshot");
    command->callback([arguments] { execute(*arguments); });
}

} // namespace bf::tools
