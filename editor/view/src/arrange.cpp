// Layers from left to right (after Sugiyama, Tagawa, Toda, "Methods for visual understanding of hierarchical
// system structures", 1981): wires that feed back are left out, each box stands one layer after what it
// reads, the order within layers is that of few crossings, and what is wired straight through becomes one
// row.
#include "bf/view/place.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace bf::editor {

namespace {

constexpr double above_box = 10, beneath_box = 25; ///< where wires run and a name stands
constexpr double beside_lane = 5;                  ///< between wires that pass a layer
constexpr double between_layers = 50, between_parts = 60, between_tracks = 10;
constexpr double grid = 5;

double on_grid(double value) { return grid * std::round(value / grid); }

/// The boxes of one connected part of a drawing.
class Layers {
  public:
    Layers(const std::vector<Box>& boxes, const std::vector<Net>& nets,
           const std::vector<std::size_t>& members)
        : boxes_(boxes) {
        std::vector<std::size_t> vertex_of(boxes.size(), none);
        for (const std::size_t box : members) {
            vertex_of[box] = vertices_.size();
            vertices_.push_back({box, 0, boxes[box].height, above_box, beneath_box});
        }
        for (std::size_t n = 0; n < nets.size(); ++n) {
            const Net& net = nets[n];
            if (vertex_of[net.from.box] == none) continue;
            for (const PinOf& to : net.to)
                wires_.push_back({n, vertex_of[net.from.box], vertex_of[to.box],
                                  boxes[net.from.box].pins[net.from.pin].at.y,
                                  boxes[to.box].pins[to.pin].at.y});
        }
    }

    /// Puts the corners of the boxes into the result; returns how large the part is.
    Point run(std::vector<Point>& corners) {
        break_loops();
        assign_layers();
        add_lanes();
        reduce_crossings();
        make_rows();
        place_rows();
        return place_layers(corners);
    }

  private:
    static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
    static constexpr std::size_t effort = 300'000; ///< edges that are looked at to reduce crossings

    struct Vertex {
        std::size_t box; ///< none: a lane, where a wire passes a layer
        std::size_t layer;
        double height, above, beneath;
        std::size_t order = 0; ///< within its layer
        std::size_t row = none;
        double in_row = 0; ///< of its upper side, from that of the row's first vertex
        std::vector<std::size_t> left = {}, right = {}; ///< edges
    };

    struct Wire {
        std::size_t net, from, to;
        double from_y, to_y; ///< of pins, from the upper sides
        bool feeds_back = false;
    };

    /// A piece of a wire from one layer to the next.
    struct Edge {
        std::size_t net, from, to;
        double from_y, to_y;
    };

    /// A wire feeds back where it leads to a box that leads to it, seen from the sources in the order of the
    /// document.
    void break_loops() {
        std::vector<std::vector<std::size_t>> outgoing(vertices_.size());
        std::vector<int> incoming(vertices_.size(), 0);
        for (std::size_t w = 0; w < wires_.size(); ++w) {
            outgoing[wires_[w].from].push_back(w);
            ++incoming[wires_[w].to];
        }
        std::vector<char> state(vertices_.size(), 'n');        // new, open, closed
        std::vector<std::pair<std::size_t, std::size_t>> path; // vertex and its next wire
        const auto visit = [&](std::size_t root) {
            if (state[root] != 'n') return;
            path = {{root, 0}};
            state[root] = 'o';
            while (!path.empty()) {
                auto& [v, next] = path.back();
                if (next == outgoing[v].size()) {
                    state[v] = 'c';
                    topological_.push_back(v);
                    path.pop_back();
                    continue;
                }
                Wire& wire = wires_[outgoing[v][next++]];
                wire.feeds_back = state[wire.to] == 'o';
                if (state[wire.to] != 'n') continue;
                state[wire.to] = 'o';
                path.emplace_back(wire.to, 0);
            }
        };
        for (std::size_t v = 0; v < vertices_.size(); ++v)
            if (incoming[v] == 0) visit(v);
        for (std::size_t v = 0; v < vertices_.size(); ++v) visit(v);
        std::reverse(topological_.begin(), topological_.end());
    }

