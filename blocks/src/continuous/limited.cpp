// Integrators with limits and resets: events change their states.
#include "bf/kernels/continuous.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/events.hpp"
#include "bf/kernels/nonlinear.hpp"

#include "../groups.hpp"
#include "../reset.hpp"
#include "../shapes.hpp"

namespace bf::blocks {

namespace {

using Numbers = Array<double>;
using GuardRow = GuardOf<Numbers>;
using Sides = GuardOf<Array<std::int32_t>>;

/// dz/dt = u between limits, with reset. z = x + base, so that an external initial value can be taken over:
/// base is that value, known in the first step or at a reset, and x begins at 0.
class LimitedIntegrator final : public Block {
  public:
    explicit LimitedIntegrator(const Arguments& arguments) : Block(arguments) {
        if (is_external) {
            OutputRule(this, kernels::Choose{}, now_base, base, started, x0);
            OutputRule(this, kernels::Add{}, z, x, now_base);
            UpdateRule(this, kernels::Choose{}, next(base), base, started, x0);
            UpdateRule(this, kernels::Copy{}, next(started), Constants({1}));
        } else {
            OutputRule(this, kernels::Copy{}, z, x);
        }
        OutputRule(this, kernels::Saturate{}, y, lower, upper, z);
        if (*saturation_port) OutputRule(this, kernels::LimitReached{}, saturation, lower, upper, y);
        if (*state_port) {
            if (is_external)
                OutputRule(this, kernels::Add{}, state, x, base);
            else
                OutputRule(this, kernels::Copy{}, state, x);
        }
        if (is_external) {
            EventRule(this, kernels::Choose{}, now_base, base, started, x0);
            EventRule(this, kernels::StoppedState{}, after(x), above, below, lower, upper, now_base, x);
        } else {
            EventRule(this, kernels::StoppedState{}, after(x), above, below, lower, upper, Constants({0}), x);
        }
        EventRule(this, kernels::StoppedSide{}, after(side), above, below, side);
        if (!reset_input.is_present()) return;
        reset_input.declare_guard(this, restarts);
        reset_input.declare_event(this, restarts, side, side);
        if (is_external) {
            reset_input.declare_event(this, restarts, x, Constants({0}));
            reset_input.declare_event(this, restarts, base, x0);
            reset_input.declare_event(this, restarts, started, Constants({1}));
        } else {
            reset_input.declare_event(this, restarts, x, initial);
        }
    }
    Argument<std::string> initial_source{this,
                                         "initial_source",
                                         {.initial = "internal",
                                          .doc = "initial value from the parameter or from an input",
                                          .choices = {"internal", "external"}}};
    Argument<bool> saturation_port{
        this, "saturation_port", {.initial = false, .doc = "an output that tells where y is at a limit"}};
    Argument<bool> state_port{
        this,
        "state_port",
        {.initial = false,
         .doc = "an output of the state before a reset, from which the reset may be made without a loop"}};
    const bool is_external = *initial_source == "external";
    AnyShape shape{this};
    Parameter<Numbers> initial{
        this,
        "initial",
        {.initial = {0}, .unit = any_unit, .doc = "y at the start", .present = !is_external}};
    Parameter<Numbers> lower{
        this, "lower", {.shape = shape, .initial = {-infinity}, .unit = any_unit, .doc = "smallest y"}};
    Parameter<Numbers> upper{this,
                             "upper",
                             {.shape = shape,
                              .initial = {infinity},
                              .at_least = lower.index(),
                              .unit = any_unit,
                              .doc = "largest y"}};
    Input<Numbers> u{
        this, "u", {.shape = shape, .unit = any_unit, .doc = "signal to integrate", .feedthrough = false}};
    ContinuousReset reset_input{this};
    Input<Numbers> x0{
        this, "x0", {.shape = shape, .unit = any_unit, .doc = "initial value", .present = is_external}};
    Output<Numbers> y{this, "y", any(shape, "integral, within the limits")};
    Output<Numbers> saturation{this,
                               "saturation",
                               {.shape = shape,
                                .doc = "1 at the upper limit, -1 at the lower one, else 0",
                                .present = *saturation_port}};
    Output<Numbers> state{
        this,
        "state",
        {.shape = shape, .unit = any_unit, .doc = "integral before a reset", .present = *state_port}};
    ContinuousState<Numbers> x{this, "x", any(shape, "integral, less the external initial value", initial)};
    DiscreteState<Numbers> base{
        this,
        "base",
        {.shape = shape, .unit = any_unit, .doc = "external initial value", .present = is_external}};
    DiscreteState<bool> started{
        this, "started", {.doc = "false before the first step", .present = is_external}};
    DiscreteState<Array<std::int32_t>> side{
        this,
        "side",
        {.shape = shape, .doc = "limit at which an event stopped it last: 1 upper, -1 lower, 0 none"}};
    Workspace<Numbers> now_base{this, "now_base", {.shape = shape, .present = is_external}};
    Workspace<Numbers> z{this, "z", {.shape = shape}};
    GuardRow above{this, "above", {.shape = shape, .doc = "distance above the upper limit"}};
    GuardRow below{this, "below", {.shape = shape, .doc = "distance above the lower limit"}};
    Sides held{this, "held", {.shape = shape, .doc = "limit that u presses against: 1 upper, -1 lower"}};
    Guard restarts{this, "restarts", {.doc = "sign of the reset input", .present = reset_input.is_present()}};
    DerivativeRule derivative_rule{this, kernels::LimitedRate{}, bf::derivative(x), lower, upper, y, u};
    UpdateRule side_rule{this, kernels::Copy{}, next(side), side};
    GuardRule guard_above{this, kernels::Subtract{}, above, z, upper};
    GuardRule guard_below{this, kernels::Subtract{}, below, z, lower};
    GuardRule guard_held{this, kernels::HeldSide{}, held, side, lower, upper, y, u};

