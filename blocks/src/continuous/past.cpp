// Blocks of continuous signals that remember the past.
#include "bf/kernels/continuous.hpp"
#include "bf/kernels/elementwise.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <algorithm>

namespace bf::blocks {

namespace {

using Numbers = Array<double>;

/// y = Δu / Δt since the step before.
class Derivative final : public Block {
  public:
    explicit Derivative(const Arguments& arguments) : Block(arguments) { declare({.goes_on = true}); }
    AnyShape shape{this};
    Input<Numbers> u{this, "u", any(shape)};
    Output<Numbers> y{this, "y", any(shape, "derivative of u, unit of u per second")};
    DiscreteState<Numbers> before{this, "before", any(shape, "u of the step before")};
    DiscreteState<double> time{this, "time", {.unit = unit<"s">, .doc = "of the step before"}};
    DiscreteState<Numbers> last{this, "last", any(shape, "y of the step before")};
    DiscreteState<bool> started{this, "started", {.doc = "false before the first step"}};
    OutputRule rule{this, kernels::DifferenceQuotient{}, y, started, time, before, last, at_time, u};
    UpdateRule rule_before{this, kernels::Copy{}, next(before), u};
    UpdateRule rule_last{this, kernels::Copy{}, next(last), y};
    UpdateRule rule_time{this, kernels::Copy{}, next(time), at_time};
    UpdateRule rule_started{this, kernels::Copy{}, next(started), Constants({1})};
};

/// y(t) = u(t - delay).
class TransportDelay final : public Block {
  public:
    explicit TransportDelay(const Arguments& arguments) : Block(arguments) {
        declare({.goes_on = true});
        if (is_external)
            OutputRule(this, kernels::DelayedSample{}, y, initial, delay_input, times, values, count,
                       at_time);
        else
            OutputRule(this, kernels::DelayedSample{}, y, initial, delay, times, values, count, at_time);
    }
    Argument<std::string> delay_source{this,
                                       "delay_source",
                                       {.initial = "internal",
                                        .doc = "delay from the parameter or from an input",
                                        .choices = {"internal", "external"}}};
    Argument<int> buffer{this,
                         "buffer",
                         {.initial = 1024,
                          .minimum = 1,
                          .maximum = most_samples,
                          .doc = "samples kept, one per step: at least the delay's steps + 1"}};
    const bool is_external = *delay_source == "external";
    const int capacity = std::max(2, *buffer);
    AnyShape shape{this};
    Parameter<Numbers> delay{this,
                             "delay",
                             {.shape = scalar,
                              .initial = {1},
                              .minimum = 0,
                              .unit = unit<"s">,
                              .doc = "from u to y",
                              .present = !is_external}};
    Parameter<Numbers> initial{
        this, "initial", {.shape = scalar, .initial = {0}, .unit = any_unit, .doc = "y before the first u"}};
    Input<Numbers> u{this, "u", any(shape)};
    Input<Numbers> delay_input{
        this, "delay", {.shape = shape, .unit = unit<"s">, .doc = "at least 0", .present = is_external}};
    Output<Numbers> y{this, "y", any(shape)};
    DiscreteState<Numbers> times{
        this, "times", {.shape = {Extent(capacity)}, .unit = unit<"s">, .doc = "of the samples, a ring"}};
    DiscreteState<Numbers> values{this, "values", any("samples, one row each")};
    DiscreteState<std::uint32_t> count{this, "count", {.doc = "samples seen"}};
    UpdateRule rule_ring{
        this, kernels::KeepSample{}, next(times), next(values), next(count), times, values, count, at_time,
        u};

    void infer(Inference& inference) const override {
        if (const Size* s = inference.size(u)) inference.set(values, Size{capacity, s->count(), true});
    }
};

/// y = u_k + (u_k - u_{k-1}) / T (t - t_k) from the sample at t_k on.
class FirstOrderHold final : public Block {
  public:
    explicit FirstOrderHold(const Arguments& arguments) : Block(arguments) { declare({.goes_on = true}); }
    AnyShape shape{this};
    Parameter<double> interval{
        this,
        "interval",
        {.initial = {1}, .above = 0, .unit = unit<"s">, .doc = "T, from sample to sample: whole base steps"}};
    Input<Numbers> u{this, "u", any(shape)};
    Output<Numbers> y{this, "y", any(shape, "straight on from the last two samples")};
    DiscreteState<double> time{this, "time", {.unit = unit<"s">, .doc = "of the newest sample"}};
    DiscreteState<Numbers> sample{this, "sample", any(shape, "newest sample")};
    DiscreteState<Numbers> slope{this, "slope", any(shape, "to it from the one before, per second")};
    DiscreteState<double> steps{this, "steps", {.doc = "1 + the last step that was looked at, 0 before"}};

    Status output(Now at, Out to) const noexcept override {
        if (is_due(at))
            to[y] = at[u];
        else
            to[y] = at[sample] + at[slope] * (at.time() - at[time]);
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[steps] = static_cast<double>(at.step()) + 1;
        const bool takes = is_due(at);
        next[time] = takes ? at.time() : at[time];
        next[slope] = at[slope];
        if (takes && at[steps] > 0) next[slope] = (at[u] - at[sample]) / (at.time() - at[time]);
        next[sample] = at[sample];
        if (takes) next[sample] = at[u];
        return ok;
    }

  private:
    /// Is a sample taken in this step? Inside a step, which has been looked at, none is.
    bool is_due(Now at) const {
        if (at[steps] == 0) return true;
        const double since = at.time() - at[time];
        return at[steps] <= static_cast<double>(at.step()) && since > 0 && since >= at[interval] * (1 - 1e-9);
    }
};

} // namespace

void add_past(Library& library) {
    library.group("continuous")
        .add<Derivative>("Derivative",
                         "Difference quotient over the engine's last step: y(t) = (u(t) - u(t₀)) / (t - t₀) "
                         "with t₀ the step before, 0 in the first one. Rough for noise and jumps: "
                         "FilteredDerivative is smooth, and a state that is known is better.")
        .add<TransportDelay>(
            "TransportDelay",
            "Delays a continuous signal. y(t) = u(t - delay), from straight lines between the samples of the "
            "steps; later than the newest sample the last line goes on, and y never waits for u, so loops "
            "are broken. Stops the run when the delay is longer than the buffer.")
        .add<FirstOrderHold>("FirstOrderHold",
                             "Takes a sample of u every `interval` seconds and goes on in a straight line "
                             "from it, as the last two samples lead: y(t) = u_k + (u_k - u_{k-1}) / T (t - "
                             "t_k), constant after the first one.");
}

} // namespace bf::blocks
