// Limits, dead zones and switches with memory.
#include "bf/kernels/nonlinear.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <limits>

namespace bf::blocks {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// y = u held between the limits.
class Saturate final : public Block {
  public:
    using Block::Block;
    Parameter<> lower{this, "lower", {.initial = {-infinity}, .unit = any_unit, .doc = "smallest y"}};
    Parameter<> upper{this, "upper", {.initial = {infinity}, .unit = any_unit, .doc = "largest y"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::Saturate{}, y, lower, upper, u};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(u, lower, upper), y.index());
    }
};

/// y = u without the part inside the zone.
class DeadZone final : public Block {
  public:
    using Block::Block;
    Parameter<> start{this, "start", {.initial = {-0.5}, .unit = any_unit, .doc = "lower end of the zone"}};
    Parameter<> end{this, "end", {.initial = {0.5}, .unit = any_unit, .doc = "upper end of the zone"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::DeadZone{}, y, start, end, u};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(u, start, end), y.index());
    }
};

/// y = q round(u / q).
class Quantize final : public Block {
  public:
    using Block::Block;
    Parameter<> interval{
        this, "interval", {.initial = {0.5}, .unit = any_unit, .doc = "distance of the steps, q"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::Quantize{}, y, interval, u};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(u, interval), y.index());
    }
};

/// y = on or off; switches on at u ≥ on_point, off at u ≤ off_point.
class Relay final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<> on_point{
        this,
        "on_point",
        {.shape = scalar, .initial = {1}, .unit = any_unit, .doc = "switches on from here up"}};
    Parameter<> off_point{
        this, "off_point", {.shape = scalar, .unit = any_unit, .doc = "switches off from here down"}};
    Parameter<> on_value{
        this, "on_value", {.shape = scalar, .initial = {1}, .unit = any_unit, .doc = "y while on"}};
    Parameter<> off_value{this, "off_value", {.shape = scalar, .unit = any_unit, .doc = "y while off"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<Array<bool>> mode{this, "mode", {.shape = shape, .doc = "on or off"}};
    Workspace<Array<bool>> now_on{this, "now_on", {.shape = shape}};
    OutputRule rule_mode{this, kernels::RelayMode{}, now_on, on_point, off_point, mode, u};
    OutputRule rule_y{this, kernels::SwitchNotZero{}, y, Constants({0}), on_value, now_on, off_value};
    UpdateRule update_mode{this, kernels::RelayMode{}, next(mode), on_point, off_point, mode, u};
};

} // namespace

void add_nonlinear(Library& library) {
    library.group("logic")
        .add<Saturate>("Saturate",
                       "Holds a signal between limits. y = min(max(u, lower), upper); NaN stays NaN.")
        .add<DeadZone>("DeadZone",
                       "Removes a zone around zero. y = u - end above it, u - start below it, else 0.")
        .add<Quantize>("Quantize",
                       "Rounds to multiples of an interval. y = q round(u / q), halves away from zero.")
        .add<Relay>("Relay",
                    "Switch with memory. On from u ≥ on_point, off from u ≤ off_point, as before between "
                    "them; starts off.");
}

} // namespace bf::blocks
