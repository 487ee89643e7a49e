#include "qp/qp_block.hpp"

#include "bf/core/changes.hpp"
#include "bf/core/differenced.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/qp/sensitivity.hpp"
#include "bf/qp/solver.hpp"

#include <cmath>
#include <optional>

namespace bf::toolbox {

namespace {

/// min ½ xᵀHx + gᵀx subject to lbA ≤ Ax ≤ ubA, lb ≤ x ≤ ub: ports and rules of all QP blocks, which differ in
/// their solvers and numbers of outcomes.
class QuadraticProgram : public Block, public Differentiable, public WarmStarted {
    const char* outcomes_;

  public:
    QuadraticProgram(const Arguments& arguments, const char* outcomes)
        : Block(arguments), outcomes_(outcomes) {}
    Argument<bool> use_lbA{this, "use_lbA", {.initial = false, .doc = "port lbA"}};
    Argument<bool> use_ubA{this, "use_ubA", {.initial = true, .doc = "port ubA"}};
    Argument<bool> use_lb{this, "use_lb", {.initial = false, .doc = "port lb"}};
    Argument<bool> use_ub{this, "use_ub", {.initial = false, .doc = "port ub"}};
    Argument<bool> compute_objective{this, "compute_objective", {.initial = false, .doc = "port objective"}};
    Argument<bool> stop_when_fails{
        this,
        "stop_when_fails",
        {.initial = false, .doc = "a problem that is not solved ends the run; otherwise it shows in status"}};

    Dim n{this, "n"};
    Dim m{this, "m"};
    Input<Matrix> H{
        this, "H", {.shape = {n, n}, .unit = any_unit, .doc = "Hessian, symmetric positive semidefinite"}};
    Input<Vector> g{this, "g", {.shape = {n}, .unit = any_unit, .doc = "gradient"}};
    Input<Matrix> A{
        this,
        "A",
        {.shape = {m, n}, .unit = any_unit, .doc = "constraint matrix", .present = use_lbA || use_ubA}};
    Input<Vector> lbA{
        this, "lbA", {.shape = {m}, .unit = any_unit, .doc = "lower bounds of A x", .present = use_lbA}};
    Input<Vector> ubA{
        this, "ubA", {.shape = {m}, .unit = any_unit, .doc = "upper bounds of A x", .present = use_ubA}};
    Input<Vector> lb{
        this, "lb", {.shape = {n}, .unit = any_unit, .doc = "lower bounds of x", .present = use_lb}};
    Input<Vector> ub{
        this, "ub", {.shape = {n}, .unit = any_unit, .doc = "upper bounds of x", .present = use_ub}};
    Output<Vector> x{
        this, "x", {.shape = {n}, .unit = any_unit, .doc = "solution; the last one while there is none"}};
    Output<double> status{this, "status", {.doc = outcomes_}};
    Output<double> objective{
        this,
        "objective",
        {.unit = any_unit, .doc = "value at x of the problem that it solves", .present = compute_objective}};
    DiscreteState<Vector> last{this, "last", {.shape = {n}, .unit = any_unit, .doc = "last solution"}};
    DiscreteState<double> last_objective{
        this, "last_objective", {.unit = any_unit, .doc = "its objective", .present = compute_objective}};
    OutsideState<qp::Solver> workspace{this, [this] { return make_solver(); }};

    Status reset(Now at, After) const noexcept override {
        at[workspace].reset();
        return ok;
    }

    UpdateRule update_last{this, kernels::Copy{}, next(last), x};
    std::optional<UpdateRule> update_objective = made_if(compute_objective);

    Status output(Now at, Out out) const noexcept override {
        auto solution = out[x];
        const qp::Result result = at[workspace].solve(program(at), solution);
        if (std::isnan(result.objective)) solution = at[last]; // none was written
        out[status] = number(result);
        if (objective.is_present())
            out[objective] = std::isnan(result.objective) ? at[last_objective] : result.objective;
        if (result.status == qp::Status::solved || !stop_when_fails) return ok;
        return failure(result);
    }