    void infer(Inference& inference) const override {
        if (!is_external) check_initial(*this, inference, initial.index(), u.index());
    }
};

/// dx/dt = v, dv/dt = u, both between limits; at a limit of x the velocity ends.
class SecondOrderIntegrator final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<Numbers> initial_x{
        this, "initial_x", {.initial = {0}, .unit = any_unit, .doc = "x at the start"}};
    Parameter<Numbers> initial_v{
        this, "initial_v", {.initial = {0}, .unit = any_unit, .doc = "v at the start"}};
    Parameter<Numbers> lower_x{
        this, "lower_x", {.shape = shape, .initial = {-infinity}, .unit = any_unit, .doc = "smallest x"}};
    Parameter<Numbers> upper_x{this,
                               "upper_x",
                               {.shape = shape,
                                .initial = {infinity},
                                .at_least = lower_x.index(),
                                .unit = any_unit,
                                .doc = "largest x"}};
    Parameter<Numbers> lower_v{
        this, "lower_v", {.shape = shape, .initial = {-infinity}, .unit = any_unit, .doc = "smallest v"}};
    Parameter<Numbers> upper_v{this,
                               "upper_v",
                               {.shape = shape,
                                .initial = {infinity},
                                .at_least = lower_v.index(),
                                .unit = any_unit,
                                .doc = "largest v"}};
    Input<Numbers> u{this, "u", any(shape, "second derivative of x")};
    Output<Numbers> y{this, "x", any(shape, "position")};
    Output<Numbers> v{this, "v", any(shape, "velocity")};
    ContinuousState<Numbers> q{this, "q", any(shape, "position", initial_x)};
    ContinuousState<Numbers> q_dot{this, "q_dot", any(shape, "velocity", initial_v)};
    Workspace<Numbers> rate{this, "rate", {.shape = shape}};
    Workspace<Numbers> free_v{this, "free_v", {.shape = shape}};
    DiscreteState<Array<std::int32_t>> side{
        this,
        "side",
        {.shape = shape, .doc = "limit of x at which an event stopped it last: 1 upper, -1 lower, 0 none"}};
    GuardRow above{this, "above", {.shape = shape, .doc = "distance above the upper limit of x"}};
    GuardRow below{this, "below", {.shape = shape, .doc = "distance above the lower limit of x"}};
    Sides held{this, "held", {.shape = shape, .doc = "limit of x that the velocity presses against"}};
    Sides pressed{this, "pressed", {.shape = shape, .doc = "limit of x that u presses against"}};
    Sides held_v{this, "held_v", {.shape = shape, .doc = "limit of v that u presses against"}};
    Sides at_v{this, "at_v", {.shape = shape, .doc = "limit of v that is reached"}};
    OutputRule rule_x{this, kernels::Saturate{}, y, lower_x, upper_x, q};
    OutputRule rule_limits{this, kernels::Saturate{}, free_v, lower_v, upper_v, q_dot};
    OutputRule rule_v{this, kernels::LimitedRate{}, v, lower_x, upper_x, y, free_v};
    DerivativeRule rule_q{this, kernels::Copy{}, bf::derivative(q), v};
    DerivativeRule rule_rate{this, kernels::LimitedRate{}, rate, lower_v, upper_v, v, u};
    DerivativeRule rule_q_dot{this, kernels::LimitedRate{}, bf::derivative(q_dot), lower_x, upper_x, y, rate};
    UpdateRule side_rule{this, kernels::Copy{}, next(side), side};
    GuardRule guard_above{this, kernels::Subtract{}, above, q, upper_x};
    GuardRule guard_below{this, kernels::Subtract{}, below, q, lower_x};
    GuardRule guard_held{this, kernels::HeldSide{}, held, side, lower_x, upper_x, y, q_dot};
    GuardRule guard_pressed{this, kernels::HeldSide{}, pressed, side, lower_x, upper_x, y, u};
    GuardRule guard_held_v{this, kernels::HeldSide{}, held_v, Constants({0}), lower_v, upper_v, q_dot, u};
    GuardRule guard_at_v{this, kernels::LimitReached{}, at_v, lower_v, upper_v, q_dot};

    EventRule stop_q{this,    kernels::StoppedState{}, after(q), above, below, lower_x,
                     upper_x, Constants({0}),          q};
    EventRule stop_q_dot{this,           kernels::StoppedState{}, after(q_dot),   above, below,
                         Constants({0}), Constants({0}),          Constants({0}), q_dot};
    EventRule stop_side{this, kernels::StoppedSide{}, after(side), above, below, side};

    void infer(Inference& inference) const override {
        for (const int initial : {initial_x.index(), initial_v.index()})
            check_initial(*this, inference, initial, u.index());
    }
};

} // namespace

void add_limited_integrators(Library& library) {
    library.group("continuous")
        .add<LimitedIntegrator>(
            "LimitedIntegrator",
            "Integral of u over time between limits, with reset and external initial value. At a limit it "
            "moves only inwards; a reset puts it back to its initial value at that instant.")
        .add<SecondOrderIntegrator>("SecondOrderIntegrator",
                                    "Integrates twice: dx/dt = v, dv/dt = u, within limits. At a limit of x "
                                    "the velocity becomes 0, and only an inward u moves it again.");
}

} // namespace bf::blocks
