// A formula as a block.
#include "bf/kernels/expression.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"
#include "formula.hpp"

#include <stdexcept>

namespace bf::blocks {

namespace {

/// y = expression(u1, u2, ..., p).
class Fcn final : public Block {
  public:
    explicit Fcn(const Arguments& arguments) : Block(arguments) {
        if (compiled.edges > 0)
            GuardRule(this, kernels::ExpressionEdges{}, edges, Constants(compiled.code), p, u);
    }
    Argument<std::string> expression{
        this,
        "expression",
        {.initial = "u", .doc = "formula of the inputs u, or u1, u2, ..., and of p(1), p(2), ..."}};
    const Formula compiled = compile();
    Parameter<Array<double>> p{
        this, "p", {.initial = {0}, .unit = mixed_units, .doc = "parameters of the formula"}};
    InputList<> u{this, names(), any("input of the formula")};
    Output<> y{this, "y", any("value of the formula")};
    OutputRule rule{this, kernels::Expression{}, y, Constants(compiled.code), p, u};
    GuardOf<Array<std::int32_t>> edges{
        this,
        "edges",
        {.doc = "change where an operation jumps or has a corner", .present = compiled.edges > 0}};

    void infer(Inference& inference) const override {
        if (const Size* s = inference.size(p); s && s->count() < compiled.parameters)
            inference.refuse("parameter 'p' has " + std::to_string(s->count()) +
                             " elements, but the expression reads p(" + std::to_string(compiled.parameters) +
                             ")");
        if (const Size* s = inference.size(p); s && s->count() > 1 && compiled.is_parameter_whole)
            inference.refuse("the expression reads p, which has " + std::to_string(s->count()) +
                             " elements; write p(1), p(2), ... for each of them");
        std::vector<int> operands;
        for (int i = 0; i < u.size(); ++i) {
            const auto n = static_cast<std::size_t>(i);
            const Size* s = inference.size(u[i]);
            if (s && s->count() < compiled.elements[n])
                inference.refuse(label(resolution(), u[i].index()) + " has no element " +
                                 std::to_string(compiled.elements[n]) + ", which the expression reads");
            if (compiled.whole[n]) operands.push_back(u[i].index());
        }
        if (operands.empty())
            inference.set(y, Size{});
        else
            broadcast(*this, inference, operands, y.index());
        if (const Size* s = inference.size(y); s && compiled.edges > 0)
            inference.set(edges, Size{compiled.edges, s->count(), true});
    }

  private:
    Formula compile() {
        try {
            Formula made = formula(*expression);
            if (made.inputs > 0) return made;
            problem("argument 'expression' reads no input; a Constant has a value without one");
        } catch (const std::invalid_argument& error) {
            problem("argument 'expression': " + std::string(error.what()));
        }
        return formula("u");
    }
    std::vector<std::string> names() const {
        if (compiled.is_single) return {"u"};
        std::vector<std::string> all;
        for (int i = 1; i <= compiled.inputs; ++i) all.emplace_back("u").append(std::to_string(i));
        return all;
    }
};

} // namespace

void add_formulas(Library& library) {
    library.group("math").add<Fcn>(
        "Fcn",
        "Formula over its inputs, element by element; scalars expand, u(3) and u2(3) are single elements. "
        "MATLAB's operators + - * / ^ < <= == ~= & | ~, min, max, mod, rem, atan2, hypot and the usual "
        "functions of one number. An input that the formula leaves out is there all the same: u3 asks for "
        "u1 and u2.");
}

} // namespace bf::blocks
