// What the verbs of `bf` share: blocks, models and their options.
#pragma once

#include "bf/base/run_options.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/run/recorder.hpp"
#include "output.hpp"

#include <CLI/CLI.hpp>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf::tools {

/// Ends the command with this text on standard error and exit code 1.
struct CommandError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Accepts a number of these as every program of ours does; NaN is none.
CLI::Validator within(const OptionRange& range);
CLI::Validator between(double low, double high);

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
    ModelSource source;
    Diagram diagram;
};

/// Standard blocks, and plugins from BLOCKFACTORY_PLUGIN_PATH and the installation.
std::unique_ptr<Registry> make_registry();

/// Reads and elaborates, with the values of --params files changed first, then those of --set options. Throws
/// model::Errors or CommandError.
LoadedModel load_model(const ModelOptions& options);

/// The same from what a recording holds. Files that the model names and that are no models - a robot's
/// description, data - are looked for where they were.
LoadedModel load_model(const ModelSource& source);

/// Throws CommandError if the file of this option is one that the model is read from, which writing would
/// replace.
void refuse_overwriting(const ModelOptions& options, const ModelSource& source, const std::string& option,
                        const std::string& file);

} // namespace bf::tools
