#include "../qp/test/random_problem.hpp"
#include "running.hpp"

#include <limits>

namespace bf::toolbox::test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A QP block whose inputs are the root's.
std::string problem(int n, int m, const std::string& settings, const std::vector<std::string>& ports,
                    const std::string& block = "QP") {
    std::string text = "model: m\nstep: 0.01\ninputs:\n";
    std::string connections = "connections:\n";
    for (const auto& port : ports) {
        const std::string shape = port == "H"        ? "[n n]"
                                  : port == "A"      ? "[m n]"
                                  : port.size() == 3 ? "m"
                                                     : "n";
        text += "  " + port + ": {shape: \"" + shape + "\"}\n";
        connections += "  " + port + ": qp." + port + "\n";
    }
    return text + "variables: {n: " + std::to_string(n) + ", m: " + std::to_string(m) +
           "}\nblocks:\n  qp: {block: WholeBodyToolbox/" + block + settings + "}\n" + connections;
}

const std::string all_bounds = ", use_lbA: true, use_lb: true, use_ub: true, compute_objective: true";
const std::vector<std::string> all_ports = {"H", "g", "A", "lbA", "ubA", "lb", "ub"};

/// min ½|x|² − x1 − 2 x2 subject to x1 + x2 ≤ 1 has x = (0, 1).
void set_small(Running& run) {
    run.set("H", Matrix::Identity(2, 2)).set("g", Eigen::Vector2d(-1, -2));
    run.set("A", Eigen::RowVector2d(1, 1)).set("ubA", 1);
}

} // namespace

TEST(QP, AgreesWithTheClosedFormWhereNoConstraintIsActive) {
    Running run(problem(3, 1, ", use_ubA: false, compute_objective: true", {"H", "g"}));
    std::mt19937 random(1);
    for (int k = 0; k < 10; ++k) {
        const auto p = qp::test::random_problem(random, 3, 0, false);
        run.set("H", p.H).set("g", p.g);
        ASSERT_TRUE(run.step());
        const Vector expected = -p.H.ldlt().solve(p.g);
        EXPECT_LT((run.get("qp.x") - expected).norm(), 1e-9);
        EXPECT_EQ(run.scalar("qp.status"), 0);
        EXPECT_NEAR(run.scalar("qp.objective"), 0.5 * p.g.dot(expected), 1e-9);
    }
}

TEST(QP, AgreesWithProxQpOnProblemsWithAllBounds) {
    Running daqp(problem(6, 5, all_bounds, all_ports)),
        proxqp(problem(6, 5, all_bounds + ", solver: proxqp", all_ports));
    std::mt19937 random(2);
    for (int k = 0; k < 50; ++k) {
        const auto p = qp::test::random_problem(random, 6, 5, true);
        for (Running* run : {&daqp, &proxqp}) {
            run->set("H", p.H).set("g", p.g).set("A", p.A);
            run->set("lbA", p.lbA).set("ubA", p.ubA).set("lb", p.lb).set("ub", p.ub);
            ASSERT_TRUE(run->step());
            ASSERT_EQ(run->scalar("qp.status"), 0);
        }
        EXPECT_LT((daqp.get("qp.x") - proxqp.get("qp.x")).norm(), 1e-4) << k;
        EXPECT_NEAR(daqp.scalar("qp.objective"), p.objective(daqp.get("qp.x")), 1e-9) << k;
    }
}

TEST(QP, HasThePortsThatItsArgumentsSwitchOn) {
    const auto ports = [](const std::string& settings) {
        Blocks blocks;
        Arguments arguments;
        for (const auto* name : {"use_lbA", "use_ubA", "use_lb", "use_ub", "compute_objective"})
            arguments.push_back({name, (settings + " ").find(std::string(name) + " ") != std::string::npos});
        std::string names;
        const auto block = blocks.find("WholeBodyToolbox/QP").make(arguments);
        for (const auto& slot : block->resolution().slots)
            if (slot.role == Role::input || slot.role == Role::output) names += slot.name + " ";
        return names;
    };
    EXPECT_EQ(ports(""), "H g x status ");
    EXPECT_EQ(ports("use_lbA"), "H g A lbA x status ");
    EXPECT_EQ(ports("use_ubA"), "H g A ubA x status ");
    EXPECT_EQ(ports("use_lb"), "H g lb x status ");
    EXPECT_EQ(ports("use_ub compute_objective"), "H g ub x status objective ");
    EXPECT_EQ(ports("use_lbA use_ubA use_lb use_ub compute_objective"),
              "H g A lbA ubA lb ub x status objective ");
}

