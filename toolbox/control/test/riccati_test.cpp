#include "bf/control/riccati.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <stdexcept>

namespace bf::control::test {
namespace {

using Eigen::MatrixXd;
using Status = Regulator::Status;
using Time = Regulator::Time;

struct System {
    MatrixXd A, B, Q, R;
};

MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, std::mt19937& random) {
    std::normal_distribution<double> normal;
    return MatrixXd::NullaryExpr(rows, cols, [&](Eigen::Index, Eigen::Index) { return normal(random); });
}

/// Some unstable motions, and a cost that sees part of the states.
System random_system(int n, int m, std::mt19937& random) {
    System system{random_matrix(n, n, random), random_matrix(n, m, random), MatrixXd(), MatrixXd()};
    const MatrixXd C = random_matrix(n - 1, n, random), D = random_matrix(m, m, random);
    system.Q = C.transpose() * C;
    system.R = D * D.transpose() + 0.1 * MatrixXd::Identity(m, m);
    return system;
}

/// The solution by the eigenvectors of the Hamiltonian or symplectic matrix that decay.
MatrixXd by_eigenvectors(const System& of, Time time) {
    const Eigen::Index n = of.A.rows();
    const MatrixXd G = of.B * of.R.inverse() * of.B.transpose();
    MatrixXd Z(2 * n, 2 * n);
    if (time == Time::continuous) {
        Z << of.A, -G, -of.Q, -of.A.transpose();
    } else {
        const MatrixXd inverse = of.A.transpose().inverse();
        Z << of.A + G * inverse * of.Q, -G * inverse, -inverse * of.Q, inverse;
    }
    const Eigen::EigenSolver<MatrixXd> eigen(Z);
    Eigen::MatrixXcd U(2 * n, n);
    Eigen::Index found = 0;
    for (Eigen::Index i = 0; i < 2 * n; ++i) {
        const auto value = eigen.eigenvalues()[i];
        const bool decays = time == Time::continuous ? value.real() < 0.0 : std::abs(value) < 1.0;
        if (decays && found < n) U.col(found++) = eigen.eigenvectors().col(i);
    }
    EXPECT_EQ(found, n);
    return (U.bottomRows(n) * U.topRows(n).inverse()).real();
}

/// What is left of the equation, relative to its terms.
double residual(const System& of, Time time, const MatrixXd& X, const MatrixXd& K) {
    const MatrixXd BtX = of.B.transpose() * X;
    if (time == Time::continuous)
        return (of.A.transpose() * X + X * of.A - BtX.transpose() * K + of.Q).norm() /
               (of.Q.norm() + X.norm());
    return (of.A.transpose() * X * of.A - of.A.transpose() * BtX.transpose() * K + of.Q - X).norm() /
           (of.Q.norm() + X.norm());
}

} // namespace

TEST(Regulator, OfOneStateIsTheClosedForm) {
    const MatrixXd one = MatrixXd::Ones(1, 1);
    Regulator continuous(1, 1, Time::continuous), discrete(1, 1, Time::discrete);
    for (const double a : {-2.0, 0.0, 0.5, 3.0}) {
        ASSERT_EQ(continuous.solve(a * one, 2.0 * one, 5.0 * one, 4.0 * one), Status::solved);
        EXPECT_NEAR(continuous.X()(0, 0), a + std::sqrt(a * a + 5.0), 1e-12); // 2 a X - X² + 5 = 0
        ASSERT_EQ(discrete.solve(a * one, 2.0 * one, 5.0 * one, 4.0 * one), Status::solved);
        // X = a² X - a² X²/(1 + X) + 5, that is X² - (a² + 4) X - 5 = 0
        EXPECT_NEAR(discrete.X()(0, 0), 0.5 * (a * a + 4 + std::sqrt((a * a + 4) * (a * a + 4) + 20)), 1e-11);
    }
}

