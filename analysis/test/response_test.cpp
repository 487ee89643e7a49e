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

/// A transfer function by falling powers, in companion form.
LinearSystem rational(std::vector<double> numerator, const std::vector<double>& denominator,
                      double period = 0) {
    const auto n = static_cast<Eigen::Index>(denominator.size()) - 1;
    numerator.insert(numerator.begin(), denominator.size() - numerator.size(), 0);
    LinearSystem s;
    s.D = Matrix::Constant(1, 1, numerator[0] / denominator[0]);
    s.A = Matrix::Zero(n, n);
    s.B = Matrix::Zero(n, 1);
    s.C = Matrix::Zero(1, n);
    for (Eigen::Index i = 0; i < n; ++i) {
        const auto at = static_cast<std::size_t>(n - i);
        if (i + 1 < n) s.A(i, i + 1) = 1;
        s.A(n - 1, i) = -denominator[at] / denominator[0];
        s.C(0, i) = (numerator[at] - s.D(0, 0) * denominator[at]) / denominator[0];
    }
    if (n > 0) s.B(n - 1, 0) = 1;
    s.inputs = {"u"};
    s.outputs = {"y"};
    s.period = period;
    return s;
}

TEST(Response, CrossoversFarBeyondPolesAndZerosCount) {
    // 30 (s + 1)²/s³ is 1 where 30 (ω² + 1) = ω³, with a phase of 2 atan ω - 270 degrees.
    const auto m = margins(third_order(30, 60, 30, 0, 0, 0));
    EXPECT_NEAR(m.reduction_crossover, 1, 1e-9); // the phase passes -180 degrees at 1 rad/s
    EXPECT_NEAR(m.gain_reduction, 1.0 / 60, 1e-9);
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
    EXPECT_EQ(unstable.reduction_crossover, 0);
    EXPECT_TRUE(unstable.is_stable);
    const auto positive = margins(first_order(-0.5, 1));
    EXPECT_NEAR(positive.gain, 2, 1e-12);
    EXPECT_EQ(positive.phase_crossover, 0);
    EXPECT_NEAR(positive.modulus, 0.5, 1e-12);
}

TEST(Response, LeastDistanceFromMinusOneIsExact) {
    EXPECT_LT(margins(third_order(0, 1, 1, 1, 0, 0)).modulus, 1e-6); // 1/s² meets -1
    // |1 + 1/(s (s + 1))| is least where its derivative by ω² vanishes; by Brent's method of SciPy.
    EXPECT_NEAR(margins(third_order(0, 1, 2, 3, 2, 0)).modulus, 0.6812500386332132, 1e-9);
}

TEST(Response, FastPolesDoNotHideWhatHappensAtZeroFrequency) {
    // Products of (s + a): a = 1000 three times, 0.1; 1e6 twice, 1000, 1; 1e9, 1.
    const std::vector<std::vector<double>> stiff = {{1, 3000.1, 3000300, 1000300000, 1e8},
                                                    {1, 2001001, 1.002002001e12, 1.001002e15, 1e15},
                                                    {1, 1e9 + 1, 1e9}};
    for (const auto& denominator : stiff) {
        const auto m = margins(rational({-0.5 * denominator.back()}, denominator));
        EXPECT_NEAR(m.gain, 2, 1e-9);
        EXPECT_EQ(m.phase_crossover, 0);
        EXPECT_NEAR(m.modulus, 0.5, 1e-9);
        EXPECT_NEAR(margins(rational({-2 * denominator.back()}, denominator)).gain_reduction, 0.5, 1e-9);
    }
    EXPECT_NEAR(margins(rational({1e10}, {1, 1e9 + 1, 1e9})).bandwidth, 11, 1e-5); // ≈ 10/(s + 11)
    EXPECT_NEAR(margins(rational({20}, {1, 0})).bandwidth, 20, 1e-9);
    const auto found = poles(rational({1}, {1, 2, 1, 1e300})); // ≈ s³ = -1e300
    for (const auto& p : found) EXPECT_NEAR(std::abs(p), 1e100, 1e88);
}

TEST(Response, AnIntegratorThatTheInputDoesNotReachIsNotSeen) {
    LinearSystem s = rational({1}, {1, 1, 0});
    s.A << 0, 0, 0, -1;
    s.B << 0, 1;
    s.C << 1, -0.5; // -0.5/(s + 1)
    EXPECT_NEAR(margins(s).gain, 2, 1e-12);
}

