// Blocks with continuous states: the engine's solver integrates them.
#include "bf/kernels/continuous.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/matrix.hpp"

#include "../groups.hpp"
#include "../pid.hpp"
#include "../polynomial.hpp"
#include "../reset.hpp"

namespace bf::blocks {

namespace {

using Numbers = Array<double>;

/// dx/dt = u, y = x.
class Integrator final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<Numbers> initial{this, "initial", {.initial = {0}, .unit = any_unit, .doc = "y at the start"}};
    Input<Numbers> u{this, "u", any(shape, "signal to integrate")};
    Output<Numbers> y{this, "y", any(shape, "integral")};
    ContinuousState<Numbers> x{
        this, "x", {.shape = shape, .unit = any_unit, .doc = "integral", .initial_from = initial.index()}};
    OutputRule output_rule{this, kernels::Copy{}, y, x};
    DerivativeRule derivative_rule{this, kernels::Copy{}, bf::derivative(x), u};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, initial.index(), u.index());
    }
};

/// y = (u - x)/τ, dx/dt = y.
class FilteredDerivative final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<Numbers> time_constant{
        this,
        "time_constant",
        {.shape = shape, .initial = {0.01}, .unit = unit<"s">, .doc = "of the lag, above 0"}};
    Parameter<Numbers> initial{
        this,
        "initial",
        {.initial = {0}, .unit = any_unit, .doc = "where the lag begins; y(0) = 0 if it is u(0)"}};
    Input<Numbers> u{this, "u", any(shape)};
    Output<Numbers> y{this, "y", any(shape, "derivative of u, unit of u per second")};
    ContinuousState<Numbers> x{
        this, "x", {.shape = shape, .unit = any_unit, .doc = "lag of u", .initial_from = initial.index()}};
    OutputRule output_rule{this, kernels::Lag{}, y, time_constant, x, u};
    DerivativeRule derivative_rule{this, kernels::Lag{}, bf::derivative(x), time_constant, x, u};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, initial.index(), u.index());
    }
};

/// dx/dt = A x + B u, y = C x + D u.
class StateSpace final : public Block {
  public:
    explicit StateSpace(const Arguments& arguments) : Block(arguments) {
        if (D->isZero(0))
            OutputRule(this, kernels::MatrixProduct{}, y, C, x);
        else
            OutputRule(this, kernels::StateSpace{}, y, C, Constants({D->data(), D->data() + D->size()}), x,
                       u);
    }
    Argument<Matrix> D{
        this, "D", {.initial = Matrix::Zero(1, 1), .doc = "feedthrough matrix; y waits for u only if not 0"}};
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
    ContinuousState<Vector> x{
        this, "x", {.shape = {n}, .unit = mixed_units, .doc = "state", .initial_from = initial.index()}};
    DerivativeRule derivative_rule{this, kernels::StateSpace{}, bf::derivative(x), A, B, x, u};

    void infer(Inference& inference) const override {
        check_feedthrough(*this, inference, *D, u.index(), y.index());
    }
};

/// A rational function of s on every element, in controllable canonical form.
class RationalSystem : public Block {
  protected:
    explicit RationalSystem(const Arguments& arguments) : Block(arguments) {}

    void declare(const Rational& h, const Input<Numbers>& u, const Output<Numbers>& y,
                 const ContinuousState<Numbers>& x) {
        const Constants b(h.b), a(h.a);
        if (h.is_proper())
            OutputRule(this, kernels::CompanionOutput{}, y, b, a, x, Constants({0}));
        else
            OutputRule(this, kernels::CompanionOutput{}, y, b, a, x, u);
        DerivativeRule(this, kernels::CompanionRate{}, bf::derivative(x), a, x, u);
    }
    static About chain() {
        return {.unit = mixed_units,
                .doc = "chain of integrators, highest derivative first; a column per element"};
    }
};

/// H(s) = Σ b_i sⁿ⁻ⁱ / Σ a_i sⁿ⁻ⁱ.
class TransferFunction final : public RationalSystem {
  public:
    explicit TransferFunction(const Arguments& arguments) : RationalSystem(arguments) { declare(h, u, y, x); }
    Argument<std::vector<double>> numerator{
        this, "numerator", {.initial = {1}, .doc = "b_0 b_1 ..., highest power first"}};
    Argument<std::vector<double>> denominator{
        this, "denominator", {.initial = {1, 1}, .doc = "a_0 a_1 ..., highest power first"}};
    const Rational h = rational(*this, *numerator, *denominator);
    AnyShape shape{this};
    Input<Numbers> u{this, "u", any(shape, "input")};
    Output<Numbers> y{this, "y", any(shape, "output")};
    ContinuousState<Numbers> x{this, "x", chain()};

    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(u)) inference.set(x, Size{h.order(), size->count(), true});
    }
};

