#include "random_problem.hpp"
#include "two_feet.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <malloc.h>
#include <random>

namespace {

using namespace bf::qp;
using namespace bf::qp::test;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The claims that hold for all solvers but OSQP, which is not exact.
struct Method {
    const char* name;
    std::unique_ptr<Solver> (*make)(int, int, const Options&);
};

class Qp : public testing::TestWithParam<Method> {
  protected:
    std::unique_ptr<Solver> make(int n, int m, const Options& options = {.tolerance = 1e-9}) const {
        return GetParam().make(n, m, options);
    }
};

INSTANTIATE_TEST_SUITE_P(, Qp,
                         testing::Values(Method{"Daqp", make_daqp}, Method{"ProxQp", make_proxqp},
                                         Method{"QpOases", make_qpoases}),
                         [](const auto& method) { return method.param.name; });

/// min ½|x|² − x1 − 2 x2 with the given bounds on x1 + x2.
Owned small() {
    Owned p;
    p.H = Matrix2d::Identity();
    p.g = Vector2d(-1, -2);
    p.A = Eigen::RowVector2d(1, 1);
    p.ubA = VectorXd::Constant(1, 1.0);
    return p;
}

TEST_P(Qp, SolutionsOfRandomProblemsSatisfyTheOptimalityConditions) {
    std::mt19937 random(1);
    const int sizes[][2] = {{1, 0}, {1, 2}, {2, 3}, {5, 0}, {5, 8}, {12, 38}, {20, 10}, {30, 60}};
    int count = 0;
    for (int round = 0; round < 63; ++round) {
        for (const auto& [n, m] : sizes) {
            for (const bool box : {false, true}) {
                const auto p = random_problem(random, n, m, box);
                VectorXd x(n);
                const auto r = make(n, m)->solve(p.problem(), x);
                ASSERT_EQ(r.status, Status::solved) << n << ' ' << m << ' ' << box << ' ' << describe(r);
                ASSERT_LT(kkt_violation(p, x, 1e-6), 2e-6) << n << ' ' << m << ' ' << box;
                ASSERT_NEAR(r.objective, p.objective(x), 1e-7 * (1 + std::abs(r.objective)));
                ++count;
            }
        }
    }
    EXPECT_GE(count, 1000);
}

TEST(Qps, BothMethodsFindTheSameSolution) {
    std::mt19937 random(2);
    for (int k = 0; k < 200; ++k) {
        const int n = 1 + k % 20, m = k % 31;
        const auto p = random_problem(random, n, m, k % 2);
        VectorXd x(n), y(n);
        ASSERT_EQ(make_daqp(n, m, {.tolerance = 1e-9})->solve(p.problem(), x).status, Status::solved);
        ASSERT_EQ(make_proxqp(n, m, {.tolerance = 1e-9})->solve(p.problem(), y).status, Status::solved);
        ASSERT_LT((x - y).cwiseAbs().maxCoeff(), 1e-6) << k;
    }
}

TEST_P(Qp, WithoutActiveConstraintsTheSolutionIsMinusHInverseG) {
    std::mt19937 random(3);
    const auto p = random_problem(random, 6, 0, false);
    VectorXd x(6);
    ASSERT_EQ(make(6, 0)->solve({.H = p.H, .g = p.g}, x).status, Status::solved);
    EXPECT_LT((x + p.H.ldlt().solve(p.g)).norm(), 1e-8);
}

TEST_P(Qp, WithUnitHessianABoxProjects) {
    const VectorXd target = VectorXd::LinSpaced(8, -2, 2), g = -target;
    const MatrixXd H = MatrixXd::Identity(8, 8);
    const VectorXd lb = VectorXd::Constant(8, -0.7), ub = VectorXd::Constant(8, 1.1);
    VectorXd x(8);
    ASSERT_EQ(make(8, 0)->solve({.H = H, .g = g, .lb = lb, .ub = ub}, x).status, Status::solved);
    EXPECT_LT((x - target.cwiseMax(lb).cwiseMin(ub)).norm(), 1e-8);
}

TEST_P(Qp, EqualitiesSolveTheKktSystem) {
    std::mt19937 random(4);
    auto p = random_problem(random, 7, 3, false);
    const VectorXd b = Eigen::Vector3d(1, -2, 0.5);
    MatrixXd K = MatrixXd::Zero(10, 10);
    K.topLeftCorner(7, 7) = p.H;
    K.topRightCorner(7, 3) = p.A.transpose();
    K.bottomLeftCorner(3, 7) = p.A;
    VectorXd right(10);
    right << -p.g, b;
    VectorXd x(7);
    ASSERT_EQ(make(7, 3)->solve({.H = p.H, .g = p.g, .A = p.A, .lbA = b, .ubA = b}, x).status,
              Status::solved);
    EXPECT_LT((x - K.partialPivLu().solve(right).head(7)).norm(), 1e-6);
}

TEST_P(Qp, RepeatedEqualitiesAreHarmless) {
    auto p = small();
    p.A = MatrixXd::Ones(2, 2);
    p.lbA = p.ubA = Vector2d(1, 1);
    Vector2d x;
    ASSERT_EQ(make(2, 2)->solve(p.problem(), x).status, Status::solved);
    EXPECT_LT((x - Vector2d(0, 1)).norm(), 1e-6);
}

TEST_P(Qp, OnlyTheSymmetricPartOfHCounts) {
    auto p = small();
    p.H << 2, 0, 1, 2; // the upper triangle alone looks diagonal
    const Matrix2d symmetric = 0.5 * (p.H + p.H.transpose());
    Vector2d x;
    ASSERT_EQ(make(2, 0)->solve({.H = p.H, .g = p.g}, x).status, Status::solved);
    EXPECT_LT((x + symmetric.inverse() * p.g).norm(), 1e-8);
}

TEST_P(Qp, InfiniteBoundsAreNoBounds) {
    auto p = small();
    p.lbA = VectorXd::Constant(1, -infinity);
    p.ubA = VectorXd::Constant(1, infinity);
    p.lb = Vector2d::Constant(-infinity);
    p.ub = Vector2d(infinity, 1.5);
    Vector2d x;
    ASSERT_EQ(make(2, 1)->solve(p.problem(), x).status, Status::solved);
    EXPECT_LT((x - Vector2d(1, 1.5)).norm(), 1e-8);
}

TEST(Daqp, ReportsInfeasibleConstraints) {
    auto p = small();
    p.lb = Vector2d(1, 1);
    Vector2d x(7, 8);
    const auto r = make_daqp(2, 1)->solve(p.problem(), x);
    EXPECT_EQ(r.status, Status::infeasible);
    EXPECT_EQ(describe(r), "no x satisfies all constraints: relax the bounds or drop a constraint");
    EXPECT_EQ(x, Vector2d(7, 8));
}

TEST_P(Qp, NamesBoundsThatCross) {
    auto p = small();
    p.lb = Vector2d(0, 3);
    p.ub = Vector2d(1, 2);
    Vector2d x(7, 8);
    const auto solver = make(2, 1);
    auto r = solver->solve(p.problem(), x);
    EXPECT_EQ(r.status, Status::infeasible);
    EXPECT_EQ(describe(r), "lb(2) = 3 and ub(2) = 2 leave no value between them");
    p.lb.setZero();
    p.lbA = VectorXd::Constant(1, infinity);
    p.ubA = VectorXd::Constant(1, infinity);
    r = solver->solve(p.problem(), x);
    EXPECT_EQ(r.status, Status::infeasible);
    EXPECT_EQ(describe(r), "lbA(1) = inf and ubA(1) = inf leave no value between them");
    EXPECT_EQ(x, Vector2d(7, 8));
}

TEST_P(Qp, BoundsThatCrossWithinTheToleranceAreAnEquality) {
    auto p = small();
    p.lbA = p.ubA;
    p.lbA[0] += 1e-10;
    Vector2d x;
    ASSERT_EQ(make(2, 1)->solve(p.problem(), x).status, Status::solved);
    EXPECT_LT((x - Vector2d(0, 1)).norm(), 1e-8);
}

TEST(Daqp, ReportsAnUnboundedObjective) {
    auto p = small();
    p.H << 1, 0, 0, 0;
    p.g << 0, -1;
    p.A << 1, 0;
    Vector2d x(7, 8);
    const auto r = make_daqp(2, 1)->solve(p.problem(), x);
    EXPECT_EQ(r.status, Status::unbounded) << describe(r);
    EXPECT_EQ(describe(r),
              "the objective has no minimum: bound x, or add a small multiple of the identity to H");
    EXPECT_EQ(x, Vector2d(7, 8));
}

TEST(ProxQp, DoesNotSolveInfeasibleOrUnboundedProblems) {
    auto infeasible = small(), unbounded = small();
    infeasible.lb = Vector2d(1, 1);
    unbounded.H << 1, 0, 0, 0;
    unbounded.A << 1, 0;
    Vector2d x(7, 8);
    EXPECT_NE(make_proxqp(2, 1)->solve(infeasible.problem(), x).status, Status::solved);
    EXPECT_NE(make_proxqp(2, 1)->solve(unbounded.problem(), x).status, Status::solved);
    EXPECT_EQ(x, Vector2d(7, 8));
}

TEST_P(Qp, SolvesSemidefiniteProblems) {
    std::mt19937 random(5);
    for (int k = 0; k < 100; ++k) {
        auto p = random_problem(random, 8, 6, true);
        const MatrixXd B = p.A.topRows(3);
        p.H = B.transpose() * B; // rank 3 of 8
        VectorXd x(8);
        const auto r = make(8, 6)->solve(p.problem(), x);
        ASSERT_EQ(r.status, Status::solved) << k << ' ' << describe(r);
        ASSERT_LT(kkt_violation(p, x, 1e-6), 1e-5) << k;
        ASSERT_NEAR(r.objective, p.objective(x), 1e-5) << k;
    }
}

TEST_P(Qp, StopsAtTheIterationLimit) {
    std::mt19937 random(6);
    const auto p = random_problem(random, 12, 38, true);
    VectorXd x = VectorXd::Constant(12, 5);
    const auto r = make(12, 38, {.max_iterations = 1, .tolerance = 1e-9})->solve(p.problem(), x);
    EXPECT_EQ(r.status, Status::iteration_limit);
    EXPECT_NE(describe(r).find("raise max_iterations"), std::string::npos) << describe(r);
    EXPECT_EQ(x, VectorXd::Constant(12, 5));
}

TEST_P(Qp, NamesTheEntryThatIsNotFinite) {
    auto p = small();
    p.lbA = VectorXd::Constant(1, -1);
    p.lb = Vector2d(-9, -9);
    p.ub = Vector2d(9, 9);
    const auto solver = make(2, 1);
    const auto text = [&](const std::function<void(Owned&)>& spoil) {
        auto bad = p;
        spoil(bad);
        Vector2d x(7, 8);
        const auto r = solver->solve(bad.problem(), x);
        EXPECT_EQ(r.status, Status::internal_error);
        EXPECT_EQ(x, Vector2d(7, 8));
        return describe(r);
    };
    const std::string advice = " is not finite: check the signals it is computed from";
    const std::string bound = " is not a bound: use -inf or inf where there is none";
    EXPECT_EQ(text([](Owned& q) { q.H(1, 0) = nan; }), "H(2,1) = nan" + advice);
    EXPECT_EQ(text([](Owned& q) { q.H(0, 1) = -infinity; }), "H(1,2) = -inf" + advice);
    EXPECT_EQ(text([](Owned& q) { q.g[1] = infinity; }), "g(2) = inf" + advice);
    EXPECT_EQ(text([](Owned& q) { q.A(0, 1) = nan; }), "A(1,2) = nan" + advice);
    EXPECT_EQ(text([](Owned& q) { q.lbA[0] = nan; }), "lbA(1) = nan" + bound);
    EXPECT_EQ(text([](Owned& q) { q.ubA[0] = nan; }), "ubA(1) = nan" + bound);
    EXPECT_EQ(text([](Owned& q) { q.lb[1] = nan; }), "lb(2) = nan" + bound);
    EXPECT_EQ(text([](Owned& q) { q.ub[0] = nan; }), "ub(1) = nan" + bound);
    Vector2d x;
    EXPECT_EQ(solver->solve(p.problem(), x).status, Status::solved) << "sound data after bad data";
}

TEST_P(Qp, ChecksEveryEntryOfALargeProblem) {
    const auto balancing = two_feet::make(0);
    const auto solver = make(12, 38);
    VectorXd x(12);
    for (int j = 0; j < 12; ++j) {
        for (int i = 0; i < 38; ++i) {
            auto bad = balancing;
            bad.A(i, j) = infinity;
            const auto r = solver->solve(bad.problem(), x);
            ASSERT_EQ(r.term, Term::A);
            ASSERT_EQ(r.row, i);
            ASSERT_EQ(r.column, j);
        }
        for (int i = 0; i < 12; ++i) {
            auto bad = balancing;
            bad.H(i, j) = nan;
            const auto r = solver->solve(bad.problem(), x);
            ASSERT_EQ(r.term, Term::H);
            ASSERT_EQ(r.row, i);
            ASSERT_EQ(r.column, j);
        }
    }
}

TEST_P(Qp, RefusesDataOfWrongSize) {
    const auto p = small();
    const VectorXd three = VectorXd::Zero(3);
    const auto solver = make(2, 1);
    VectorXd x = Vector2d(7, 8);
    const auto text = [&](const Problem& problem) {
        const auto r = solver->solve(problem, x);
        EXPECT_EQ(r.status, Status::internal_error);
        return describe(r);
    };
    const std::string end = " has not the size that the solver was made for";
    const MatrixXd smaller = MatrixXd::Identity(3, 3);
    EXPECT_EQ(text({.H = smaller, .g = p.g, .A = p.A}), "H" + end);
    EXPECT_EQ(text({.H = p.H, .g = three, .A = p.A}), "g" + end);
    EXPECT_EQ(text({.H = p.H, .g = p.g}), "A" + end);
    EXPECT_EQ(text({.H = p.H, .g = p.g, .A = p.A, .lbA = three}), "lbA" + end);
    EXPECT_EQ(text({.H = p.H, .g = p.g, .A = p.A, .ubA = three}), "ubA" + end);
    EXPECT_EQ(text({.H = p.H, .g = p.g, .A = p.A, .lb = three}), "lb" + end);
    EXPECT_EQ(text({.H = p.H, .g = p.g, .A = p.A, .ub = three}), "ub" + end);
    x = three;
    EXPECT_EQ(text(p.problem()), "x" + end);
}

TEST_P(Qp, ReadsMatricesThatArePartOfLargerOnes) {
    std::mt19937 random(7);
    const auto p = random_problem(random, 6, 9, true);
    MatrixXd H = MatrixXd::Constant(8, 8, nan), A = MatrixXd::Constant(20, 8, nan);
    H.block(1, 1, 6, 6) = p.H;
    A.block(3, 2, 9, 6) = p.A;
    VectorXd x(6), y(6);
    ASSERT_EQ(make(6, 9)->solve(p.problem(), x).status, Status::solved);
    ASSERT_EQ(make(6, 9)
                  ->solve({H.block(1, 1, 6, 6), p.g, A.block(3, 2, 9, 6), p.lbA, p.ubA, p.lb, p.ub}, y)
                  .status,
              Status::solved);
    EXPECT_EQ(x, y);
}

TEST_P(Qp, WarmAndColdStartsFindTheSameWrenches) {
    const auto problems = two_feet::sequence(300);
    const auto warm = make(12, 38), cold = make(12, 38);
    VectorXd x(12), y(12);
    int warm_iterations = 0, cold_iterations = 0, active = 0;
    for (const auto& p : problems) {
        cold->reset();
        const auto w = warm->solve(p.problem(), x);
        const auto c = cold->solve(p.problem(), y);
        ASSERT_EQ(w.status, Status::solved) << describe(w);
        ASSERT_EQ(c.status, Status::solved) << describe(c);
        ASSERT_LT((x - y).cwiseAbs().maxCoeff(), 1e-4);
        warm_iterations += w.iterations;
        cold_iterations += c.iterations;
        active += ((p.ubA - p.A * x).minCoeff() < 1e-6);
    }
    EXPECT_LT(warm_iterations, cold_iterations / 2);
    EXPECT_GT(active, 150) << "the sequence must exercise constraints";
}

TEST(Qps, BothMethodsFindTheSameWrenches) {
    const auto daqp = make_daqp(12, 38), proxqp = make_proxqp(12, 38, {.tolerance = 1e-9});
    VectorXd x(12), y(12);
    for (const auto& p : two_feet::sequence(2000)) {
        ASSERT_EQ(daqp->solve(p.problem(), x).status, Status::solved);
        ASSERT_EQ(proxqp->solve(p.problem(), y).status, Status::solved);
        ASSERT_LT((x - y).cwiseAbs().maxCoeff(), 1e-3);
        const Owned owned{p.H, p.g, p.A, {}, p.ubA, {}, {}};
        ASSERT_LT(kkt_violation(owned, x, 1e-6), 1e-5);
    }
}

TEST_P(Qp, AfterResetItSolvesLikeANewSolver) {
    const auto problems = two_feet::sequence(50);
    const auto used = make(12, 38);
    VectorXd x(12), y(12);
    for (const auto& p : problems) {
        used->solve(p.problem(), x);
    }
    used->reset();
    const auto fresh = make(12, 38);
    for (const auto& p : problems) {
        const auto a = used->solve(p.problem(), x), b = fresh->solve(p.problem(), y);
        ASSERT_EQ(x, y);
        ASSERT_EQ(a.iterations, b.iterations);
        ASSERT_EQ(a.objective, b.objective);
    }
}

TEST_P(Qp, ARestoredSolverContinuesBitForBit) {
    const auto solver = make(12, 38), other = make(12, 38);
    VectorXd x(12), y(12);
    std::vector<double> state(static_cast<std::size_t>(solver->state_size()));
    for (int k = 0; k < 60; ++k) {
        solver->save(state.data());
        other->restore(state.data()); // what it solved before must not matter
        const auto p = two_feet::make(k), next = two_feet::make(k + 200);
        const auto a = solver->solve(p.problem(), x), b = other->solve(p.problem(), y);
        ASSERT_EQ(a.status, Status::solved);
        ASSERT_EQ(x, y) << k;
        ASSERT_EQ(a.iterations, b.iterations) << k;
        ASSERT_EQ(a.objective, b.objective) << k;
        if (k % 3 == 0) solver->reset();
        if (k % 2 == 0) other->solve(next.problem(), y);
    }
}

TEST_P(Qp, ARestoredSolverContinuesWithSemidefiniteProblemsAndBounds) {
    std::mt19937 random(7);
    const auto solver = make(8, 6), other = make(8, 6);
    VectorXd x(8), y(8);
    std::vector<double> state(static_cast<std::size_t>(solver->state_size()));
    for (int k = 0; k < 60; ++k) {
        auto p = random_problem(random, 8, 6, true);
        p.H = p.H.col(0) * p.H.col(0).transpose(); // rank 1, the box bounds x
        if (k % 5 == 0) p = random_problem(random, 8, 6, false);
        solver->save(state.data());
        other->restore(state.data());
        const auto a = solver->solve(p.problem(), x), b = other->solve(p.problem(), y);
        ASSERT_EQ(a.status, b.status) << k;
        if (a.status == Status::solved) {
            ASSERT_EQ(x, y) << k;
        }
        ASSERT_EQ(a.iterations, b.iterations) << k;
        if (k % 2 == 0) other->reset();
    }
}

TEST_P(Qp, BoundsMayComeAndGoBetweenSolves) {
    std::mt19937 random(8);
    mallopt(M_PERTURB, 0x55); // fresh memory is not zero: rows that were never in use must not matter
    const auto solver = make(6, 9);
    mallopt(M_PERTURB, 0);
    for (int k = 0; k < 200; ++k) {
        auto p = random_problem(random, 6, 9, k % 3 != 0);
        if (k % 5 == 0) p.ubA.resize(0);
        if (k % 7 == 0) p.lb.resize(0);
        VectorXd x(6);
        const auto r = solver->solve(p.problem(), x);
        ASSERT_EQ(r.status, Status::solved) << k << ' ' << describe(r);
        ASSERT_LT(kkt_violation(p, x, 1e-6), 2e-6) << k;
    }
}

TEST_P(Qp, RecoversAfterAFailure) {
    auto good = small(), infeasible = small(), unbounded = small();
    infeasible.lb = Vector2d(1, 1);
    unbounded.H.setZero();
    unbounded.A.setZero();
    const auto solver = make(2, 1);
    for (const auto& bad : {infeasible, unbounded, infeasible}) {
        Vector2d x;
        EXPECT_NE(solver->solve(bad.problem(), x).status, Status::solved);
        ASSERT_EQ(solver->solve(good.problem(), x).status, Status::solved);
        EXPECT_LT((x - Vector2d(0, 1)).norm(), 1e-6);
    }
}

TEST_P(Qp, RefusesImpossibleSizesAndOptions) {
    const auto text = [&](int n, int m, const Options& options) -> std::string {
        try {
            make(n, m, options);
        } catch (const std::invalid_argument& e) {
            return e.what();
        }
        return "no exception";
    };
    EXPECT_EQ(text(0, 3, {}),
              "a quadratic program of 0 variables and 3 constraints was asked for: it needs at "
              "least 1 and at least 0");
    EXPECT_EQ(text(2, 3, {.max_iterations = 0}), "max_iterations is 0, but must be at least 1");
    EXPECT_EQ(text(2, 3, {.tolerance = nan}), "tolerance is nan, but must lie between 0 and 1");
}

TEST(Daqp, ReportsAnIndefiniteHessian) {
    std::mt19937 random(9);
    auto p = random_problem(random, 6, 4, true);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(p.H);
    for (const double negative : {-1e-4, -1e-2, -0.3, -10.0}) {
        VectorXd values = eigen.eigenvalues();
        values[0] = negative * values[5];
        p.H = eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
        VectorXd x(6);
        const auto r = make_daqp(6, 4)->solve(p.problem(), x);
        EXPECT_EQ(r.status, Status::internal_error) << negative;
        EXPECT_EQ(describe(r), "the solver broke down: make H positive semidefinite, and scale objective and "
                               "constraints alike");
    }
}

TEST(Daqp, ContinuesWhereTheIterationLimitStoppedIt) {
    std::mt19937 random(10);
    const auto p = random_problem(random, 12, 38, true);
    VectorXd expected(12), x(12);
    make_daqp(12, 38)->solve(p.problem(), expected);
    const auto solver = make_daqp(12, 38, {.max_iterations = 3});
    auto r = solver->solve(p.problem(), x);
    EXPECT_EQ(r.status, Status::iteration_limit);
    EXPECT_EQ(r.iterations, 3);
    for (int k = 0; k < 20 && r.status != Status::solved; ++k) {
        r = solver->solve(p.problem(), x);
        EXPECT_LE(r.iterations, 3);
    }
    EXPECT_EQ(r.status, Status::solved);
    EXPECT_LT((x - expected).norm(), 1e-8);
}

} // namespace
