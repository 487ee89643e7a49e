// Linear systems in discrete time.
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/matrix.hpp"

#include "../groups.hpp"
#include "../polynomial.hpp"
#include "../shapes.hpp"

#include <algorithm>

namespace bf::blocks {

namespace {

using Numbers = Array<double>;

/// Filters every element by a rational function of z, direct form II transposed.
class RationalFilter : public Block {
  protected:
    RationalFilter(const Arguments& arguments) : Block(arguments) {}

    void declare(const Rational& h, const Input<Numbers>& u, const Output<Numbers>& y,
                 const DiscreteState<Numbers>& s) {
        if (h.is_proper())
            OutputRule(this, kernels::FirstRow{}, y, s);
        else
            OutputRule(this, kernels::FilterOutput{}, y, Constants(h.b), Constants(h.a), s, u);
        UpdateRule(this, kernels::FilterUpdate{}, next(s), Constants(h.b), Constants(h.a), s, y, u);
    }
};

/// H(z) = Σ b_i zⁿ⁻ⁱ / Σ a_i zⁿ⁻ⁱ.
class DiscreteTransferFunction final : public RationalFilter {
  public:
    explicit DiscreteTransferFunction(const Arguments& arguments) : RationalFilter(arguments) {
        declare(h, u, y, s);
    }
    Argument<std::vector<double>> numerator{
        this, "numerator", {.initial = {1}, .doc = "b_0 b_1 ..., highest power of z first"}};
    Argument<std::vector<double>> denominator{
        this, "denominator", {.initial = {1, 0.5}, .doc = "a_0 a_1 ..., highest power of z first"}};
    const Rational h = rational(*this, *numerator, *denominator);
    AnyShape shape{this};
    Input<Numbers> u{this, "u", any(shape)};
    Output<Numbers> y{this, "y", any(shape)};
    DiscreteState<Numbers> s{this, "s", any("delay line, one column per element of u")};

    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(u)) inference.set(s, Size{h.order(), size->count(), true});
    }
};

/// H(z) = gain Π(z - zero) / Π(z - pole).
class DiscreteZeroPole final : public RationalFilter {
  public:
    explicit DiscreteZeroPole(const Arguments& arguments) : RationalFilter(arguments) { declare(h, u, y, s); }
    Argument<Matrix> zeros{
        this, "zeros", {.initial = Matrix(1, 0), .doc = "a row of real zeros, or rows [real imaginary]"}};
    Argument<Matrix> poles{
        this,
        "poles",
        {.initial = Matrix::Constant(1, 1, 0.5), .doc = "a row of real poles, or rows [real imaginary]"}};
    Argument<double> gain{this, "gain", {.initial = 1, .doc = "factor of the numerator"}};
    const Rational h = rational(*this, *zeros, *poles, *gain);
    AnyShape shape{this};
    Input<Numbers> u{this, "u", any(shape)};
    Output<Numbers> y{this, "y", any(shape)};
    DiscreteState<Numbers> s{this, "s", any("delay line, one column per element of u")};

    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(u)) inference.set(s, Size{h.order(), size->count(), true});
    }
};

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

/// x⁺ = A x + B u, y = C x + D u.
class DiscreteStateSpace final : public Block {
  public:
    explicit DiscreteStateSpace(const Arguments& arguments) : Block(arguments) {
        if (is_direct)
            OutputRule(this, kernels::StateSpace{}, y, C, Constants({D->data(), D->data() + D->size()}), x,
                       u);
        else
            OutputRule(this, kernels::MatrixProduct{}, y, C, x);
        UpdateRule(this, kernels::StateSpace{}, next(x), A, B, x, u);
    }
    Argument<Matrix> D{
        this, "D", {.initial = Matrix::Zero(1, 1), .doc = "feedthrough matrix; y waits for u only if not 0"}};
    const bool is_direct = !D->isZero(0);
    Dim n{this, "n"};
    Dim m{this, "m"};
    Dim p{this, "p"};
    Parameter<Matrix> A{this, "A", {.shape = {n, n}, .unit = mixed_units, .doc = "system matrix"}};
    Parameter<Matrix> B{this, "B", {.shape = {n, m}, .unit = mixed_units, .doc = "input matrix"}};
    Parameter<Matrix> C{this, "C", {.shape = {p, n}, .unit = mixed_units, .doc = "output matrix"}};
    Parameter<Vector> initial{
        this, "initial", {.shape = {n}, .initial = {0}, .unit = mixed_units, .doc = "x at the start"}};
    Input<Vector> u{this, "u", {.shape = {m}, .unit = any_unit, .doc = "input"}};
    Output<Vector> y{this, "y", {.shape = {p}, .unit = any_unit, .doc = "output"}};
    DiscreteState<Vector> x{
        this, "x", {.shape = {n}, .unit = mixed_units, .doc = "state", .initial_from = initial.index()}};

    void infer(Inference& inference) const override {
        check_feedthrough(*this, inference, *D, u.index(), y.index());
    }
};

} // namespace

void add_discrete_systems(Library& library) {
    library.group("discrete")
        .add<DiscreteTransferFunction>(
            "DiscreteTransferFunction",
            "Rational transfer function in z, on every element. H(z) = Σ b_i zⁿ⁻ⁱ / "
            "Σ a_i zⁿ⁻ⁱ; a numerator shorter than the denominator breaks loops. "
            "Errors: longer numerator, leading zero.")
        .add<DiscreteZeroPole>(
            "DiscreteZeroPole",
            "Transfer function by zeros and poles, on every element. H(z) = gain Π(z - zero) "
            "/ Π(z - pole); fewer zeros than poles break loops. Errors: more zeros than "
            "poles, complex roots without their conjugates.")
        .add<DiscreteStateSpace>("DiscreteStateSpace",
                                 "Linear system x⁺ = A x + B u, y = C x + D u; without D "
                                 "it breaks loops.")
        .add<DiscreteFilter>("DiscreteFilter", "Filter with tunable coefficients, on every element. H(z) = "
                                               "Σ b_i z⁻ⁱ / Σ a_i z⁻ⁱ, direct form II transposed.")
        .add<FIRFilter>("FIRFilter",
                        "Weighted sum of the last samples, on every element. y[k] = Σ b_i u[k-i].");
}

} // namespace bf::blocks
