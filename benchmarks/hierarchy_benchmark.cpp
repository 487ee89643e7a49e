// Strict hierarchies of least-squares problems, beside the hierarchical solver that comes with DAQP.
#include "bare_daqp.hpp"
#include "bf/qp/hierarchy.hpp"

#include <Eigen/Dense>

#include <random>
#include <vector>

namespace {

using RowMajor = bf::qp::Hierarchy::RowMajor;
constexpr int n = 60, rows = 20, levels = 3, total = n + rows * levels;

/// Bounds of all variables, some of which are reached, and three levels of 20 equalities, the first 5 rows of
/// the second in conflict with those of the first.
struct Problem {
    RowMajor A{total, n};
    Eigen::VectorXd lower{total}, upper{total};
};

/// Neighbours differ little, as in a control loop.
const std::vector<Problem>& problems() {
    static const auto all = [] {
        std::mt19937 random(1);
        std::normal_distribution<double> normal;
        const auto draw = [&] { return normal(random); };
        Problem p;
        p.A.topRows(n).setIdentity();
        p.A.bottomRows(rows * levels) = RowMajor::NullaryExpr(rows * levels, n, draw);
        p.A.middleRows(n + rows, 5) = p.A.middleRows(n, 5);
        p.lower = Eigen::VectorXd::NullaryExpr(total, draw);
        p.lower.head(n).setConstant(-0.5);
        const Eigen::VectorXd middle = p.lower;
        std::vector<Problem> sequence;
        for (int k = 0; k < 50; ++k) {
            p.lower.tail(rows * levels) = middle.tail(rows * levels) * (1.0 + 0.3 * std::sin(0.126 * k));
            p.upper = p.lower;
            p.upper.head(n).setConstant(0.5);
            sequence.push_back(p);
        }
        return sequence;
    }();
    return all;
}

void with_hierarchy(benchmark::State& state) {
    bf::qp::Hierarchy hierarchy(n, {n, rows, rows, rows}, {});
    Eigen::VectorXd x(n);
    std::size_t k = 0;
    for (auto _ : state) {
        const Problem& p = problems()[k++ % problems().size()];
        int first = 0;
        for (int level = 0; level <= levels; ++level) {
            auto to = hierarchy.level(level);
            const int count = level == 0 ? n : rows;
            to.A = p.A.middleRows(first, count);
            to.lower = p.lower.segment(first, count);
            to.upper = p.upper.segment(first, count);
            first += count;
        }
        if (hierarchy.solve(x).status != bf::qp::Status::solved) return state.SkipWithError("not solved");
    }
    benchmark::DoNotOptimize(x.data());
}

/// DAQP's own hierarchy, which begins with the active set of the last solve, too. It keeps each level as a
/// penalty, and is satisfied when the violations settle.
void with_bare_daqp(benchmark::State& state) {
    std::vector<int> ends{n, n + rows, n + 2 * rows, n + 3 * rows};
    const auto problem = [&](std::size_t k) {
        const Problem& p = problems()[k];
        DAQPProblem qp{};
        qp.n = n;
        qp.m = total;
        qp.ms = n; // bounds of variables, which it needs no rows for
        qp.A = const_cast<double*>(p.A.data() + n * n);
        qp.bupper = const_cast<double*>(p.upper.data());
        qp.blower = const_cast<double*>(p.lower.data());
        qp.nh = static_cast<int>(ends.size());
        qp.break_points = ends.data();
        return qp;
    };
    bf::benchmarks::run_daqp(state, problem, problems().size(), DAQP_UPDATE_M | DAQP_UPDATE_d, n, total);
}

BENCHMARK(with_hierarchy)->Name("toolbox.hierarchy_3x60/hierarchy");
BENCHMARK(with_bare_daqp)->Name("toolbox.hierarchy_3x60/bare_daqp");

} // namespace