TEST(Response, AModulusMarginIsNotMoreThanThePhaseMarginAllows) {
    // The distance from -1 at a crossover is 2 sin(phase/2); the least distance is that of a dense grid of
    // NumPy.
    const auto m = margins(rational({69187.7, 1263.95, 2619180, 9062.25, 1837390},
                                    {1, 877.20723, 279.76669, 133411.27, 203.58338, -19.70863}));
    EXPECT_NEAR(m.phase, 4.304122244624022, 1e-8);
    EXPECT_LE(m.modulus, 2 * std::sin(m.phase * std::numbers::pi / 360));
    EXPECT_NEAR(m.modulus, 0.07505733, 2e-7);
}

TEST(Response, AGainMarginMayLieAtInfiniteFrequency) {
    const auto m = margins(rational({-0.5, 0}, {1, 1})); // 1 + kL = ((1 - k/2) s + 1)/(s + 1)
    EXPECT_NEAR(m.gain, 2, 1e-12);
    EXPECT_TRUE(std::isinf(m.phase_crossover));
}

TEST(Response, WhereALoopGainIs0ButForRoundingThereIsNoMargin) {
    EXPECT_EQ(margins(rational({17.2899, 0}, {1, 1.1370164, 4.9466482, 5.4929338})).gain, Margins::none);
    EXPECT_EQ(margins(rational({-0.544181, 0.544181}, {1, -1.4847014, 0.48470136}, 0.1)).gain, Margins::none);
    try {
        margins(rational({0}, {1, 1}));
        ADD_FAILURE();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "there is no loop: what is added to 'u' does not come back");
    }
}

TEST(Response, ACrossoverMayLieShortlyBelowHalfOfTheSamplesFrequency) {
    // By the root of the imaginary part in NumPy and SciPy; at π/T the loop bears 8.64 dB.
    const auto m =
        margins(rational({0.259305, 0.32173, 0.228254, 0.0790251, 0.0157426},
                         {1, 0.63476864, -0.62191886, -0.13356336, 0.31521678, -0.085332204}, 0.1));
    EXPECT_NEAR(20 * std::log10(m.gain), 7.624323897844122, 1e-8);
    EXPECT_NEAR(m.phase_crossover, 30.277720262619916, 1e-8);
}

TEST(Response, ACrossoverMayLieFarBelowTheSlowestPole) {
    const auto m = margins(first_order(1.001, 1));
    const double w = std::sqrt(1.001 * 1.001 - 1);
    EXPECT_NEAR(m.gain_crossover, w, 1e-9);
    EXPECT_NEAR(m.phase, 180 - std::atan(w) * 180 / std::numbers::pi, 1e-7);
}

TEST(Response, OfASharpResonanceMarginsAreExact) {
    // 1/(s² + 2 ζ s + 1) is 1 in absolute value where ω² = 2 - 4 ζ², with a phase of -180 degrees but for 2 ζ
    // √2.
    for (const double zeta : {1e-2, 1e-4, 1e-6}) {
        const auto m = margins(second_order(zeta, 1));
        EXPECT_NEAR(m.gain_crossover, std::sqrt(2 - 4 * zeta * zeta), 1e-9);
        EXPECT_NEAR(m.modulus / (2 * zeta * std::numbers::sqrt2), 1, 4 * zeta);
    }
}

TEST(Response, OfManyStatesIsThatOfItsClosedForm) {
    // 1/(s + 1)ⁿ is negative real where n atan ω = π, with an absolute value of cosⁿ(π/n).
    constexpr int n = 60;
    LinearSystem lags = rational({1}, std::vector<double>(n + 1, 1));
    lags.A.setZero();
    lags.A.diagonal().setConstant(-1);
    lags.A.diagonal<-1>().setConstant(1);
    lags.B = Vector::Unit(n, 0);
    lags.C = Vector::Unit(n, n - 1).transpose();
    const auto m = margins(lags);
    EXPECT_TRUE(m.is_stable);
    EXPECT_NEAR(m.gain, std::pow(std::cos(std::numbers::pi / n), -n), 1e-9);
    EXPECT_NEAR(m.phase_crossover, std::tan(std::numbers::pi / n), 1e-9);
    // k z⁻ⁿ
    LinearSystem delay = lags;
    delay.period = 0.01;
    delay.A.diagonal().setZero();
    delay.C *= 0.5;
    EXPECT_NEAR(margins(delay).gain, 2, 1e-9);
    EXPECT_NEAR(margins(delay).modulus, 0.5, 1e-9);
    EXPECT_EQ(margins(delay).phase, Margins::none);
    delay.C *= 4;
    EXPECT_NEAR(margins(delay).gain_reduction, 0.5, 1e-9);
    EXPECT_FALSE(margins(delay).is_stable);
}

