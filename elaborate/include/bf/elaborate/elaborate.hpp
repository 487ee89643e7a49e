// Model → Diagram: the compiler of models.
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace bf {

/// What a run changes in a model before it is elaborated.
struct ElaborateOptions {
    /// An expression for a variable of the model ("Gain.Kp"), a setting of a block ("controller.pd.K"),
    /// "step" or "stop"; `where` it is written, for messages. The last one of a name counts.
    struct Override {
        std::string name, text;
        model::Location where = {};
    };
    std::vector<Override> overrides;
    /// Folder that relative file names in arguments refer to; the registry's blocks read it as
    /// `model_folder`.
    std::string folder;
    /// The only files that arguments may name (see named_files), of a model that somebody sends; null: any.
    const std::set<std::filesystem::path>* files = nullptr;
};

/// Files, no folders, that texts among the arguments name, where there are such.
std::set<std::filesystem::path> named_files(const Arguments& arguments);

/// What elaboration finds out about a model, right or wrong.
struct Examined {
    /// Of a wrong model: the blocks that can be made, their wires, and the sizes, types, rates and order that
    /// are determined all the same. What is not known of a size or a type says so in its slot, a rate that is
    /// not known is -1. It cannot be run.
    Diagram diagram;
    /// What is wrong, located and with its remedy, in the order of the document; what stands in no file comes
    /// last.
    std::vector<model::Diagnostic> diagnostics;
};

/// As `elaborate`, but tells of a wrong model, too, what can be known.
Examined examine(const model::Model& model, Registry& registry, const ElaborateOptions& options = {});

/// Evaluates expressions, dissolves subsystems, makes the blocks, finds sizes, types, rates and the order.
/// Throws model::Errors with everything that is wrong, each located and with its remedy.
Diagram elaborate(const model::Model& model, Registry& registry, const ElaborateOptions& options = {});

} // namespace bf
