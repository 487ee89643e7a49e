#include "eigen_views.hpp"

#include "bf/kernels/lookup.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using D = std::vector<double>;

/// A table over its points, asked at one place.
struct Table {
    std::vector<D> points;
    D values;
    Interpolation how = Interpolation::linear;
    bool clips = false;
    std::vector<std::int32_t> guess = std::vector<std::int32_t>(6, 0);

    /// The table of f over its points.
    Table& fill(const std::function<double(const D&)>& f) {
        D at(points.size());
        const std::function<void(std::size_t)> run = [&](std::size_t i) {
            if (i-- == 0) return values.push_back(f(at));
            for (const double x : points[i]) {
                at[i] = x;
                run(i);
            }
        };
        run(points.size()); // the first dimension runs fastest
        return *this;
    }
    double operator()(const D& u) {
        D layout{double(how), double(clips)};
        for (const auto& x : points) layout.push_back(double(x.size()));
        for (const auto& x : points) layout.insert(layout.end(), x.begin(), x.end());
        std::vector<View<const double>> list;
        for (const double& x : u) list.push_back({&x, 1});
        double y = 0;
        Lookup{}(View<double>{&y, 1}, View<const double>{layout.data(), int(layout.size())},
                 View<const double>{values.data(), int(values.size())},
                 ListView<const double>(list.data(), int(list.size())),
                 View<std::int32_t>{guess.data(), int(u.size())});
        return y;
    }
};

TEST(Lookup, FindsTheSameIntervalFromEveryGuess) {
    const double x[] = {-1, 0, 0.5, 2, 7};
    for (const double u : {-3.0, -1.0, -0.1, 0.0, 0.5, 1.9, 2.0, 7.0, 9.0, nan}) {
        int expected = 0;
        while (expected < 3 && u >= x[expected + 1]) ++expected;
        for (const int guess : {-5, 0, 1, 2, 3, 4, 99, std::numeric_limits<int>::max()})
            EXPECT_EQ(interval(x, 5, u, guess), expected) << u << " " << guess;
    }
    EXPECT_EQ(interval(x, 1, 3.0, 0), 0);
}

TEST(Lookup, IsExactForFunctionsThatAreLinearInEachInput) {
    const auto f = [](const D& u) { return 2 + u[0] - 3 * u[1] + 0.5 * u[2] * u[0] - u[0] * u[1] * u[2]; };
    Table t{{{-1, 0, 2}, {0, 1, 1.5, 3}, {-2, 5}}, {}};
    t.fill(f);
    for (const D& u : {D{0, 0, 0}, {-0.7, 1.2, 3}, {1.9, 2.9, -1.5}, {-4, 7, 9}, {2, 3, 5}})
        EXPECT_NEAR(t(u), f(u), 1e-12);
    t.clips = true;
    EXPECT_NEAR(t({-4, 7, 9}), f({-1, 3, 5}), 1e-12);
    EXPECT_NEAR(t({1, 7, -9}), f({1, 3, -2}), 1e-12);
}

TEST(Lookup, TakesTheValueBelowOrTheNearest) {
    Table t{{{0, 1, 3}}, {10, 20, 30}, Interpolation::flat};
    for (const auto& [u, y] : std::vector<std::pair<double, double>>{
             {-1, 10}, {0, 10}, {0.99, 10}, {1, 20}, {2.9, 20}, {3, 30}, {8, 30}})
        EXPECT_EQ(t({u}), y) << u;
    t.how = Interpolation::nearest;
    for (const auto& [u, y] :
         std::vector<std::pair<double, double>>{{-1, 10}, {0.49, 10}, {0.5, 20}, {1.9, 20}, {2, 30}, {8, 30}})
        EXPECT_EQ(t({u}), y) << u;
}

TEST(Lookup, MeetsItsPointsWhateverLiesBeside) {
    Table t{{{0, 1, 2}}, {inf, 5, inf}};
    EXPECT_EQ(t({1}), 5);
    for (const auto how : {Interpolation::flat, Interpolation::nearest, Interpolation::linear}) {
        t.how = how;
        EXPECT_TRUE(std::isnan(t({nan})));
    }
    Table single{{{4}}, {7}};
    EXPECT_EQ(single({-100}), 7);
}

TEST(Lookup, RoundsAndHoldsIntegers) {
    const std::int8_t values[] = {0, 5, 127};
    const V layout{double(Interpolation::linear), 0, 3, 0, 2, 3};
    std::int32_t guess = 0;
    const auto at = [&](std::int8_t u) {
        std::int8_t y = 0;
        const View<const std::int8_t> list[] = {{&u, 1}};
        Lookup{}(View<std::int8_t>{&y, 1}, *layout, View<const std::int8_t>{values, 3},
                 ListView<const std::int8_t>(list), View<std::int32_t>{&guess, 1});
        return y;
    };
    EXPECT_EQ(at(1), 3); // 2.5
    EXPECT_EQ(at(4), 127);
    EXPECT_EQ(at(-100), -128);
}