    /// As far left as what is read permits; then to the right, where that makes wires shorter.
    void assign_layers() {
        std::vector<std::vector<const Wire*>> in(vertices_.size()), out(vertices_.size());
        for (const Wire& wire : wires_)
            if (!wire.feeds_back) in[wire.to].push_back(&wire), out[wire.from].push_back(&wire);
        for (const std::size_t v : topological_)
            for (const Wire* wire : in[v])
                vertices_[v].layer = std::max(vertices_[v].layer, vertices_[wire->from].layer + 1);
        for (auto v = topological_.rbegin(); v != topological_.rend(); ++v) {
            if (out[*v].size() <= in[*v].size()) continue;
            std::size_t last = none;
            for (const Wire* wire : out[*v]) last = std::min(last, vertices_[wire->to].layer);
            vertices_[*v].layer = last - 1;
        }
        std::size_t first = none;
        for (const Vertex& vertex : vertices_) first = std::min(first, vertex.layer);
        for (Vertex& vertex : vertices_) vertex.layer -= first;
    }

    /// Wires of a net that pass a layer do so in one lane.
    void add_lanes() {
        std::map<std::pair<std::size_t, std::size_t>, std::size_t> lanes; // by net and layer
        for (const Wire& wire : wires_) {
            if (wire.feeds_back) continue;
            std::size_t from = wire.from;
            double from_y = wire.from_y;
            for (std::size_t layer = vertices_[wire.from].layer + 1; layer < vertices_[wire.to].layer;
                 ++layer) {
                const auto [lane, is_new] = lanes.try_emplace({wire.net, layer}, vertices_.size());
                if (is_new) {
                    vertices_.push_back({none, layer, 0, beside_lane, beside_lane});
                    add_edge({wire.net, from, lane->second, from_y, 0});
                }
                from = lane->second;
                from_y = 0;
            }
            add_edge({wire.net, from, wire.to, from_y, wire.to_y});
        }
        for (std::size_t v = 0; v < vertices_.size(); ++v) {
            layers_.resize(std::max(layers_.size(), vertices_[v].layer + 1));
            vertices_[v].order = layers_[vertices_[v].layer].size();
            layers_[vertices_[v].layer].push_back(v);
        }
    }

    void add_edge(const Edge& edge) {
        vertices_[edge.from].right.push_back(edges_.size());
        vertices_[edge.to].left.push_back(edges_.size());
        edges_.push_back(edge);
    }

    /// Where an edge ends, in the order of its layer; pins of one box are told apart.
    double place_of_from(const Edge& e) const { return place(vertices_[e.from], e.from_y); }
    double place_of_to(const Edge& e) const { return place(vertices_[e.to], e.to_y); }
    static double place(const Vertex& vertex, double y) {
        return static_cast<double>(vertex.order) + (y + 1) / (vertex.height + 2);
    }

    void reduce_crossings() {
        const auto best_of = [&](auto& best, std::size_t& least) {
            const std::size_t now = crossings();
            if (now >= least) return;
            least = now;
            best = layers_;
        };
        auto best = layers_;
        std::size_t least = crossings();
        // Of wires that pass many layers nobody follows each; fewer sweeps do, since each takes long.
        const int sweeps = static_cast<int>(std::clamp<std::size_t>(effort / (edges_.size() + 1), 2, 12));
        for (int sweep = 0; sweep < sweeps && least > 0; ++sweep) {
            const bool rightwards = sweep % 2 == 0;
            for (std::size_t k = 1; k < layers_.size(); ++k)
                sort_layer(rightwards ? k : layers_.size() - 1 - k, rightwards);
            exchange_neighbours();
            best_of(best, least);
        }
        for (std::size_t l = 0; l < best.size(); ++l) set_order(l, best[l]);
    }

    void set_order(std::size_t layer, std::vector<std::size_t> order) {
        for (std::size_t k = 0; k < order.size(); ++k) vertices_[order[k]].order = k;
        layers_[layer] = std::move(order);
    }

