#include "eigen_views.hpp"

#include "bf/kernels/convert.hpp"
#include "bf/kernels/functions.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/overflow.hpp"
#include "bf/kernels/reduce.hpp"
#include "bf/kernels/routing.hpp"
#include "bf/kernels/sources.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using D = std::vector<double>;
using B = std::vector<bool>;

B flags(const std::vector<double>& y) { return {y.begin(), y.end()}; }

TEST(Elementwise, GainExpandsScalars) {
    EXPECT_EQ(elements(Gain{}, 3, V{2}, V{1, 2, 3}), (D{2, 4, 6}));
    EXPECT_EQ(elements(Gain{}, 3, V{1, 2, 3}, V{2}), (D{2, 4, 6}));
    EXPECT_EQ(elements(Gain{}, 3, V{1, 2, 3}, V{4, 5, 6}), (D{4, 10, 18}));
}

TEST(Elementwise, SumFollowsItsSigns) {
    const V a{1, 2}, b{10}, c{100, 200};
    const View<const double> u[] = {a, b, c};
    Eigen::Vector2d y;
    Sum{}(view(y), *Vector<int>{-1, 1, -1}, ListView<const double>(u));
    EXPECT_EQ(y, Eigen::Vector2d(-91, -192));
}

TEST(Elementwise, ProductDividesWhereAsked) {
    const V a{2, 4}, b{10, 20}, c{5};
    const View<const double> u[] = {a, b, c};
    Eigen::Vector2d y;
    ElementProduct{}(view(y), *Vector<int>{-1, 1, -1}, ListView<const double>(u));
    EXPECT_EQ(y, Eigen::Vector2d(1. / 2 * 10 / 5, 1. / 4 * 20 / 5));
}

TEST(Elementwise, MayWriteOnItsInput) {
    Eigen::Vector3d u(1, -2, 3);
    Abs{}(view(u), view(u));
    EXPECT_EQ(u, Eigen::Vector3d(1, 2, 3));
}

TEST(Elementwise, IntegersWrapAround) {
    EXPECT_EQ(add<std::int8_t>(127, 1), -128);
    EXPECT_EQ(subtract<std::uint8_t>(0, 1), 255);
    EXPECT_EQ(multiply<std::int32_t>(65536, 65536), 0);
    EXPECT_EQ(multiply<std::uint16_t>(65535, 65535), 1);
    EXPECT_EQ(negate<std::int8_t>(-128), -128);
    EXPECT_EQ(absolute<std::int32_t>(std::numeric_limits<std::int32_t>::min()),
              std::numeric_limits<std::int32_t>::min());
}

TEST(Elementwise, IntegerQuotientsAreFloored) {
    EXPECT_EQ(divide<std::int8_t>(-7, 2), -4);
    EXPECT_EQ(divide<std::int8_t>(7, 2), 3);
    EXPECT_EQ(divide<std::int8_t>(5, 0), 127);
    EXPECT_EQ(divide<std::int8_t>(-5, 0), -128);
    EXPECT_EQ(divide<std::int8_t>(0, 0), 0);
}

TEST(Elementwise, ModuloHasTheSignOfTheDivisorRemainderThatOfTheDividend) {
    EXPECT_EQ(elements(Mod{}, 4, V{-7, 7, -7, 5}, V{3, -3, -3, 0}), (D{2, -2, -1, 5}));
    EXPECT_EQ(elements(Rem{}, 3, V{-7, 7, -7}, V{3, -3, -3}), (D{-1, 1, -1}));
    EXPECT_EQ(modulo<std::int8_t>(-7, 3), 2);
    // With an infinite divisor, as MATLAB documents.
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(modulo(5.0, infinity), 5);
    EXPECT_EQ(modulo(5.0, -infinity), -infinity);
    EXPECT_EQ(remainder(-5.0, infinity), -5);
    EXPECT_TRUE(std::isnan(remainder(5.0, 0.0)));
    EXPECT_EQ(modulo<std::uint32_t>(4294967295u, 7u), 4294967295u % 7u);
    EXPECT_EQ(remainder<std::int8_t>(-7, 3), -1);
}

