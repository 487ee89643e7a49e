#include "bf/analysis/response.hpp"

#include <gtest/gtest.h>
#include <numbers>

namespace bf::analysis::test {

namespace {

/// 1/(s (s + 1) (s + 2)), of which textbooks know all margins.
LinearSystem integrating(double gain) {
    LinearSystem s;
    s.A = Matrix::Zero(3, 3);
    s.A << 0, 1, 0, 0, 0, 1, 0, -2, -3;
    s.B = Matrix::Zero(3, 1);
    s.B(2, 0) = gain;
    s.C = Matrix::Zero(1, 3);
    s.C(0, 0) = 1;
    s.D = Matrix::Zero(1, 1);
    s.inputs = {"u"};
    s.outputs = {"y"};
    return s;
}

/// ω² / (s² + 2 ζ ω s + ω²).
LinearSystem second_order(double zeta, double omega) {
    LinearSystem s;
    s.A = Matrix(2, 2);
    s.A << 0, 1, -omega * omega, -2 * zeta * omega;
    s.B = Matrix(2, 1);
    s.B << 0, omega * omega;
    s.C = Matrix(1, 2);
    s.C << 1, 0;
    s.D = Matrix::Zero(1, 1);
    return s;
}

} // namespace

TEST(Response, MarginsOfALoopAreThoseOfItsClosedForm) {
    // The phase is -180 degrees at √2, where |L| = k/6.
    const auto m = margins(integrating(1));
    EXPECT_NEAR(m.gain, 6, 1e-9);
    EXPECT_NEAR(m.phase_crossover, std::numbers::sqrt2, 1e-9);
    EXPECT_TRUE(m.is_stable);
    const double w = m.gain_crossover;
    EXPECT_NEAR(w * std::sqrt((w * w + 1) * (w * w + 4)), 1, 1e-9);
    EXPECT_NEAR(m.phase, 90 - (std::atan(w) + std::atan(w / 2)) * 180 / std::numbers::pi, 1e-8);
    EXPECT_NEAR(m.delay, m.phase * std::numbers::pi / 180 / w, 1e-9);
    EXPECT_FALSE(margins(integrating(6.1)).is_stable);
    EXPECT_NEAR(margins(integrating(12)).gain_reduction, 0.5, 1e-9);
}

TEST(Response, OfASecondOrderSystemOvershootsAsItsDampingSays) {
    for (const double zeta : {0.2, 0.5, 0.8}) {
        const auto r = step_response(second_order(zeta, 3), 0, 0);
        EXPECT_NEAR(r.final, 1, 1e-12);
        EXPECT_NEAR(r.overshoot, 100 * std::exp(-std::numbers::pi * zeta / std::sqrt(1 - zeta * zeta)), 0.05);
        EXPECT_NEAR(r.peak_time, std::numbers::pi / (3 * std::sqrt(1 - zeta * zeta)), 0.02);
    }
    EXPECT_TRUE(std::isnan(step_response(integrating(1), 0, 0).final));
}

TEST(Response, KnowsPolesAndZeros) {
    auto s = integrating(1);
    s.C << 4, 1, 0; // s + 4
    const auto found = zeros(s, 0, 0);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].real(), -4, 1e-9);
    const auto all = poles(s);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(all[static_cast<std::size_t>(i)].real(), i - 2, 1e-9);
    EXPECT_TRUE(zeros(integrating(1), 0, 0).empty());
}

TEST(Response, OfASampledSystemIsThatOfItsDifferenceEquation) {
    // y⁺ = 0.5 y + u: G(z) = 1/(z - 0.5).
    LinearSystem s;
    s.A = Matrix::Constant(1, 1, 0.5);
    s.B = s.C = Matrix::Constant(1, 1, 1);
    s.D = Matrix::Zero(1, 1);
    s.period = 0.1;
    const Complex z = std::polar(1.0, 0.7);
    EXPECT_LT(std::abs(frequency_response(s, 0, 0, 7) - 1.0 / (z - 0.5)), 1e-14);
    const auto r = step_response(s, 0, 0);
    for (int k = 0; k < 8; ++k)
        EXPECT_NEAR(r.value[static_cast<std::size_t>(k)], 2 * (1 - std::pow(0.5, k)), 1e-14);
    // With -k/(z - 0.5) the loop ends where the root reaches -1: k = 1.5, at π/T.
    const auto m = margins(s);
    EXPECT_NEAR(m.gain, 1.5, 1e-9);
    EXPECT_NEAR(m.phase_crossover, std::numbers::pi / 0.1, 1e-9);
}

TEST(Response, OfALoopWithoutDelayAndWithAGainOfMinusOneIsRefused) {
    LinearSystem s = second_order(0.5, 1);
    s.D(0, 0) = -1;
    s.outputs = {"y"};
    s.inputs = {"u"};
    EXPECT_THROW(closed(s), std::runtime_error);
}

} // namespace bf::analysis::test
