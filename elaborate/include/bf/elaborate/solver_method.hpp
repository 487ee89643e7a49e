// The methods that integrate continuous states.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

namespace bf {

/// Explicit Runge-Kutta methods with a fixed step, then adaptive methods. Sources: Hairer, Nørsett, Wanner,
/// Solving Ordinary Differential Equations I, 2nd ed., §II.1 (Euler, Heun, the classical method), §II.5
/// (Dormand-Prince) and §II.6 (its dense output); Bogacki, Shampine, A 3(2) pair of Runge-Kutta formulas,
/// 1989; Hindmarsh et al., SUNDIALS, ACM TOMS 31, 2005 (CVODE: backward differentiation formulas for stiff,
/// Adams-Moulton for smooth plants).
enum class SolverMethod {
    euler,
    heun,
    bogacki_shampine,
    rk4,
    dormand_prince,
    dormand_prince45,
    cvode_bdf,
    cvode_adams
};

inline constexpr std::array<std::pair<std::string_view, SolverMethod>, 8> solver_methods{
    {{"euler", SolverMethod::euler},
     {"heun", SolverMethod::heun},
     {"bogacki_shampine", SolverMethod::bogacki_shampine},
     {"rk4", SolverMethod::rk4},
     {"dormand_prince", SolverMethod::dormand_prince},
     {"dormand_prince45", SolverMethod::dormand_prince45},
     {"cvode_bdf", SolverMethod::cvode_bdf},
     {"cvode_adams", SolverMethod::cvode_adams}}};

/// The method of that name, or nothing.
constexpr std::optional<SolverMethod> solver_method(std::string_view name) {
    for (const auto& [known, method] : solver_methods)
        if (name == known) return method;
    return std::nullopt;
}

/// Does the method choose its own steps and locate zero crossings inside a base step?
constexpr bool is_adaptive(SolverMethod method) { return method >= SolverMethod::dormand_prince45; }

/// How continuous states are integrated. The tolerances hold per element:
/// |error| <= absolute_tolerance + relative_tolerance |x|; fixed-step methods use none of them.
struct SolverSettings {
    SolverMethod method = SolverMethod::rk4;
    double relative_tolerance = 1e-6;
    double absolute_tolerance = 1e-9;
    double max_step = std::numeric_limits<double>::infinity(); ///< s
};

} // namespace bf
