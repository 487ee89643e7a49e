// What the verbs of `bf` share: blocks, models and their options.
#pragma once

#include "bf/base/run_options.hpp"
#include "bf/library/load.hpp"
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

/// Of a figure; height 0: as needed.
struct FigureSize {
    int width, height = 0; ///< pixels

    void add_to(CLI::App& app);
};

/// Which model, with which values changed.
struct ModelOptions {
    std::string file;
    std::vector<std::string> sets = {};   ///< NAME=EXPRESSION
    std::vector<std::string> params = {}; ///< YAML files of names and expressions
    bool is_quiet = false;                ///< nothing is told of a model that takes long

    void add_to(CLI::App& app, const char* what = "model file (.yaml)");
    /// What they change: --params files first, then --set. Throws model::Errors.
    std::vector<Override> overrides() const;
};

/// Reads and elaborates, with the values of --params files changed first, then those of --set options. Throws
/// model::Errors or CommandError.
LoadedModel load_model(const ModelOptions& options);

/// The same of a model that may be wrong, whose mistakes are no exception unless it cannot be read.
ExaminedModel examine_model(const ModelOptions& options);

/// The same from what a recording holds.
LoadedModel load_model(const ModelSource& source);

} // namespace bf::tools
