#include "session.hpp"

#include "bf/base/numbers.hpp"
#include "bf/base/open_file.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/formats/yaml.hpp"
#include "terminal.hpp"

namespace bf::tools {

namespace fs = std::filesystem;

namespace {

std::string check_set(const std::string& set) {
    const auto equals = set.find('=');
    if (equals != std::string::npos && equals > 0 && equals + 1 < set.size()) return {};
    return "'" + set + "' is no NAME=EXPRESSION, e.g. --set Gain.Kp=10 or --set 'q0=[1 2 3]'";
}

/// A struct has names inside: Gain: {Kp: 1} changes Gain.Kp.
void collect(const std::vector<model::Variable>& variables, const std::string& prefix,
             std::vector<ElaborateOptions::Override>& to) {
    for (const auto& variable : variables)
        if (variable.fields.empty())
            to.push_back({prefix + variable.name, variable.value.matlab(), variable.value.where});
        else
            collect(variable.fields, prefix + variable.name + ".", to);
}

std::vector<ElaborateOptions::Override> read_overrides(const ModelOptions& options) {
    std::vector<ElaborateOptions::Override> overrides;
    for (const auto& file : options.params)
        collect(formats::read_yaml_variables(read_text_file(file, std::size_t{64} << 20), file), "",
                overrides);
    for (const auto& set : options.sets)
        overrides.push_back({set.substr(0, set.find('=')), set.substr(set.find('=') + 1)});
    return overrides;
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

void ModelOptions::add_to(CLI::App& app) {
    app.add_option("MODEL", file, "model file (.yaml)")->required()->type_name("");
    app.add_option("--set", sets, "change a variable, a block's setting, step or stop; may be repeated")
        ->type_name("NAME=EXPRESSION")
        ->check(CLI::Validator(check_set, ""))
        ->allow_extra_args(false);
    app.add_option("--params", params, "YAML file of names and expressions to change; --set wins over it")
        ->type_name("FILE")
        ->allow_extra_args(false);
}

std::unique_ptr<Registry> make_registry() {
    auto registry = std::make_unique<Registry>();
    registry->add(standard_library());
    // A build has the folders of an installation; where it was built, an installation does not look.
    std::error_code no_proc; // in a bare root
    const fs::path program = fs::read_symlink("/proc/self/exe", no_proc);
    if (!no_proc) registry->add_search_path(program.parent_path().parent_path() / "lib" / "blockfactory");
    return registry;
}

namespace {

LoadedModel load(ModelSource source, const fs::path& file, ElaborateOptions options) {
    LoadedModel loaded{make_registry(), std::move(source), {}};
    options.folder = loaded.source.file.parent_path().string();
    for (const auto& [name, text, where] : options.overrides)
        loaded.source.overrides.emplace_back(name, text);
    loaded.diagram = elaborate(formats::read_yaml(file, loaded.source.texts), *loaded.registry, options);
    return loaded;
}

} // namespace

LoadedModel load_model(const ModelOptions& options) {
    const Waiting waiting("elaborating " + options.file);
    if (std::error_code error; !fs::exists(options.file, error) && !error)
        throw CommandError("there is no model file " + options.file);
    if (const auto wrong = why_unreadable(options.file); !wrong.empty())
        throw CommandError("cannot read the model " + options.file + ": " + wrong);
    return load({fs::absolute(options.file).lexically_normal(), {}, {}}, options.file,
                {read_overrides(options), {}});
}

LoadedModel load_model(const ModelSource& source) {
    const Waiting waiting("elaborating " + source.file.string());
    ElaborateOptions options;
    for (const auto& [name, text] : source.overrides) options.overrides.push_back({name, text, {}});
    LoadedModel loaded = load({source.file, source.texts, {}}, source.file, options);
    for (const auto& [file, text] : loaded.source.texts)
        if (!source.texts.contains(file)) throw CommandError(file.string() + " is not in the recording");
    return loaded;
}

void refuse_overwriting(const ModelOptions& options, const ModelSource& source, const std::string& option,
                        const std::string& file) {
    std::vector<fs::path> inputs(options.params.begin(), options.params.end());
    inputs.push_back(options.file);
    for (const auto& [path, text] : source.texts) inputs.push_back(path);
    for (const auto& input : inputs)
        if (std::error_code ignored; fs::equivalent(file, input, ignored))
            throw CommandError(option + " " + file + " is a file that the run reads; give another name");
}

} // namespace bf::tools
