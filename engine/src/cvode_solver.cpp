#include "solvers.hpp"
#include "sundials.hpp"

#include <algorithm>
#include <cmath>
#include <cvode/cvode.h>
#include <limits>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <utility>

namespace bf {

namespace {

struct FreeMemory {
    void operator()(void* memory) const { CVodeFree(&memory); }
};

/// CVODE of SUNDIALS. Linear systems: dense up to `largest_dense` states, then GMRES without a matrix.
class Cvode final : public Solver {
  public:
    static constexpr std::size_t largest_dense = 300;

    Cvode(const SolverSettings& settings, ContinuousSystem system)
        : Solver(std::move(system)), settings_(settings) {
        SUNContext context = context_.get();
        const auto n = static_cast<sunindextype>(system_.x.size());
        x_.reset(N_VNew_Serial(n, context));
        errors_.reset(N_VNew_Serial(n, context));
        weights_.reset(N_VNew_Serial(n, context));
        memory_.reset(CVodeCreate(settings.method == SolverMethod::cvode_bdf ? CV_BDF : CV_ADAMS, context));
        std::copy(system_.x.begin(), system_.x.end(), N_VGetArrayPointer(x_.get()));
        CVodeSetErrHandlerFn(
            memory_.get(), [](int, const char*, const char*, char*, void*) {}, nullptr);
        CVodeInit(memory_.get(), derivative, 0, x_.get());
        CVodeSetUserData(memory_.get(), this);
        CVodeSStolerances(memory_.get(), settings.relative_tolerance, settings.absolute_tolerance);
        CVodeSetMaxNumSteps(memory_.get(), most_steps);
        // A jump that lies just ahead lets steps fail until they end before it: at most down to the rounding
        // of the time, each being a fourth of the one before, or a fifth.
        CVodeSetMaxConvFails(memory_.get(), 30);
        CVodeSetMaxErrTestFails(memory_.get(), 30);
        if (settings.max_step < std::numeric_limits<double>::infinity())
            CVodeSetMaxStep(memory_.get(), settings.max_step);
        if (system_.x.size() <= largest_dense) {
            matrix_.reset(SUNDenseMatrix(n, n, context));
            linear_.reset(SUNLinSol_Dense(x_.get(), matrix_.get(), context));
        } else {
            linear_.reset(SUNLinSol_SPGMR(x_.get(), SUN_PREC_NONE, 0, context));
        }
        CVodeSetLinearSolver(memory_.get(), linear_.get(), matrix_.get());
        CVodeSetNoInactiveRootWarn(memory_.get());
        roots_.resize(system_.guards.size());
        guards_at_base_.resize(system_.guards.size());
        if (roots_.empty()) return;
        // CVODE's own difference quotients would reach across jumps of the derivative, and Newton's iteration
        // stands still where it takes such a jump for a slope.
        if (matrix_)
            CVodeSetJacFn(memory_.get(), jacobian);
        else
            CVodeSetJacTimes(memory_.get(), begin_products, product);
    }

    void restart(double t) override {
        std::copy(system_.x.begin(), system_.x.end(), N_VGetArrayPointer(x_.get()));
        // Short at first behind a crossing, and soon longer, so that a guard that comes back at once is seen.
        const double first_step = std::exchange(first_step_, 0);
        CVodeSetInitStep(memory_.get(), first_step);
        CVodeSetEtaMaxFirstStep(memory_.get(), first_step > 0 ? 10 : 0);
        CVodeReInit(memory_.get(), t, x_.get());
        if (roots_.empty()) return;
        CVodeRootInit(memory_.get(), 0, nullptr); // which guards it had put aside is forgotten only so
        CVodeRootInit(memory_.get(), static_cast<int>(roots_.size()), guards);
    }
    /// To begin anew with small steps would cost far more than the little that changed.
    void resume(double) override {}
    /// CVODE cannot hand out its past.
    void set_history(double t, std::span<const double>) override {
        first_step_ = 0;
        restart(t);
    }

