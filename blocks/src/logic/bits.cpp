// Bits of integers.
#include "bf/kernels/logic.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

namespace bf::blocks {

namespace {

/// y = u op mask, or u1 op u2 op …, on the bits of integers.
class Bitwise final : public Block {
  public:
    explicit Bitwise(const Arguments& arguments) : Block(arguments) {
        const auto& op = *operation;
        if (op == "NOT")
            OutputRule(this, kernels::BitNot{}, y, u);
        else if (has_mask)
            declare_mask(op);
        else if (op == "AND")
            OutputRule(this, kernels::BitAndOfList{}, y, list);
        else if (op == "OR")
            OutputRule(this, kernels::BitOrOfList{}, y, list);
        else if (op == "XOR")
            OutputRule(this, kernels::BitXorOfList{}, y, list);
        else if (op == "NAND")
            OutputRule(this, kernels::BitNandOfList{}, y, list);
        else
            OutputRule(this, kernels::BitNorOfList{}, y, list);
    }
    Argument<std::string> operation{this,
                                    "operator",
                                    {.initial = "AND",
                                     .doc = "how bits are joined",
                                     .choices = {"AND", "OR", "XOR", "NAND", "NOR", "NOT"}}};
    Argument<int> inputs{this,
                         "inputs",
                         {.initial = 0,
                          .minimum = 0,
                          .maximum = most_ports,
                          .doc = "number of inputs; 0: one, joined with the mask; NOT has one"}};
    const bool has_one = *inputs < 1 || *operation == "NOT", has_mask = has_one && *operation != "NOT";
    Parameter<> mask{
        this,
        "mask",
        {.shape = scalar, .initial = {1}, .doc = "bits joined with every element", .present = has_mask}};
    Input<> u{this, "u", {.unit = any_unit, .present = has_one}};
    InputList<> list{this, "u", has_one ? 0 : *inputs, any()};
    Output<> y{this, "y", any()};

    void infer(Inference& inference) const override {
        if (list.size() == 1) return inference.set(y, Size{});
        broadcast(*this, inference, slots(u, list), y.index());
    }

  private:
    void declare_mask(const std::string& op) {
        if (op == "AND" || op == "NAND")
            OutputRule(this, kernels::BitAnd{}, y, u, mask);
        else if (op == "XOR")
            OutputRule(this, kernels::BitXor{}, y, u, mask);
        else
            OutputRule(this, kernels::BitOr{}, y, u, mask);
        if (op == "NAND" || op == "NOR") OutputRule(this, kernels::BitNot{}, y, y);
    }
};

/// y = u with its bits moved.
class ShiftBits final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Parameter<double> places{
        this, "places", {.initial = {1}, .doc = "how far, up if positive and down if negative"}};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    OutputRule rule{this, kernels::ShiftBits{}, y, places, u};
};

} // namespace

void add_bits(Library& library) {
    library.group("logic")
        .add<Bitwise>("Bitwise",
                      "Joins the bits of integers: of one input with a mask, of several inputs, or "
                      "(with one of several) over the elements. y = u operator mask, or u1 operator "
                      "u2 …; NAND and NOR invert the result, NOT each bit.")
        .add<ShiftBits>("ShiftBits",
                        "Shifts the bits of integers. y = u · 2^places, bits beyond the type being "
                        "lost; downwards the sign stays, so y = floor(u / 2^-places).");
}

} // namespace bf::blocks
