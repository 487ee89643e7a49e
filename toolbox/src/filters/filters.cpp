#include "filters/filters.hpp"

#include "bf/core/changes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace bf::toolbox {

namespace {

/// Element-wise discrete filter.
///
///   Generic:                 y[k] = (Σ b_i u[k-i] - Σ_{i≥1} a_i y[k-i]) / a_0
///   FirstOrderLowPassFilter: the same with b = [T, T], a = [2τ+T, T-2τ], τ = 1/(2π Fc) (Tustin)
///   MedianFilter:            y[k] = median of the last `order` inputs
class DiscreteFilter final : public Block {
  public:
    explicit DiscreteFilter(const Arguments& arguments) : Block(arguments) { check(); }

    Argument<std::string> filter_type{this,
                                      "filter_type",
                                      {.initial = "Generic",
                                       .doc = "which filter",
                                       .choices = {"Generic", "FirstOrderLowPassFilter", "MedianFilter"}}};
    Argument<std::vector<double>> numerator{
        this, "numerator", {.initial = {1}, .doc = "b_0 b_1 ..., Generic only"}};
    Argument<std::vector<double>> denominator{
        this, "denominator", {.initial = {1}, .doc = "a_0 a_1 ..., Generic only"}};
    Argument<double> cut_frequency{
        this, "cut_frequency", {.initial = 1, .above = 0, .doc = "Fc, Hz, FirstOrderLowPassFilter only"}};
    Argument<int> order{
        this, "order", {.initial = 3, .minimum = 1, .doc = "length of the window, MedianFilter only"}};
    Argument<std::vector<double>> y0{
        this, "y0", {.doc = "initial output, one element or one per signal element; none: zero"}};
    Argument<std::vector<double>> u0{
        this, "u0", {.doc = "initial input, Generic only, used where the numerator sums to zero"}};

    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}, .unit = any_unit, .doc = "signal to filter"}};
    Output<Vector> y{this, "y", {.shape = {n}, .unit = any_unit, .doc = "filtered signal"}};
    DiscreteState<Matrix> past_u{
        this,
        "past_u",
        {.shape = {n, past_inputs()}, .unit = any_unit, .doc = "former inputs, latest first"}};
    DiscreteState<Matrix> past_y{
        this,
        "past_y",
        {.shape = {n, past_outputs()}, .unit = any_unit, .doc = "former outputs, latest first"}};
    Scratch<Vector> window{this, [this] { return Vector(*order); }};

    void infer(Inference& inference) const override {
        const Size* size = inference.size(u);
        for (const auto& [values, label] : {std::pair(&*y0, "y0"), std::pair(&*u0, "u0")})
            if (size && values->size() > 1 && static_cast<int>(values->size()) != size->rows)
                inference.refuse(std::string("argument '") + label + "' has " +
                                 std::to_string(values->size()) + " elements, but the signal has " +
                                 std::to_string(size->rows) +
                                 "; give one element or as many as the signal has");
    }

    Status reset(Now, After after) const noexcept override {
        auto inputs = after[past_u];
        auto outputs = after[past_y];
        const auto element = [](const std::vector<double>& v, Eigen::Index i) {
            return v.empty() ? 0.0 : v[v.size() == 1 ? 0 : static_cast<std::size_t>(i)];
        };
        inputs.setZero();
        outputs.setZero();
        if (y0->empty()) return ok;
        if (is("MedianFilter")) {
            for (Eigen::Index i = 0; i < inputs.rows(); ++i) inputs.row(i).setConstant(element(*y0, i));
            return ok;
        }
        // Steady state at y0, so that the filter goes on from there.
        const Coefficients c = coefficients(1.0);
        const double sum_b = c.sum_b, sum_a = c.sum_a;
        for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
            const double y_i = element(*y0, i);
            if (std::abs(sum_b) > 1e-9) {
                inputs.row(i).setConstant(sum_a / sum_b * y_i);
                outputs.row(i).setConstant(y_i);
            } else {
                inputs.row(i).setConstant(element(*u0, i));
                const double rest = denominator->front() - sum_a; // -Σ_{i≥1} a_i
                outputs.row(i).setConstant(std::abs(rest) > 1e-9 ? denominator->front() / rest * y_i : 0.0);
            }
        }
        return ok;
    }

    Status output(Now at, Out out) const noexcept override {
        if (is("MedianFilter")) return median(at, out);
        const auto inputs = at[past_u];
        const auto outputs = at[past_y];
        auto result = out[y];
        const Coefficients c = coefficients(at.period());
        for (Eigen::Index i = 0; i < result.size(); ++i) {
            double sum = c.b(0) * at[u](i);
            for (Eigen::Index k = 0; k < inputs.cols(); ++k) sum += c.b(k + 1) * inputs(i, k);
            for (Eigen::Index k = 0; k < outputs.cols(); ++k) sum -= c.a(k + 1) * outputs(i, k);
            result(i) = sum / c.a(0);
        }
        return ok;
    }

    Status update(Now at, Next next) const noexcept override {
        shift(at[u], at[past_u], next[past_u]);
        shift(at[y], at[past_y], next[past_y]);
        return ok;
    }

  private:
    /// Coefficients without a copy: the generic ones, or those of the low-pass for the step's period.
    struct Coefficients {
        const double *numerator, *denominator;
        double low_b[2], low_a[2];
        double sum_a = 0, sum_b = 0;
        double b(Eigen::Index i) const { return numerator ? numerator[i] : low_b[i]; }
        double a(Eigen::Index i) const { return denominator ? denominator[i] : low_a[i]; }
    };

    Coefficients coefficients(double period) const {
        Coefficients c{numerator->data(), denominator->data(), {}, {}};
        if (is("FirstOrderLowPassFilter")) {
            const double tau = 1 / (2 * std::numbers::pi * cut_frequency);
            c = {nullptr, nullptr, {period, period}, {2 * tau + period, period - 2 * tau}};
        }
        for (int i = 0; i <= past_inputs(); ++i) c.sum_b += c.b(i);
        for (int i = 0; i <= past_outputs(); ++i) c.sum_a += c.a(i);
        return c;
    }

    bool is(const char* type) const { return *filter_type == type; }
    int past_inputs() const {
        if (is("MedianFilter")) return *order - 1;
        return is("Generic") ? std::max(0, static_cast<int>(numerator->size()) - 1) : 1;
    }
    int past_outputs() const {
        if (is("MedianFilter")) return 0;
        return is("Generic") ? std::max(0, static_cast<int>(denominator->size()) - 1) : 1;
    }

    Status median(Now at, Out out) const noexcept {
        const auto inputs = at[past_u];
        auto& values = at[window];
        for (Eigen::Index i = 0; i < out[y].size(); ++i) {
            values(0) = at[u](i);
            for (Eigen::Index k = 0; k < inputs.cols(); ++k) values(k + 1) = inputs(i, k);
            if (values.hasNaN()) { // has no order
                out[y](i) = std::numeric_limits<double>::quiet_NaN();
                continue;
            }
            const auto middle = values.data() + values.size() / 2;
            std::nth_element(values.data(), middle, values.data() + values.size());
            const double upper = *middle;
            const bool is_even = values.size() % 2 == 0;
            out[y](i) = is_even ? 0.5 * (upper + *std::max_element(values.data(), middle)) : upper;
        }
        return ok;
    }

    template <class Latest, class Past, class NextPast>
    static void shift(const Latest& latest, const Past& past, NextPast next) {
        if (past.cols() == 0) return;
        next.rightCols(past.cols() - 1) = past.leftCols(past.cols() - 1);
        next.col(0) = latest;
    }

    void check() {
        const auto zeros = [](const std::vector<double>& v) {
            return std::all_of(v.begin(), v.end(), [](double x) { return x == 0; });
        };
        if (is("Generic") && (numerator->empty() || zeros(*numerator)))
            problem("argument 'numerator' has no coefficient other than 0; give b_0 b_1 ...");
        if (is("Generic") && (denominator->empty() || denominator->front() == 0))
            problem("argument 'denominator' must begin with a_0 other than 0");
    }
};

