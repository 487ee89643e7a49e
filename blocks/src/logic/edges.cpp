// Edges, intervals, truth tables and flip-flops.
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/routing.hpp"

#include "../groups.hpp"
#include "../guards.hpp"

#include <algorithm>
#include <cmath>

namespace bf::blocks {

namespace {

using Booleans = Array<bool>;

/// y = an edge of u in this step.
class EdgeDetect final : public Block {
  public:
    explicit EdgeDetect(const Arguments& arguments) : Block(arguments) {
        const auto& which = *edge;
        if (which == "rising")
            OutputRule(this, kernels::RisingEdge{}, y, previous, u);
        else if (which == "falling")
            OutputRule(this, kernels::FallingEdge{}, y, previous, u);
        else if (which == "either")
            OutputRule(this, kernels::EitherEdge{}, y, previous, u);
        else if (which == "change")
            OutputRule(this, kernels::Changed{}, y, previous, u);
        else if (which == "increase")
            OutputRule(this, kernels::Increased{}, y, previous, u);
        else
            OutputRule(this, kernels::Decreased{}, y, previous, u);
    }
    Argument<std::string> edge{
        this,
        "edge",
        {.initial = "rising",
         .doc = "rising: u > 0 after u ≤ 0, falling: the reverse, either of them; or any change, increase or "
                "decrease since the step before",
         .choices = {"rising", "falling", "either", "change", "increase", "decrease"}}};
    AnyShape shape{this};
    Parameter<> initial{
        this, "initial", {.initial = {0}, .unit = any_unit, .doc = "u before the first step"}};
    Input<> u{this, "u", any(shape)};
    Output<Booleans> y{this, "y", {.shape = shape}};
    DiscreteState<> previous{this, "previous", any(shape, "input of the step before", initial)};
    UpdateRule rule_previous{this, kernels::Copy{}, next(previous), u};
};

/// y = u lies in an interval.
class IntervalTest final : public Block {
  public:
    using Block::Block;
    Argument<bool> closed_lower{
        this, "closed_lower", {.initial = true, .doc = "the lower end belongs to it"}};
    Argument<bool> closed_upper{
        this, "closed_upper", {.initial = true, .doc = "the upper end belongs to it"}};
    Parameter<> lower{this, "lower", {.initial = {-0.5}, .unit = any_unit, .doc = "lower end"}};
    Parameter<> upper{
        this, "upper", {.initial = {0.5}, .at_least = lower.index(), .unit = any_unit, .doc = "upper end"}};
    Input<> u{this, "u", any()};
    Output<Booleans> y{this, "y"};
    OutputRule rule{
        this, kernels::Inside{}, y, Constants({double(*closed_lower), double(*closed_upper)}), lower, upper,
        u};
    Crossing at_lower{this, "at_lower", u, lower};
    Crossing at_upper{this, "at_upper", u, upper};

    void infer(Inference& inference) const override {
        at_lower.infer(*this, inference);
        at_upper.infer(*this, inference);
        broadcast(*this, inference, slots(u, lower, upper), y.index());
    }
};

/// y = row of a truth table.
class CombinatorialLogic final : public Block {
  public:
    explicit CombinatorialLogic(const Arguments& arguments) : Block(arguments) {
        if (inputs < 1 || table->rows() != Eigen::Index(1) << inputs || table->cols() < 1)
            problem("argument 'table' has " + std::to_string(table->rows()) +
                    " rows, but needs one for each combination of inputs: 2, 4, 8, …");
    }
    Argument<Matrix> table{this,
                           "table",
                           {.initial = (Matrix(8, 1) << 0, 0, 0, 0, 0, 0, 0, 1).finished(),
                            .doc = "one row per combination of the inputs, counting in binary digits"}};
    const int inputs = static_cast<int>(std::lround(std::log2(std::max<double>(1, double(table->rows())))));
    Input<> u{this, "u", any({Extent(std::max(1, inputs))}, "truth values, the highest digit first")};
    Output<Vector> y{this, "y", any({Extent(std::max<int>(1, static_cast<int>(table->cols())))}, "the row")};
    OutputRule rule{this, kernels::TruthTable{}, y, Constants({table->data(), table->data() + table->size()}),
                    u};
};

/// y = u(index), or the elements that a vector of indices asks for.
class IndexVector final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Argument<bool> from_zero{this, "from_zero", {.initial = false, .doc = "the first element is 0, else 1"}};
    Input<Other> index{this, "index", any(shape, "which elements, without their fraction")};
    Input<Any> u{this, "u", any("elements to choose from")};
    Output<Any> y{this, "y", any(shape)};
    Workspace<Array<double>> place{this, "place", {.shape = shape}};
    OutputRule rule_place{this, kernels::Place{}, place, Constants({*from_zero ? 1.0 : 0.0}), index};
    OutputRule rule{this, kernels::Select{}, y, place, u};
};

/// Set-reset flip-flop.
class SRFlipFlop final : public Block {
  public:
    using Block::Block;
    Parameter<bool> initial{this, "initial", {.doc = "q before the first step"}};
    Input<bool> set{this, "s", {.doc = "makes q true"}};
    Input<bool> reset_input{this, "r", {.doc = "makes q false"}};
    Output<bool> q{this, "q", {.doc = "state"}};
    Output<bool> nq{this, "nq", {.doc = "its inverse; false while s and r are both true"}};
    DiscreteState<bool> x{this, "x", {.doc = "q of the step before", .initial_from = initial.index()}};
    OutputRule rule{this, kernels::SetReset{}, q, nq, x, set, reset_input};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), q};
};

