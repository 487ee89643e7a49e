// Sensitivities of checks beside closed forms and differences of runs.
#include "bf/analysis/sensitivity.hpp"

#include "../../engine/test/support.hpp"

#include <gtest/gtest.h>

namespace bf::analysis::test {

using Checked = bf::test::Session;

namespace {

/// x' = -a x from x(0) = b: at the end b exp(-a t), and the greatest value is b.
const std::string decay = R"m(
model: decay
step: 0.001
stop: 1
solver: rk4
variables: {a: 0.7, b: 2, tolerance: 0.5}
blocks:
  x: {block: Integrator, initial: b}
  slope: {block: Gain, K: -a}
  end: {block: Check, kind: final, at_least: 0.2, at_most: 2*tolerance}
  top: {block: Check, kind: maximum, at_most: 2.5}
  level: {block: Check, kind: mean}
  is_there: {block: Check}
connections: {x: [slope, end, top, level, is_there], slope: x}
)m";

const Sensitivities::Check& named_check(const Sensitivities& all, const std::string& name) {
    for (const auto& check : all.checks)
        if (check.name == name) return check;
    throw std::runtime_error("no check " + name);
}

Sensitivities sensitivities_of(const std::string& text, const SensitivityOptions& options = {}) {
    const Checked session(text);
    return sensitivities(session.diagram, options);
}

std::string refused_sensitivity(const std::string& text, const SensitivityOptions& options) {
    try {
        sensitivities_of(text, options);
    } catch (const RunError& error) {
        return error.what();
    }
    return "nothing";
}

} // namespace

TEST(Sensitivity, OfChecksIsItsClosedForm) {
    const auto found = sensitivities_of(decay);
    ASSERT_EQ(found.names, (std::vector<std::string>{"a", "b", "tolerance"}));
    ASSERT_EQ(found.checks.size(), 3u); // what is true or false has no distance
    // The last sample is that before the end.
    const double t = 0.999, end = 2 * std::exp(-0.7 * t);
    const auto& final = named_check(found, "end");
    EXPECT_EQ(final.differenced, "");
    EXPECT_NEAR(final.value, end, 1e-10);
    EXPECT_NEAR(final.slopes[0], -t * end, 1e-8);
    EXPECT_NEAR(final.slopes[1], end / 2, 1e-8);
    EXPECT_EQ(final.slopes[2], 0);
    // The nearer limit is the upper one, which is a variable, too.
    EXPECT_NEAR(final.distance, 1 - end, 1e-10);
    EXPECT_TRUE(final.has_passed);
    EXPECT_NEAR(final.distance_slopes[0], t * end, 1e-8);
    EXPECT_NEAR(final.distance_slopes[2], 2, 1e-8);
    EXPECT_NEAR(final.change_to_limit(2), -(1 - end) / 2, 1e-8);
    const auto& top = named_check(found, "top");
    EXPECT_EQ(top.value, 2);
    EXPECT_EQ(top.slopes[0], 0);
    EXPECT_NEAR(top.slopes[1], 1, 1e-9);
    EXPECT_NEAR(top.change_to_limit(1), 0.5, 1e-9);
    EXPECT_EQ(top.change_to_limit(0), INFINITY);
    EXPECT_TRUE(std::isinf(named_check(found, "level").distance));
    EXPECT_EQ(found.checks[0].name, "end"); // 0.7 % of its parameters are enough
    EXPECT_EQ(found.checks[2].name, "level");
}

TEST(Sensitivity, ExactOnesAreThoseOfDifferences) {
    const auto exact = sensitivities_of(decay);
    const auto differenced = sensitivities_of(decay, {.by_differences = true});
    for (const auto& check : exact.checks) {
        const auto& other = named_check(differenced, check.name);
        EXPECT_EQ(other.differenced, "asked for");
        EXPECT_LT((check.slopes - other.slopes).norm(), 1e-6) << check.name;
    }
}

TEST(Sensitivity, DifferencesWhatHasNoGradientAndSaysWhy) {
    // An adaptive solver has no steps that can be differentiated.
    std::string text = decay;
    text.replace(text.find("rk4"), 3, "dormand_prince45");
    const auto found = sensitivities_of(text, {.by = {"slope.K"}, .checks = {"end"}});
    ASSERT_EQ(found.checks.size(), 1u);
    const auto& check = found.checks[0];
    EXPECT_NE(check.differenced.find("the solver chooses its steps"), std::string::npos) << check.differenced;
    EXPECT_NEAR(check.slopes[0], 0.999 * check.value, 1e-4);
    EXPECT_EQ(found.at[0], -0.7);
}

TEST(Sensitivity, NamesElementsOfParameters) {
    const auto found = sensitivities_of(R"m(
model: vector
step: 0.1
stop: 1
blocks:
  one: {block: Constant, value: "[1; 2]"}
  gain: {block: Gain, K: "[3; 4]"}
  sum: {block: Dot}
  end: {block: Check, kind: final, at_most: 20}
connections: {one: [gain, sum.u1], gain: sum.u2, sum: end}
)m",
                                        {.by = {"gain.K", "end.at_most"}});
    ASSERT_EQ(found.names, (std::vector<std::string>{"gain.K[1]", "gain.K[2]", "end.at_most"}));
    const auto& check = found.checks[0];
    EXPECT_EQ(check.value, 19);
    EXPECT_NEAR(check.slopes[0], 1, 1e-9);
    EXPECT_NEAR(check.slopes[1], 4, 1e-9);
    EXPECT_NEAR(check.distance_slopes[2], 1, 1e-9);
    EXPECT_NEAR(check.change_to_limit(1), 0.25, 1e-9);
}

