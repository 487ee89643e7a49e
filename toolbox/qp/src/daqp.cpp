#include "data.hpp"

#include <algorithm>
#include <cmath>

extern "C" {
#include <api.h>
#include <utils.h>
}

namespace bf::qp {
namespace {

Status status_of(int exit_flag) noexcept {
    switch (exit_flag) {
    case DAQP_EXIT_OPTIMAL: return Status::solved;
    case DAQP_EXIT_INFEASIBLE:
    case DAQP_EXIT_OVERDETERMINED_INITIAL: return Status::infeasible;
    case DAQP_EXIT_UNBOUNDED: return Status::unbounded;
    case DAQP_EXIT_ITERLIMIT: return Status::iteration_limit;
    default: return Status::internal_error;
    }
}

class Daqp final : public Solver {
  public:
    Daqp(int variables, int constraints, const Options& options)
        : data_(variables, constraints, options), x_(variables), max_iterations_(options.max_iterations) {
        const int total = variables + constraints;
        allocate_daqp_settings(&work_);
        work_.settings->primal_tol = options.tolerance;
        work_.settings->eq_reduction = DAQP_EQ_REDUCTION_OFF; // it allocates
        allocate_daqp_workspace(&work_, variables, 0);
        allocate_daqp_ldp(&work_, variables, total, variables, 1, 1);
        std::fill_n(work_.sense, total, 0); // a state may be saved before the first solve
        // Room for m rows was made; without bounds on x the same rows start at index 0.
        work_.m = total;
        problem_.n = variables;
        problem_.H = data_.H.data();
        problem_.f = data_.g.data();
        problem_.A = data_.A.data();
    }
    Daqp(const Daqp&) = delete;
    Daqp& operator=(const Daqp&) = delete;
    ~Daqp() override {
        free_daqp_ldp(&work_);
        free_daqp_workspace(&work_);
    }

    Result solve(const Problem& problem, Eigen::Ref<Eigen::VectorXd> x) noexcept override {
        Result result = data_.load(problem, x.size());
        if (result.status != Status::solved) {
            return result;
        }
        const int bounds = data_.bounded ? data_.n : 0;
        warm_ = warm_ && bounds == problem_.ms; // the active set is a list of indices into the rows in use
        problem_.ms = bounds;
        problem_.m = bounds + data_.m;
        problem_.blower = data_.lower.data() + data_.n - bounds;
        problem_.bupper = data_.upper.data() + data_.n - bounds;

        const bool was_warm = warm_;
        run(result);
        if (was_warm && result.status != Status::solved && result.iterations < max_iterations_) {
            warm_ = false;
            run(result);
        }
        warm_ = result.status == Status::solved || result.status == Status::iteration_limit;
        if (result.status == Status::solved) {
            x = x_;
        }
        return result;
    }

    void reset() noexcept override { warm_ = false; }

    // Each solve forms everything else anew: the active set from `sense`, proximal iterations from x.
    int state_size() const noexcept override { return 2 + total() + data_.n; }
    void save(double* state) const noexcept override {
        *state++ = warm_;
        *state++ = problem_.ms;
        state = std::copy_n(work_.sense, total(), state);
        std::copy_n(work_.x, data_.n, state);
    }
    void restore(const double* state) noexcept override {
        warm_ = *state++ != 0.0;
        problem_.ms = static_cast<int>(*state++);
        for (int i = 0; i < total(); ++i) {
            work_.sense[i] = static_cast<int>(*state++);
        }
        std::copy_n(state, data_.n, work_.x);
    }

  private:
    int total() const noexcept { return data_.n + data_.m; }

    void run(Result& result) noexcept {
        int mask = DAQP_UPDATE_Rinv | DAQP_UPDATE_M | DAQP_UPDATE_v | DAQP_UPDATE_d;
        if (!warm_) {
            mask |= DAQP_UPDATE_sense;
            std::fill_n(work_.x, data_.n, 0.0); // where proximal iterations start
        }
        const int budget = max_iterations_ - result.iterations;
        work_.settings->iter_limit = budget + 1; // it counts from 1
        DAQPResult found{};
        found.x = x_.data();
        found.exitflag = daqp_update_ldp(mask, &work_, &problem_);
        if (found.exitflag >= 0) {
            found.exitflag =
                is_indefinite() ? DAQP_EXIT_NONCONVEX : (daqp_solve(&found, &work_), found.exitflag);
        }
        result.status = status_of(found.exitflag);
        result.iterations += std::min(found.iter, budget);
        if (result.status == Status::solved && !std::isfinite(x_.sum())) {
            result.status = Status::internal_error;
        }
        if (result.status == Status::solved) {
            result.objective = found.fval;
        }
    }

    /// DAQP doubles the shift of H until it factors; rounding alone needs one doubling at most.
    bool is_indefinite() const noexcept {
        if (work_.n_prox == 0) {
            return false;
        }
        const double scale = data_.H.diagonal().cwiseAbs().maxCoeff();
        const double shift = std::max(-work_.settings->eps_prox, std::sqrt(work_.settings->zero_tol) * scale);
        return daqp_get_proximal_regularization(&work_) > 3.0 * shift;
    }

    Data data_;
    Eigen::VectorXd x_;
    int max_iterations_;
    bool warm_ = false;
    DAQPWorkspace work_{};
    DAQPProblem problem_{};
};

} // namespace

std::unique_ptr<Solver> make_daqp(int variables, int constraints, const Options& options) {
    return std::make_unique<Daqp>(variables, constraints, options);
}

} // namespace bf::qp