/// Third-order filter whose response to a step approximates a minimum-jerk trajectory; 90 % of it are done in
/// T:
///
///   d³p/dt³ = α (p - u) + β dp/dt + γ d²p/dt²,   α = -150.765868956161/T³, β = -84.9812819469538/T², γ =
///   -15.9669610709384/T
///
/// discretised by Tustin's rule with step h: x⁺ = x + h/2 (f(x, u) + f(x⁺, u⁺)). Before the first step it
/// rests at the reference (or at `initial`). When the settling time changes, position, velocity and
/// acceleration go on; with reset_on_settling_time_change it goes on from rest at the last position. Source:
/// U. Pattacini et al., An experimental evaluation of a novel minimum-jerk Cartesian controller, 2010.
class MinimumJerkTrajectoryGenerator final : public Block, public Differentiable {
  public:
    using Block::Block;
    Argument<bool> compute_first_derivative{
        this, "compute_first_derivative", {.initial = true, .doc = "port velocity"}};
    Argument<bool> compute_second_derivative{
        this, "compute_second_derivative", {.initial = true, .doc = "port acceleration"}};
    Argument<bool> read_initial_value{this, "read_initial_value", {.initial = false, .doc = "port initial"}};
    Argument<bool> read_external_settling_time{
        this,
        "read_external_settling_time",
        {.initial = false, .doc = "port settling_time instead of the parameter"}};
    Argument<bool> reset_on_settling_time_change{
        this,
        "reset_on_settling_time_change",
        {.initial = false, .doc = "a new settling time starts at rest from the present position"}};

