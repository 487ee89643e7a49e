// DAQP's own functions on data that is already in its format.
#pragma once

#include <benchmark/benchmark.h>

#include <Eigen/Core>

#include <cstddef>

extern "C" {
#include <api.h>
#include <utils.h>
}

namespace bf::benchmarks {

/// One iteration is one solve of problem(k), the next k each time, from the active set of the last one.
/// `update` says what of it changes; `multipliers` are as many as constraints, or none.
template <class Problem>
void run_daqp(benchmark::State& state, const Problem& problem, std::size_t count, int update, int variables,
              int multipliers = 0) {
    Eigen::VectorXd x(variables), lambda(multipliers);
    DAQPWorkspace work{};
    DAQPProblem qp = problem(0);
    setup_daqp(&qp, &work, nullptr);
    DAQPResult found{};
    found.x = x.data();
    if (multipliers > 0) found.lam = lambda.data();
    std::size_t k = 0;
    for (auto _ : state) {
        qp = problem(k++ % count);
        daqp_update_ldp(update, &work, &qp);
        daqp_solve(&found, &work);
        if (found.exitflag < 0) {
            state.SkipWithError("DAQP failed");
            break;
        }
    }
    benchmark::DoNotOptimize(x.data());
    free_daqp_ldp(&work);
    free_daqp_workspace(&work);
}

} // namespace bf::benchmarks
