// Measures of step responses beside closed forms.
#include "bf/base/step_measures.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

namespace bf {
namespace {

struct Sampled {
    std::vector<double> time, value;
};
template <class Y> Sampled sampled(Y&& y, double step, double end) {
    Sampled all;
    for (int k = 0; k * step < end; ++k) {
        all.time.push_back(k * step);
        all.value.push_back(y(k * step));
    }
    return all;
}

TEST(StepMeasures, AreTheClosedFormsOfASecondOrderSystem) {
    // w² / (s² + 2 ζ w s + w²), to -3.
    const double w = 4, zeta = 0.5, root = std::sqrt(1 - zeta * zeta);
    const auto y = [&](double t) {
        return -3 * (1 - std::exp(-zeta * w * t) *
                             (std::cos(root * w * t) + zeta / root * std::sin(root * w * t)));
    };
    const auto [time, value] = sampled(y, 1e-3, 10);
    const auto found = measure_step(time, value, -3, false);
    EXPECT_NEAR(found.overshoot, 100 * std::exp(-std::numbers::pi * zeta / root), 1e-4);
    EXPECT_NEAR(found.peak_time, std::numbers::pi / (w * root), 1e-3);
    EXPECT_NEAR(found.peak, y(found.peak_time), 1e-12);
    EXPECT_EQ(found.undershoot, 0);
    EXPECT_NEAR(std::abs(y(found.settling_time) + 3), 0.06, 1e-5);
    const auto sampled_at = measure_step(time, value, -3, true);
    EXPECT_LE(std::abs(y(sampled_at.settling_time) + 3), 0.06);
    EXPECT_LT(sampled_at.settling_time - found.settling_time, 1e-3);
}

TEST(StepMeasures, OfAnExponentialAreItsLogarithms) {
    const auto [time, value] = sampled([](double t) { return 1 - std::exp(-t); }, 1e-3, 10);
    const auto found = measure_step(time, value, 1, false);
    EXPECT_NEAR(found.rise_time, std::log(9), 1e-6);
    EXPECT_NEAR(found.settling_time, std::log(50), 1e-6);
    EXPECT_EQ(found.overshoot, 0);
}

TEST(StepMeasures, SettleOnTheLineThatCrossesTheFinalValue) {
    // From +0.05 to -0.01 around 1, which is within 0.02 from half of the way on; and the mirror image.
    for (const double side : {1.0, -1.0})
        EXPECT_NEAR(
            measure_step({0, 1, 2, 3}, {0, 1 + side * 0.05, 1 - side * 0.01, 1}, 1, false).settling_time, 1.5,
            1e-12);
}

TEST(StepMeasures, SayWhatThereIsNot) {
    // What comes to 0 has nothing to be relative to, but settles within its own size.
    const auto [time, value] = sampled([](double t) { return t * std::exp(-t); }, 1e-3, 20);
    const auto fading = measure_step(time, value, 0, false);
    EXPECT_TRUE(std::isnan(fading.overshoot));
    EXPECT_TRUE(std::isnan(fading.rise_time));
    EXPECT_NEAR(fading.settling_time * std::exp(-fading.settling_time), 0.02 / std::numbers::e, 1e-6);
    const auto swinging = sampled([](double t) { return 1 + 0.5 * std::sin(t); }, 1e-2, 20);
    EXPECT_TRUE(std::isnan(measure_step(swinging.time, swinging.value, 1, false).settling_time));
    EXPECT_TRUE(
        std::isnan(measure_step(time, value, std::numeric_limits<double>::quiet_NaN(), false).settling_time));
    const auto down = sampled([](double t) { return 1 - std::exp(-t) - 2 * t * std::exp(-3 * t); }, 1e-3, 10);
    EXPECT_GT(measure_step(down.time, down.value, 1, false).undershoot, 1);
}

} // namespace
} // namespace bf
