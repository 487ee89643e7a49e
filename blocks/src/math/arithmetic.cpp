// Sums, products and what else works on numbers of every type.
#include "bf/kernels/functions.hpp"
#include "bf/kernels/linear_algebra.hpp"
#include "bf/kernels/overflow.hpp"
#include "bf/kernels/reduce.hpp"
#include "bf/kernels/standard.hpp"

#include "../elementwise.hpp"
#include "../groups.hpp"
#include "../overflow.hpp"

#include <algorithm>
#include <cctype>

namespace bf::blocks {

namespace {

constexpr const char* only_elementwise =
    "argument 'on_overflow' is for element-by-element operation; matrix products wrap";

/// y = K ∘ u, K u or u K; see `multiplication`.
class Gain final : public Block {
  public:
    explicit Gain(const Arguments& arguments) : Block(arguments) {
        const bool is_elementwise = *multiplication == "elementwise";
        if (!is_elementwise && !on_overflow.wraps()) problem(only_elementwise);
        if (is_elementwise && !on_overflow.wraps())
            OutputRule(this, kernels::BoundedGain{}, y, on_overflow.stops(), K, u);
        else if (is_elementwise)
            OutputRule(this, kernels::Gain{}, y, K, u);
        else if (*multiplication == "K*u")
            OutputRule(this, kernels::ScalarOrMatrixProduct{}, y, K, u);
        else
            OutputRule(this, kernels::ScalarOrMatrixProduct{}, y, u, K);
    }
    Argument<std::string> multiplication{this,
                                         "multiplication",
                                         {.initial = "elementwise",
                                          .doc = "element by element, or a matrix product",
                                          .choices = {"elementwise", "K*u", "u*K"}}};
    OnOverflow on_overflow{this};
    Parameter<> K{this, "K", {.initial = {1}, .unit = any_unit, .doc = "factor", .as_written = true}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};

    void infer(Inference& inference) const override {
        if (*multiplication == "K*u") return multiply(*this, inference, K.index(), u.index(), y.index());
        if (*multiplication == "u*K") return multiply(*this, inference, u.index(), K.index(), y.index());
        const Size *factor = inference.size(K), *signal = inference.size(u);
        const bool is_vector = factor && (factor->rows == 1 || factor->cols == 1);
        const bool is_row = is_vector && factor->rows == 1 && factor->count() > 1;
        if (is_row && !signal) return; // 1-D or as the signal is
        if (is_vector && signal && factor->count() == signal->count()) {
            inference.set(y, *signal);
            inference.same_elements({y.index(), u.index()});
        } else if (is_row && signal->is_scalar())
            inference.set(y, {factor->count(), 1, false}); // a row of gains makes a 1-D signal
        else
            broadcast(*this, inference, slots(K, u), y.index());
    }
};

/// The +1 and -1 that `text` stands for: one `plus` or `minus` per operand, or a number of operands.
std::vector<double> parse_operations(Block& block, const char* argument, const Value& value, char plus,
                                     char minus) {
    std::vector<double> signs;
    double count = value.kind == Value::Kind::number && value.data.size() == 1 ? value.data[0] : 0;
    const auto& text = value.text;
    if (value.kind == Value::Kind::text && !text.empty() &&
        std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c); }))
        count = std::stod(text.substr(0, 6));
    if (count >= 1 && count <= 1000 && count == static_cast<int>(count))
        return std::vector<double>(static_cast<std::size_t>(count), 1.0);
    bool is_understood = value.kind == Value::Kind::text;
    for (const char c : text)
        if (c == plus || c == minus)
            signs.push_back(c == plus ? 1 : -1);
        else
            is_understood = is_understood && (c == '|' || c == ' ');
    if (!is_understood || signs.empty()) {
        bf::detail::declared_by(block).problems.push_back(
            "argument '" + std::string(argument) + "' is " + value.describe() + ", but must be made of '" +
            plus + "' and '" + minus + "', one per input, or be the number of inputs");
        return {1, 1};
    }
    return signs;
}