TEST(QP, HoldsTheLastSolutionWhileItFails) {
    Running run(problem(2, 1, ", use_lbA: true", {"H", "g", "A", "lbA", "ubA"}));
    set_small(run);
    run.set("lbA", 2); // lbA > ubA
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), -2);
    EXPECT_EQ(run.get("qp.x"), Vector(Eigen::Vector2d(0, 0))) << "before the first solution";
    run.set("lbA", -infinity);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), 0);
    EXPECT_LT((run.get("qp.x") - Eigen::Vector2d(0, 1)).norm(), 1e-12);
    const Matrix solution = run.get("qp.x");
    for (const double bad : {2.0, nan}) {
        run.set("lbA", bad).set("g", Eigen::Vector2d(5, 5));
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(run.step());
            EXPECT_EQ(run.scalar("qp.status"), bad == 2.0 ? -2 : -1);
            EXPECT_EQ(run.get("qp.x"), solution);
        }
    }
    run.set("lbA", -infinity).set("g", Eigen::Vector2d(0.5, 0.25));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), 0);
    EXPECT_LT((run.get("qp.x") - Eigen::Vector2d(-0.5, -0.25)).norm(), 1e-12);
}

TEST(QP, HoldsTheObjectiveOfTheLastSolutionWhileItFails) {
    for (const auto* block : {"QP", "QpOases", "OSQP"}) {
        Running run(
            problem(2, 1, ", use_lb: true, compute_objective: true", {"H", "g", "A", "ubA", "lb"}, block));
        set_small(run);
        run.set("lb", Eigen::Vector2d(-9, -9));
        ASSERT_TRUE(run.step());
        const double solved = run.scalar("qp.objective");
        EXPECT_NEAR(solved, -1.5, 0.01) << block;
        for (const double bad : {2.0, nan, -infinity}) { // infeasible; at fault; unbounded
            run.set("lb", Eigen::Vector2d(bad, bad)).set("g", Eigen::Vector2d(-5, -6));
            if (bad == -infinity) run.set("H", Matrix::Zero(2, 2)).set("A", Eigen::RowVector2d(0, 0));
            ASSERT_TRUE(run.step());
            EXPECT_EQ(run.scalar("qp.objective"), solved) << block << ' ' << bad;
        }
    }
}

TEST(QP, ReportsItsOutcomeWithTheNumbersOfQpOases) {
    Running run(problem(2, 2, ", use_lbA: true", {"H", "g", "A", "lbA", "ubA"}));
    const Vector free = Vector::Constant(2, infinity);
    run.set("H", Matrix::Identity(2, 2)).set("g", Eigen::Vector2d(-1, -2)).set("A", Matrix::Identity(2, 2));
    run.set("lbA", -free).set("ubA", free);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), 0);
    Matrix same(2, 2);
    same << 1, 1, 1, 1;
    run.set("A", same).set("lbA", Eigen::Vector2d(1, -infinity)).set("ubA", Eigen::Vector2d(infinity, 0));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), -2) << "x1 + x2 at least 1 and at most 0";
    run.set("H", Matrix::Zero(2, 2)).set("lbA", -free).set("ubA", free);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), -3) << "no minimum";

    std::mt19937 random(3);
    const auto p = qp::test::random_problem(random, 12, 30, false);
    Running short_run(problem(12, 30, ", use_lbA: true, max_iterations: 1", {"H", "g", "A", "lbA", "ubA"}));
    short_run.set("H", p.H).set("g", p.g).set("A", p.A).set("lbA", p.lbA).set("ubA", p.ubA);
    ASSERT_TRUE(short_run.step());
    EXPECT_EQ(short_run.scalar("qp.status"), 1);
}

