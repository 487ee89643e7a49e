#pragma once

#include "bf/qp/solver.hpp"

#include <vector>

namespace bf::qp {

/// min ½ |u|² subject to lower ≤ G u ≤ upper, by DAQP, for any number of variables and rows up to those that
/// it was made for. Solving never allocates.
class LeastDistance {
  public:
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

    LeastDistance(int variables, int rows, const Options& options);
    ~LeastDistance();
    LeastDistance(LeastDistance&&) noexcept;

    /// G (rows × variables, one row after the other) and its bounds are not altered. `active` (rows) is where
    /// the search begins and afterwards what it found: 0 not active, 1 at the upper, -1 at the lower bound. u
    /// (variables) is the solution when the status is `solved`. `iterations` grows by the changes of the
    /// active set, of which there are at most `most`. `again`: only the bounds are others than in the last
    /// call.
    Status solve(int variables, int rows, const double* G, const double* lower, const double* upper,
                 signed char* active, double* u, int& iterations, int most, bool again = false) noexcept;

  private:
    struct Workspace;
    std::unique_ptr<Workspace> work_;
};

} // namespace bf::qp