TEST(Elementwise, MinimumAndMaximumIgnoreNaN) {
    EXPECT_EQ(elements(Minimum{}, 3, V{1, nan, 3}, V{2, 2, nan}), (D{1, 2, 3}));
    EXPECT_EQ(elements(Maximum{}, 3, V{1, nan, 3}, V{2, 2, nan}), (D{2, 2, 3}));
    const V a{1, 5}, b{4, nan}, c{2};
    const View<const double> u[] = {a, b, c};
    Eigen::Vector2d y;
    MinimumOfList{}(view(y), ListView<const double>(u));
    EXPECT_EQ(y, Eigen::Vector2d(1, 2));
    MaximumOfList{}(view(y), ListView<const double>(u));
    EXPECT_EQ(y, Eigen::Vector2d(4, 5));
}

TEST(Elementwise, SignKeepsNaN) {
    EXPECT_EQ(elements(Sign{}, 3, V{-2, 0, 5}), (D{-1, 0, 1}));
    EXPECT_TRUE(std::isnan(Sign::apply(nan)));
}

TEST(Functions, FulfilTheirIdentities) {
    for (double x : {-0.9, -0.3, 0.2, 0.7}) {
        EXPECT_NEAR(Sin::apply(x) * Sin::apply(x) + Cos::apply(x) * Cos::apply(x), 1, 1e-15);
        EXPECT_NEAR(Tan::apply(x), Sin::apply(x) / Cos::apply(x), 1e-15);
        EXPECT_NEAR(Asin::apply(Sin::apply(x)), x, 1e-15);
        EXPECT_NEAR(Acos::apply(Cos::apply(x)), std::fabs(x), 1e-15);
        EXPECT_NEAR(Atan::apply(Tan::apply(x)), x, 1e-15);
        EXPECT_NEAR(Atan2::apply(Sin::apply(x), -Cos::apply(x)), std::copysign(M_PI, x) - x, 1e-15);
        EXPECT_NEAR(Sinh::apply(x), (Exp::apply(x) - Exp::apply(-x)) / 2, 1e-15);
        EXPECT_NEAR(Cosh::apply(x), (Exp::apply(x) + Exp::apply(-x)) / 2, 1e-15);
        EXPECT_NEAR(Tanh::apply(x), Sinh::apply(x) / Cosh::apply(x), 1e-15);
        EXPECT_NEAR(Asinh::apply(Sinh::apply(x)), x, 1e-15);
        EXPECT_NEAR(Acosh::apply(Cosh::apply(x)), std::fabs(x), 1e-14);
        EXPECT_NEAR(Atanh::apply(Tanh::apply(x)), x, 1e-15);
        EXPECT_NEAR(Log::apply(Exp::apply(x)), x, 1e-15);
        EXPECT_NEAR(Log10::apply(Pow10::apply(x)), x, 1e-15);
        EXPECT_DOUBLE_EQ(SignedSqrt::apply(x) * std::fabs(SignedSqrt::apply(x)), x);
        EXPECT_DOUBLE_EQ(Sqrt::apply(x * x), std::fabs(x));
        EXPECT_DOUBLE_EQ(ReciprocalSqrt::apply(x * x), std::fabs(Reciprocal::apply(x)));
        EXPECT_DOUBLE_EQ(Hypot::apply(3 * x, 4 * x), 5 * std::fabs(x));
        EXPECT_DOUBLE_EQ(Power::apply(x, 3.0), x * x * x);
        EXPECT_EQ(Power::apply(x, 2.0), Square::apply(x));
    }
    EXPECT_EQ(elements(Floor{}, 2, V{-1.5, 2.5}), (D{-2, 2}));
    EXPECT_EQ(elements(Ceil{}, 2, V{-1.5, 2.5}), (D{-1, 3}));
    EXPECT_EQ(elements(Round{}, 2, V{-1.5, 2.5}), (D{-2, 3}));
    EXPECT_EQ(elements(Fix{}, 2, V{-1.5, 2.5}), (D{-1, 2}));
}

