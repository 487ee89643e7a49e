// Blocks with continuous states: the engine's solver integrates them.
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/matrix.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bf::blocks {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
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
};

/// dx/dt = u between limits: at a limit the state moves only inwards.
class LimitedIntegrator final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<Numbers> initial{this, "initial", {.initial = {0}, .unit = any_unit, .doc = "y at the start"}};
    Parameter<Numbers> lower{
        this, "lower", {.shape = shape, .initial = {-infinity}, .unit = any_unit, .doc = "smallest y"}};
    Parameter<Numbers> upper{
        this, "upper", {.shape = shape, .initial = {infinity}, .unit = any_unit, .doc = "largest y"}};
    Input<Numbers> u{
        this, "u", {.shape = shape, .unit = any_unit, .doc = "signal to integrate", .feedthrough = false}};
    Output<Numbers> y{this, "y", any(shape, "integral, within the limits")};
    ContinuousState<Numbers> x{
        this, "x", {.shape = shape, .unit = any_unit, .doc = "integral", .initial_from = initial.index()}};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[x].cwiseMax(at[lower]).cwiseMin(at[upper]);
        return ok;
    }
    Status derivative(Now at, Rate rate) const noexcept override {
        for (Eigen::Index i = 0; i < at[x].size(); ++i) {
            const double value = at[x](i), slope = at[u](i);
            const bool is_held = (value >= at[upper](i) && slope > 0) || (value <= at[lower](i) && slope < 0);
            rate[x](i) = is_held ? 0 : slope;
        }
        return ok;
    }
};

/// dx/dt = A x + B u, y = C x + D u.
class StateSpace final : public Block {
  public:
    using Block::Block;
    Dim n{this, "n"};
    Dim m{this, "m"};
    Dim p{this, "p"};
    Parameter<Matrix> A{this, "A", {.shape = {n, n}, .unit = mixed_units, .doc = "system matrix"}};
    Parameter<Matrix> B{this, "B", {.shape = {n, m}, .unit = mixed_units, .doc = "input matrix"}};
    Parameter<Matrix> C{this, "C", {.shape = {p, n}, .unit = mixed_units, .doc = "output matrix"}};
    Parameter<Matrix> D{
        this, "D", {.shape = {p, m}, .initial = {0}, .unit = mixed_units, .doc = "feedthrough matrix"}};
    Parameter<Vector> initial{
        this, "initial", {.shape = {n}, .initial = {0}, .unit = mixed_units, .doc = "x at the start"}};
    Input<Vector> u{this, "u", {.shape = {m}, .unit = any_unit, .doc = "input"}};
    Output<Vector> y{this, "y", {.shape = {p}, .unit = any_unit, .doc = "output"}};
    ContinuousState<Vector> x{
        this, "x", {.shape = {n}, .unit = mixed_units, .doc = "state", .initial_from = initial.index()}};
    OutputRule output_rule{this, kernels::StateSpace{}, y, C, D, x, u};
    DerivativeRule derivative_rule{this, kernels::StateSpace{}, bf::derivative(x), A, B, x, u};
};

/// Rational transfer function of one signal, in controllable canonical form:
///
///          b_0 sᵐ + ... + b_m
///   H(s) = ──────────────────,  m <= n.     Source: Ogata, Modern Control Engineering, 5th ed., §9.2.
///          a_0 sⁿ + ... + a_n
class TransferFunction final : public Block {
  public:
    explicit TransferFunction(const Arguments& arguments) : Block(arguments) {
        if (denominator->empty() || denominator->front() == 0)
            problem("argument 'denominator' must begin with a coefficient other than 0");
        if (numerator->empty() || numerator->size() > denominator->size())
            problem("argument 'numerator' has " + std::to_string(numerator->size()) +
                    " coefficients, the denominator " + std::to_string(denominator->size()) +
                    "; give at least one and at most as many");
    }
    Argument<std::vector<double>> numerator{
        this, "numerator", {.initial = {1}, .doc = "b_0 b_1 ..., highest power first"}};
    Argument<std::vector<double>> denominator{
        this, "denominator", {.initial = {1, 1}, .doc = "a_0 a_1 ..., highest power first"}};
    Input<double> u{this, "u", {.unit = any_unit, .doc = "input", .feedthrough = is_proper()}};
    Output<double> y{this, "y", {.unit = any_unit, .doc = "output"}};
    ContinuousState<Vector> x{this,
                              "x",
                              {.shape = {std::max(0, order())},
                               .unit = mixed_units,
                               .doc = "chain of integrators, highest derivative first"}};