TEST(Regulator, OfADoubleIntegratorIsTheClosedForm) {
    System system{MatrixXd::Zero(2, 2), MatrixXd::Zero(2, 1), MatrixXd::Zero(2, 2), MatrixXd::Ones(1, 1)};
    system.A(0, 1) = system.B(1, 0) = system.Q(0, 0) = 1.0;
    Regulator regulator(2, 1, Time::continuous);
    ASSERT_EQ(regulator.solve(system.A, system.B, system.Q, system.R), Status::solved);
    EXPECT_LT((regulator.K() - Eigen::RowVector2d(1.0, std::sqrt(2.0))).norm(), 1e-12);
}

TEST(Regulator, OfACartPoleHasTheGainsOfScipy) {
    // A cart of 1 kg with a pole of 0.1 kg and 0.5 m to its centre, upright;
    // scipy.linalg.solve_continuous_are, and solve_discrete_are for A = 1 + 0.01 A_c, B = 0.01 B_c.
    MatrixXd A = MatrixXd::Zero(4, 4), B = MatrixXd::Zero(4, 1);
    A(0, 1) = A(2, 3) = 1.0;
    A(1, 2) = -0.71707317073170737;
    A(3, 2) = 15.775609756097561;
    B << 0.0, 0.97560975609756106, 0.0, -1.4634146341463414;
    const MatrixXd Q = Eigen::Vector4d(1, 0.1, 10, 0.1).asDiagonal(), R = MatrixXd::Constant(1, 1, 0.01);
    Regulator continuous(4, 1, Time::continuous), discrete(4, 1, Time::discrete);
    ASSERT_EQ(continuous.solve(A, B, Q, R), Status::solved);
    const Eigen::RowVector4d of_continuous(-9.999999999999988, -12.138035294248324, -78.07263139416489,
                                           -18.676568689244373),
        of_discrete(-9.261785600219776, -11.428341686270395, -74.78010424630295, -17.99505327353424);
    EXPECT_LT((continuous.K() - of_continuous).norm(), 1e-9 * of_continuous.norm());
    ASSERT_EQ(discrete.solve(MatrixXd::Identity(4, 4) + 0.01 * A, 0.01 * B, Q, R), Status::solved);
    EXPECT_LT((discrete.K() - of_discrete).norm(), 1e-9 * of_discrete.norm());
}

TEST(Regulator, AgreesWithTheEigenvectorsThatDecay) {
    std::mt19937 random(1);
    for (const Time time : {Time::discrete, Time::continuous})
        for (const int n : {2, 5, 12}) {
            Regulator regulator(n, 2, time);
            for (int k = 0; k < 5; ++k) {
                const System system = random_system(n, 2, random);
                ASSERT_EQ(regulator.solve(system.A, system.B, system.Q, system.R), Status::solved);
                const MatrixXd expected = by_eigenvectors(system, time);
                EXPECT_LT((regulator.X() - expected).norm(), 1e-6 * expected.norm()) << n;
                EXPECT_LT(residual(system, time, regulator.X(), regulator.K()), 1e-9) << n;
                const Eigen::VectorXcd poles = (system.A - system.B * regulator.K()).eigenvalues();
                if (time == Time::discrete)
                    EXPECT_LT(poles.cwiseAbs().maxCoeff(), 1.0);
                else
                    EXPECT_LT(poles.real().maxCoeff(), 0.0);
            }
        }
}

TEST(Regulator, SolvesAHundredStates) {
    std::mt19937 random(2);
    System system = random_system(100, 10, random);
    system.A *= 0.1;
    Regulator regulator(100, 10, Time::discrete);
    ASSERT_EQ(regulator.solve(system.A, system.B, system.Q, system.R), Status::solved);
    EXPECT_LT(residual(system, Time::discrete, regulator.X(), regulator.K()), 1e-9);
}

