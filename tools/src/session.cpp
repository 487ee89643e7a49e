#include "session.hpp"

#include "bf/base/numbers.hpp"
#include "bf/base/open_file.hpp"
#include "ssp.hpp"
#include "terminal.hpp"

#include <optional>

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

std::string check_set(const std::string& set) {
    const auto equals = set.find('=');
    if (equals != std::string::npos && equals > 0 && equals + 1 < set.size()) return {};
    return "'" + set + "' is no NAME=EXPRESSION, e.g. --set Gain.Kp=10 or --set 'q0=[1 2 3]'";
}

} // namespace

CLI::Validator within(const OptionRange& range) {
    return CLI::Validator(
        [range](std::string& text) -> std::string {
            double value = 0;
            std::string wrong = read_option(text, range, value);
            if (wrong.empty()) text = number_text(value); // as the option's type reads it
            return wrong;
        },
        "");
}
CLI::Validator between(double low, double high) { return within({low, high}); }

void FigureSize::add_to(CLI::App& app) {
    app.add_option("--width", width, "pixels")
        ->check(between(100, 20000))
        ->type_name("PIXELS")
        ->capture_default_str();
    app.add_option("--height", height, "pixels; 0: as needed")
        ->check(between(0, 20000))
        ->type_name("PIXELS")
        ->capture_default_str();
}

void ModelOptions::add_to(CLI::App& app, const char* what) {
    app.add_option("MODEL", file, what)->required()->type_name("");
    app.add_option("--set", sets,
                   "change a variable, a block's setting, or the model's step, stop, solver, "
                   "relative_tolerance, absolute_tolerance or max_step; may be repeated")
        ->type_name("NAME=EXPRESSION")
        ->check(CLI::Validator(check_set, ""))
        ->allow_extra_args(false);
    app.add_option("--params", params, "YAML file of names and expressions to change; --set wins over it")
        ->type_name("FILE")
        ->allow_extra_args(false);
}

std::vector<Override> ModelOptions::overrides() const {
    std::vector<Override> all;
    for (const auto& file : params)
        for (auto& override : read_overrides(file)) all.push_back(std::move(override));
    for (const auto& set : sets) all.push_back({set.substr(0, set.find('=')), set.substr(set.find('=') + 1)});
    return all;
}

ExaminedModel examine_model(const ModelOptions& options) {
    std::optional<Waiting> waiting;
    if (!options.is_quiet) waiting.emplace("elaborating " + options.file);
    if (std::error_code error; !fs::exists(options.file, error) && !error)
        throw CommandError("there is no model file " + options.file);
    if (const auto wrong = why_unreadable(options.file); !wrong.empty())
        throw CommandError("cannot read the model " + options.file + ": " + wrong);
    const auto overrides = options.overrides();
    return is_system(options.file) ? examine(open_system(options.file, overrides), options.file, overrides)
                                   : examine(options.file, overrides);
}

LoadedModel load_model(const ModelOptions& options) {
    ExaminedModel found = examine_model(options);
    if (!found.diagnostics.empty()) throw model::Errors(std::move(found.diagnostics));
    return found;
}

LoadedModel load_model(const ModelSource& source) {
    const Waiting waiting("elaborating " + source.file.string());
    return load(source);
}

} // namespace bf::tools
