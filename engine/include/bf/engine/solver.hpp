// Integration of continuous states over one step.
#pragma once

#include "bf/elaborate/solver_method.hpp"

#include <functional>
#include <span>
#include <vector>

namespace bf {

/// Order of the global error: h^order.
int order(SolverMethod method);

/// Advances x' = f(t, x). Allocates at construction only.
class FixedStepSolver {
  public:
    /// For `size` states.
    FixedStepSolver(SolverMethod method, std::size_t size);

    /// x(t) -> x(t + h). `derivative(t)` computes the derivative of what `x` holds into `rate`; it returns
    /// false when the model fails, which ends the step with x as it was at its begin.
    bool step(double t, double h, std::span<double> x, std::span<const double> rate,
              const std::function<bool(double t)>& derivative);

  private:
    SolverMethod method_;
    std::vector<double> start_;
    std::vector<std::vector<double>> slopes_;
};

} // namespace bf
