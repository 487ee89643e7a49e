#include <bf/core/registry.hpp>

namespace my_plants {

using namespace bf;

/// A mass over a floor, which it leaves with a share of the speed with which it came.
///
///   dh/dt = v,  dv/dt = F/m - g;   where h falls through 0:  v⁺ = -e v⁻     (e: coefficient of restitution)
///
/// Reference: Brogliato, Nonsmooth Mechanics, 3rd ed., ch. 1.
class BouncingMass final : public Block {
  public:
    using Block::Block;

    Input<double> F{this, "F", {.unit = unit<"N">, .doc = "upwards", .feedthrough = false, .optional = true}};
    Output<double> h{this, "h", {.unit = unit<"m">, .doc = "height over the floor"}};
    Output<double> v{this, "v", {.unit = unit<"m/s">, .doc = "its velocity, upwards"}};
    Parameter<double> m{this, "m", {.initial = {1}, .above = 0, .unit = unit<"kg">, .doc = "mass"}};
    Parameter<double> e{
        this, "e", {.initial = {0.8}, .minimum = 0, .maximum = 1, .doc = "coefficient of restitution"}};
    Parameter<double> h0{
        this, "h0", {.initial = {1}, .minimum = 0, .unit = unit<"m">, .doc = "height at the start"}};
    ContinuousState<double> height{this, "height", {.unit = unit<"m">, .initial_from = h0.index()}};
    ContinuousState<double> velocity{this, "velocity", {.unit = unit<"m/s">}};
    DiscreteState<double> bounces{this, "bounces", {.doc = "so far", .reported = true}};
    Guard floor{this, "floor", {.unit = unit<"m">, .doc = "the mass touches the floor"}};

    Status output(Now at, Out out) const noexcept override {
        out[h] = at[height];
        out[v] = at[velocity];
        return ok;
    }
    Status derivative(Now at, Rate rate) const noexcept override {
        constexpr double g = 9.81; // m/s2
        rate[height] = at[velocity];
        rate[velocity] = at[F] / at[m] - g;
        return ok;
    }
    Status guards(Now at, Guards guard) const noexcept override {
        guard[floor] = at[height];
        return ok;
    }
    Status event(Now at, After after) const noexcept override {
        if (at[floor] < 0) { // it fell; rising from below is no bounce
            after[velocity] = -at[e] * at[velocity];
            after[bounces] = at[bounces] + 1;
        }
        return ok;
    }
};

} // namespace my_plants

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("plants").add<my_plants::BouncingMass>(
        "BouncingMass",
        "A mass over a floor. dh/dt = v, dv/dt = F/m - g; where h falls through 0, v⁺ = -e v⁻.");
}
