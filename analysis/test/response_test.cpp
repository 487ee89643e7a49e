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

/// c₂ s² + c₁ s + c₀ over s³ + a₂ s² + a₁ s + a₀.
LinearSystem third_order(double c2, double c1, double c0, double a2, double a1, double a0) {
    LinearSystem s = integrating(1);
    s.A.row(2) << -a0, -a1, -a2;
    s.C << c0, c1, c2;
    return s;
}
/// k/(s + a).
LinearSystem first_order(double k, double a) {
    LinearSystem s;
    s.A = Matrix::Constant(1, 1, -a);
    s.B = Matrix::Constant(1, 1, 1);
    s.C = Matrix::Constant(1, 1, k);
    s.D = Matrix::Zero(1, 1);
    return s;
}

TEST(Response, CrossoversFarBeyondPolesAndZerosCount) {
    // 30 (s + 1)²/s³ is 1 where 30 (ω² + 1) = ω³, with a phase of 2 atan ω - 270 degrees.
    const auto m = margins(third_order(30, 60, 30, 0, 0, 0));
    const double w = m.gain_crossover;
    EXPECT_NEAR(30 * (w * w + 1) / (w * w * w), 1, 1e-9);
    EXPECT_NEAR(m.phase, 2 * std::atan(w) * 180 / std::numbers::pi - 90, 1e-7);
    EXPECT_NEAR(m.delay, m.phase * std::numbers::pi / 180 / w, 1e-9);
    EXPECT_LE(m.modulus, 1); // L comes to 0
    EXPECT_NEAR(margins(first_order(1e9, 1)).gain_crossover, 1e9, 10);
    EXPECT_NEAR(margins(third_order(0, 0, 1e-9, 30, 200, 0)).gain_crossover, 5e-12, 1e-20);
}

TEST(Response, AGainMarginMayLieAtZeroFrequency) {
    const auto unstable = margins(first_order(2, -1)); // stable from a gain of 1/2 on
    EXPECT_NEAR(unstable.gain_reduction, 0.5, 1e-12);
    EXPECT_TRUE(unstable.is_stable);
    const auto positive = margins(first_order(-0.5, 1));
    EXPECT_NEAR(positive.gain, 2, 1e-12);
    EXPECT_EQ(positive.phase_crossover, 0);
    EXPECT_NEAR(positive.modulus, 0.5, 1e-12);
}

TEST(Response, WhatIsSlowIsNotLostBesideWhatIsFast) {
    // -k over (s/1000 + 1)² (s/0.1 + 1), whose value at 0 is -k, in the form of its denominator.
    const auto stiff = [](double k) { return third_order(0, 0, -k * 1e5, 2000.1, 1000200, 1e5); };
    const auto half = margins(stiff(0.5)), twice = margins(stiff(2));
    EXPECT_NEAR(half.gain, 2, 1e-9);
    EXPECT_EQ(half.phase_crossover, 0);
    EXPECT_NEAR(half.modulus, 0.5, 1e-9);
    EXPECT_NEAR(half.bandwidth, 0.05, 1e-3); // closed, the slow pole lies at 0.1 (1 - 0.5)
    EXPECT_NEAR(twice.gain_reduction, 0.5, 1e-9);
    // 10/((1e-9 s + 1)(s + 1)) follows up to about 11 rad/s.
    auto quick = second_order((1 + 1e9) / 2 / std::sqrt(1e9), std::sqrt(1e9));
    quick.C *= 10;
    EXPECT_NEAR(margins(quick).bandwidth, 11, 0.1);
}

TEST(Response, AGainMarginMayLieAtInfinity) {
    // -0.5 s/(s + 1) closed has its pole at -1/(1 - 0.5 k).
    auto s = first_order(0.5, 1);
    s.D(0, 0) = -0.5;
    const auto m = margins(s);
    EXPECT_NEAR(m.gain, 2, 1e-12);
    EXPECT_TRUE(std::isinf(m.phase_crossover));
}

TEST(Response, AZeroAtZeroFrequencyIsNoGainMargin) {
    // 17 s/((s² + 1) (s + 2)), times -1: its real part at 0 is 0, to rounding.
    EXPECT_TRUE(std::isinf(margins(third_order(0, -17, -1e-15, 2, 1, 2)).gain));
}

TEST(Response, ASmallFinalValueIsWaitedFor) {
    // (-s - 0.356)/(s + 66.2): comes to -0.0054 from -1.
    auto s = first_order(66.24777519 - 0.356094, 66.24777519);
    s.D(0, 0) = -1;
    EXPECT_NEAR(step_response(s, 0, 0).settling_time, 0.1379, 1e-3);
}

TEST(Response, BranchesOfALocusMeetOnTheRealAxis) {
    // k (s + 3) over s (s + 1) (s + 2): two branches leave the axis between 0 and -1.
    const auto locus = root_locus(third_order(0, 1, 3, 3, 2, 0));
    for (std::size_t i = 1; i < locus.gains.size(); ++i)
        for (std::size_t b = 0; b < 3; ++b) {
            if (std::abs(locus.roots[i][b]) >= 4) continue;
            EXPECT_LT(std::abs(locus.roots[i][b] - locus.roots[i - 1][b]), 0.04) << locus.gains[i];
        }
}

TEST(Response, LeastDistanceFromMinusOneIsExact) {
    EXPECT_LT(margins(third_order(0, 1, 1, 1, 0, 0)).modulus, 1e-6); // 1/s² meets -1
    // |1 + 1/(s (s + 1))| is least where its derivative by ω² vanishes; by Brent's method of SciPy.
    EXPECT_NEAR(margins(third_order(0, 1, 2, 3, 2, 0)).modulus, 0.6812500386332132, 1e-9);
}

TEST(Response, APhaseBeginsWhereItsIntegratorsHaveIt) {
    const auto phase = [](const LinearSystem& s) { return response(s, 0, 0, {1e-3}).phase.front(); };
    EXPECT_NEAR(phase(third_order(30, 60, 30, 0, 0, 0)), -270, 1);
    EXPECT_NEAR(phase(third_order(0, 1, 1, 1, 0, 0)), -180, 1);
    EXPECT_NEAR(phase(integrating(1)), -90, 1);
    EXPECT_NEAR(phase(integrating(-1)), -270, 1);
    EXPECT_NEAR(phase(first_order(-1, 1)), -180, 1);
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

TEST(Response, OfLittleDampingIsSeenHoweverLongItLasts) {
    for (const double duration : {0.0, 1e6}) {
        const auto r = step_response(second_order(1e-4, 1), 0, 0, duration);
        EXPECT_NEAR(r.overshoot, 100 * std::exp(-std::numbers::pi * 1e-4), 0.05);
        EXPECT_NEAR(r.peak_time, std::numbers::pi, 0.02);
        EXPECT_NEAR(r.rise_time, std::acos(0.1) - std::acos(0.9), 0.01);
        EXPECT_NEAR(r.time.back(), duration > 0 ? duration : 8e4, duration > 0 ? 1e-2 * duration : 1e3);
    }
    EXPECT_NEAR(step_response(first_order(1, 1), 0, 0, 1e9).rise_time, std::log(9), 1e-3);
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
