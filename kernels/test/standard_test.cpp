// What the standard blocks decide and sum up, and the limits of parameters.
#include "eigen_views.hpp"

#include "bf/kernels/limits.hpp"
#include "bf/kernels/standard.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using D = std::vector<double>;

TEST(Decisions, AssertCountAndLookUpRows) {
    const auto holds = [](const V& u) { return Assert{}(*u); };
    EXPECT_TRUE(holds({1, -2, 0.5}));
    EXPECT_FALSE(holds({1, 0, 1}));
    EXPECT_FALSE(holds({0, 1}));
    EXPECT_TRUE(holds({}));
    EXPECT_EQ(elements(Count{}, 1, V{4}, V{1}, V{0}), D{5});
    EXPECT_EQ(elements(Count{}, 1, V{4}, V{-1}, V{0}), D{5});
    EXPECT_EQ(elements(Count{}, 1, V{4}, V{0}, V{0}), D{4});
    EXPECT_EQ(elements(Count{}, 1, V{4}, V{1}, V{-1}), D{0});
    Eigen::MatrixXd table(2, 3);
    table << 1, 2, 3, 4, 5, 6;
    Eigen::VectorXd row(3);
    EXPECT_TRUE(LookUpRow{}(view(row), view(table), *V{2}));
    EXPECT_EQ(row, Eigen::Vector3d(4, 5, 6));
    for (const double outside : {0.0, 3.0, -1.0, nan}) {
        EXPECT_FALSE(LookUpRow{}(view(row), view(table), *V{outside}));
        EXPECT_EQ(row, Eigen::Vector3d(0, 0, 0));
    }
}

TEST(Decisions, AProductOfMatricesIsScaledByASingleElement) {
    Eigen::MatrixXd a(2, 2), b(2, 2), y(2, 2), one(1, 1);
    a << 1, 2, 3, 4;
    b << 5, 6, 7, 8;
    one << 3;
    ScalarOrMatrixProduct{}(view(y), view(a), view(b));
    EXPECT_EQ(y, a * b);
    ScalarOrMatrixProduct{}(view(y), view(one), view(b));
    EXPECT_EQ(y, 3 * b);
    ScalarOrMatrixProduct{}(view(y), view(a), view(one));
    EXPECT_EQ(y, 3 * a);
}

TEST(Decisions, AnOnDelayHoldsAfterItsDurationAndForgivesRounding) {
    const double period = 0.1;
    double since = 0;
    for (int k = 0; k <= 40; ++k) {
        const double u = k == 20 ? 0 : k % 2 ? 1 : -1; // what is not 0 is true
        double next, y;
        OnDelay{}(View<double>(&y, 1), View<double>(&next, 1), *V{0.7}, *V{period}, *V{since}, *V{u});
        const int steps = k < 20 ? k : k - 21; // that it was true before
        EXPECT_EQ(y != 0, k != 20 && steps >= 7) << k;
        EXPECT_NEAR(next, k == 20 ? 0 : (steps + 1) * period, 1e-12) << k;
        since = next;
    }
}

TEST(Decisions, TheFirstOfSeveralThatIsTrueOrEqual) {
    const V no{0}, yes{1};
    const auto first = [](double which, std::initializer_list<View<const double>> list) {
        double y;
        IsFirst{}(View<double>(&y, 1), *V{which},
                  ListView<const double>(list.begin(), static_cast<int>(list.size())));
        return y;
    };
    for (int which = 0; which < 4; ++which) {
        EXPECT_EQ(first(which, {*no, *yes, *yes}), which == 1) << which;
        EXPECT_EQ(first(which, {*no, *no, *no}), which == 3) << which;
        EXPECT_EQ(first(which, {*yes, *no, *yes}), which == 0) << which;
        for (const auto& [u, place] : {std::pair(4.9, 1), {3, 0}, {5, 2}, {-4.0, 3}, {3.999, 0}})
            EXPECT_EQ(elements(IsCase{}, 1, V{double(which)}, V{3, 4, 5}, V{u})[0], which == place)
                << u << which;
    }
    EXPECT_EQ(elements(AlwaysTrue{}, 1, V{0}), D{1});
}