    Outcome advance(double& t, double end) override {
        if (end - t < 2 * epsilon * end) { // after an event: the first step is left to the next advance
            t = end;
            return Outcome::reached;
        }
        if (system_.has_samples) CVodeSetStopTime(memory_.get(), end);
        for (int retries = 0;; ++retries) {
            double reached = t;
            const int flag = CVode(memory_.get(), end, x_.get(), &reached, CV_NORMAL);
            load(x_.get());
            if (flag < 0) {
                t = reached;
                return failed(flag);
            }
            if (flag != CV_ROOT_RETURN) {
                t = end;
                return Outcome::reached;
            }
            const double begin = std::max(t, begin_of_last_step());
            reached = std::max(t, reached); // a root at the start may be found a rounding error before it
            CVodeGetRootInfo(memory_.get(), roots_.data());
            first_step_ = 1e3 * epsilon * reached;
            if (retries < most_retries && reached - begin > first_step_) {
                if (!go_straight(reached, 0.01 * (reached - begin))) return Outcome::failed;
                if (!crosses()) {
                    interpolate(begin);
                    restart(t = begin);
                    continue;
                }
                load(x_.get());
            }
            t = reached;
            std::transform(roots_.begin(), roots_.end(), crossings_.begin(),
                           [](int direction) { return static_cast<std::int8_t>(direction); });
            return Outcome::crossed;
        }
    }

  private:
    static constexpr double epsilon = std::numeric_limits<double>::epsilon();
    static constexpr int most_retries = 100; ///< of a step with a doubtful crossing

    static int derivative(double t, N_Vector x, N_Vector rate, void* self) {
        auto& solver = *static_cast<Cvode*>(self);
        auto& system = solver.system_;
        solver.load(x);
        if (!system.derivatives(t)) return -1;
        std::copy(system.rate.begin(), system.rate.end(), N_VGetArrayPointer(rate));
        return 0;
    }
    static int guards(double t, N_Vector x, double* values, void* self) {
        auto& solver = *static_cast<Cvode*>(self);
        auto& system = solver.system_;
        solver.load(x);
        if (!system.evaluate_guards(t, false)) return -1;
        std::copy(system.guards.begin(), system.guards.end(), values);
        return 0;
    }

    /// Remembers on which side of its guards the system is at x.
    bool begin_differences(double t, N_Vector x) {
        load(x);
        if (!system_.evaluate_guards(t, false)) return false;
        std::copy(system_.guards.begin(), system_.guards.end(), guards_at_base_.begin());
        return true;
    }
    /// result := (f(x + moved) - f(x)) / length, backwards where a guard is crossed, and 0 where guards are
    /// crossed on both sides. Where a guard is not looked at, a state may slide along its jump: of both sides
    /// the one where f changes less counts. `move(s)` puts x + s moved into the system's memory.
    template <class Move>
    bool difference(double t, const double* rate, double length, double* result, const Move& move) {
        const std::size_t n = system_.x.size();
        const bool is_doubtful = std::any_of(guards_at_base_.begin(), guards_at_base_.end(),
                                             [](double guard) { return std::isnan(guard); });
        bool is_known = false;
        for (const double sign : {1.0, -1.0}) {
            move(sign);
            if (!system_.derivatives(t) || !system_.evaluate_guards(t, true)) return false;
            if (has_crossed()) continue;
            for (std::size_t i = 0; i < n; ++i) {
                const double slope = (system_.rate[i] - rate[i]) / (sign * length);
                if (!is_known || std::abs(slope) < std::abs(result[i])) result[i] = slope;
            }
            is_known = true;
            if (!is_doubtful) break;
        }
        if (!is_known) std::fill_n(result, n, 0.0);
        return true;
    }
    bool has_crossed() const {
        for (std::size_t i = 0; i < guards_at_base_.size(); ++i)
            if (crossing(guards_at_base_[i], system_.guards[i]) != 0) return true;
        return false;
    }
    /// Increments as CVODE's own (cvode_ls.c, cvLsDenseDQJac; Hindmarsh and others, User Documentation for
    /// CVODE, §2.3).
    static int jacobian(double t, N_Vector x, N_Vector rate, SUNMatrix matrix, void* self, N_Vector weights,
                        N_Vector, N_Vector) {
        auto& solver = *static_cast<Cvode*>(self);
        double h = 0;
        CVodeGetErrWeights(solver.memory_.get(), weights);
        CVodeGetCurrentStep(solver.memory_.get(), &h);
        const double norm = N_VWrmsNorm(rate, weights);
        const auto n = static_cast<double>(solver.system_.x.size());
        const double least = norm > 0 ? 1000 * std::abs(h) * epsilon * n * norm : 1;
        if (!solver.begin_differences(t, x)) return -1;
        const double *begin = N_VGetArrayPointer(x), *weight = N_VGetArrayPointer(weights);
        for (std::size_t j = 0; j < solver.system_.x.size(); ++j) {
            const double length = std::max(std::sqrt(epsilon) * std::abs(begin[j]), least / weight[j]);
            const auto move = [&](double sign) {
                solver.load(x);
                solver.system_.x[j] += sign * length;
            };
            if (!solver.difference(t, N_VGetArrayPointer(rate), length,
                                   SUNDenseMatrix_Column(matrix, static_cast<sunindextype>(j)), move))
                return -1;
        }
        return 0;
    }
    static int begin_products(double t, N_Vector x, N_Vector, void* self) {
        return static_cast<Cvode*>(self)->begin_differences(t, x) ? 0 : -1;
    }
    /// Jacobian times v, with a step to x as long as the tolerances are.
    static int product(N_Vector v, N_Vector result, double t, N_Vector x, N_Vector rate, void* self,
                       N_Vector weights) {
        auto& solver = *static_cast<Cvode*>(self);
        CVodeGetErrWeights(solver.memory_.get(), weights);
        const double length = 1 / N_VWrmsNorm(v, weights);
        const double* along = N_VGetArrayPointer(v);
        const auto move = [&](double sign) {
            solver.load(x);
            for (std::size_t i = 0; i < solver.system_.x.size(); ++i)
                solver.system_.x[i] += sign * length * along[i];
        };
        return solver.difference(t, N_VGetArrayPointer(rate), length, N_VGetArrayPointer(result), move) ? 0
                                                                                                        : -1;
    }

