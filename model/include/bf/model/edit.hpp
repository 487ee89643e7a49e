#pragma once

#include "bf/model/model.hpp"

#include <functional>

namespace bf::model {

/// The block at a dotted path, such as `controller.pd`; null if there is none.
const Block* find(const Model& model, std::string_view path);
Block* find(Model& model, std::string_view path); ///< looks into subsystems of this document only

/// Calls `visit` with each block and its dotted path, parents first, in document order, through referenced
/// files.
void walk(const Model& model, const std::function<void(const std::string& path, const Block& block)>& visit);

/// Gives a block's setting a new value, adding it if it is new. Comments stay.
void set(Block& block, std::string_view setting, std::string value);

} // namespace bf::model
