// Polynomials, running extremes, and operations along the elements of a vector.
#include "bf/kernels/functions.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/reduce.hpp"

#include "../elementwise.hpp"
#include "../groups.hpp"
#include "../reset.hpp"

namespace bf::blocks {

namespace {

/// y = u + bias.
class Bias final : public Block {
  public:
    using Block::Block;
    Parameter<> bias{this, "bias", {.initial = {0}, .unit = any_unit, .doc = "what is added"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::Add{}, y, u, bias};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(u, bias), y.index());
    }
};

/// y = c_0 uⁿ + … + c_n.
class Polynomial final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<> coefficients{
        this,
        "coefficients",
        {.initial = {1, 0}, .unit = any_unit, .doc = "c_0 c_1 ..., highest power first"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    OutputRule rule{this, kernels::Polynomial{}, y, coefficients, u};
};

/// y = extreme of u over the steps so far.
class RunningExtreme final : public Block {
  public:
    explicit RunningExtreme(const Arguments& arguments) : Block(arguments) {
        if (reset_input.is_present()) {
            reset_input.declare_edge<OutputRule>(this, restarts);
            OutputRule(this, kernels::Choose{}, from, initial, restarts, x);
            declare(from);
            reset_input.declare_memory(this);
        } else {
            declare(x);
        }
        UpdateRule(this, kernels::Copy{}, next(x), y);
    }
    Argument<std::string> function{
        this, "function", {.initial = "max", .doc = "largest or smallest u", .choices = {"max", "min"}}};
    AnyShape shape{this};
    Parameter<> initial{this, "initial", {.initial = {0}, .unit = any_unit, .doc = "extreme at the start"}};
    Input<> u{this, "u", any(shape)};
    ResetInput reset_input{this};
    Output<> y{this, "y", any(shape)};
    DiscreteState<> x{this, "x", any(shape, "extreme of the steps before", initial)};
    Workspace<Any> from{this, "from", {.shape = shape, .present = reset_input.is_present()}};
    Workspace<bool> restarts{this, "restarts", {.present = reset_input.is_present()}};

    void infer(Inference& inference) const override {
        check_initial(*this, inference, initial.index(), u.index());
    }

  private:
    template <class Before> void declare(const Before& before) {
        if (*function == "max")
            OutputRule(this, kernels::Maximum{}, y, before, u);
        else
            OutputRule(this, kernels::Minimum{}, y, before, u);
    }
};

/// y = u in order.
class Sort final : public Block {
  public:
    using Block::Block;
    Argument<std::string> order{this,
                                "order",
                                {.initial = "ascending",
                                 .doc = "smallest or largest element first",
                                 .choices = {"ascending", "descending"}}};
    AnyShape shape{this}; // not that of u, whose elements stay in their places
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any(shape, "the elements in order; NaN counts as the largest")};
    Output<Array<double>> index{
        this,
        "index",
        {.shape = shape, .doc = "place of each in u, counted from 1; equal ones keep their order"}};
    OutputRule rule{this, kernels::Sort{}, y, index, Constants({double(*order == "descending")}), u};
    GuardOf<Array<std::int32_t>> at_change{
        this, "at_change", {.shape = shape, .doc = "changes where two elements change their places"}};
    GuardRule guard{this, kernels::WholeNumber{}, at_change, index};

    void infer(Inference& inference) const override {
        if (const Size* s = inference.size(u)) inference.set(y, *s);
        if (const Size* s = inference.size(y)) inference.set(u, *s);
    }
};

/// y = place of the first element that is not 0.
class FindFirst final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
    Output<double> y{this, "y", {.doc = "counted from 1, 0 if there is none"}};
    OutputRule rule{this, kernels::FindFirst{}, y, u};
};

/// y = Σ u_i over all elements, each column or each row.
class SumOfElements final : public Block {
  public:
    explicit SumOfElements(const Arguments& arguments) : Block(arguments) {
        if (*along == "columns")
            OutputRule(this, kernels::SumOfColumns{}, y, u);
        else if (*along == "rows")
            OutputRule(this, kernels::SumOfRows{}, y, u);
        else
            OutputRule(this, kernels::SumOfElements{}, y, u);
    }
    Argument<std::string> along{this,
                                "along",
                                {.initial = "all",
                                 .doc = "all elements, or one sum for each column or row",
                                 .choices = {"all", "columns", "rows"}}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (*along == "all")
            inference.set(y, Size{});
        else if (s)
            inference.set(y, *along == "columns" ? Size{1, s->cols, true} : Size{s->rows, 1, true});
    }
};

} // namespace

void add_vectors(Library& library) {
    library.group("math")
        .add<Bias>("Bias", "Adds a constant. y = u + bias, element by element.")
        .add<Polynomial>("Polynomial",
                         "Polynomial with tunable coefficients, by Horner's rule. y = c_0 uⁿ + … + c_n.")
        .add<RunningExtreme>("RunningExtreme",
                             "Largest or smallest value so far, element by element. y[k] = max(y[k-1], "
                             "u[k]), beginning with `initial`, at a reset too. NaN is ignored.")
        .add<SumOfElements>("SumOfElements", "Sum of all elements, or of each column or row. y = Σ u_i.")
        .add<Unary<kernels::CumulativeSum>>("CumulativeSum",
                                            "Sums up along the elements. y_k = u_1 + … + u_k.")
        .add<Sort>("Sort", "Puts the elements in order, and tells where they came from.")
        .add<FindFirst>("FindFirst", "Finds the first element that is not 0.");
}

} // namespace bf::blocks
