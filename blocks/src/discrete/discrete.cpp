// Delays, latches, counters and limits over time.
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/standard.hpp"

#include "../elementwise.hpp"
#include "../groups.hpp"
#include "../reset.hpp"

namespace bf::blocks {

namespace {

/// y[k] = u[k-1].
class UnitDelay final : public Block {
  public:
    explicit UnitDelay(const Arguments& arguments) : Block(arguments) { declare({.changes_rate = true}); }
    AnyShape shape{this};
    Parameter<> initial{this, "initial", {.initial = {0}, .unit = any_unit, .doc = "y in the first step"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> x{this, "x", any(shape, "input of the step before", initial)};
    OutputRule rule{this, kernels::Copy{}, y, x};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), u};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, initial.index(), u.index());
    }
};

/// y[k] = u[k-n].
class Delay final : public Block {
  public:
    explicit Delay(const Arguments& arguments) : Block(arguments) {
        declare({.changes_rate = true});
        const Constants last({double(length)});
        if (!reset_input.is_present()) {
            OutputRule(this, kernels::LookUpRow{}, y, past, last);
            UpdateRule(this, kernels::Shift{}, next(past), past, u);
            return;
        }
        reset_input.declare_edge<OutputRule>(this, restarts);
        OutputRule(this, kernels::LookUpRow{}, y, past, last);
        OutputRule(this, kernels::Choose{}, y, initial, restarts, y);
        reset_input.declare_edge<UpdateRule>(this, restarts);
        UpdateRule(this, kernels::Choose{}, kept, initial, restarts, past);
        UpdateRule(this, kernels::Shift{}, next(past), kept, u);
        reset_input.declare_memory(this);
    }
    Argument<int> steps{
        this, "steps", {.initial = 2, .minimum = 1, .maximum = most_samples, .doc = "length of the delay"}};
    const int length = *steps;
    AnyShape shape{this};
    Parameter<> initial{
        this, "initial", {.shape = scalar, .initial = {0}, .unit = any_unit, .doc = "y in the first steps"}};
    Input<> u{this, "u", any(shape)};
    ResetInput reset_input{this};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> past{this,
                         "past",
                         {.unit = any_unit,
                          .doc = "inputs of the steps before, newest in row 1, one column per element",
                          .initial_from = initial.index()}};
    Workspace<Any> kept{this, "kept", {.present = reset_input.is_present()}};
    Workspace<bool> restarts{this, "restarts", {.present = reset_input.is_present()}};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (!s) return;
        inference.set(past, Size{length, s->count(), true});
        if (kept.is_present()) inference.set(kept, Size{length, s->count(), true});
    }
};

/// y = the last samples of u, one row per step.
class TappedDelay final : public Block {
  public:
    explicit TappedDelay(const Arguments& arguments) : Block(arguments) {
        if (*include_current)
            OutputRule(this, kernels::Shift{}, y, past, u);
        else
            OutputRule(this, kernels::Copy{}, y, past);
        UpdateRule(this, kernels::Shift{}, next(past), past, u);
    }
    Argument<int> steps{
        this,
        "steps",
        {.initial = 4, .minimum = 1, .maximum = most_samples, .doc = "number of samples kept"}};
    Argument<bool> include_current{
        this,
        "include_current",
        {.initial = false, .doc = "y begins with u[k] before the samples, and so has one row more"}};
    const int length = *steps;
    Parameter<> initial{
        this, "initial", {.shape = scalar, .initial = {0}, .unit = any_unit, .doc = "y in the first steps"}};
    Input<> u{this, "u", any("a vector gives one column per element")};
    Output<> y{this, "y", any("newest sample first")};
    DiscreteState<> past{this,
                         "past",
                         {.unit = any_unit,
                          .doc = "inputs of the steps before, newest in row 1, one column per element",
                          .initial_from = initial.index()}};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (!s) return;
        const int rows = length + (*include_current ? 1 : 0);
        inference.set(past, Size{length, s->count(), true});
        inference.set(y, s->is_scalar() ? Size{rows, 1, false} : Size{rows, s->count(), true});
    }
};

/// y = u at the hits of its own period.
class ZeroOrderHold final : public Block {
  public:
    explicit ZeroOrderHold(const Arguments& arguments) : Block(arguments) { declare({.changes_rate = true}); }
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    OutputRule rule{this, kernels::Copy{}, y, u};
};