    Dim n{this, "n"};
    Dim k{this, "k"};
    Parameter<double> settling{this,
                               "settling_time",
                               {.initial = {3},
                                .above = 0,
                                .unit = unit<"s">,
                                .doc = "T",
                                .present = !*read_external_settling_time}};
    Input<Vector> u{this, "reference", {.shape = {n}, .unit = any_unit, .doc = "where to go"}};
    Input<Vector> initial{this,
                          "initial",
                          {.shape = {k},
                           .unit = any_unit,
                           .doc = "where to start, one element or as many as the reference",
                           .present = read_initial_value}};
    Input<Vector> settling_input{
        this,
        "settling",
        {.shape = {1}, .unit = unit<"s">, .doc = "T", .present = read_external_settling_time}};
    Output<Vector> position{this, "position", {.shape = {n}, .unit = any_unit, .doc = "smoothed reference"}};
    Output<Vector> velocity{
        this,
        "velocity",
        {.shape = {n}, .unit = any_unit, .doc = "its first derivative", .present = compute_first_derivative}};
    Output<Vector> acceleration{this,
                                "acceleration",
                                {.shape = {n},
                                 .unit = any_unit,
                                 .doc = "its second derivative",
                                 .present = compute_second_derivative}};
    DiscreteState<Matrix> r{
        this, "r", {.shape = {n, 3}, .unit = any_unit, .doc = "x + h/2 f(x, u) of the last step"}};
    DiscreteState<Vector> last_position{
        this, "last_position", {.shape = {n}, .unit = any_unit, .doc = "position of the last step"}};
    DiscreteState<double> last_settling{
        this, "last_settling", {.unit = unit<"s">, .doc = "T of the last step; 0 before the first"}};

    void infer(Inference& inference) const override {
        const Size *wide = inference.size(u), *start = inference.size(initial);
        if (wide && start && start->rows != 1 && start->rows != wide->rows)
            inference.refuse("input 'initial' has " + std::to_string(start->rows) +
                             " elements, but the reference has " + std::to_string(wide->rows) +
                             "; give one element or as many as the reference has");
    }

    Status output(Now at, Out out) const noexcept override {
        const double T = settling_time(at);
        if (!(T > 0)) return Status::failure("the settling time must be above 0 s");
        const Coefficients c(T, at.period() / 2);
        auto p = out[position];
        for (Eigen::Index i = 0; i < p.size(); ++i) {
            const Motion x = c.solve(begin(at, i, T), at[u](i));
            p(i) = x[0];
            if (velocity.is_present()) out[velocity](i) = x[1];
            if (acceleration.is_present()) out[acceleration](i) = x[2];
        }
        return ok;
    }

    Status update(Now at, Next next) const noexcept override {
        const double T = settling_time(at);
        const Coefficients c(T, at.period() / 2);
        auto half_ahead = next[r];
        const auto wanted = at[u], p = at[position];
        const bool has_all = velocity.is_present() && acceleration.is_present();
        for (Eigen::Index i = 0; i < wanted.size(); ++i) {
            const Motion x = has_all ? Motion{p(i), at[velocity](i), at[acceleration](i)}
                                     : c.solve(begin(at, i, T), wanted(i));
            const Motion ahead = c.half_ahead(x, wanted(i));
            half_ahead.row(i) << ahead[0], ahead[1], ahead[2];
        }
        next[last_position] = at[position];
        next[last_settling] = T;
        return ok;
    }

    bool directional_derivative(Now at, Changes& changes) const override {
        for_each_change(at, changes, [&](Eigen::Index i, Eigen::Index c, const Motion& x, const Motion&) {
            changes[position](i, c) = x[0];
            if (velocity.is_present()) changes[velocity](i, c) = x[1];
            if (acceleration.is_present()) changes[acceleration](i, c) = x[2];
        });
        return true;
    }

    bool directional_derivative_of_update(Now at, Changes& changes) const override {
        const Eigen::Index n = at[u].size();
        for_each_change(at, changes,
                        [&](Eigen::Index i, Eigen::Index c, const Motion& x, const Motion& ahead) {
                            for (Eigen::Index k = 0; k < 3; ++k)
                                changes.next(r)(i + k * n, c) = ahead[static_cast<std::size_t>(k)];
                            changes.next(last_position)(i, c) = x[0];
                        });
        if (changes.moves(settling_input)) changes.next(last_settling) = changes[settling_input];
        return true;
    }

  private:
    using Motion = std::array<double, 3>; ///< position, velocity, acceleration

