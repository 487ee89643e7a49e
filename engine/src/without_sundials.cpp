// What a build without SUNDIALS says (BF_SUNDIALS).
#include "algebraic.hpp"
#include "solvers.hpp"

#include <stdexcept>

namespace bf {

std::unique_ptr<Solver> make_cvode(const SolverSettings&, ContinuousSystem) {
    throw std::runtime_error("cvode_bdf and cvode_adams are missing, as bf was built without SUNDIALS: "
                             "choose dormand_prince45, or build with BF_SUNDIALS=ON");
}

struct AlgebraicSolver::Kinsol {};

AlgebraicSolver::AlgebraicSolver(std::vector<std::span<double>>, std::function<bool()>) {
    throw std::runtime_error("it stands in an algebraic loop, and bf was built without SUNDIALS: break the "
                             "loop with a UnitDelay, or build with BF_SUNDIALS=ON");
}
AlgebraicSolver::~AlgebraicSolver() = default;
bool AlgebraicSolver::solve() { return false; }

} // namespace bf