/// y = u, or the sample of the hit before.
class RateTransition final : public Block {
  public:
    explicit RateTransition(const Arguments& arguments) : Block(arguments) {
        declare({.changes_rate = true});
        if (is_delay) {
            OutputRule(this, kernels::Copy{}, y, x);
            UpdateRule(this, kernels::Copy{}, next(x), u);
        } else {
            OutputRule(this, kernels::Copy{}, y, u);
        }
    }
    Argument<std::string> mode{this,
                               "mode",
                               {.initial = "hold",
                                .doc =
                                    "hold: y = u at the hits of the period, for a slower reader; delay: u of "
                                    "the hit before, for a faster reader that must not wait for u",
                                .choices = {"hold", "delay"}}};
    const bool is_delay = *mode == "delay";
    AnyShape shape{this};
    Parameter<> initial{
        this, "initial", {.initial = {0}, .unit = any_unit, .doc = "first y", .present = is_delay}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> x{this,
                      "x",
                      {.shape = shape,
                       .unit = any_unit,
                       .doc = "input of the hit before",
                       .present = is_delay,
                       .initial_from = initial.index()}};

    void infer(Inference& inference) const override {
        if (is_delay) check_initial(*this, inference, initial.index(), u.index());
    }
};

/// y[k] = K (u[k] - u[k-1]) / T.
class DiscreteDerivative final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<> gain{this, "gain", {.shape = scalar, .initial = {1}, .unit = any_unit, .doc = "factor K"}};
    Parameter<> initial{
        this, "initial", {.initial = {0}, .unit = any_unit, .doc = "input before the first step"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> x{this, "x", any(shape, "input of the step before", initial)};
    Workspace<Any> slope{this, "slope", {.shape = shape}};
    OutputRule rule_slope{this, kernels::Difference{}, slope, at_period, x, u};
    OutputRule rule{this, kernels::Gain{}, y, gain, slope};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), u};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, initial.index(), u.index());
    }
};

/// y follows u at a limited rate; a Bound is a parameter or an input.
template <class Bound> class RateLimit final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Bound rising{this,
                 "rising",
                 {.shape = of_bound(),
                  .initial = {1},
                  .minimum = 0,
                  .unit = any_unit,
                  .doc = "fastest rise, unit of u per second"}};
    Bound falling{this,
                  "falling",
                  {.shape = of_bound(),
                   .initial = {-1},
                   .maximum = 0,
                   .unit = any_unit,
                   .doc = "fastest fall, unit of u per second"}};
    Parameter<> initial{
        this, "initial", {.initial = {0}, .unit = any_unit, .doc = "y before the first step"}};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> x{this, "x", any(shape, "output of the step before", initial)};
    OutputRule rule{this, kernels::RateLimit{}, y, rising, falling, at_period, x, u};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), y};

    void infer(Inference& inference) const override {
        for (const int given : {initial.index(), rising.index(), falling.index()})
            check_initial(*this, inference, given, u.index());
    }

  private:
    Shape of_bound() const { return std::is_same_v<Bound, Input<>> ? Shape(shape) : Shape(); }
};

/// y = the first u of the run, whatever follows.
class FirstSample final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> held{this, "held", any(shape, "the first sample")};
    DiscreteState<bool> waiting{this, "waiting", {.initial = {1}, .doc = "true before the first step"}};
    OutputRule rule{this, kernels::Choose{}, y, u, waiting, held};
    UpdateRule rule_held{this, kernels::Copy{}, next(held), y};
    UpdateRule rule_waiting{this, kernels::Copy{}, next(waiting), Constants({0})};
};

/// y = value in the first step, then u.
class InitialCondition final : public Block {
  public:
    explicit InitialCondition(const Arguments& arguments) : Block(arguments) {
        declare({.first_value = value.index()});
    }
    AnyShape shape{this};
    Parameter<> value{this, "value", {.initial = {0}, .unit = any_unit, .doc = "y in the first step"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<bool> waiting{this, "waiting", {.initial = {1}, .doc = "true before the first step"}};
    OutputRule rule{this, kernels::Choose{}, y, value, waiting, u};
    UpdateRule rule_waiting{this, kernels::Copy{}, next(waiting), Constants({0})};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, value.index(), u.index());
    }
};

