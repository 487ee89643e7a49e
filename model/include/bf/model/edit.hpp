#pragma once

#include "bf/model/model.hpp"

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bf::model {

/// The block at a dotted path, such as `controller.pd`; null if there is none.
const Block* find(const Model& model, std::string_view path);
Block* find(Model& model, std::string_view path); ///< looks into subsystems of this document only

/// The system at a dotted path, the model's own at the empty one; null if no subsystem stands there.
const System* find_system(const Model& model, std::string_view path);
System* find_system(Model& model, std::string_view path); ///< subsystems of this document only

/// The path of `name` in the system at `system`.
std::string joined(std::string_view system, std::string_view name);

/// The system that a path lies in, and the name there: "a.b.c" -> ("a.b", "c"), "a" -> ("", "a").
std::pair<std::string, std::string> split_last(std::string_view path);

/// The subsystems in which a wire leads to `path`, as a layout names it (`controller.tau` may be an input of
/// the controller outside, and an output inside), and the state machines of which it is a transition.
std::vector<std::string> systems_with_wire(const Model& model, const std::string& path);

/// The variable of that name, or the field of a struct, `Gain.Kp`; null if there is none.
const Variable* find_variable(const std::vector<Variable>& variables, std::string_view name);

/// Calls `visit` with each block and its dotted path, parents first, in document order, through referenced
/// files.
void walk(const Model& model, const std::function<void(const std::string& path, const Block& block)>& visit);

/// Gives a block's setting a new value, adding it if it is new. Comments stay.
void set(Block& block, std::string_view setting, std::string value);

} // namespace bf::model
