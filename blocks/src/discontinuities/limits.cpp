// Limits, zones, steps and plays.
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/events.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/nonlinear.hpp"

#include "../groups.hpp"
#include "../guards.hpp"
#include "../shapes.hpp"

namespace bf::blocks {

namespace {

/// What sets blocks with a lower and an upper bound apart.
struct Clipped {
    using Kernel = kernels::Saturate;
    static constexpr const char *lower = "lower", *upper = "upper";
    static constexpr const char *lower_doc = "smallest y", *upper_doc = "largest y";
    static constexpr double bound = infinity;
};
struct Dead {
    using Kernel = kernels::DeadZone;
    static constexpr const char *lower = "start", *upper = "end";
    static constexpr const char *lower_doc = "lower end of the zone", *upper_doc = "upper end of the zone";
    static constexpr double bound = 0.5;
};

/// y = kernel(lower, upper, u); a Bound is a parameter or an input.
template <class Of, class Bound> class Between final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
    Bound lower{this, Of::lower, {.initial = {-Of::bound}, .unit = any_unit, .doc = Of::lower_doc}};
    Bound upper{this,
                Of::upper,
                {.initial = {Of::bound}, .at_least = lower.index(), .unit = any_unit, .doc = Of::upper_doc}};
    Output<> y{this, "y", any()};
    OutputRule rule{this, typename Of::Kernel{}, y, lower, upper, u};
    Crossing at_lower{this, "at_lower", u, lower};
    Crossing at_upper{this, "at_upper", u, upper};

    void infer(Inference& inference) const override {
        at_lower.infer(*this, inference);
        at_upper.infer(*this, inference);
        broadcast(*this, inference, slots(u, lower, upper), y.index());
    }
};

/// y = sign(u) (viscous |u| + coulomb).
class Friction final : public Block {
  public:
    using Block::Block;
    Parameter<> coulomb{
        this, "coulomb", {.initial = {1}, .minimum = 0, .unit = any_unit, .doc = "height of the jump at 0"}};
    Parameter<> viscous{
        this,
        "viscous",
        {.initial = {1}, .minimum = 0, .unit = any_unit, .doc = "slope, unit of y per unit of u"}};
    Input<> u{this, "u", any("velocity")};
    Output<> y{this, "y", any("friction, in the direction of u")};
    OutputRule rule{this, kernels::Friction{}, y, coulomb, viscous, u};
    Crossing at_rest{this, "at_rest", u, Constants({0})};