    /// Vertices go where the mean of their neighbours is (barycentre); those without one stay about where
    /// they are.
    void sort_layer(std::size_t layer, bool by_left) {
        const double others = static_cast<double>(layers_[by_left ? layer - 1 : layer + 1].size());
        const double scale = others / static_cast<double>(layers_[layer].size());
        std::vector<std::pair<double, std::size_t>> keys;
        for (const std::size_t v : layers_[layer]) {
            const auto& edges = by_left ? vertices_[v].left : vertices_[v].right;
            double sum = 0;
            for (const std::size_t e : edges)
                sum += by_left ? place_of_from(edges_[e]) : place_of_to(edges_[e]);
            keys.emplace_back(edges.empty() ? (static_cast<double>(vertices_[v].order) + 0.5) * scale
                                            : sum / static_cast<double>(edges.size()),
                              v);
        }
        std::stable_sort(keys.begin(), keys.end(),
                         [](const auto& a, const auto& b) { return a.first < b.first; });
        std::vector<std::size_t> order;
        for (const auto& [key, v] : keys) order.push_back(v);
        set_order(layer, std::move(order));
    }

    /// Crossings of the edges of two vertices when the first stands above the second.
    int crossings(const Vertex& first, const Vertex& second) const {
        int result = 0;
        for (const std::size_t e : first.left)
            for (const std::size_t f : second.left)
                result += place_of_from(edges_[e]) > place_of_from(edges_[f]);
        for (const std::size_t e : first.right)
            for (const std::size_t f : second.right)
                result += place_of_to(edges_[e]) > place_of_to(edges_[f]);
        return result;
    }

    void exchange_neighbours() {
        bool is_better = true;
        for (int round = 0; round < 8 && is_better; ++round) {
            is_better = false;
            for (auto& layer : layers_)
                for (std::size_t k = 1; k < layer.size(); ++k) {
                    Vertex &a = vertices_[layer[k - 1]], &b = vertices_[layer[k]];
                    if (crossings(b, a) >= crossings(a, b)) continue;
                    std::swap(a.order, b.order);
                    std::swap(layer[k - 1], layer[k]);
                    is_better = true;
                }
        }
    }

    std::size_t crossings() const {
        std::vector<std::vector<std::pair<double, double>>> ends(layers_.size());
        for (const Edge& edge : edges_)
            ends[vertices_[edge.from].layer].emplace_back(place_of_from(edge), place_of_to(edge));
        std::size_t result = 0;
        for (auto& gap : ends) {
            std::sort(gap.begin(), gap.end());
            std::vector<double> reached;
            for (const auto& [from, to] : gap) {
                const auto above = std::upper_bound(reached.begin(), reached.end(), to);
                result += static_cast<std::size_t>(reached.end() - above);
                reached.insert(above, to);
            }
        }
        return result;
    }

    /// Chooses the edges that become straight: at most one on each side of a vertex, none across another;
    /// lanes before boxes, and the middle one of several.
    void make_rows() {
        std::vector<double> cost(edges_.size(), 0);
        for (const Vertex& vertex : vertices_)
            for (const bool is_left : {true, false}) {
                auto side = is_left ? vertex.left : vertex.right;
                std::stable_sort(side.begin(), side.end(), [&](std::size_t e, std::size_t f) {
                    return is_left ? place_of_from(edges_[e]) < place_of_from(edges_[f])
                                   : place_of_to(edges_[e]) < place_of_to(edges_[f]);
                });
                const double middle = static_cast<double>(side.size() - 1) / 2;
                for (std::size_t k = 0; k < side.size(); ++k)
                    cost[side[k]] += std::abs(static_cast<double>(k) - middle);
            }
        std::vector<std::size_t> by_cost(edges_.size());
        std::iota(by_cost.begin(), by_cost.end(), 0);
        const auto key = [&](std::size_t e) {
            const bool is_lane = vertices_[edges_[e].from].box == none && vertices_[edges_[e].to].box == none;
            return is_lane ? -1 : cost[e];
        };
        std::stable_sort(by_cost.begin(), by_cost.end(), [&](auto e, auto f) { return key(e) < key(f); });

        std::vector<std::map<std::size_t, std::size_t>> chosen(
            layers_.size()); // in each gap: order from -> order to
        std::vector<std::size_t> next(vertices_.size(), none), before(vertices_.size(), none);
        for (const std::size_t e : by_cost) {
            const Edge& edge = edges_[e];
            if (next[edge.from] != none || before[edge.to] != none) continue;
            auto& gap = chosen[vertices_[edge.from].layer];
            const std::size_t from = vertices_[edge.from].order, to = vertices_[edge.to].order;
            const auto after = gap.lower_bound(from);
            if (after != gap.end() && after->second < to) continue;
            if (after != gap.begin() && std::prev(after)->second > to) continue;
            gap.emplace(from, to);
            next[edge.from] = before[edge.to] = e;
        }
        for (std::size_t v = 0; v < vertices_.size(); ++v) {
            if (before[v] != none) continue;
            const std::size_t row = rows_++;
            double y = 0;
            for (std::size_t at = v;;) {
                vertices_[at].row = row;
                vertices_[at].in_row = y;
                if (next[at] == none) break;
                const Edge& edge = edges_[next[at]];
                y += edge.from_y - edge.to_y;
                at = edge.to;
            }
        }
    }

