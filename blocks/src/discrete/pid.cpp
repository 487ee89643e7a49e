// PID controllers in discrete time.
#include "../pid.hpp"

#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/nonlinear.hpp"

#include "../groups.hpp"
#include "../reset.hpp"

namespace bf::blocks {

namespace {

using Numbers = Array<double>;

const std::vector<std::string>& methods() {
    static const std::vector<std::string> all{"forward", "backward", "trapezoidal"};
    return all;
}
double theta(const std::string& method) {
    return method == "forward" ? 0.0 : method == "backward" ? 1.0 : 0.5;
}

/// PID controller whose integrals are taken by Euler's or the trapezoidal rule.
template <bool has_setpoint> class DiscretePID final : public Block {
  public:
    explicit DiscretePID(const Arguments& arguments) : Block(arguments) {
        compute<OutputRule>(q.y);
        compute<UpdateRule>(now_y);
        UpdateRule(this, kernels::Advance{}, next(x_i), Constants({i}), at_period, now_i, slope_i);
        UpdateRule(this, kernels::Advance{}, next(x_d), Constants({d}), at_period, now_d, slope_d);
        UpdateRule(this, kernels::Copy{}, next(before_i), slope_i);
        UpdateRule(this, kernels::Copy{}, next(before_d), slope_d);
        if (reset_input.is_present()) reset_input.declare_memory(this);
    }
    Argument<std::string> method{
        this, "method", {.initial = "forward", .doc = "rule of integration", .choices = methods()}};
    Argument<std::string> filter_method{
        this, "filter_method", {.initial = "forward", .doc = "rule of the filter", .choices = methods()}};
    const double i = theta(*method), d = theta(*filter_method);
    AnyShape shape{this};
    PidQuantities q{this, shape, has_setpoint};
    ResetInput reset_input{this};
    DiscreteState<Numbers> x_i{this, "x_i", any(shape, "integral part", q.initial)};
    DiscreteState<Numbers> x_d{this, "x_d", any(shape, "filtered D e")};
    DiscreteState<Numbers> before_i{this, "before_i", any(shape, "slope of x_i in the step before")};
    DiscreteState<Numbers> before_d{this, "before_d", any(shape, "slope of x_d in the step before")};
    Workspace<Numbers> slope_i{this, "slope_i", {.shape = shape}};
    Workspace<Numbers> slope_d{this, "slope_d", {.shape = shape}};
    Workspace<Numbers> now_y{this, "now_y", {.shape = shape}};
    Workspace<Numbers> now_i{this, "now_i", {.shape = shape}};
    Workspace<Numbers> now_d{this, "now_d", {.shape = shape}};
    Workspace<bool> restarts{this, "restarts", {.present = reset_input.is_present()}};

  private:
    /// The slopes of the step before hold, by their part, until this step: only now is it known how long.
    template <class Rule, class Y> void compute(const Y& to_y) {
        Rule(this, kernels::Advance{}, now_i, Constants({1 - i}), at_period, x_i, before_i);
        Rule(this, kernels::Advance{}, now_d, Constants({1 - d}), at_period, x_d, before_d);
        if (reset_input.is_present()) {
            reset_input.declare_edge<Rule>(this, restarts);
            Rule(this, kernels::Choose{}, now_i, q.initial, restarts, now_i);
            Rule(this, kernels::Choose{}, now_d, Constants({0}), restarts, now_d);
        }
        q.template declare<Rule>(this, to_y, slope_i, slope_d, at_period, i, d, now_i, now_d);
    }
};

} // namespace

void add_discrete_pid(Library& library) {
    library.group("discrete")
        .add<DiscretePID<false>>(
            "DiscretePID",
            "Discrete PID controller of the error e, element by element. y = P e + I T α(z) e + D N / (1 + N "
            "T α(z)) e between its limits, with α = 1/(z - 1) forward, z/(z - 1) backward, their mean "
            "trapezoidal; a filter by the forward rule is stable for N T < 2; anti-windup acts on the next "
            "integral. Source: Åström, Hägglund, Advanced PID Control.")
        .add<DiscretePID<true>>(
            "DiscretePID2",
            "Discrete PID controller of a setpoint r and a measurement m, with weights of the setpoint: like "
            "DiscretePID with P (b r - m), I (r - m) and D (c r - m).");
}

} // namespace bf::blocks