/// y = ± u1 ± u2 …; a single input is summed over its elements.
class Sum final : public Block {
  public:
    explicit Sum(const Arguments& arguments) : Block(arguments) {
        if (u.size() == 1 && !on_overflow.wraps())
            problem("argument 'on_overflow' is for two and more inputs; a sum over elements wraps");
        if (u.size() > 1 && !on_overflow.wraps()) {
            OutputRule(this, kernels::BoundedSum{}, y, on_overflow.stops(), Constants(values), u);
        } else if (u.size() > 1) {
            OutputRule(this, kernels::Sum{}, y, Constants(values), u);
        } else if (values[0] > 0) {
            OutputRule(this, kernels::SumOfElements{}, y, u[0]);
        } else {
            OutputRule(this, kernels::SumOfElements{}, sum, u[0]);
            OutputRule(this, kernels::Negate{}, y, sum);
        }
    }
    Argument<Value> signs{
        this,
        "signs",
        {.initial = Value("++"), .doc = "a + or - per input, | as a spacer, or the number of inputs to add"}};
    OnOverflow on_overflow{this};
    std::vector<double> values = parse_operations(*this, "signs", *signs, '+', '-');
    InputList<> u{this, "u", static_cast<int>(values.size()), any()};
    Output<> y{this, "y", any()};
    Workspace<Any> sum{this, "sum", {.shape = scalar, .present = values.size() == 1 && values[0] < 0}};

    void infer(Inference& inference) const override {
        if (u.size() == 1) return inference.set(y, Size{});
        broadcast(*this, inference, slots(u), y.index());
    }
};

/// y = u1^±1 u2^±1 …, element by element or as matrices.
class Product final : public Block {
  public:
    explicit Product(const Arguments& arguments) : Block(arguments) {
        const bool is_matrix = *multiplication == "matrix";
        if ((is_matrix || u.size() == 1) && !on_overflow.wraps()) problem(only_elementwise);
        if (is_matrix)
            declare_matrix_rules();
        else if (u.size() > 1 && !on_overflow.wraps())
            OutputRule(this, kernels::BoundedProduct{}, y, on_overflow.stops(), Constants(exponents), u);
        else if (u.size() > 1)
            OutputRule(this, kernels::ElementProduct{}, y, Constants(exponents), u);
        else if (exponents[0] > 0)
            OutputRule(this, kernels::ProductOfElements{}, y, u[0]);
        else {
            OutputRule(this, kernels::ProductOfElements{}, add_workspace(), u[0]);
            OutputRule(this, kernels::Reciprocal{}, y, workspaces.back());
        }
    }
    Argument<Value> operations{
        this,
        "operations",
        {.initial = Value("**"), .doc = "a * or / per input, or the number of inputs to multiply"}};
    Argument<std::string> multiplication{this,
                                         "multiplication",
                                         {.initial = "elementwise",
                                          .doc = "element by element, or matrices from left to right",
                                          .choices = {"elementwise", "matrix"}}};
    OnOverflow on_overflow{this};
    std::vector<double> exponents = parse_operations(*this, "operations", *operations, '*', '/');
    InputList<> u{this, "u", static_cast<int>(exponents.size()), any()};
    Output<> y{this, "y", any()};

    void infer(Inference& inference) const override {
        if (*multiplication == "matrix") return infer_matrices(inference);
        if (u.size() > 1) return broadcast(*this, inference, slots(u), y.index());
        inference.set(y, Size{});
        for (const auto& work : workspaces) inference.set(work, Size{});
    }

  private:
    enum class Kind { copy, product, left, right, inverse };
    /// One rule of the chain, as slot indices.
    struct Step {
        Kind kind;
        int a, b, target, work;
    };
    std::vector<Step> steps;
    std::vector<Workspace<Any>> workspaces;

    const Workspace<Any>& add_workspace() {
        workspaces.emplace_back(this, "work" + std::to_string(workspaces.size() + 1), About{});
        return workspaces.back();
    }