TEST(Response, FrequenciesOfALoopReachADecadeBeyondItsCrossovers) {
    const auto of_integrator = frequencies(rational({20}, {1, 0}), 0, 0, 100, true);
    EXPECT_LE(of_integrator.front(), 2);
    EXPECT_GE(of_integrator.back(), 200);
    EXPECT_GE(frequencies(rational({30, 60, 30}, {1, 0, 0, 0}), 0, 0, 100, true).back(), 300);
    EXPECT_LE(frequencies(rational({1e-3}, {1, 2, 1, 0}), 0, 0, 100, true).front(), 1e-4);
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

TEST(Response, OfAnIntegratingLoopLastsUntilItsOtherPolesHaveFaded) {
    // 1/(s² (s + 1) (s + 2)) = 1/(2 s²) - 3/(4 s) + 1/(s + 1) - 1/(4 (s + 2)).
    const auto r = step_response(integrating(1), 0, 0);
    const double t = r.time.back();
    EXPECT_NEAR(t, 8, 0.1); // eight times the slowest of them
    EXPECT_NEAR(r.value.back(), t / 2 - 0.75 + std::exp(-t) - std::exp(-2 * t) / 4, 1e-9);
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

TEST(Response, SettlesHoweverSmallItsFinalValueIs) {
    // y = D + (y∞ - D) (1 - exp(-a t)), D = -1, y∞ = -0.356094/a.
    const double a = 66.24777519, final = -0.356094 / a;
    const auto r = step_response(rational({-1, -0.356094}, {1, a}), 0, 0);
    EXPECT_NEAR(r.settling_time, std::log((1 + final) / (-0.02 * final)) / a, 1e-4);
    // y⁺ = p y + u⁺ - z u: y = y∞ + (1 - y∞) pᵏ.
    const double p = 0.3490768178, z = 0.989898, end = (1 - z) / (1 - p);
    const auto sampled = step_response(rational({1, -z}, {1, -p}, 0.1), 0, 0);
    EXPECT_NEAR(sampled.settling_time, 0.1 * std::ceil(std::log(0.02 * end / (1 - end)) / std::log(p)), 1e-9);
    // s/(s + 1), exp(-t), ends at 0: of its largest value.
    const auto washout = step_response(rational({1, 0}, {1, 1}), 0, 0);
    EXPECT_NEAR(washout.settling_time, std::log(50), 1e-3);
    EXPECT_TRUE(std::isnan(washout.overshoot));
    EXPECT_TRUE(std::isnan(washout.rise_time));
}

TEST(Response, TellsHowFarItGoesToTheOtherSide) {
    const auto r = step_response(rational({1, -1.963}, {1, 9.03461}), 0, 0); // from 1 to -1.963/9.03461
    EXPECT_NEAR(r.undershoot, 100 * 9.03461 / 1.963, 1e-9);
    EXPECT_EQ(r.undershoot_time, 0);
    EXPECT_EQ(step_response(second_order(0.5, 1), 0, 0).undershoot, 0);
}

TEST(Response, BranchesOfARootLocusMeetInShortSteps) {
    // Closed with k/(s (s + 2)): s = -1 ± √(1 - k), which meet at k = 1.
    const auto locus = root_locus(rational({1}, {1, 2, 0}));
    EXPECT_EQ(locus.gains.front(), 0);
    EXPECT_EQ(locus.gains.back(), 1000);
    for (std::size_t i = 0; i < locus.gains.size(); ++i)
        for (std::size_t b = 0; b < 2; ++b) {
            const Complex root = locus.roots[i][b];
            EXPECT_LT(std::abs(root * root + 2.0 * root + locus.gains[i]), 1e-9 * (1 + locus.gains[i]));
            if (i > 0 && std::abs(root) < 4) {
                EXPECT_LE(std::abs(root - locus.roots[i - 1][b]), 0.02001);
            }
        }
    EXPECT_THROW(root_locus(rational({1}, {1, 2, 0}), 0, 0, {1, std::nan("")}), RunError);
    EXPECT_EQ(root_locus(rational({1}, {1, 2, 0}), 0, 0, {3, 1}).gains, (std::vector<double>{3, 1}));
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
