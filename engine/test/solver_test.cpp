#include "bf/engine/solver.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

using namespace bf;

namespace {

/// x' = f(t, x) for one state, with one guard.
class Scalar {
  public:
    using Function = std::function<double(double t, double x)>;
    explicit Scalar(Function derivative, Function guard = {})
        : f_(std::move(derivative)), g_(std::move(guard)) {}

    std::unique_ptr<Solver> solver(const SolverSettings& settings, double step) {
        const std::size_t guards = g_ ? 1 : 0;
        return make_solver(settings, step,
                           {.x = {&x, 1},
                            .rate = {&rate_, 1},
                            .guards = {&guard_, guards},
                            .derivatives =
                                [this](double t) {
                                    rate_ = f_(t, x);
                                    return ++calls != stop_after;
                                },
                            .evaluate_guards =
                                [this](double t, bool) {
                                    if (g_) guard_ = g_(t, x);
                                    ++looks;
                                    return true;
                                }});
    }

    double x = 0;
    int calls = 0, looks = 0, stop_after = -1;

  private:
    Function f_, g_;
    double rate_ = 0, guard_ = 0;
};

/// Error of x' = -x + sin t over [0, 1] against its closed form, in n advances.
double error(const SolverSettings& settings, int n) {
    Scalar system([](double t, double x) { return -x + std::sin(t); });
    system.x = 1;
    const auto solver = system.solver(settings, 1.0 / n);
    solver->restart(0);
    double t = 0;
    for (int k = 0; k < n; ++k) EXPECT_EQ(solver->advance(t, (k + 1) * (1.0 / n)), Solver::Outcome::reached);
    const double exact = 1.5 * std::exp(-1.0) + 0.5 * (std::sin(1.0) - std::cos(1.0));
    return std::abs(system.x - exact);
}

const std::vector<SolverMethod> adaptive{SolverMethod::dormand_prince45, SolverMethod::cvode_bdf,
                                         SolverMethod::cvode_adams};

} // namespace

TEST(FixedStepSolver, EachMethodHasItsOrder) {
    for (const auto* name : {"euler", "heun", "bogacki_shampine", "rk4", "dormand_prince"}) {
        const auto method = solver_method(name);
        ASSERT_TRUE(method) << name;
        const double observed = std::log2(error({*method}, 10) / error({*method}, 20));
        EXPECT_NEAR(observed, order(*method), 0.25) << name;
    }
}

TEST(FixedStepSolver, IsExactForPolynomialsUpToItsOrder) {
    for (const auto* name : {"euler", "heun", "bogacki_shampine", "rk4", "dormand_prince"}) {
        const auto method = *solver_method(name);
        const int p = order(method);
        Scalar system([p](double t, double) { return p * std::pow(t, p - 1); });
        double t = 0;
        system.solver({method}, 2)->advance(t, 2);
        EXPECT_NEAR(system.x, std::pow(2, p), 1e-12) << name;
    }
}

TEST(FixedStepSolver, KeepsTheStateWhenTheModelFails) {
    Scalar system([](double, double) { return 1.0; });
    system.x = 3;
    system.stop_after = 3;
    double t = 0;
    EXPECT_EQ(system.solver({SolverMethod::rk4}, 1)->advance(t, 1), Solver::Outcome::failed);
    EXPECT_EQ(system.x, 3);
}

TEST(AdaptiveSolver, ErrorsFollowTheTolerance) {
    for (const auto method : adaptive)
        for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
            const SolverSettings settings{method, tolerance, tolerance};
            EXPECT_LT(error(settings, 1), 50 * tolerance);
            EXPECT_LT(error(settings, 100), 50 * tolerance) << "interpolated";
        }
}

TEST(AdaptiveSolver, DenseOutputCostsNoEvaluations) {
    for (const auto method : adaptive) {
        const auto evaluations = [&](int outputs) {
            Scalar system([](double t, double x) { return -x + std::sin(t); });
            const auto solver = system.solver({method}, 1);
            solver->restart(0);
            double t = 0;
            for (int k = 1; k <= outputs; ++k) solver->advance(t, 10.0 * k / outputs);
            return system.calls;
        };
        EXPECT_EQ(evaluations(10), evaluations(1000));
    }
}

TEST(AdaptiveSolver, FindsTheFirstCrossingAndStandsJustBehindIt) {
    for (const auto method : adaptive) {
        // x = sin t falls through 0.5 at pi - pi/6, after it has risen through it at pi/6.
        Scalar system([](double t, double) { return std::cos(t); }, [](double, double x) { return x - 0.5; });
        const auto solver = system.solver({method, 1e-10, 1e-12}, 10);
        solver->restart(0);
        double t = 0;
        ASSERT_EQ(solver->advance(t, 10), Solver::Outcome::crossed);
        EXPECT_NEAR(t, std::acos(-1) / 6, 1e-8);
        EXPECT_EQ(solver->crossings()[0], 1);
        EXPECT_GE(system.x - 0.5, -1e-15);
        EXPECT_NEAR(system.x, 0.5, 1e-9);
        solver->restart(t);
        ASSERT_EQ(solver->advance(t, 10), Solver::Outcome::crossed);
        EXPECT_NEAR(t, std::acos(-1) * 5 / 6, 1e-8);
        EXPECT_EQ(solver->crossings()[0], -1);
    }
}

