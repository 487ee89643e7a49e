// Integration of continuous states, with zero crossings.
#pragma once

#include "bf/core/status.hpp"
#include "bf/elaborate/solver_method.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace bf {

/// Order of the global error of a fixed-step method: h^order.
int order(SolverMethod method);

/// What a solver integrates: x' = f(t, x), watched by zero-crossing functions g(t, x).
struct ContinuousSystem {
    std::span<double> x;            ///< read and written by the solver
    std::span<const double> rate;   ///< f, after `derivatives`
    std::span<const double> guards; ///< g, after `evaluate_guards`
    /// rate := f(t, x); false ends the run.
    std::function<bool(double t)> derivatives;
    /// guards := g(t, x); false ends the run. `is_current`: the last call of either kind was for the same t
    /// and x.
    std::function<bool(double t, bool is_current)> evaluate_guards;
    /// Something outside the system may change f at the end of each advance: steps end there.
    bool has_samples = false;
};

/// How a guard crossed zero between two values: +1 it rose, -1 it fell, 0 it did not. Leaving zero is no
/// crossing.
constexpr std::int8_t crossing(double before, double after) {
    return before < 0 && after >= 0   ? std::int8_t{1}
           : before > 0 && after <= 0 ? std::int8_t{-1}
                                      : std::int8_t{0};
}

/// Advances the states of a system. Allocates nothing after `restart`, except CVODE inside its library.
class Solver {
  public:
    enum class Outcome : std::uint8_t {
        reached, ///< x is the state at the end
        crossed, ///< x is the state at `t`, just behind the first crossings
        failed   ///< a block refused (then `failure` is ok), or the solver gave up: x is what it had at `t`
    };

    virtual ~Solver() = default;
    /// The state or its derivative has changed by a jump at t: what was known of the past counts no more.
    virtual void restart(double t) = 0;
    /// Blocks that remember the past have taken a sample at t: the derivative has changed a little.
    virtual void resume(double t) { restart(t); }
    /// From t to `end`, or to the first zero crossing before it.
    virtual Outcome advance(double& t, double end) = 0;

    /// Which guards crossed: +1, -1, 0 for each.
    std::span<const std::int8_t> crossings() const { return crossings_; }
    /// Why the solver gave up, and the element of x that it could not integrate (-1: none in particular).
    const Status& failure() const { return failure_; }
    int worst_state() const { return worst_state_; }

    /// The past that a run needs to go on bit for bit; a solver whose past cannot be saved restarts instead.
    /// An empty one is that of a new run.
    virtual std::vector<double> history() const { return {}; }
    virtual void set_history(double t, std::span<const double> history) = 0;

  protected:
    explicit Solver(ContinuousSystem system)
        : system_(std::move(system)), crossings_(system_.guards.size()) {}

    ContinuousSystem system_;
    std::vector<std::int8_t> crossings_;
    Status failure_;
    int worst_state_ = -1;
};

/// The solver of a fixed-step method, which takes steps of `step` seconds, or of an adaptive one.
std::unique_ptr<Solver> make_solver(const SolverSettings& settings, double step, ContinuousSystem system);

} // namespace bf
