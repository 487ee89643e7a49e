#pragma once

#include "bf/view/drawing.hpp"

#include <vector>

namespace bf::editor {

/// What a subsystem has inside, in small: a box for each block and port, a line for each wire, within the
/// rectangle. Nothing of an empty one, of one with more blocks than can be told apart, or where there is no
/// room.
std::vector<Shape> sketch_of(const model::System& system, const Rectangle& within);

} // namespace bf::editor
