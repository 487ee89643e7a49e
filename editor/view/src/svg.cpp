#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"
#include "bf/view/draw.hpp"
#include "bf/view/image.hpp"
#include "bf/view/theme.hpp"

#include <cmath>

namespace bf::editor {

const char* name(Style style) {
    static const char* const names[] = {"body",      "symbol", "value",   "name",   "port",
                                        "open",      "wire",   "branch",  "label",  "note",
                                        "highlight", "added",  "removed", "changed"};
    return names[static_cast<int>(style)];
}

namespace {

/// Tenths of a pixel are enough.
std::string text_of(double x) { return number_text(std::round(x * 10) / 10 + 0.0); }

std::string points_of(const Shape& shape) {
    std::string text;
    for (const Point& point : shape.points)
        text += (text.empty() ? "" : " ") + text_of(point.x) + "," + text_of(point.y);
    return text;
}

std::string curve_of(const Shape& shape) {
    std::string text;
    for (std::size_t i = 0; i < shape.points.size(); ++i)
        text += (i == 0   ? "M"
                 : i == 1 ? " C"
                          : " ") +
                text_of(shape.points[i].x) + "," + text_of(shape.points[i].y);
    return text;
}

std::string shape_text(const Shape& shape) {
    const std::string kind = " class=\"" + std::string(name(shape.style)) + "\"";
    if (shape.points.empty()) return "";
    switch (shape.kind) {
    case Shape::Kind::polygon: return "<polygon" + kind + " points=\"" + points_of(shape) + "\"/>\n";
    case Shape::Kind::line: return "<polyline" + kind + " points=\"" + points_of(shape) + "\"/>\n";
    case Shape::Kind::curve: return "<path" + kind + " d=\"" + curve_of(shape) + "\"/>\n";
    case Shape::Kind::ellipse: {
        const Point a = shape.points.front(), b = shape.points.back();
        return "<ellipse" + kind + " cx=\"" + text_of((a.x + b.x) / 2) + "\" cy=\"" +
               text_of((a.y + b.y) / 2) + "\" rx=\"" + text_of(std::abs(b.x - a.x) / 2) + "\" ry=\"" +
               text_of(std::abs(b.y - a.y) / 2) + "\"/>\n";
    }
    case Shape::Kind::image: {
        const Point a = shape.points.front(), b = shape.points.back();
        return "<image x=\"" + text_of(a.x) + "\" y=\"" + text_of(a.y) + "\" width=\"" + text_of(b.x - a.x) +
               "\" height=\"" + text_of(b.y - a.y) + "\" href=\"" + data_address(shape.text) + "\"/>\n";
    }
    case Shape::Kind::text: {
        static const char* const anchors[] = {"start", "middle", "end"};
        return "<text" + kind + " x=\"" + text_of(shape.points[0].x) + "\" y=\"" +
               text_of(shape.points[0].y) + "\" font-size=\"" + text_of(shape.size) + "\" text-anchor=\"" +
               anchors[static_cast<int>(shape.align)] + "\">" + escape::xml(shape.text) + "</text>\n";
    }
    }
    return "";
}

std::string style_sheet(bool is_dark) {
    std::string text = "text { font-family: Helvetica, Arial, 'Liberation Sans', sans-serif }\n";
    for (const Ink& ink : theme) {
        const std::string colour = is_dark ? ink.dark : ink.light,
                          fill = is_dark ? ink.dark_fill : ink.light_fill;
        const std::string selector = name(ink.style);
        text += "." + selector + " { stroke: " + colour + "; fill: " + (fill.empty() ? "none" : fill) +
                "; stroke-width: " + number_text(ink.width) + " }\ntext." + selector +
                " { stroke: none; fill: " + colour + " }\n";
    }
    // What a wire crosses is still read.
    const std::string paper = is_dark ? dark_paper : light_paper;
    return text + "text.name, text.label { stroke: " + paper + "; stroke-width: 3; paint-order: stroke }\n";
}

} // namespace

Rectangle sheet_of(const Drawing& drawing) {
    constexpr double margin = 20;
    const Rectangle& r = drawing.bounds;
    return {r.x - margin, r.y - margin, r.width + 2 * margin, r.height + 2 * margin};
}

std::string to_svg(const Drawing& drawing, bool is_dark) {
    const Rectangle sheet = sheet_of(drawing);
    const std::string x = text_of(sheet.x), y = text_of(sheet.y), width = text_of(sheet.width),
                      height = text_of(sheet.height), box = x + " " + y + " " + width + " " + height;
    std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"" + box + "\" width=\"" + width +
                      "\" height=\"" + height + "\" role=\"img\">\n<style>\n" + style_sheet(is_dark) +
                      "</style>\n<rect x=\"" + x + "\" y=\"" + y +
                      "\" width=\"100%\" height=\"100%\" fill=\"" + (is_dark ? dark_paper : light_paper) +
                      "\"/>\n";
    for (const auto& element : drawing.elements) {
        svg += "<g>\n<title>" + escape::xml(element.title) + "</title>\n";
        for (const auto& shape : element.shapes) svg += shape_text(shape);
        svg += "</g>\n";
    }
    return svg + "</svg>\n";
}

} // namespace bf::editor