template <class T>
std::vector<T> convert(const Vector<double>& u, Rounding rounding, Overflow overflow = Overflow::wrap) {
    const Vector<double> options{double(rounding), double(overflow)};
    return elements<T>(Convert{}, static_cast<int>(u.elements.size()), options, u);
}

TEST(Convert, RoundsAsAsked) {
    using I = std::vector<std::int32_t>;
    const V u{-2.5, -0.4, 0.49999999999999994, 1.5, 2.5};
    EXPECT_EQ(convert<std::int32_t>(u, Rounding::zero), (I{-2, 0, 0, 1, 2}));
    EXPECT_EQ(convert<std::int32_t>(u, Rounding::floor), (I{-3, -1, 0, 1, 2}));
    EXPECT_EQ(convert<std::int32_t>(u, Rounding::ceil), (I{-2, 0, 1, 2, 3}));
    EXPECT_EQ(convert<std::int32_t>(u, Rounding::nearest), (I{-2, 0, 0, 2, 3}));
    EXPECT_EQ(convert<std::int32_t>(u, Rounding::away), (I{-3, 0, 0, 2, 3}));
    for (const double x : {-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 0.49999999999999994, 7.2, -7.8})
        EXPECT_EQ(rounded(x, Rounding::convergent), std::nearbyint(x)) << x; // the default of IEEE 754
}

TEST(Convert, WrapsOrSaturates) {
    using I = std::vector<std::int8_t>;
    const V u{300, -300, nan, inf, 127.9};
    EXPECT_EQ(convert<std::int8_t>(u, Rounding::floor), (I{44, -44, 0, 0, 127}));
    EXPECT_EQ(convert<std::int8_t>(u, Rounding::floor, Overflow::saturate), (I{127, -128, 0, 127, 127}));
    EXPECT_EQ((converted<std::uint8_t>(std::int32_t(-1))), 255);
    EXPECT_EQ((converted<std::uint8_t>(std::int32_t(-1), Rounding::floor, Overflow::saturate)), 0);
    EXPECT_EQ((converted<bool>(0.1)), true);
}

TEST(Convert, TellsWhatDoesNotFit) {
    const auto fits_in = [](auto type, double x) {
        decltype(type) y{};
        return Convert{}(View<decltype(type)>{&y, 1}, *V{double(Rounding::floor), double(Overflow::error)},
                         *V{x});
    };
    for (const double x : {-128.0, 127.9}) EXPECT_TRUE(fits_in(std::int8_t{}, x)) << x;
    for (const double x : {-128.1, 128.0, nan, inf}) EXPECT_FALSE(fits_in(std::int8_t{}, x)) << x;
    EXPECT_TRUE(fits_in(float{}, 3e38));
    for (const double x : {1e39, -inf, nan}) EXPECT_FALSE(fits_in(float{}, x)) << x;
}

TEST(Bounded, HoldsIntegersAtTheirLimitsAndTellsOfIt) {
    using I = std::vector<std::int8_t>;
    using I8 = Vector<std::int8_t>;
    const I8 a{100, -100, 5}, b{100, -100, -7};
    const View<const std::int8_t> list[] = {*a, *b};
    std::int8_t y[3];
    const View<std::int8_t> out{y, 3};
    const ListView<const std::int8_t> u(list);
    EXPECT_TRUE(BoundedSum{}(out, *V{0}, *V{1, 1}, u));
    EXPECT_EQ(I(y, y + 3), (I{127, -128, -2}));
    EXPECT_FALSE(BoundedSum{}(out, *V{1}, *V{1, 1}, u));
    EXPECT_TRUE(BoundedSum{}(out, *V{1}, *V{1, -1}, u));
    EXPECT_EQ(I(y, y + 3), (I{0, 0, 12}));
    EXPECT_TRUE(BoundedProduct{}(out, *V{0}, *V{1, 1}, u));
    EXPECT_EQ(I(y, y + 3), (I{127, 127, -35}));
    EXPECT_FALSE(BoundedGain{}(out, *V{1}, *I8{2}, *a));
    EXPECT_TRUE(BoundedGain{}(out, *V{1}, *I8{-1}, *a));
    const I8 least{-128}, minus{-1};
    const View<const std::int8_t> quotient[] = {*least, *minus};
    EXPECT_FALSE(
        BoundedProduct{}(View<std::int8_t>{y, 1}, *V{1}, *V{1, -1}, ListView<const std::int8_t>(quotient)));
    EXPECT_EQ(y[0], 127);
}

