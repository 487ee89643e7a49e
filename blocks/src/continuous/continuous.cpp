// Blocks with continuous states: the engine's solver integrates them.
#include "bf/kernels/continuous.hpp"
#include "bf/kernels/elementwise.hpp"

#include "../groups.hpp"
#include "../linear_system.hpp"
#include "../pid.hpp"
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
    ContinuousState<Numbers> x{this, "x", any(shape, "integral", initial)};
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
        {.shape = shape, .initial = {0.01}, .above = 0, .unit = unit<"s">, .doc = "of the lag"}};
    Parameter<Numbers> initial{
        this,
        "initial",
        {.initial = {0}, .unit = any_unit, .doc = "where the lag begins; y(0) = 0 if it is u(0)"}};
    Input<Numbers> u{this, "u", any(shape)};
    Output<Numbers> y{this, "y", any(shape, "derivative of u, unit of u per second")};
    ContinuousState<Numbers> x{this, "x", any(shape, "lag of u", initial)};
    OutputRule output_rule{this, kernels::Lag{}, y, time_constant, x, u};
    DerivativeRule derivative_rule{this, kernels::Lag{}, bf::derivative(x), time_constant, x, u};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, initial.index(), u.index());
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
        q.declare_guard(this, branch, x_i, x_d);
        if (!reset_input.is_present()) return;
        reset_input.declare_guard(this, restarts);
        reset_input.declare_event(this, restarts, x_i, q.initial);
        reset_input.declare_event(this, restarts, x_d, Constants({0}));
    }
    AnyShape shape{this};
    PidQuantities q{this, shape, has_setpoint};
    ContinuousReset reset_input{this};
    ContinuousState<Numbers> x_i{this, "x_i", any(shape, "integral part", q.initial)};
    ContinuousState<Numbers> x_d{this, "x_d", any(shape, "filtered D e")};
    Workspace<Numbers> slope_i{this, "slope_i", {.shape = shape}};
    Workspace<Numbers> slope_d{this, "slope_d", {.shape = shape}};
    Workspace<Numbers> now_y{this, "now_y", {.shape = shape}};
    GuardOf<Array<std::int32_t>> branch{
        this, "branch", {.shape = shape, .doc = "limit that y is at, and whether the integral stands still"}};
    Guard restarts{this, "restarts", {.doc = "sign of the reset input", .present = reset_input.is_present()}};
};

} // namespace

void add_continuous(Library& library) {
    library.group("continuous")
        .add<Integrator>("Integrator", "Integral of u over time: dx/dt = u, y = x.")
        .add<FilteredDerivative>("FilteredDerivative",
                                 "Derivative of a lag of u: y = (u - x)/τ, dx/dt = y, or H(s) = s/(τ s + 1).")
        .add<StateSpace<ContinuousTime>>(
            "StateSpace", "Linear system dx/dt = A x + B u, y = C x + D u; without D it breaks loops.")
        .add<TransferFunction<ContinuousTime>>(
            "TransferFunction",
            "Rational transfer function on every element. H(s) = Σ b_i sⁿ⁻ⁱ / Σ a_i sⁿ⁻ⁱ; a numerator "
            "shorter than the denominator breaks loops. Errors: longer numerator, leading zero.")
        .add<ZeroPole<ContinuousTime>>(
            "ZeroPole", "Transfer function by zeros and poles, on every element. H(s) = gain Π(s - zero) / "
                        "Π(s - pole); fewer zeros than poles break loops. Errors: more zeros than poles, "
                        "complex roots without their conjugates.")
        .add<PID<false>>("PID",
                         "Continuous PID controller of the error e, element by element: v = P e + x_i + D N "
                         "(e - x_d), y = clamp(v, lower, upper), dx_i/dt = I e + (y - v)/T_t, dx_d/dt = N (e "
                         "- x_d). Source: Åström, Murray, Feedback Systems, 2nd ed., §11.4.")
        .add<PID<true>>("PID2", "Continuous PID controller of a setpoint r and a measurement m, with weights "
                                "of the setpoint: like PID with P (b r - m), I (r - m) and D (c r - m).");
}

} // namespace bf::blocks
