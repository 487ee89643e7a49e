// The solvers by family.
#pragma once

#include "bf/engine/solver.hpp"

namespace bf {

std::unique_ptr<Solver> make_fixed_step_solver(SolverMethod method, double step, ContinuousSystem system);
std::unique_ptr<Solver> make_dormand_prince(const SolverSettings& settings, ContinuousSystem system);
std::unique_ptr<Solver> make_cvode(const SolverSettings& settings, ContinuousSystem system);

constexpr int most_steps = 1000000; ///< of an adaptive solver in one base step
inline Status too_many_steps(SolverMethod method) {
    return method == SolverMethod::cvode_bdf
               ? Status::failure("the solver did not reach the end of the base step in a million steps: use "
                                 "larger tolerances, or a smaller step")
               : Status::failure("the solver did not reach the end of the base step in a million steps: use "
                                 "larger tolerances, or cvode_bdf if the plant is stiff");
}

} // namespace bf
