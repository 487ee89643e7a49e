// Claims about wires: how they run around boxes and beside each other.
#include "layout.hpp"

#include <gtest/gtest.h>

namespace bf::editor::layout {
namespace {

std::vector<std::vector<Route>> routed(const Graph& g) { return route(g.boxes, g.corners, g.nets); }

/// Boxes of a graph of chance, each somewhere in a cell of its own.
Graph scattered(unsigned seed, std::size_t n) {
    Graph g = random_graph(seed, n);
    std::mt19937 random(seed);
    const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(n)))) + 1;
    std::vector<std::size_t> cells(columns * columns);
    for (std::size_t c = 0; c < cells.size(); ++c) cells[c] = c;
    std::shuffle(cells.begin(), cells.end(), random);
    for (std::size_t b = 0; b < n; ++b) {
        const auto jitter = [&] { return 5 * static_cast<double>(random() % 6); };
        g.corners[b] = {130 * static_cast<double>(cells[b] % columns) + jitter(),
                        180 * static_cast<double>(cells[b] / columns) + jitter()};
    }
    return g;
}

void expect_sound(const Graph& g, const std::vector<std::vector<Route>>& routes, const std::string& what) {
    EXPECT_EQ(disconnected(g, routes), "") << what;
    EXPECT_EQ(collisions(g, routes), "") << what;
    EXPECT_EQ(coincidences(routes), "") << what;
}

TEST(Route, IsStraightWherePinsFaceEachOther) {
    Graph g;
    g.add(0, 1, {0, 0});
    g.add(1, 0, {120, 0});
    g.connect(0, 0, 1, 0);
    EXPECT_EQ(text(routed(g)[0][0]), "(50, 20)(120, 20)");
}

TEST(Route, TurnsMidwayBetweenTwoBoxes) {
    Graph g;
    g.add(0, 1, {0, 0});
    g.add(1, 0, {120, 60});
    g.connect(0, 0, 1, 0);
    EXPECT_EQ(text(routed(g)[0][0]), "(50, 20)(85, 20)(85, 80)(120, 80)");
}

TEST(Route, GoesBackBeneathABoxAndItsName) {
    Graph g;
    g.add(1, 1, {0, 0});
    g.connect(0, 0, 0, 0);
    EXPECT_EQ(text(routed(g)[0][0]), "(50, 20)(58, 20)(58, 60)(-8, 60)(-8, 20)(0, 20)");
}

TEST(Route, LeavesAndEntersPinsOfEverySide) {
    Graph g;
    for (const Side out : {Side::left, Side::right, Side::top, Side::bottom})
        for (const Side in : {Side::left, Side::right, Side::top, Side::bottom})
            for (const Point& corner :
                 {Point{100, 0}, {0, 100}, {-100, 0}, {0, -100}, {100, 70}, {-70, -100}}) {
                const auto pin = [](Side side) {
                    return Box::Pin{{side == Side::left    ? 0.
                                     : side == Side::right ? 50.
                                                           : 25.,
                                     side == Side::top      ? 0.
                                     : side == Side::bottom ? 40.
                                                            : 20.},
                                    side};
                };
                g.boxes = {{50, 40, {pin(out)}}, {50, 40, {pin(in)}}};
                g.corners = {{0, 0}, corner};
                g.nets = {{{0, 0}, {{1, 0}}}};
                expect_sound(g, routed(g), text(corner));
            }
}

TEST(Route, SharesATrunkAndBranchesFromItOnce) {
    Graph g;
    g.add(0, 1, {0, 0});
    for (int i = 0; i < 3; ++i) g.connect(0, 0, g.add(1, 0, {150, 100.0 * i}), 0);
    const auto routes = routed(g);
    EXPECT_EQ(text(routes[0][0]), "(50, 20)(150, 20)");
    EXPECT_EQ(text(routes[0][1]), "(50, 20)(100, 20)(100, 120)(150, 120)");
    EXPECT_EQ(text(routes[0][2]), "(50, 20)(100, 20)(100, 220)(150, 220)");
    EXPECT_TRUE(routes[0][0].branches.empty());
    EXPECT_EQ(routes[0][1].branches, std::vector{Point({100, 20})});
    EXPECT_EQ(routes[0][2].branches, std::vector{Point({100, 120})});
}

TEST(Route, KeepsABundleApartWithoutCrossings) {
    for (const double lower : {-200.0, -60.0, 60.0, 200.0}) {
        Graph g;
        g.add(0, 5, {0, 0});
        g.add(5, 0, {140, lower});
        for (std::size_t i = 0; i < 5; ++i) g.connect(0, i, 1, i);
        const auto routes = routed(g);
        expect_sound(g, routes, "bundle");
        EXPECT_EQ(crossings(routes), 0);
        EXPECT_EQ(bends(routes), 10u);
        for (const Piece& p : pieces(routes))
            for (const Piece& q : pieces(routes))
                if (p.net != q.net && !p.is_level() && !q.is_level()) {
                    EXPECT_GE(std::abs(p.a.x - q.a.x), 10);
                }
    }
}