TEST(Regulator, StabilisesMotionsThatGrowAndThatNoCostSees) {
    // scipy.linalg.solve_discrete_are and solve_continuous_are; the poles of growing motions are mirrored.
    const MatrixXd one = MatrixXd::Ones(1, 1), none = MatrixXd::Zero(2, 2);
    Regulator scalar(1, 1, Time::discrete), discrete(2, 1, Time::discrete),
        continuous(2, 1, Time::continuous);
    ASSERT_EQ(scalar.solve(2.0 * one, one, 0.0 * one, one), Status::solved);
    EXPECT_NEAR(scalar.K()(0, 0), 1.5, 1e-12);
    ASSERT_EQ(discrete.solve(Eigen::Vector2d(0.9, 2.0).asDiagonal().toDenseMatrix(), MatrixXd::Ones(2, 1),
                             none, one),
              Status::solved);
    EXPECT_LT((discrete.K() - Eigen::RowVector2d(0.0, 1.5)).norm(), 1e-11);
    MatrixXd A = none, B = MatrixXd::Zero(2, 1);
    A << 0.0, 1.0, 2.0, 0.0;
    B << 0.0, 1.0;
    ASSERT_EQ(continuous.solve(A, B, none, one), Status::solved);
    EXPECT_LT((continuous.K() - Eigen::RowVector2d(4.0, std::sqrt(8.0))).norm(), 1e-11);

    std::mt19937 random(3);
    for (const Time time : {Time::discrete, Time::continuous})
        for (int k = 0; k < 5; ++k) {
            System system = random_system(5, 2, random);
            system.Q.setZero();
            Regulator regulator(5, 2, time);
            ASSERT_EQ(regulator.solve(system.A, system.B, system.Q, system.R), Status::solved);
            EXPECT_LT(residual(system, time, regulator.X(), regulator.K()), 1e-9) << k;
            const Eigen::VectorXcd poles = (system.A - system.B * regulator.K()).eigenvalues();
            EXPECT_TRUE(time == Time::discrete ? poles.cwiseAbs().maxCoeff() < 1.0
                                               : poles.real().maxCoeff() < 0.0);
        }
}

TEST(Regulator, RefusesACostThatRewards) {
    const MatrixXd one = MatrixXd::Ones(1, 1), two = MatrixXd::Identity(2, 2), B = MatrixXd::Ones(2, 1);
    MatrixXd Q = two;
    for (const Time time : {Time::discrete, Time::continuous}) {
        Regulator regulator(2, 1, time);
        for (const double cost : {-1.0, -1e-6}) {
            Q(1, 1) = cost;
            EXPECT_EQ(regulator.solve(0.5 * two, B, Q, one), Status::indefinite) << cost;
        }
    }
}

TEST(Regulator, TellsWhereThereIsNoGain) {
    const MatrixXd one = MatrixXd::Ones(1, 1), two = MatrixXd::Identity(2, 2);
    for (const Time time : {Time::discrete, Time::continuous}) {
        Regulator regulator(2, 1, time);
        MatrixXd B = MatrixXd::Zero(2, 1);
        B(0, 0) = 1.0;
        EXPECT_EQ(regulator.solve(1.5 * two, B, two, one), Status::not_stabilising) << "out of reach";
        // What no cost sees and what neither grows nor decays.
        const double rest = time == Time::discrete ? 1.0 : 0.0;
        EXPECT_EQ(
            regulator.solve(Eigen::Vector2d(0.5, rest).asDiagonal().toDenseMatrix() - (1.0 - rest) * two,
                            MatrixXd::Ones(2, 1),
                            Eigen::Vector2d(1.0, 0.0).asDiagonal().toDenseMatrix() * 0.0, one),
            time == Time::discrete ? Status::not_stabilising : Status::solved);
        EXPECT_EQ(regulator.solve(two, B, two, -one), Status::no_cost);
        EXPECT_EQ(regulator.solve(two, B, two, 0.0 * one), Status::no_cost);
        EXPECT_EQ(regulator.solve(two, B, std::numeric_limits<double>::quiet_NaN() * two, one),
                  Status::not_finite);
        EXPECT_EQ(regulator.solve(two, MatrixXd::Ones(2, 1), two, one), Status::not_stabilising)
            << "two alike motions, one input";
        B << 1.0, 1.0;
        EXPECT_EQ(regulator.solve(Eigen::Vector2d(0.5, 2.0).asDiagonal().toDenseMatrix(), B, two, one),
                  Status::solved)
            << "after all that";
    }
    EXPECT_THROW(Regulator(0, 1, Time::discrete), std::invalid_argument);
}

} // namespace bf::control::test