TEST(Sensitivity, OfAModelWithoutVariablesIsByTheParametersOfAllBlocksButChecks) {
    const auto found = sensitivities_of(R"m(
model: m
step: 0.1
stop: 1
blocks:
  one: {block: Constant, value: 3}
  gain: {block: Gain, K: 2}
  end: {block: Check, kind: final, at_most: 20}
connections: {one: gain, gain: end}
)m");
    ASSERT_EQ(found.names, (std::vector<std::string>{"one.value", "gain.K"}));
    EXPECT_NEAR(found.checks[0].slopes[0], 2, 1e-9);
    EXPECT_NEAR(found.checks[0].slopes[1], 3, 1e-9);
}

TEST(Sensitivity, TakesElementsByTheNamesThatItGives) {
    const std::string text = R"m(
model: vector
step: 0.1
stop: 1
variables: {K: "[3, 4]", M: "[1 2; 3 4]", L: {value: 2, minimum: 1.9}}
blocks:
  one: {block: Constant, value: "[1; 2]"}
  gain: {block: Gain, K: "K'"}
  matrix: {block: Gain, K: L*M, multiplication: "K*u"}
  sum: {block: Dot}
  end: {block: Check, kind: final, at_least: 2}
connections: {one: gain, gain: [sum.u1, matrix], matrix: sum.u2, sum: end}
)m";
    const auto all = sensitivities_of(text);
    ASSERT_EQ(all.names,
              (std::vector<std::string>{"K[1]", "K[2]", "M[1][1]", "M[2][1]", "M[1][2]", "M[2][2]", "L"}));
    for (std::size_t i = 0; i < all.names.size(); ++i) {
        const auto one = sensitivities_of(text, {.by = {all.names[i]}});
        ASSERT_EQ(one.names, (std::vector<std::string>{all.names[i]}));
        EXPECT_EQ(one.checks[0].slopes[0], all.checks[0].slopes[static_cast<Eigen::Index>(i)]);
        EXPECT_NE(one.checks[0].slopes[0], 0);
    }
    EXPECT_EQ(all.least[6], 1.9);
    EXPECT_NEAR(sensitivities_of(text, {.by = {"gain.K[2]"}}).checks[0].slopes[0], all.checks[0].slopes[1],
                1e-6);
    EXPECT_EQ(refused_sensitivity(text, {.by = {"M[3][1]"}}),
              "'M' has no element [3][1]; it has 4, from M[1][1] to M[2][2]");
    EXPECT_EQ(sensitivities_of(text, {.by = {"M[3]"}}).names[0], "M[1][2]"); // column by column
}

TEST(Sensitivity, RefusesByName) {
    const auto expect = [](const std::string& refusal, const std::string& part) {
        EXPECT_NE(refusal.find(part), std::string::npos) << refusal;
    };
    expect(refused_sensitivity(decay, {.by = {"c"}}), "no parameter or variable of doubles 'c'");
    expect(refused_sensitivity(decay, {.checks = {"tpo"}}),
           "no check that reports a number 'tpo'; did you mean 'top'?");
    expect(refused_sensitivity("model: m\nstep: 0.1\nblocks: {c: {block: Clock}}\n", {}),
           "no check that reports");
    std::string endless = decay;
    endless.replace(endless.find("stop: 1"), 7, "       ");
    expect(refused_sensitivity(endless, {}), "the run has no end");
    expect(refused_sensitivity(decay, {.step = 1}), "at most 0.1");
}

TEST(Sensitivity, OfAVariableAtItsLimitIsThatOfOneSide) {
    std::string text = decay;
    text.replace(text.find("a: 0.7"), 6, "a: {value: 0.7, minimum: 0.7}");
    const auto free = sensitivities_of(decay), held = sensitivities_of(text);
    const auto by_runs = sensitivities_of(text, {.by_differences = true});
    const double slope = named_check(free, "end").slopes[0];
    EXPECT_NEAR(named_check(held, "end").slopes[0], slope, 1e-5 * std::abs(slope));
    EXPECT_NEAR(named_check(by_runs, "end").slopes[0], slope, 1e-2 * std::abs(slope));
}

TEST(Sensitivity, OfACheckThatLooksAtNothingIsRefused) {
    std::string text = decay;
    text.replace(text.find("at_most: 2.5"), 12, "at_most: 2.5, from_time: 5");
    EXPECT_EQ(refused_sensitivity(text, {.checks = {"top"}}).find("the check 'top' has looked at no step"),
              0u);
    EXPECT_EQ(refused_sensitivity(text, {.checks = {"end"}}), "nothing");
}

} // namespace bf::analysis::test
