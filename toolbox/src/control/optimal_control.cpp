#include "bf/control/mpc.hpp"
#include "bf/control/riccati.hpp"
#include "bf/core/differenced.hpp"
#include "checks.hpp"
#include "control/control.hpp"

namespace bf::toolbox {

namespace {

using control::Mpc;
using control::Regulator;

class Lqr final : public Block {
  public:
    using Block::Block;
    Argument<std::string> time{this,
                               "time",
                               {.initial = "discrete",
                                .doc = "discrete: x(k+1) = A x + B u; continuous: dx/dt = A x + B u",
                                .choices = {"discrete", "continuous"}}};
    Argument<bool> model_inputs{
        this, "model_inputs", {.initial = false, .doc = "A and B are inputs instead of parameters"}};
    Argument<bool> stop_when_fails{
        this,
        "stop_when_fails",
        {.initial = true, .doc = "matrices without a gain end the run; otherwise it shows in status"}};

    Dim n{this, "n"};
    Dim m{this, "m"};
    Parameter<Matrix> A{
        this, "A", {.shape = {n, n}, .unit = mixed_units, .doc = "system matrix", .present = !*model_inputs}};
    Parameter<Matrix> B{
        this, "B", {.shape = {n, m}, .unit = mixed_units, .doc = "input matrix", .present = !*model_inputs}};
    Parameter<Matrix> Q{
        this,
        "Q",
        {.shape = {n, n}, .unit = mixed_units, .doc = "cost of the states, positive semidefinite"}};
    Parameter<Matrix> R{
        this, "R", {.shape = {m, m}, .unit = mixed_units, .doc = "cost of the inputs, positive definite"}};
    Input<Matrix> A_now{
        this, "A", {.shape = {n, n}, .unit = mixed_units, .doc = "system matrix", .present = model_inputs}};
    Input<Matrix> B_now{
        this, "B", {.shape = {n, m}, .unit = mixed_units, .doc = "input matrix", .present = model_inputs}};
    Input<Vector> x{this, "x", {.shape = {n}, .unit = any_unit, .doc = "state"}};
    Input<Vector> x_target{
        this,
        "x_target",
        {.shape = {n}, .unit = any_unit, .doc = "state that is wanted; open: zero", .optional = true}};
    Input<Vector> u_target{
        this,
        "u_target",
        {.shape = {m}, .unit = any_unit, .doc = "input that is fed forward; open: zero", .optional = true}};
    Output<Vector> u{this, "u", {.shape = {m}, .unit = any_unit, .doc = "u_target - K (x - x_target)"}};
    Output<Matrix> K{this, "K", {.shape = {m, n}, .unit = mixed_units, .doc = "gain"}};
    Output<double> status{this,
                          "status",
                          {.doc =
                               "0 solved, 1 no stabilising gain, 2 R is not positive definite, 3 a matrix "
                               "is not finite, 4 Q is not positive semidefinite; then K is the last gain"}};
    DiscreteState<Matrix> last{this, "last", {.shape = {m, n}, .unit = mixed_units, .doc = "last gain"}};
    Scratch<Regulator> regulator{this, [this] {
                                     return Regulator(value(n), value(m),
                                                      *time == "continuous" ? Regulator::Time::continuous
                                                                            : Regulator::Time::discrete);
                                 }};

