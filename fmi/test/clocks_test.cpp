#include "bf/fmi/check.hpp"
#include "bf/fmi/clockwork.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bf::fmi::test {
namespace {

Description clocked() {
    Description d{.name = "clocked", .token = "{1}"};
    d.co_simulation = Interface{.identifier = "clocked", .has_event_mode = true};
    d.variables.push_back({.name = "time", .causality = Causality::independent});
    d.variables.push_back({.name = "y",
                           .reference = 1,
                           .causality = Causality::output,
                           .variability = Variability::discrete,
                           .initial = Initial::calculated,
                           .clocks = {2, 3}});
    d.variables.push_back({.name = "slow",
                           .reference = 7,
                           .type = Type::clock,
                           .causality = Causality::input,
                           .variability = Variability::discrete,
                           .ticks = Ticks{.interval = 0.03, .resolution = 100, .interval_count = 3}});
    d.variables.push_back({.name = "fast",
                           .reference = 8,
                           .type = Type::clock,
                           .causality = Causality::input,
                           .variability = Variability::discrete,
                           .ticks = Ticks{.interval = 0.002, .shift = 0.001}});
    d.outputs.push_back({1, std::vector<int>{2, 3}});
    return d;
}

TEST(Clocks, AreReadAsTheyWereWritten) {
    const Description d = clocked(), again = read_description(to_xml(d), "x.fmu");
    EXPECT_EQ(to_xml(again), to_xml(d));
    EXPECT_EQ(again.variables[1].clocks, (std::vector<int>{2, 3}));
    ASSERT_TRUE(again.variables[2].ticks && again.variables[3].ticks);
    EXPECT_EQ(*again.variables[2].ticks->interval, 0.03);
    EXPECT_EQ(again.variables[2].ticks->interval_count, 3u);
    EXPECT_EQ(again.variables[3].ticks->shift, 0.001);
    EXPECT_EQ(problems_of(d), std::vector<std::string>());
}

TEST(Clocks, TickAtMultiplesOfTheirIntervalBehindTheirShift) {
    const Clockwork clockwork(clocked(), "x.fmu");
    double last = -INFINITY;
    int compared = 0;
    for (int ms = 0; ms < 2000; ++ms) { // in whole numbers
        if (ms % 30 != 0 && ms % 2 != 1) continue;
        const double next = clockwork.next(last);
        ASSERT_NEAR(next, ms / 1000.0, 1e-12);
        last = ms / 1000.0; // with other last bits than those of multiples
        ++compared;
    }
    EXPECT_EQ(compared, 1000 + 67);
    EXPECT_EQ(clockwork.off_the_grid(0.001), nullptr);
    EXPECT_STREQ(clockwork.off_the_grid(0.0015), "fast");
    EXPECT_STREQ(clockwork.off_the_grid(0.01), "fast");
    EXPECT_STREQ(clockwork.off_the_grid(0.004), "slow");
}

TEST(Clocks, ThatBreakRulesAreProblems) {
    const auto problem = [](auto&& change) {
        Description d = clocked();
        change(d);
        std::string all;
        for (const auto& its : problems_of(d)) all += its + "\n";
        return all;
    };
    const auto has = [](const std::string& text, const std::string& part) {
        EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    has(problem([](auto& d) { d.co_simulation->has_event_mode = false; }),
        "it has clocks, but no event mode");
    has(problem([](auto& d) { d.variables[1].variability = Variability::continuous; }),
        "'y' has a clock, but is neither discrete nor tunable");
    has(problem([](auto& d) { d.variables[2].variability = Variability::tunable; }),
        "'slow' is a clock, but not discrete");
    has(problem([](auto& d) { d.variables[2].causality = Causality::local; }),
        "'slow' ticks at times of its own, but is no input");
    has(problem([](auto& d) { d.variables[2].ticks->interval_count = 4; }), "'slow' has two intervals");
}

TEST(Clocks, WhoseTicksNobodyKnowsAreRefusedByName) {
    const auto refusal = [](auto&& change) -> std::string {
        Description d = clocked();
        change(d.variables);
        try {
            const Clockwork clockwork(d, "x.fmu");
        } catch (const FmuError& error) {
            return error.what();
        }
        return "it was taken";
    };
    for (const auto kind : {Ticks::Kind::changing, Ticks::Kind::countdown})
        EXPECT_NE(refusal([&](auto& v) {
                      v[2].ticks->kind = kind;
                  }).find("x.fmu: its input clock 'slow' ticks at times"),
                  std::string::npos);
    EXPECT_NE(refusal([](auto& v) {
                  v[2].ticks->kind = Ticks::Kind::triggered;
              }).find("is triggered by another FMU"),
              std::string::npos);
    const auto tunable = [](auto& v) { v[2].ticks->kind = Ticks::Kind::tunable; };
    EXPECT_EQ(refusal(tunable), "it was taken");
    EXPECT_NE(
        refusal([&](auto& v) { tunable(v), v[2].ticks->interval.reset(); }).find("follows from parameters"),
        std::string::npos);
    const auto own = [](auto& v) {
        v[3].causality = Causality::output, v[3].ticks->kind = Ticks::Kind::triggered;
    };
    EXPECT_NE(refusal(own).find("'y' has a value only in the ticks of 'fast'"), std::string::npos);
    EXPECT_EQ(refusal([&](auto& v) { own(v), v[1].clocks = {2}; }), "it was taken"); // nothing waits for it
}

} // namespace
} // namespace bf::fmi::test
