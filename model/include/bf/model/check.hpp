#pragma once

#include "bf/model/model.hpp"

namespace bf::model {

/// The deepest nesting of subsystems.
inline constexpr int max_depth = 100;

/// All that is wrong with a model's structure: names, duplicates, blocks that are nothing or two things at
/// once, connections from or to nothing, inputs fed twice, signals to record that do not exist. Ports of
/// library blocks are not known here; elaboration checks them. Referenced models are taken as checked.
std::vector<Diagnostic> check(const Model& model);

/// Whether `name` may name a block, port, plot or setting: not empty, at most 200 bytes, no '.' or '*', no
/// control character, no blank at either end.
bool is_name(std::string_view name);

} // namespace bf::model