/// y = u while the trigger is true, else the last such u.
class SampleHold final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<> initial{
        this, "initial", {.initial = {0}, .unit = any_unit, .doc = "y before the trigger was ever true"}};
    Input<Any> u{this, "u", any(shape)};
    Input<Other> trigger{this, "trigger", {.shape = scalar, .doc = "true: let u through"}};
    Output<Any> y{this, "y", any(shape)};
    DiscreteState<Any> held{this, "held", any(shape, "output of the step before", initial)};
    Workspace<bool> open{this, "open", {}};
    OutputRule rule_open{this, kernels::NotEqual{}, open, trigger, Constants({0})};
    OutputRule rule{this, kernels::Choose{}, y, u, open, held};
    UpdateRule rule_held{this, kernels::Copy{}, next(held), y};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, initial.index(), u.index());
    }
};

/// y = u has been true for the duration.
class OnDelay final : public Block {
  public:
    using Block::Block;
    Parameter<double> duration{
        this,
        "duration",
        {.initial = {0.1}, .minimum = 0, .unit = unit<"s">, .doc = "for how long u must have been true"}};
    Input<> u{this, "u", {.shape = scalar, .doc = "truth value"}};
    Output<bool> y{this, "y"};
    DiscreteState<double> since{this, "since", {.unit = unit<"s">, .doc = "for how long u has been true"}};
    Workspace<double> now_since{this, "now_since", {}};
    Workspace<bool> now_y{this, "now_y", {}};
    OutputRule rule{this, kernels::OnDelay{}, y, now_since, duration, at_period, since, u};
    UpdateRule rule_since{this, kernels::OnDelay{}, now_y, next(since), duration, at_period, since, u};
};

/// y = number of steps in which u was true.
class Counter final : public Block {
  public:
    using Block::Block;
    Input<Any> u{this, "u", {.shape = scalar, .doc = "counted while true"}};
    Input<Other> reset_signal{this, "reset", {.shape = scalar, .doc = "true: back to 0", .optional = true}};
    Output<double> y{this, "y", {.doc = "steps counted, this one included"}};
    DiscreteState<double> x{this, "x", {.doc = "steps counted before"}};
    Workspace<bool> counts{this, "counts", {}};
    Workspace<bool> restarts{this, "restarts", {}};
    OutputRule rule_counts{this, kernels::NotEqual{}, counts, u, Constants({0})};
    OutputRule rule_restarts{this, kernels::NotEqual{}, restarts, reset_signal, Constants({0})};
    OutputRule rule{this, kernels::Count{}, y, x, counts, restarts};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), y};
};

} // namespace

void add_discrete(Library& library) {
    library.group("discrete")
        .add<UnitDelay>("UnitDelay", "Delays by one step. y[k] = u[k-1], y[0] = initial; breaks loops.")
        .add<UnitDelay>("Memory", "Input of the step before. y[k] = u[k-1], y[0] = initial; breaks loops.")
        .add<Delay>(
            "Delay",
            "Delays by several steps. y[k] = u[k - steps], initial before and after a reset; breaks loops.")
        .add<TappedDelay>("TappedDelay", "Keeps the last samples. y = [u[k-1] u[k-2] …], initial before.")
        .add<ZeroOrderHold>("ZeroOrderHold", "Samples a signal at its own period and holds it. y = u.")
        .add<RateTransition>("RateTransition", "Carries a signal between two rates, at its own period. y = "
                                               "u, or with mode delay u of the hit before.")
        .add<DiscreteDerivative>("DiscreteDerivative", "Difference quotient. y[k] = K (u[k] - u[k-1]) / T.")
        .add<RateLimit<Parameter<>>>("RateLimit", "Limits the rate of change. y moves from its last value "
                                                  "toward u by at most rising T up and falling T down.")
        .add<RateLimit<Input<>>>("RateLimitDynamic",
                                 "Limits the rate of change by two signals. y moves from its last value "
                                 "toward u by at most rising T up and falling T down.")
        .add<FirstSample>("FirstSample", "Holds the first sample of its input. y[k] = u[0].")
        .add<InitialCondition>("InitialCondition", "Replaces the first sample. y[0] = value, then y = u.")
        .add<SampleHold>("SampleHold",
                         "Lets its input through while a trigger is true. y = u, else the last such u.")
        .add<OnDelay>("OnDelay", "Ignores short pulses. y is true once u has been true for the duration.")
        .add<Counter>("Counter",
                      "Counts the steps in which its input is true. y = steps so far, 0 while reset.");
}

} // namespace bf::blocks
