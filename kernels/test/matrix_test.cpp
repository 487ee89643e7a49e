#include "eigen_views.hpp"

#include "bf/kernels/svd.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace bf::kernels {
namespace {

using Matrix = Eigen::MatrixXd;

class Shapes : public testing::TestWithParam<std::array<int, 3>> {};

/// a of rank r at most, m × n.
Matrix random(int m, int n, int r) { return Matrix::Random(m, r) * Matrix::Random(r, n); }

TEST_P(Shapes, ProductAgreesWithEigen) {
    const auto [m, n, r] = GetParam();
    const Matrix a = Matrix::Random(m, r), b = Matrix::Random(r, n);
    Matrix y(m, n);
    MatrixProduct{}(view(y), view(a), view(b));
    EXPECT_LE((y - a * b).norm(), 1e-14 * r);
}

TEST_P(Shapes, TruncatedPinvAgreesWithEigensSvd) {
    const auto [m, n, r] = GetParam();
    const Matrix a = random(m, n, r), tolerance = Matrix::Constant(1, 1, 1e-6);
    Matrix y(n, m), work(m * n + std::min(m, n) * std::min(m, n), 1), expected = Matrix::Zero(n, m);
    EXPECT_TRUE(TruncatedPinv{}(view(y), view(tolerance), view(a), view(work)));
    const Eigen::JacobiSVD<Matrix> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
    for (int k = 0; k < svd.singularValues().size(); ++k)
        if (svd.singularValues()[k] > 1e-6)
            expected += svd.matrixV().col(k) * svd.matrixU().col(k).transpose() / svd.singularValues()[k];
    EXPECT_LE((y - expected).norm(), 1e-10 * (1 + expected.norm()));
}

TEST_P(Shapes, DampedPinvAgreesWithItsFormula) {
    const auto [m, n, r] = GetParam();
    const Matrix a = random(m, n, r), sigma = Matrix::Constant(1, 1, 0.1);
    Matrix y(n, m), work(m * n + std::min(m, n) * std::min(m, n), 1);
    EXPECT_TRUE(DampedPinv{}(view(y), view(sigma), view(a), view(work)));
    const Matrix gram = a * a.transpose() + 0.1 * Matrix::Identity(m, m);
    EXPECT_LE((y - a.transpose() * gram.inverse()).norm(), 1e-9 * (1 + y.norm()));
}

TEST_P(Shapes, LeastSquaresIsTheBestSolutionOfSmallestNorm) {
    const auto [m, n, r] = GetParam();
    const Matrix a = random(m, n, r), b = Matrix::Random(m, 2);
    Matrix x(n, 2), work(m * (n + 2) + n, 1);
    EXPECT_TRUE(LeastSquares{}(view(x), view(a), view(b), view(work)));
    EXPECT_LE((a.transpose() * (a * x - b)).norm(), 1e-9 * (1 + a.squaredNorm() * x.norm()));
    Eigen::JacobiSVD<Matrix> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
    svd.setThreshold(1e-10);
    const Matrix best = svd.solve(b);
    EXPECT_LE((x - best).norm(), 1e-9 * (1 + best.norm()));
}

INSTANTIATE_TEST_SUITE_P(All, Shapes,
                         testing::Values(std::array{1, 1, 1}, std::array{3, 3, 3}, std::array{29, 29, 29},
                                         std::array{6, 29, 6}, std::array{29, 12, 12}, std::array{12, 29, 6},
                                         std::array{23, 12, 5}, std::array{5, 7, 2}));

TEST(LeastSquares, EqualsNumpysLstsq) {
    // numpy.linalg.lstsq([[1, 2, 3], [4, 5, 6], [7, 8, 9]], [1, 2, 4]) of rank 2, and of two rows alone.
    const Matrix a = (Matrix(3, 3) << 1, 2, 3, 4, 5, 6, 7, 8, 9).finished(),
                 b = (Matrix(3, 1) << 1, 2, 4).finished(), top = a.topRows(2), two = b.topRows(2);
    Matrix x(3, 1), work(15, 1);
    EXPECT_TRUE(LeastSquares{}(view(x), view(a), view(b), view(work)));
    EXPECT_LE((x - (Matrix(3, 1) << 1. / 4, 1. / 6, 1. / 12).finished()).norm(), 1e-14);
    EXPECT_TRUE(LeastSquares{}(view(x), view(top), view(two), view(work)));
    EXPECT_LE((x - (Matrix(3, 1) << -1. / 18, 1. / 9, 5. / 18).finished()).norm(), 1e-14);
}

TEST(LeastSquares, RefusesAMatrixThatIsNotFinite) {
    for (const double wrong : {double(NAN), HUGE_VAL}) {
        Matrix a = Matrix::Identity(3, 3), b = Matrix::Ones(3, 1), x(3, 1), work(15, 1);
        a(1, 2) = wrong;
        EXPECT_FALSE(LeastSquares{}(view(x), view(a), view(b), view(work)));
    }
}

TEST(TruncatedPinv, DropsSingularValuesNotAboveTheTolerance) {
    const Matrix a = Eigen::Vector3d(3, 0.5, 0.25).asDiagonal();
    Matrix y(3, 3), work(18, 1);
    for (auto [tolerance, kept] : {std::array{0.5, 1.0}, {0.4, 2.0}, {-1.0, 3.0}}) {
        const Matrix limit = Matrix::Constant(1, 1, tolerance);
        TruncatedPinv{}(view(y), view(limit), view(a), view(work));
        const Eigen::Vector3d expected(1. / 3, kept > 1 ? 2 : 0, kept > 2 ? 4 : 0);
        EXPECT_LE((y - Matrix(expected.asDiagonal())).norm(), 1e-15) << tolerance;
    }
}

TEST(TruncatedPinv, OfZeroIsZeroAndReportsNaN) {
    Matrix a = Matrix::Zero(4, 3), y(3, 4), work(21, 1);
    const Matrix tolerance = Matrix::Constant(1, 1, -1);
    EXPECT_TRUE(TruncatedPinv{}(view(y), view(tolerance), view(a), view(work)));
    EXPECT_EQ(y, Matrix::Zero(3, 4));
    a(1, 1) = std::nan("");
    EXPECT_FALSE(TruncatedPinv{}(view(y), view(tolerance), view(a), view(work)));
}

TEST(TruncatedPinv, OfALostRankSatisfiesTheConditionsOfPenrose) {
    for (int k = 0; k < 500; ++k) {
        const int m = 2 + k % 5, n = 2 + k / 5 % 5;
        Matrix a = Matrix::Random(m, n), y(n, m), work(m * n + 36, 1);
        a.row(m - 1) = a.row(0);
        const Matrix tolerance = Matrix::Constant(1, 1, -1);
        ASSERT_TRUE(TruncatedPinv{}(view(y), view(tolerance), view(a), view(work))) << a;
        const Matrix ay = a * y, ya = y * a;
        const double size = 1 + y.norm();
        ASSERT_LE((a * y * a - a).norm(), 1e-13 * size);
        ASSERT_LE((y * a * y - y).norm(), 1e-13 * size * size);
        ASSERT_LE((ay - ay.transpose()).norm() + (ya - ya.transpose()).norm(), 1e-13 * size);
    }
}

TEST(DampedPinv, WithoutDampingIsThePseudoInverseOfTallMatricesToo) {
    const Matrix a = Matrix::Random(9, 4), sigma = Matrix::Zero(1, 1);
    Matrix y(4, 9), work(52, 1);
    EXPECT_TRUE(DampedPinv{}(view(y), view(sigma), view(a), view(work)));
    EXPECT_LE((y * a - Matrix::Identity(4, 4)).norm(), 1e-13);
}

TEST(LinearEquations, AreSolvedFromBothSides) {
    const Matrix a = Matrix::Random(29, 29), b = Matrix::Random(29, 12), c = Matrix::Random(12, 29);
    Matrix x(29, 12), z(12, 29), inverse(29, 29), work(29 * 29 + 12 * 29, 1);
    EXPECT_TRUE(Solve{}(view(x), view(a), view(b), view(work)));
    EXPECT_TRUE(SolveRight{}(view(z), view(c), view(a), view(work)));
    EXPECT_TRUE(Inverse{}(view(inverse), view(a), view(work)));
    EXPECT_LE((a * x - b).norm(), 1e-11);
    EXPECT_LE((z * a - c).norm(), 1e-11);
    EXPECT_LE((a * inverse - Matrix::Identity(29, 29)).norm(), 1e-11);
}

TEST(LinearEquations, NeedPivotsWhereTheDiagonalIsZero) {
    Matrix a(2, 2), x(2, 1), work(4, 1);
    a << 0, 2, 4, 0;
    const Matrix b = Eigen::Vector2d(2, 8);
    EXPECT_TRUE(Solve{}(view(x), view(a), view(b), view(work)));
    EXPECT_EQ(x, Eigen::Vector2d(2, 1));
}

TEST(LinearEquations, SingularMatricesAreReportedAndGiveNoFiniteResult) {
    const Matrix a = (Matrix(2, 2) << 1, 2, 2, 4).finished(), b = Eigen::Vector2d(1, 3);
    Matrix x(2, 1), row(1, 2), inverse(2, 2), work(6, 1);
    const Matrix bt = b.transpose();
    EXPECT_FALSE(Solve{}(view(x), view(a), view(b), view(work)));
    EXPECT_FALSE(x.allFinite());
    EXPECT_FALSE(SolveRight{}(view(row), view(bt), view(a), view(work)));
    EXPECT_FALSE(row.allFinite());
    EXPECT_FALSE(Inverse{}(view(inverse), view(a), view(work)));
    EXPECT_FALSE(inverse.allFinite());
}

TEST(Cholesky, ReadsTheLowerTriangleOnly) {
    const Matrix r = Matrix::Random(29, 29), a = r * r.transpose() + Matrix::Identity(29, 29);
    const Matrix b = Matrix::Random(29, 12);
    Matrix lower = a.triangularView<Eigen::Lower>(), x(29, 12), work(29 * (29 + 12 + 8), 1);
    EXPECT_TRUE(CholeskySolve{}(view(x), view(lower), view(b), view(work)));
    EXPECT_LE((a * x - b).norm(), 1e-11);
}

TEST(Cholesky, ReportsAMatrixThatIsNotPositive) {
    Matrix a(2, 2), x(2, 1), work(22, 1);
    a << 1, 2, 2, 1;
    const Matrix b = Eigen::Vector2d(1, 3);
    EXPECT_FALSE(CholeskySolve{}(view(x), view(a), view(b), view(work)));
    EXPECT_FALSE(x.allFinite());
}

TEST(Cholesky, AgreesWithEigenForEveryRemainderOfATile) {
    for (int n = 1; n < 11; ++n)
        for (int m = 1; m < 7; ++m) {
            const Matrix r = Matrix::Random(n, n), a = r * r.transpose() + Matrix::Identity(n, n);
            const Matrix b = Matrix::Random(n, m);
            Matrix x(n, m), work(n * (n + m + 8), 1);
            EXPECT_TRUE(CholeskySolve{}(view(x), view(a), view(b), view(work)));
            EXPECT_LE((x - a.llt().solve(b)).norm(), 1e-12) << n << " x " << m;
        }
}

TEST(Cholesky, AgreesWithEigenOnATree) {
    const int trunk = 3, limb = 6, n = trunk + 2 * limb;
    Matrix U = Matrix::Random(n, n).triangularView<Eigen::Upper>();
    U.block(trunk, trunk + limb, limb, limb).setZero();
    U.diagonal().setConstant(2);
    const Matrix a = U * U.transpose(), b = Matrix::Random(n, 5);
    Matrix x(n, 5), work(n * (n + 13), 1);
    EXPECT_TRUE(CholeskySolve{}(view(x), view(a), view(b), view(work)));
    EXPECT_LE((x - a.llt().solve(b)).norm(), 1e-11);
}

TEST(Cholesky, DoesNotMultiplyByZerosOfAMatrixOfBlocks) {
    Matrix a = Matrix::Zero(8, 8), b = Matrix::Random(8, 1), x(8, 1), work(8 * 17, 1);
    for (int i : {0, 4}) {
        const Matrix r = Matrix::Random(4, 4);
        a.block(i, i, 4, 4) = r * r.transpose() + Matrix::Identity(4, 4);
    }
    b(7) = HUGE_VAL; // and 0 times infinity is NaN
    EXPECT_TRUE(CholeskySolve{}(view(x), view(a), view(b), view(work)));
    EXPECT_FALSE(x.bottomRows(4).allFinite());
    EXPECT_LE((x.topRows(4) - a.topLeftCorner(4, 4).llt().solve(b.topRows(4))).norm(), 1e-13);
}

TEST(Matrix, PatternsAndStateSpaceAgreeWithEigen) {
    const Matrix a = Matrix::Random(3, 3), b = Matrix::Random(3, 2), x = Matrix::Random(3, 1);
    const Matrix u = Matrix::Random(2, 1);
    Matrix y(3, 1), t(2, 3), d(3, 3), diagonal(3, 1), identity(2, 3);
    StateSpace{}(view(y), view(a), view(b), view(x), view(u));
    Transpose{}(view(t), view(b));
    Diagonal{}(view(d), view(x));
    DiagonalOf{}(view(diagonal), view(a));
    Identity{}(view(identity));
    EXPECT_LE((y - (a * x + b * u)).norm(), 1e-15);
    EXPECT_EQ(t, b.transpose());
    EXPECT_EQ(d, Matrix(x.col(0).asDiagonal()));
    EXPECT_EQ(diagonal, Matrix(a.diagonal()));
    EXPECT_EQ(identity, Matrix::Identity(2, 3));
}

} // namespace
} // namespace bf::kernels