/// Flip-flop that samples d where the clock rises.
class DFlipFlop final : public Block {
  public:
    using Block::Block;
    Parameter<bool> initial{this, "initial", {.doc = "q before the first step"}};
    Input<bool> d{this, "d", {.doc = "value taken over"}};
    Input<bool> clock{this, "clock", {.doc = "takes d over where it rises"}};
    Output<bool> q{this, "q", {.doc = "state"}};
    Output<bool> nq{this, "nq", {.doc = "its inverse"}};
    DiscreteState<bool> x{this, "x", {.doc = "q of the step before", .initial_from = initial.index()}};
    DiscreteState<bool> clock_before{
        this, "clock_before", {.initial = {1}, .doc = "clock of the step before"}};
    OutputRule rule{this, kernels::DFlipFlop{}, q, nq, x, clock_before, d, clock};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), q};
    UpdateRule rule_clock{this, kernels::Copy{}, next(clock_before), clock};
};

/// Flip-flop that sets, resets or toggles where the clock falls.
class JKFlipFlop final : public Block {
  public:
    using Block::Block;
    Parameter<bool> initial{this, "initial", {.doc = "q before the first step"}};
    Input<bool> j{this, "j", {.doc = "makes q true; with k toggles it"}};
    Input<bool> clock{this, "clock", {.doc = "acts where it falls"}};
    Input<bool> k{this, "k", {.doc = "makes q false; with j toggles it"}};
    Output<bool> q{this, "q", {.doc = "state"}};
    Output<bool> nq{this, "nq", {.doc = "its inverse"}};
    DiscreteState<bool> x{this, "x", {.doc = "q of the step before", .initial_from = initial.index()}};
    DiscreteState<bool> clock_before{this, "clock_before", {.doc = "clock of the step before"}};
    OutputRule rule{this, kernels::JKFlipFlop{}, q, nq, x, clock_before, j, k, clock};
    UpdateRule rule_x{this, kernels::Copy{}, next(x), q};
    UpdateRule rule_clock{this, kernels::Copy{}, next(clock_before), clock};
};

} // namespace

void add_edges(Library& library) {
    library.group("logic")
        .add<EdgeDetect>("EdgeDetect", "Tells where a signal rises, falls or changes, element by element. y "
                                       "= true in the step of the edge.")
        .add<IntervalTest>(
            "IntervalTest",
            "Tells whether a signal lies in an interval. y = lower ≤ u ≤ upper, or < at an open end.")
        .add<CombinatorialLogic>("CombinatorialLogic",
                                 "Truth table. y = the row whose number has the inputs as binary digits, the "
                                 "first input being the highest; refuses a table without 2^n rows.")
        .add<IndexVector>("IndexVector", "Chooses elements by a signal. y_i = u(index_i), counted from 1 or "
                                         "0; an index outside u stops the run.")
        .add<SRFlipFlop>("SRFlipFlop",
                         "Set-reset flip-flop. q = 1 by s, 0 by r, as before by neither; by both q = nq = 0.")
        .add<DFlipFlop>("DFlipFlop", "D flip-flop. q takes d over where the clock rises.")
        .add<JKFlipFlop>("JKFlipFlop", "J-K flip-flop. Where the clock falls j sets q, k resets it, both "
                                       "toggle it.");
}

} // namespace bf::blocks
