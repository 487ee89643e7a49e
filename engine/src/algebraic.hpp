// Solution of algebraic loops.
#pragma once

#include "bf/core/status.hpp"

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace bf {

/// Solves y = f(y), where evaluating reads the unknowns y from memory and writes f(y) over them. Newton's
/// method of KINSOL (Hindmarsh et al., SUNDIALS, ACM TOMS 31, 2005) with a Jacobian by differences, from the
/// last solution on.
class AlgebraicSolver {
  public:
    AlgebraicSolver(std::vector<std::span<double>> unknowns, std::function<bool()> evaluate);
    ~AlgebraicSolver();
    /// The unknowns and all signals of the loop agree afterwards. False: a block failed, or `failure` says
    /// why.
    bool solve();
    Status failure() const { return failure_; }

  private:
    struct Kinsol;
    std::unique_ptr<Kinsol> kinsol_;
    Status failure_;
};

} // namespace bf