    /// By the active set of the solution; without one x keeps the last.
    bool directional_derivative(Now at, Changes& changes) const override {
        if (!is_exact()) return false;
        if (at[status] != 0) {
            if (changes.moves(last)) changes[x] = changes[last];
            if (changes.moves(last_objective)) changes[objective] = changes[last_objective];
            return true;
        }
        const Matrix still;
        const auto of = [&](const auto& key) -> const Matrix& {
            return key.is_present() ? changes[key] : still;
        };
        const auto found =
            qp::differentiate(program(at), at[x], {of(H), of(g), of(A), of(lbA), of(ubA), of(lb), of(ub)},
                              changes.directions());
        if (!found.exists) return false;
        if (found.is_one_sided) changes.meets_corner();
        changes[x] = found.x;
        if (objective.is_present()) changes[objective] = found.objective;
        return true;
    }

  protected:
    int variables() const { return size(g).rows; }
    int constraints() const { return A.is_present() ? size(A).rows : 0; }

  private:
    std::optional<UpdateRule> made_if(bool is_present) {
        if (!is_present) return {};
        return UpdateRule(this, kernels::Copy{}, next(last_objective), objective);
    }
    qp::Problem program(Now at) const noexcept {
        const auto vector = [&](const Input<Vector>& key) {
            return key.is_present() ? qp::Problem::Vector(at[key]) : qp::Problem::Vector();
        };
        return {at[H],       at[g],       A.is_present() ? qp::Problem::Matrix(at[A]) : qp::Problem::Matrix(),
                vector(lbA), vector(ubA), vector(lb),
                vector(ub)};
    }
    virtual std::shared_ptr<qp::Solver> make_solver() const = 0;
    virtual int number(const qp::Result& result) const noexcept { return static_cast<int>(result.status); }

    static Status failure(const qp::Result& result) {
        switch (result.status) {
        case qp::Status::iteration_limit:
            return Status::failure(
                "the QP was not solved within max_iterations; raise it or scale the problem");
        case qp::Status::infeasible:
            if (result.term == qp::Term::lbA)
                return Status::failure("lbA({}) is above ubA({}); look at what computes them", result.row + 1,
                                       result.row + 1);
            if (result.term == qp::Term::lb)
                return Status::failure("lb({}) is above ub({}); look at what computes them", result.row + 1,
                                       result.row + 1);
            return Status::failure(
                "the QP has no feasible point: constraints contradict each other; relax the bounds");
        case qp::Status::unbounded:
            return Status::failure("the QP is unbounded; make H positive definite or bound x");
        default: break;
        }
        const int row = result.row + 1, column = result.column + 1;
        switch (result.term) {
        case qp::Term::H:
            return Status::failure("H({}, {}) is not finite; look at what computes H", row, column);
        case qp::Term::g: return Status::failure("g({}) is not finite; look at what computes g", row);
        case qp::Term::A:
            return Status::failure("A({}, {}) is not finite; look at what computes A", row, column);
        case qp::Term::lbA: return Status::failure("lbA({}) is NaN; look at what computes lbA", row);
        case qp::Term::ubA: return Status::failure("ubA({}) is NaN; look at what computes ubA", row);
        case qp::Term::lb: return Status::failure("lb({}) is NaN; look at what computes lb", row);
        case qp::Term::ub: return Status::failure("ub({}) is NaN; look at what computes ub", row);
        default:
            return Status::failure("the QP solver broke down; make H positive semidefinite, and scale "
                                   "objective and constraints alike");
        }
    }
};

constexpr const char* simple_outcomes =
    "0 solved, 1 iteration limit, -1 internal error, -2 infeasible, -3 unbounded";

class QP final : public QuadraticProgram {
  public:
    explicit QP(const Arguments& arguments) : QuadraticProgram(arguments, simple_outcomes) {}
    Argument<std::string> solver{this,
                                 "solver",
                                 {.initial = "daqp",
                                  .doc = "daqp: exact, real-time; proxqp: the second opinion, allocates",
                                  .choices = {"daqp", "proxqp"}}};
    Argument<int> max_iterations{
        this, "max_iterations", {.initial = 1000, .minimum = 1, .doc = "of one solve"}};