    Status output(Now at, Out out) const noexcept override {
        if (const Status good = all_finite(at, x, x_target, u_target); !good) return good;
        auto& riccati = at[regulator];
        const auto found = model_inputs ? riccati.solve(at[A_now], at[B_now], at[Q], at[R])
                                        : riccati.solve(at[A], at[B], at[Q], at[R]);
        out[status] = static_cast<double>(found);
        out[K] = at[last];
        if (found == Regulator::Status::solved) out[K] = riccati.K();
        out[u] = at[u_target];
        out[u].noalias() -= out[K].lazyProduct(at[x]);
        out[u].noalias() += out[K].lazyProduct(at[x_target]);
        if (!stop_when_fails) return ok;
        switch (found) {
        case Regulator::Status::not_stabilising:
            return Status::failure(
                "no gain stabilises A, B, or Q does not see a motion that neither grows nor "
                "decays; look at the model and at Q");
        case Regulator::Status::indefinite:
            return Status::failure("Q is not positive semidefinite; let no state have a negative cost");
        case Regulator::Status::no_cost:
            return Status::failure("R is not positive definite; give each input a cost");
        case Regulator::Status::not_finite:
            return Status::failure("A, B, Q or R is not finite; look at what computes them");
        default: return ok;
        }
    }
    Status update(Now at, Next next) const noexcept override {
        next[last] = at[K];
        return ok;
    }
};

/// Parameters NAME_min and NAME_max, without bounds where they are not given.
struct Bounds {
    Bounds(Block* owner, const std::string& name, const Dim& size, const char* doc, bool present = true)
        : lower{owner,
                (name + "_min").c_str(),
                {.shape = {size},
                 .initial = {-bf::Limits::infinity},
                 .maximum = largest,
                 .unit = any_unit,
                 .doc = doc,
                 .present = present}},
          upper{owner,
                (name + "_max").c_str(),
                {.shape = {size},
                 .initial = {bf::Limits::infinity},
                 .minimum = -largest,
                 .at_least = lower.index(),
                 .unit = any_unit,
                 .doc = doc,
                 .present = present}} {}
    Parameter<Vector> lower, upper;
};

class PredictiveControl final : public Block, public WarmStarted {
  public:
    using Block::Block;
    Argument<int> horizon{this, "horizon", {.initial = 20, .minimum = 1, .doc = "N, steps"}};
    Argument<std::string> form{this,
                               "form",
                               {.initial = "condensed",
                                .doc = "condensed: the inputs are the variables; sparse: inputs and states",
                                .choices = {"condensed", "sparse"}}};
    Argument<std::string> solver{
        this,
        "solver",
        {.initial = "daqp",
         .doc = "daqp: exact; osqp: until residuals and gradient are below 1e-5, absolute "
                "and relative: u may be off by 1e-2 where the cost is flat",
         .choices = {"daqp", "osqp"}}};
    Argument<std::string> terminal{
        this,
        "terminal",
        {.initial = "lqr",
         .doc =
             "cost of the last state: lqr: that of going on without bounds for ever; Q: as of all others; P: "
             "a parameter",
         .choices = {"lqr", "Q", "P"}}};
    Argument<std::vector<int>> bounded{
        this, "bounded", {.minimum = 1, .doc = "numbers of the states with bounds, from 1"}};
    Argument<bool> soft{
        this,
        "soft",
        {.initial = false, .doc = "bounds of states may be exceeded, at the cost of the slack_ parameters"}};
    Argument<bool> limit_rates{
        this,
        "limit_rates",
        {.initial = false, .doc = "u changes from step to step within the bounds du_min and du_max"}};
    Argument<int> max_iterations{
        this, "max_iterations", {.initial = 1000, .minimum = 1, .doc = "of one solve"}};
    Argument<bool> stop_when_fails{
        this,
        "stop_when_fails",
        {.initial = false, .doc = "a problem that is not solved ends the run; otherwise it shows in status"}};