    /// From left to right; the first operand is an input, later ones are the result so far.
    void declare_matrix_rules() {
        workspaces.reserve(2 * exponents.size() + 2);
        const auto n = u.size();
        const bool inverts = exponents[0] < 0;
        const bool solves = inverts && n > 1 && exponents[1] > 0;
        int next = solves ? 2 : 1;
        const Workspace<Any>* result = nullptr;
        const auto first = [&](const auto& target) {
            if (solves)
                rule(Kind::left, kernels::Solve{}, target, u[0], u[1]);
            else if (inverts)
                rule(Kind::inverse, kernels::Inverse{}, target, u[0]);
            else
                rule(Kind::copy, kernels::Copy{}, target, u[0]);
        };
        if (next == n) return first(y);
        if (inverts) first(*(result = &add_workspace()));
        for (; next < n; ++next) {
            const auto combine = [&](const auto& target, const auto& so_far) {
                if (exponents[static_cast<std::size_t>(next)] > 0)
                    rule(Kind::product, kernels::ScalarOrMatrixProduct{}, target, so_far, u[next]);
                else
                    rule(Kind::right, kernels::SolveRight{}, target, so_far, u[next]);
            };
            const auto* target = next + 1 < n ? &add_workspace() : nullptr;
            if (target)
                result ? combine(*target, *result) : combine(*target, u[0]);
            else
                result ? combine(y, *result) : combine(y, u[0]);
            result = target;
        }
    }
    template <class Kernel, class Target, class A>
    void rule(Kind kind, Kernel, const Target& target, const A& a) {
        if (kind == Kind::copy) {
            OutputRule(this, kernels::Copy{}, target, a);
            steps.push_back({kind, a.index(), -1, target.index(), -1});
        } else {
            const auto& work = add_workspace();
            OutputRule(this, kernels::Inverse{}, target, a, work);
            steps.push_back({kind, a.index(), -1, target.index(), work.index()});
        }
    }
    template <class Kernel, class Target, class A, class B>
    void rule(Kind kind, Kernel kernel, const Target& target, const A& a, const B& b) {
        if constexpr (std::is_same_v<Kernel, kernels::ScalarOrMatrixProduct>) {
            OutputRule(this, kernel, target, a, b);
            steps.push_back({kind, a.index(), b.index(), target.index(), -1});
        } else {
            const auto& work = add_workspace();
            OutputRule(this, kernel, target, a, b, work);
            steps.push_back({kind, a.index(), b.index(), target.index(), work.index()});
        }
    }

    void infer_matrices(Inference& inference) const {
        for (const Step& s : steps) {
            const Size* a = inference.size(s.a);
            if (s.kind == Kind::copy && a) inference.set(s.target, *a);
            if (s.kind == Kind::product) multiply(*this, inference, s.a, s.b, s.target);
            if ((s.kind == Kind::inverse || s.kind == Kind::left) && square(*this, inference, s.a)) {
                inference.set(s.work, Size{a->count(), 1, false});
                if (s.kind == Kind::inverse) inference.set(s.target, *a);
                if (const Size* b = s.kind == Kind::left ? inference.size(s.b) : nullptr) {
                    if (b->rows != a->rows) refuse_sizes(inference, s);
                    inference.set(s.target, *b);
                }
            }
            if (s.kind == Kind::right && a && square(*this, inference, s.b)) {
                const Size* b = inference.size(s.b);
                if (a->cols != b->rows) refuse_sizes(inference, s);
                inference.set(s.work, Size{b->count() + a->count(), 1, false});
                inference.set(s.target, *a);
            }
        }
    }
    [[noreturn]] void refuse_sizes(Inference& inference, const Step& s) const {
        inference.refuse(label(resolution(), s.a) + " and " + label(resolution(), s.b) +
                         " cannot be divided as matrices; A \\ b needs as many rows in b as in A, b / A as "
                         "many columns");
    }
};

/// y = a · b, a scalar.
class Dot final : public Block {
  public:
    using Block::Block;
    Input<> u1{this, "u1", any()};
    Input<> u2{this, "u2", any()};
    Output<> y{this, "y", any(scalar)};
    OutputRule rule{this, kernels::Dot{}, y, u1, u2};

    void infer(Inference& inference) const override {
        const Size *a = inference.size(u1), *b = inference.size(u2);
        if (a && b && a->count() != b->count() && !a->is_scalar() && !b->is_scalar())
            inference.refuse(label(resolution(), u1.index()) + " and " + label(resolution(), u2.index()) +
                             " must have as many elements");
    }
};

/// y = a × b, three elements each.
class Cross final : public Block {
  public:
    using Block::Block;
    Input<> u1{this, "u1", any({3})};
    Input<> u2{this, "u2", any({3})};
    Output<> y{this, "y", any({3})};
    OutputRule rule{this, kernels::Cross{}, y, u1, u2};
};

