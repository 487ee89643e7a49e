#include "bf/engine/solver.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace bf;

namespace {

/// Error of x' = -x + sin t over [0, 1] against its closed form, with n steps.
double error(SolverMethod method, int n) {
    double x = 1, rate = 0;
    FixedStepSolver solver(method, 1);
    const double h = 1.0 / n;
    for (int k = 0; k < n; ++k)
        EXPECT_TRUE(solver.step(k * h, h, {&x, 1}, {&rate, 1}, [&](double t) {
            rate = -x + std::sin(t);
            return true;
        }));
    const double exact = 1.5 * std::exp(-1.0) + 0.5 * (std::sin(1.0) - std::cos(1.0));
    return std::abs(x - exact);
}

} // namespace

TEST(FixedStepSolver, EachMethodHasItsOrder) {
    for (const auto* name : {"euler", "heun", "bogacki_shampine", "rk4", "dormand_prince"}) {
        const auto method = solver_method(name);
        ASSERT_TRUE(method) << name;
        const double observed = std::log2(error(*method, 10) / error(*method, 20));
        EXPECT_NEAR(observed, order(*method), 0.25) << name;
    }
}

TEST(FixedStepSolver, IsExactForPolynomialsUpToItsOrder) {
    for (const auto* name : {"euler", "heun", "bogacki_shampine", "rk4", "dormand_prince"}) {
        const auto method = *solver_method(name);
        const int p = order(method);
        double x = 0, rate = 0;
        FixedStepSolver solver(method, 1);
        solver.step(0, 2, {&x, 1}, {&rate, 1}, [&](double t) {
            rate = p * std::pow(t, p - 1);
            return true;
        });
        EXPECT_NEAR(x, std::pow(2, p), 1e-12) << name;
    }
}

TEST(FixedStepSolver, KeepsTheStateWhenTheModelFails) {
    double x = 3, rate = 1;
    FixedStepSolver solver(SolverMethod::rk4, 1);
    int calls = 0;
    EXPECT_FALSE(solver.step(0, 1, {&x, 1}, {&rate, 1}, [&](double) { return ++calls < 3; }));
    EXPECT_EQ(x, 3);
}

TEST(FixedStepSolver, UnknownNamesGiveNothing) { EXPECT_FALSE(solver_method("ode45")); }
