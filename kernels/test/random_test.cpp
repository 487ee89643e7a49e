#include "eigen_views.hpp"

#include "bf/kernels/random.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using U = Vector<std::uint32_t>;

std::array<std::uint32_t, 4> words(const Philox& p) { return {p.word[0], p.word[1], p.word[2], p.word[3]}; }

TEST(Philox, GivesThePublishedAnswers) {
    // Random123, tests/kat_vectors, philox4x32 10
    using W = std::array<std::uint32_t, 4>;
    EXPECT_EQ(words(Philox(0, 0, 0, 0, 0, 0)), (W{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
    const std::uint32_t ones = 0xffffffff;
    EXPECT_EQ(words(Philox(ones, ones, ones, ones, ones, ones)),
              (W{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
    EXPECT_EQ(words(Philox(0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344, 0xa4093822, 0x299f31d0)),
              (W{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

/// n draws of one element, sorted.
template <class Draw> std::vector<double> draws(int n, Draw draw) {
    std::vector<double> all;
    for (int k = 0; k < n; ++k) all.push_back(draw(U{static_cast<std::uint32_t>(k), 0}));
    std::sort(all.begin(), all.end());
    return all;
}

/// Largest distance between the empirical distribution and F. Kolmogorov: above 1.95/√n with probability 0.1
/// %.
template <class F> double distance(const std::vector<double>& sorted, F f) {
    const double n = static_cast<double>(sorted.size());
    double largest = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i)
        largest = std::max(
            {largest, std::fabs(f(sorted[i]) - double(i) / n), std::fabs(f(sorted[i]) - double(i + 1) / n)});
    return largest;
}

TEST(Random, IsUniformlyDistributed) {
    const auto u =
        draws(20000, [](const U& k) { return elements(RandomUniform{}, 1, V{-1}, V{3}, U{42}, k)[0]; });
    EXPECT_GE(u.front(), -1);
    EXPECT_LT(u.back(), 3);
    EXPECT_LT(distance(u, [](double x) { return (x + 1) / 4; }), 1.95 / std::sqrt(20000.0));
}

TEST(Random, IsNormallyDistributed) {
    const auto u =
        draws(20000, [](const U& k) { return elements(RandomNormal{}, 1, V{2}, V{9}, V{0}, U{7}, k)[0]; });
    EXPECT_LT(distance(u, [](double x) { return 0.5 * std::erfc(-(x - 2) / 3 / std::sqrt(2.0)); }),
              1.95 / std::sqrt(20000.0));
}

TEST(Random, NoiseOfGivenPowerIsLouderAtShorterPeriods) {
    const U k{5, 0};
    EXPECT_DOUBLE_EQ(elements(RandomNormal{}, 1, V{0}, V{2}, V{0.01}, U{7}, k)[0],
                     elements(RandomNormal{}, 1, V{0}, V{200}, V{0}, U{7}, k)[0]);
}

TEST(Random, DiffersBetweenElementsSeedsAndDraws) {
    const auto two = elements(RandomUniform{}, 2, V{0}, V{1}, U{1}, U{0, 0});
    EXPECT_NE(two[0], two[1]);
    EXPECT_NE(two[0], elements(RandomUniform{}, 1, V{0}, V{1}, U{2}, U{0, 0})[0]);
    EXPECT_NE(two[0], elements(RandomUniform{}, 1, V{0}, V{1}, U{1}, U{0, 1})[0]);
    EXPECT_EQ(elements<std::uint32_t>(NextDraw{}, 2, U{0xffffffff, 4}), (std::vector<std::uint32_t>{0, 5}));
}

} // namespace
} // namespace bf::kernels
