#include "eigen_views.hpp"

#include "bf/kernels/logic.hpp"
#include "bf/kernels/reduce.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using D = std::vector<double>;
using U8 = Vector<std::uint8_t>;
using I8 = Vector<std::int8_t>;

TEST(Bits, OfListsFollowDeMorgan) {
    const U8 a{0b1100, 0xFF}, b{0b1010, 0x0F};
    const View<const std::uint8_t> list[] = {*a, *b};
    const auto joined = [&](auto kernel) {
        std::vector<std::uint8_t> y(2);
        kernel(View<std::uint8_t>{y.data(), 2}, ListView<const std::uint8_t>(list));
        return y;
    };
    EXPECT_EQ(joined(BitAndOfList{}), (std::vector<std::uint8_t>{0b1000, 0x0F}));
    EXPECT_EQ(joined(BitOrOfList{}), (std::vector<std::uint8_t>{0b1110, 0xFF}));
    EXPECT_EQ(joined(BitXorOfList{}), (std::vector<std::uint8_t>{0b0110, 0xF0}));
    EXPECT_EQ(joined(BitNandOfList{}), (std::vector<std::uint8_t>{0xF7, 0xF0}));
    EXPECT_EQ(joined(BitNorOfList{}), (std::vector<std::uint8_t>{0xF1, 0x00}));
    const View<const std::uint8_t> one[] = {*a};
    std::uint8_t y = 0;
    BitAndOfList{}(View<std::uint8_t>{&y, 1}, ListView<const std::uint8_t>(one));
    EXPECT_EQ(y, 0b1100);
}

TEST(Bits, ShiftLikePowersOfTwo) {
    EXPECT_EQ(elements<std::int8_t>(ShiftBits{}, 3, V{1}, I8{3, -3, 100}),
              (std::vector<std::int8_t>{6, -6, -56}));
    EXPECT_EQ(elements<std::int8_t>(ShiftBits{}, 2, V{-1}, I8{7, -7}), (std::vector<std::int8_t>{3, -4}));
    EXPECT_EQ(elements<std::uint8_t>(ShiftBits{}, 2, V{-1}, U8{255, 1}), (std::vector<std::uint8_t>{127, 0}));
    const Vector<std::int32_t> least{std::numeric_limits<std::int32_t>::min()};
    EXPECT_EQ(elements<std::int32_t>(ShiftBits{}, 1, V{99}, least)[0], 0);
    EXPECT_EQ(elements<std::int32_t>(ShiftBits{}, 1, V{-99}, least)[0], -1);
}

TEST(Interval, HasOpenAndClosedEnds) {
    const V u{1, 2, 3}, lower{1}, upper{3};
    EXPECT_EQ(elements(Inside{}, 3, V{1, 1}, lower, upper, u), (D{1, 1, 1}));
    EXPECT_EQ(elements(Inside{}, 3, V{0, 0}, lower, upper, u), (D{0, 1, 0}));
    EXPECT_EQ(elements(Inside{}, 3, V{1, 0}, lower, upper, u), (D{1, 1, 0}));
}

TEST(TruthTable, CountsInBinaryDigits) {
    const V table{0, 10, 20, 30, 1, 11, 21, 31}; // 4 x 2
    for (int row = 0; row < 4; ++row) {
        const V u{double(row / 2), double(row % 2)};
        EXPECT_EQ(elements(TruthTable{}, 2, table, u), (D{row * 10.0, row * 10.0 + 1}));
    }
}

/// q and nq for the operands of a flip-flop.
template <class K, class... A> std::vector<bool> state(K kernel, const A&... operands) {
    bool q = false, nq = false;
    kernel(View<bool>{&q, 1}, View<bool>{&nq, 1}, *Vector<bool>{bool(operands)}...);
    return {q, nq};
}

TEST(FlipFlop, FollowsItsTruthTable) {
    using B = std::vector<bool>;
    for (const bool before : {false, true}) {
        EXPECT_EQ(state(SetReset{}, before, 0, 0), (B{before, !before}));
        EXPECT_EQ(state(SetReset{}, before, 1, 0), (B{true, false}));
        EXPECT_EQ(state(SetReset{}, before, 0, 1), (B{false, true}));
        EXPECT_EQ(state(SetReset{}, before, 1, 1), (B{false, false}));
        for (const bool d : {false, true}) {
            EXPECT_EQ(state(DFlipFlop{}, before, 0, d, 1), (B{d, !d}));
            for (const bool clock : {false, true})
                EXPECT_EQ(state(DFlipFlop{}, before, 1, d, clock), (B{before, !before}));
        }
        EXPECT_EQ(state(JKFlipFlop{}, before, 1, 0, 0, 0), (B{before, !before}));
        EXPECT_EQ(state(JKFlipFlop{}, before, 1, 1, 0, 0), (B{true, false}));
        EXPECT_EQ(state(JKFlipFlop{}, before, 1, 0, 1, 0), (B{false, true}));
        EXPECT_EQ(state(JKFlipFlop{}, before, 1, 1, 1, 0), (B{!before, before}));
        EXPECT_EQ(state(JKFlipFlop{}, before, 0, 1, 1, 1), (B{before, !before}));
    }
}

TEST(Sort, KeepsTheOrderOfEqualElementsAndPutsNaNLast) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const V u{3, nan, 1, 3, -2};
    Eigen::VectorXd y(5), index(5);
    Sort{}(view(y), view(index), *V{0}, *u);
    EXPECT_EQ(index, (Eigen::VectorXd(5) << 5, 3, 1, 4, 2).finished());
    EXPECT_EQ(y.head(4), Eigen::Vector4d(-2, 1, 3, 3));
    Sort{}(view(y), view(index), *V{1}, *u);
    EXPECT_EQ(index, (Eigen::VectorXd(5) << 2, 1, 4, 3, 5).finished());
}

TEST(Reduce, SumsUpAndFinds) {
    EXPECT_EQ(elements(CumulativeSum{}, 4, V{1, 2, 3, -4}), (D{1, 3, 6, 2}));
    EXPECT_EQ(elements(FindFirst{}, 1, V{0, 0, 7, 1}), (D{3}));
    EXPECT_EQ(elements(FindFirst{}, 1, V{0, 0}), (D{0}));
}

} // namespace
} // namespace bf::kernels
