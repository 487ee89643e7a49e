// Linear systems, which are the same blocks in continuous and in discrete time.
#pragma once

#include "bf/kernels/continuous.hpp"
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/matrix.hpp"

#include "polynomial.hpp"
#include "shapes.hpp"

#include <cmath>
#include <vector>

namespace bf::blocks {

/// States whose derivatives are given.
struct ContinuousTime {
    template <class T> using State = ContinuousState<T>;
    using Rule = DerivativeRule;
    template <class T> static auto change(const State<T>& x) { return derivative(x); }

    static constexpr double pole = -1; ///< of default systems
    static constexpr const char* state_doc =
        "chain of integrators, highest derivative first; a column per element";
    /// A rational function of s in controllable canonical form.
    static void declare(Block* block, const Rational& h, const Input<Array<double>>& u,
                        const Output<Array<double>>& y, const State<Array<double>>& x) {
        const Constants b(h.b), a(h.a);
        if (h.is_proper())
            OutputRule(block, kernels::CompanionOutput{}, y, b, a, x, Constants({0}));
        else
            OutputRule(block, kernels::CompanionOutput{}, y, b, a, x, u);
        DerivativeRule(block, kernels::CompanionRate{}, change(x), a, x, u);
    }
};

/// States whose next values are given.
struct DiscreteTime {
    template <class T> using State = DiscreteState<T>;
    using Rule = UpdateRule;
    template <class T> static auto change(const State<T>& x) { return next(x); }

    static constexpr double pole = 0.5;
    static constexpr const char* state_doc = "delay line, one column per element of u";
    /// A rational function of z, direct form II transposed.
    static void declare(Block* block, const Rational& h, const Input<Array<double>>& u,
                        const Output<Array<double>>& y, const State<Array<double>>& x) {
        const Constants b(h.b), a(h.a);
        if (h.is_proper())
            OutputRule(block, kernels::FirstRow{}, y, x);
        else
            OutputRule(block, kernels::FilterOutput{}, y, b, a, x, u);
        UpdateRule(block, kernels::FilterUpdate{}, change(x), b, a, x, y, u);
    }
};

/// x' = A x + B u, y = C x + D u, x' being dx/dt or x⁺.
template <class Time> class StateSpace final : public Block {
  public:
    explicit StateSpace(const Arguments& arguments) : Block(arguments) {
        if (D->isZero(0))
            OutputRule(this, kernels::MatrixProduct{}, y, C, x);
        else
            OutputRule(this, kernels::StateSpace{}, y, C, Constants({D->data(), D->data() + D->size()}), x,
                       u);
    }
    Argument<Matrix> D{
        this, "D", {.initial = Matrix::Zero(1, 1), .doc = "feedthrough matrix; y waits for u only if not 0"}};
    Dim n{this, "n"};
    Dim m{this, "m"};
    Dim p{this, "p"};
    Parameter<Matrix> A{this, "A", {.shape = {n, n}, .unit = mixed_units, .doc = "system matrix"}};
    Parameter<Matrix> B{this, "B", {.shape = {n, m}, .unit = mixed_units, .doc = "input matrix"}};
    Parameter<Matrix> C{this, "C", {.shape = {p, n}, .unit = mixed_units, .doc = "output matrix"}};
    Parameter<Vector> initial{
        this, "initial", {.shape = {n}, .initial = {0}, .unit = mixed_units, .doc = "x at the start"}};
    Input<Vector> u{this, "u", {.shape = {m}, .unit = any_unit, .doc = "input"}};
    Output<Vector> y{this, "y", {.shape = {p}, .unit = any_unit, .doc = "output"}};
    typename Time::template State<Vector> x{
        this, "x", {.shape = {n}, .unit = mixed_units, .doc = "state", .initial_from = initial.index()}};
    typename Time::Rule rule{this, kernels::StateSpace{}, Time::change(x), A, B, x, u};

    void infer(Inference& inference) const override {
        check_feedthrough(*this, inference, *D, u.index(), y.index());
    }
};

/// Σ b_i qⁿ⁻ⁱ / Σ a_i qⁿ⁻ⁱ on every element, q being s or z.
template <class Time> class TransferFunction final : public Block {
  public:
    explicit TransferFunction(const Arguments& arguments) : Block(arguments) {
        Time::declare(this, h, u, y, x);
    }
    Argument<std::vector<double>> numerator{
        this, "numerator", {.initial = {1}, .doc = "b_0 b_1 ..., highest power first"}};
    Argument<std::vector<double>> denominator{
        this,
        "denominator",
        {.initial = {1, std::abs(Time::pole)}, .doc = "a_0 a_1 ..., highest power first"}};
    const Rational h = rational(*this, *numerator, *denominator);
    AnyShape shape{this};
    Input<Array<double>> u{this, "u", any(shape, "input")};
    Output<Array<double>> y{this, "y", any(shape, "output")};
    typename Time::template State<Array<double>> x{this, "x", {.unit = mixed_units, .doc = Time::state_doc}};

    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(u)) inference.set(x, Size{h.order(), size->count(), true});
    }
};

/// gain Π(q - zero) / Π(q - pole) on every element, q being s or z.
template <class Time> class ZeroPole final : public Block {
  public:
    explicit ZeroPole(const Arguments& arguments) : Block(arguments) { Time::declare(this, h, u, y, x); }
    Argument<Matrix> zeros{
        this, "zeros", {.initial = Matrix(1, 0), .doc = "a row of real zeros, or rows [real imaginary]"}};
    Argument<Matrix> poles{this,
                           "poles",
                           {.initial = Matrix::Constant(1, 1, Time::pole),
                            .doc = "a row of real poles, or rows [real imaginary]"}};
    Argument<double> gain{this, "gain", {.initial = 1, .doc = "factor of the numerator"}};
    const Rational h = rational(*this, *zeros, *poles, *gain);
    AnyShape shape{this};
    Input<Array<double>> u{this, "u", any(shape, "input")};
    Output<Array<double>> y{this, "y", any(shape, "output")};
    typename Time::template State<Array<double>> x{this, "x", {.unit = mixed_units, .doc = Time::state_doc}};

    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(u)) inference.set(x, Size{h.order(), size->count(), true});
    }
};

} // namespace bf::blocks
