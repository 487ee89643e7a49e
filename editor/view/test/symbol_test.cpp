#include "../src/symbol.hpp"
#include "../src/text.hpp"

#include <gtest/gtest.h>
#include <map>

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

/// The settings "name=value" of a block.
SettingText settings(std::map<std::string, std::string> all) {
    return [all](const std::string& name) { return all.contains(name) ? all.at(name) : std::string(); };
}

TEST(Symbol, ShowsWhatItsSettingsSay) {
    const auto text = [](const char* type, std::map<std::string, std::string> all) {
        return symbol_of(type, 1, settings(std::move(all))).shapes.at(0).text;
    };
    EXPECT_EQ(text("Delay", {{"steps", "12"}}), "z⁻¹²");
    EXPECT_EQ(text("Delay", {{"steps", "n"}}), "z⁻ⁿ");
    EXPECT_EQ(text("CompareToConstant", {{"operator", "<="}, {"constant", "3"}}), "≤ 3");
    EXPECT_EQ(text("Relational", {{"operator", "'~='"}}), "≠");
    EXPECT_EQ(text("Selector", {{"indices", "[1 3]"}}), "u([1 3])");
    EXPECT_EQ(text("Bias", {{"bias", "0.3"}}), "u + 0.3");
    EXPECT_EQ(text("Bias", {{"bias", "-0.3"}}), "u − 0.3");
    EXPECT_EQ(text("Bias", {{"bias", "-a+b"}}), "u + -a+b");
    EXPECT_EQ(symbol_of("Product", 2, settings({{"operations", "'*/'"}})).signs,
              (std::vector<std::string>{"×", "÷"}));
}

TEST(Symbol, DrawsATableFromItsNumbers) {
    const auto curve = [](std::map<std::string, std::string> all) {
        return symbol_of("Lookup1D", 1, settings(std::move(all))).shapes.at(1).points;
    };
    const auto rising = curve({{"breakpoints", "[0 1 4]"}, {"table", "[-1, 0, 1]"}});
    ASSERT_EQ(rising.size(), 3u);
    EXPECT_NEAR((rising[1].x - rising[0].x) / (rising[2].x - rising[0].x), 0.25, 1e-9);
    EXPECT_GT(rising[0].y, rising[2].y) << "y grows downwards";
    EXPECT_EQ(curve({{"breakpoints", "[0 1 4]"}, {"table", "[1 2 3]"}, {"interpolation", "flat"}}).size(),
              5u);
    for (const char* table : {"values", "[1 2]", "[1 2 Inf]", "[1 2 x]"}) // else any curve
        EXPECT_GT(curve({{"breakpoints", "[0 1 4]"}, {"table", table}}).size(), 3u) << table;
}

} // namespace