TEST(QP, StopsTheRunWithTheEntryAtFault) {
    struct Case {
        std::string port;
        Matrix value;
        std::string text;
    };
    const Matrix H = Matrix::Identity(2, 2);
    const auto with = [](Matrix value, int row, int column, double entry) {
        value(row, column) = entry;
        return value;
    };
    const std::vector<Case> cases = {
        {"H", with(H, 0, 1, nan), "qp: H(1, 2) is not finite; look at what computes H"},
        {"g", Eigen::Vector2d(1, infinity), "qp: g(2) is not finite; look at what computes g"},
        {"A", Eigen::RowVector2d(nan, 1), "qp: A(1, 1) is not finite; look at what computes A"},
        {"lbA", Matrix::Constant(1, 1, nan), "qp: lbA(1) is NaN; look at what computes lbA"},
        {"ubA", Matrix::Constant(1, 1, nan), "qp: ubA(1) is NaN; look at what computes ubA"},
        {"lb", Eigen::Vector2d(0, nan), "qp: lb(2) is NaN; look at what computes lb"},
        {"ub", Eigen::Vector2d(nan, 0), "qp: ub(1) is NaN; look at what computes ub"},
        {"lbA", Matrix::Constant(1, 1, 3), "qp: lbA(1) is above ubA(1); look at what computes them"},
        {"lb", Eigen::Vector2d(-9, 10), "qp: lb(2) is above ub(2); look at what computes them"},
        {"H", -H,
         "qp: the QP solver broke down; make H positive semidefinite, and scale objective and constraints "
         "alike"},
    };
    for (const auto& [port, value, text] : cases) {
        Running run(problem(2, 1, all_bounds + ", stop_when_fails: true", all_ports));
        set_small(run);
        run.set("lbA", -1).set("lb", Eigen::Vector2d(-9, -9)).set("ub", Eigen::Vector2d(9, 9));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        run.set(port, value);
        EXPECT_FALSE(run.step()) << text;
        EXPECT_EQ(run.simulation.failure(), text);
    }
    Running run(problem(2, 2, ", use_lbA: true, stop_when_fails: true", {"H", "g", "A", "lbA", "ubA"}));
    run.set("H", H).set("g", Eigen::Vector2d(1, 1)).set("A", Matrix::Ones(2, 2));
    run.set("lbA", Eigen::Vector2d(1, -1)).set("ubA", Eigen::Vector2d(2, 0));
    EXPECT_FALSE(run.step());
    EXPECT_EQ(run.simulation.failure(),
              "qp: the QP has no feasible point: constraints contradict each other; relax the bounds");
}

TEST(QP, RefusesImpossibleArgumentsAndSizes) {
    expect_contains(refusal(problem(2, 1, ", max_iterations: 0", {"H", "g", "A", "ubA"})),
                    "qp: argument 'max_iterations' must be at least 1, but is 0");
    const auto solver = refusal(problem(2, 1, ", solver: qpoases", {"H", "g", "A", "ubA"}));
    expect_contains(solver, "qp: ");
    expect_contains(solver, "daqp");
    auto text = problem(2, 1, "", {"H", "g", "A", "ubA"});
    text.replace(text.find("g: {shape: \"n\""), 14, "g: {shape: \"3\"");
    expect_contains(refusal(text), "qp: input 'g' needs n = 3, but n is already 2");
}

TEST(QP, ContinuesASnapshotBitForBit) {
    Running run(problem(6, 5, all_bounds, all_ports));
    std::mt19937 random(4);
    const auto p = qp::test::random_problem(random, 6, 5, true);
    const auto go = [&](int from, std::vector<double>& seen) {
        for (int k = from; k < from + 20; ++k) {
            const Vector g = p.g * std::cos(0.3 * k);
            run.set("H", p.H).set("g", g).set("A", p.A);
            run.set("lbA", p.lbA).set("ubA", p.ubA).set("lb", p.lb).set("ub", p.ub);
            ASSERT_TRUE(run.step());
            const Matrix x = run.get("qp.x");
            seen.insert(seen.end(), x.data(), x.data() + x.size());
        }
    };
    std::vector<double> before, first, second;
    go(0, before);
    const auto snapshot = run.simulation.snapshot();
    go(20, first);
    run.simulation.restore(snapshot);
    go(20, second);
    EXPECT_EQ(first, second);
    EXPECT_NE(first, before);
}

TEST(QpOases, AgreesWithQpOnProblemsWithAllBoundsInBothSolvers) {
    Running qp(problem(6, 5, all_bounds, all_ports)),
        qpoases(problem(6, 5, all_bounds, all_ports, "QpOases")),
        daqp(problem(6, 5, all_bounds + ", solver: daqp", all_ports, "QpOases"));
    std::mt19937 random(5);
    for (int k = 0; k < 30; ++k) {
        const auto p = qp::test::random_problem(random, 6, 5, true);
        for (Running* run : {&qp, &qpoases, &daqp}) {
            run->set("H", p.H).set("g", p.g).set("A", p.A);
            run->set("lbA", p.lbA).set("ubA", p.ubA).set("lb", p.lb).set("ub", p.ub);
            ASSERT_TRUE(run->step());
            ASSERT_EQ(run->scalar("qp.status"), 0);
            EXPECT_LT((run->get("qp.x") - qp.get("qp.x")).norm(), 1e-6) << k;
            EXPECT_NEAR(run->scalar("qp.objective"), qp.scalar("qp.objective"), 1e-6) << k;
        }
    }
}