TEST(AdaptiveSolver, DormandPrinceFindsASmoothCrossingInAFewLooks) {
    // Beside one look at the end of each step, which has six evaluations. The crossing is looked for in the
    // step over it and in shorter ones towards it, by secants that converge with order 1.44 (Dowell, Jarratt,
    // 1971); halves would take 45 looks each time.
    for (const double level : {0.1, 0.5, 0.9}) {
        Scalar system([](double t, double) { return std::cos(t); },
                      [level](double, double x) { return x - level; });
        const auto solver = system.solver({.method = SolverMethod::dormand_prince45, .max_step = 0.1}, 10);
        solver->restart(0);
        double t = 0;
        ASSERT_EQ(solver->advance(t, 10), Solver::Outcome::crossed);
        EXPECT_LE(system.looks - system.calls / 6, 60) << level;
    }
}

TEST(AdaptiveSolver, StatesThatMoveAlikeAreAsHardAsOneOfThem) {
    // The error is a root mean square, so that it grows with no copy.
    const auto calls = [](std::size_t states) {
        std::vector<double> x(states, 1), rate(states);
        int made = 0;
        const auto solver = make_solver({SolverMethod::dormand_prince45}, 1,
                                        {.x = x,
                                         .rate = rate,
                                         .guards = {},
                                         .derivatives =
                                             [&](double t) {
                                                 for (std::size_t i = 0; i < states; ++i)
                                                     rate[i] = std::cos(t) * x[i];
                                                 return ++made > 0;
                                             },
                                         .evaluate_guards = [](double, bool) { return true; }});
        solver->restart(0);
        double t = 0;
        EXPECT_EQ(solver->advance(t, 20), Solver::Outcome::reached);
        return made;
    };
    EXPECT_EQ(calls(4), calls(1));
    EXPECT_EQ(calls(16), calls(1));
}

TEST(AdaptiveSolver, GivesUpWhereTheStateGrowsWithoutBound) {
    for (const auto method : adaptive) {
        Scalar system([](double, double x) { return x * x; }); // x = 1/(1 - t)
        system.x = 1;
        const auto solver = system.solver({method}, 2);
        solver->restart(0);
        double t = 0;
        EXPECT_EQ(solver->advance(t, 2), Solver::Outcome::failed);
        EXPECT_NE(solver->failure().text().find("tolerances"), std::string::npos) << solver->failure().text();
        EXPECT_EQ(solver->worst_state(), 0);
    }
}

TEST(AdaptiveSolver, StopsWithTheModelWithoutAReasonOfItsOwn) {
    for (const auto method : adaptive) {
        Scalar system([](double, double) { return 1.0; });
        system.stop_after = 3;
        const auto solver = system.solver({method}, 1);
        solver->restart(0);
        double t = 0;
        EXPECT_EQ(solver->advance(t, 100), Solver::Outcome::failed);
        EXPECT_TRUE(solver->failure());
    }
}

TEST(AdaptiveSolver, StopsWhereverTheModelFails) {
    // The first evaluation of which solvers take back what follows is as good a place as any other.
    for (const auto method : adaptive) {
        const auto calls_until = [&](int stop_after, Solver::Outcome& outcome) {
            Scalar system([](double t, double x) { return -x + std::sin(t); },
                          [](double, double x) { return x - 0.25; });
            system.x = 1;
            system.stop_after = stop_after;
            const auto solver = system.solver({method}, 1);
            solver->restart(0);
            double t = 0;
            for (outcome = Solver::Outcome::reached; outcome != Solver::Outcome::failed && t < 3;)
                outcome = solver->advance(t, 3);
            return system.calls;
        };
        auto outcome = Solver::Outcome::reached;
        const int all = calls_until(-1, outcome);
        EXPECT_NE(outcome, Solver::Outcome::failed);
        for (int k = 1; k <= all; ++k) {
            EXPECT_EQ(calls_until(k, outcome), k) << "nothing is evaluated afterwards";
            EXPECT_EQ(outcome, Solver::Outcome::failed) << k << " of " << all;
        }
    }
}

TEST(AdaptiveSolver, DormandPrinceTakesHardlyMoreEvaluationsThanScipys) {
    // nfev of scipy.integrate.RK45 (1.17.1) with atol = rtol/1000, for rtol = 1e-4, 1e-6, 1e-9.
    struct Problem {
        const char* name;
        Scalar::Function f;
        double x, end;
        std::array<int, 3> scipy;
    };
    const Problem problems[] = {
        {"decay", [](double, double x) { return -x; }, 1, 10, {110, 248, 926}},
        {"swing", [](double t, double x) { return std::cos(t) * x; }, 1, 20, {266, 548, 1712}},
        {"logistic", [](double, double x) { return 5 * x * (1 - x); }, 1e-3, 5, {128, 284, 1028}},
        {"fast", [](double t, double x) { return -50 * (x - std::cos(t)); }, 0, 3, {446, 950, 3476}}};
    for (const auto& [name, f, x, end, scipy] : problems)
        for (std::size_t i = 0; i < 3; ++i) {
            const double tolerance = std::array{1e-4, 1e-6, 1e-9}[i];
            Scalar system(f);
            system.x = x;
            const auto solver =
                system.solver({SolverMethod::dormand_prince45, tolerance, tolerance * 1e-3}, end);
            solver->restart(0);
            double t = 0;
            ASSERT_EQ(solver->advance(t, end), Solver::Outcome::reached);
            EXPECT_LE(system.calls, 1.15 * scipy[i] + 10) << name << " " << tolerance;
            EXPECT_GE(system.calls, 0.6 * scipy[i])
                << name << " " << tolerance << ": else it is not as exact";
        }
}

TEST(FixedStepSolver, UnknownNamesGiveNothing) { EXPECT_FALSE(solver_method("ode45")); }
