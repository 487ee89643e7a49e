// Graphs of boxes, and what must hold of how they are placed: each check returns what is wrong, or nothing.
#pragma once

#include "bf/view/place.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>

namespace bf::editor::layout {

struct Graph {
    std::vector<Box> boxes;
    std::vector<Net> nets;
    std::vector<Point> corners = {};

    /// A box with inputs at its left and outputs at its right side; returns its number. Pins: inputs first.
    std::size_t add(int inputs, int outputs, Point corner = {}) {
        const int rows = std::max({inputs, outputs, 2});
        Box box{50, 20.0 * rows, {}};
        for (int i = 0; i < inputs; ++i) box.pins.push_back({{0, pin(i, inputs, rows)}, Side::left});
        for (int i = 0; i < outputs; ++i) box.pins.push_back({{50, pin(i, outputs, rows)}, Side::right});
        boxes.push_back(box);
        corners.push_back(corner);
        return boxes.size() - 1;
    }
    static double pin(int i, int n, int rows) { return 10.0 * rows + 20.0 * i - 10.0 * (n - 1); }

    std::size_t outputs_from(std::size_t box) const {
        const auto& pins = boxes[box].pins;
        return static_cast<std::size_t>(
            std::count_if(pins.begin(), pins.end(), [](const Box::Pin& p) { return p.side == Side::left; }));
    }

    /// Wires an output, counted from 0, to an input.
    void connect(std::size_t from, std::size_t output, std::size_t to, std::size_t input) {
        const PinOf source{from, outputs_from(from) + output};
        for (Net& net : nets)
            if (net.from.box == source.box && net.from.pin == source.pin) {
                net.to.push_back({to, input});
                return;
            }
        nets.push_back({source, {{to, input}}});
    }

