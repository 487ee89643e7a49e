// Model → Diagram: the compiler of models.
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <string>
#include <utility>
#include <vector>

namespace bf {

/// What a run changes in a model before it is elaborated.
struct ElaborateOptions {
    /// Expressions by name: a variable of the model ("Gain.Kp"), a setting of a block ("controller.pd.K"), or
    /// "step" and "stop".
    std::vector<std::pair<std::string, std::string>> overrides;
    /// Folder that relative file names in arguments refer to; the registry's blocks read it as
    /// `model_folder`.
    std::string folder;
};

/// Evaluates expressions, dissolves subsystems, makes the blocks, finds sizes, types, rates and the order.
/// Throws model::Errors with everything that is wrong, each located and with its remedy.
Diagram elaborate(const model::Model& model, Registry& registry, const ElaborateOptions& options = {});

} // namespace bf
