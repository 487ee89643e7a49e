#include "labels.hpp"

#include "item.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bf::editor {

namespace {

constexpr double beside = 12;   ///< from the beginning of a piece
constexpr double from_line = 4; ///< from a level piece to the text above or beneath it
constexpr double step = 20;     ///< between places that are tried along a piece
constexpr int most = 12;        ///< places on one side of a piece

/// A line has no width: it lies on a rectangle where it runs through its inside.
bool crosses(const std::vector<Point>& way, const Rectangle& r) {
    for (std::size_t k = 1; k < way.size(); ++k) {
        const auto [left, right] = std::minmax(way[k - 1].x, way[k].x);
        const auto [top, bottom] = std::minmax(way[k - 1].y, way[k].y);
        if (left < r.x + r.width && right > r.x && top < r.y + r.height && bottom > r.y) return true;
    }
    return false;
}

/// Where letters leave traces, of a text that stands in its line.
Rectangle ink(const Shape& text) {
    const Rectangle line = extent(text);
    return {line.x, text.points[0].y - 0.8 * text.size, line.width, 1.05 * text.size};
}

Shape label_at(const Point& at, const std::string& text, Align align) {
    return {Shape::Kind::text, Style::label, {at}, text, small_letter, align};
}

/// In the order in which they are liked: from the beginning of the way on; above before beneath, and beside
/// an upright piece on the right first.
std::vector<Shape> places(const Labelled& one) {
    std::vector<Shape> found;
    const double width = text_width(one.text, small_letter);
    for (std::size_t k = 1; k < one.way.size(); ++k) {
        const Point a = one.way[k - 1], b = one.way[k];
        const bool is_level = a.y == b.y, is_back = is_level ? b.x < a.x : b.y < a.y;
        const double length = std::abs(is_level ? b.x - a.x : b.y - a.y), sign = is_back ? -1 : 1;
        const double room = length - beside - (is_level ? width : small_letter);
        for (int i = 0; i < most && (i == 0 || i * step <= room); ++i) {
            const double along = beside + i * step;
            if (is_level) {
                const Align align = is_back ? Align::end : Align::start;
                for (const double y : {-from_line, small_letter + 1})
                    found.push_back(label_at({a.x + sign * along, a.y + y}, one.text, align));
            } else { // its base line; a text above its place has its feet there
                const double y = a.y + sign * (along - 8) + (is_back ? 0 : small_letter);
                found.push_back(label_at({a.x + 6, y}, one.text, Align::start));
                found.push_back(label_at({a.x - 6, y}, one.text, Align::end));
            }
        }
    }
    return found;
}

} // namespace

Rectangle extent(const Shape& text) {
    const double width = text_width(text.text, text.size);
    const double before = text.align == Align::start ? 0 : text.align == Align::middle ? width / 2 : width;
    return {text.points[0].x - before, text.points[0].y - text.size, width, 1.3 * text.size};
}

std::vector<Shape> place_labels(const std::vector<Labelled>& ways, const std::vector<Rectangle>& boxes) {
    std::vector<Shape> labels(ways.size());
    const auto cost = [&](const Shape& label, std::size_t own) {
        const Rectangle r = ink(label);
        double sum = 0;
        for (const Rectangle& box : boxes) sum += 100 * overlap(r, box); // which would hide it
        for (std::size_t i = 0; i < ways.size(); ++i) {
            sum += crosses(ways[i].way, r);
            if (i != own && !labels[i].points.empty()) sum += 10 * overlap(r, ink(labels[i]));
        }
        return sum;
    };
    // Those that come later may stand where an earlier one would be freer than it is: all are placed twice.
    for (int round = 0; round < 2; ++round)
        for (std::size_t i = 0; i < ways.size(); ++i) {
            if (ways[i].text.empty()) continue;
            double least = std::numeric_limits<double>::infinity();
            labels[i] = {};
            Shape best;
            for (Shape& place : places(ways[i])) {
                const double found = cost(place, i);
                if (found >= least) continue;
                least = found;
                best = std::move(place);
                if (least == 0) break;
            }
            labels[i] = std::move(best);
        }
    return labels;
}

bool overlap(const Rectangle& a, const Rectangle& b) {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

Rectangle together(const Rectangle& a, const Rectangle& b) {
    const double x = std::min(a.x, b.x), y = std::min(a.y, b.y);
    return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

Rectangle around(const std::vector<Point>& points) {
    const auto [left, right] = std::ranges::minmax(points, {}, &Point::x);
    const auto [top, bottom] = std::ranges::minmax(points, {}, &Point::y);
    return {left.x, top.y, right.x - left.x, bottom.y - top.y};
}

std::vector<Point> own_part(const Route& way) {
    if (way.branches.empty()) return way.points;
    const Point leaves = way.branches.back();
    for (std::size_t i = way.points.size(); i-- > 1;) {
        const Rectangle piece = around({way.points[i - 1], way.points[i]});
        const bool is_on = leaves.x >= piece.x - 0.1 && leaves.x <= piece.x + piece.width + 0.1 &&
                           leaves.y >= piece.y - 0.1 && leaves.y <= piece.y + piece.height + 0.1;
        if (!is_on) continue;
        std::vector<Point> points{leaves};
        points.insert(points.end(), way.points.begin() + static_cast<std::ptrdiff_t>(i), way.points.end());
        return points;
    }
    return way.points;
}

Shape label_along(const std::vector<Point>& way, const std::string& text) {
    constexpr double beside = 4, least_room = 40;
    const double width = text_width(text, small_letter);
    Rectangle best = around({way.front()});
    double down = -beside; // from the line to the base line
    for (std::size_t k = 1; k < way.size() && best.width < width + 2 * beside; ++k) {
        const Rectangle piece = around({way[k - 1], way[k]});
        if (piece.height > 0 || piece.width <= best.width) continue;
        best = piece;
        down = way[k].x < way[k - 1].x ? small_letter + 1 : -beside;
    }
    return {Shape::Kind::text,
            Style::label,
            {{best.x + beside, best.y + down}},
            fitted(text, small_letter, std::max(least_room, best.width - 2 * beside)),
            small_letter,
            Align::start};
}

} // namespace bf::editor
