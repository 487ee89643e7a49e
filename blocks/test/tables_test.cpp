#include "standard_block.hpp"

namespace bf::test {
namespace {

double at(RunBlock block, const Values& u) {
    for (std::size_t i = 0; i < u.size(); ++i)
        block.set(u.size() == 1 ? "u" : "u" + std::to_string(i + 1), Values{u[i]});
    if (!block.output()) throw std::runtime_error("the step failed");
    return block.scalar("y");
}

RunBlock lookup(const char* interpolation, const char* extrapolation = "clip") {
    return make("Lookup1D", {{"breakpoints", row({0, 1, 3})},
                             {"interpolation", interpolation},
                             {"extrapolation", extrapolation}})
        .wire("table", vector_size(3))
        .wire("u", scalar_size())
        .start()
        .set("table", Values{0, 2, 18});
}

TEST(Lookup1D, InterpolatesAsAsked) {
    EXPECT_EQ(at(lookup("linear"), {2}), 10);
    EXPECT_EQ(at(lookup("flat"), {2.9}), 2);
    EXPECT_EQ(at(lookup("nearest"), {2.9}), 18);
    EXPECT_NEAR(at(lookup("spline"), {2}), 8, 1e-14); // 2 u² is the parabola through three points
    EXPECT_NEAR(at(lookup("akima"), {3}), 18, 1e-14);
}

TEST(Lookup1D, HoldsItsEndsOrGoesOn) {
    EXPECT_EQ(at(lookup("linear"), {5}), 18);
    EXPECT_EQ(at(lookup("linear", "linear"), {5}), 34);
    EXPECT_EQ(at(lookup("spline"), {-1}), 0);
    EXPECT_NEAR(at(lookup("spline", "linear"), {4}), 30, 1e-13); // slope 4 u at 3
}

TEST(Lookup1D, RefusesPointsThatDoNotIncreaseAndTablesOfAnotherLength) {
    EXPECT_EQ(refusal([] {
                  make("Lookup1D", {{"breakpoints", row({0, 2, 2})}});
              }),
              "argument 'breakpoints' must increase strictly, but element 3 is not above the one before");
    EXPECT_EQ(refusal([] {
                  make("Lookup1D", {{"breakpoints", row({0, 1, 3})}}).wire("table", vector_size(2)).start();
              }),
              "parameter 'table' of size [2] has 2 elements, but the breakpoints ask for 3");
}

TEST(Lookup2D, HasOneRowPerFirstBreakpoint) {
    const Arguments arguments{{"breakpoints1", row({0, 1})}, {"breakpoints2", row({0, 1, 3})}};
    auto block = make("Lookup2D", arguments).wire("table", matrix_size(2, 3));
    block.wire("u1", scalar_size()).wire("u2", vector_size(2)).start();
    block.set("table", (Matrix(2, 3) << 0, 1, 3, 10, 11, 13).finished());
    block.set("u1", Values{0.5}).set("u2", Values{2, 9});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{7, 8})); // 10 u1 + u2, held at 3
    EXPECT_EQ(refusal([&] { make("Lookup2D", arguments).wire("table", matrix_size(3, 2)).start(); }),
              "parameter 'table' of size 3x2 must be 2 x 3: one row per breakpoint of the first input");
}

TEST(LookupND, TakesBreakpointsForEachDimension) {
    auto block = make("LookupND", {{"dimensions", 3}, {"breakpoints3", row({0, 2})}});
    for (const char* name : {"u1", "u2", "u3"}) block.wire(name, scalar_size());
    block.wire("table", vector_size(8)).start().set("table", Values{0, 1, 10, 11, 100, 101, 110, 111});
    EXPECT_NEAR(at(block, {0.5, 0.25, 0.5}), 0.5 + 2.5 + 25, 1e-12);
    EXPECT_EQ(refusal([] {
                  make("LookupND", {{"dimensions", 7}});
              }),
              "argument 'dimensions' must be from 1 to 6, but is 7");
}

TEST(DirectLookup, TakesTheElementAndClipsOrStops) {
    const auto block = [](const char* outside) {
        return make("DirectLookup", {{"dimensions", 2}, {"outside", outside}})
            .wire("table", matrix_size(2, 3))
            .wire("i1", scalar_size())
            .wire("i2", scalar_size())
            .start()
            .set("table", (Matrix(2, 3) << 1, 2, 3, 4, 5, 6).finished());
    };
    auto clips = block("clip").set("i1", Values{2}).set("i2", Values{3.9});
    ASSERT_TRUE(clips.output());
    EXPECT_EQ(clips.scalar("y"), 6);
    clips.set("i1", Values{-4}).set("i2", Values{9});
    ASSERT_TRUE(clips.output());
    EXPECT_EQ(clips.scalar("y"), 3);
    auto stops = block("error").set("i1", Values{1}).set("i2", Values{4});
    EXPECT_EQ(stops.output().text(), "an index is outside the table");
}

TEST(Prelookup, FeedsInterpolateAt) {
    auto find = make("Prelookup", {{"breakpoints", row({0, 1, 3})}}).wire("u", scalar_size()).start();
    auto table = make("InterpolateAt", {{"size", 3}}).wire("table", vector_size(3));
    table.wire("k1", scalar_size()).wire("f1", scalar_size()).start().set("table", Values{0, 2, 18});
    for (const auto& [u, y] :
         std::vector<std::pair<double, double>>{{-1, 0}, {0.5, 1}, {2, 10}, {3, 18}, {9, 18}}) {
        find.set("u", Values{u});
        ASSERT_TRUE(find.output());
        table.set("k1", Values{find.scalar("k")}).set("f1", Values{find.scalar("f")});
        ASSERT_TRUE(table.output());
        EXPECT_EQ(table.scalar("y"), y) << u;
    }
}

} // namespace
} // namespace bf::test
