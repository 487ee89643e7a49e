#include "wires.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

namespace bf::editor::wires {

namespace {

bool is_inside(const Rectangle& box, const Point& p) {
    return p.x > box.x && p.x < box.x + box.width && p.y > box.y && p.y < box.y + box.height;
}

/// Covers points, and grows.
class Cover {
  public:
    void add(const Point& p) {
        least_ = {std::min(least_.x, p.x), std::min(least_.y, p.y)};
        most_ = {std::max(most_.x, p.x), std::max(most_.y, p.y)};
    }
    void add(const Rectangle& r) { add(Point{r.x, r.y}), add(Point{r.x + r.width, r.y + r.height}); }
    Rectangle widened(double by) const {
        return {least_.x - by, least_.y - by, most_.x - least_.x + 2 * by, most_.y - least_.y + 2 * by};
    }

  private:
    Point least_{1e300, 1e300}, most_{-1e300, -1e300};
};

} // namespace

Grid::Grid(const std::vector<Rectangle>& boxes, const std::vector<Places>& nets) : boxes_(boxes) {
    Cover all;
    for (const Rectangle& box : boxes) all.add(box);
    for (const Places& net : nets)
        for (const Point& p : net.corners) all.add(p);
    bounds_ = all.widened(2 * margin_beneath);

    for (const Rectangle& box : boxes) {
        Cover cover;
        cover.add(box);
        const Rectangle area = cover.widened(detour);
        for (int axis = 0; axis < 2; ++axis) {
            const double middle = (low(box, axis) + high(box, axis)) / 2;
            add(axis, point(axis, middle, low(widened(box), 1 - axis)), area);
            add(axis, point(axis, middle, high(widened(box), 1 - axis)), area);
        }
    }
    for (const Places& net : nets) {
        Cover cover;
        for (const End& end : net.ends) cover.add(end.stub);
        for (const Point& p : net.corners) cover.add(p);
        const Rectangle area = cover.widened(detour);
        for (const End& end : net.ends) {
            const int axis = axis_of(end.out);
            const Line line = add(axis, end.stub, area);
            add(1 - axis, end.stub, area);
            // Two wires that change places need a third line between those beside the two boxes.
            const double reach = sign_of(end.out) > 0 ? line.to : line.from;
            const double midway = std::round((along(end.stub, axis) + reach) / 2);
            add(1 - axis, point(axis, midway, across(end.stub, axis)), area);
        }
        for (const Point& p : net.corners) add(0, p, area), add(1, p, area);
    }
    merge();
    cross();
}

Line Grid::add(int axis, const Point& through, const Rectangle& area) {
    const double at = across(through, axis), start = along(through, axis);
    Line line{axis, at, std::max(low(bounds_, axis), low(area, axis)),
              std::min(high(bounds_, axis), high(area, axis))};
    if (at < low(bounds_, 1 - axis) || at > high(bounds_, 1 - axis)) return line;
    for (const Rectangle& box : boxes_) {
        // Where boxes stand so close that the margins meet, lines run between them nevertheless.
        const Rectangle around = widened(box), &clear = is_inside(around, through) ? box : around;
        if (is_inside(box, through)) return line;
        if (at <= low(clear, 1 - axis) || at >= high(clear, 1 - axis)) continue;
        if (high(clear, axis) <= start) line.from = std::max(line.from, high(clear, axis));
        if (low(clear, axis) >= start) line.to = std::min(line.to, low(clear, axis));
    }
    lines_[static_cast<std::size_t>(axis)].push_back(line);
    return line;
}

void Grid::merge() {
    for (auto& lines : lines_) {
        std::sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) {
            return std::tie(a.at, a.from, a.to) < std::tie(b.at, b.from, b.to);
        });
        std::vector<Line> merged;
        for (const Line& line : lines) {
            if (!merged.empty() && merged.back().at == line.at && merged.back().to >= line.from)
                merged.back().to = std::max(merged.back().to, line.to);
            else
                merged.push_back(line);
        }
        lines = std::move(merged);
    }
}

void Grid::cross() {
    auto& [rows, columns] = lines_;
    for (Line& row : rows) {
        auto column = std::lower_bound(columns.begin(), columns.end(), row.from,
                                       [](const Line& line, double x) { return line.at < x; });
        for (; column != columns.end() && column->at <= row.to; ++column) {
            if (row.at < column->from || row.at > column->to) continue;
            const int n = static_cast<int>(nodes.size());
            nodes.push_back({{column->at, row.at}});
            for (Line* line : {&row, &*column}) {
                const auto forward = static_cast<std::size_t>(line->axis);
                if (!line->nodes.empty()) {
                    nodes[static_cast<std::size_t>(line->nodes.back())].next[forward] = n;
                    nodes.back().next[forward + 2] = line->nodes.back();
                }
                line->nodes.push_back(n);
            }
        }
    }
}