TEST(Route, LetsTwoWiresChangePlacesWithOneCrossing) {
    Graph g;
    g.add(0, 2, {0, 0});
    g.add(2, 0, {120, 0});
    g.connect(0, 0, 1, 1);
    g.connect(0, 1, 1, 0);
    const auto routes = routed(g);
    expect_sound(g, routes, "swap");
    EXPECT_EQ(crossings(routes), 1);
}

TEST(Route, BringsManyWiresThroughANarrowGap) {
    for (const double gap : {2.0, 10.0, 20.0, 40.0}) {
        Graph g;
        g.add(0, 8, {0, 0});
        g.add(8, 0, {50 + gap, 70});
        for (std::size_t i = 0; i < 8; ++i) g.connect(0, i, 1, i);
        expect_sound(g, routed(g), std::to_string(gap));
    }
}

TEST(Route, KeepsBendsThatAPersonDrew) {
    Graph g;
    g.add(0, 1, {0, 0});
    g.add(1, 0, {200, 0});
    g.add(1, 0, {200, 100});
    g.connect(0, 0, 1, 0);
    g.connect(0, 0, 2, 0);
    const std::vector<Point> drawn{{70, 20}, {70, 80}, {180, 80}, {180, 20}};
    const auto routes = route(g.boxes, g.corners, g.nets, {{drawn, {}}});
    EXPECT_EQ(text(routes[0][0]), "(50, 20)(70, 20)(70, 80)(180, 80)(180, 20)(200, 20)");
    EXPECT_EQ(routes[0][1].branches.size(), 1u) << "the other wire of the net begins on what was drawn";
    expect_sound(g, routes, "drawn");
}

TEST(Route, LeadsToDrawnBendsFromBoxesThatMoved) {
    Graph g;
    g.add(0, 1, {0, 30});
    g.add(1, 0, {200, 10});
    g.connect(0, 0, 1, 0);
    const auto routes = route(g.boxes, g.corners, g.nets, {{{{70, 20}, {70, 80}, {180, 80}, {180, 20}}}});
    EXPECT_EQ(text(routes[0][0]), "(50, 50)(70, 50)(70, 80)(180, 80)(180, 30)(200, 30)");
}

TEST(Route, OfBoxesOnEachOtherIsConnectedNevertheless) {
    for (const Point& corner : {Point{0, 0}, {30, 10}, {-30, 20}, {45, 0}, {-60, 0}}) {
        Graph g;
        g.add(1, 1, {0, 0});
        g.add(1, 1, corner);
        g.add(1, 1, {10, 10});
        for (std::size_t b = 0; b < 3; ++b) g.connect(b, 0, (b + 1) % 3, 0);
        const auto routes = routed(g);
        for (std::size_t n = 0; n < 3; ++n) {
            const auto& points = routes[n][0].points;
            ASSERT_GE(points.size(), 2u);
            EXPECT_EQ(points.front(), g.at(g.nets[n].from));
            EXPECT_EQ(points.back(), g.at(g.nets[n].to[0]));
            for (std::size_t k = 1; k < points.size(); ++k)
                EXPECT_TRUE(points[k].x == points[k - 1].x || points[k].y == points[k - 1].y) << text(corner);
        }
    }
}

TEST(Route, OfNothingIsNothing) { EXPECT_TRUE(route({}, {}, {}).empty()); }

TEST(Route, IsSoundInThousandsOfGraphsOfChance) {
    for (unsigned seed = 0; seed < 2000 && !testing::Test::HasFailure(); ++seed) {
        const Graph g = scattered(seed, 2 + seed % 25);
        expect_sound(g, routed(g), "seed " + std::to_string(seed));
    }
}

TEST(Route, LeadsAroundBoxesAlsoWhereThereAreThousands) {
    Graph g = scattered(3, 2500);
    const auto routes = routed(g);
    expect_sound(g, routes, "2,500 boxes");
}

TEST(Route, IsTheSameEachTime) {
    const Graph g = scattered(1, 30);
    const auto once = routed(g), again = routed(g);
    for (std::size_t n = 0; n < once.size(); ++n)
        for (std::size_t i = 0; i < once[n].size(); ++i) EXPECT_EQ(once[n][i].points, again[n][i].points);
}

} // namespace
} // namespace bf::editor::layout