  private:
    std::shared_ptr<qp::Solver> make_solver() const override {
        qp::Options options;
        options.max_iterations = max_iterations;
        return *solver == "proxqp" ? qp::make_proxqp(variables(), constraints(), options)
                                   : qp::make_daqp(variables(), constraints(), options);
    }
};

class QpOases final : public QuadraticProgram {
  public:
    explicit QpOases(const Arguments& arguments) : QuadraticProgram(arguments, simple_outcomes) {}
    Argument<std::string> solver{
        this,
        "solver",
        {.initial = "qpoases",
         .doc = "qpoases allocates in a step; daqp: in real time, and what is not convex is always -1",
         .choices = {"qpoases", "daqp"}}};

  private:
    std::shared_ptr<qp::Solver> make_solver() const override {
        qp::Options options;
        options.max_iterations = 100;
        return *solver == "daqp" ? qp::make_daqp(variables(), constraints(), options)
                                 : qp::make_qpoases(variables(), constraints(), options);
    }
};

class Osqp final : public QuadraticProgram {
  public:
    explicit Osqp(const Arguments& arguments)
        : QuadraticProgram(
              arguments, "1 solved, 2 solved inaccurately, -2 iteration limit, -3 infeasible, -4 unbounded, "
                         "3 and 4 the latter two by inaccurate certificates, -7 H is not positive "
                         "semidefinite, -10 an input is not finite or the solver broke down") {}
    Argument<bool> adaptive_rho{
        this,
        "adaptive_rho",
        {.initial = false, .doc = "the step size is adapted to the problem every 25 iterations"}};
    Argument<bool> polish{
        this,
        "polish",
        {.initial = false, .doc = "refines solutions by their active constraints; allocates in a step"}};
    Argument<int> max_iterations{
        this, "max_iterations", {.initial = 100, .minimum = 1, .doc = "of one solve"}};

  private:
    std::shared_ptr<qp::Solver> make_solver() const override {
        qp::OsqpOptions options;
        options.max_iterations = max_iterations;
        options.tolerance = 1e-3;
        options.adaptive_rho = adaptive_rho;
        options.polish = polish;
        options.has_bounds = use_lb || use_ub;
        return qp::make_osqp(variables(), constraints(), options);
    }
    bool is_exact() const override { return false; }
    int number(const qp::Result& result) const noexcept override { return result.osqp_status; }
};

} // namespace

void add_qp(Library& library) {
    library.group("optimisation")
        .add<QP>("QP", "Quadratic program: min 1/2 x'Hx + g'x subject to lbA <= Ax <= ubA, lb <= x <= ub. n "
                       "variables, m rows of A; ports by the use_ arguments, an absent bound is none, equal "
                       "bounds make an equality, and only the symmetric part of H counts. It starts from the "
                       "solution of the step before. While the status is not 0, x keeps the last solution "
                       "(zero before the first). Source: D. Arnström, A. Bemporad, D. Axehill, A dual "
                       "active-set solver for embedded quadratic programming using recursive LDL' updates, "
                       "2022; status numbers are those of qpOASES. Errors: with stop_when_fails, a problem "
                       "that is not solved, naming the entry that is not finite or the bounds that cross.")
        .add<QpOases>(
            "QpOases",
            "Quadratic program as QP, solved by qpOASES with its default options and at most 100 changes of "
            "the working set in a step. It starts from the solution and working set of the step before and, "
            "if that fails, once more from nothing; where these options find no minimum because H is "
            "singular, by proximal point iterations. While the status is not 0, x keeps the last solution "
            "(zero before the first). Source: H. J. Ferreau et al., qpOASES: a parametric active-set "
            "algorithm for quadratic programming, 2014. Errors: those of QP.")
        .add<Osqp>(
            "OSQP",
            "Quadratic program as QP, solved approximately by OSQP: it ends where violations of constraints "
            "and the gradient of the Lagrangian are below 1e-3, absolute and relative, which says nothing of "
            "how far x is from the solution where the cost is flat. Its status has the numbers of OSQP, "
            "where 1 is solved: what compares with 0, as for QpOases, never accepts it. It starts from "
            "solution and multipliers of the step before. At the iteration limit x is where the iterations "
            "ended; without any point (infeasible, unbounded, ...) it keeps the last one. Source: B. "
            "Stellato et al., OSQP: an operator splitting solver for quadratic programs, 2020. Errors: with "
            "stop_when_fails, a status other than 1 and 2, in the words of QP.");
}

} // namespace bf::toolbox
