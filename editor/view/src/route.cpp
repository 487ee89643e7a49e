#include "wires.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace bf::editor {

namespace wires {

namespace {

std::size_t index(int n) { return static_cast<std::size_t>(n); }

/// Without points that repeat or lie within a straight piece.
std::vector<Point> simplified(const std::vector<Point>& points) {
    std::vector<Point> result;
    for (const Point& p : points) {
        if (!result.empty() && result.back() == p) continue;
        if (result.size() > 1) {
            const Point &a = result[result.size() - 2], &b = result.back();
            if ((a.x == b.x && b.x == p.x) || (a.y == b.y && b.y == p.y)) result.pop_back();
        }
        result.push_back(p);
    }
    return result;
}

/// With corners where a piece would be oblique; begins and ends along the axes of its ends.
std::vector<Point> squared(const End& from, const std::vector<Point>& corners, const End& to) {
    std::vector<Point> result{from.at};
    int axis = axis_of(from.out);
    for (const Point& corner : corners) {
        const Point last = result.back();
        result.push_back(axis == 0 ? Point{corner.x, last.y} : Point{last.x, corner.y});
        result.push_back(corner);
        if (!(result[result.size() - 2] == corner)) axis = 1 - axis;
    }
    const Point last = result.back();
    const bool level = axis_of(to.out) == 0;
    result.push_back(level ? Point{last.x, to.at.y} : Point{to.at.x, last.y});
    result.push_back(to.at);
    return simplified(result);
}

class Router {
  public:
    Router(const std::vector<Box>& boxes, const std::vector<Point>& corners, const std::vector<Net>& nets,
           const std::vector<std::vector<std::vector<Point>>>& bends)
        : nets_(nets), bends_(bends) {
        for (std::size_t b = 0; b < boxes.size(); ++b)
            boxes_.push_back({corners[b].x, corners[b].y, boxes[b].width, boxes[b].height});
        const auto end_of = [&](const PinOf& of) { return end(boxes[of.box].pins[of.pin], boxes_[of.box]); };
        for (const Net& net : nets) {
            sources_.push_back(end_of(net.from));
            targets_.emplace_back();
            for (const PinOf& to : net.to) targets_.back().push_back(end_of(to));
            routes_.emplace_back(net.to.size());
        }
    }

    std::vector<std::vector<Route>> run() {
        std::vector<Places> places;
        for (std::size_t n = 0; n < nets_.size(); ++n) {
            Places& net = places.emplace_back();
            net.ends = {sources_[n]};
            net.ends.insert(net.ends.end(), targets_[n].begin(), targets_[n].end());
            for (std::size_t i = 0; i < targets_[n].size(); ++i)
                if (has_bends(n, i)) {
                    const auto points = squared(sources_[n], bends_[n][i], targets_[n][i]);
                    net.corners.insert(net.corners.end(), points.begin() + 1, points.end() - 1);
                }
        }
        Grid grid(boxes_, places);
        for (std::size_t n = 0; n < nets_.size(); ++n) {
            const auto reserve = [&](const End& end) {
                if (const int node = grid.node_at(end.stub); node != nobody)
                    grid.nodes[index(node)].fixed[index(axis_of(end.out))] = static_cast<int>(n);
            };
            reserve(sources_[n]);
            for (const End& end : targets_[n]) reserve(end);
        }
        Search search(grid);
        for (const std::size_t n : order()) find(n, grid, search);
        make_tracks();
        spread(tracks_, wires_, boxes_);
        return result();
    }

  private:
    struct Found {
        std::vector<Point> points;
        bool is_fixed = false;
    };

    bool has_bends(std::size_t n, std::size_t i) const {
        return n < bends_.size() && i < bends_[n].size() && !bends_[n][i].empty();
    }

    End end(const Box::Pin& pin, const Rectangle& box) const {
        constexpr std::array<Direction, 4> outs{2, 0, 3, 1};
        const Direction out = outs[static_cast<std::size_t>(pin.side)];
        const int axis = axis_of(out), sign = sign_of(out);
        const Point at{box.x + pin.at.x, box.y + pin.at.y};
        const double side = sign > 0 ? high(box, axis) : low(box, axis);
        const double most = out == 1 ? margin_beneath : margin;
        double room = 3 * most; // where another box stands close, its pins need their part of the room
        for (const Rectangle& other : boxes_) {
            if (across(at, axis) <= low(other, 1 - axis) || across(at, axis) >= high(other, 1 - axis))
                continue;
            const double distance = sign > 0 ? low(other, axis) - side : side - high(other, axis);
            if (distance > 0) room = std::min(room, distance);
        }
        return {at, point(axis, side + sign * room / 3, across(at, axis)), out};
    }

    double estimate(std::size_t n, std::size_t i) const {
        const End &from = sources_[n], &to = targets_[n][i];
        return std::abs(from.stub.x - to.stub.x) + std::abs(from.stub.y - to.stub.y) +
               cost_of_bend * fewest_bends(from.stub, from.out, to.stub, (to.out + 2) & 3);
    }

