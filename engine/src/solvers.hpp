// The solvers by family.
#pragma once

#include "bf/engine/solver.hpp"

namespace bf {

std::unique_ptr<Solver> make_fixed_step_solver(SolverMethod method, double step, ContinuousSystem system);
std::unique_ptr<Solver> make_dormand_prince(const SolverSettings& settings, ContinuousSystem system);
std::unique_ptr<Solver> make_cvode(const SolverSettings& settings, ContinuousSystem system);

} // namespace bf
