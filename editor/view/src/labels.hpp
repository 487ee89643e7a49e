// What is drawn of wires, and where texts stand beside them.
#pragma once

#include "bf/view/place.hpp"

#include <string>
#include <vector>

namespace bf::editor {

/// One text for each way, of horizontal and vertical pieces; empty texts stand nowhere.
struct Labelled {
    std::vector<Point> way;
    std::string text;
};

/// The rectangle of points.
Rectangle around(const std::vector<Point>& points);
Rectangle together(const Rectangle& a, const Rectangle& b);
bool overlap(const Rectangle& a, const Rectangle& b);

/// A wire that leaves another one of its net is drawn from there on.
std::vector<Point> own_part(const Route& way);

/// Where the rectangle around a text is.
Rectangle extent(const Shape& text);

/// The text of each way beside it, where it begins as far as that is free: on no box, on no other text and on
/// no wire where the way has such a place. In the order of the ways.
std::vector<Shape> place_labels(const std::vector<Labelled>& ways, const std::vector<Rectangle>& boxes);

/// Above the first level piece of a wire that has room for the text, else above the longest one; beneath what
/// runs back, since names of blocks stand above that.
Shape label_along(const std::vector<Point>& way, const std::string& text);

} // namespace bf::editor
