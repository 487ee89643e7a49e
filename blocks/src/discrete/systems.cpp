// Linear systems in discrete time.
#include "../groups.hpp"
#include "../linear_system.hpp"

#include <algorithm>

namespace bf::blocks {

namespace {

/// H(z) = Σ b_i z⁻ⁱ / Σ a_i z⁻ⁱ with tunable coefficients.
class DiscreteFilter final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<> b{this, "numerator", {.initial = {1}, .unit = any_unit, .doc = "b_0 b_1 ... of 1, z⁻¹, ..."}};
    Parameter<> a{
        this, "denominator", {.initial = {1, 0.5}, .unit = any_unit, .doc = "a_0 a_1 ..., a_0 other than 0"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> s{this, "s", any("delay line, one column per element of u")};
    OutputRule rule{this, kernels::FilterOutput{}, y, b, a, s, u};
    UpdateRule rule_s{this, kernels::FilterUpdate{}, next(s), b, a, s, y, u};

    void infer(Inference& inference) const override {
        const Size *size = inference.size(u), *nb = inference.size(b), *na = inference.size(a);
        if (size && nb && na)
            inference.set(s, Size{std::max(nb->count(), na->count()) - 1, size->count(), true});
    }
};

/// y[k] = Σ b_i u[k-i] with tunable coefficients.
class FIRFilter final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<> b{this,
                  "coefficients",
                  {.initial = {0.5, 0.5}, .unit = any_unit, .doc = "b_0 b_1 ..., of u[k], u[k-1], ..."}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> s{this, "s", any("delay line, one column per element of u")};
    OutputRule rule{this, kernels::FilterOutput{}, y, b, Constants({1}), s, u};
    UpdateRule rule_s{this, kernels::FilterUpdate{}, next(s), b, Constants({1}), s, y, u};

    void infer(Inference& inference) const override {
        const Size *size = inference.size(u), *nb = inference.size(b);
        if (size && nb) inference.set(s, Size{nb->count() - 1, size->count(), true});
    }
};

} // namespace

void add_discrete_systems(Library& library) {
    library.group("discrete")
        .add<TransferFunction<DiscreteTime>>(
            "DiscreteTransferFunction",
            "Rational transfer function in z, on every element. H(z) = Σ b_i zⁿ⁻ⁱ / Σ a_i zⁿ⁻ⁱ; a numerator "
            "shorter than the denominator breaks loops. Errors: longer numerator, leading zero.")
        .add<ZeroPole<DiscreteTime>>("DiscreteZeroPole",
                                     "Transfer function by zeros and poles, on every element. H(z) = gain "
                                     "Π(z - zero) / Π(z - pole); fewer zeros than poles break loops. Errors: "
                                     "more zeros than poles, complex roots without their conjugates.")
        .add<StateSpace<DiscreteTime>>(
            "DiscreteStateSpace", "Linear system x⁺ = A x + B u, y = C x + D u; without D it breaks loops.")
        .add<DiscreteFilter>("DiscreteFilter", "Filter with tunable coefficients, on every element. H(z) = "
                                               "Σ b_i z⁻ⁱ / Σ a_i z⁻ⁱ, direct form II transposed.")
        .add<FIRFilter>("FIRFilter",
                        "Weighted sum of the last samples, on every element. y[k] = Σ b_i u[k-i].");
}

} // namespace bf::blocks
