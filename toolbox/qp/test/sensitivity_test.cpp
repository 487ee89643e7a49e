// Derivatives of solutions beside differences of solutions.
#include <bf/qp/sensitivity.hpp>

#include "random_problem.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace bf::qp {
namespace {

using test::Owned;

Eigen::VectorXd solved(const Owned& own) {
    const auto solver = make_daqp(static_cast<int>(own.g.size()), static_cast<int>(own.A.rows()),
                                  {.max_iterations = 1000, .tolerance = 1e-11});
    Eigen::VectorXd x(own.g.size());
    EXPECT_EQ(solver->solve(own.problem(), x).status, Status::solved);
    return x;
}

/// a + step b, of problems.
Owned moved(Owned a, const Owned& b, double step) {
    a.H += step * b.H;
    a.g += step * b.g;
    a.A += step * b.A;
    a.lbA += step * b.lbA;
    a.ubA += step * b.ubA;
    a.lb += step * b.lb;
    a.ub += step * b.ub;
    return a;
}

TEST(Sensitivity, OfRandomProblemsIsThatOfCentralDifferences) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    int with_constraints = 0;
    for (int k = 0; k < 60; ++k) {
        const int n = 2 + k % 6, m = 1 + k % 9;
        const Owned own = test::random_problem(random, n, m, true);
        Owned change = own;
        for (Eigen::MatrixXd* part : {&change.H, &change.A})
            *part = part->unaryExpr([&](double) { return normal(random); }).eval();
        for (Eigen::VectorXd* part : {&change.g, &change.lbA, &change.ubA, &change.lb, &change.ub})
            *part = part->unaryExpr([&](double) { return normal(random); }).eval();
        change.H = (change.H + change.H.transpose()).eval();
        for (int i = 0; i < m; ++i)
            if (own.lbA[i] == own.ubA[i]) change.ubA[i] = change.lbA[i]; // it stays an equality
        const Eigen::MatrixXd dH = change.H.reshaped(), dA = change.A.reshaped(), dg = change.g,
                              dlbA = change.lbA, dubA = change.ubA, dlb = change.lb, dub = change.ub;
        const Eigen::VectorXd x = solved(own);
        const auto found = differentiate(own.problem(), x, {dH, dg, dA, dlbA, dubA, dlb, dub}, 1);
        ASSERT_TRUE(found.exists);
        EXPECT_FALSE(found.is_one_sided);
        const double step = 1e-6;
        const Owned above = moved(own, change, step), below = moved(own, change, -step);
        const Eigen::VectorXd x_above = solved(above), x_below = solved(below),
                              slope = (x_above - x_below) / (2 * step);
        EXPECT_LT((found.x.col(0) - slope).norm(), 1e-5 * (1 + slope.norm())) << k;
        EXPECT_NEAR(found.objective[0], (above.objective(x_above) - below.objective(x_below)) / (2 * step),
                    1e-5 * (1 + std::abs(found.objective[0])))
            << k;
        with_constraints += (x + own.H.ldlt().solve(own.g)).norm() > 1e-6;
    }
    EXPECT_GT(with_constraints, 40);
}

TEST(Sensitivity, ExistsNotWhereTheSolutionIsNotUnique) {
    Owned own{.H = Eigen::Vector2d(1, 0).asDiagonal(), .g = Eigen::Vector2d(0, 0)};
    const Eigen::MatrixXd dg = Eigen::MatrixXd::Ones(2, 1);
    EXPECT_FALSE(differentiate(own.problem(), Eigen::Vector2d(0, 3), {.g = dg}, 1).exists);
    // A bound that pushes makes it one.
    own.lb = Eigen::Vector2d(-5, 2);
    own.g[1] = 1;
    const auto found = differentiate(own.problem(), Eigen::Vector2d(0, 2), {.g = dg}, 1);
    EXPECT_TRUE(found.exists);
    EXPECT_EQ(found.x, Eigen::MatrixXd(Eigen::Vector2d(-1, 0)));
}

TEST(Sensitivity, ExistsNotWhereXIsNoSolution) {
    const Owned own{.H = Eigen::Matrix2d::Identity(), .g = Eigen::Vector2d(1, 1)};
    EXPECT_FALSE(differentiate(own.problem(), Eigen::Vector2d(0, 0), {}, 1).exists);
}

TEST(Sensitivity, OfDuplicatedConstraintsIsThatOfOne) {
    Owned own{.H = Eigen::Matrix2d::Identity(), .g = Eigen::Vector2d(0, 0), .A = Eigen::MatrixXd::Ones(3, 2)};
    own.lbA = Eigen::Vector3d(2, 2, 2);
    const Eigen::MatrixXd dlbA = Eigen::MatrixXd::Ones(3, 1);
    const auto found = differentiate(own.problem(), Eigen::Vector2d(1, 1), {.lbA = dlbA}, 1);
    ASSERT_TRUE(found.exists);
    EXPECT_FALSE(found.is_one_sided);
    EXPECT_LT((found.x - Eigen::MatrixXd(Eigen::Vector2d(0.5, 0.5))).norm(), 1e-12);
}

} // namespace
} // namespace bf::qp
