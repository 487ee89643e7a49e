// Functions of real numbers, element by element.
#include "bf/kernels/functions.hpp"

#include "../elementwise.hpp"
#include "../groups.hpp"

#include <array>

namespace bf::blocks {

namespace {

/// A kernel that a block can be asked for by name.
struct Choice {
    const char* name;
    void (*declare)(Block*, const Output<>&, const Input<>&);
};
template <class Kernel> void declare(Block* block, const Output<>& y, const Input<>& u) {
    OutputRule(block, Kernel{}, y, u);
}

constexpr std::array square_roots{Choice{"sqrt", declare<kernels::Sqrt>},
                                  Choice{"signed", declare<kernels::SignedSqrt>},
                                  Choice{"reciprocal", declare<kernels::ReciprocalSqrt>}};
constexpr std::array exponentials{Choice{"e", declare<kernels::Exp>}, Choice{"10", declare<kernels::Pow10>}};
constexpr std::array logarithms{Choice{"e", declare<kernels::Log>}, Choice{"10", declare<kernels::Log10>}};
constexpr std::array trigonometric{
    Choice{"sin", declare<kernels::Sin>},     Choice{"cos", declare<kernels::Cos>},
    Choice{"tan", declare<kernels::Tan>},     Choice{"asin", declare<kernels::Asin>},
    Choice{"acos", declare<kernels::Acos>},   Choice{"atan", declare<kernels::Atan>},
    Choice{"sinh", declare<kernels::Sinh>},   Choice{"cosh", declare<kernels::Cosh>},
    Choice{"tanh", declare<kernels::Tanh>},   Choice{"asinh", declare<kernels::Asinh>},
    Choice{"acosh", declare<kernels::Acosh>}, Choice{"atanh", declare<kernels::Atanh>}};

/// y = the chosen function of u; the first choice is the default.
template <const auto& choices> class Function final : public Block {
  public:
    explicit Function(const Arguments& arguments) : Block(arguments) {
        for (const Choice& choice : choices)
            if (*function == choice.name) choice.declare(this, y, u);
    }
    Argument<std::string> function{
        this, "function", {.initial = choices[0].name, .doc = "which function", .choices = names()}};
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};

  private:
    static std::vector<std::string> names() {
        std::vector<std::string> all;
        for (const Choice& choice : choices) all.emplace_back(choice.name);
        return all;
    }
};

/// y = u without its fraction, in one of several ways.
class Round final : public Block {
  public:
    explicit Round(const Arguments& arguments) : Block(arguments) {
        if (*function == "round")
            declare(kernels::Round{}, kernels::Rounding::away);
        else if (*function == "floor")
            declare(kernels::Floor{}, kernels::Rounding::floor);
        else if (*function == "ceil")
            declare(kernels::Ceil{}, kernels::Rounding::ceil);
        else
            declare(kernels::Fix{}, kernels::Rounding::zero);
    }
    Argument<std::string> function{
        this,
        "function",
        {.initial = "round", .doc = "which function", .choices = {"round", "floor", "ceil", "fix"}}};
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    GuardOf<Array<std::int32_t>> edge{this, "edge", {.shape = shape, .doc = "changes where y jumps"}};

  private:
    template <class Kernel> void declare(Kernel kernel, kernels::Rounding rounding) {
        OutputRule(this, kernel, y, u);
        GuardRule(this, kernels::RoundingEdges{}, edge, Constants({double(rounding)}), u);
    }
};

/// sin = sin u, cos = cos u.
class SineCosine final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", any(shape, "angle [rad]")};
    Output<> sin{this, "sin", any(shape, "sin u")};
    Output<> cos{this, "cos", any(shape, "cos u")};
    OutputRule rule{this, kernels::SineCosine{}, sin, cos, u};
};

} // namespace

void add_functions(Library& library) {
    library.group("math")
        .add<Function<square_roots>>("Sqrt", "Square root. y = √u (NaN below 0), sign(u) √|u|, or 1/√u.")
        .add<Function<exponentials>>("Exp", "Exponential function. y = e^u, or 10^u.")
        .add<Function<logarithms>>("Log", "Logarithm. y = ln u, or log₁₀ u; -∞ at 0, NaN below.")
        .add<Binary<kernels::Power>>("Power", "Power. y = u1^u2, element by element; scalars expand.")
        .add<Unary<kernels::Reciprocal>>("Reciprocal", "Reciprocal. y = 1/u, element by element.")
        .add<Binary<kernels::Hypot>>("Hypot", "Length of the hypotenuse. y = √(u1² + u2²).")
        .add<Function<trigonometric>>("Trigonometry",
                                      "Trigonometric and hyperbolic functions and their inverses. y = "
                                      "function(u), angles in rad; NaN outside the domain.")
        .add<SineCosine>("SineCosine",
                         "Sine and cosine of an angle at once. Quicker than one after the other.")
        .add<BinaryWithEdges<kernels::Atan2, kernels::AngleEdge>>(
            "Atan2", "Angle of the point (u2, u1). y = atan2(u1, u2) [rad], in [-π, π].")
        .add<Round>("Round", "Rounds to a whole number. To the nearest with halves away from zero, down, up, "
                             "or toward zero; the type stays.");
}

} // namespace bf::blocks
