// State machines, assertions and what a run reports about itself.
#include "bf/base/numbers.hpp"
#include "bf/kernels/standard.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <algorithm>

namespace bf::blocks {

namespace {

/// Stops the run, after the step is complete, when an element of u is 0.
class Assertion final : public Block {
  public:
    explicit Assertion(const Arguments& arguments) : Block(arguments) {
        if (*stop) UpdateRule(this, kernels::Assert{}, u);
    }
    Argument<bool> stop{this, "stop", {.initial = true, .doc = "false switches the assertion off"}};
    Input<> u{this, "u", {.unit = any_unit, .doc = "what must hold: all elements other than 0"}};
};

/// States and timed transitions between them.
class StateMachine final : public Block {
  public:
    explicit StateMachine(const Arguments& arguments) : Block(arguments) { check(); }

    Argument<std::vector<std::string>> states{
        this, "states", {.initial = {"idle"}, .doc = "names of the states, numbered from 1"}};
    Argument<Matrix> transitions{
        this,
        "transitions",
        {.initial = Matrix(0, 4),
         .doc = "rows [from to condition minimum_time], conditions from 1, 0: none"}};
    Parameter<double> initial{this,
                              "initial",
                              {.initial = {1},
                               .minimum = 1,
                               .maximum = static_cast<double>(states->size()),
                               .doc = "number of the first state",
                               .value_names = *states}};
    Input<> conditions{this, "conditions", {.doc = "one truth value per condition", .optional = true}};
    Output<double> state{this, "state", {.doc = "number of the state", .value_names = *states}};
    Output<double> time_in_state{
        this, "time_in_state", {.unit = unit<"s">, .doc = "since the first step of the state"}};
    Output<bool> entered{this, "entered", {.doc = "true in the first step of a state"}};
    DiscreteState<double> x{this, "x", {.doc = "number of the state", .value_names = *states}};
    DiscreteState<double> entry{this, "entry", {.unit = unit<"s">, .doc = "time at which the state began"}};
    DiscreteState<bool> started{this, "started", {.doc = "false before the first step"}};
    OutputRule rule{this,      kernels::StateMachine{},
                    state,     time_in_state,
                    entered,   rows(),
                    initial,   x,
                    entry,     started,
                    at_time,   at_period,
                    conditions};
    UpdateRule rule_x{
        this,   kernels::StateMachineUpdate{}, next(x), next(entry), next(started), state, entered, entry,
        at_time};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(conditions);
        if (!s || transitions->size() == 0 || transitions->cols() != 4) return;
        Eigen::Index row = 0;
        const int needed = static_cast<int>(transitions->col(2).maxCoeff(&row));
        if (s->count() < needed)
            inference.refuse(label(resolution(), conditions.index()) + " is too short: 'transitions', row " +
                             std::to_string(row + 1) + ", names condition " + std::to_string(needed));
    }

  private:
    Constants rows() const {
        if (transitions->cols() != 4) return Constants({});
        return Constants({transitions->data(), transitions->data() + transitions->size()});
    }
    void check() {
        if (transitions->size() == 0) return;
        if (transitions->cols() != 4)
            return problem("argument 'transitions' has " + std::to_string(transitions->cols()) +
                           " columns, but needs 4: from, to, condition, minimum_time");
        const double count = static_cast<double>(states->size());
        for (Eigen::Index i = 0; i < transitions->rows(); ++i) {
            const auto row = transitions->row(i);
            const auto is_state = [&](double s) { return s >= 1 && s <= count && s == std::floor(s); };
            const auto refuse = [&](const char* entry, double given, const std::string& rule) {
                problem("argument 'transitions', row " + std::to_string(i + 1) + ": " + entry + " is " +
                        number_text(given) + ", but " + rule);
            };
            const std::string numbers = "states are numbered 1 to " + std::to_string(states->size());
            if (!is_state(row(0))) refuse("from", row(0), numbers);
            if (!is_state(row(1))) refuse("to", row(1), numbers);
            if (row(2) < 0 || row(2) != std::floor(row(2)))
                refuse("condition", row(2), "conditions are numbered from 1, 0: none");
            if (!(row(3) >= 0)) refuse("minimum_time", row(3), "it must not be negative");
        }
    }
};

/// What the run's summary reports about u.
class Check final : public Block {
  public:
    explicit Check(const Arguments& arguments) : Block(arguments) {
        using kernels::CheckKind;
        if (*kind == "always") declare<CheckKind::always>();
        if (*kind == "final") declare<CheckKind::final>();
        if (*kind == "maximum") declare<CheckKind::maximum>();
        if (*kind == "minimum") declare<CheckKind::minimum>();
        if (*kind == "rms") declare<CheckKind::rms>();
        if (*kind == "mean") declare<CheckKind::mean>();
    }
    Argument<std::string> kind{this,
                               "kind",
                               {.initial = "always",
                                .doc = "what is reported of u",
                                .choices = {"always", "final", "maximum", "minimum", "rms", "mean"}}};
    Parameter<double> from_time{
        this,
        "from_time",
        {.initial = {-infinity}, .unit = unit<"s">, .doc = "earlier samples do not count"}};
    Parameter<double> at_least{
        this, "at_least", {.initial = {-infinity}, .unit = any_unit, .doc = "smallest value that passes"}};
    Parameter<double> at_most{this,
                              "at_most",
                              {.initial = {infinity},
                               .at_least = at_least.index(),
                               .unit = any_unit,
                               .doc = "largest value that passes"}};
    Input<> u{this, "u", any("signal that is checked")};
    DiscreteState<double> value{
        this,
        "value",
        {.unit = any_unit, .doc = "result so far, 0 without a sample", .reported = *kind != "always"}};
    DiscreteState<bool> passed{
        this, "passed", {.doc = "value within its limits; false without a sample", .reported = true}};
    DiscreteState<double> sum{this, "sum", {.unit = any_unit, .doc = "of squares or values"}};
    DiscreteState<double> count{this, "count", {.doc = "samples so far"}};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (s && *kind == "final" && !s->is_scalar())
            inference.refuse(label(resolution(), u.index()) + " must be a scalar for kind 'final'");
    }

  private:
    template <kernels::CheckKind which> void declare() {
        UpdateRule(this, kernels::Check<which>{}, next(value), next(passed), next(sum), next(count), value,
                   passed, sum, count, from_time, at_least, at_most, at_time, u);
    }
};

} // namespace

void add_checks(Library& library) {
    library.group("logic")
        .add<Assertion>("Assertion",
                        "Stops the run when a condition fails. The step in which an element of u is 0 is "
                        "completed.")
        .add<StateMachine>(
            "StateMachine",
            "States with timed transitions. In each step the first row [from to condition "
            "minimum_time] of `transitions` that leaves the present state, whose condition is true and "
            "whose minimum time in the state has passed is taken, at most one per step; the outputs "
            "show the new state at once. Refuses states and conditions that do not exist.")
        .add<Check>(
            "Check",
            "Reports one number about a signal when the run ends. `kind`: always (1 while u was true "
            "at every step; reported as true or false alone), final, maximum, minimum, rms (of the Euclidean "
            "norm) or mean, over the samples from `from_time` on; `passed` tells whether it lies within "
            "at_least and at_most.");
}

} // namespace bf::blocks