    void load(N_Vector x) { std::copy_n(N_VGetArrayPointer(x), system_.x.size(), system_.x.begin()); }
    /// The state at a time of the last step, in the system's memory.
    void interpolate(double t) {
        CVodeGetDky(memory_.get(), t, 0, errors_.get());
        load(errors_.get());
    }
    double begin_of_last_step() const {
        double now = 0, length = 0;
        CVodeGetCurrentTime(memory_.get(), &now);
        CVodeGetLastStep(memory_.get(), &length);
        return now - length;
    }
    /// The guards at t + h, on the tangent of the state at t - h.
    bool go_straight(double t, double h) {
        interpolate(t - h);
        if (!system_.derivatives(t - h)) return false;
        for (std::size_t i = 0; i < system_.x.size(); ++i) system_.x[i] += 2 * h * system_.rate[i];
        return system_.evaluate_guards(t + h, false);
    }
    /// Does the tangent cross where the interpolation does? Where it leads away, or is less than half as
    /// steep, the guard is so near zero that the tolerance allows for either side.
    bool crosses() const {
        for (std::size_t i = 0; i < roots_.size(); ++i)
            if (roots_[i] * system_.guards[i] < 0) return false;
        return true;
    }

    Outcome failed(int flag) {
        if (flag == CV_RHSFUNC_FAIL || flag == CV_RTFUNC_FAIL) return Outcome::failed; // a block said why
        failure_ = flag == CV_TOO_MUCH_WORK
                       ? too_many_steps(settings_.method)
                       : Status::failure(
                             "CVODE gave up (flag {}): look for a state that grows without bound or a jump "
                             "without a zero crossing, or use larger tolerances",
                             flag);
        if (CVodeGetEstLocalErrors(memory_.get(), errors_.get()) == CV_SUCCESS &&
            CVodeGetErrWeights(memory_.get(), weights_.get()) == CV_SUCCESS) {
            const double *error = N_VGetArrayPointer(errors_.get()),
                         *weight = N_VGetArrayPointer(weights_.get());
            double worst = -1;
            for (std::size_t i = 0; i < system_.x.size(); ++i)
                if (const double e = std::abs(error[i] * weight[i]); !(e <= worst)) {
                    worst = e;
                    worst_state_ = static_cast<int>(i);
                }
        }
        return Outcome::failed;
    }

    const SolverSettings settings_;
    Owned<SUNContext, free_context> context_ = make_context();
    Owned<N_Vector, N_VDestroy> x_, errors_, weights_;
    Owned<SUNMatrix, SUNMatDestroy> matrix_;
    Owned<SUNLinearSolver, SUNLinSolFree> linear_;
    std::unique_ptr<void, FreeMemory> memory_;
    std::vector<int> roots_;
    std::vector<double> guards_at_base_; ///< where difference quotients begin
    double first_step_ = 0;              ///< after the next restart; 0: CVODE finds one
};

} // namespace

std::unique_ptr<Solver> make_cvode(const SolverSettings& settings, ContinuousSystem system) {
    return std::make_unique<Cvode>(settings, std::move(system));
}

} // namespace bf
