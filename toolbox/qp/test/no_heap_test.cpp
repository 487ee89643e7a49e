#include "heap.hpp"
#include "random_problem.hpp"
#include "two_feet.hpp"

#include <bf/qp/hierarchy.hpp>
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>

namespace {

using namespace bf::qp;
using bf::test::heap_calls;

TEST(AllocationCounter, SeesAllocationsOfEigenAndOfC) {
    if (!bf::test::heap_is_counted()) GTEST_SKIP() << "not counted here";
    const long before = heap_calls();
    Eigen::VectorXd v(100);
    // Otherwise clang leaves both out.
    [[maybe_unused]] const double* const volatile seen = v.data();
    void* volatile memory = std::malloc(v.size());
    EXPECT_EQ(heap_calls() - before, 2);
    std::free(memory);
}

TEST(Daqp, DoesNotAllocateWhenSolving) {
    const auto problems = two_feet::sequence(100);
    const auto solver = make_daqp(12, 38);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(12);
    const long before = heap_calls();
    for (const auto& p : problems) { // the first solve counts too
        solver->solve(p.problem(), x);
    }
    EXPECT_EQ(heap_calls() - before, 0);
    solver->reset();
    solver->solve(problems[0].problem(), x);
    EXPECT_EQ(heap_calls() - before, 0);
}

TEST(Daqp, AllocatesInNoOutcome) {
    std::mt19937 random(1);
    const auto solver = make_daqp(8, 6);
    const auto good = test::random_problem(random, 8, 6, true);
    auto equalities = good, infeasible = good, crossing = good, broken = good, unbounded = good, flat = good;
    equalities.lbA.head(4) = equalities.ubA.head(4) = equalities.A.topRows(4) * (0.5 * (good.lb + good.ub));
    infeasible.A.row(0).setZero();
    infeasible.lbA[0] = infeasible.ubA[0] = 1.0;
    crossing.lb[0] = crossing.ub[0] + 1.0;
    broken.A(2, 3) = test::infinity;
    unbounded.H.setZero();
    unbounded.lb.resize(0);
    unbounded.ub.resize(0);
    unbounded.A.setZero();
    unbounded.lbA.setConstant(-1);
    unbounded.ubA.setConstant(1);
    flat.H.topRows(3).setZero();
    flat.H.leftCols(3).setZero();
    Eigen::VectorXd x(8);
    for (const auto& [problem, status] : {std::pair{&good, Status::solved},
                                          {&equalities, Status::solved},
                                          {&infeasible, Status::infeasible},
                                          {&crossing, Status::infeasible},
                                          {&broken, Status::internal_error},
                                          {&unbounded, Status::unbounded},
                                          {&flat, Status::solved},
                                          {&good, Status::solved}}) {
        const long before = heap_calls();
        const auto r = solver->solve(problem->problem(), x);
        EXPECT_EQ(heap_calls() - before, 0) << describe(r);
        EXPECT_EQ(r.status, status) << describe(r);
    }
}

TEST(Osqp, DoesNotAllocateWithoutPolishing) {
    const auto problems = two_feet::sequence(20);
    OsqpOptions options;
    options.adaptive_rho = true;
    options.max_iterations = 400;
    const auto solver = make_osqp(12, 38, options);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(12);
    const long before = heap_calls();
    for (const auto& p : problems) {
        solver->solve(p.problem(), x);
    }
    EXPECT_EQ(heap_calls() - before, 0);
}

TEST(Hierarchy, DoesNotAllocateWhenSolving) {
    std::mt19937 random(2);
    const auto hard = test::random_problem(random, 12, 10, true),
               soft = test::random_problem(random, 12, 8, false);
    Hierarchy hierarchy(12, {22, 8, 20}, {});
    auto of_hard = hierarchy.level(0), first = hierarchy.level(1), second = hierarchy.level(2);
    of_hard.A.topRows(10) = hard.A;
    of_hard.A.bottomRows(12).setIdentity();
    of_hard.lower << hard.lbA, hard.lb;
    of_hard.upper << hard.ubA, hard.ub;
    first.A = soft.A;
    first.lower = soft.lbA;
    first.upper = soft.ubA;
    second.A = Eigen::MatrixXd::Ones(20, 12) + Eigen::MatrixXd::Identity(20, 12);
    second.lower.setConstant(1.0);
    second.upper = second.lower;
    Eigen::VectorXd x(12);
    for (const double bound : {1.0, 9.0, -9.0, std::numeric_limits<double>::quiet_NaN()}) {
        first.lower[0] = first.upper[0] = bound;
        const long before = heap_calls();
        hierarchy.solve(x);
        EXPECT_EQ(heap_calls() - before, 0);
    }
    first.lower[0] = first.upper[0] = 1.0;
    EXPECT_EQ(hierarchy.solve(x).status, Status::solved);
    EXPECT_GT(hierarchy.solve(x).iterations, 0) << "no program was needed";
}

} // namespace
