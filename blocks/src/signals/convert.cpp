// Changing element types.
#include "bf/kernels/convert.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/guards.hpp"

#include "../groups.hpp"
#include "../overflow.hpp"
#include "../shapes.hpp"

namespace bf::blocks {

namespace {

/// y = u in another element type.
class Convert final : public Block {
  public:
    explicit Convert(const Arguments& arguments) : Block(arguments) {
        if (is_whole) GuardRule(this, kernels::RoundingEdges{}, edge, options(), u);
    }
    Argument<std::string> type{
        this,
        "type",
        {.initial = "double",
         .doc = "element type of y",
         .choices = {"double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "boolean"}}};
    Argument<std::string> rounding{
        this,
        "rounding",
        {.initial = "floor",
         .doc = "for real to integer; of two equally near integers nearest takes the upper, away that away "
                "from zero, convergent the even one",
         .choices = {"floor", "nearest", "ceil", "zero", "away", "convergent"}}};
    OnOverflow on_overflow{this};
    AnyShape shape{this};
    Input<Any> u{this, "u", any(shape)};
    Output<Other> y{this, "y", any(shape)};
    const bool is_whole = *type != "double" && *type != "single" && *type != "boolean";
    Workspace<Array<double>> value{this, "value", {.shape = shape}};
    OutputRule rule_value{this, kernels::Copy{}, value, u};
    OutputRule rule{this, kernels::Convert{}, y, options(), value};
    GuardOf<Array<std::int32_t>> edge{
        this, "edge", {.shape = shape, .doc = "changes where y jumps", .present = is_whole}};

    void infer(Inference& inference) const override { inference.set(y, *type_from_name(*type)); }

  private:
    Constants options() const {
        using kernels::Rounding;
        const auto how = *rounding == "floor"     ? Rounding::floor
                         : *rounding == "nearest" ? Rounding::nearest
                         : *rounding == "ceil"    ? Rounding::ceil
                         : *rounding == "zero"    ? Rounding::zero
                         : *rounding == "away"    ? Rounding::away
                                                  : Rounding::convergent;
        return Constants({double(how), double(on_overflow.choice())});
    }
};

} // namespace

void add_conversion(Library& library) {
    library.group("signals").add<Convert>(
        "Convert",
        "Changes the element type. Real to integer rounds; what does not fit wraps, is held at the limits or "
        "stops the run; NaN becomes 0 or stops the run; anything to boolean is u ≠ 0.");
}

} // namespace bf::blocks