    Status output(Now at, Out out) const noexcept override {
        const double direct = is_proper() ? b(0) / a(0) : 0;
        double sum = is_proper() ? direct * at[u] : 0;
        // y = Σ (b_i - a_i b_0/a_0)/a_0 x_i + b_0/a_0 u
        for (int i = 1; i <= order(); ++i) sum += (b(i) - a(i) * direct) / a(0) * at[x](i - 1);
        out[y] = sum;
        return ok;
    }
    Status derivative(Now at, Rate rate) const noexcept override {
        auto slope = rate[x];
        if (order() < 1) return ok;
        double first = at[u];
        for (int i = 1; i <= order(); ++i) first -= a(i) / a(0) * at[x](i - 1);
        for (int i = order() - 1; i > 0; --i) slope(i) = at[x](i - 1);
        slope(0) = first;
        return ok;
    }

  private:
    int order() const { return static_cast<int>(denominator->size()) - 1; }
    bool is_proper() const { return numerator->size() == denominator->size(); }
    double a(int i) const { return (*denominator)[static_cast<std::size_t>(i)]; }
    /// Numerator filled up with zeros to the length of the denominator.
    double b(int i) const {
        const int missing = order() + 1 - static_cast<int>(numerator->size());
        return i < missing ? 0 : (*numerator)[static_cast<std::size_t>(i - missing)];
    }
};

/// Continuous PID controller with filtered derivative and anti-windup by back-calculation:
///
///   v = P e + x_i + D N (e - x_d),   y = clamp(v, lower, upper)
///   dx_i/dt = I e + (y - v)/T_t,     dx_d/dt = N (e - x_d)
///
/// Source: Åström, Murray, Feedback Systems, 2nd ed., §11.4.
class PID final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<Numbers> P{
        this, "P", {.shape = shape, .initial = {1}, .unit = any_unit, .doc = "proportional gain"}};
    Parameter<Numbers> I{
        this, "I", {.shape = shape, .initial = {0}, .unit = any_unit, .doc = "integral gain, 1/s"}};
    Parameter<Numbers> D{
        this, "D", {.shape = shape, .initial = {0}, .unit = any_unit, .doc = "derivative gain, s"}};
    Parameter<Numbers> N{
        this,
        "N",
        {.shape = shape, .initial = {100}, .unit = unit<"1/s">, .doc = "bandwidth of the derivative filter"}};
    Parameter<Numbers> tracking{
        this,
        "tracking_time",
        {.shape = shape, .initial = {1}, .unit = unit<"s">, .doc = "T_t of the anti-windup"}};
    Parameter<Numbers> lower{
        this, "lower", {.shape = shape, .initial = {-infinity}, .unit = any_unit, .doc = "smallest y"}};
    Parameter<Numbers> upper{
        this, "upper", {.shape = shape, .initial = {infinity}, .unit = any_unit, .doc = "largest y"}};
    Input<Numbers> e{this, "e", any(shape, "control error")};
    Output<Numbers> y{this, "y", any(shape, "control signal")};
    ContinuousState<Numbers> x_i{this, "x_i", {.shape = shape, .unit = any_unit, .doc = "integral part"}};
    ContinuousState<Numbers> x_d{this, "x_d", {.shape = shape, .unit = any_unit, .doc = "filtered error"}};

    Status output(Now at, Out out) const noexcept override {
        for (Eigen::Index i = 0; i < at[e].size(); ++i)
            out[y](i) = std::clamp(unlimited(at, i), at[lower](i), at[upper](i));
        return ok;
    }
    Status derivative(Now at, Rate rate) const noexcept override {
        for (Eigen::Index i = 0; i < at[e].size(); ++i) {
            const double v = unlimited(at, i), limited = std::clamp(v, at[lower](i), at[upper](i));
            rate[x_i](i) = at[I](i) * at[e](i) + (limited - v) / at[tracking](i);
            rate[x_d](i) = at[N](i) * (at[e](i) - at[x_d](i));
        }
        return ok;
    }

  private:
    double unlimited(Now at, Eigen::Index i) const {
        return at[P](i) * at[e](i) + at[x_i](i) + at[D](i) * at[N](i) * (at[e](i) - at[x_d](i));
    }
};

} // namespace

void add_continuous(Library& library) {
    library.group("continuous")
        .add<Integrator>("Integrator", "Integral of u over time: dx/dt = u, y = x.")
        .add<LimitedIntegrator>("LimitedIntegrator",
                                "Integral of u over time between limits, where it moves only inwards.")
        .add<StateSpace>("StateSpace", "Linear system dx/dt = A x + B u, y = C x + D u.")
        .add<TransferFunction>("TransferFunction", "Rational transfer function of one signal. Errors: "
                                                   "numerator longer than the denominator, leading zero.")
        .add<PID>("PID", "Continuous PID controller, element by element, with filtered derivative, limits "
                         "and anti-windup by back-calculation.");
}

} // namespace bf::blocks
