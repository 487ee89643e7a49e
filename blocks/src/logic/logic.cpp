// Truth values, comparisons and choices.
#include "bf/kernels/logic.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/standard.hpp"

#include "../groups.hpp"
#include "../guards.hpp"

#include <algorithm>
#include <cmath>

namespace bf::blocks {

namespace {

using Booleans = Array<bool>;

/// y = u1 op u2 op …, element by element; of a single input over its elements.
class Logic final : public Block {
  public:
    explicit Logic(const Arguments& arguments) : Block(arguments) {
        const auto& op = *operation;
        if (op == "NOT")
            OutputRule(this, kernels::Not{}, y, u[0]);
        else if (op == "AND")
            OutputRule(this, kernels::And{}, y, u);
        else if (op == "OR")
            OutputRule(this, kernels::Or{}, y, u);
        else if (op == "NAND")
            OutputRule(this, kernels::Nand{}, y, u);
        else if (op == "NOR")
            OutputRule(this, kernels::Nor{}, y, u);
        else if (op == "XOR")
            OutputRule(this, kernels::Xor{}, y, u);
        else
            OutputRule(this, kernels::Xnor{}, y, u);
    }
    Argument<std::string> operation{this,
                                    "operator",
                                    {.initial = "AND",
                                     .doc = "how truth values are joined",
                                     .choices = {"AND", "OR", "NAND", "NOR", "XOR", "XNOR", "NOT"}}};
    Argument<int> inputs{
        this,
        "inputs",
        {.initial = 2, .minimum = 1, .maximum = most_ports, .doc = "number of inputs; NOT has one"}};
    InputList<> u{this, "u", *operation == "NOT" ? 1 : *inputs, {}};
    Output<Booleans> y{this, "y"};

    void infer(Inference& inference) const override {
        if (u.size() == 1 && *operation != "NOT") return inference.set(y, Size{});
        broadcast(*this, inference, slots(u), y.index());
    }
};

template <class... Operands>
void declare_relation(Block* block, const std::string& op, const Operands&... operands) {
    if (op == "==")
        OutputRule(block, kernels::Equal{}, operands...);
    else if (op == "~=")
        OutputRule(block, kernels::NotEqual{}, operands...);
    else if (op == "<")
        OutputRule(block, kernels::Less{}, operands...);
    else if (op == "<=")
        OutputRule(block, kernels::LessEqual{}, operands...);
    else if (op == ">")
        OutputRule(block, kernels::Greater{}, operands...);
    else
        OutputRule(block, kernels::GreaterEqual{}, operands...);
}

const std::vector<std::string>& relations() {
    static const std::vector<std::string> all{"==", "~=", "<", "<=", ">", ">="};
    return all;
}

/// y = (u1 op u2), element by element.
class Relational final : public Block {
  public:
    explicit Relational(const Arguments& arguments) : Block(arguments) {
        declare_relation(this, *operation, y, u1, u2);
    }
    Argument<std::string> operation{
        this, "operator", {.initial = "<=", .doc = "u1 operator u2", .choices = relations()}};
    Input<> u1{this, "u1", any()};
    Input<> u2{this, "u2", any()};
    Output<Booleans> y{this, "y"};
    Crossing crossing{this, "crossing", u1, u2};

    void infer(Inference& inference) const override {
        crossing.infer(*this, inference);
        broadcast(*this, inference, slots(u1, u2), y.index());
    }
};

/// y = (u op constant), element by element.
class CompareToConstant final : public Block {
  public:
    explicit CompareToConstant(const Arguments& arguments) : Block(arguments) {
        declare_relation(this, *operation, y, u, constant);
    }
    Argument<std::string> operation{
        this, "operator", {.initial = "<=", .doc = "u operator constant", .choices = relations()}};
    Parameter<Array<double>> constant{
        this, "constant", {.initial = {0}, .unit = any_unit, .doc = "what u is compared to; scalars expand"}};
    Input<> u{this, "u", any()};
    Output<Booleans> y{this, "y"};
    Crossing crossing{this, "crossing", u, constant};

    void infer(Inference& inference) const override {
        crossing.infer(*this, inference);
        broadcast(*this, inference, slots(u, constant), y.index());
    }
};

/// y = (u op 0), element by element.
class CompareToZero final : public Block {
  public:
    explicit CompareToZero(const Arguments& arguments) : Block(arguments) {
        declare_relation(this, *operation, y, u, Constants({0}));
    }
    Argument<std::string> operation{
        this, "operator", {.initial = "<=", .doc = "u operator 0", .choices = relations()}};
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<Booleans> y{this, "y", {.shape = shape}};
    Crossing crossing{this, "crossing", u, Constants({0})};

