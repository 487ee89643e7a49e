// Assertions and what a run reports about itself.
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
    library.group("logic").add<Assertion>(
        "Assertion", "Stops the run when a condition fails. The step in which an element of u is 0 is "
                     "completed.");
    add_state_machine(library);
    library.group("logic").add<Check>(
        "Check", "Reports one number about a signal when the run ends. `kind`: always (1 while u was true at "
                 "every step; reported as true or false alone), final, maximum, minimum, rms (of the "
                 "Euclidean norm) or mean, over the samples from `from_time` on; `passed` tells whether it "
                 "lies within at_least and at_most.");
}

} // namespace bf::blocks
