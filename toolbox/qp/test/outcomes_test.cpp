// What each solver says of feasible, infeasible, unbounded, degenerate and non-convex problems.
#include "random_problem.hpp"
#include "two_feet.hpp"

#include <gtest/gtest.h>
#include <map>

namespace {

using namespace bf::qp;
using namespace bf::qp::test;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// min ½|x|² − x1 − 2 x2 subject to x1 + x2 ≤ 1.
Owned feasible() {
    return {Matrix2d::Identity(),
            Vector2d(-1, -2),
            Eigen::RowVector2d(1, 1),
            {},
            VectorXd::Constant(1, 1.0),
            {},
            {}};
}

struct Case {
    std::string name;
    Owned problem;
    Status exact;               ///< of DAQP and qpOASES
    std::vector<int> of_osqp;   ///< OSQP's own numbers that are right
    std::vector<double> x = {}; ///< where it is solved
};

std::vector<Case> cases() {
    std::vector<Case> all;
    all.push_back({"feasible", feasible(), Status::solved, {1}, {0, 1}});

    auto p = feasible(); // x1 + x2 at least 1 and at most 0
    p.A = MatrixXd::Ones(2, 2);
    p.lbA = Vector2d(1, -infinity);
    p.ubA = Vector2d(infinity, 0);
    all.push_back({"infeasible", p, Status::infeasible, {-3}});

    p = feasible(); // the bounds of x against those of A x
    p.lb = Vector2d(1, 1);
    p.ub = Vector2d(5, 5);
    all.push_back({"infeasible_bounds", p, Status::infeasible, {-3}});

    p = feasible(); // nothing bounds -x1 - 2 x2 from below
    p.H.setZero();
    p.A.setZero();
    all.push_back({"unbounded", p, Status::unbounded, {-4}});

    p = feasible(); // the constraint bounds one direction of descent, not all
    p.H.setZero();
    all.push_back({"unbounded_along_a_constraint", p, Status::unbounded, {-4}});

    p = feasible(); // flat along x2 without slope: many solutions
    p.H << 1, 0, 0, 0;
    p.g = Vector2d(-1, 0);
    p.A = Eigen::RowVector2d(1, 0);
    p.lb = Vector2d(-3, -3);
    p.ub = Vector2d(3, 3);
    all.push_back({"semidefinite", p, Status::solved, {1}});

    p = feasible(); // four constraints meet at (0, 1), two of them the same
    p.A = MatrixXd(4, 2);
    p.A << 1, 1, 1, 1, 0, 1, -1, 1;
    p.ubA = Eigen::Vector4d(1, 1, 1, 1);
    all.push_back({"degenerate", p, Status::solved, {1}, {0, 1}});

    p = feasible(); // an equality, and the same once more as two inequalities
    p.A = MatrixXd::Ones(2, 2);
    p.lbA = Vector2d(1, -infinity);
    p.ubA = Vector2d(1, 1);
    all.push_back({"redundant_equality", p, Status::solved, {1}, {0, 1}});

    p = feasible(); // least on the line x1 + x2 = -1, which nothing bounds
    p.H.setOnes();
    p.g = Vector2d(1, 1);
    p.A.setZero();
    all.push_back({"flat_along_a_line", p, Status::solved, {1}});

    p.H << 4, 2, 2, 1; // on 2 x1 + x2 = -1
    p.g = Vector2d(2, 1);
    all.push_back({"flat_along_another_line", p, Status::solved, {1}});

    p.g = Vector2d(2, 1.5); // and with a slope along it
    all.push_back({"falling_along_a_line", p, Status::unbounded, {-4}});

    return all;
}

class Outcomes : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(, Outcomes, testing::ValuesIn(cases()),
                         [](const auto& instance) { return instance.param.name; });

TEST_P(Outcomes, AreTheSameOfTheExactSolvers) {
    const auto& [name, p, expected, osqp, solution] = GetParam();
    const int n = static_cast<int>(p.g.size()), m = static_cast<int>(p.A.rows());
    for (const auto make : {make_daqp, make_qpoases}) {
        const auto solver = make(n, m, {.max_iterations = 100, .tolerance = 1e-9});
        VectorXd x = VectorXd::Constant(n, 7);
        for (int k = 0; k < 3; ++k) { // cold, then from what is known
            const auto r = solver->solve(p.problem(), x);
            ASSERT_EQ(r.status, expected) << describe(r);
            EXPECT_EQ(r.osqp_status, 0);
            if (expected != Status::solved) {
                EXPECT_EQ(x, VectorXd::Constant(n, 7));
                EXPECT_TRUE(std::isnan(r.objective)) << "no x, no value at x";
                continue;
            }
            if (solution.empty()) { // multipliers of constraints that depend on each other are not unique
                EXPECT_LT(kkt_violation(p, x, 1e-6), 1e-6);
            }
            EXPECT_NEAR(r.objective, p.objective(x), 1e-8);
            for (std::size_t i = 0; i < solution.size(); ++i)
                EXPECT_NEAR(x[static_cast<Eigen::Index>(i)], solution[i], 1e-7);
        }
    }
}

TEST_P(Outcomes, OfProxQpAreThoseOfTheExactSolvers) {
    const auto& [name, p, expected, osqp, solution] = GetParam();
    const int n = static_cast<int>(p.g.size()), m = static_cast<int>(p.A.rows());
    const auto solver = make_proxqp(n, m);
    VectorXd x = VectorXd::Constant(n, 7);
    for (int k = 0; k < 3; ++k) {
        const auto r = solver->solve(p.problem(), x);
        ASSERT_EQ(r.status, expected) << describe(r);
        if (expected == Status::solved) {
            EXPECT_NEAR(r.objective, p.objective(x), 1e-8);
        } else {
            EXPECT_EQ(x, VectorXd::Constant(n, 7));
            EXPECT_TRUE(std::isnan(r.objective)) << "no x, no value at x";
        }
        for (std::size_t i = 0; i < solution.size(); ++i)
            EXPECT_NEAR(x[static_cast<Eigen::Index>(i)], solution[i], 1e-5);
    }
}

TEST_P(Outcomes, OfOsqpHaveItsOwnNumbers) {
    const auto& [name, p, exact, expected, solution] = GetParam();
    const int n = static_cast<int>(p.g.size()), m = static_cast<int>(p.A.rows());
    OsqpOptions options;
    options.tolerance = 1e-5;
    options.max_iterations = 4000;
    const auto solver = make_osqp(n, m, options);
    VectorXd x = VectorXd::Constant(n, 7);
    for (int k = 0; k < 3; ++k) {
        const auto r = solver->solve(p.problem(), x);
        ASSERT_NE(std::find(expected.begin(), expected.end(), r.osqp_status), expected.end())
            << r.osqp_status;
        ASSERT_EQ(r.status, exact) << describe(r);
        if (exact != Status::solved) {
            EXPECT_EQ(x, VectorXd::Constant(n, 7)) << "no point of a problem without solution";
            continue;
        }
        EXPECT_NEAR(r.objective, p.objective(x), 1e-3);
        for (std::size_t i = 0; i < solution.size(); ++i)
            EXPECT_NEAR(x[static_cast<Eigen::Index>(i)], solution[i], 1e-3);
    }
}

TEST(NonConvex, IsAnInternalErrorOfDaqpAndProxQpAndOsqpNumberSeven) {
    auto p = feasible();
    p.H << 1, 0, 0, -1;
    p.lb = Vector2d(-2, -2);
    p.ub = Vector2d(2, 2);
    VectorXd x = Vector2d(7, 8);
    EXPECT_EQ(make_daqp(2, 1)->solve(p.problem(), x).status, Status::internal_error);
    EXPECT_EQ(make_proxqp(2, 1)->solve(p.problem(), x).status, Status::internal_error);
    const auto osqp = make_osqp(2, 1)->solve(p.problem(), x);
    EXPECT_EQ(osqp.status, Status::internal_error);
    EXPECT_EQ(osqp.osqp_status, -7);
    EXPECT_EQ(x, Vector2d(7, 8));
    // qpOASES may end at a point where the gradient vanishes along the active constraints.
    const auto qpoases = make_qpoases(2, 1)->solve(p.problem(), x);
    EXPECT_TRUE(qpoases.status == Status::internal_error || qpoases.status == Status::solved ||
                qpoases.status == Status::unbounded)
        << describe(qpoases);
}

TEST(NonConvex, IsNoticedByProxQpWhereASaddleIsFeasible) {
    std::mt19937 random(12);
    for (int k = 0; k < 50; ++k) {
        auto p = random_problem(random, 6, 0, true);
        p.H -= (k % 5 + 1.0) * MatrixXd::Identity(6, 6);
        const bool is_convex = Eigen::SelfAdjointEigenSolver<MatrixXd>(p.H).eigenvalues()[0] >= 0;
        VectorXd x(6);
        const auto r = make_proxqp(6, 0)->solve(p.problem(), x);
        EXPECT_EQ(r.status, is_convex ? Status::solved : Status::internal_error) << k;
    }
}

TEST(ProxQp, NoticesEndlessDescentAndDoesNotSolveContradictions) {
    std::mt19937 random(13);
    for (int k = 0; k < 20; ++k) {
        auto p = random_problem(random, 6, 4, false);
        p.A.conservativeResize(5, 6);
        p.lbA.conservativeResize(5);
        p.ubA.conservativeResize(5);
        p.A.row(4) = p.A.row(0) + p.A.row(1); // above the sum of what the two may be
        p.lbA.head(2).setConstant(-1);
        p.ubA.head(2).setConstant(1);
        p.lbA[4] = 2.5 + k;
        p.ubA[4] = infinity;
        VectorXd x = VectorXd::Constant(6, 7);
        const auto solver = make_proxqp(6, 5);
        const auto contradicting = solver->solve(p.problem(), x).status;
        EXPECT_TRUE(contradicting == Status::infeasible || contradicting == Status::iteration_limit) << k;
        p.lbA[4] = 1.5;
        EXPECT_EQ(solver->solve(p.problem(), x).status, Status::solved) << k;

        p = random_problem(random, 6, 0, false);
        p.H = p.H.topRows(3).transpose() * p.H.topRows(3); // of rank 3, and g has a part beside its range
        const auto r = make_proxqp(6, 0)->solve(p.problem(), x);
        EXPECT_EQ(r.status, Status::unbounded) << k << ' ' << describe(r);
    }
}

TEST(ProxQp, SolvesObjectivesOfHugeNumbers) {
    Owned p{1e200 * Matrix2d::Identity(), Vector2d(1e200, -2e200), {}, {}, {}, {}, {}};
    VectorXd x(2);
    const auto r = make_proxqp(2, 0)->solve(p.problem(), x);
    ASSERT_EQ(r.status, Status::solved);
    EXPECT_LT((x - Vector2d(-1, 2)).norm(), 1e-6);
    EXPECT_NEAR(r.objective / 1e200, -2.5, 1e-6);
}

TEST(QpOases, FindsAMinimumAlongPlanesThatNothingBounds) {
    std::mt19937 random(14);
    int limited = 0;
    for (int k = 0; k < 40; ++k) {
        auto p = random_problem(random, 8, 6, false);
        const MatrixXd B = p.A.topRows(3);
        p.H = B.transpose() * B; // rank 3 of 8
        p.g = B.transpose() * p.g.head(3);
        VectorXd x(8), y(8);
        const auto solver = make_qpoases(8, 6, {.max_iterations = 100});
        for (int again = 0; again < 2; ++again) {
            const auto r = solver->solve(p.problem(), x);
            if (r.status == Status::iteration_limit) {
                ++limited;
                break;
            }
            ASSERT_EQ(r.status, Status::solved) << k << ' ' << describe(r);
            ASSERT_EQ(make_daqp(8, 6, {.tolerance = 1e-9})->solve(p.problem(), y).status, Status::solved);
            EXPECT_NEAR(r.objective, p.objective(y), 1e-6 * (1 + std::abs(p.objective(y)))) << k;
            EXPECT_LT(x.norm(), 1e3) << "no far bound holds it";
        }
    }
    EXPECT_LE(limited, 4) << "of 40 are not solved within 100 changes of the working set";
}

TEST(Osqp, AgreesWithDaqpOnRandomProblems) {
    std::mt19937 random(21);
    int polished = 0;
    for (const bool polish : {false, true}) {
        for (int k = 0; k < 60; ++k) {
            const int n = 2 + k % 9, m = k % 12;
            const auto p = random_problem(random, n, m, k % 2);
            OsqpOptions options;
            options.tolerance = 1e-7;
            options.max_iterations = 100'000;
            options.adaptive_rho = k % 3 != 0;
            options.polish = polish;
            options.has_bounds = k % 2;
            VectorXd x(n), y(n);
            const auto r = make_osqp(n, m, options)->solve(p.problem(), x);
            ASSERT_EQ(r.osqp_status, 1) << k;
            ASSERT_EQ(make_daqp(n, m, {.tolerance = 1e-9})->solve(p.problem(), y).status, Status::solved);
            ASSERT_LT((x - y).cwiseAbs().maxCoeff(), 2e-4) << k;
            polished += polish && (x - y).cwiseAbs().maxCoeff() < 1e-8;
        }
    }
    EXPECT_GT(polished, 40) << "polishing makes the solution exact";
}

TEST(Osqp, WritesWhereItsIterationsEndedAtTheLimit) {
    const auto p = two_feet::make(0);
    OsqpOptions options;
    options.tolerance = 1e-9;
    options.max_iterations = 25;
    VectorXd x = VectorXd::Constant(12, 7);
    const auto r = make_osqp(12, 38, options)->solve(p.problem(), x);
    EXPECT_EQ(r.osqp_status, -2);
    EXPECT_EQ(r.status, Status::iteration_limit);
    EXPECT_NE(x[0], 7);
    const Owned owned{p.H, p.g, p.A, {}, p.ubA, {}, {}};
    EXPECT_NEAR(r.objective, owned.objective(x), 1e-9 * (1 + std::abs(r.objective)));
}

TEST(Osqp, RefusesFaultyDataAndBoundsThatItWasMadeWithout) {
    auto p = feasible();
    VectorXd x = Vector2d(7, 8);
    OsqpOptions options;
    options.has_bounds = false;
    const auto solver = make_osqp(2, 1, options);
    auto bad = p;
    bad.g[1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(solver->solve(bad.problem(), x).osqp_status, -10);
    bad = p;
    bad.lbA = VectorXd::Constant(1, 2);
    const auto crossing = solver->solve(bad.problem(), x);
    EXPECT_EQ(crossing.osqp_status, -3);
    EXPECT_EQ(crossing.term, Term::lbA);
    bad = p;
    bad.ub = Vector2d(1, 1);
    EXPECT_EQ(solver->solve(bad.problem(), x).term, Term::ub);
    EXPECT_EQ(x, Vector2d(7, 8));
    EXPECT_EQ(solver->solve(p.problem(), x).osqp_status, 1);
}

TEST(Osqp, ARestoredSolverContinuesBitForBit) {
    for (const bool adaptive : {false, true}) {
        OsqpOptions options;
        options.adaptive_rho = adaptive;
        options.max_iterations = 4000;
        options.has_bounds = false;
        const auto solver = make_osqp(12, 38, options), other = make_osqp(12, 38, options);
        VectorXd x(12), y(12);
        std::vector<double> state(static_cast<std::size_t>(solver->state_size()));
        for (int k = 0; k < 40; ++k) {
            solver->save(state.data());
            other->restore(state.data()); // what it solved before must not matter
            const auto p = two_feet::make(k), next = two_feet::make(k + 200);
            const auto a = solver->solve(p.problem(), x), b = other->solve(p.problem(), y);
            ASSERT_EQ(x, y) << k;
            ASSERT_EQ(a.osqp_status, b.osqp_status);
            ASSERT_EQ(a.iterations, b.iterations) << k;
            ASSERT_EQ(a.objective, b.objective) << k;
            if (k % 5 == 0) solver->reset();
            if (k % 2 == 0) other->solve(next.problem(), y);
        }
    }
}

TEST(Osqp, AfterResetItSolvesLikeANewSolver) {
    OsqpOptions options;
    options.adaptive_rho = true;
    const auto used = make_osqp(12, 38, options), fresh = make_osqp(12, 38, options);
    VectorXd x(12), y(12);
    for (int k = 0; k < 10; ++k) used->solve(two_feet::make(k).problem(), x);
    used->reset();
    for (int k = 0; k < 10; ++k) {
        used->solve(two_feet::make(k).problem(), x);
        fresh->solve(two_feet::make(k).problem(), y);
        ASSERT_EQ(x, y);
    }
}

TEST(Osqp, BeginsAtTheLastSolution) {
    OsqpOptions options;
    options.tolerance = 1e-5;
    options.max_iterations = 20'000;
    const auto solver = make_osqp(12, 38, options);
    const auto p = two_feet::make(0);
    VectorXd x(12);
    const int cold = solver->solve(p.problem(), x).iterations,
              warm = solver->solve(p.problem(), x).iterations;
    EXPECT_LT(warm, cold / 2);
    EXPECT_EQ(warm, 25);
}

TEST(QpOases, LooksAtEachHessianAnew) {
    auto p = feasible();
    const auto solver = make_qpoases(2, 1);
    VectorXd x(2);
    ASSERT_EQ(solver->solve(p.problem(), x).status, Status::solved); // by the identity
    p.H << 4, 1, 1, 2;
    ASSERT_EQ(solver->solve(p.problem(), x).status, Status::solved);
    EXPECT_LT(kkt_violation(p, x, 1e-6), 1e-9);
    p.H.setZero();
    ASSERT_EQ(solver->solve(p.problem(), x).status, Status::unbounded);
    p.H << 4, 1, 1, 2;
    ASSERT_EQ(solver->solve(p.problem(), x).status, Status::solved);
    EXPECT_LT(kkt_violation(p, x, 1e-6), 1e-9);
}

TEST(QpOases, ContinuesWhereTheIterationLimitStoppedIt) {
    std::mt19937 random(10);
    const auto p = random_problem(random, 12, 38, true);
    VectorXd expected(12), x = VectorXd::Constant(12, 7);
    make_daqp(12, 38)->solve(p.problem(), expected);
    const auto solver = make_qpoases(12, 38, {.max_iterations = 10});
    auto r = solver->solve(p.problem(), x);
    EXPECT_EQ(r.status, Status::iteration_limit);
    EXPECT_EQ(x, VectorXd::Constant(12, 7));
    for (int k = 0; k < 20 && r.status != Status::solved; ++k) {
        r = solver->solve(p.problem(), x);
        EXPECT_LE(r.iterations, 10);
    }
    EXPECT_EQ(r.status, Status::solved);
    EXPECT_LT((x - expected).norm(), 1e-6);
}

} // namespace