    struct Distance {
        std::size_t upper, lower;
        double least;
    };

    /// Rows go where their other wires become short, in the order that the layers give.
    void place_rows() {
        std::vector<Distance> distances;
        for (const auto& layer : layers_)
            for (std::size_t k = 1; k < layer.size(); ++k) {
                const Vertex &u = vertices_[layer[k - 1]], &v = vertices_[layer[k]];
                distances.push_back({u.row, v.row, u.in_row + u.height + u.beneath + v.above - v.in_row});
            }
        std::vector<std::vector<Distance>> up(rows_), down(rows_);
        std::vector<int> open(rows_, 0);
        for (const Distance& d : distances)
            up[d.lower].push_back(d), down[d.upper].push_back(d), ++open[d.lower];
        std::vector<std::size_t> order;
        for (std::size_t r = 0; r < rows_; ++r)
            if (open[r] == 0) order.push_back(r);
        for (std::size_t k = 0; k < order.size(); ++k)
            for (const Distance& d : down[order[k]])
                if (--open[d.lower] == 0) order.push_back(d.lower);

        y_.assign(rows_, 0);
        constexpr double endless = std::numeric_limits<double>::infinity();
        const auto least = [&](std::size_t r) {
            double result = -endless;
            for (const Distance& d : up[r]) result = std::max(result, y_[d.upper] + d.least);
            return result;
        };
        const auto most = [&](std::size_t r) {
            double result = endless;
            for (const Distance& d : down[r]) result = std::min(result, y_[d.lower] - d.least);
            return result;
        };
        for (const std::size_t r : order) y_[r] = std::max(0.0, least(r));

        std::vector<std::vector<std::pair<std::size_t, double>>> wishes(
            rows_); // to stand that far below another row
        for (const Edge& edge : edges_) {
            const Vertex &u = vertices_[edge.from], &v = vertices_[edge.to];
            if (u.row == v.row) continue;
            const double offset = u.in_row + edge.from_y - v.in_row - edge.to_y;
            wishes[v.row].emplace_back(u.row, offset);
            wishes[u.row].emplace_back(v.row, -offset);
        }
        for (int sweep = 0; sweep < 24; ++sweep) {
            for (std::size_t k = 0; k < order.size(); ++k) {
                const std::size_t r = sweep % 2 == 0 ? order[order.size() - 1 - k] : order[k];
                if (wishes[r].empty()) continue;
                std::vector<double> wished;
                for (const auto& [other, offset] : wishes[r]) wished.push_back(y_[other] + offset);
                std::sort(wished.begin(), wished.end());
                const double median = (wished[(wished.size() - 1) / 2] + wished[wished.size() / 2]) / 2;
                y_[r] = std::min(std::max(median, least(r)), most(r));
            }
        }
        double top = endless;
        for (const Vertex& v : vertices_) top = std::min(top, y(v));
        for (double& value : y_) value = on_grid(value - top);
    }

    double y(const Vertex& v) const { return y_[v.row] + v.in_row; }

