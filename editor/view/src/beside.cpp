#include "bf/view/draw.hpp"

#include "bf/model/edit.hpp"
#include "text.hpp"

#include <algorithm>
#include <map>

namespace bf::editor {

void outline(Element& element, Style style) {
    if (element.kind == Element::Kind::wire) {
        element.shapes[0].style = style;
        return;
    }
    constexpr double gap = 4;
    const Rectangle& r = element.bounds;
    const double left = r.x - gap, right = r.x + r.width + gap, top = r.y - gap,
                 bottom = r.y + r.height + gap;
    element.shapes.push_back(
        {Shape::Kind::polygon, style, {{left, top}, {right, top}, {right, bottom}, {left, bottom}}});
}

namespace {

using Kind = model::Distinction::Kind;

void shift(Drawing& drawing, double dx, double dy) {
    const auto move = [&](Point& point) { point = {point.x + dx, point.y + dy}; };
    for (Element& element : drawing.elements) {
        element.bounds.x += dx;
        element.bounds.y += dy;
        for (Shape& shape : element.shapes)
            for (Point& point : shape.points) move(point);
        for (Port& port : element.ports) move(port.at);
        for (Point& corner : element.corners) move(corner);
    }
    drawing.bounds.x += dx;
    drawing.bounds.y += dy;
}

/// How elements of one of the models are outlined, by their path; of wires, by "wire " and their path.
using Outlines = std::map<std::string, Style>;

Outlines outlines_of(const std::vector<model::Distinction>& distinctions, Kind there) {
    Outlines outlines;
    for (const auto& d : distinctions) {
        const bool is_whole = d.kind == Kind::added || d.kind == Kind::removed;
        if (d.what == "wire" || (is_whole && d.what.empty())) {
            const Style style = d.kind == Kind::added ? Style::added : Style::removed;
            if (d.kind == there) outlines[(d.what.empty() ? "" : "wire ") + d.path] = style;
        } else {
            outlines.emplace(d.path, Style::changed);
        }
        for (std::string path = d.system; !path.empty(); path = model::split_last(path).first)
            outlines.emplace(path, Style::changed);
    }
    return outlines;
}

void outline(Drawing& drawing, const Outlines& outlines) {
    for (Element& element : drawing.elements) {
        const bool is_wire = element.kind == Element::Kind::wire;
        const auto found = outlines.find((is_wire ? "wire " : "") + element.path);
        if (found != outlines.end()) editor::outline(element, found->second);
    }
}

constexpr double title_size = 15;

Element title(const std::string& text, const Drawing& above) {
    constexpr double distance = 24;
    const Point at{above.bounds.x, above.bounds.y - distance};
    return {.kind = Element::Kind::note,
            .path = {},
            .bounds = {at.x, at.y - title_size, text_width(text, title_size), title_size},
            .shapes = {{Shape::Kind::text, Style::name, {at}, text, title_size}},
            .title = text};
}

} // namespace

Drawing beside(Drawing before, Drawing after, const std::vector<model::Distinction>& distinctions,
               const std::string& before_title, const std::string& after_title) {
    auto earlier = distinctions;
    for (auto& d : earlier) {
        d.path = model::earlier_path(d.path, distinctions);
        d.system = model::earlier_path(d.system, distinctions);
    }
    outline(before, outlines_of(earlier, Kind::removed));
    outline(after, outlines_of(distinctions, Kind::added));
    constexpr double gap = 80;
    const double width = std::max(before.bounds.width, text_width(before_title, title_size));
    shift(after, before.bounds.x + width + gap - after.bounds.x, before.bounds.y - after.bounds.y);
    Drawing both;
    both.system = after.system;
    both.rates = after.rates;
    both.elements = {title(before_title, before), title(after_title, after)};
    for (const Drawing* one : {&before, &after})
        both.elements.insert(both.elements.end(), one->elements.begin(), one->elements.end());
    const double top = both.elements[0].bounds.y;
    both.bounds = {before.bounds.x, top,
                   after.bounds.x + std::max(after.bounds.width, both.elements[1].bounds.width) -
                       before.bounds.x,
                   std::max(before.bounds.height, after.bounds.height) + before.bounds.y - top};
    return both;
}

} // namespace bf::editor
