#include "least_distance.hpp"

#include <algorithm>
#include <cmath>

extern "C" {
#include <api.h>
#include <utils.h>
}

namespace bf::qp {

struct LeastDistance::Workspace {
    Workspace(int variables, int rows, const Options& options) : sense(static_cast<std::size_t>(rows)) {
        allocate_daqp_settings(&daqp);
        daqp.settings->primal_tol = options.tolerance;
        daqp.settings->eq_reduction = DAQP_EQ_REDUCTION_OFF; // it allocates
        allocate_daqp_workspace(&daqp, variables, 0);
        allocate_daqp_ldp(&daqp, variables, rows, 0, 0, 0);
        std::fill_n(daqp.sense, rows, 0);
    }
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;
    ~Workspace() {
        free_daqp_ldp(&daqp);
        free_daqp_workspace(&daqp);
    }

    DAQPWorkspace daqp{};
    DAQPProblem problem{};
    std::vector<int> sense;
};

LeastDistance::LeastDistance(int variables, int rows, const Options& options)
    : work_(std::make_unique<Workspace>(variables, rows, options)) {}
LeastDistance::~LeastDistance() = default;
LeastDistance::LeastDistance(LeastDistance&&) noexcept = default;

Status LeastDistance::solve(int variables, int rows, const double* G, const double* lower,
                            const double* upper, signed char* active, double* u, int& iterations, int most,
                            bool again) noexcept {
    DAQPWorkspace& daqp = work_->daqp;
    DAQPProblem& problem = work_->problem;
    problem.n = variables;
    problem.m = rows;
    // It reads these alone, though their types do not say so.
    problem.A = const_cast<double*>(G);
    problem.blower = const_cast<double*>(lower);
    problem.bupper = const_cast<double*>(upper);
    problem.sense = work_->sense.data();
    DAQPResult found{};
    found.x = u;
    for (const bool warm : {true, false}) {
        for (int i = 0; i < rows; ++i)
            problem.sense[i] = !warm || active[i] == 0 ? 0 : (DAQP_ACTIVE | (active[i] < 0 ? DAQP_LOWER : 0));
        daqp.settings->iter_limit = most - iterations + 1; // it counts from 1
        const int everything = DAQP_UPDATE_M | DAQP_UPDATE_d | DAQP_UPDATE_sense;
        found.exitflag = daqp_update_ldp(warm && again ? DAQP_UPDATE_d : everything, &daqp, &problem);
        found.iter = 0;
        if (found.exitflag >= 0) daqp_solve(&found, &daqp);
        iterations += std::min(found.iter, most - iterations);
        const bool solved = found.exitflag == DAQP_EXIT_OPTIMAL &&
                            std::isfinite(Eigen::Map<const Eigen::VectorXd>(u, variables).sum());
        for (int i = 0; i < rows; ++i)
            active[i] = !solved || !(daqp.sense[i] & DAQP_ACTIVE) ? 0 : daqp.sense[i] & DAQP_LOWER ? -1 : 1;
        if (solved) return Status::solved;
        if (iterations >= most) break;
    }
    switch (found.exitflag) {
    case DAQP_EXIT_INFEASIBLE:
    case DAQP_EXIT_OVERDETERMINED_INITIAL: return Status::infeasible;
    case DAQP_EXIT_ITERLIMIT: return Status::iteration_limit;
    default: return Status::internal_error;
    }
}

} // namespace bf::qp
