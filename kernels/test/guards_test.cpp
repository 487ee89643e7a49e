// Zero-crossing functions against the functions whose jumps and corners they tell of.
#include "eigen_views.hpp"

#include "bf/kernels/guards.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/sources.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using D = std::vector<double>;
using I = std::vector<int>;

/// Does g change exactly where f does, on a walk through [from, to]?
template <class F, class G> void expect_together(F&& f, G&& g, double from, double to, const char* what) {
    const double step = 1.0 / 64; // exact
    for (double x = from; x < to; x += step)
        EXPECT_EQ(f(x) != f(x + step), g(x) != g(x + step))
            << what << " between " << x << " and " << x + step;
}

TEST(Guards, OfSignsAndMargins) {
    EXPECT_EQ(elements(Margin{}, 3, V{1, 2, 3}, V{2}), (D{-1, 0, 1}));
    EXPECT_EQ(elements(Margin{}, 2, V{5}, V{2, 7}), (D{3, -2}));
    EXPECT_EQ(elements(PositiveSign{}, 4, V{-1, 0, 1e-300, inf}), (D{-1, -1, 1, 1}));
    double low[2], high[2];
    StopMargins{}(View<double>(low, 2), View<double>(high, 2), *V{3}, *V{1, 2}, *V{4, -1});
    EXPECT_EQ((D{low[0], low[1], high[0], high[1]}), (D{4.5, -1.5, 1.5, -4.5}));
}

TEST(Guards, CountWhereRoundingJumps) {
    expect_together([](double u) { return elements(Quantize{}, 1, V{0.5}, V{u})[0]; },
                    [](double u) { return elements<int>(QuantizeEdges{}, 1, V{0.5}, V{u})[0]; }, -2, 2,
                    "quantizer");
    expect_together([](double u) { return std::trunc(u); },
                    [](double u) { return elements<int>(WholeNumber{}, 1, V{u})[0]; }, -3, 3, "choice");
    for (const auto rounding : {Rounding::zero, Rounding::nearest, Rounding::floor, Rounding::ceil,
                                Rounding::away, Rounding::convergent}) {
        const V options{static_cast<double>(rounding)};
        expect_together([&](double u) { return rounded(u, rounding); },
                        [&](double u) { return elements<int>(RoundingEdges{}, 1, options, V{u})[0]; }, -3, 3,
                        "rounding");
    }
    expect_together([](double a) { return std::floor(a / 0.75); },
                    [](double a) {
                        return elements<int>(QuotientEdges{}, 1, V{static_cast<double>(Rounding::floor)},
                                             V{a}, V{0.75})[0];
                    },
                    -3, 3, "remainder");
}

TEST(Guards, TellWhereAnAngleJumps) {
    // Around the circle: only from the second quadrant into the third does atan2 jump, by 2π.
    for (int k = 0; k < 16; ++k) {
        const auto at = [](int i) {
            const double angle = 0.1 + i * std::acos(-1.0) / 8;
            return std::pair(std::sin(angle), std::cos(angle));
        };
        const auto [a, b] = at(k);
        const auto [a1, b1] = at(k + 1);
        const auto quadrant = [](double s, double c) { return elements<int>(AngleEdge{}, 1, V{s}, V{c})[0]; };
        if (std::abs(std::atan2(a1, b1) - std::atan2(a, b)) > 3) {
            EXPECT_NE(quadrant(a, b), quadrant(a1, b1)) << k;
        }
        EXPECT_EQ(quadrant(a, b), a < 0 && b < 0) << k;
    }
    EXPECT_EQ(elements<int>(AngleEdge{}, 2, V{0, -1}, V{-1, 0}), (I{0, 0}))
        << "the axes are above and beside it";
}