/// y at u for the slopes of K.
template <class K, class... W> D cubic(K slopes, const V& x, const V& v, const V& u, W... work) {
    const int n = static_cast<int>(x.elements.size()), m = static_cast<int>(u.elements.size());
    Eigen::VectorXd s(n), y(m);
    slopes(view(s), *x, *v, work...);
    std::int32_t guess = 0;
    Hermite{}(view(y), *V{0}, *x, *v, view(s), *u, View<std::int32_t>{&guess, 1});
    return {y.data(), y.data() + m};
}

const V x{0, 1, 2.5, 3, 4.5, 6}, v{1, -1, 2, 2.5, 0, 3}, u{0, 0.5, 1.75, 2.7, 3.9, 5.5, 6};

TEST(Spline, EqualsScipys) {
    // scipy 1.17.1: CubicSpline(x, v)(u)
    const D expected{1.0,
                     -0.749027777777778,
                     0.28714843749999996,
                     2.302811666666667,
                     1.2299450000000003,
                     0.40790895061728316,
                     2.999999999999999};
    Eigen::VectorXd work(6);
    const D y = cubic(SplineSlopes{}, x, v, u, view(work));
    for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], expected[i], 1e-13) << i;
}

TEST(Spline, IsExactForCubicsAndForFewPoints) {
    const auto f = [](double t) { return 1 - 2 * t + 0.5 * t * t - t * t * t; };
    const V values{f(0), f(1), f(2.5), f(3), f(4.5), f(6)};
    Eigen::VectorXd work(6);
    const D y = cubic(SplineSlopes{}, x, values, u, view(work));
    for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], f(u.elements[long(i)]), 1e-12);
    // scipy 1.17.1: CubicSpline(x[:3], v[:3])([0.5, 2])
    const D three = cubic(SplineSlopes{}, V{0, 1, 2.5}, V{1, -1, 2}, V{0.5, 2}, view(work));
    const D parabola{-0.4, 0.2000000000000002};
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(three[i], parabola[i], 1e-14);
    EXPECT_EQ(cubic(SplineSlopes{}, V{1, 3}, V{0, 4}, V{1.5, 5}, view(work)), (D{1, 8}));
    EXPECT_EQ(cubic(SplineSlopes{}, V{1}, V{4}, V{1.5, 1}, view(work)), (D{4, 4}));
}

TEST(Akima, EqualsScipysModifiedAkima) {
    // scipy 1.17.1: Akima1DInterpolator(x, v, method="makima")(u)
    const D expected{1.0,
                     -0.5059523809523809,
                     0.4285714285714284,
                     2.2813834586466166,
                     1.0061353383458647,
                     1.5007642563198118,
                     3.0};
    const D y = cubic(AkimaSlopes{}, x, v, u);
    for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], expected[i], 1e-13) << i;
}

TEST(Akima, KeepsAFlatStretchFlat) {
    const D y = cubic(AkimaSlopes{}, V{0, 1, 2, 3, 4, 5}, V{0, 1, 1, 1, 1, 4}, V{1.5, 2.3, 3});
    EXPECT_EQ(y, (D{1, 1, 1}));
    EXPECT_EQ(cubic(AkimaSlopes{}, V{1, 3}, V{0, 4}, V{1.5, 5}), (D{1, 8}));
}

TEST(Prelookup, WithItsTableIsTheLookup) {
    const V a{-1, 0, 2}, b{0, 1, 1.5, 3};
    D table(12);
    for (int i = 0; i < 12; ++i) table[static_cast<std::size_t>(i)] = std::sin(i * i);
    Table direct{{{-1, 0, 2}, {0, 1, 1.5, 3}}, table};
    for (const D& at : {D{0.3, 1.1}, {-1, 3}, {5, -2}, {2, 3}}) {
        double k[2], f[2], y = 0;
        std::int32_t guess = 0;
        const View<std::int32_t> g{&guess, 1};
        Prelookup{}(View<double>{&k[0], 1}, View<double>{&f[0], 1}, *V{0}, *a, *V{at[0]}, g);
        Prelookup{}(View<double>{&k[1], 1}, View<double>{&f[1], 1}, *V{0}, *b, *V{at[1]}, g);
        const View<const double> places[] = {{&k[0], 1}, {&f[0], 1}, {&k[1], 1}, {&f[1], 1}};
        const auto ask = [&] {
            return InterpolateAt{}(View<double>{&y, 1}, *V{3, 4}, View<const double>{table.data(), 3, 4},
                                   ListView<const double>(places));
        };
        EXPECT_TRUE(ask());
        EXPECT_EQ(y, direct(at));
        k[1] = 3;
        EXPECT_FALSE(ask());
        EXPECT_EQ(y, 0);
    }
}

} // namespace
} // namespace bf::kernels
