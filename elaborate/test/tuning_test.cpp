#include "bf/elaborate/tuning.hpp"

#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

const std::string text = R"m(
model: m
step: T
variables:
  T: 0.01
  n: 2
  Gain: {Kp: 3, Kd: 2*sqrt(Gain.Kp), row: [1, 2]}
  limit: Gain.Kp + T
  mode: 'fast'
blocks:
  p: {block: Gain, K: Gain.Kp}
  d: {block: Gain, K: "Gain.Kd*[1 2]"}
  free: {block: Constant, value: 5}
  sized: {block: Constant, value: "zeros(n, 1)"}
  part:
    variables: {copy: Gain, factor: 2*copy.Kp}
    inputs: [u]
    outputs: [y]
    blocks:
      g: {block: Gain, K: "factor*copy.row(2)"}
    connections: {u: g, g: y}
connections: {free: [p, d, part.u]}
)m";

/// What elaboration gives the parameters with these overrides.
NamedValues elaborated(const Overrides& overrides, const NamedValues& names) {
    const auto model = elaborate_text(text, overrides);
    NamedValues values;
    for (const auto& [name, ignored] : names) {
        const auto dot = name.rfind('.');
        values.emplace_back(name, model.slot(name.substr(0, dot), name.substr(dot + 1)).initial);
    }
    return values;
}

TEST(Tuning, GivesTheParametersThatElaborationGivesWithTheSameOverride) {
    const auto model = elaborate_text(text);
    const Tuning tuning(model.diagram);
    const NamedValues followed = tuning.follow({{"Gain.Kp", {7}}});
    ASSERT_EQ(followed.size(), 3u);
    EXPECT_EQ(followed[0].first, "p.K");
    EXPECT_EQ(followed[1].first, "d.K");
    EXPECT_EQ(followed[2].first, "part.g.K");
    EXPECT_EQ(followed, elaborated({{"Gain.Kp", "7"}}, followed));
    const NamedValues row = tuning.follow({{"Gain.row", {1, 8}}});
    EXPECT_EQ(row, (NamedValues{{"part.g.K", {48}}}));
    EXPECT_EQ(row, elaborated({{"Gain.row", "[1 8]"}}, row));
}

TEST(Tuning, KeepsWhatWasGivenByName) {
    const auto model = elaborate_text(text);
    Tuning tuning(model.diagram);
    const NamedValues both{{"Gain.Kp", {7}}, {"Gain.Kd", {1}}, {"p.K", {9}}};
    const NamedValues followed = tuning.follow(both);
    EXPECT_EQ(followed, elaborated({{"Gain.Kp", "7"}, {"Gain.Kd", "1"}, {"p.K", "9"}}, followed));
    tuning.accept(both);
    EXPECT_EQ(tuning.follow({{"Gain.Kp", {8}}}), (NamedValues{{"part.g.K", {32}}}));
    for (const auto& variable : tuning.variables()) {
        if (variable.path == "Gain.Kd") EXPECT_EQ(variable.values, std::vector<double>{1});
    }
}

std::string refusal(const NamedValues& changes) {
    const auto model = elaborate_text(text);
    try {
        Tuning(model.diagram).follow(changes);
    } catch (const TuningError& error) {
        return error.what();
    }
    return {};
}

TEST(Tuning, RefusesWhatIsFixedAndSaysWhy) {
    EXPECT_EQ(refusal({{"T", {0.1}}}),
              "variable 'T' cannot change in a run: 'step' follows from it: it is fixed when "
              "the model is elaborated");
    EXPECT_EQ(refusal({{"n", {3}}}),
              "'sized.value', which follows, would become a 3x1 double; it is a 2x1 double");
    EXPECT_EQ(refusal({{"Gain.row", {1}}}), "variable 'Gain.row' has 2 elements, not 1");
    EXPECT_EQ(refusal({{"Gain.Kp", {0.0 / 0.0}}}), "variable 'Gain.Kp' takes numbers that are not NaN");
    EXPECT_EQ(
        refusal({{"Gain.Kp", {-1}}}),
        "'Gain.Kd', which follows, has no value: sqrt(-1) is complex; complex numbers are not supported");
    EXPECT_EQ(refusal({{"mode", {1}}}), "variable 'mode' cannot change in a run: it is a text");
}

TEST(Tuning, RefusesParametersThatFollowOutsideOfTheirLimits) {
    const auto model =
        elaborate_text("model: m\nstep: 1\nvariables: {w: 4, twice: 2*w}\nblocks:\n"
                       "  inside:\n    blocks: {p: {block: Pulse, cycle: 1/w, width: twice}}\n");
    Tuning tuning(model.diagram);
    const auto refused = [&](const NamedValues& changes) -> std::string {
        try {
            tuning.follow(changes);
            tuning.accept(changes);
        } catch (const TuningError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(refused({{"w", {60}}}), "parameter 'inside.p.width' must be from 0 to 100, but is 120");
    EXPECT_EQ(refused({{"w", {-4}}}), "parameter 'inside.p.cycle' must be greater than 0, but is -0.25");
    EXPECT_EQ(tuning.variables()[0].values, std::vector<double>{4});
    EXPECT_EQ(refused({{"w", {60}}, {"inside.p.width", {50}}}), "") << "what was given follows no more";
}

TEST(Tuning, IterationsKnowTheirNumberAndShareTheVariables) {
    const auto model = elaborate_text(R"m(
model: m
step: 1
variables: {k: 10}
blocks:
  c: {block: Constant, value: [1, 2]}
  each:
    execution: for_each
    iterations: 2
    inputs: {u: {each: true}}
    outputs: [y]
    blocks: {g: {block: Gain, K: k*iteration}}
    connections: {u: g, g: y}
connections: {c: each.u}
)m");
    EXPECT_EQ(Tuning(model.diagram).follow({{"k", {100}}}),
              (NamedValues{{"each(1).g.K", {100}}, {"each(2).g.K", {200}}}));
}

} // namespace
} // namespace bf::test
