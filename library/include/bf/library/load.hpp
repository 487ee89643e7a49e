// A model with its blocks: ready to be looked at, run, recorded and generated.
#pragma once

#include "bf/codegen/generate.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/model/model.hpp"
#include "bf/run/recorder.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <vector>

namespace bf {

/// Standard blocks, and plugins from BLOCKFACTORY_PLUGIN_PATH and from beside this installation.
std::unique_ptr<Registry> make_registry();

/// An elaborated model with the registry that its blocks come from, which lives longer than its diagram.
struct LoadedModel {
    std::unique_ptr<Registry> registry;
    ModelSource source; ///< for recordings, which replay it, and for generated code that finds sizes itself
    Diagram diagram;
};

/// "Gain.Kp", "3" and where that is written: an expression for a variable, a block's setting, or the model's
/// "step", "stop", "solver", "relative_tolerance", "absolute_tolerance" or "max_step".
using Override = ElaborateOptions::Override;

/// Reads and elaborates the file with these changes; the last one of a name counts. Throws model::Errors with
/// all that is wrong, FileError when the file cannot be read. Of files of which there are `texts`, by their
/// absolute paths, these count.
LoadedModel load(const std::filesystem::path& file, const std::vector<Override>& overrides = {},
                 std::map<std::filesystem::path, std::string> texts = {});

/// What can be known of a model, right or wrong.
struct ExaminedModel : LoadedModel {
    std::vector<model::Diagnostic> diagnostics; ///< as in `Examined`; where there are some it cannot be run
};

/// As `load`, but a model that can be read and is wrong is no exception.
ExaminedModel examine(const std::filesystem::path& file, const std::vector<Override>& overrides = {});

/// The same for what a recording holds. Files that the model names and that are no models - a robot's
/// description, data - are looked for where they were. Throws FileError for a model that it lacks.
LoadedModel load(const ModelSource& source);

/// The same for a model that was edited or built, which stands for the file: what it refers to is meant from
/// there, and recordings keep its text under that name. The file is neither read nor written.
LoadedModel load(const model::Model& model, const std::filesystem::path& file,
                 const std::vector<Override>& overrides = {});

/// The same for a model that may be wrong.
ExaminedModel examine(const model::Model& model, const std::filesystem::path& file,
                      const std::vector<Override>& overrides = {});

/// The same for a model that was read from these texts, with the models of all files that it refers to, and
/// is changed as the source says.
/// `files`: the only ones that arguments may name; null: any. `registry`: has the blocks; null: that of
/// make_registry.
ExaminedModel examine(const model::Model& model, ModelSource source,
                      const std::set<std::filesystem::path>* files = nullptr,
                      std::unique_ptr<Registry> registry = nullptr);

/// The changes that a YAML file of names and expressions makes: Gain: {Kp: 1} changes Gain.Kp. Throws
/// model::Errors, FileError.
std::vector<Override> read_overrides(const std::filesystem::path& file);

/// What `codegen::generate` needs to know of a model besides its diagram: folder, texts and changes.
codegen::Options generation_options(const LoadedModel& loaded, codegen::Options options = {});

} // namespace bf
