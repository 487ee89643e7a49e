// The discrete integrator.
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/nonlinear.hpp"

#include "../groups.hpp"
#include "../reset.hpp"
#include "../shapes.hpp"

namespace bf::blocks {

namespace {

/// Integral of K u over the steps, between limits.
///
///   forward      y[k] = y[k-1] + K T u[k-1]
///   backward     y[k] = y[k-1] + K T u[k]
///   trapezoidal  y[k] = y[k-1] + K T (u[k-1] + u[k])/2
///
/// T is the time since the step before, which in a triggered subsystem is known in its next run alone:
/// therefore u[k-1] is a state. On a reset, and with an external initial value in the first step, y is that
/// value instead.
class DiscreteIntegrator final : public Block {
  public:
    explicit DiscreteIntegrator(const Arguments& arguments) : Block(arguments) {
        if (has_reset) reset_input.declare_edge<OutputRule>(this, edge);
        if (is_external) {
            if (has_reset) {
                OutputRule(this, kernels::Not{}, is_first, started);
                OutputRule(this, kernels::Maximum{}, restarts, edge, is_first);
            } else {
                OutputRule(this, kernels::Not{}, restarts, started);
            }
            UpdateRule(this, kernels::Copy{}, next(started), Constants({1}));
            declare_outputs(initial_input);
        } else {
            if (has_reset) OutputRule(this, kernels::Copy{}, restarts, edge);
            declare_outputs(initial);
        }
        UpdateRule(this, kernels::Copy{}, next(x), y);
        if (looks_back) UpdateRule(this, kernels::Copy{}, next(before), u);
        if (has_reset) reset_input.declare_memory(this);
    }

    Argument<std::string> method{this,
                                 "method",
                                 {.initial = "forward",
                                  .doc = "rule of integration",
                                  .choices = {"forward", "backward", "trapezoidal"}}};
    Argument<std::string> initial_source{this,
                                         "initial_source",
                                         {.initial = "internal",
                                          .doc = "initial value from the parameter or from an input",
                                          .choices = {"internal", "external"}}};
    const bool is_external = *initial_source == "external", looks_back = *method != "backward";

    AnyShape shape{this};
    Parameter<> gain{this, "gain", {.initial = {1}, .unit = any_unit, .doc = "factor K"}};
    Parameter<> lower{this, "lower", {.initial = {-infinity}, .unit = any_unit, .doc = "smallest y"}};
    Parameter<> upper{
        this,
        "upper",
        {.initial = {infinity}, .at_least = lower.index(), .unit = any_unit, .doc = "largest y"}};
    Parameter<> initial{this,
                        "initial",
                        {.initial = {0},
                         .unit = any_unit,
                         .doc = "y before the first step, and after a reset",
                         .present = !is_external}};
    Input<Any> u{this, "u", any(shape, "signal to integrate")};
    ResetInput reset_input{this};
    const bool has_reset = reset_input.is_present();
    Input<Any> initial_input{this, "x0", {.unit = any_unit, .doc = "initial value", .present = is_external}};
    Output<Any> y{this, "y", any(shape, "integral")};
    DiscreteState<Any> x{this, "x", any(shape, "y of the step before", initial)};
    DiscreteState<Any> before{
        this,
        "before",
        {.shape = shape, .unit = any_unit, .doc = "u of the step before", .present = looks_back}};
    DiscreteState<bool> started{
        this, "started", {.doc = "false before the first step", .present = is_external}};
    const bool may_restart = has_reset || is_external;
    Workspace<bool> edge{this, "edge", {.present = has_reset}};
    Workspace<bool> is_first{this, "is_first", {.present = has_reset && is_external}};
    Workspace<bool> restarts{this, "restarts", {.present = may_restart}};
    Workspace<Any> sum{this, "sum", {.shape = shape, .present = may_restart}};

    void infer(Inference& inference) const override {
        const int first = is_external ? initial_input.index() : initial.index();
        for (const int operand : {first, gain.index(), lower.index(), upper.index()}) {
            const Size *s = inference.size(operand), *signal = inference.size(u);
            if (!s || s->is_scalar()) continue;
            if (!signal)
                inference.set(u, *s);
            else if (s->count() != signal->count())
                inference.refuse(label(resolution(), operand) + " and " + label(resolution(), u.index()) +
                                 " differ; give a scalar or as many elements");
        }
    }

  private:
    /// `sum` is the unlimited choice between going on and starting again from `x0`.
    template <class Initial> void declare_outputs(const Initial& x0) {
        if (!may_restart) {
            accumulate(y);
        } else {
            accumulate(sum);
            OutputRule(this, kernels::Choose{}, y, x0, restarts, sum);
            OutputRule(this, kernels::Saturate{}, y, lower, upper, y);
        }
    }
    template <class Target> void accumulate(const Target& target) {
        if (*method == "forward")
            OutputRule(this, kernels::Accumulate{}, target, gain, at_period, lower, upper, x, before);
        else if (*method == "backward")
            OutputRule(this, kernels::Accumulate{}, target, gain, at_period, lower, upper, x, u);
        else {
            OutputRule(this, kernels::AccumulateHalf{}, target, gain, at_period, lower, upper, x, before);
            OutputRule(this, kernels::AccumulateHalf{}, target, gain, at_period, lower, upper, target, u);
        }
    }
};

} // namespace

void add_integrators(Library& library) {
    library.group("discrete")
        .add<DiscreteIntegrator>(
            "DiscreteIntegrator",
            "Integral of K u. y[k] = y[k-1] + K T u[k-1] forward, + K T u[k] backward, "
            "the mean of both trapezoidal, and y[-1] is `initial`. Limits hold y; a reset or, in the first "
            "step, the external input x0 puts y to its initial value.");
}

} // namespace bf::blocks
