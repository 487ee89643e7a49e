#include "data.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

extern "C" {
#include <auxil.h>
#include <osqp.h>
#include <qdldl_interface.h>
#include <scaling.h>
}

namespace bf::qp {
namespace {

Status status_of(c_int status) noexcept {
    switch (status) {
    case OSQP_SOLVED:
    case OSQP_SOLVED_INACCURATE: return Status::solved;
    case OSQP_MAX_ITER_REACHED: return Status::iteration_limit;
    case OSQP_PRIMAL_INFEASIBLE:
    case OSQP_PRIMAL_INFEASIBLE_INACCURATE: return Status::infeasible;
    case OSQP_DUAL_INFEASIBLE:
    case OSQP_DUAL_INFEASIBLE_INACCURATE: return Status::unbounded;
    default: return Status::internal_error;
    }
}

/// The constraints are l <= [I; A] x <= u, or A alone where no problem bounds x; all matrices are dense.
class Osqp final : public Solver {
  public:
    Osqp(int variables, int constraints, const OsqpOptions& options)
        : data_(variables, constraints, options), bounds_(options.has_bounds ? variables : 0), x_(variables),
          y_(rows()) {
        x_.setZero();
        y_.setZero();
        const int n = variables, m = constraints;
        std::vector<c_int> P_rows, P_begin{0}, A_rows, A_begin{0};
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i <= j; ++i) P_rows.push_back(i);
            P_begin.push_back(static_cast<c_int>(P_rows.size()));
            if (bounds_ > 0) A_rows.push_back(j);
            for (int i = 0; i < m; ++i) A_rows.push_back(bounds_ + i);
            A_begin.push_back(static_cast<c_int>(A_rows.size()));
        }
        // The values of the first problem replace these.
        std::vector<c_float> P_values, A_values(A_rows.size(), 1), zeros(static_cast<std::size_t>(n), 0),
            free(static_cast<std::size_t>(rows()), OSQP_INFTY), low(free.size(), -OSQP_INFTY);
        for (int j = 0; j < n; ++j)
            for (int i = 0; i <= j; ++i) P_values.push_back(i == j);
        csc P{static_cast<c_int>(P_values.size()), n, n, P_begin.data(), P_rows.data(), P_values.data(), -1};
        csc A{static_cast<c_int>(A_values.size()),
              rows(),
              n,
              A_begin.data(),
              A_rows.data(),
              A_values.data(),
              -1};
        OSQPData data{n, rows(), &P, &A, zeros.data(), low.data(), free.data()};
        OSQPSettings settings;
        osqp_set_default_settings(&settings);
        settings.eps_abs = settings.eps_rel = options.tolerance;
        settings.max_iter = options.max_iterations;
        settings.adaptive_rho = options.adaptive_rho;
        settings.adaptive_rho_interval = settings.check_termination;
        settings.polish = options.polish;
        initial_rho_ = settings.rho;
        if (osqp_setup(&work_, &data, &settings) != 0) {
            osqp_cleanup(work_);
            throw std::bad_alloc();
        }
    }
    Osqp(const Osqp&) = delete;
    Osqp& operator=(const Osqp&) = delete;
    ~Osqp() override { osqp_cleanup(work_); }

    Result solve(const Problem& problem, Eigen::Ref<Eigen::VectorXd> x) noexcept override {
        Result result = data_.load(problem, x.size());
        if (result.status == Status::solved && data_.bounded && bounds_ == 0) {
            result.status = Status::internal_error;
            result.term = problem.lb.size() > 0 ? Term::lb : Term::ub;
        }
        if (result.status != Status::solved) {
            result.osqp_status = result.status == Status::infeasible ? OSQP_PRIMAL_INFEASIBLE : OSQP_UNSOLVED;
            return result;
        }
        result.osqp_status = load() ? run(result) : OSQP_NON_CVX;
        result.status = status_of(result.osqp_status);
        const bool has_point = result.status == Status::solved || result.osqp_status == OSQP_MAX_ITER_REACHED;
        const Eigen::Map<const Eigen::VectorXd> found(work_->solution->x, data_.n);
        if (!has_point || !found.allFinite()) {
            if (has_point) {
                result.status = Status::internal_error;
                result.osqp_status = OSQP_UNSOLVED;
            }
            reset();
            return result;
        }
        x_ = found;
        y_ = Eigen::Map<const Eigen::VectorXd>(work_->solution->y, rows());
        x = x_;
        result.objective = work_->info->obj_val;
        if (result.osqp_status == OSQP_MAX_ITER_REACHED) {
            result.objective = data_.objective(x_);
        }
        return result;
    }

    void reset() noexcept override {
        x_.setZero();
        y_.setZero();
        work_->settings->rho = initial_rho_;
    }

    // Scaling and factors are formed anew from each problem, so that these are all that a solve starts from.
    int state_size() const noexcept override { return 1 + data_.n + rows(); }
    void save(double* state) const noexcept override {
        *state++ = work_->settings->rho;
        state = std::copy_n(x_.data(), data_.n, state);
        std::copy_n(y_.data(), rows(), state);
    }
    void restore(const double* state) noexcept override {
        work_->settings->rho = *state++;
        std::copy_n(state, data_.n, x_.data());
        std::copy_n(state + data_.n, rows(), y_.data());
    }

  private:
    int rows() const noexcept { return bounds_ + data_.m; }

    /// Writes the problem into the workspace as if it were new; false if H is not positive semidefinite.
    bool load() noexcept {
        const int n = data_.n, m = data_.m, skipped = n - bounds_;
        c_float *P = work_->data->P->x, *A = work_->data->A->x;
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i <= j; ++i) *P++ = data_.H(i, j);
            if (bounds_ > 0) *A++ = 1;
            for (int i = 0; i < m; ++i) *A++ = data_.A(i, j);
        }
        std::copy_n(data_.g.data(), n, work_->data->q);
        for (int i = 0; i < rows(); ++i) {
            work_->data->l[i] = std::max(data_.lower[skipped + i], -OSQP_INFTY);
            work_->data->u[i] = std::min(data_.upper[skipped + i], OSQP_INFTY);
        }
        scale_data(work_);
        set_rho_vec(work_);
        auto* system = reinterpret_cast<qdldl_solver*>(work_->linsys_solver);
        if (work_->linsys_solver->update_rho_vec(work_->linsys_solver, work_->rho_vec) != 0) return false;
        if (work_->linsys_solver->update_matrices(work_->linsys_solver, work_->data->P, work_->data->A) != 0)
            return false;
        // The system is quasi-definite, with one positive pivot for each variable, where H is semidefinite.
        if (std::count_if(system->D, system->D + n + rows(), [](double pivot) { return pivot > 0; }) != n)
            return false;
        reset_info(work_->info);
        osqp_warm_start(work_, x_.data(), y_.data());
        return true;
    }

    c_int run(Result& result) noexcept {
        osqp_solve(work_);
        result.iterations = static_cast<int>(work_->info->iter);
        return work_->info->status_val;
    }

    Data data_;
    int bounds_; ///< rows that bound x
    Eigen::VectorXd x_, y_;
    double initial_rho_ = 0;
    OSQPWorkspace* work_ = nullptr;
};

} // namespace

std::unique_ptr<Solver> make_osqp(int variables, int constraints, const OsqpOptions& options) {
    return std::make_unique<Osqp>(variables, constraints, options);
}

} // namespace bf::qp