int Grid::node_at(const Point& p) const {
    const auto& rows = lines_[0];
    auto row = std::upper_bound(rows.begin(), rows.end(), p, [](const Point& q, const Line& line) {
        return std::tie(q.y, q.x) < std::tie(line.at, line.from);
    });
    if (row == rows.begin() || (--row)->at != p.y) return nobody;
    const auto found = std::lower_bound(row->nodes.begin(), row->nodes.end(), p.x, [&](int n, double x) {
        return nodes[static_cast<std::size_t>(n)].at.x < x;
    });
    return found != row->nodes.end() && nodes[static_cast<std::size_t>(*found)].at == p ? *found : nobody;
}

std::vector<int> Grid::straight(const Point& from, const Point& to) const {
    std::vector<int> result;
    const int last = node_at(to);
    const auto d = static_cast<std::size_t>(direction(from, to));
    for (int n = node_at(from); n != nobody; n = nodes[static_cast<std::size_t>(n)].next[d]) {
        result.push_back(n);
        if (n == last) return result;
    }
    return {};
}

int fewest_bends(const Point& from, Direction d, const Point& to, Direction in) {
    const int axis = axis_of(in);
    const double ahead = (along(to, axis) - along(from, axis)) * sign_of(in);
    const double aside = across(to, axis) - across(from, axis);
    if (d == in) return aside == 0 ? (ahead >= 0 ? 0 : 4) : (ahead > 0 ? 2 : 4);
    if (axis_of(d) == axis) return aside == 0 ? 4 : 2;
    return ahead >= 0 && aside * sign_of(d) > 0 ? 1 : 3;
}

std::vector<int> Search::path(int net, const std::vector<Start>& starts, int target, Direction in,
                              bool everywhere) {
    // Where crossings are many, the estimate falls behind the cost, and the search would look everywhere;
    // then a way that is good enough is sought.
    auto found = attempt(net, starts, target, in, everywhere, 1, 2000);
    return found.empty() ? attempt(net, starts, target, in, everywhere, 3, grid_.nodes.size() * 4) : found;
}

std::vector<int> Search::attempt(int net, const std::vector<Start>& starts, int target, Direction in,
                                 bool everywhere, double weight, std::size_t limit) {
    ++search_;
    const Point goal = grid_.nodes[static_cast<std::size_t>(target)].at;
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    const auto reach = [&](int node, Direction d, double cost, int before) {
        const int s = node * 4 + d;
        State& state = states_[static_cast<std::size_t>(s)];
        if (state.search == search_ && (state.is_done || state.cost <= cost)) return;
        state = {cost, before, search_, false};
        const Point& at = grid_.nodes[static_cast<std::size_t>(node)].at;
        const double rest =
            std::abs(goal.x - at.x) + std::abs(goal.y - at.y) + cost_of_bend * fewest_bends(at, d, goal, in);
        open.emplace(cost + weight * rest, s);
    };
    for (const Start& start : starts) reach(start.node, start.direction, start.cost, nobody);
    while (!open.empty()) {
        const int s = open.top().second;
        open.pop();
        State& state = states_[static_cast<std::size_t>(s)];
        if (state.is_done) continue;
        state.is_done = true;
        const int n = s / 4;
        const Direction d = s % 4;
        if (n == target && d == in) {
            std::vector<int> result;
            for (int at = s; at != nobody; at = states_[static_cast<std::size_t>(at)].before)
                if (result.empty() || result.back() != at / 4) result.push_back(at / 4);
            std::reverse(result.begin(), result.end());
            return result;
        }
        if (limit-- == 0) return {};
        const Node& node = grid_.nodes[static_cast<std::size_t>(n)];
        for (const Direction turned : {d, (d + 1) & 3, (d + 3) & 3}) {
            const double cost = state.cost + (turned == d ? 0 : cost_of_bend) +
                                (d == 3 && turned == 2 ? cost_of_going_back_above : 0);
            if (turned != d && n == target && turned == in) reach(n, turned, cost, s);
            const int m = node.next[static_cast<std::size_t>(turned)];
            if (m == nobody) continue;
            const Node& next = grid_.nodes[static_cast<std::size_t>(m)];
            const auto axis = static_cast<std::size_t>(axis_of(turned));
            const auto is_barred = [&](int owner) { return owner != nobody && owner != net; };
            if (!everywhere && (is_barred(node.fixed[axis]) || is_barred(next.fixed[axis]))) continue;
            reach(m, turned,
                  cost + std::abs(next.at.x - node.at.x) + std::abs(next.at.y - node.at.y) +
                      cost_of_crossing * next.through[1 - axis],
                  s);
        }
    }
    return {};
}

} // namespace bf::editor::wires
