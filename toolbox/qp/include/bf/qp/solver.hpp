#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <string>

/// Dense convex quadratic programs of fixed size, solved once per control step.
namespace bf::qp {

/// Outcome of a solve; the numbers are those of qpOASES' simple status.
enum class Status : int {
    solved = 0,
    iteration_limit = 1,
    internal_error = -1,
    infeasible = -2,
    unbounded = -3,
};

/// A quantity of a problem, to name the one that is at fault.
enum class Term { none, H, g, A, lbA, ubA, lb, ub, x };

/// What a solve did. `describe` turns it into text, outside the control step.
struct Result {
    Status status = Status::solved;
    int iterations = 0; ///< working-set changes (DAQP, qpOASES), inner Newton steps (ProxQP) or steps (OSQP)
    /// ½ xᵀHx + gᵀx at the x that was written; NaN when none was.
    double objective = std::numeric_limits<double>::quiet_NaN();
    /// OSQP's own number of the outcome: 1 solved, 2 solved inaccurately, 3 and 4 infeasible and unbounded by
    /// inaccurate certificates, −2 iteration limit, −3 infeasible, −4 unbounded, −7 non-convex, −10 not tried
    /// because an input is at fault. 0 of the other solvers.
    int osqp_status = 0;

    /// The input at fault: none, or a non-finite entry (row, column from 0; column −1 in vectors), or bounds
    /// that leave no value between them (`term` is the lower one), or, with row −1, a quantity of wrong size.
    Term term = Term::none;
    int row = -1;
    int column = -1;
    double value = 0.0; ///< the entry at fault
    double other = 0.0; ///< the upper bound, when bounds are at fault
};

/// Says what happened, which entry is at fault (counted from 1, as in MATLAB) and what to do. Allocates.
std::string describe(const Result& result);

/// Numbers of the caller, seen where they are: a matrix, vector, map or block by columns. Unlike an
/// Eigen::Ref it never holds a copy, so it takes no expression that has yet to be computed.
template <class Plain> class View : public Eigen::Map<const Plain, 0, Eigen::OuterStride<>> {
    using Base = Eigen::Map<const Plain, 0, Eigen::OuterStride<>>;

  public:
    View() : Base(nullptr, 0, Plain::ColsAtCompileTime == 1, Eigen::OuterStride<>(0)) {}
    template <class Numbers>
    requires(bool(Numbers::Flags& Eigen::DirectAccessBit) && Numbers::InnerStrideAtCompileTime == 1 &&
             !Numbers::IsRowMajor) View(const Eigen::DenseBase<Numbers>& numbers)
        : Base(numbers.derived().data(), numbers.rows(), numbers.cols(),
               Eigen::OuterStride<>(numbers.derived().outerStride())) {}
};

/// min ½ xᵀHx + gᵀx subject to lbA ≤ Ax ≤ ubA, lb ≤ x ≤ ub, with x ∈ ℝⁿ and A having m rows.
///
/// All matrices are column-major and are only looked at, never kept. A bound of size 0 is absent, ±inf is no
/// bound, equal bounds make an equality. With m = 0, A may be left out. Only the symmetric part of H counts.
struct Problem {
    using Matrix = View<Eigen::MatrixXd>;
    using Vector = View<Eigen::VectorXd>;

    Matrix H;        ///< n × n, positive semidefinite
    Vector g;        ///< n
    Matrix A = {};   ///< m × n
    Vector lbA = {}; ///< m
    Vector ubA = {}; ///< m
    Vector lb = {};  ///< n
    Vector ub = {};  ///< n
};

struct Options {
    /// Most working-set changes (DAQP, the cold retry included) or outer iterations (ProxQP) of one solve.
    int max_iterations = 1000;
    /// Largest violation of a constraint, in its units; ProxQP holds the gradient of the Lagrangian to it
    /// too. Bounds that cross by no more than this are an equality.
    double tolerance = 1e-6;