TEST(Bounded, TellsOfRealsThatAreNotFinite) {
    double y = 0;
    const V big{1e308}, zero{0};
    const View<const double> list[] = {*big, *big}, quotient[] = {*big, *zero};
    EXPECT_FALSE(BoundedSum{}(View<double>{&y, 1}, *V{1}, *V{1, 1}, ListView<const double>(list)));
    EXPECT_TRUE(BoundedSum{}(View<double>{&y, 1}, *V{1}, *V{1, -1}, ListView<const double>(list)));
    EXPECT_FALSE(BoundedProduct{}(View<double>{&y, 1}, *V{1}, *V{1, -1}, ListView<const double>(quotient)));
}

TEST(Logic, ComparesMixedTypesByValue) {
    EXPECT_EQ(flags(elements(Less{}, 2, Vector<std::int32_t>{-1, 3}, Vector<std::uint32_t>{2})), (B{1, 0}));
    EXPECT_EQ(flags(elements(Equal{}, 3, V{1, nan, 2}, V{1, nan, 3})), (B{1, 0, 0}));
    EXPECT_EQ(flags(elements(NotEqual{}, 3, V{1, nan, 2}, V{1, nan, 3})), (B{0, 1, 1}));
    EXPECT_EQ(flags(elements(LessEqual{}, 3, V{1, 2, 3}, V{2})), (B{1, 1, 0}));
    EXPECT_EQ(flags(elements(Greater{}, 3, V{1, 2, 3}, V{2})), (B{0, 0, 1}));
    EXPECT_EQ(flags(elements(GreaterEqual{}, 3, V{1, 2, 3}, V{2})), (B{0, 1, 1}));
}

template <class K> std::string table() {
    std::string out;
    for (double a : {0, 5})
        for (double b : {0, -1}) {
            const V x{a}, y{b};
            const View<const double> pair[] = {x, y};
            bool joined = false, over_elements = false;
            K{}(View<bool>{&joined, 1}, ListView<const double>(pair));
            const V both{a, b};
            const View<const double> one[] = {both};
            K{}(View<bool>{&over_elements, 1}, ListView<const double>(one));
            out += joined == over_elements ? (joined ? "1" : "0") : "differs";
        }
    return out;
}

TEST(Logic, FollowsItsTruthTableOverInputsAndOverElements) {
    EXPECT_EQ(table<And>(), "0001");
    EXPECT_EQ(table<Or>(), "0111");
    EXPECT_EQ(table<Nand>(), "1110");
    EXPECT_EQ(table<Nor>(), "1000");
    EXPECT_EQ(table<Xor>(), "0110");
    EXPECT_EQ(table<Xnor>(), "1001");
    EXPECT_EQ(flags(elements(Not{}, 2, V{0, 0.5})), (B{1, 0}));
    EXPECT_EQ(flags(elements(All{}, 1, V{1, 0})), (B{0}));
    EXPECT_EQ(flags(elements(Any{}, 1, V{1, 0})), (B{1}));
    EXPECT_EQ(flags(elements(AnyPositive{}, 1, V{-1, 0})), (B{0}));
    using U = Vector<std::uint8_t>;
    EXPECT_EQ(elements<std::uint8_t>(BitAnd{}, 1, U{6}, U{3})[0], 2);
    EXPECT_EQ(elements<std::uint8_t>(BitOr{}, 1, U{6}, U{3})[0], 7);
    EXPECT_EQ(elements<std::uint8_t>(BitXor{}, 1, U{6}, U{3})[0], 5);
    EXPECT_EQ(elements<std::uint8_t>(BitNot{}, 1, U{6})[0], 249);
}

