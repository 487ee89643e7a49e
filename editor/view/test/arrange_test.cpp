// Claims about where boxes are put.
#include "layout.hpp"

#include <gtest/gtest.h>

namespace bf::editor::layout {
namespace {

Graph arranged(Graph g) {
    g.corners = arrange(g.boxes, g.nets);
    return g;
}

bool is_left_of(const Graph& g, std::size_t a, std::size_t b) {
    return g.place(a).x + g.place(a).width < g.place(b).x;
}

TEST(Arrange, MakesAChainOneStraightLineThroughThePins) {
    Graph g;
    for (int i = 0; i < 6; ++i) g.add(i > 0, i < 5);
    for (std::size_t b = 0; b < 6; ++b) g.boxes[b].height = b % 2 ? 40 : 70; // whatever their heights
    for (std::size_t b = 0; b < 6; ++b)
        for (Box::Pin& pin : g.boxes[b].pins) pin.at.y = b % 2 ? 20 : 35;
    for (std::size_t b = 1; b < 6; ++b) g.connect(b - 1, 0, b, 0);
    g = arranged(g);
    const auto routes = route(g.boxes, g.corners, g.nets);
    EXPECT_EQ(bends(routes), 0u);
    for (std::size_t b = 1; b < 6; ++b) EXPECT_TRUE(is_left_of(g, b - 1, b));
}

TEST(Arrange, StandsInOneLineTheLoopOfAControllerWhoseFeedbackRunsBeneath) {
    Graph g;
    const auto reference = g.add(0, 1), error = g.add(2, 1), controller = g.add(1, 1), plant = g.add(1, 1),
               scope = g.add(1, 0);
    g.connect(reference, 0, error, 0);
    g.connect(error, 0, controller, 0);
    g.connect(controller, 0, plant, 0);
    g.connect(plant, 0, error, 1);
    g.connect(plant, 0, scope, 0);
    g = arranged(g);
    for (std::size_t b = 1; b < 5; ++b) EXPECT_TRUE(is_left_of(g, b - 1, b));
    const auto routes = route(g.boxes, g.corners, g.nets);
    EXPECT_EQ(crossings(routes), 0);
    EXPECT_EQ(bends(routes), 4u) << "of the feedback alone";
    double lowest = 0;
    for (std::size_t b = 0; b < 5; ++b) lowest = std::max(lowest, g.corners[b].y + g.boxes[b].height);
    const auto& feedback = routes[3][0].points;
    EXPECT_GT(feedback[3].y, lowest);
    EXPECT_EQ(routes[3][0].branches.size() + routes[3][1].branches.size(), 1u);
}

TEST(Arrange, PutsAConstantBesideWhatReadsIt) {
    Graph g;
    const auto source = g.add(0, 1), first = g.add(1, 1), sum = g.add(2, 0), constant = g.add(0, 1);
    g.connect(source, 0, first, 0);
    g.connect(first, 0, sum, 0);
    g.connect(constant, 0, sum, 1);
    g = arranged(g);
    EXPECT_TRUE(is_left_of(g, source, constant));
    EXPECT_EQ(g.corners[constant].x, g.corners[first].x);
}

TEST(Arrange, OrdersBoxesLikeThePinsTheyAreWiredTo) {
    Graph g;
    const auto sum = g.add(4, 0);
    for (const std::size_t input : {2, 0, 3, 1}) g.connect(g.add(0, 1), 0, sum, input);
    g = arranged(g);
    EXPECT_EQ(crossings(route(g.boxes, g.corners, g.nets)), 0);
}

TEST(Arrange, KeepsTheOrderOfTheDocumentWhereNothingElseDecides) {
    Graph g;
    const auto source = g.add(0, 1);
    for (int i = 0; i < 5; ++i) g.connect(source, 0, g.add(1, 0), 0);
    g = arranged(g);
    for (std::size_t b = 2; b < 6; ++b) EXPECT_LT(g.corners[b - 1].y, g.corners[b].y);
}

TEST(Arrange, LeavesAFreeLaneForAWireThatPassesALayer) {
    Graph g;
    const auto source = g.add(0, 2), first = g.add(1, 1), second = g.add(1, 1), sum = g.add(2, 0);
    g.connect(source, 0, first, 0);
    g.connect(first, 0, second, 0);
    g.connect(second, 0, sum, 0);
    g.connect(source, 1, sum, 1);
    g = arranged(g);
    const auto routes = route(g.boxes, g.corners, g.nets);
    EXPECT_EQ(crossings(routes), 0);
    EXPECT_LE(bends(routes), 4u);
}

TEST(Arrange, LeavesRoomForTracksBetweenLayers) {
    Graph g;
    const auto source = g.add(0, 12), target = g.add(12, 0);
    for (std::size_t i = 0; i < 12; ++i) g.connect(source, i, target, 11 - i);
    g = arranged(g);
    EXPECT_GE(g.corners[target].x - g.corners[source].x - g.boxes[source].width, 120);
}

TEST(Arrange, StacksPartsAndPutsBoxesWithoutWiresAtTheEnd) {
    Graph g;
    const auto alone = g.add(1, 1), a = g.add(0, 1), b = g.add(1, 0), c = g.add(0, 1), d = g.add(1, 0),
               lonely = g.add(0, 0);
    g.connect(c, 0, d, 0);
    g.connect(a, 0, b, 0);
    g = arranged(g);
    EXPECT_GT(g.corners[c].y, g.corners[a].y + g.boxes[a].height);
    EXPECT_EQ(g.corners[a].x, g.corners[c].x);
    EXPECT_GT(g.corners[alone].y, g.corners[d].y + g.boxes[d].height);
    EXPECT_EQ(g.corners[alone].y, g.corners[lonely].y);
    EXPECT_TRUE(is_left_of(g, alone, lonely));
}

TEST(Arrange, BeginsANewRowOfBoxesWithoutWiresWhereOneIsFull) {
    Graph g;
    for (int i = 0; i < 30; ++i) g.add(0, 1);
    g = arranged(g);
    EXPECT_EQ(overlaps(g), "");
    for (const Point& corner : g.corners) EXPECT_LE(corner.x, 600);
}

TEST(Arrange, TakesNoBoxesAndABoxThatIsWiredToItself) {
    EXPECT_TRUE(arrange({}, {}).empty());
    Graph g;
    g.add(1, 1);
    g.connect(0, 0, 0, 0);
    EXPECT_EQ(arranged(g).corners, std::vector{Point({0, 0})});
}

TEST(Arrange, LeavesSoundRoomForWiresInThousandsOfGraphsOfChance) {
    for (unsigned seed = 0; seed < 2000 && !testing::Test::HasFailure(); ++seed) {
        const Graph g = arranged(random_graph(seed, 2 + seed % 30, 1 + 0.1 * (seed % 11)));
        const auto routes = route(g.boxes, g.corners, g.nets);
        const std::string what = "seed " + std::to_string(seed);
        EXPECT_EQ(overlaps(g), "") << what;
        EXPECT_EQ(disconnected(g, routes), "") << what;
        EXPECT_EQ(collisions(g, routes, 4), "") << what;
        EXPECT_EQ(coincidences(routes), "") << what;
        for (const Point& corner : g.corners)
            EXPECT_TRUE(std::fmod(corner.x, 5) == 0 && std::fmod(corner.y, 5) == 0) << what << text(corner);
    }
}

TEST(Arrange, PutsWhatIsReadToTheLeftUnlessTheReaderStandsInALoop) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        Graph g = random_graph(seed, 25);
        for (Net& net : g.nets)
            std::erase_if(net.to, [&](const PinOf& to) { return to.box <= net.from.box; });
        std::erase_if(g.nets, [](const Net& net) { return net.to.empty(); });
        g = arranged(g);
        for (const Net& net : g.nets)
            for (const PinOf& to : net.to) EXPECT_TRUE(is_left_of(g, net.from.box, to.box)) << seed;
    }
}

TEST(Arrange, IsTheSameEachTime) {
    const Graph g = random_graph(1, 60);
    EXPECT_EQ(arrange(g.boxes, g.nets), arrange(g.boxes, g.nets));
}

} // namespace
} // namespace bf::editor::layout