TEST(Guards, NumberTheElementThatDecides) {
    const auto one = [](auto kernel, auto... operands) { return elements<int>(kernel, 1, operands...)[0]; };
    EXPECT_EQ(one(SideOfNumber{}, V{-2}), -1);
    EXPECT_EQ(one(SideOfNumber{}, V{0}), 0);
    EXPECT_EQ(one(SideOfNumber{}, V{2}), 1);
    EXPECT_EQ(one(SideOfNumber{}, V{2, 3}), 0);
    EXPECT_EQ(one(FarthestElement{}, V{1, -3, 2}), -2);
    EXPECT_EQ(one(FarthestElement{}, V{1, 2, 4}), 3);
    EXPECT_EQ(one(FarthestElement{}, V{2, -2}), 1) << "the first of several";
    EXPECT_EQ(one(FarthestElement{}, V{-5}), -1);
    EXPECT_EQ(one(FarthestElement{}, V{}), 0);
    EXPECT_EQ(one(ExtremeElement{}, V{1}, V{3, 1, 2}), 1);
    EXPECT_EQ(one(ExtremeElement{}, V{-1}, V{3, 1, 2}), 0);
    EXPECT_EQ(one(ExtremeElement{}, V{-1}, V{3, 4, 4}), 1);
    const V a{1, 5, 2}, b{0, 6, 2}, c{3};
    const View<const double> list[3] = {*a, *b, *c};
    int which[3];
    ExtremeOperand{}(View<int>(which, 3), *V{1}, ListView<const double>(list));
    EXPECT_EQ((I{which[0], which[1], which[2]}), (I{1, 2, 0}));
    ExtremeOperand{}(View<int>(which, 3), *V{-1}, ListView<const double>(list));
    EXPECT_EQ((I{which[0], which[1], which[2]}), (I{2, 1, 2}));
}

TEST(Guards, NumberThePieceOfATable) {
    const V x{0, 1, 3}, u{-1, 0, 0.5, 0.75, 1, 1.75, 2, 2.5, 3, 4};
    const auto pieces = [&](Interpolation how, double clips) {
        return elements<int>(TablePiece{}, 10, V{static_cast<double>(how), clips}, x, u);
    };
    EXPECT_EQ(pieces(Interpolation::linear, 1), (I{-1, 0, 0, 0, 1, 1, 1, 1, 2, 2}))
        << "corners at the borders, too";
    EXPECT_EQ(pieces(Interpolation::linear, 0), (I{0, 0, 0, 0, 1, 1, 1, 1, 1, 1})) << "its lines go on";
    EXPECT_EQ(pieces(Interpolation::flat, 1), (I{0, 0, 0, 0, 1, 1, 1, 1, 2, 2}))
        << "nothing jumps at the first";
    EXPECT_EQ(pieces(Interpolation::nearest, 1), (I{0, 0, 1, 1, 1, 1, 2, 2, 2, 2})) << "jumps half-way";
    EXPECT_EQ(elements<int>(TablePiece{}, 2, V{2, 1}, V{1}, V{0, 2}), (I{0, 0})) << "one point has no pieces";
}

// ---- sources

TEST(Sources, StartWhereTheySay) {
    EXPECT_EQ(elements(Step{}, 2, V{1}, V{2, 3}, V{4, 5}, V{0.5}), (D{2, 3}));
    EXPECT_EQ(elements(Step{}, 2, V{1}, V{2, 3}, V{4, 5}, V{1}), (D{4, 5}));
    EXPECT_EQ(elements(Ramp{}, 2, V{2, -1}, V{1}, V{10}, V{0.5}), (D{10, 10}));
    EXPECT_EQ(elements(Ramp{}, 2, V{2, -1}, V{1}, V{10}, V{3}), (D{14, 8}));
    EXPECT_EQ(elements(SineWave{}, 1, V{3}, V{0}, V{std::acos(0.0)}, V{0.5}, V{9}), (D{3.5}));
    EXPECT_NEAR(elements(SineWave{}, 1, V{2}, V{3}, V{0.25}, V{1}, V{0.5})[0], 2 * std::sin(1.75) + 1, 1e-15);
}

TEST(Sources, AChirpHasItsFrequencyAtItsTarget) {
    // The frequency is the derivative of the phase, by central differences of turns = asin(y) / 2π.
    const auto y = [](double t) { return elements(Chirp{}, 1, V{0.02}, V{0.05}, V{4}, V{t})[0]; };
    const auto frequency = [&](double t) {
        return (std::asin(y(t + 1e-4)) - std::asin(y(t - 1e-4))) / 2e-4 / (2 * std::acos(-1.0));
    };
    EXPECT_EQ(y(0), 0);
    EXPECT_NEAR(frequency(1e-3), 0.02, 1e-4);
    EXPECT_NEAR(frequency(2), 0.035, 1e-6);
    EXPECT_NEAR(frequency(4), 0.05, 1e-6);
}

