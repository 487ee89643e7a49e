#include "session.hpp"

#include "bf/blocks/standard.hpp"
#include "bf/formats/yaml.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <yaml-cpp/yaml.h>

namespace bf::tools {

namespace fs = std::filesystem;

void ModelOptions::add_to(CLI::App& app) {
    app.add_option("model", file, "model file (.yaml)")->required();
    app.add_option("--set", sets, "change a variable, a block's setting, step or stop: NAME=EXPRESSION")->type_name("NAME=VALUE");
    app.add_option("--params", params, "YAML file of names and expressions")->type_name("FILE");
}

std::unique_ptr<Registry> make_registry() {
    auto registry = std::make_unique<Registry>();
    registry->add(standard_library());
    registry->add_search_path(BF_PLUGIN_DIRECTORY);
    const fs::path program = fs::read_symlink("/proc/self/exe");
    registry->add_search_path(program.parent_path().parent_path() / "lib" / "blockfactory");
    return registry;
}

namespace {

/// A value of a parameter file as an expression: sequences are rows, sequences of sequences matrices.
std::string expression_of(const YAML::Node& node, bool nested = false) {
    if (node.IsScalar()) return node.Tag() == "!" && !nested ? node.Scalar() : node.Scalar();
    std::string text;
    const bool is_matrix = node.size() > 0 && node[0].IsSequence();
    for (const auto& item : node) text += (text.empty() ? "" : is_matrix ? "; " : ", ") + expression_of(item, true);
    return nested ? text : "[" + text + "]";
}

void collect(const YAML::Node& node, const std::string& prefix, std::vector<std::pair<std::string, std::string>>& to) {
    for (const auto& entry : node) {
        const std::string name = prefix + entry.first.as<std::string>();
        if (entry.second.IsMap()) collect(entry.second, name + ".", to);
        else to.emplace_back(name, expression_of(entry.second));
    }
}

} // namespace

std::vector<std::pair<std::string, std::string>> read_overrides(const ModelOptions& options) {
    std::vector<std::pair<std::string, std::string>> overrides;
    for (const auto& file : options.params) {
        try {
            const YAML::Node node = YAML::Load(read_file(file));
            if (!node.IsMap()) throw CommandError(file + ": a parameter file is a map of names and values, e.g. 'Gain: {Kp: 10}'");
            collect(node, "", overrides);
        } catch (const YAML::Exception& error) {
            throw CommandError(file + ":" + std::to_string(error.mark.line + 1) + ":" + std::to_string(error.mark.column + 1) + ": " + error.msg);
        }
    }
    for (const auto& set : options.sets) {
        const auto equals = set.find('=');
        if (equals == std::string::npos || equals == 0)
            throw CommandError("--set " + set + ": write NAME=EXPRESSION, e.g. --set Gain.Kp=10");
        overrides.emplace_back(set.substr(0, equals), set.substr(equals + 1));
    }
    return overrides;
}

LoadedModel load_model(const ModelOptions& options, std::vector<std::pair<std::string, std::string>> extra) {
    if (!fs::exists(options.file)) throw CommandError("there is no model file " + options.file);
    LoadedModel loaded{make_registry(), read_file(options.file), {}};
    ElaborateOptions elaborate_options;
    elaborate_options.overrides = read_overrides(options);
    elaborate_options.overrides.insert(elaborate_options.overrides.end(), extra.begin(), extra.end());
    elaborate_options.folder = fs::absolute(options.file).parent_path().string();
    loaded.diagram = elaborate(formats::read_yaml(options.file), *loaded.registry, elaborate_options);
    return loaded;
}

std::string read_file(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw CommandError("cannot read " + file.string() + ": " + std::strerror(errno));
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

void write_file(const fs::path& file, const std::string& text) {
    if (file.has_parent_path()) fs::create_directories(file.parent_path());
    fs::path temporary = file;
    temporary += ".part";
    std::ofstream stream(temporary, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) {
        const std::string reason = std::strerror(errno);
        std::error_code ignored;
        fs::remove(temporary, ignored);
        throw CommandError("cannot write " + file.string() + ": " + reason);
    }
    fs::rename(temporary, file);
}

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", x);
    return text;
}

} // namespace bf::tools