    void infer(Inference& inference) const override { crossing.infer(*this, inference); }
};

/// y = u1 where the criterion holds for the control, else u3.
class Switch final : public Block {
  public:
    explicit Switch(const Arguments& arguments) : Block(arguments) {
        if (*criterion == ">=")
            OutputRule(this, kernels::GreaterEqual{}, holds, control, threshold);
        else if (*criterion == ">")
            OutputRule(this, kernels::Greater{}, holds, control, threshold);
        else
            OutputRule(this, kernels::NotEqual{}, holds, control, Constants({0}));
        OutputRule(this, kernels::Choose{}, y, u1, holds, u3);
    }
    Argument<std::string> criterion{
        this,
        "criterion",
        {.initial = ">=", .doc = "control against threshold, or control ~= 0", .choices = {">=", ">", "~="}}};
    Parameter<Array<double>> threshold{
        this, "threshold", {.initial = {0}, .unit = any_unit, .doc = "limit of the control; scalars expand"}};
    Input<Any> u1{this, "u1", any("taken where the criterion holds")};
    Input<Other> control{this, "u2", any("control")};
    Input<Any> u3{this, "u3", any("taken elsewhere")};
    Output<Any> y{this, "y", any()};
    Workspace<Booleans> holds{this, "holds", {}};
    Crossing crossing{this, "crossing", control, threshold};

    void infer(Inference& inference) const override {
        crossing.infer(*this, inference);
        broadcast(*this, inference, slots(control, threshold), holds.index());
        broadcast(*this, inference, slots(u1, control, u3, threshold), y.index());
    }
};

/// y = the input whose index equals the control.
class MultiportSwitch final : public Block {
  public:
    using Block::Block;
    Argument<int> inputs{
        this,
        "inputs",
        {.initial = 2, .minimum = 1, .maximum = most_ports, .doc = "number of inputs to choose from"}};
    Argument<std::vector<int>> indices{
        this, "indices", {.initial = {}, .doc = "control value of each input; empty: 1, 2, …"}};
    Input<Other> control{this, "control", any("index of the input wanted")};
    InputList<Any> u{this, "u", *inputs, any()};
    Output<Any> y{this, "y", any()};
    Workspace<double> wanted{this, "wanted", {}};
    OutputRule rule_wanted{this, kernels::Copy{}, wanted, control};
    OutputRule rule{this, kernels::MultiportSwitch{}, y, Constants(cases()), wanted, u};
    GuardOf<std::int32_t> at_change{this, "at_change", {.doc = "index wanted"}};
    GuardRule guard{this, kernels::WholeNumber{}, at_change, control};

    void infer(Inference& inference) const override {
        if (const Size* s = inference.size(control); s && !s->is_scalar())
            inference.refuse(label(resolution(), control.index()) + " must be a scalar");
        broadcast(*this, inference, slots(u), y.index());
    }

  private:
    std::vector<double> cases() {
        std::vector<double> values(indices->begin(), indices->end());
        if (values.empty())
            for (int i = 1; i <= u.size(); ++i) values.push_back(i);
        if (static_cast<int>(values.size()) != u.size()) {
            problem("argument 'indices' has " + std::to_string(values.size()) + " values, but there are " +
                    std::to_string(u.size()) + " inputs");
            values.resize(static_cast<std::size_t>(u.size()));
        }
        return values;
    }
};

/// y = table(row, :), 1-D.
class LookUpRow final : public Block {
  public:
    using Block::Block;
    Parameter<Any> table{
        this, "table", {.initial = {1}, .unit = any_unit, .doc = "one case per row", .as_written = true}};
    Input<Other> row{this, "row", {.doc = "row wanted, counted from 1; the fraction is cut off"}};
    Output<Any> y{this, "y", any()};
    Workspace<double> wanted{this, "wanted", {}};
    OutputRule rule_wanted{this, kernels::Copy{}, wanted, row};
    OutputRule rule{this, kernels::LookUpRow{}, y, table, wanted};
    GuardOf<std::int32_t> at_change{this, "at_change", {.doc = "row wanted"}};
    GuardRule guard{this, kernels::WholeNumber{}, at_change, row};

    void infer(Inference& inference) const override {
        if (const Size* s = inference.size(row); s && !s->is_scalar())
            inference.refuse(label(resolution(), row.index()) + " must be a scalar");
        if (const Size* s = inference.size(table)) inference.set(y, Size{s->cols, 1, false});
    }
};

} // namespace

void add_logic(Library& library) {
    library.group("logic")
        .add<Logic>("Logic",
                    "Joins truth values. Element by element over its inputs, an element being true when it "
                    "is not 0; a single input is joined over its elements, NOT inverts each.")
        .add<Relational>("Relational", "Compares two signals. y = (u1 operator u2), element by element.")
        .add<CompareToConstant>("CompareToConstant",
                                "Compares with a constant. y = (u operator constant), element by element.")
        .add<CompareToZero>("CompareToZero", "Compares with zero. y = (u operator 0), element by element.")
        .add<Switch>("Switch",
                     "Chooses between two signals. y = u1 where u2 > or >= threshold, or u2 ~= 0, else u3; "
                     "a scalar control switches all elements.")
        .add<MultiportSwitch>("MultiportSwitch",
                              "Chooses one of several signals. y = the input whose index equals the "
                              "control without its fraction; the last one if none does.")
        .add<LookUpRow>("LookUpRow",
                        "Chooses a row of a table. y_j = table(row, j), 1-D; a row outside the table stops "
                        "the run.");
}

} // namespace bf::blocks
