// Where texts stand beside the wires of a chart.
#pragma once

#include "bf/view/drawing.hpp"

#include <string>
#include <vector>

namespace bf::editor {

/// One text for each way, of horizontal and vertical pieces; empty texts stand nowhere.
struct Labelled {
    std::vector<Point> way;
    std::string text;
};

/// Where the rectangle around a text is.
Rectangle extent(const Shape& text);

/// The text of each way beside it, where it begins as far as that is free: on no box, on no other text and on
/// no wire where the way has such a place. In the order of the ways.
std::vector<Shape> place_labels(const std::vector<Labelled>& ways, const std::vector<Rectangle>& boxes);

} // namespace bf::editor
