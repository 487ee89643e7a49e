#include <bf/core/registry.hpp>

namespace my_blocks {

using namespace bf;
using Vector2 = Eigen::Vector2d;

/// Second-order discrete-time filter, applied to every element of u.
///
///          b0 + b1 z⁻¹ + b2 z⁻²
///   H(z) = ────────────────────          (direct form II, transposed)
///           1 + a1 z⁻¹ + a2 z⁻²
///
/// The roots of z² + a1 z + a2 must lie inside the unit circle; the block does not check it.
/// Reference: Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed., §6.3.
class SecondOrderFilter final : public Block {
  public:
    using Block::Block;

    Dim n{this, "n"}; // width of the signal, set by whatever is wired to u

    Input<Vector> u{this, "u", {.shape = {n}, .unit = any_unit, .doc = "signal to filter"}};
    Output<Vector> y{this, "y", {.shape = {n}, .unit = any_unit, .doc = "filtered signal, unit of u"}};
    Parameter<Vector3> b{this, "b", {.initial = {1, 0, 0}, .doc = "numerator b0 b1 b2"}};
    Parameter<Vector2> a{this, "a", {.initial = {0, 0}, .doc = "denominator a1 a2, with a0 = 1"}};
    DiscreteState<Vector> s1{this, "s1", {.shape = {n}, .unit = any_unit, .doc = "delay line, one step"}};
    DiscreteState<Vector> s2{this, "s2", {.shape = {n}, .unit = any_unit, .doc = "delay line, two steps"}};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[b][0] * at[u] + at[s1];
        return ok;
    }

    Status update(Now at, Next next) const noexcept override {
        next[s1] = at[b][1] * at[u] - at[a][0] * at[y] + at[s2];
        next[s2] = at[b][2] * at[u] - at[a][1] * at[y];
        return ok;
    }
};

} // namespace my_blocks

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("filters").add<my_blocks::SecondOrderFilter>(
        "SecondOrderFilter",
        "Second-order discrete-time filter. H(z) = (b0 + b1 z⁻¹ + b2 z⁻²) / (1 + a1 z⁻¹ + a2 z⁻²).");
}