    Dim n{this, "n"};
    Dim m{this, "m"};
    Dim h{this, "h"};
    Dim c{this, "c", [this] { return static_cast<int>(bounded->size()); }};
    Dim N{this, "N", [this] { return *horizon; }};
    Parameter<Matrix> A{this, "A", {.shape = {n, n}, .unit = mixed_units, .doc = "system matrix"}};
    Parameter<Matrix> B{this, "B", {.shape = {n, m}, .unit = mixed_units, .doc = "input matrix"}};
    Parameter<Matrix> Q{
        this,
        "Q",
        {.shape = {n, n}, .unit = mixed_units, .doc = "cost of the states, positive semidefinite"}};
    Parameter<Matrix> R{
        this, "R", {.shape = {m, m}, .unit = mixed_units, .doc = "cost of the inputs, positive definite"}};
    Parameter<Matrix> P{
        this,
        "P",
        {.shape = {n, n}, .unit = mixed_units, .doc = "cost of the last state", .present = *terminal == "P"}};
    Bounds u_bounds{this, "u", m, "of the inputs"};
    Bounds du_bounds{this, "du", m, "of u(k) - u(k-1)", limit_rates};
    Bounds x_bounds{this, "x", c, "of the bounded states", has_bounds()};
    Parameter<Vector> slack_weight{this,
                                   "slack_weight",
                                   {.shape = {c},
                                    .initial = {1},
                                    .minimum = 0,
                                    .unit = any_unit,
                                    .doc = "of 1/2 s^2, s by which a bound is exceeded",
                                    .present = soft && has_bounds()}};
    Parameter<Vector> slack_linear{this,
                                   "slack_linear",
                                   {.shape = {c},
                                    .initial = {1000},
                                    .minimum = 0,
                                    .unit = any_unit,
                                    .doc = "of s; large enough, bounds are kept wherever that is possible",
                                    .present = soft && has_bounds()}};
    Input<Vector> x{this, "x", {.shape = {n}, .unit = any_unit, .doc = "state"}};
    Input<Matrix> reference{
        this,
        "reference",
        {.shape = {n, h},
         .unit = any_unit,
         .doc = "states that are wanted after 1, 2, ... N steps, a column each; one column: always that"}};
    Input<Vector> u_reference{
        this,
        "u_reference",
        {.shape = {m}, .unit = any_unit, .doc = "input that costs nothing; open: zero", .optional = true}};
    Input<Vector> disturbance{
        this,
        "disturbance",
        {.shape = {n}, .unit = any_unit, .doc = "added to the state in each step", .optional = true}};
    Input<Vector> u_last{this,
                         "u_last",
                         {.shape = {m},
                          .unit = any_unit,
                          .doc =
                              "input that is in force, from which u may go away by du_min to du_max; open: u "
                              "of the step before, zero at first",
                          .present = limit_rates,
                          .optional = true}};
    Output<Vector> u{this, "u", {.shape = {m}, .unit = any_unit, .doc = "first input of the plan"}};
    Output<Matrix> plan{
        this, "plan", {.shape = {m, N}, .unit = any_unit, .doc = "inputs of now and the next steps"}};
    Output<Matrix> states{
        this, "states", {.shape = {n, N}, .unit = any_unit, .doc = "states that follow from the plan"}};
    Output<double> status{
        this,
        "status",
        {.doc = "0 solved, 1 iteration limit, -1 internal error, -2 infeasible, -3 unbounded"}};
    DiscreteState<Matrix> last_plan{
        this, "last_plan", {.shape = {m, N}, .unit = any_unit, .doc = "plan of the step before"}};
    DiscreteState<Matrix> last_states{
        this, "last_states", {.shape = {n, N}, .unit = any_unit, .doc = "and its states"}};
    OutsideState<Mpc> controller{this, [this] { return make_controller(); }};
    Scratch<Regulator> regulator{this,
                                 [this] { return Regulator(value(n), value(m), Regulator::Time::discrete); }};

    void infer(Inference& inference) const override {
        const Size *of_reference = inference.size(reference), *of_x = inference.size(x);
        if (of_reference && of_reference->cols != 1 && of_reference->cols != *horizon)
            inference.refuse("input 'reference' has " + std::to_string(of_reference->cols) +
                             " columns, but the horizon has " + std::to_string(*horizon) +
                             " steps; give one column, or one for each step");
        const Size* of_u = inference.size(u);
        if (!of_x || !of_u) return;
        try {
            options().validate(of_x->rows, of_u->rows);
        } catch (const std::invalid_argument& wrong) {
            inference.refuse(wrong.what());
        }
    }
    Status reset(Now at, After) const noexcept override {
        at[controller].reset();
        return ok;
    }
    Status output(Now at, Out out) const noexcept override {
        Status good = all_finite(at, x, reference, u_reference, disturbance);
        if (good && u_last.is_present()) good = all_finite(at, u_last);
        if (!good) return good;
        auto& mpc = at[controller];
        if (*terminal == "lqr") {
            auto& riccati = at[regulator];
            if (riccati.solve(at[A], at[B], at[Q], at[R]) != Regulator::Status::solved)
                return Status::failure(
                    "A, B, Q and R have no linear-quadratic regulator, whose cost terminal: "
                    "lqr takes; look at them, or let terminal be Q or P");
            mpc.set_model(at[A], at[B], at[Q], at[R], riccati.X());
        } else {
            mpc.set_model(at[A], at[B], at[Q], at[R], P.is_present() ? at[P] : at[Q]);
        }
        mpc.u_min = at[u_bounds.lower];
        mpc.u_max = at[u_bounds.upper];
        if (has_bounds()) {
            mpc.x_min = at[x_bounds.lower];
            mpc.x_max = at[x_bounds.upper];
        }
        if (slack_weight.is_present()) {
            mpc.slack_weight = at[slack_weight];
            mpc.slack_linear = at[slack_linear];
        }
        if (limit_rates) {
            mpc.du_min = at[du_bounds.lower];
            mpc.du_max = at[du_bounds.upper];
            if (at.is_connected(u_last))
                mpc.u_last = at[u_last];
            else
                mpc.u_last = at[last_plan].col(0);
        }
        const qp::Result result = mpc.solve(at[x], at[reference], at[u_reference], at[disturbance]);
        out[status] = static_cast<double>(result.status);
        if (result.status == qp::Status::solved) {
            out[plan] = mpc.inputs();
            out[states] = mpc.states();
        } else {
            go_on(at[last_plan], out[plan]);
            go_on(at[last_states], out[states]);
        }
        out[u] = at[plan].col(0);
        return result.status == qp::Status::solved || !stop_when_fails ? ok : failure(result);
    }
    Status update(Now at, Next next) const noexcept override {
        next[last_plan] = at[plan];
        next[last_states] = at[states];
        return ok;
    }

