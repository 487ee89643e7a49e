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
template <class Kernel> class Binary final : public Block {
  public:
    using Block::Block;
    Input<> u1{this, "u1", any()};
    Input<> u2{this, "u2", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, Kernel{}, y, u1, u2};

    void infer(Inference& inference) const override { broadcast(*this, inference, slots(u1, u2), y.index()); }
};

/// y = kernel(u), one number from all elements.
template <class Kernel> class Reduction final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any(scalar)};
    OutputRule rule{this, Kernel{}, y, u};
};

/// y = extreme of the inputs, element by element; of a single input over its elements. Two inputs have a kink
/// where they cross; of more than two it is not looked for.
template <class OfElements, class OfList> class Extreme final : public Block {
  public:
    explicit Extreme(const Arguments& arguments) : Block(arguments) {
        if (u.size() == 1)
            OutputRule(this, OfElements{}, y, u[0]);
        else
            OutputRule(this, OfList{}, y, u);
        if (u.size() == 2) crossing.emplace(this, "crossing", u[0], u[1]);
    }
    Argument<int> inputs{
        this, "inputs", {.initial = 2, .minimum = 1, .maximum = most_ports, .doc = "number of inputs"}};
    InputList<> u{this, "u", *inputs, any()};
    Output<> y{this, "y", any()};
    std::optional<Crossing> crossing;

    void infer(Inference& inference) const override {
        if (u.size() == 1) return inference.set(y, Size{});
        if (crossing) crossing->infer(*this, inference);
        broadcast(*this, inference, slots(u), y.index());
    }
};

} // namespace bf::blocks
