// A model around one block.
#pragma once

#include "session.hpp"

namespace bf::tools {

/// The block whose type is `options.file`, "Gain" or "WholeBodyToolbox/RPYToRotation", as a model of that
/// name whose inputs and outputs are those of the block. Values given by name are its arguments and
/// parameters, the shapes of its inputs, or the model's step, stop and solver (0.01 s, rk4). Throws
/// PluginError, model::Errors.
LoadedModel block_as_model(const ModelOptions& options);

} // namespace bf::tools
