#include "../toolbox/qp/test/two_feet.hpp"
#include "bare_daqp.hpp"

namespace {

using namespace bf::qp;

const std::vector<two_feet::Balancing>& problems() {
    static const auto all = two_feet::sequence(two_feet::cached);
    return all;
}

/// One iteration is one solve; the problems follow each other as in a control loop.
void run(benchmark::State& state, Solver& solver) {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(12);
    std::size_t k = 0;
    for (auto _ : state) {
        const auto result = solver.solve(problems()[k].problem(), x);
        if (result.status != Status::solved) {
            state.SkipWithError(describe(result).c_str());
            break;
        }
        k = (k + 1) % problems().size();
    }
    benchmark::DoNotOptimize(x.data());
}

void with_solver(benchmark::State& state) { run(state, *make_daqp(12, 38)); }
void with_proxqp(benchmark::State& state) { run(state, *make_proxqp(12, 38)); }

/// DAQP's own functions on data that is already in its format, as the floor for `solver`.
void with_bare_daqp(benchmark::State& state) {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    std::vector<RowMajor> A;
    for (const auto& p : problems()) {
        A.emplace_back(p.A);
    }
    Eigen::VectorXd lower = Eigen::VectorXd::Constant(38, -DAQP_INF);
    const auto problem = [&](std::size_t k) {
        const auto& p = problems()[k];
        DAQPProblem qp{};
        qp.n = 12;
        qp.m = 38;
        qp.H = const_cast<double*>(p.H.data());
        qp.f = const_cast<double*>(p.g.data());
        qp.A = A[k].data();
        qp.bupper = const_cast<double*>(p.ubA.data());
        qp.blower = lower.data();
        return qp;
    };
    bf::benchmarks::run_daqp(state, problem, problems().size(),
                             DAQP_UPDATE_Rinv | DAQP_UPDATE_M | DAQP_UPDATE_v | DAQP_UPDATE_d, 12);
}

BENCHMARK(with_solver)->Name("toolbox.qp_12x38/solver");
BENCHMARK(with_bare_daqp)->Name("toolbox.qp_12x38/bare_daqp");
BENCHMARK(with_proxqp)->Name("toolbox.qp_12x38/proxqp");

} // namespace
