#include "bf/recording/plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <limits>
#include <numeric>
#include <span>
#include <sstream>

namespace bf::recording {
namespace {

class Plot : public testing::Test {
  protected:
    Plot() {
        std::string name = testing::TempDir() + "bf_plot_XXXXXX";
        folder_ = ::mkdtemp(name.data());
    }
    ~Plot() override { std::filesystem::remove_all(folder_); }

    std::string draw(const Figure& figure, const char* name, int width = 960, int height = 0) const {
        save(figure, folder_ / name, width, height);
        std::ifstream file(folder_ / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    std::string error_of(const Figure& figure, const std::filesystem::path& path, int width = 960,
                         int height = 0) const {
        try {
            save(figure, path, width, height);
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "no error";
    }
    std::filesystem::path folder_;
};

#define EXPECT_CONTAINS(text, part) EXPECT_NE(std::string(text).find(part), std::string::npos) << text

Curve line(const std::string& name, std::vector<double> values) {
    std::vector<double> time(values.size());
    std::iota(time.begin(), time.end(), 0.0);
    return {name, time, std::move(values)};
}

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t n = 0;
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

std::uint32_t big_endian(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
}

TEST_F(Plot, DrawsAPngOfTheGivenSize) {
    const std::string png = draw({"t", {{"a", "m", {line("x", {1, 2, 1})}}}}, "a.png", 640, 300);
    EXPECT_EQ(png.substr(1, 3), "PNG");
    EXPECT_EQ(big_endian(png, 16), 640u);
    EXPECT_EQ(big_endian(png, 20), 300u);
}

TEST_F(Plot, ShowsNamesAsTheyAre) {
    // Marks that gnuplot or SVG would take for commands.
    const std::string svg =
        draw({"it's `date` {a}_1^2",
              {{"tau_des & <tau>",
                "N·m",
                {line("l_knee[0]", {1, 2}), line("@x \"y\" \\n", {2, 1}), line("'it''", {1, 1})}}}},
             "a.svg");
    for (const char* text : {"it's `date` {a}_1^2", "tau_des &amp; &lt;tau>", "N·m", "@x \"y\" \\n", "'it''",
                             "l_knee[0]", "time (s)"})
        EXPECT_CONTAINS(svg, text);
}

TEST_F(Plot, DrawsOneLinePerCurveAndDashesReferences) {
    Panel panel{"q", "rad", {line("q", {0, 1, 2}), line("q_ref", {0, 2, 2})}};
    const std::string without = draw({"", {panel}}, "a.svg");
    panel.curves[1].reference = true;
    const std::string with = draw({"", {panel}}, "b.svg");
    EXPECT_GT(count(with, "stroke-dasharray"), count(without, "stroke-dasharray"));
    EXPECT_GT(count(with, "rgb(  0,  51,  80)"), 0u) << "the colour of q, darker";
}

TEST_F(Plot, NamesAllOfManyCurves) {
    Panel panel{"tau", "N m", {}};
    for (int i = 0; i < 40; ++i) panel.curves.push_back(line("<" + std::to_string(i), {0.0 + i, 1.0 + i}));
    for (const int height : {0, 250}) {
        const std::string svg = draw({"", {panel}}, "a.svg", 960, height);
        for (int i = 0; i < 40; ++i) EXPECT_EQ(count(svg, "&lt;" + std::to_string(i) + "</text>"), 1u);
    }
}

TEST_F(Plot, ShortensLongNamesInTheMiddle) {
    const std::string name = "controller." + std::string(200, 'x') + "é.torques[12]";
    const std::string svg = draw({name, {{name, name, {line(name, {1, 2}), line("y", {2, 1})}}}}, "a.svg");
    EXPECT_EQ(count(svg, name), 0u);
    EXPECT_EQ(count(svg, "controller.xx"), 4u);
    EXPECT_EQ(count(svg, "é.torques[12]</text>"), 4u);
    EXPECT_EQ(count(svg, "…"), 4u);
}

TEST_F(Plot, WritesAsManyDigitsAsTicksNeedToDiffer) {
    const std::string svg = draw({"", {{"", "", {line("x", {1e6 - 1, 1e6 + 1})}}}}, "a.svg");
    for (const char* tick : {">999999.5<", ">1000000<", ">1000000.5<"}) EXPECT_CONTAINS(svg, tick);
}

TEST_F(Plot, EndsTheTimeAxisAtATickThatIsNear) {
    Curve run = line("x", std::vector<double>(200, 1.0));
    for (double& t : run.time) t *= 0.1;
    EXPECT_CONTAINS(draw({"", {{"", "", {run}}}}, "a.svg"), ">20</text>");
}

TEST_F(Plot, SurvivesConstantsGapsExtremesAndNothing) {
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    const Figure figure{"",
                        {{"constant", "", {line("x", {3, 3, 3})}},
                         {"gaps", "", {line("x", {1, nan, 2, inf, 3, -inf})}},
                         {"nothing finite", "", {line("x", {nan, nan}), line("y", {inf})}},
                         {"no samples", "", {line("x", {})}},
                         {"no curves", "", {}},
                         {"one sample", "", {line("x", {1})}},
                         {"huge", "", {line("x", {-1e308, 1e308}), line("y", {1e-300, 2e-300})}}}};
    EXPECT_FALSE(draw(figure, "a.png").empty());
    const std::vector<double> many(100'000, nan);
    EXPECT_FALSE(draw({"", {{"times and values that are none", "", {{"x", many, many}}}}}, "c.png").empty());
    EXPECT_FALSE(draw({"", {figure.panels[3]}}, "b.svg").empty());
}

TEST_F(Plot, KeepsEveryPeakOfALongRecordingInASmallFile) {
    std::vector<double> values(1'000'000);
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = std::sin(1e-4 * double(k));
    const auto top = [&] { // y of the highest point of the longest path, which is that of x
        const std::string svg =
            draw({"", {{"", "", {line("x", values), line("frame", {-60, 60})}}}}, "a.svg");
        EXPECT_LT(svg.size(), 300'000u);
        std::string longest;
        for (auto at = svg.find("d='"); at != std::string::npos; at = svg.find("d='", at + 1)) {
            const std::string path = svg.substr(at + 3, svg.find("'", at + 3) - at - 3);
            if (path.size() > longest.size()) longest = path;
        }
        std::istringstream points(longest);
        double highest = 1e9, x = 0, y = 0;
        for (char mark = 0, comma = 0; points >> mark;)
            if (mark == 'M' || mark == 'L') {
                points >> x >> comma >> y;
                highest = std::min(highest, y);
            }
        return highest;
    };
    const double without = top();
    values[500'001] = 50; // a single sample
    EXPECT_LT(top(), without - 50);
}

TEST_F(Plot, SaysWhatIsWrong) {
    const Figure good{"", {{"p", "", {line("x", {1, 2})}}}};
    EXPECT_CONTAINS(error_of(good, folder_ / "a.jpg"), "figures are .png or .svg files, not '.jpg'");
    EXPECT_CONTAINS(error_of({"none", {}}, folder_ / "a.png"), "the figure 'none' has no panel");
    EXPECT_CONTAINS(error_of({"", {{"p", "", {{"x", {1, 2}, {1}}}}}}, folder_ / "a.png"),
                    "the curve 'x' of the panel 'p' has 2 times and 1 values");
    EXPECT_CONTAINS(error_of(good, folder_ / "a.png", 960, 50),
                    "50 pixels are too low for 1 panels; use at least 116");
    EXPECT_CONTAINS(error_of(good, folder_ / "a.png", 100), "100 pixels are too narrow for axes and legend");
    EXPECT_CONTAINS(error_of(good, "/nowhere/a.png"), "cannot draw '/nowhere/a.png': gnuplot failed");
    std::filesystem::create_symlink("/dev/full", folder_ / "full.svg");
    EXPECT_CONTAINS(error_of(good, folder_ / "full.svg"), "the file is not whole");
}

TEST_F(Plot, TellsHowToGetGnuplotWhenItIsMissing) {
    const std::string path = std::getenv("PATH");
    ::setenv("PATH", folder_.c_str(), 1);
    const std::string error = error_of({"", {{"p", "", {line("x", {1, 2})}}}}, folder_ / "a.png");
    ::setenv("PATH", path.c_str(), 1);
    EXPECT_CONTAINS(error, "cannot run gnuplot, which draws the figures: No such file or directory");
    EXPECT_CONTAINS(error, "gnuplot-nox");
}

TEST_F(Plot, DrawsHeldSignalsAsStairsToTheEndOfTheFigure) {
    // Two samples of a held signal are a stair of three more corners, the last one at the end.
    const auto corners = [&](bool steps) {
        Panel panel{"p", "", {line("x", {0, 1, 0, 1}), line("y", {1, 3})}};
        panel.curves[1].steps = steps;
        const std::string svg = draw({"", {panel}}, "a.svg");
        return count(svg, " L") + count(svg, "\tL");
    };
    EXPECT_EQ(corners(true), corners(false) + 2);
    Channel channel{"y", "/y", {.is_held = true}, {0}, std::vector<std::byte>(8)};
    EXPECT_TRUE(panel_of(channel).curves[0].steps);
    channel.info.is_held = false;
    EXPECT_FALSE(panel_of(channel).curves[0].steps);
}

TEST_F(Plot, NamesTheValuesOfAnEnumeration) {
    Panel panel{"mode", "", {line("mode", {0, 5, 5})}, {{0, "idle"}, {5, "walking"}}};
    const std::string svg = draw({"", {panel}}, "a.svg");
    EXPECT_CONTAINS(svg, "idle");
    EXPECT_CONTAINS(svg, "walking");
}

TEST_F(Plot, MakesAPanelOfASignal) {
    const std::int8_t bytes[] = {1, -2, 3, -4};
    const auto raw = std::as_bytes(std::span(bytes));
    const Channel mode{
        "mode", "/mode", {ElementType::Int8, 2, 1, false, "1"}, {0, 500'000'000}, {raw.begin(), raw.end()}};
    const Panel panel = panel_of(mode);
    EXPECT_EQ(panel.y_label, "1");
    ASSERT_EQ(panel.curves.size(), 2u);
    EXPECT_EQ(panel.curves[1].name, "mode[2]");
    EXPECT_EQ(panel.curves[1].time, (std::vector{0, 0.5}));
    EXPECT_EQ(panel.curves[1].value, (std::vector<double>{-2, -4}));
    EXPECT_TRUE(panel.curves[1].steps);
}

TEST_F(Plot, HasAnyCommonAxis) {
    const Panel panel{"gain", "dB", {{"", {0.1, 1, 10, 100}, {0, 0, -20, -40}}}};
    const std::string svg = draw({"", {panel}, "frequency (rad/s)", true}, "a.svg");
    EXPECT_CONTAINS(svg, "frequency (rad/s)");
    EXPECT_EQ(svg.find("time (s)"), std::string::npos);
    for (const char* tick : {">0.1<", ">1<", ">10<", ">100<"}) EXPECT_CONTAINS(svg, tick);
}

TEST_F(Plot, HasTicksOnALogarithmicAxisWithinADecade) {
    const auto labelled = [&](double low, double high) {
        Figure figure{"", {{"a", "", {{"c", {low, high}, {30, 40}}}}}, "rad/s", true};
        const std::string svg = draw(figure, "l.svg");
        std::vector<std::string> found;
        for (const char* tick : {"1", "1.2", "1.4", "2", "5", "10", "100"})
            if (svg.find(std::string(">") + tick + "</tspan>") != svg.npos ||
                svg.find(std::string(">") + tick + "<") != svg.npos)
                found.push_back(tick);
        return found;
    };
    EXPECT_EQ(labelled(1.00003, 9.997), (std::vector<std::string>{"2", "5"}));
    const auto near = labelled(1.1, 1.5);
    EXPECT_TRUE(std::count(near.begin(), near.end(), "1.2") && std::count(near.begin(), near.end(), "1.4"));
    const auto wide = labelled(0.5, 200);
    EXPECT_TRUE(std::count(wide.begin(), wide.end(), "10") && !std::count(wide.begin(), wide.end(), "5"));
}

TEST_F(Plot, DrawsACircleAsACircle) {
    Curve circle{"", {}, {}};
    for (int i = 0; i <= 100; ++i) {
        circle.time.push_back(std::cos(0.0628318530718 * i));
        circle.value.push_back(std::sin(0.0628318530718 * i));
    }
    const Curve pole{"pole", {-1}, {0}, false, false, Curve::Mark::cross};
    const std::string svg = draw({"", {{"", "", {circle, pole}}}, "real part", false, true}, "a.svg");
    // The path of the longest line: as wide as it is high.
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    std::size_t longest = 0, at = std::string::npos;
    for (auto from = svg.find(" d='M"); from != std::string::npos; from = svg.find(" d='M", from + 1))
        if (const auto size = svg.find('\'', from + 4) - from; size > longest) longest = size, at = from;
    ASSERT_NE(at, std::string::npos);
    std::string path = svg.substr(at + 4, longest - 4);
    for (char& c : path)
        if (c == 'M' || c == 'L' || c == ',') c = ' ';
    std::istringstream numbers(path);
    for (double x, y; numbers >> x >> y;) {
        low[0] = std::min(low[0], x), high[0] = std::max(high[0], x);
        low[1] = std::min(low[1], y), high[1] = std::max(high[1], y);
    }
    EXPECT_NEAR(high[0] - low[0], high[1] - low[1], 2);
    EXPECT_GT(high[0] - low[0], 50);
}

} // namespace
} // namespace bf::recording