  private:
    bool is_exact() const override { return *solver == "daqp"; }
    bool has_bounds() const { return !bounded->empty(); }
    Mpc::Options options() const {
        Mpc::Options options;
        options.horizon = horizon;
        options.form = *form == "sparse" ? Mpc::Form::sparse : Mpc::Form::condensed;
        options.method = *solver == "osqp" ? Mpc::Method::osqp : Mpc::Method::daqp;
        for (const int number : *bounded) options.bounded.push_back(number - 1);
        options.is_soft = soft && has_bounds();
        options.limits_rates = limit_rates;
        options.max_iterations = max_iterations;
        if (*solver == "osqp") options.tolerance = 1e-5;
        return options;
    }
    std::shared_ptr<Mpc> make_controller() const {
        return std::make_shared<Mpc>(value(n), value(m), options());
    }
    /// The last plan a step later; its end stays.
    template <class From, class To> static void go_on(const From& from, To to) {
        const Eigen::Index rest = from.cols() - 1;
        to.leftCols(rest) = from.rightCols(rest);
        to.col(rest) = from.col(rest);
    }
    Status failure(const qp::Result& result) const noexcept {
        switch (result.status) {
        case qp::Status::infeasible:
            if (limit_rates)
                return Status::failure("no inputs within their bounds and rates keep the states within "
                                       "theirs; relax u_min, u_max, "
                                       "du_min, du_max, x_min or x_max, or let soft be true");
            return Status::failure(
                "no inputs within their bounds keep the states within theirs; relax them, or "
                "let soft be true");
        case qp::Status::iteration_limit:
            return Status::failure("the plan was not found within max_iterations; raise it");
        default:
            return Status::failure(
                "the solver broke down; make Q positive semidefinite, R positive definite, "
                "and scale states and inputs alike");
        }
    }
};

} // namespace

void add_optimal_control(Library& library) {
    library.group("optimal control")
        .add<Lqr>(
            "LQR",
            "Linear-quadratic regulator u = u_target - K (x - x_target), which minimises the sum (or "
            "integral) of "
            "x'Q x + u'R u: discrete: K = (R + B'XB)^-1 B'XA with X = A'XA - A'XB K + Q; continuous: K = "
            "R^-1 B'X "
            "with A'X + XA - XB K + Q = 0. The gain is computed when a matrix changes. Only the symmetric "
            "parts "
            "of Q and R count. "
            "Source: E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, A structure-preserving doubling algorithm for "
            "continuous-time algebraic Riccati equations, 2005. "
            "Errors: an input that is not finite; with stop_when_fails, matrices without a stabilising gain.")
        .add<PredictiveControl>("MPC",
                                "Model predictive control of x(k+1) = A x + B u + disturbance: the inputs "
                                "u_0 ... u_{N-1} of least "
                                "1/2 sum |x_k - r_k|^2_Q + 1/2 |x_N - r_N|^2_P + 1/2 sum |u_k - "
                                "u_reference|^2_R within the bounds of "
                                "inputs and states, of which the first is u. The references of the whole "
                                "horizon may be known before. "
                                "With limit_rates, du_min <= u(k) - u(k-1) <= du_max all along the plan. "
                                "Soft bounds are exceeded by s at a cost of slack_linear s + 1/2 "
                                "slack_weight s^2 for each step and "
                                "state. It starts from the active bounds of the step before. While status is "
                                "not 0 it goes on along "
                                "the last plan (zeros before the first) and stays at its end. "
                                "Source: J. B. Rawlings, D. Q. Mayne, M. M. Diehl, Model Predictive Control: "
                                "Theory, Computation, and "
                                "Design, 2017, ch. 1 and 8; status numbers are those of QP. "
                                "Errors: columns of reference that are neither 1 nor N, bounded states that "
                                "do not exist, more than 2000 variables; in a step, an input that is not "
                                "finite; terminal: "
                                "lqr where there is no regulator. With stop_when_fails, what is not solved.");
}

} // namespace bf::toolbox