    Rectangle place(std::size_t b) const {
        return {corners[b].x, corners[b].y, boxes[b].width, boxes[b].height};
    }
    Point at(const PinOf& p) const {
        const Point& pin = boxes[p.box].pins[p.pin].at;
        return {corners[p.box].x + pin.x, corners[p.box].y + pin.y};
    }
};

/// A connected graph of chance; every input is wired, some to what comes later.
inline Graph random_graph(unsigned seed, std::size_t n, double wires_per_box = 1.5) {
    std::mt19937 random(seed);
    const auto below = [&](std::size_t m) { return static_cast<std::size_t>(random() % m); };
    Graph g;
    std::vector<int> inputs(n), outputs(n);
    int open = static_cast<int>(wires_per_box * static_cast<double>(n));
    for (std::size_t b = 1; b < n; ++b) inputs[b] = 1, --open;
    while (open-- > 0) ++inputs[below(n)];
    for (std::size_t b = 0; b < n; ++b) g.add(inputs[b], 1 + static_cast<int>(below(3)) % 2);
    for (std::size_t b = 0; b < n; ++b)
        for (int i = 0; i < inputs[b]; ++i) {
            const std::size_t back = 1 + below(std::min<std::size_t>(b + 1, 6));
            const std::size_t from = b >= back && below(6) > 0 ? b - back : below(n);
            const std::size_t outs = g.boxes[from].pins.size() - g.outputs_from(from);
            g.connect(from, below(outs), b, static_cast<std::size_t>(i));
        }
    return g;
}

inline std::string text(const Point& p) {
    std::ostringstream out;
    out << '(' << p.x << ", " << p.y << ')';
    return out.str();
}

inline std::string text(const Route& route) {
    std::string result;
    for (const Point& p : route.points) result += text(p);
    return result;
}

inline std::string overlaps(const Graph& g) {
    for (std::size_t a = 0; a < g.boxes.size(); ++a)
        for (std::size_t b = 0; b < a; ++b) {
            const Rectangle r = g.place(a), s = g.place(b);
            if (r.x < s.x + s.width && s.x < r.x + r.width && r.y < s.y + s.height && s.y < r.y + r.height)
                return "boxes " + std::to_string(b) + " and " + std::to_string(a) + " overlap";
        }
    return {};
}

struct Piece {
    std::size_t net, wire;
    Point a, b; ///< a before b
    bool is_level() const { return a.y == b.y; }
};

inline std::vector<Piece> pieces(const std::vector<std::vector<Route>>& routes) {
    std::vector<Piece> result;
    for (std::size_t n = 0; n < routes.size(); ++n)
        for (std::size_t i = 0; i < routes[n].size(); ++i) {
            const auto& p = routes[n][i].points;
            for (std::size_t k = 1; k < p.size(); ++k) {
                const bool forward = p[k - 1].x < p[k].x || p[k - 1].y < p[k].y;
                result.push_back({n, i, forward ? p[k - 1] : p[k], forward ? p[k] : p[k - 1]});
            }
        }
    return result;
}

/// Whether each wire runs from its output to its input by horizontal and vertical pieces, and leaves both by
/// their sides.
inline std::string disconnected(const Graph& g, const std::vector<std::vector<Route>>& routes) {
    if (routes.size() != g.nets.size()) return "nets are missing";
    for (std::size_t n = 0; n < routes.size(); ++n) {
        const Net& net = g.nets[n];
        if (routes[n].size() != net.to.size()) return "wires are missing";
        for (std::size_t i = 0; i < net.to.size(); ++i) {
            const auto& p = routes[n][i].points;
            const std::string where = "net " + std::to_string(n) + ", wire " + std::to_string(i);
            if (p.size() < 2 || !(p.front() == g.at(net.from)) || !(p.back() == g.at(net.to[i])))
                return where + " does not reach its pins";
            for (std::size_t k = 1; k < p.size(); ++k) {
                if ((p[k].x == p[k - 1].x) == (p[k].y == p[k - 1].y))
                    return where + " is oblique at " + text(p[k]);
                if (k > 1 && (p[k].x == p[k - 1].x) == (p[k - 1].x == p[k - 2].x))
                    return where + " does not turn at " + text(p[k - 1]);
            }
            const auto leaves = [&](const PinOf& pin, const Point& from, const Point& to) {
                switch (g.boxes[pin.box].pins[pin.pin].side) {
                case Side::left: return to.x < from.x;
                case Side::right: return to.x > from.x;
                case Side::top: return to.y < from.y;
                default: return to.y > from.y;
                }
            };
            if (!leaves(net.from, p[0], p[1])) return where + " leaves its output into the box";
            if (!leaves(net.to[i], p.back(), p[p.size() - 2]))
                return where + " enters its input through the box";
        }
    }
    return {};
}

/// Whether a wire comes nearer to a box than `margin`, but for where it ends.
inline std::string collisions(const Graph& g, const std::vector<std::vector<Route>>& routes,
                              double margin = 0) {
    for (const Piece& piece : pieces(routes))
        for (std::size_t b = 0; b < g.boxes.size(); ++b) {
            Rectangle r = g.place(b);
            const Net& net = g.nets[piece.net];
            const double m = b == net.from.box || b == net.to[piece.wire].box ? 0 : margin;
            if (piece.a.x < r.x + r.width + m && piece.b.x > r.x - m && piece.a.y < r.y + r.height + m &&
                piece.b.y > r.y - m)
                return "net " + std::to_string(piece.net) + " runs through box " + std::to_string(b) +
                       " between " + text(piece.a) + " and " + text(piece.b);
        }
    return {};
}

/// Whether wires of different nets lie on each other, or touch at their ends.
inline std::string coincidences(const std::vector<std::vector<Route>>& routes) {
    auto all = pieces(routes);
    const auto key = [](const Piece& p) {
        return p.is_level() ? std::tuple(true, p.a.y, p.a.x) : std::tuple(false, p.a.x, p.a.y);
    };
    std::sort(all.begin(), all.end(), [&](const Piece& p, const Piece& q) { return key(p) < key(q); });
    for (std::size_t k = 0; k < all.size(); ++k)
        for (std::size_t j = k + 1; j < all.size(); ++j) {
            const Piece &p = all[k], &q = all[j];
            if (p.is_level() != q.is_level() || (p.is_level() ? q.a.y > p.a.y : q.a.x > p.a.x)) break;
            const bool touch = p.is_level() ? q.a.x <= p.b.x : q.a.y <= p.b.y;
            if (touch && p.net != q.net)
                return "nets " + std::to_string(p.net) + " and " + std::to_string(q.net) +
                       " lie on each other at " + text(q.a);
        }
    return {};
}

inline int crossings(const std::vector<std::vector<Route>>& routes) {
    const auto all = pieces(routes);
    int result = 0;
    for (const Piece& p : all)
        for (const Piece& q : all)
            result += p.is_level() && !q.is_level() && p.net != q.net && q.a.x > p.a.x && q.a.x < p.b.x &&
                      p.a.y > q.a.y && p.a.y < q.b.y;
    return result;
}

inline std::size_t bends(const std::vector<std::vector<Route>>& routes) {
    std::size_t result = 0;
    for (const auto& net : routes)
        for (const Route& wire : net) result += wire.points.size() - 2;
    return result;
}

} // namespace bf::editor::layout
