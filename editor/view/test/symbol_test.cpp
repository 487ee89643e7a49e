#include "../src/symbol.hpp"
#include "../src/text.hpp"

#include <gtest/gtest.h>

namespace {

using namespace bf::editor;

TEST(Polynomial, IsWrittenAsPeopleDo) {
    EXPECT_EQ(polynomial("[1 2 0.5]", "s"), "s² + 2 s + 0.5");
    EXPECT_EQ(polynomial("[1, -1]", "z"), "z − 1");
    EXPECT_EQ(polynomial("[-1 0 0]", "s"), "−s²");
    EXPECT_EQ(polynomial("3", "s"), "3");
    EXPECT_EQ(polynomial("[0 0]", "s"), "0");
    EXPECT_EQ(polynomial("[m*l 1]", "s"), "[m*l 1]");
    EXPECT_EQ(polynomial("[]", "s"), "[]");
}

TEST(Text, HasTheWidthOfHelvetica) {
    EXPECT_NEAR(text_width("A", 1000), 667, 1e-9);
    EXPECT_NEAR(text_width("Hi il", 1000), 722 + 222 + 278 + 222 + 222, 1e-9);
    EXPECT_NEAR(text_width("τ", 1000), 556, 1e-9);
}

TEST(Text, IsCutBetweenCharactersWhereItDoesNotFit) {
    EXPECT_EQ(fitted("short", 10, 100), "short");
    const std::string cut = fitted("ττττττττττ", 10, 30);
    EXPECT_LE(text_width(cut, 10), 30);
    EXPECT_EQ(cut, "ττττ…");
}

TEST(Symbol, GrowsWithItsPortsAndItsText) {
    const SettingText none = [](const std::string&) { return std::string(); };
    EXPECT_GE(symbol_of("Mux", 10, none).height, 200);
    EXPECT_EQ(symbol_of("Mux", 2, none).outline, Symbol::Outline::bar);
    const SettingText named = [](const std::string&) { return std::string("a_name_that_is_quite_long"); };
    EXPECT_GT(symbol_of("Gain", 1, named).width, symbol_of("Gain", 1, none).width);
    EXPECT_EQ(symbol_of("Other/Thing", 1, none).shapes.at(0).text, "Thing");
}

TEST(Symbol, HoldsTheTextOfAGainBetweenTheSidesOfItsTriangle) {
    for (const std::string text : {"2", "Gain.Kp", "-Gain.angular_momentum", "[1/Motor.L 0; 0 -1/Motor.J]"}) {
        const Symbol gain = symbol_of("Gain", 1, [&](const std::string&) { return text; });
        const Shape& value = gain.shapes.at(0);
        const double half = text_width(value.text, value.size) / 2, x = value.points.at(0).x;
        EXPECT_GE(x - half, 0) << text;
        // Its letters, about 8 high, fit where the triangle, narrowing to its tip, is that high.
        EXPECT_GE(gain.height * (1 - (x + half) / gain.width), 8) << text;
    }
}

} // namespace