TEST(Nonlinear, LimitsAndZones) {
    EXPECT_EQ(elements(Saturate{}, 4, V{-1}, V{1, 1, 1, 2}, V{-3, 0.5, 3, 3}), (D{-1, 0.5, 1, 2}));
    EXPECT_EQ(elements(DeadZone{}, 3, V{-1}, V{2}, V{-3, 0.5, 3}), (D{-2, 0, 1}));
    EXPECT_EQ(elements(Quantize{}, 3, V{0.5}, V{-0.3, 0.2, 0.25}), (D{-0.5, 0, 0.5}));
    EXPECT_EQ(elements(RateLimit{}, 3, V{2}, V{-1}, V{0.5}, V{0}, V{5, -5, 0.1}), (D{1, -0.5, 0.1}));
    EXPECT_TRUE(std::isnan(elements(Saturate{}, 1, V{-1}, V{1}, V{nan})[0]));
}

TEST(Elementwise, ARemainderThatIsOnlyRoundingIsZero) {
    for (int k = 1; k < 1000; ++k)
        for (const double step : {0.1, 0.3, 0.7, 1e-3}) {
            EXPECT_EQ(modulo(k * step, step), 0) << k << " " << step;
            EXPECT_EQ(remainder(-k * step, step), 0) << k << " " << step;
            EXPECT_EQ(modulo(static_cast<float>(k) * static_cast<float>(step), static_cast<float>(step)), 0);
        }
    EXPECT_EQ(modulo(0.35, 0.1), std::fmod(0.35, 0.1));
    EXPECT_EQ(remainder(1e-300, 0.1), 1e-300);
    EXPECT_EQ(remainder(1e-320, 1.5e10), 1e-320) << "the quotient is 0";
    // An integer divisor leaves an exact remainder, however small.
    EXPECT_EQ(remainder(3 - 4e-16, 3.0), 3 - 4e-16);
}

TEST(Nonlinear, RelayKeepsItsModeBetweenThePoints) {
    const auto next = elements(RelayMode{}, 4, V{2}, V{1}, V{0, 1, 1, 0}, V{1.5, 1.5, 1, 2});
    EXPECT_EQ(flags(next), (B{0, 1, 0, 1}));
}

TEST(Nonlinear, ChoosesElementByElement) {
    const V on{1, 2}, off{-1};
    EXPECT_EQ(elements(Choose{}, 2, on, Vector<bool>{true, false}, off), (D{1, -1}));
    EXPECT_EQ(elements(Choose{}, 2, on, Vector<bool>{true}, off), (D{1, 2}));
}

TEST(Nonlinear, BacklashMovesOnlyAgainstItsStops) {
    EXPECT_EQ(elements(Backlash{}, 4, V{1}, V{0, 0, 0, 2}, V{0.4, 0.8, -3, 2}), (D{0, 0.8 - 0.5, -2.5, 2}));
}

TEST(Nonlinear, FrictionIsOddAndJumpsAtRest) {
    EXPECT_EQ(elements(Friction{}, 3, V{2}, V{0.5}, V{4, 0, -4}), (D{4, 0, -4}));
}

TEST(Nonlinear, WrapsToZeroAboveTheThreshold) {
    EXPECT_EQ(elements(WrapToZero{}, 3, V{5}, V{5, 5.1, -9}), (D{5, 0, -9}));
}

TEST(Nonlinear, HitCrossingSeesReachingAndPassing) {
    const V before{-1, -1, 1, 0, -1, 2}, now{1, 0, 0, 1, -0.5, 2};
    const V offset{0}, started{1};
    EXPECT_EQ(elements(HitCrossing{}, 6, V{0}, offset, started, before, now), (D{1, 1, 1, 0, 0, 0}));
    EXPECT_EQ(elements(HitCrossing{}, 6, V{1}, offset, started, before, now), (D{1, 1, 0, 0, 0, 0}));
    EXPECT_EQ(elements(HitCrossing{}, 6, V{-1}, offset, started, before, now), (D{0, 0, 1, 0, 0, 0}));
    EXPECT_EQ(elements(HitCrossing{}, 6, V{0}, offset, V{0}, before, now), (D(6, 0)));
}