    /// Columns, as far apart as the vertical pieces of the wires between them need.
    Point place_layers(std::vector<Point>& corners) const {
        std::vector<double> width(layers_.size(), 0), gap(layers_.size(), 0);
        for (const Vertex& v : vertices_)
            if (v.box != none) width[v.layer] = std::max(width[v.layer], boxes_[v.box].width);

        std::vector<std::map<std::size_t, std::pair<double, double>>> runs(layers_.size()); // of each net
        for (const Edge& edge : edges_) {
            const double from = y(vertices_[edge.from]) + edge.from_y, to = y(vertices_[edge.to]) + edge.to_y;
            if (from == to) continue;
            auto& run = runs[vertices_[edge.from].layer].try_emplace(edge.net, from, from).first->second;
            run = {std::min({run.first, from, to}), std::max({run.second, from, to})};
        }
        std::vector<int> returning(layers_.size() + 1,
                                   0); // to the right of each layer, whose first is the border
        for (const Wire& wire : wires_)
            if (wire.feeds_back)
                ++returning[vertices_[wire.from].layer + 1], ++returning[vertices_[wire.to].layer];
        for (std::size_t l = 0; l + 1 < layers_.size(); ++l) {
            std::vector<std::pair<double, int>> ends;
            for (const auto& [net, run] : runs[l])
                ends.emplace_back(run.first, -1), ends.emplace_back(run.second, 1);
            std::sort(ends.begin(), ends.end());
            int tracks = 0, most = 0;
            for (const auto& [at, change] : ends) most = std::max(most, tracks -= change);
            gap[l] = std::max(between_layers, between_tracks * (3 + most + returning[l + 1]));
        }
        double x = 0;
        Point size;
        std::vector<double> left(layers_.size());
        for (std::size_t l = 0; l < layers_.size(); ++l) {
            left[l] = x;
            size.x = x + width[l];
            x = grid * std::ceil((size.x + gap[l]) / grid);
        }
        for (const Vertex& v : vertices_) {
            size.y = std::max(size.y, y(v) + v.height);
            if (v.box == none) continue;
            corners[v.box] = {on_grid(left[v.layer] + (width[v.layer] - boxes_[v.box].width) / 2), y(v)};
        }
        size.y += between_tracks * static_cast<double>(returning.front());
        return size;
    }

    const std::vector<Box>& boxes_;
    std::vector<Vertex> vertices_; ///< boxes, then lanes
    std::vector<Wire> wires_;
    std::vector<Edge> edges_;
    std::vector<std::size_t> topological_;
    std::vector<std::vector<std::size_t>> layers_; ///< vertices in their order
    std::size_t rows_ = 0;
    std::vector<double> y_; ///< of rows
};

/// Boxes that wires join, in the order of their first ones.
std::vector<std::vector<std::size_t>> parts(std::size_t boxes, const std::vector<Net>& nets) {
    std::vector<std::size_t> root(boxes);
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](std::size_t b) {
        while (root[b] != b) b = root[b] = root[root[b]];
        return b;
    };
    for (const Net& net : nets)
        for (const PinOf& to : net.to) {
            const auto [first, second] = std::minmax({find(net.from.box), find(to.box)});
            root[second] = first;
        }
    std::map<std::size_t, std::vector<std::size_t>> result;
    for (std::size_t b = 0; b < boxes; ++b) result[find(b)].push_back(b);
    std::vector<std::vector<std::size_t>> list;
    for (auto& [first, members] : result) list.push_back(std::move(members));
    return list;
}

} // namespace

std::vector<Point> arrange(const std::vector<Box>& boxes, const std::vector<Net>& nets) {
    std::vector<Point> corners(boxes.size());
    std::vector<std::size_t> single;
    double y = 0, width = 600;
    for (const auto& part : parts(boxes.size(), nets)) {
        if (part.size() == 1) {
            single.push_back(part.front());
            continue;
        }
        const Point size = Layers(boxes, nets, part).run(corners);
        for (const std::size_t b : part) corners[b].y += y;
        y = on_grid(y + size.y + between_parts);
        width = std::max(width, size.x);
    }
    double x = 0, tallest = 0;
    for (const std::size_t b : single) {
        if (x > 0 && x + boxes[b].width > width) {
            y = grid * std::ceil((y + tallest + above_box + beneath_box) / grid);
            x = tallest = 0;
        }
        corners[b] = {x, y};
        tallest = std::max(tallest, boxes[b].height);
        x = grid * std::ceil((x + boxes[b].width + between_layers) / grid);
    }
    return corners;
}

} // namespace bf::editor