TEST(QpOases, ReportsItsOutcomeAndHoldsTheLastSolution) {
    for (const std::string solver : {"", ", solver: daqp"}) {
        Running run(problem(2, 2, ", use_lbA: true" + solver, {"H", "g", "A", "lbA", "ubA"}, "QpOases"));
        const Vector free = Vector::Constant(2, infinity);
        run.set("H", Matrix::Identity(2, 2)).set("g", Eigen::Vector2d(-1, -2)).set("A", Matrix::Ones(2, 2));
        run.set("lbA", -free).set("ubA", free);
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("qp.status"), 0);
        const Matrix x = run.get("qp.x");
        EXPECT_LT((x - Eigen::Vector2d(1, 2)).norm(), 1e-9);
        run.set("lbA", Eigen::Vector2d(1, -infinity)).set("ubA", Eigen::Vector2d(infinity, 0));
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("qp.status"), -2);
        EXPECT_EQ(run.get("qp.x"), x);
        run.set("H", Matrix::Zero(2, 2)).set("lbA", -free).set("ubA", free);
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("qp.status"), -3);
        EXPECT_EQ(run.get("qp.x"), x);
        run.set("g", Eigen::Vector2d(nan, 0));
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("qp.status"), -1);
    }
}

TEST(QpOases, EndsAfterAHundredChangesOfTheWorkingSet) {
    std::mt19937 random(6);
    const auto p = qp::test::random_problem(random, 120, 160, true);
    Running run(problem(120, 160, all_bounds, all_ports, "QpOases"));
    run.set("H", p.H).set("g", p.g).set("A", p.A);
    run.set("lbA", p.lbA).set("ubA", p.ubA).set("lb", p.lb).set("ub", p.ub);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), 1);
    for (int k = 0; k < 30 && run.scalar("qp.status") == 1; ++k) ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), 0) << "it goes on in the next steps";
}

TEST(Osqp, ReportsItsOutcomeWithItsOwnNumbers) {
    Running run(
        problem(2, 2, ", use_lbA: true, max_iterations: 4000", {"H", "g", "A", "lbA", "ubA"}, "OSQP"));
    const Vector free = Vector::Constant(2, infinity);
    run.set("H", Matrix::Identity(2, 2)).set("g", Eigen::Vector2d(-1, -2)).set("A", Matrix::Ones(2, 2));
    run.set("lbA", -free).set("ubA", free);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), 1);
    const Matrix x = run.get("qp.x");
    EXPECT_LT((x - Eigen::Vector2d(1, 2)).norm(), 1e-2);
    const auto fails = [&](double status) {
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("qp.status"), status);
        EXPECT_EQ(run.get("qp.x"), x) << "the last point while there is none";
    };
    run.set("lbA", Eigen::Vector2d(1, -infinity)).set("ubA", Eigen::Vector2d(infinity, 0));
    fails(-3);
    run.set("H", Matrix::Zero(2, 2)).set("lbA", -free).set("ubA", free);
    fails(-4);
    run.set("H", -Matrix::Identity(2, 2));
    fails(-7);
    run.set("g", Eigen::Vector2d(nan, 0));
    fails(-10);

    std::mt19937 random(3);
    const auto p = qp::test::random_problem(random, 12, 30, false);
    Running short_run(
        problem(12, 30, ", use_lbA: true, max_iterations: 1", {"H", "g", "A", "lbA", "ubA"}, "OSQP"));
    short_run.set("H", p.H).set("g", p.g).set("A", p.A).set("lbA", p.lbA).set("ubA", p.ubA);
    ASSERT_TRUE(short_run.step());
    EXPECT_EQ(short_run.scalar("qp.status"), -2);
    EXPECT_GT(short_run.get("qp.x").norm(), 0) << "where the iterations ended";
}

TEST(Osqp, StopsTheRunUnlessItSolvesOnDemand) {
    Running run(problem(2, 1, ", stop_when_fails: true, polish: true, adaptive_rho: true",
                        {"H", "g", "A", "ubA"}, "OSQP"));
    set_small(run);
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_LT((run.get("qp.x") - Eigen::Vector2d(0, 1)).norm(), 1e-6) << "polished";
    run.set("H", -Matrix::Identity(2, 2));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(), "qp: the QP solver broke down; make H positive semidefinite");
}

TEST(Qps, HaveTheArgumentsOfThePaperInItsOrder) {
    Blocks blocks;
    const auto names = [&](const std::string& block) {
        const auto made = blocks.find("WholeBodyToolbox/" + block).make({});
        std::string all;
        for (const auto& argument : made->declaration().arguments) all += argument.name + " ";
        return all;
    };
    const std::string common = "use_lbA use_ubA use_lb use_ub compute_objective stop_when_fails ";
    EXPECT_EQ(names("QpOases"), common + "solver ");
    EXPECT_EQ(names("OSQP"), common + "adaptive_rho polish max_iterations ");
}

} // namespace bf::toolbox::test