    /// What is drawn already comes first, then what is straight and short.
    std::vector<std::size_t> order() const {
        std::vector<double> cost(nets_.size(), 0);
        for (std::size_t n = 0; n < nets_.size(); ++n)
            for (std::size_t i = 0; i < targets_[n].size(); ++i)
                cost[n] = has_bends(n, i) ? -1 : cost[n] < 0 ? cost[n] : std::max(cost[n], estimate(n, i));
        std::vector<std::size_t> result(nets_.size());
        std::iota(result.begin(), result.end(), 0);
        std::stable_sort(result.begin(), result.end(), [&](auto a, auto b) { return cost[a] < cost[b]; });
        return result;
    }

    /// Routes of a net: a tree on the grid that grows by one input after the other.
    void find(std::size_t n, Grid& grid, Search& search) {
        std::map<int, Branch> tree; // by node
        const End& from = sources_[n];
        const int root = grid.node_at(from.stub);
        if (root != nobody) tree[root] = {nobody, 1 << ((from.out + 2) & 3)};
        std::vector<std::size_t> inputs(targets_[n].size());
        std::iota(inputs.begin(), inputs.end(), 0);
        std::stable_sort(inputs.begin(), inputs.end(), [&](auto a, auto b) {
            const bool drawn_a = has_bends(n, a), drawn_b = has_bends(n, b);
            return drawn_a != drawn_b ? drawn_a : estimate(n, a) < estimate(n, b);
        });
        for (const std::size_t i : inputs) {
            const End& to = targets_[n][i];
            Found& found = routes_[n][i];
            if (has_bends(n, i)) {
                found = {squared(from, bends_[n][i], to), true};
                grow_along(static_cast<int>(n), found.points, grid, tree);
                continue;
            }
            const int target = grid.node_at(to.stub);
            const Direction in = (to.out + 2) & 3;
            std::vector<int> path;
            if (root != nobody && target != nobody) {
                const auto starts = starts_of(tree, root, from.out);
                path = search.path(static_cast<int>(n), starts, target, in, false);
                if (path.empty()) path = search.path(static_cast<int>(n), starts, target, in, true);
            }
            if (path.empty()) { // boxes stand on each other
                found = {squared(from, {from.stub, to.stub}, to), true};
                continue;
            }
            grow(path, grid, tree);
            tree[target].directions |= 1 << in;
            found.points.push_back(to.at);
            for (int node = target; node != nobody; node = tree[node].before)
                found.points.push_back(grid.nodes[index(node)].at);
            found.points.push_back(from.at);
            std::reverse(found.points.begin(), found.points.end());
            found.points = simplified(found.points);
        }
        occupy(static_cast<int>(n), grid, tree);
    }

    struct Branch {
        int before;     ///< the node on the way from the source
        int directions; ///< a bit for each in which the tree goes on from here
    };
    using Tree = std::map<int, Branch>;

    static std::vector<Start> starts_of(const Tree& tree, int root, Direction out) {
        if (tree.size() == 1) return {{root, out, 0}};
        std::vector<Start> result;
        for (const auto& [node, branch] : tree)
            for (Direction d = 0; d < 4; ++d) {
                const bool goes_on = branch.directions >> ((d + 2) & 3) & 1;
                if (!(branch.directions >> d & 1)) result.push_back({node, d, goes_on ? 0 : cost_of_bend});
            }
        return result;
    }

    static void grow(const std::vector<int>& path, const Grid& grid, Tree& tree) {
        for (std::size_t k = 1; k < path.size(); ++k) {
            const Direction d = direction(grid.nodes[index(path[k - 1])].at, grid.nodes[index(path[k])].at);
            tree[path[k - 1]].directions |= 1 << d;
            tree.try_emplace(path[k], Branch{path[k - 1], 0}).first->second.directions |= 1 << ((d + 2) & 3);
        }
    }

    /// What a person drew is part of the tree as far as it leads around boxes.
    static void grow_along(int net, const std::vector<Point>& points, Grid& grid, Tree& tree) {
        for (std::size_t k = 1; k < points.size(); ++k) {
            const auto path = grid.straight(points[k - 1], points[k]);
            const auto axis = index(axis_of(direction(points[k - 1], points[k])));
            for (const int node : path) grid.nodes[index(node)].fixed[axis] = net;
            if (path.empty() || !tree.count(path.front())) continue;
            grow(path, grid, tree);
        }
    }

    static void occupy(int net, Grid& grid, const Tree& tree) {
        for (const auto& [n, branch] : tree) {
            Node& node = grid.nodes[index(n)];
            for (std::size_t axis = 0; axis < 2; ++axis)
                if (const int both = 5 << axis; (branch.directions & both) == both) ++node.through[axis];
        }
        // Towards a pin there is a direction without a node of the tree: what lies on this line is fixed.
        for (const auto& [n, branch] : tree)
            for (Direction d = 0; d < 4; ++d) {
                if (!(branch.directions >> d & 1) || tree.count(grid.nodes[index(n)].next[index(d)]))
                    continue;
                const Direction back = (d + 2) & 3;
                for (int at = n; at != nobody && tree.count(at);) {
                    grid.nodes[index(at)].fixed[index(axis_of(d))] = net;
                    at =
                        tree.at(at).directions >> back & 1 ? grid.nodes[index(at)].next[index(back)] : nobody;
                }
            }
    }

