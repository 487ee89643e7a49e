// Registers of every width, whichever this processor has: without them the compiler takes several.
#include "eigen_views.hpp"

#include "bf/kernels/linear_algebra.hpp"

#include <gtest/gtest.h>

namespace bf::kernels {
namespace {

template <class T> using MatrixOf = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;

/// The sizes of a whole-body controller, and remainders of all tiles.
constexpr int sizes[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 13, 16, 23, 29};

template <int most, class T> void expect_products() {
    for (const int m : sizes)
        for (const int n : sizes)
            for (const int depth : {1, 5, 23}) {
                const MatrixOf<T> a = MatrixOf<T>::Random(m, depth), b = MatrixOf<T>::Random(depth, n);
                MatrixOf<T> expected = MatrixOf<T>::Zero(m, n), y(m, n);
                for (int k = 0; k < depth; ++k)
                    for (int j = 0; j < n; ++j)
                        for (int i = 0; i < m; ++i) expected(i, j) += a(i, k) * b(k, j);
                MatrixProduct{}.run<most>(view(y), view(a), view(b));
                ASSERT_EQ(y, expected) << m << " x " << depth << " by " << n << " in " << most;
            }
}

/// Where the compiler knows the extents, tiles are others.
template <int most, class T, int m, int depth, int n> void expect_known_product() {
    const MatrixOf<T> a = MatrixOf<T>::Random(m, depth), b = MatrixOf<T>::Random(depth, n);
    MatrixOf<T> expected(m, n), y(m, n);
    MatrixProduct{}.run<0>(view(expected), view(a), view(b));
    MatrixProduct{}.run<most>(FixedView<T, m, n>(y.data()), FixedView<const T, m, depth>(a.data()),
                              FixedView<const T, depth, n>(b.data()));
    ASSERT_EQ(y, expected) << m << " x " << depth << " by " << n << " in " << most;
}
template <int most, class T, int m> void expect_known_products() {
    expect_known_product<most, T, m, 5, 1>();
    expect_known_product<most, T, m, 1, 3>();
    expect_known_product<most, T, m, 6, 13>();
}
template <int most, class T> void expect_known_products() {
    expect_known_products<most, T, 1>();
    expect_known_products<most, T, 3>();
    expect_known_products<most, T, 6>();
    expect_known_products<most, T, 12>();
    expect_known_products<most, T, 23>();
    expect_known_products<most, T, 38>();
}

template <int most, class T> void expect_transposes() {
    for (const int m : sizes)
        for (const int n : sizes) {
            const MatrixOf<T> u = MatrixOf<T>::Random(m, n);
            MatrixOf<T> y(n, m);
            Transpose{}.run<most>(view(y), view(u));
            ASSERT_EQ(y, u.transpose()) << m << " x " << n << " in " << most;
        }
}

/// Blocks of a tree, whose zeros may have a sign, between a trunk and two limbs.
template <int most, class T> void expect_solutions() {
    for (const int n : sizes)
        for (const int m : {1, 4, 12, 13}) {
            MatrixOf<T> u = T(0.25) * MatrixOf<T>::Random(n, n);
            const int limb = n / 3;
            u.block(n - 2 * limb, n - limb, limb, limb).setZero();
            MatrixOf<T> a = u.template triangularView<Eigen::UnitUpper>();
            a = (a * a.transpose()).eval();
            a.block(n - limb, n - 2 * limb, limb, limb).setConstant(T(-0.0));
            const MatrixOf<T> b = MatrixOf<T>::Random(n, m);
            MatrixOf<T> expected(n, m), x(n, m), work(n * (n + m + 8), 1);
            ASSERT_TRUE(CholeskySolve{}.run<0>(view(expected), view(a), view(b), view(work)));
            ASSERT_TRUE(CholeskySolve{}.run<most>(view(x), view(a), view(b), view(work)));
            ASSERT_EQ(x, expected) << n << " with " << m << " in " << most;
            ASSERT_LE((a * x - b).norm(), 1000 * std::numeric_limits<T>::epsilon()) << n << " with " << m;
        }
}

template <int most> void expect_all() {
    expect_products<most, double>();
    expect_products<most, float>();
    expect_known_products<most, double>();
    expect_known_products<most, float>();
    expect_transposes<most, double>();
    expect_transposes<most, float>();
    expect_solutions<most, double>();
    expect_solutions<most, float>();
}

TEST(Lanes, OfSixteenBytesGiveTheBitsOfSingleNumbers) { expect_all<16>(); }
TEST(Lanes, OfThirtyTwoBytesGiveTheBitsOfSingleNumbers) { expect_all<32>(); }
TEST(Lanes, OfSixtyFourBytesGiveTheBitsOfSingleNumbers) { expect_all<64>(); }

} // namespace
} // namespace bf::kernels
