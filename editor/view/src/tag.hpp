// Labels that stand for a wire.
#pragma once

#include "bf/view/drawing.hpp"

#include <string>
#include <vector>

namespace bf::editor {

/// The text, as far as there is room for a label from its port to the next one of the blocks.
std::string fitted_tag(const std::string& text, const Point& port, model::Side side,
                       const std::vector<Rectangle>& blocks);

/// Where the label of a wire stands: outside of a port on that side of its block.
Rectangle tag_area(const Point& port, model::Side side, const std::string& text);

/// Adds it to the wire at one of its ends, and a line that joins it to the port; the wire's bounds grow
/// around both. Its tip shows where the signal goes.
void add_tag(Element& wire, const Point& port, model::Side side, bool is_source, const std::string& text);

} // namespace bf::editor
