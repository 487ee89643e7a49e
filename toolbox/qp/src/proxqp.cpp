#include "data.hpp"

#include <algorithm>
#include <cmath>
#include <proxsuite/proxqp/dense/dense.hpp>

namespace bf::qp {
namespace {

namespace proxqp = proxsuite::proxqp;
using proxqp::QPSolverOutput;

Status status_of(QPSolverOutput output) noexcept {
    switch (output) {
    case QPSolverOutput::PROXQP_SOLVED: return Status::solved;
    case QPSolverOutput::PROXQP_MAX_ITER_REACHED: return Status::iteration_limit;
    case QPSolverOutput::PROXQP_PRIMAL_INFEASIBLE: return Status::infeasible;
    case QPSolverOutput::PROXQP_DUAL_INFEASIBLE: return Status::unbounded;
    default: return Status::internal_error;
    }
}

class ProxQp final : public Solver {
  public:
    ProxQp(int variables, int constraints, const Options& options)
        : data_(variables, constraints, options),
          // The other backend ends at points that are not optimal, with the status "solved".
          qp_(variables, 0, constraints, true, proxqp::DenseBackend::PrimalLDLT), z_(variables + constraints),
          direction_(variables) {
        auto& settings = qp_.settings;
        settings.eps_abs = options.tolerance;
        settings.check_duality_gap = true;
        settings.eps_duality_gap_abs = options.tolerance;
        settings.eps_primal_inf = settings.eps_dual_inf =
            1e-8; // the default finds feasible problems infeasible
        settings.max_iter = options.max_iterations;
    }

    Result solve(const Problem& problem, Eigen::Ref<Eigen::VectorXd> x) noexcept override {
        Result result = data_.load(problem, x.size());
        if (result.status != Status::solved) {
            return result;
        }
        if (!data_.is_convex()) { // of such a problem it finds a saddle, as solved
            result.status = Status::internal_error;
            return result;
        }
        // ProxQP takes 1e20 as infinite; an objective of such numbers is solved in smaller units.
        data_.lower = data_.lower.cwiseMax(-infinity);
        data_.upper = data_.upper.cwiseMin(infinity);
        const double size = std::max(data_.H.cwiseAbs().maxCoeff(), data_.g.cwiseAbs().maxCoeff());
        const double unit = size > infinity ? size : 1.0;
        data_.H /= unit;
        data_.g /= unit;
        const bool was_warm = warm_;
        run(result);
        if (was_warm && result.status != Status::solved) {
            warm_ = false;
            run(result);
        }
        warm_ = result.status == Status::solved;
        if (warm_) {
            x = qp_.results.x;
            result.objective = unit * data_.objective(qp_.results.x);
        } else if (result.status == Status::iteration_limit) {
            if (descends_for_ever())
                result.status = Status::unbounded;
            else if (contradicts())
                result.status = Status::infeasible;
        }
        return result;
    }

    void reset() noexcept override { warm_ = false; }

    // A warm start takes x, the multipliers and the proximal parameters over.
    int state_size() const noexcept override { return 4 + 2 * data_.n + data_.m; }
    void save(double* state) const noexcept override {
        const auto& from = qp_.results;
        for (const double value : {double(warm_), from.info.rho, from.info.mu_in, from.info.mu_in_inv}) {
            *state++ = value;
        }
        state = std::copy_n(from.x.data(), data_.n, state);
        std::copy_n(from.z.data(), data_.n + data_.m, state);
    }
    void restore(const double* state) noexcept override {
        auto& to = qp_.results;
        warm_ = *state++ != 0.0;
        for (double* value : {&to.info.rho, &to.info.mu_in, &to.info.mu_in_inv}) {
            *value = *state++;
        }
        std::copy_n(state, data_.n, to.x.data());
        std::copy_n(state + data_.n, data_.n + data_.m, to.z.data());
    }

  private:
    void run(Result& result) noexcept {
        using Guess = proxqp::InitialGuessStatus;
        qp_.settings.initial_guess = warm_ ? Guess::WARM_START_WITH_PREVIOUS_RESULT : Guess::NO_INITIAL_GUESS;
        qp_.work.refactorize = warm_; // otherwise it goes on with the factors of the former problem
        try {
            qp_.init(data_.H, data_.g, {}, {}, data_.A, data_.lower.tail(data_.m), data_.upper.tail(data_.m),
                     data_.lower.head(data_.n), data_.upper.head(data_.n));
            qp_.solve();
        } catch (...) {
            result.status = Status::internal_error;
            return;
        }
        const auto& info = qp_.results.info;
        result.status = qp_.results.x.allFinite() ? status_of(info.status) : Status::internal_error;
        result.iterations += static_cast<int>(info.iter);
    }

    /// Farkas: multipliers r with Aᵀr_A + r_x = 0 and a negative sum of bounds times multipliers. Where the
    /// violations r are least, but not zero, they are such multipliers.
    bool contradicts() {
        const auto& x = qp_.results.x;
        if (!x.allFinite()) return false;
        z_.head(data_.n) = x;
        z_.tail(data_.m).noalias() = data_.A * x;
        z_ -= z_.cwiseMax(data_.lower).cwiseMin(data_.upper);
        const double worst = z_.cwiseAbs().maxCoeff();
        direction_ = z_.head(data_.n);
        direction_.noalias() += data_.A.transpose() * z_.tail(data_.m);
        return worst > 10.0 * data_.tolerance &&
               direction_.cwiseAbs().maxCoeff() <= certain * worst * steepest();
    }
    double steepest() const { return data_.m > 0 ? std::max(1.0, data_.A.cwiseAbs().maxCoeff()) : 1.0; }

    /// Along d = x/|x| the objective falls with slope gᵀd, H d vanishes and no bound is in the way: x of a
    /// problem without a minimum grows along such a d.
    bool descends_for_ever() {
        const auto& x = qp_.results.x;
        const double longest = x.cwiseAbs().maxCoeff();
        if (!(longest > 1.0 && std::isfinite(longest))) return false;
        direction_ = x / longest;
        z_.head(data_.n) = direction_;
        z_.tail(data_.m).noalias() = data_.A * direction_;
        for (int i = 0; i < data_.n + data_.m; ++i) {
            const double within = certain * (i < data_.n ? 1.0 : steepest());
            if (z_[i] > within && data_.upper[i] < infinity) return false;
            if (z_[i] < -within && data_.lower[i] > -infinity) return false;
        }
        const double curvature = (data_.H * direction_).cwiseAbs().maxCoeff();
        return curvature <= certain * data_.H.cwiseAbs().maxCoeff() &&
               data_.g.dot(direction_) < -certain * data_.g.cwiseAbs().maxCoeff();
    }

    static constexpr double infinity = 1e20;
    static constexpr double certain = 1e-6; ///< what certificates may be wrong by, relatively

    Data data_;
    proxqp::dense::QP<double> qp_;
    Eigen::VectorXd z_, direction_;
    bool warm_ = false;
};

} // namespace

std::unique_ptr<Solver> make_proxqp(int variables, int constraints, const Options& options) {
    return std::make_unique<ProxQp>(variables, constraints, options);
}

} // namespace bf::qp
