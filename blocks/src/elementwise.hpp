// Blocks that are one kernel and need no argument.
#pragma once

#include "guards.hpp"

#include <optional>

namespace bf::blocks {

/// y = kernel(u), element by element.
template <class Kernel> class Unary final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    OutputRule rule{this, Kernel{}, y, u};
};

/// y = kernel(u), element by element, with a kink or jump at u = 0.
template <class Kernel> class UnaryWithKink final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    OutputRule rule{this, Kernel{}, y, u};
    Crossing at_zero{this, "at_zero", u, Constants({0})};

    void infer(Inference& inference) const override { at_zero.infer(*this, inference); }
};

/// y = kernel(u1, u2), element by element; a scalar expands.
template <class Kernel> class Binary : public Block {
  public:
    using Block::Block;
    Input<> u1{this, "u1", any()};
    Input<> u2{this, "u2", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, Kernel{}, y, u1, u2};

    void infer(Inference& inference) const override { broadcast(*this, inference, slots(u1, u2), y.index()); }
};

/// y = kernel(u1, u2), element by element, which jumps where edges(options, u1, u2) changes.
template <class Kernel, class EdgesKernel, int... options>
class BinaryWithEdges final : public Binary<Kernel> {
  public:
    using Binary<Kernel>::Binary;
    Edges edges = declare_edges();

    void infer(Inference& inference) const override {
        Binary<Kernel>::infer(inference);
        edges.infer(*this, inference);
    }

  private:
    Edges declare_edges() {
        constexpr const char* doc = "changes where y jumps";
        if constexpr (sizeof...(options) > 0)
            return {this, "edge", doc, EdgesKernel{}, Constants({double(options)...}), this->u1, this->u2};
        else
            return {this, "edge", doc, EdgesKernel{}, this->u1, this->u2};
    }
};

/// y = kernel(u), one number from all elements.
template <class Kernel> class Reduction final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any(scalar)};
    OutputRule rule{this, Kernel{}, y, u};
};

/// y = extreme of the inputs, element by element; of a single input over its elements. It has a corner where
/// one takes it over from another. `sign` is -1 for the largest.
template <class OfElements, class OfList, int sign> class Extreme final : public Block {
  public:
    explicit Extreme(const Arguments& arguments) : Block(arguments) {
        if (u.size() == 1)
            OutputRule(this, OfElements{}, y, u[0]);
        else
            OutputRule(this, OfList{}, y, u);
        const Constants signs({double(sign)});
        if (u.size() == 1)
            GuardRule(this, kernels::ExtremeElement{}, element, signs, u[0]);
        else if (u.size() == 2)
            crossing.emplace(this, "crossing", u[0], u[1]);
        else
            operand.emplace(this, "operand", "number of the input that is y", kernels::ExtremeOperand{},
                            signs, u);
    }
    Argument<int> inputs{
        this, "inputs", {.initial = 2, .minimum = 1, .maximum = most_ports, .doc = "number of inputs"}};
    InputList<> u{this, "u", *inputs, any()};
    Output<> y{this, "y", any()};
    GuardOf<std::int32_t> element{
        this, "element", {.doc = "number of the element that is y", .present = u.size() == 1}};
    std::optional<Crossing> crossing;
    std::optional<Edges> operand;

    void infer(Inference& inference) const override {
        if (u.size() == 1) return inference.set(y, Size{});
        if (crossing) crossing->infer(*this, inference);
        if (operand) operand->infer(*this, inference);
        broadcast(*this, inference, slots(u), y.index());
    }
};

} // namespace bf::blocks
