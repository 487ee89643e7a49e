// Modes on the boundary of stability that a loop does not see, beside the same loop without them.
#include "bf/analysis/linearize.hpp"
#include "bf/analysis/loop_gain.hpp"
#include "bf/analysis/response.hpp"
#include "bf/analysis/tune_loop.hpp"

#include "../../engine/test/support.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <numbers>

namespace bf::analysis::test {

namespace {

using Session = bf::test::Session;

/// Two masses of 1 with a shaft between them, whose speeds are integrated by blocks of that kind, and a loop
/// of the first one's speed. The twist of the shaft is the difference of two angles, or a state where the
/// model is minimal.
std::string two_masses(bool is_minimal, const std::string& integrator, const std::string& gain = "-5",
                       const std::string& damping = "1") {
    const std::string integrates = ": {block: " + integrator + "}\n";
    return "model: drive\nstep: 0.01\nsolver: rk4\nblocks:\n"
           "  a1: {block: Sum, signs: +-}\n  w1" +
           integrates + "  w2" + integrates + "  speed: {block: Sum, signs: +-}\n" +
           (is_minimal ? "  twist" + integrates
                       : "  th1" + integrates + "  th2" + integrates + "  twist: {block: Sum, signs: +-}\n") +
           "  shaft: {block: Fcn, expression: 100*u1 + " + damping + "*u2}\n  u: {block: Gain, K: " + gain +
           "}\nconnections:\n  u: a1.u1\n  shaft: [a1.u2, w2]\n  a1: w1\n  twist: shaft.u1\n" +
           (is_minimal ? "  speed: [shaft.u2, twist]\n  w1: [speed.u1, u]\n  w2: speed.u2\n"
                       : "  speed: shaft.u2\n  w1: [speed.u1, th1, u]\n  w2: [speed.u2, th2]\n"
                         "  th1: twist.u1\n  th2: twist.u2\n");
}

LinearSystem loop_of(const std::string& text) {
    Session session(text);
    return loop_gain(*session.simulation, "u");
}

void expect_same(const Margins& a, const Margins& b, double tolerance = 1e-7) {
    const auto near = [&](double x, double y, const char* what) {
        if (std::isinf(x) && x == y) return;
        EXPECT_LE(std::abs(x - y), tolerance * std::max(1.0, std::abs(y)))
            << what << ": " << x << ", not " << y;
    };
    EXPECT_EQ(a.is_stable, b.is_stable);
    near(a.gain, b.gain, "gain");
    near(a.gain_reduction, b.gain_reduction, "gain reduction");
    near(a.phase, b.phase, "phase");
    near(a.delay, b.delay, "delay");
    near(a.modulus, b.modulus, "modulus");
    near(a.phase_crossover, b.phase_crossover, "phase crossover");
    near(a.gain_crossover, b.gain_crossover, "gain crossover");
    near(a.bandwidth, b.bandwidth, "bandwidth");
}

/// k (s² + d s + 100) / (s (s² + 2 d s + 200)), in the parallel form of both modes; of Euler's method
/// with z = 1 + s T.
LinearSystem minimal(double k, double d, double period = 0) {
    LinearSystem s;
    s.A = Matrix::Zero(3, 3);
    s.A << 0, 0, 0, 0, 0, 1, 0, -200, -2 * d;
    s.B = Matrix::Zero(3, 1);
    s.B << 1, 0, 1;
    s.C = Matrix::Zero(1, 3);
    s.C << 0.5 * k, 0, 0.5 * k; // half of k/s, and half of k s/(s² + 2 d s + 200)
    s.D = Matrix::Zero(1, 1);
    s.inputs = {"u"};
    s.outputs = {"y"};
    s.period = period;
    if (period > 0) {
        s.A = (Matrix::Identity(3, 3) + period * s.A).eval();
        s.B *= period;
    }
    return s;
}

/// T A T⁻¹, T B, C T⁻¹ with a T of chance whose condition is small.
LinearSystem turned(LinearSystem s, unsigned seed) {
    std::srand(seed);
    const auto n = s.A.rows();
    const Matrix T = 2 * Matrix(Eigen::HouseholderQR<Matrix>(Matrix::Random(n, n)).householderQ()) +
                     0.3 * Matrix::Random(n, n),
                 inverse = T.inverse();
    s.A = (T * s.A * inverse).eval();
    s.B = (T * s.B).eval();
    s.C = (s.C * inverse).eval();
    return s;
}

/// With further modes beside those of s, which these and the input drive and nobody looks at; or which drive
/// them and are looked at, and which nobody moves.
LinearSystem with_hidden(const LinearSystem& s, const Matrix& hidden, bool is_driven, unsigned seed) {
    std::srand(seed);
    const auto n = s.A.rows(), m = hidden.rows(), all = n + m;
    LinearSystem whole = s;
    whole.A = Matrix::Zero(all, all);
    whole.A.topLeftCorner(n, n) = s.A;
    whole.A.bottomRightCorner(m, m) = hidden;
    whole.B = Matrix::Zero(all, 1);
    whole.B.topRows(n) = s.B;
    whole.C = Matrix::Zero(1, all);
    whole.C.leftCols(n) = s.C;
    if (is_driven) {
        whole.A.bottomLeftCorner(m, n).setRandom();
        whole.B.bottomRows(m).setRandom();
    } else {
        whole.A.topRightCorner(n, m).setRandom();
        whole.C.rightCols(m).setRandom();
    }
    return turned(whole, seed + 1000);
}

Matrix matrix(Eigen::Index n, std::initializer_list<double> rows) {
    Matrix m(n, n);
    Eigen::Index i = 0;
    for (const double x : rows) m(i / n, i % n) = x, ++i;
    return m;
}

/// With the eigenvalues real ± imaginary j.
Matrix swing(double real, double imaginary) { return matrix(2, {real, imaginary, -imaginary, real}); }

} // namespace

TEST(HiddenModes, TheAngleOfARigidBodyDecidesNothingInALoopOfItsSpeed) {
    const auto loop = loop_of(two_masses(false, "Integrator"));
    ASSERT_EQ(loop.A.rows(), 4);
    const auto m = margins(loop);
    // By python-control: stability_margins(5*(s**2 + s + 100)/(s*(s**2 + 2*s + 200))).
    EXPECT_TRUE(m.is_stable);
    EXPECT_EQ(m.gain, Margins::none);
    EXPECT_EQ(m.gain_reduction, 0);
    EXPECT_NEAR(m.phase, 90.04465420945445, 1e-8);
    EXPECT_NEAR(m.gain_crossover, 2.424354797426973, 1e-9);
    expect_same(m, margins(minimal(5, 1)));
    expect_same(m, margins(loop_of(two_masses(true, "Integrator"))));
    const auto roots = root_locus(loop, 0, 0, {1}).roots.front();
    ASSERT_EQ(roots.size(), 3u); // by python-control: poles(feedback(5*(...), 1))
    EXPECT_NEAR(roots[0].real(), -2.58276031, 1e-8);
    EXPECT_NEAR(std::abs(roots[1] - Complex(-2.20861984, -13.73729693)), 0, 1e-7);
    EXPECT_EQ(zeros(loop, 0, 0).size(), 2u); // of s² + s + 100
}

TEST(HiddenModes, OfASampledLoopAreThoseAtOne) {
    for (const char* gain : {"-5", "-5000"}) {
        const auto loop = loop_of(two_masses(false, "DiscreteIntegrator", gain, "3"));
        ASSERT_EQ(loop.period, 0.01);
        expect_same(margins(loop), margins(minimal(-std::stod(gain), 3, 0.01)));
    }
    EXPECT_TRUE(margins(loop_of(two_masses(false, "DiscreteIntegrator", "-5", "3"))).is_stable);
    EXPECT_FALSE(margins(loop_of(two_masses(false, "DiscreteIntegrator", "-5000", "3"))).is_stable);
}

TEST(HiddenModes, OfALoopOfSeveralRatesDecideNothing) {
    const auto sampled = [](bool is_minimal) {
        auto text = two_masses(is_minimal, "Integrator");
        const std::string gain = "{block: Gain, K: -5}";
        text.replace(text.find(gain), gain.size(), "{block: Gain, K: -5, period: 0.02}");
        return loop_of(text);
    };
    const auto loop = sampled(false);
    ASSERT_EQ(loop.A.rows(), 4);
    ASSERT_EQ(loop.period, 0.02);
    expect_same(margins(loop), margins(sampled(true)));
    EXPECT_TRUE(margins(loop).is_stable);
}

TEST(HiddenModes, AStepComesToItsFinalValueWhereTheAngleIsNotLookedAt) {
    const Session session(two_masses(false, "Integrator"));
    const auto to_speed = linearize(session.diagram, {.from = {"u"}, .to = {"w1"}});
    const auto settled = step_response(to_speed, 0, 0);
    EXPECT_NEAR(settled.final, 1.0 / 5, 1e-12); // of 1/(1/G + 5), where G has a pole at 0
    EXPECT_NEAR(settled.value.back(), 0.2, 0.004);
    EXPECT_TRUE(is_stable(to_speed));
    // The angle itself grows on.
    const auto to_angle = linearize(session.diagram, {.from = {"u"}, .to = {"th1"}});
    EXPECT_TRUE(std::isnan(step_response(to_angle, 0, 0).final));
    EXPECT_FALSE(is_stable(to_angle));
}

TEST(HiddenModes, ALoopIsTunedAsWithoutThem) {
    Session session(two_masses(false, "Integrator"));
    const auto found = tune_loop(*session.simulation, {.loop = "u", .by = {"u.K"}, .crossover = 4});
    const Complex s(0, 4), G = (s * s + s + 100.0) / (s * (s * s + 2.0 * s + 200.0));
    EXPECT_NEAR(found.gains.at(0).after, -1 / std::abs(G), 1e-9);
    EXPECT_TRUE(found.after.margins.is_stable);
    EXPECT_NEAR(found.after.margins.gain_crossover, 4, 1e-9);
    EXPECT_NEAR(found.after.margins.phase, 180 + std::arg(G) * 180 / std::numbers::pi, 1e-7);
    EXPECT_NEAR(found.after.step.final, 1, 1e-9);
}

TEST(HiddenModes, InAnyCoordinatesDecideNothing) {
    // Integrators one behind another, side by side, and undamped swings; sampled also an alternating sign.
    const std::vector<Matrix> continuous = {matrix(1, {0}),
                                            matrix(2, {0, 1, 0, 0}),
                                            matrix(3, {0, 1, 0, 0, 0, 1, 0, 0, 0}),
                                            Matrix::Zero(2, 2),
                                            swing(0, 3),
                                            matrix(3, {0, 0, 0, 0, 0, 7, 0, -7, 0})},
                              sampled = {matrix(1, {1}), matrix(2, {1, 1, 0, 1}), matrix(1, {-1}),
                                         swing(0.6, 0.8)};
    const auto expect_decide_nothing = [](const LinearSystem& s, const std::vector<Matrix>& all) {
        for (unsigned seed = 1; seed <= 20; ++seed)
            for (const bool is_driven : {true, false})
                for (const auto& hidden : all) {
                    SCOPED_TRACE(testing::Message() << "seed " << seed << ", driven " << is_driven << "\n"
                                                    << hidden);
                    const auto whole = with_hidden(s, hidden, is_driven, seed);
                    expect_same(margins(whole), margins(s));
                    EXPECT_NEAR(step_response(closed(whole), 0, 0).final, 1, 1e-9);
                    EXPECT_TRUE(is_stable(closed(whole)));
                    EXPECT_EQ(poles(whole).size(), static_cast<std::size_t>(whole.A.rows()));
                }
    };
    expect_decide_nothing(minimal(5, 1), continuous);
    expect_decide_nothing(minimal(5, 3, 0.01), sampled);
}

TEST(HiddenModes, ThatSwingAsOneThatIsSeenDecideNothing) {
    // 2 s/(s² + 9), which drives another swing of 3 rad/s, or is driven by it: open, both are one chain.
    for (const bool is_driven : {true, false})
        for (unsigned seed = 1; seed <= 20; ++seed) {
            LinearSystem s = minimal(1, 1);
            s.A = swing(0, 3);
            s.B = Vector::Unit(2, 0);
            s.C = 2 * Vector::Unit(2, 0).transpose();
            const auto m = margins(with_hidden(s, swing(0, 3), is_driven, seed));
            EXPECT_TRUE(m.is_stable) << seed;
            // |L| = 1 where ω² ± 2 ω = 9.
            EXPECT_NEAR(std::abs(m.gain_crossover - std::sqrt(10.0)), 1, 1e-6) << seed;
            EXPECT_NEAR(std::abs(m.phase), 90, 1e-4) << seed;
        }
}

TEST(HiddenModes, ThatAreSlowBesideOthersDecideNothing) {
    LinearSystem s = minimal(1, 1); // 2e6/((s + 1) (s + 1e6))
    s.A = matrix(2, {-1, 1e3, 0, -1e6});
    s.B = 1e3 * Vector::Unit(2, 1);
    s.C = 2 * Vector::Unit(2, 0).transpose();
    for (const double omega : {1e-2, 1.0})
        for (const bool is_driven : {true, false})
            expect_same(margins(with_hidden(s, swing(0, omega), is_driven, 1)), margins(s), 1e-6);
}

TEST(HiddenModes, WherePathsCancelDecideNothing) {
    // 2/(s + 1), and b x1 - a x2 of x1'' = a u, x2'' = b u, where b a - a b may be 0 but for rounding.
    for (double a = 1; a < 20; a += 1) {
        const double b = std::sqrt(a);
        LinearSystem s = minimal(1, 1);
        s.A = Matrix::Zero(4, 4);
        s.A(0, 0) = -1;
        s.A(2, 1) = a / 3;
        s.A(3, 1) = b / 3;
        s.B = Vector::Unit(4, 0) + Vector::Unit(4, 1);
        s.C = Matrix(1, 4);
        s.C << 2, 0, b, -a; // |2/(s + 1)| = 1 at √3, with a phase of -60 degrees
        const auto m = margins(s);
        EXPECT_TRUE(m.is_stable) << a;
        EXPECT_NEAR(m.phase, 120, 1e-9) << a;
        EXPECT_NEAR(m.gain_crossover, std::sqrt(3.0), 1e-12) << a;
        EXPECT_NEAR(step_response(s, 0, 0).final, 2, 1e-12) << a;
    }
}

TEST(HiddenModes, AreNoOthersInOtherUnits) {
    LinearSystem s = minimal(1, 1); // 1/s beside 1e-3/(s + 1000)
    s.A = matrix(2, {0, 0, 0, -1000});
    s.B = 1e18 * Vector::Ones(2);
    s.C = Matrix(1, 2);
    s.C << 1e-18, 1e-21;
    EXPECT_NEAR(margins(s).gain_crossover, 1, 1e-5);
    EXPECT_FALSE(is_stable(s));
    EXPECT_TRUE(is_stable(closed(s)));
}

TEST(HiddenModes, ThatGrowAreToldHoweverSlowlyTheyDo) {
    const auto s = minimal(5, 1), z = minimal(5, 3, 0.01);
    const std::vector<std::pair<LinearSystem, Matrix>> all = {
        {s, matrix(1, {1e-6})},     {s, swing(1e-6, 3)},      {s, matrix(2, {0, 1, 0, 1e-3})},
        {z, matrix(1, {1 + 1e-6})}, {z, matrix(1, {-1.001})}, {z, swing(0.6, 0.801)}};
    for (const auto& [system, hidden] : all)
        for (const bool is_driven : {true, false}) {
            const auto whole = with_hidden(system, hidden, is_driven, 1);
            EXPECT_FALSE(margins(whole).is_stable) << hidden;
            EXPECT_TRUE(std::isnan(step_response(closed(whole), 0, 0, 1).final)) << hidden;
            EXPECT_NEAR(margins(whole).phase, margins(system).phase, 1e-6) << hidden;
        }
}

TEST(HiddenModes, ThatAreSeenAndMovedALittleAreNotHidden) {
    // 1/(s + 1) + ε/s, closed s² + (2 + ε) s + ε; and 1/(s + 1) + ε s/(s² + 4), whose pole near 2j moves by
    // -ε/2 (1 + 1/(1 + 2j))⁻¹: both are stable for ε > 0 alone.
    for (const double epsilon : {1e-4, -1e-4, 1e-8, -1e-8})
        for (const bool is_seen_little : {true, false})
            for (unsigned seed = 1; seed <= 10; ++seed) {
                const auto with = [&](const Matrix& more) {
                    LinearSystem s = minimal(1, 1);
                    const auto n = more.rows() + 1;
                    s.A = Matrix::Zero(n, n);
                    s.A(0, 0) = -1;
                    s.A.bottomRightCorner(n - 1, n - 1) = more;
                    s.B = Vector::Unit(n, 0) + (is_seen_little ? 1 : epsilon) * Vector::Unit(n, 1);
                    s.C = (Vector::Unit(n, 0) + (is_seen_little ? epsilon : 1) * Vector::Unit(n, 1))
                              .transpose();
                    return turned(s, seed);
                };
                const auto drifting = with(matrix(1, {0})), swinging = with(swing(0, 2));
                EXPECT_EQ(margins(drifting).is_stable, epsilon > 0) << epsilon << ", seed " << seed;
                EXPECT_EQ(margins(swinging).is_stable, epsilon > 0) << epsilon << ", seed " << seed;
                EXPECT_GT(std::abs(frequency_response(drifting, 0, 0, std::abs(epsilon) / 10)), 9);
            }
}

TEST(HiddenModes, AnIntegratorOutsideOfTheFeedbackWhoseOutputIsLookedAtIsSeen) {
    // 1/(s + 1), and the integral of it.
    LinearSystem s = minimal(1, 1);
    s.A = matrix(2, {-1, 0, 1, 0});
    s.B = Vector::Unit(2, 0);
    s.C = Vector::Unit(2, 1).transpose();
    EXPECT_FALSE(is_stable(s));
    EXPECT_TRUE(std::isnan(step_response(s, 0, 0).final));
    s.C = Matrix::Identity(2, 2);
    s.D = Matrix::Zero(2, 1);
    s.outputs = {"v", "x"};
    EXPECT_FALSE(is_stable(s));
    EXPECT_NEAR(step_response(s, 0, 0).final, 1, 1e-12);
    EXPECT_TRUE(std::isnan(step_response(s, 1, 0).final));
}

} // namespace bf::analysis::test