/// value and passed after samples of two elements, one at each second.
template <CheckKind kind>
std::pair<double, double> checked(std::initializer_list<std::pair<double, double>> samples, double from = 0,
                                  double at_least = -inf, double at_most = inf) {
    double value = 0, passed = 1, sum = 0, count = 0, t = 0;
    for (const auto& [a, b] : samples) {
        const double v = value, p = passed, s = sum, n = count;
        const auto in = [](const double& x) { return View<const double>(&x, 1); };
        Check<kind>{}(View<double>(&value, 1), View<double>(&passed, 1), View<double>(&sum, 1),
                      View<double>(&count, 1), in(v), in(p), in(s), in(n), *V{from}, *V{at_least},
                      *V{at_most}, *V{t}, *V{a, b});
        t += 1;
    }
    return {value, passed};
}
using Pair = std::pair<double, double>;

TEST(Checks, SumUpTheSamplesFromTheirTimeOn) {
    constexpr auto always = CheckKind::always;
    EXPECT_EQ(checked<always>({{1, 2}, {3, 4}}), (Pair{1, 1}));
    EXPECT_EQ(checked<always>({{1, 0}, {3, 4}}), (Pair{0, 0})) << "once is enough";
    EXPECT_EQ(checked<always>({{1, 0}, {3, 4}}, 1), (Pair{1, 1})) << "before its time";
    EXPECT_EQ(checked<always>({{-1, 1}, {0, 1}}), (Pair{0, 0}));
    EXPECT_EQ(checked<CheckKind::final>({{1, 2}, {3, 4}}), (Pair{3, 1}));
    EXPECT_EQ(checked<CheckKind::maximum>({{-5, -7}, {-6, -9}}), (Pair{-5, 1}));
    EXPECT_EQ(checked<CheckKind::maximum>({{1, 9}, {2, 3}}, 1), (Pair{3, 1}));
    EXPECT_EQ(checked<CheckKind::minimum>({{5, 7}, {6, 4}}), (Pair{4, 1}));
    for (const auto& [value, passed] :
         {checked<CheckKind::maximum>({{1, nan}, {2, 3}}), checked<CheckKind::minimum>({{nan, 1}, {2, 3}})}) {
        EXPECT_TRUE(std::isnan(value)) << "a NaN is not overlooked";
        EXPECT_EQ(passed, 0);
    }
    EXPECT_EQ(checked<CheckKind::rms>({{3, 4}, {0, 0}}).first, std::sqrt(25.0 / 2));
    EXPECT_EQ(checked<CheckKind::mean>({{1, 3}, {5, 7}}).first, 4);
    EXPECT_EQ(checked<CheckKind::rms>({{3, 4}, {0, 0}, {0, 0}}, 2).first, 0);
}

TEST(Checks, PassWithinTheirLimits) {
    for (const auto& [low, high, passes] :
         {std::tuple(3., 3., 1.), {2, 4, 1}, {3.5, 9, 0}, {-9, 2.5, 0}, {-inf, 3, 1}, {3, inf, 1}})
        EXPECT_EQ(checked<CheckKind::final>({{3, 0}}, 0, low, high).second, passes) << low << " " << high;
    EXPECT_EQ(checked<CheckKind::final>({{3, 0}}, 1, 4).second, 1) << "not judged before its time";
}

// ---- limits

std::string said(const Limits& limits, const D& values) {
    char text[256] = "nothing";
    const bool is_found = find_outside(
        limits, static_cast<int>(values.size()), [&](int i) { return values[static_cast<std::size_t>(i)]; },
        text, sizeof text);
    return is_found ? text : "";
}
template <class T> std::string said(const D& values) {
    char text[256];
    return find_outside(
               range_of<T>(), static_cast<int>(values.size()),
               [&](int i) { return values[static_cast<std::size_t>(i)]; }, text, sizeof text)
               ? text
               : "";
}

