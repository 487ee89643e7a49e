// Integration of continuous states over one step.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace bf {

/// Explicit Runge-Kutta methods with a fixed step. Sources: Hairer, Nørsett, Wanner, Solving Ordinary
/// Differential Equations I, 2nd ed., §II.1 (Euler, Heun, the classical method) and §II.5 (Dormand-Prince);
/// Bogacki, Shampine, A 3(2) pair of Runge-Kutta formulas, 1989.
enum class SolverMethod { euler, heun, bogacki_shampine, rk4, dormand_prince };

/// The method of that name: euler, heun, bogacki_shampine, rk4, dormand_prince.
std::optional<SolverMethod> solver_method(std::string_view name);
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
