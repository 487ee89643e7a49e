#include "tag.hpp"

#include "item.hpp"
#include "labels.hpp"
#include "text.hpp"

#include <algorithm>

namespace bf::editor {

namespace {

constexpr double away = 10, height = 15, tip = 6, margin = 2, most = 120, beyond = 12; // to the next block

bool is_upright(model::Side side) { return side == model::Side::top || side == model::Side::bottom; }

} // namespace

std::string fitted_tag(const std::string& text, const Point& port, model::Side side,
                       const std::vector<Rectangle>& blocks) {
    double room = most;
    for (const Rectangle& block : blocks) {
        const double apart = side == model::Side::left ? port.x - block.x - block.width : block.x - port.x;
        if (is_upright(side) || apart <= 0 || block.y >= port.y + height / 2 ||
            block.y + block.height <= port.y - height / 2)
            continue;
        room = std::min(room, apart - away - beyond - 2 * (tip + margin));
    }
    return fitted(text, small_letter, room);
}

Rectangle tag_area(const Point& port, model::Side side, const std::string& text) {
    const double width = text_width(text, small_letter) + 2 * (tip + margin);
    switch (side) {
    case model::Side::left: return {port.x - away - width, port.y - height / 2, width, height};
    case model::Side::right: return {port.x + away, port.y - height / 2, width, height};
    case model::Side::top: return {port.x - width / 2, port.y - away - height, width, height};
    case model::Side::bottom: break;
    }
    return {port.x - width / 2, port.y + away, width, height};
}

void add_tag(Element& wire, const Point& port, model::Side side, bool is_source, const std::string& text) {
    const Rectangle area = tag_area(port, side, text);
    const double left = area.x, right = area.x + area.width, top = area.y, bottom = area.y + height;
    const double middle = top + height / 2;
    // Under the outline as far as its other end: where a person takes it.
    const Point far = is_upright(side) ? Point{port.x, side == model::Side::top ? top : bottom}
                                       : Point{side == model::Side::left ? left : right, port.y};
    const Rectangle all = together(area, around({far, port}));
    wire.bounds = wire.shapes.empty() ? all : together(wire.bounds, all);
    wire.shapes.push_back({Shape::Kind::line, Style::wire, {far, port}});
    Shape outline{
        Shape::Kind::polygon, Style::body, {{left, top}, {right, top}, {right, bottom}, {left, bottom}}};
    // The signal leaves a source and its label, and enters an end: away from the one, towards the other.
    const bool points_left = (side == model::Side::left) == is_source;
    if (!is_upright(side) && points_left)
        outline.points = {
            {right, top}, {left + tip, top}, {left, middle}, {left + tip, bottom}, {right, bottom}};
    else if (!is_upright(side))
        outline.points = {
            {left, top}, {right - tip, top}, {right, middle}, {right - tip, bottom}, {left, bottom}};
    wire.shapes.push_back(std::move(outline));
    wire.shapes.push_back({Shape::Kind::text,
                           Style::label,
                           {{left + area.width / 2, middle + small_letter / 3}},
                           text,
                           small_letter,
                           Align::middle});
}

} // namespace bf::editor