    /// Throws std::invalid_argument naming the option that is out of range.
    void validate() const;
};

struct OsqpOptions : Options {
    bool adaptive_rho = false; ///< the step size is adapted every 25 iterations, and kept for the next solve
    bool polish = false;       ///< a solution is refined by its active constraints; allocates
    bool has_bounds = true;    ///< false: problems never have lb or ub
};

/// Solves problems of one size, each starting from the solution of the one before.
class Solver {
  public:
    virtual ~Solver() = default;

    /// Solves `problem` and writes x (n); x stays as it was unless the status is `solved` (OSQP also writes
    /// where its iterations ended at their limit).
    /// Wrong sizes and non-finite data are `internal_error`. Whether it allocates, its maker says.
    virtual Result solve(const Problem& problem, Eigen::Ref<Eigen::VectorXd> x) noexcept = 0;

    /// Forgets the previous solution: the next solve is what a new solver would do, bit for bit.
    virtual void reset() noexcept = 0;

    /// Number of doubles of a saved state.
    virtual int state_size() const noexcept = 0;
    /// Writes what the next solve starts from to `state` (state_size() doubles).
    virtual void save(double* state) const noexcept = 0;
    /// Continues, bit for bit, from a state that a solver of the same method, size and options saved.
    virtual void restore(const double* state) noexcept = 0;
};

/// DAQP, a dual active-set method: exact, a few microseconds for a dozen variables, the one to use.
///
/// Solving never allocates. It continues from the previous active set, and starts over once, within the same
/// solve, when that fails. A singular H is handled by proximal-point iterations that end at a solution of the
/// given problem (H is not altered). An indefinite H is an `internal_error`, if its negative curvature is
/// above 1e-5 of its largest diagonal entry. Throws std::invalid_argument unless variables ≥ 1 and
/// constraints ≥ 0.
std::unique_ptr<Solver> make_daqp(int variables, int constraints, const Options& options = {});

/// ProxQP, a proximal augmented Lagrangian method: the independent second opinion, some ten times slower.
///
/// It allocates while it solves, so it does not belong into a hard real-time step. Where its iterations end
/// at their limit, certificates tell problems that are infeasible or unbounded; without a certificate, as of
/// many infeasible ones, it stays an `iteration_limit`. An indefinite H is an `internal_error`, as of DAQP.
/// It continues from the previous x and multipliers, and starts over once, with all iterations again, when
/// that fails. Throws std::invalid_argument unless variables ≥ 1 and constraints ≥ 0.
std::unique_ptr<Solver> make_proxqp(int variables, int constraints, const Options& options = {});

/// qpOASES, a parametric active-set method: exact. It allocates while it solves.
///
/// Each solve begins at the solution and working set of the one before; when that fails for another reason
/// than the limit of iterations, it begins anew with the iterations that are left. Its default options
/// neither regularise a singular H nor, then, tell a minimum along a line or plane from none at all: what
/// they end at without a minimum is solved by proximal-point iterations, which find it if there is one. An
/// indefinite H is not detected in general. The limit of iterations is one of working-set changes. Source: H.
/// J. Ferreau et al., qpOASES: a parametric active-set algorithm for quadratic programming, 2014. Throws
/// std::invalid_argument unless variables ≥ 1 and constraints ≥ 0.
std::unique_ptr<Solver> make_qpoases(int variables, int constraints, const Options& options = {});

/// OSQP, an operator-splitting method of first order: approximate, `tolerance` is its absolute and relative
/// one (1e-3 is its own default). Allocates nothing unless it polishes.
///
/// Each solve begins at x and multipliers of the one before. Whether it ends is looked at every 25
/// iterations. Source: B. Stellato et al., OSQP: an operator splitting solver for quadratic programs, 2020.
/// Throws std::invalid_argument unless variables ≥ 1 and constraints ≥ 0.
std::unique_ptr<Solver> make_osqp(int variables, int constraints, const OsqpOptions& options = {});

} // namespace bf::qp