/// H(s) = gain Π(s - zero) / Π(s - pole).
class ZeroPole final : public RationalSystem {
  public:
    explicit ZeroPole(const Arguments& arguments) : RationalSystem(arguments) { declare(h, u, y, x); }
    Argument<Matrix> zeros{
        this, "zeros", {.initial = Matrix(1, 0), .doc = "a row of real zeros, or rows [real imaginary]"}};
    Argument<Matrix> poles{
        this,
        "poles",
        {.initial = Matrix::Constant(1, 1, -1), .doc = "a row of real poles, or rows [real imaginary]"}};
    Argument<double> gain{this, "gain", {.initial = 1, .doc = "factor of the numerator"}};
    const Rational h = rational(*this, *zeros, *poles, *gain);
    AnyShape shape{this};
    Input<Numbers> u{this, "u", any(shape, "input")};
    Output<Numbers> y{this, "y", any(shape, "output")};
    ContinuousState<Numbers> x{this, "x", chain()};

    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(u)) inference.set(x, Size{h.order(), size->count(), true});
    }
};

/// PID controller whose states the solver integrates.
template <bool has_setpoint> class PID final : public Block {
  public:
    explicit PID(const Arguments& arguments) : Block(arguments) {
        const Constants no_period({0});
        q.template declare<OutputRule>(this, q.y, slope_i, slope_d, no_period, 0, 0, x_i, x_d);
        q.template declare<DerivativeRule>(this, now_y, bf::derivative(x_i), bf::derivative(x_d), no_period,
                                           0, 0, x_i, x_d);
        if (reset_input.is_present()) reset_input.declare_guard(this, restarts);
    }
    AnyShape shape{this};
    PidQuantities q{this, shape, has_setpoint};
    ContinuousReset reset_input{this};
    ContinuousState<Numbers> x_i{
        this,
        "x_i",
        {.shape = shape, .unit = any_unit, .doc = "integral part", .initial_from = q.initial.index()}};
    ContinuousState<Numbers> x_d{this, "x_d", any(shape, "filtered error")};
    Workspace<Numbers> slope_i{this, "slope_i", {.shape = shape}};
    Workspace<Numbers> slope_d{this, "slope_d", {.shape = shape}};
    Workspace<Numbers> now_y{this, "now_y", {.shape = shape}};
    Guard restarts{this, "restarts", {.doc = "sign of the reset input", .present = reset_input.is_present()}};

    Status event(Now at, After after) const noexcept override {
        if (!reset_input.is_due(at, restarts)) return ok;
        after[x_i] = at[q.initial];
        after[x_d].setZero();
        return ok;
    }
};

} // namespace

void add_continuous(Library& library) {
    library.group("continuous")
        .add<Integrator>("Integrator", "Integral of u over time: dx/dt = u, y = x.")
        .add<FilteredDerivative>("FilteredDerivative",
                                 "Derivative of a lag of u: y = (u - x)/τ, dx/dt = y, or H(s) = s/(τ s + 1).")
        .add<StateSpace>("StateSpace", "Linear system dx/dt = A x + B u, y = C x + D u; without D it breaks "
                                       "loops.")
        .add<TransferFunction>(
            "TransferFunction",
            "Rational transfer function on every element. H(s) = Σ b_i sⁿ⁻ⁱ / Σ a_i sⁿ⁻ⁱ; a "
            "numerator shorter than the denominator breaks loops. Errors: longer numerator, "
            "leading zero.")
        .add<ZeroPole>(
            "ZeroPole",
            "Transfer function by zeros and poles, on every element. H(s) = gain Π(s - zero) / "
            "Π(s - pole); fewer zeros than poles break loops. Errors: more zeros than poles, complex "
            "roots without their conjugates.")
        .add<PID<false>>(
            "PID", "Continuous PID controller of the error e, element by element: v = P e + x_i + D N (e "
                   "- x_d), y = clamp(v, lower, upper), dx_i/dt = I e + (y - v)/T_t, dx_d/dt = N (e - "
                   "x_d). Source: Åström, Murray, Feedback Systems, 2nd ed., §11.4.")
        .add<PID<true>>("PID2",
                        "Continuous PID controller of a setpoint r and a measurement m, with weights of "
                        "the setpoint: like PID with P (b r - m), I (r - m) and D (c r - m).");
}

} // namespace bf::blocks
