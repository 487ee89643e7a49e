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
    using Block::Block;
    AnyShape shape{this};
    Input<Numbers> u{this, "u", any(shape)};
    Output<Numbers> y{this, "y", any(shape, "derivative of u, unit of u per second")};
    DiscreteState<Numbers> before{this, "before", any(shape, "u of the step before")};
    DiscreteState<double> time{this, "time", {.unit = unit<"s">, .doc = "of the step before"}};
    DiscreteState<bool> started{this, "started", {.doc = "false before the first step"}};
    OutputRule rule{this, kernels::DifferenceQuotient{}, y, started, time, before, at_time, u};
    UpdateRule rule_before{this, kernels::Copy{}, next(before), u};
    UpdateRule rule_time{this, kernels::Copy{}, next(time), at_time};
    UpdateRule rule_started{this, kernels::Copy{}, next(started), Constants({1})};

    /// Marks y as a signal that goes on inside a step.
    Status event(Now, After) const noexcept override { return ok; }
};

/// y(t) = u(t - delay).
class TransportDelay final : public Block {
  public:
    explicit TransportDelay(const Arguments& arguments) : Block(arguments) {
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
    Argument<int> buffer{
        this,
        "buffer",
        {.initial = 1024, .doc = "samples kept, one per step: at least the delay's steps + 1"}};
    const bool is_external = *delay_source == "external";
    const int capacity = std::max(2, at_least_one(*this, "buffer", *buffer));
    AnyShape shape{this};
    Parameter<Numbers> delay{
        this,
        "delay",
        {.shape = scalar, .initial = {1}, .unit = unit<"s">, .doc = "at least 0", .present = !is_external}};
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
    /// Marks y as a signal that goes on inside a step.
    Status event(Now, After) const noexcept override { return ok; }
};

} // namespace

void add_past(Library& library) {
    library.group("continuous")
        .add<Derivative>(
            "Derivative",
            "Difference quotient over the engine's last step: y(t) = (u(t) - u(t₀)) / (t - t₀) with "
            "t₀ the step before, 0 in the first one. Rough for noise and jumps: FilteredDerivative "
            "is smooth, and a state that is known is better.")
        .add<TransportDelay>(
            "TransportDelay",
            "Delays a continuous signal. y(t) = u(t - delay), from straight lines between the "
            "samples of the steps; later than the newest sample the last line goes on, and y "
            "never waits for u, so loops are broken. Stops the run when the delay is longer "
            "than the buffer.");
}

} // namespace bf::blocks