    /// Of the equation for steps of 2 h.
    struct Coefficients {
        Coefficients(double T, double half)
            : alpha(-150.765868956161 / (T * T * T)), beta(-84.9812819469538 / (T * T)),
              gamma(-15.9669610709384 / T), h(half),
              implicit(1 - h * gamma - h * h * beta - h * h * h * alpha) {}
        double alpha, beta, gamma, h, implicit;

        /// x in this step, x - h f(x, u) = p.
        Motion solve(const Motion& p, double u) const {
            const double rest = p[2] + h * alpha * (p[0] + h * p[1] - u) + h * beta * p[1];
            const double a = rest / implicit;
            const double v = p[1] + h * a;
            return {p[0] + h * v, v, a};
        }
        Motion half_ahead(const Motion& x, double u) const {
            const double jerk = alpha * (x[0] - u) + beta * x[1] + gamma * x[2];
            return {x[0] + h * x[1], x[1] + h * x[2], x[2] + h * jerk};
        }
    };
    double settling_time(Now at) const {
        return settling_input.is_present() ? at[settling_input](0) : at[settling];
    }

    /// What the step starts from for element i: x + h/2 f(x, u) of the last step, which is x where it rests.
    /// `value` gives an element of what is read.
    template <class Value> Motion begin(Now at, Eigen::Index i, double T, const Value& value) const {
        const double before = at[last_settling];
        if (before == 0 && !initial.is_present()) return {value(u, i), 0, 0};
        if (before == 0) return {value(initial, at[initial].size() == 1 ? 0 : i), 0, 0};
        if (reset_on_settling_time_change && std::abs(T - before) > 1e-5)
            return {value(last_position, i), 0, 0};
        const Eigen::Index n = at[u].size();
        return {value(r, i), value(r, i + n), value(r, i + 2 * n)};
    }
    Motion begin(Now at, Eigen::Index i, double T) const {
        return begin(at, i, T, [&](const auto& key, Eigen::Index e) { return at[key].data()[e]; });
    }

    /// see(element, direction, changes of x and of what is half ahead of it). All is linear in states and
    /// inputs but for T, which changes the jerk of x by that of α' = -3 α/T, β' = -2 β/T, γ' = -γ/T.
    template <class See> void for_each_change(Now at, const Changes& changes, See&& see) const {
        const double T = settling_time(at);
        const Coefficients of(T, at.period() / 2);
        for (Eigen::Index c = 0; c < changes.directions(); ++c) {
            const auto change = [&](const auto& key, Eigen::Index e) {
                return changes.moves(key) ? changes[key](e, c) : 0;
            };
            const double relative = change(settling_input, 0) / T;
            for (Eigen::Index i = 0; i < at[u].size(); ++i) {
                const Motion x = of.solve(begin(at, i, T), at[u](i));
                const double du = change(u, i),
                             more = -relative * of.h *
                                    (3 * of.alpha * (x[0] - at[u](i)) + 2 * of.beta * x[1] + of.gamma * x[2]);
                Motion p = begin(at, i, T, change);
                p[2] += more;
                const Motion dx = of.solve(p, du);
                Motion ahead = of.half_ahead(dx, du);
                ahead[2] += more;
                see(i, c, dx, ahead);
            }
        }
    }
};

} // namespace

void add_filters(Library& library) {
    library.group("filters")
        .add<DiscreteFilter>(
            "DiscreteFilter",
            "Element-wise discrete filter: generic, first-order low-pass or median. Generic: y[k] = (sum b_i "
            "u[k-i] - sum_{i>=1} a_i y[k-i]) / a_0. FirstOrderLowPassFilter: the same with b = [T, T], a = "
            "[2 tau + T, T - 2 tau], tau = 1/(2 pi Fc), T the block's sample time (Tustin's rule). "
            "MedianFilter: the median of the last `order` inputs; of an even number, the mean of the middle "
            "two. It starts at rest in zero, or in the steady state whose output is y0. Errors: coefficients "
            "that are all zero, a_0 = 0, y0 or u0 of another size than the signal.")
        .add<MinimumJerkTrajectoryGenerator>(
            "MinimumJerkTrajectoryGenerator",
            "Smooths a reference by a third-order filter that approximates minimum-jerk motion; gives "
            "velocity and acceleration too. p''' = alpha (p - u) + beta p' + gamma p'' with alpha = "
            "-150.766/T^3, beta = -84.981/T^2, gamma = -15.967/T by Tustin's rule; nine tenths of a step of "
            "the reference are done after T. It starts at rest at the reference, or at `initial`. When T "
            "changes, position, velocity and acceleration go on smoothly; with reset_on_settling_time_change "
            "velocity and acceleration restart from zero. Source: U. Pattacini et al., An experimental "
            "evaluation of a novel minimum-jerk Cartesian controller for humanoid robots, 2010. Errors: a "
            "settling time at the input that is not above 0 fails the step.");
}

} // namespace bf::toolbox
