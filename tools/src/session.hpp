// What the verbs of `bf` share: blocks, models, options, output.
#pragma once

#include "bf/elaborate/elaborate.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bf::tools {

/// Ends the command with this text on standard error and exit code 1.
struct CommandError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Which model, with which values changed.
struct ModelOptions {
    std::string file;
    std::vector<std::string> sets;   ///< NAME=EXPRESSION
    std::vector<std::string> params; ///< YAML files of names and expressions

    void add_to(CLI::App& app);
};

/// A model with the registry that its blocks come from.
struct LoadedModel {
    std::unique_ptr<Registry> registry;
    std::string text; ///< of the file
    Diagram diagram;
};

/// Standard blocks, and plugins from BLOCKFACTORY_PLUGIN_PATH and the installation.
std::unique_ptr<Registry> make_registry();

/// Reads and elaborates; throws model::Errors or CommandError.
LoadedModel load_model(const ModelOptions& options, std::vector<std::pair<std::string, std::string>> extra = {});

/// NAME=EXPRESSION pairs of --params files and --set options, in this order of precedence.
std::vector<std::pair<std::string, std::string>> read_overrides(const ModelOptions& options);

/// The whole file; throws CommandError with the reason.
std::string read_file(const std::filesystem::path& file);
/// Writes through a temporary file, so that nothing half-written stays behind.
void write_file(const std::filesystem::path& file, const std::string& text);

/// 0.0123, 1234.5: six significant digits.
std::string number(double x);

} // namespace bf::tools
