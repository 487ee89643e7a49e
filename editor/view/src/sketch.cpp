#include "sketch.hpp"

#include "bf/view/place.hpp"

#include <algorithm>
#include <map>
#include <string>

namespace bf::editor {

std::vector<Shape> sketch_of(const model::System& system, const Rectangle& within) {
    constexpr std::size_t most_blocks = 24;
    constexpr double least_room = 20, width = 50, height = 35, largest = 0.4, most_width = 12,
                     most_height = 8, least_size = 3;
    if (system.blocks.empty() || system.blocks.size() > most_blocks || within.width < least_room ||
        within.height < least_room)
        return {};
    std::map<std::string, std::size_t> number; // of blocks, and of own ports behind a dot
    const auto add = [&](const std::string& name) { number.emplace(name, number.size()); };
    for (const auto& block : system.blocks) add(block.name);
    for (const auto* ports : {&system.inputs, &system.outputs})
        for (const auto& port : *ports) add("." + port.name);
    const Box box{width, height, {{{0, height / 2}, Side::left}, {{width, height / 2}, Side::right}}};
    const std::vector<Box> boxes(number.size(), box);
    const auto find = [&](const model::Endpoint& end) {
        return number.find(end.block.empty() ? "." + end.port : end.block);
    };
    std::vector<Net> nets;
    for (const auto& connection : system.connections) {
        const auto from = find(connection.from);
        if (from == number.end()) continue;
        Net net{{from->second, 1}, {}};
        for (const auto& end : connection.to)
            if (const auto to = find(end); to != number.end()) net.to.push_back({to->second, 0});
        if (!net.to.empty()) nets.push_back(std::move(net));
    }
    const std::vector<Point> corners = arrange(boxes, nets);
    const auto [left, right] = std::ranges::minmax(corners, {}, &Point::x);
    const auto [top, bottom] = std::ranges::minmax(corners, {}, &Point::y);
    // Along each axis as far apart as there is room, up to what the drawing itself has.
    const auto share = [&](double room, double span) {
        return span > 0 ? std::min(room / span, largest) : largest;
    };
    const Point scale{share(within.width - most_width, right.x - left.x),
                      share(within.height - most_height, bottom.y - top.y)};
    const double w = std::min(most_width, 0.6 * scale.x * 2 * width),
                 h = std::min(most_height, 0.6 * scale.y * 2 * height);
    if (w < least_size || h < least_size) return {};
    const Point middle{(left.x + right.x) / 2, (top.y + bottom.y) / 2};
    const auto small = [&](const Point& p) {
        return Point{within.x + within.width / 2 + scale.x * (p.x - middle.x),
                     within.y + within.height / 2 + scale.y * (p.y - middle.y)};
    };
    std::vector<Shape> shapes;
    for (const Net& net : nets)
        for (const PinOf& to : net.to) {
            const Point a = small(corners[net.from.box]), b = small(corners[to.box]);
            shapes.push_back({Shape::Kind::line, Style::port, {{a.x + w / 2, a.y}, {b.x - w / 2, b.y}}});
        }
    for (const Point& corner : corners) {
        const Point p = small(corner);
        shapes.push_back({Shape::Kind::polygon,
                          Style::port,
                          {{p.x - w / 2, p.y - h / 2},
                           {p.x + w / 2, p.y - h / 2},
                           {p.x + w / 2, p.y + h / 2},
                           {p.x - w / 2, p.y + h / 2}}});
    }
    return shapes;
}

} // namespace bf::editor