TEST(Nonlinear, MultiportSwitchFallsBackToItsLastInput) {
    const V a{1}, b{2}, c{3};
    const View<const double> u[] = {a, b, c};
    double y = 0;
    for (auto [control, expected] :
         {std::array{10.0, 1.0}, {20.9, 2.0}, {30.0, 3.0}, {7.0, 3.0}, {nan, 3.0}}) {
        MultiportSwitch{}(View<double>{&y, 1}, *Vector<int>{10, 20, 30}, *V{control},
                          ListView<const double>(u));
        EXPECT_EQ(y, expected);
    }
}

TEST(Reduce, AgreesWithEigen) {
    const Eigen::MatrixXd a = Eigen::MatrixXd::Random(4, 3);
    const Eigen::VectorXd b = Eigen::VectorXd::Random(12), columns = a.colwise().sum(),
                          rows = a.rowwise().sum();
    Eigen::VectorXd y(1), per_column(3), per_row(4);
    const auto of = [&](auto kernel, const auto&... u) { return kernel(view(y), view(u)...), y[0]; };
    EXPECT_NEAR(of(SumOfElements{}, a), a.sum(), 1e-14);
    EXPECT_NEAR(of(ProductOfElements{}, a), a.prod(), 1e-14);
    EXPECT_EQ(of(MinimumOfElements{}, a), a.minCoeff());
    EXPECT_EQ(of(MaximumOfElements{}, a), a.maxCoeff());
    EXPECT_NEAR(of(Norm1{}, b), b.lpNorm<1>(), 1e-14);
    EXPECT_NEAR(of(Norm2{}, b), b.norm(), 1e-14);
    EXPECT_EQ(of(NormInf{}, b), b.lpNorm<Eigen::Infinity>());
    EXPECT_NEAR(of(Dot{}, a, b), a.reshaped().dot(b), 1e-14);
    SumOfColumns{}(view(per_column), view(a));
    SumOfRows{}(view(per_row), view(a));
    EXPECT_TRUE(per_column.isApprox(columns));
    EXPECT_TRUE(per_row.isApprox(rows));
    const Eigen::Vector3d p(1, 2, 3), q(-2, 0.5, 7);
    Eigen::Vector3d r;
    Cross{}(view(r), view(p), view(q));
    EXPECT_EQ(r, p.cross(q));
}

TEST(Routing, StacksAndSplits) {
    const Eigen::MatrixXd a = Eigen::MatrixXd::Random(2, 3), b = Eigen::MatrixXd::Random(2, 3);
    const View<const double> u[] = {view(a), view(b)};
    Eigen::MatrixXd side(2, 6), below(4, 3), blocks(4, 6);
    Concatenate{}(view(side), ListView<const double>(u));
    ConcatenateVertically{}(view(below), ListView<const double>(u));
    BlockDiagonal{}(view(blocks), ListView<const double>(u));
    EXPECT_EQ(side, (Eigen::MatrixXd(2, 6) << a, b).finished());
    EXPECT_EQ(below, (Eigen::MatrixXd(4, 3) << a, b).finished());
    const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(2, 3);
    EXPECT_EQ(blocks, (Eigen::MatrixXd(4, 6) << a, zero, zero, b).finished());
    Eigen::MatrixXd a2(2, 3), b2(2, 3);
    const View<double> y[] = {view(a2), view(b2)};
    Split{}(ListView<double>(y), view(std::as_const(side)));
    EXPECT_EQ(a2, a);
    EXPECT_EQ(b2, b);
}

