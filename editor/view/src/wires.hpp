// What the steps of routing hand to each other: pins with their stubs, the grid that wires are sought on, and
// tracks. An axis is 0 for what runs horizontally, along x, and 1 for what runs vertically, along y.
#pragma once

#include "bf/view/place.hpp"

#include <array>
#include <cstdint>
#include <limits>

namespace bf::editor::wires {

constexpr double margin = 8;          ///< between wires and boxes
constexpr double margin_beneath = 20; ///< where a block's name stands
constexpr double spacing = 10;        ///< between wires side by side
constexpr double detour = 1000;       ///< how far beyond what it joins a wire is sought
constexpr double cost_of_bend = 30;   ///< in pixels of length
constexpr double cost_of_crossing = 20;
constexpr double cost_of_going_back_above = 40; ///< since what feeds back is expected beneath

inline double along(const Point& p, int axis) { return axis == 0 ? p.x : p.y; }
inline double across(const Point& p, int axis) { return axis == 0 ? p.y : p.x; }
/// The point at `along` of the line of `axis` at `across`.
inline Point point(int axis, double along, double across) {
    return axis == 0 ? Point{along, across} : Point{across, along};
}
inline double low(const Rectangle& r, int axis) { return axis == 0 ? r.x : r.y; }
inline double high(const Rectangle& r, int axis) { return axis == 0 ? r.x + r.width : r.y + r.height; }

/// A box with the margins that wires keep, as far as there is room.
inline Rectangle widened(const Rectangle& box) {
    return {box.x - margin, box.y - margin, box.width + 2 * margin, box.height + margin + margin_beneath};
}

/// Right, down, left, up: the axis is the lowest bit, and opposite directions differ by 2.
using Direction = int;
inline int axis_of(Direction d) { return d & 1; }
inline int sign_of(Direction d) { return d < 2 ? 1 : -1; }
inline Direction direction(const Point& from, const Point& to) {
    return from.y == to.y ? (to.x >= from.x ? 0 : 2) : (to.y >= from.y ? 1 : 3);
}

/// A pin in the drawing: the wire runs straight from `at` to `stub`, which lies outside of the box.
struct End {
    Point at, stub;
    Direction out;
};

/// The points of a net that lines of the grid go through: pins, and corners that a person drew.
struct Places {
    std::vector<End> ends;
    std::vector<Point> corners;
};

/// A piece of lines that no box stands on, with its nodes in the order of their coordinate.
struct Line {
    int axis;
    double at, from, to;
    std::vector<int> nodes = {};
};

struct Node {
    Point at;
    std::array<int, 4> next = {-1, -1, -1, -1};
    /// The net whose wire ends in a pin on this line of the axis, so that it cannot be moved aside.
    std::array<int, 2> fixed = {-1, -1};
    std::array<int, 2> through = {0, 0}; ///< how many nets run straight through
};

constexpr int nobody = -1;

/// Lines beside boxes, at pins and midway between boxes, and where they cross. A line is as long as a wire
/// may need it, so that the grid grows with the drawing and not with its square.
class Grid {
  public:
    Grid(const std::vector<Rectangle>& boxes, const std::vector<Places>& nets);

    std::vector<Node> nodes;

    int node_at(const Point& p) const;
    /// The nodes from one to another along a line; empty where the line is interrupted.
    std::vector<int> straight(const Point& from, const Point& to) const;

  private:
    /// The line of the axis through a point, as far as it is free and in the `area`.
    Line add(int axis, const Point& through, const Rectangle& area);
    void merge();
    void cross();

    const std::vector<Rectangle>& boxes_;
    Rectangle bounds_;
    std::array<std::vector<Line>, 2> lines_;
};

/// A place in the search: at a node, having come in a direction.
struct Start {
    int node;
    Direction direction;
    double cost;
};

/// The cheapest way by length, bends and crossings (A*).
class Search {
  public:
    explicit Search(const Grid& grid) : grid_(grid), states_(grid.nodes.size() * 4) {}

    /// Nodes from one of the starts to `target`, which is entered in direction `in`; empty where there is no
    /// way. Lines that are fixed for other nets are not used, unless `everywhere`.
    std::vector<int> path(int net, const std::vector<Start>& starts, int target, Direction in,
                          bool everywhere);

  private:
    struct State {
        double cost = 0;
        int before = 0;
        std::uint32_t search = 0;
        bool is_done = false;
    };
    std::vector<int> attempt(int net, const std::vector<Start>& starts, int target, Direction in,
                             bool everywhere, double weight, std::size_t limit);

    const Grid& grid_;
    std::vector<State> states_;
    std::uint32_t search_ = 0;
};

/// The fewest bends from `from` in direction `d` to `to`, entered in direction `in`.
int fewest_bends(const Point& from, Direction d, const Point& to, Direction in);

/// What moves as one when wires are spread: a straight piece of a net's tree.
struct Track {
    int axis;
    std::size_t net;
    double at, from, to;
    bool is_fixed;
};

struct Wire {
    Point start, end;
    std::vector<std::size_t> tracks; ///< from start to end, alternately of the two axes
    std::vector<Point> points(const std::vector<Track>& tracks) const;
};

/// Moves tracks of different nets apart, and into the middle of where they may run.
void spread(std::vector<Track>& tracks, const std::vector<Wire>& wires, const std::vector<Rectangle>& boxes);

} // namespace bf::editor::wires
