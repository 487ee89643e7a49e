// The methods that integrate continuous states.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <utility>

namespace bf {

/// Explicit Runge-Kutta methods with a fixed step. Sources: Hairer, Nørsett, Wanner, Solving Ordinary
/// Differential Equations I, 2nd ed., §II.1 (Euler, Heun, the classical method) and §II.5 (Dormand-Prince);
/// Bogacki, Shampine, A 3(2) pair of Runge-Kutta formulas, 1989.
enum class SolverMethod { euler, heun, bogacki_shampine, rk4, dormand_prince };

inline constexpr std::array<std::pair<std::string_view, SolverMethod>, 5> solver_methods{
    {{"euler", SolverMethod::euler},
     {"heun", SolverMethod::heun},
     {"bogacki_shampine", SolverMethod::bogacki_shampine},
     {"rk4", SolverMethod::rk4},
     {"dormand_prince", SolverMethod::dormand_prince}}};

/// The method of that name, or nothing.
constexpr std::optional<SolverMethod> solver_method(std::string_view name) {
    for (const auto& [known, method] : solver_methods)
        if (name == known) return method;
    return std::nullopt;
}

} // namespace bf