/// y = ‖u‖.
class Norm final : public Block {
  public:
    explicit Norm(const Arguments& arguments) : Block(arguments) {
        if (*kind == "2")
            OutputRule(this, kernels::Norm2{}, y, u);
        else if (*kind == "1")
            OutputRule(this, kernels::Norm1{}, y, u);
        else
            OutputRule(this, kernels::NormInf{}, y, u);
        if (*kind == "1")
            at_zero.emplace(this, "at_zero", u, Constants({0}));
        else if (*kind == "2")
            GuardRule(this, kernels::SideOfNumber{}, side, u);
        else
            GuardRule(this, kernels::FarthestElement{}, side, u);
    }
    Argument<std::string> kind{
        this,
        "kind",
        {.initial = "2", .doc = "sum of squares, sum or maximum", .choices = {"2", "1", "inf"}}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any(scalar)};
    GuardOf<std::int32_t> side{this, "side", {.doc = "changes at a corner of y", .present = *kind != "1"}};
    std::optional<Crossing> at_zero;

    void infer(Inference& inference) const override {
        if (at_zero) at_zero->infer(*this, inference);
    }
};

using kernels::Rounding;

} // namespace

void add_arithmetic(Library& library) {
    library.group("math")
        .add<Gain>("Gain",
                   "Multiplies by a constant. y = K ∘ u element by element, K u or u K as matrices; a "
                   "scalar expands, a column K on a scalar u gives a column.")
        .add<Sum>("Sum", "Adds and subtracts. y = ± u1 ± u2 … by `signs`; scalars expand. A single input is "
                         "summed over its elements.")
        .add<Product>(
            "Product",
            "Multiplies and divides. Element by element y = u1^±1 u2^±1 … by `operations`, a single input "
            "collapsing over its elements; or as matrices from left to right, / being the inverse by LU: /* "
            "is inv(u1) u2, a single / inv(u). A singular matrix stops the run.")
        .add<UnaryWithKink<kernels::Abs>>("Abs", "Absolute value. y = |u|, element by element.")
        .add<UnaryWithKink<kernels::Sign>>("Sign",
                                           "Sign. y = 1, 0 or -1 by the sign of u, element by element.")
        .add<Unary<kernels::Square>>("Square", "Square. y = u², element by element.")
        .add<Unary<kernels::Negate>>("Negate", "Changes the sign. y = -u, element by element.")
        .add<Extreme<kernels::MinimumOfElements, kernels::MinimumOfList, 1>>(
            "Minimum", "Smallest of its inputs. Element by element over `inputs` inputs, scalars expanding; "
                       "a single input is searched over its elements. NaN is ignored.")
        .add<Extreme<kernels::MaximumOfElements, kernels::MaximumOfList, -1>>(
            "Maximum", "Largest of its inputs. Element by element over `inputs` inputs, scalars expanding; a "
                       "single input is searched over its elements. NaN is ignored.")
        .add<BinaryWithEdges<kernels::Mod, kernels::QuotientEdges, int(Rounding::floor)>>(
            "Mod", "Remainder with the sign of u2. y = u1 - floor(u1/u2) u2; u1 where u2 = 0. As in MATLAB, "
                   "0 where u2 is no integer and u1/u2 is one but for rounding: mod(0.3, 0.1) = 0.")
        .add<BinaryWithEdges<kernels::Rem, kernels::QuotientEdges, int(Rounding::zero)>>(
            "Rem", "Remainder with the sign of u1. y = u1 - trunc(u1/u2) u2; NaN, or 0 for integers, where "
                   "u2 = 0. Rounded as Mod.")
        .add<Reduction<kernels::ProductOfElements>>("ProductOfElements",
                                                    "Product of all elements. y = Π u_i.")
        .add<Dot>("Dot", "Scalar product. y = Σ u1_i u2_i; a scalar expands.")
        .add<Cross>("Cross", "Vector product of two 3-vectors. y = u1 × u2.")
        .add<Norm>("Norm", "Norm of a vector. √Σ u_i² (Frobenius for a matrix), Σ |u_i| or max |u_i|.");
}

} // namespace bf::blocks