TEST(Sources, APulseIsHighInTheFirstPartOfItsPeriodAfterItsDelay) {
    const auto y = [](double t) { return elements(Pulse{}, 1, V{7}, V{0.4}, V{25}, V{0.2}, V{t})[0]; };
    for (int k = 0; k < 2000; ++k) {
        const double t = k * 0.1;                        // k times a period, rounded
        const bool is_high = k >= 2 && (k - 2) % 4 == 0; // in whole tenths
        EXPECT_EQ(y(t), is_high ? 7 : 0) << t;
    }
    EXPECT_EQ(y(0.2 - 1e-9), 0);
    EXPECT_EQ(y(0.3 - 1e-9), 7);
    int last = elements<int>(PulseEdges{}, 1, V{0.4}, V{25}, V{0.2}, V{0.0})[0];
    EXPECT_EQ(last % 2, 0);
    for (int k = 1; k < 200; ++k) {
        const double t = k * 0.05;
        const int edges = elements<int>(PulseEdges{}, 1, V{0.4}, V{25}, V{0.2}, V{t})[0];
        EXPECT_EQ(edges % 2 != 0, y(t) != 0) << t << ": odd while it is high";
        EXPECT_EQ(edges - last, (y(t) != 0) != (last % 2 != 0) ? 1 : 0) << t << ": one for each edge";
        last = edges;
    }
}

TEST(Sources, WavesHaveTheirShapesAndCountTheirCorners) {
    struct Shape {
        Waveform form;
        D values; ///< at eighths of a turn
        I edges;
    };
    const double half = std::sqrt(0.5);
    for (const auto& [form, values, edges] :
         {Shape{Waveform::sine, {0, half, 1, half, 0, -half, -1, -half}, {0, 0, 0, 0, 0, 0, 0, 0}},
          Shape{Waveform::square, {1, 1, 1, 1, -1, -1, -1, -1}, {0, 0, 0, 0, 1, 1, 1, 1}},
          Shape{Waveform::sawtooth, {-1, -.75, -.5, -.25, 0, .25, .5, .75}, {0, 0, 0, 0, 0, 0, 0, 0}},
          Shape{Waveform::triangle, {-1, -.5, 0, .5, 1, .5, 0, -.5}, {0, 0, 0, 0, 1, 1, 1, 1}}})
        for (int k = 0; k < 80; ++k) {
            const V shape{static_cast<double>(form)};
            const double t = k / 8.0 * 0.7; // of a wave of 1/0.7 Hz, so that times are rounded
            const auto n = static_cast<std::size_t>(k % 8);
            EXPECT_NEAR(elements(Wave{}, 1, shape, V{3}, V{1 / 0.7}, V{t})[0], 3 * values[n], 1e-13)
                << static_cast<int>(form) << " at " << k << "/8";
            const int per_turn = form == Waveform::sine ? 0 : form == Waveform::sawtooth ? 1 : 2;
            EXPECT_EQ(elements<int>(WaveEdges{}, 1, shape, V{1 / 0.7}, V{t})[0],
                      per_turn * (k / 8) + edges[n])
                << static_cast<int>(form) << " at " << k << "/8";
        }
}

TEST(Sources, ACycleRepeatsItsPointsAndCountsThem) {
    const V points{1, 1.5, 3};
    for (int k = 0; k < 60; ++k) {
        const double t = 1 + 0.25 * k, within = 1 + 0.25 * (k % 8);
        EXPECT_NEAR(elements(WithinCycle{}, 1, points, V{t})[0], within, 1e-12) << t;
        EXPECT_EQ(elements<int>(CycleEdges{}, 1, points, V{t})[0], 2 * (k / 8) + (within >= 1.5)) << t;
    }
    const V x{0, 1, 3}, v{5, 7, 3};
    EXPECT_EQ(elements(Interpolate{}, 7, x, v, V{-1, 0, 0.5, 1, 2, 3, 9}), (D{5, 5, 6, 7, 5, 3, 3}));
    EXPECT_EQ(elements(Interpolate{}, 3, V{2}, V{8}, V{1, 2, 3}), (D{8, 8, 8}));
    EXPECT_TRUE(std::isnan(elements(Interpolate{}, 1, x, v, V{nan})[0]));
    EXPECT_TRUE(std::isnan(elements(Interpolate{}, 1, V{2}, V{8}, V{nan})[0]));
}

TEST(Sources, CountersBeginAgain) {
    const auto next = [](double limit, double u) { return elements(CountUp{}, 1, V{limit}, V{u})[0]; };
    EXPECT_EQ(next(2, 0), 1);
    EXPECT_EQ(next(2, 1), 2);
    EXPECT_EQ(next(2, 2), 0);
    const V list{7, 8, 9};
    for (const auto& [k, value, after] : {std::array{0., 7., 1.}, {1, 8, 2}, {2, 9, 0}, {5, 9, 0}}) {
        EXPECT_EQ(elements(ElementOf{}, 1, list, V{k})[0], value);
        EXPECT_EQ(elements(CountAlong{}, 1, list, V{k})[0], after);
    }
}

} // namespace
} // namespace bf::kernels
