#pragma once

#include <bf/qp/solver.hpp>

#include <vector>

namespace bf::qp {

/// Strict priorities: of all x that satisfy the hard rows, those that violate the rows of level 1 least; of
/// these, those that violate level 2 least, and so on; and of what is left the x of least |x|.
///
/// A row asks for lower ≤ a x ≤ upper (equal bounds: a x = b), and a level costs ½ Σ weight · violation².
/// Level 0 is hard. A task of a lower level has no influence at all on those above.
///
/// The method: an orthonormal basis Z of the directions that the levels so far leave free (B. Siciliano,
/// J.-J. Slotine, A general framework for managing multiple tasks in highly redundant robotic systems, 1991),
/// and in each level a quadratic program in Z under the inequalities of this and all former levels, which may
/// not be violated more than they are (O. Kanoun, F. Lamiraux, P.-B. Wieber, Kinematic control of redundant
/// manipulators: generalizing the task-priority framework to inequality task, 2011). Equalities are
/// triangularised by Householder reflections with pivoting, which finds those that depend on others; where
/// the least-squares solution violates no inequality, no program is solved; otherwise DAQP begins with the
/// active rows of the last solve. Products with rows pass over the zeros that they begin and end with.
///
/// All memory is allocated by the constructor. Not for concurrent use.
class Hierarchy {
  public:
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

    /// Of matrix entries and weights: squares of their products are numbers still. What is below its inverse
    /// counts as nothing beside it.
    static constexpr double largest_entry = 1e100;

    struct Options {
        int max_iterations = 1000; ///< most changes of active sets in one solve, all levels together
        /// Largest violation of a row that can be satisfied, in its units.
        double tolerance = 1e-8;
        /// A row of a soft level depends on those before it, and asks nothing, when what is left of it in the
        /// free directions is shorter than this part of it.
        double rank_tolerance = 1e-7;
        /// Throws std::invalid_argument naming the option that is out of range.
        void validate() const;
    };

    /// What is wrong with the data.
    enum class Fault {
        none,
        matrix,    ///< an entry of a is not finite, or its magnitude above `largest_entry`
        bound,     ///< a bound is NaN, +inf from below or -inf from above
        weight,    ///< a weight is negative, not finite, or above `largest_entry`
        crossing,  ///< lower is above upper: `infeasible` of level 0, else an `internal_error`
        dependent, ///< a hard equality contradicts those before it
    };

    struct Result {
        /// `solved`; `infeasible`: the hard rows contradict each other; `iteration_limit`; `internal_error`:
        /// a fault of the data, or the solver broke down.
        Status status = Status::solved;
        int iterations = 0; ///< changes of active sets
        /// The levels whose violation is least, of all soft ones. When a level above 1 fails, x is the best
        /// of the levels before it.
        int levels = 0;
        Fault fault = Fault::none;
        int level = -1;  ///< where the fault is,
        int row = -1;    ///< from 0,
        int column = -1; ///< and of the matrix; -1: no single one
    };

    /// The rows of one level, to be written before each solve. Those of weight 0 and those without bounds are
    /// none.
    struct Rows {
        Eigen::Map<RowMajor> A;                   ///< rows × variables; zeros at first
        Eigen::Map<Eigen::VectorXd> lower, upper; ///< ±inf: none; zeros at first
        Eigen::Map<Eigen::VectorXd> weight; ///< at least 0, ones at first; of level 0: whether it counts
    };

    /// `rows[k]`: those of level k, the first being hard. Throws std::invalid_argument unless there is a
    /// variable, a level 0, and no negative number of rows.
    Hierarchy(int variables, std::vector<int> rows, const Options& options);
    ~Hierarchy();
    Hierarchy(Hierarchy&&) noexcept;

    Rows level(int k) noexcept;
    /// Number of soft levels.
    int levels() const noexcept;

    /// Writes x (variables), which stays as it was when no level was solved.
    Result solve(Eigen::Ref<Eigen::VectorXd> x) noexcept;

    /// Root of Σ weight · violation² of each soft level at the x of the last solve.
    const Eigen::VectorXd& violation() const noexcept;

    /// Forgets the active rows: the next solve is what a new object would do, bit for bit.
    void reset() noexcept;
    /// The active rows, as doubles, for snapshots.
    int state_size() const noexcept;
    void save(double* state) const noexcept;
    void restore(const double* state) noexcept;

  private:
    struct Content;
    std::unique_ptr<Content> content_;
};

} // namespace bf::qp