TEST(Routing, PicksAndAssignsByOneBasedIndices) {
    const Eigen::MatrixXd a = Eigen::MatrixXd::Random(4, 3);
    Eigen::MatrixXd part(2, 2), changed(4, 3);
    const V u{10, 20, 30};
    EXPECT_EQ(elements(Select{}, 4, Vector<int>{3, 1, 3, 2}, u), (D{30, 10, 30, 20}));
    EXPECT_TRUE(SelectMatrix{}(view(part), *Vector<int>{4, 1}, *V{3, 3}, view(a)));
    EXPECT_EQ(part, (Eigen::Matrix2d() << a(3, 2), a(3, 2), a(0, 2), a(0, 2)).finished());
    EXPECT_TRUE(Submatrix{}(view(part), *Vector<int>{2}, *Vector<int>{2}, view(a)));
    EXPECT_EQ(part, a.block(1, 1, 2, 2));
    EXPECT_EQ(elements(Assign{}, 3, Vector<int>{3, 1}, u, V{7, 8}), (D{8, 20, 7}));
    EXPECT_TRUE(AssignMatrix{}(view(changed), *Vector<int>{1, 2}, *Vector<int>{3}, view(a), *V{5}));
    EXPECT_EQ(changed(0, 2), 5);
    EXPECT_EQ(changed(1, 2), 5);
    EXPECT_EQ(changed.leftCols(2), a.leftCols(2));
}

TEST(Routing, ReportsIndicesOutside) {
    const Eigen::Vector3d u(1, 2, 3);
    Eigen::Vector2d y;
    EXPECT_FALSE(Select{}(view(y), *V{nan, 3}, view(u)));
    EXPECT_EQ(y, Eigen::Vector2d(0, 3));
    EXPECT_FALSE(Select{}(view(y), *V{1e300, 0}, view(u)));
    EXPECT_FALSE(Submatrix{}(view(y), *V{3}, *V{1}, view(u)));
    EXPECT_FALSE(Assign{}(view(y), *V{3}, view(u), *V{3}));
}

TEST(Sources, FollowTheirFormulas) {
    const auto at = [](double t) { return V{t}; };
    EXPECT_EQ(elements(Step{}, 1, V{1}, V{-1}, V{2}, at(0.999)), (D{-1}));
    EXPECT_EQ(elements(Step{}, 1, V{1}, V{-1}, V{2}, at(1)), (D{2}));
    EXPECT_EQ(elements(Ramp{}, 2, V{2, 3}, V{1}, V{10}, at(3)), (D{14, 16}));
    EXPECT_EQ(elements(Ramp{}, 1, V{2}, V{1}, V{10}, at(0.5)), (D{10}));
    EXPECT_NEAR(elements(SineWave{}, 1, V{2}, V{M_PI}, V{M_PI / 2}, V{1}, at(1))[0], -1, 1e-15);
    EXPECT_EQ(elements(Pulse{}, 1, V{5}, V{2}, V{25}, V{1}, at(0.9)), (D{0}));
    EXPECT_EQ(elements(Pulse{}, 1, V{5}, V{2}, V{25}, V{1}, at(3.4)), (D{5}));
    EXPECT_EQ(elements(Pulse{}, 1, V{5}, V{2}, V{25}, V{1}, at(3.6)), (D{0}));
    EXPECT_EQ(elements(Interpolate{}, 5, V{0, 1, 3}, V{10, 20, 0}, V{-1, 0.5, 1, 2, 9}),
              (D{10, 15, 20, 10, 0}));
}

TEST(Sources, ChirpReachesItsTargetFrequency) {
    const double f1 = 3, target = 10, h = 1e-5; // the phase grows by 2π f1 h at t = target
    const auto y = [&](double t) { return elements(Chirp{}, 1, V{0.1}, V{f1}, V{target}, V{t})[0]; };
    const double slope = (y(target + h) - y(target - h)) / (2 * h);
    const double phase = 2 * M_PI * (0.1 + f1) / 2 * target;
    EXPECT_NEAR(slope, 2 * M_PI * f1 * std::cos(phase), 1e-4);
}

} // namespace
} // namespace bf::kernels