    void infer(Inference& inference) const override {
        at_rest.infer(*this, inference);
        broadcast(*this, inference, slots(u, coulomb, viscous), y.index());
    }
};

/// y = u up to the threshold, else 0.
class WrapToZero final : public Block {
  public:
    using Block::Block;
    Parameter<> threshold{
        this, "threshold", {.initial = {255}, .unit = any_unit, .doc = "largest u that is let through"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::WrapToZero{}, y, threshold, u};
    Crossing at_threshold{this, "at_threshold", u, threshold};

    void infer(Inference& inference) const override {
        at_threshold.infer(*this, inference);
        broadcast(*this, inference, slots(u, threshold), y.index());
    }
};

/// y = q round(u / q).
class Quantize final : public Block {
  public:
    using Block::Block;
    Parameter<> interval{this,
                         "interval",
                         {.initial = {0.5}, .above = 0, .unit = any_unit, .doc = "distance of the steps, q"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    GuardOf<Array<std::int32_t>> at_edge{this, "at_edge", {.doc = "steps of y from 0"}};
    OutputRule rule{this, kernels::Quantize{}, y, interval, u};
    GuardRule guard{this, kernels::QuantizeEdges{}, at_edge, interval, u};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(u, interval), y.index());
        broadcast(*this, inference, slots(u, interval), at_edge.index());
    }
};

/// y = on or off; switches on at u ≥ on_point, off at u ≤ off_point.
class Relay final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<> off_point{
        this, "off_point", {.shape = scalar, .unit = any_unit, .doc = "switches off from here down"}};
    Parameter<> on_point{this,
                         "on_point",
                         {.shape = scalar,
                          .initial = {1},
                          .at_least = off_point.index(),
                          .unit = any_unit,
                          .doc = "switches on from here up"}};
    Parameter<> on_value{
        this, "on_value", {.shape = scalar, .initial = {1}, .unit = any_unit, .doc = "y while on"}};
    Parameter<> off_value{this, "off_value", {.shape = scalar, .unit = any_unit, .doc = "y while off"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<Array<bool>> mode{this, "mode", {.shape = shape, .doc = "on or off"}};
    DiscreteState<bool> started{
        this, "started", {.doc = "false before the first step, and where a trigger runs it"}};
    Workspace<Array<bool>> wanted{this, "wanted", {.shape = shape}};
    Workspace<Array<bool>> now_on{this, "now_on", {.shape = shape}};
    OutputRule rule_wanted{this, kernels::RelayMode{}, wanted, on_point, off_point, mode, u};
    OutputRule rule_mode{this, kernels::ShownMode{}, now_on, at_period, started, mode, wanted};
    OutputRule rule_y{this, kernels::Choose{}, y, on_value, now_on, off_value};
    UpdateRule update_mode{this, kernels::RelayMode{}, next(mode), on_point, off_point, mode, u};
    UpdateRule update_started{this, kernels::Not{}, next(started), at_trigger};
    Crossing at_on{this, "at_on", u, on_point};
    Crossing at_off{this, "at_off", u, off_point};
    EventRule event_mode{this, kernels::SwitchedMode{}, after(mode), at_on.key, at_off.key, mode};

    void infer(Inference& inference) const override {
        at_on.infer(*this, inference);
        at_off.infer(*this, inference);
    }
};

/// y follows u through a play of the given width.
class Backlash final : public Block {
  public:
    explicit Backlash(const Arguments& arguments) : Block(arguments) { declare({.goes_on = true}); }
    AnyShape shape{this};
    Parameter<> width{
        this,
        "width",
        {.shape = scalar, .initial = {1}, .minimum = 0, .unit = any_unit, .doc = "play, from stop to stop"}};
    Parameter<> initial{
        this, "initial", {.initial = {0}, .unit = any_unit, .doc = "y before the first step"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> x{this, "x", any(shape, "output of the step before", initial)};
    OutputRule rule{this, kernels::Backlash{}, y, width, x, u};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), y};
    GuardOf<Array<double>> at_lower{this, "at_lower", {.shape = shape, .doc = "zero at the lower stop"}};
    GuardOf<Array<double>> at_upper{this, "at_upper", {.shape = shape, .doc = "zero at the upper stop"}};
    GuardRule guard{this, kernels::StopMargins{}, at_lower, at_upper, width, x, u};
};

/// y = u reaches or passes a level in this step.
class HitCrossing final : public Block {
  public:
    explicit HitCrossing(const Arguments& arguments) : Block(arguments) { declare({.goes_on = true}); }
    Argument<std::string> direction{
        this,
        "direction",
        {.initial = "either", .doc = "from which side", .choices = {"either", "rising", "falling"}}};
    AnyShape shape{this};
    Parameter<> level{this, "level", {.shape = scalar, .unit = any_unit, .doc = "what u reaches or passes"}};
    Input<> u{this, "u", any(shape)};
    Output<Array<bool>> y{this, "y", {.shape = shape, .doc = "true in the step of the crossing"}};
    DiscreteState<> previous{this, "previous", any(shape, "input of the step before")};
    DiscreteState<bool> started{this, "started", {.doc = "false before the first step"}};
    OutputRule rule{this, kernels::HitCrossing{}, y, side(), level, started, previous, u};
    UpdateRule rule_previous{this, kernels::Copy{}, next(previous), u};
    UpdateRule rule_started{this, kernels::Copy{}, next(started), Constants({1})};
    Crossing at_level{this, "at_level", u, level};

    void infer(Inference& inference) const override { at_level.infer(*this, inference); }

  private:
    Constants side() const {
        return Constants({*direction == "either" ? 0.0 : *direction == "rising" ? 1.0 : -1.0});
    }
};

} // namespace

void add_discontinuities(Library& library) {
    library.group("discontinuities")
        .add<Between<Clipped, Parameter<>>>(
            "Saturate", "Holds a signal between limits. y = min(max(u, lower), upper); NaN stays NaN.")
        .add<Between<Dead, Parameter<>>>(
            "DeadZone", "Removes a zone around zero. y = u - end above it, u - start below it, else 0.")
        .add<Quantize>("Quantize",
                       "Rounds to multiples of an interval. y = q round(u / q), halves away from zero.")
        .add<Between<Clipped, Input<>>>("SaturateDynamic",
                                        "Holds a signal between two others. y = min(max(u, lower), upper).")
        .add<Between<Dead, Input<>>>(
            "DeadZoneDynamic",
            "Removes the zone between two signals. y = u - end above it, u - start below it, else 0.")
        .add<Backlash>("Backlash", "Play between two parts, as in gears. y moves only when u pushes one of "
                                   "the stops, which keeps |u - y| ≤ width/2.")
        .add<Friction>("Friction",
                       "Coulomb and viscous friction. y = sign(u) (viscous |u| + coulomb), 0 at u = 0.")
        .add<WrapToZero>("WrapToZero", "Falls back to zero. y = u up to the threshold, 0 above it.")
        .add<HitCrossing>(
            "HitCrossing",
            "Tells when a signal reaches or passes a level. y = true in that step, never in the first one.")
        .add<Relay>("Relay",
                    "Switch with memory. On from u ≥ on_point, off from u ≤ off_point, as before between "
                    "them; starts off.");
}

} // namespace bf::blocks
