#pragma once

#include "bf/model/model.hpp"

namespace bf::model {

/// The deepest nesting of subsystems.
inline constexpr int max_depth = 100;

/// The largest coordinate and size of what is drawn, in pixels.
inline constexpr int max_coordinate = 1000000;

/// Whether something may be drawn there, and what to say where it may not.
bool is_drawable(const Point& at);
std::string coordinate_rule();

/// All that is wrong with a model's structure: names, duplicates, blocks that are nothing or two things at
/// once, connections from or to nothing, inputs fed twice, signals to record that do not exist, places where
/// nothing can be drawn. Ports of
/// library blocks are not known here; elaboration checks them. Referenced models are taken as checked.
std::vector<Diagnostic> check(const Model& model);

/// Whether `name` may name a block, port, plot or setting: not empty, at most 200 bytes, no '.' or '*', no
/// control character, no blank at either end.
bool is_name(std::string_view name);

} // namespace bf::model
