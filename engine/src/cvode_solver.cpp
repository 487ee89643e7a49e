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
    double first_step_ = 0; ///< after the next restart; 0: CVODE finds one
};

} // namespace

std::unique_ptr<Solver> make_cvode(const SolverSettings& settings, ContinuousSystem system) {
    return std::make_unique<Cvode>(settings, std::move(system));
}

} // namespace bf