    /// Pieces of a net that touch on one line are one track.
    void make_tracks() {
        for (std::size_t n = 0; n < routes_.size(); ++n) {
            const std::size_t first = tracks_.size();
            for (Found& found : routes_[n])
                for (std::size_t k = 1; k < found.points.size(); ++k) {
                    const Point &a = found.points[k - 1], &b = found.points[k];
                    const int axis = axis_of(direction(a, b));
                    const bool is_fixed = found.is_fixed || k == 1 || k + 1 == found.points.size();
                    add_track({axis, n, across(a, axis), std::min(along(a, axis), along(b, axis)),
                               std::max(along(a, axis), along(b, axis)), is_fixed},
                              first);
                }
            for (Found& found : routes_[n]) {
                Wire wire{found.points.front(), found.points.back(), {}};
                for (std::size_t k = 1; k < found.points.size(); ++k) {
                    const Point &a = found.points[k - 1], &b = found.points[k];
                    const int axis = axis_of(direction(a, b));
                    const auto covers = [&](const Track& t) {
                        return t.axis == axis && t.at == across(a, axis) &&
                               t.from <= std::min(along(a, axis), along(b, axis)) &&
                               t.to >= std::max(along(a, axis), along(b, axis));
                    };
                    wire.tracks.push_back(static_cast<std::size_t>(
                        std::find_if(tracks_.begin() + static_cast<std::ptrdiff_t>(first), tracks_.end(),
                                     covers) -
                        tracks_.begin()));
                }
                wires_.push_back(std::move(wire));
            }
        }
    }

    void add_track(Track track, std::size_t first) {
        for (std::size_t t = first; t < tracks_.size();) {
            const Track& other = tracks_[t];
            if (other.axis != track.axis || other.at != track.at || other.to < track.from ||
                other.from > track.to) {
                ++t;
                continue;
            }
            track.from = std::min(track.from, other.from);
            track.to = std::max(track.to, other.to);
            track.is_fixed |= other.is_fixed;
            tracks_.erase(tracks_.begin() + static_cast<std::ptrdiff_t>(t));
        }
        tracks_.push_back(track);
    }

    std::vector<std::vector<Route>> result() const {
        std::vector<std::vector<Route>> result;
        std::size_t wire = 0;
        for (const auto& net : routes_) {
            result.emplace_back();
            for (std::size_t i = 0; i < net.size(); ++i) {
                Route route{wires_[wire++].points(tracks_), {}};
                branch(route, result.back());
                result.back().push_back(std::move(route));
            }
        }
        return result;
    }

    /// Finds the last point of a route that lies on those before it.
    static void branch(Route& route, const std::vector<Route>& before) {
        for (std::size_t k = route.points.size(); k-- > 1 && !before.empty();) {
            const Point &a = route.points[k - 1], &b = route.points[k];
            const int axis = axis_of(direction(a, b));
            const double start = along(a, axis), end = along(b, axis), sign = end < start ? -1 : 1;
            double last = -1; // how far from a
            for (const Route& other : before)
                for (std::size_t j = 1; j < other.points.size(); ++j) {
                    const Point &c = other.points[j - 1], &d = other.points[j];
                    if (std::min(across(c, axis), across(d, axis)) > across(a, axis) ||
                        std::max(across(c, axis), across(d, axis)) < across(a, axis))
                        continue;
                    const auto [low, high] = std::minmax({along(c, axis), along(d, axis)});
                    const double reach = sign > 0 ? std::min(high, end) - start : start - std::max(low, end);
                    const double begin = sign > 0 ? low - start : start - high;
                    if (reach >= 0 && begin <= std::abs(end - start)) last = std::max(last, reach);
                }
            if (last < 0) continue;
            const Point at = point(axis, start + sign * last, across(a, axis));
            if (!(at == route.points.front()) && !(at == route.points.back())) route.branches.push_back(at);
            return;
        }
    }

    const std::vector<Net>& nets_;
    const std::vector<std::vector<std::vector<Point>>>& bends_;
    std::vector<Rectangle> boxes_;
    std::vector<End> sources_;
    std::vector<std::vector<End>> targets_;
    std::vector<std::vector<Found>> routes_;
    std::vector<Track> tracks_;
    std::vector<Wire> wires_;
};

} // namespace

} // namespace wires

std::vector<std::vector<Route>> route(const std::vector<Box>& boxes, const std::vector<Point>& corners,
                                      const std::vector<Net>& nets,
                                      const std::vector<std::vector<std::vector<Point>>>& bends) {
    if (boxes.empty()) return {};
    return wires::Router(boxes, corners, nets, bends).run();
}

} // namespace bf::editor