TEST(Limits, AllowTheirBoundsAndSayWhatTheyAre) {
    EXPECT_EQ(said({}, {nan, inf, -inf}), "") << "nothing is asked for";
    EXPECT_EQ(said({.minimum = 0}, {0, 1, inf}), "");
    EXPECT_EQ(said({.minimum = 0}, {-1}), "must be at least 0, but is -1");
    EXPECT_EQ(said({.minimum = 0}, {1, nan}), "must be at least 0, but element 2 is NaN");
    EXPECT_EQ(said({.above = 0}, {0}), "must be greater than 0, but is 0");
    EXPECT_EQ(said({.above = 0}, {1e-300}), "");
    EXPECT_EQ(said({.maximum = 1}, {1}), "");
    EXPECT_EQ(said({.maximum = 1}, {1.5}), "must be at most 1, but is 1.5");
    EXPECT_EQ(said({.maximum = 1}, {-inf}), "");
    EXPECT_EQ(said({.minimum = 0, .maximum = 1}, {2}), "must be from 0 to 1, but is 2");
    EXPECT_EQ(said({.above = 0, .maximum = 1}, {0, 2}),
              "must be greater than 0 and at most 1, but element 1 is 0");
    EXPECT_EQ(said({.minimum = 2, .above = 1}, {1.5}), "must be at least 2, but is 1.5")
        << "the narrower one";
    EXPECT_EQ(said({.minimum = 1, .above = 2}, {1.5}), "must be greater than 2, but is 1.5");
    EXPECT_EQ(said({.minimum = 0.3}, {0.1 + 0.2 - 1e-16}),
              "must be at least 0.3, but is 0.29999999999999993");
    EXPECT_FALSE(Limits{}.are_given());
    EXPECT_TRUE((Limits{.minimum = 0}.are_given() && Limits{.above = 0}.are_given() &&
                 Limits{.maximum = 0}.are_given()));
}

TEST(Limits, OfATypeAreTheNumbersThatItHolds) {
    EXPECT_EQ(said<std::int8_t>({-128, 127, 0}), "");
    EXPECT_EQ(said<std::int8_t>({128}), "must be a whole number from -128 to 127, but is 128");
    EXPECT_EQ(said<std::int8_t>({-129}), "must be a whole number from -128 to 127, but is -129");
    EXPECT_EQ(said<std::int8_t>({0.5}), "must be a whole number from -128 to 127, but is 0.5");
    EXPECT_EQ(said<std::uint32_t>({4294967296.0}),
              "must be a whole number from 0 to 4294967295, but is 4294967296");
    EXPECT_EQ(said<bool>({0, 1}), "");
    EXPECT_EQ(said<bool>({2}), "must be 0 or 1, but is 2");
    EXPECT_EQ(said<double>({1e308, -inf, inf, 0}), "");
    EXPECT_EQ(said<double>({nan}), "must be a number, but is NaN");
    EXPECT_EQ(said<float>({0.1, inf}), "");
    EXPECT_TRUE(said<float>({1e39}).starts_with("must be a number of at most 3.40282346638"))
        << said<float>({1e39});
}

TEST(Limits, OfOneParameterByAnother) {
    const auto below = [](const D& upper, const D& lower) -> std::string {
        char text[256];
        const auto at = [](const D& list) {
            return [&list](int i) { return list[static_cast<std::size_t>(i)]; };
        };
        return find_below("p.upper", static_cast<int>(upper.size()), at(upper), "lower",
                          static_cast<int>(lower.size()), at(lower), text, sizeof text)
                   ? text
                   : "";
    };
    EXPECT_EQ(below({2}, {2}), "");
    EXPECT_EQ(below({1}, {2}), "parameter 'p.upper' must be at least 'lower', but 1 is below 2");
    EXPECT_EQ(below({3, 1}, {2}),
              "parameter 'p.upper' must be at least 'lower', but 1 is below 2 (element 2)");
    EXPECT_EQ(below({3}, {1, 2, 4}),
              "parameter 'p.upper' must be at least 'lower', but 3 is below 4 (element 3)");
    EXPECT_EQ(below({3, 4}, {3, 4}), "");
    EXPECT_EQ(below({nan}, {2}), "") << "NaN is refused elsewhere";
}

} // namespace
} // namespace bf::kernels
