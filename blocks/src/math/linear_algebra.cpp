// Inverses and linear equations.
#include "bf/kernels/linear_algebra.hpp"
#include "bf/kernels/svd.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <algorithm>

namespace bf::blocks {

namespace {

/// y = u⁻¹.
class MatrixInverse final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<> y{this, "y", any(shape)};
    Workspace<Any> work{this, "work", {}};
    OutputRule rule{this, kernels::Inverse{}, y, u, work};

    void infer(Inference& inference) const override {
        if (const Size* s = square(*this, inference, u.index()))
            inference.set(work, Size{s->count(), 1, false});
    }
};

/// y = u⁺.
class PseudoInverse final : public Block {
  public:
    explicit PseudoInverse(const Arguments& arguments) : Block(arguments) {
        if (*method == "damped")
            OutputRule(this, kernels::DampedPinv{}, y, tolerance, u, work);
        else
            OutputRule(this, kernels::TruncatedPinv{}, y, tolerance, u, work);
    }
    Argument<std::string> method{this,
                                 "method",
                                 {.initial = "damped",
                                  .doc = "how small singular values are tamed",
                                  .choices = {"damped", "truncated"}}};
    Parameter<> tolerance{this,
                          "tolerance",
                          {.shape = scalar,
                           .initial = {1e-4},
                           .minimum = 0,
                           .unit = any_unit,
                           .doc = "damping σ, or the singular value up to which truncation cuts"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    Workspace<Any> work{this, "work", {}};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (!s) return;
        const int small = std::min(s->rows, s->cols);
        inference.set(work, Size{small * small + s->count(), 1, false});
        inference.set(y, Size{s->cols, s->rows, true});
    }
};

/// x = A \ b or b / A.
class LinearSolve final : public Block {
  public:
    explicit LinearSolve(const Arguments& arguments) : Block(arguments) {
        if (is_right && *method != "lu")
            problem("argument 'method' is '" + *method + "', but b / A is solved by 'lu' only");
        if (is_right)
            OutputRule(this, kernels::SolveRight{}, x, b, A, work);
        else if (*method == "lu")
            OutputRule(this, kernels::Solve{}, x, A, b, work);
        else if (*method == "cholesky")
            OutputRule(this, kernels::CholeskySolve{}, x, A, b, work);
        else
            OutputRule(this, kernels::LeastSquares{}, x, A, b, work);
    }
    Argument<std::string> side{
        this,
        "side",
        {.initial = "left", .doc = "left solves A x = b, right x A = b", .choices = {"left", "right"}}};
    Argument<std::string> method{this,
                                 "method",
                                 {.initial = "lu",
                                  .doc = "cholesky needs a symmetric positive definite A, of which it reads "
                                         "the lower triangle; least_squares takes any shape and rank, and of "
                                         "all best x gives the one of smallest norm, as pinv(A) b",
                                  .choices = {"lu", "cholesky", "least_squares"}}};
    Input<> A{this, "A", any("matrix of the equations")};
    Input<> b{this, "b", any("right-hand side, one or more columns (rows for b / A)")};
    Output<> x{this, "x", any("solution")};
    Workspace<Any> work{this, "work", {}};

    void infer(Inference& inference) const override {
        const bool any_shape = !is_right && *method == "least_squares";
        const Size* a = any_shape ? inference.size(A) : square(*this, inference, A.index());
        const Size* rhs = inference.size(b);
        if (!a || !rhs) return;
        if (is_right ? rhs->cols != a->cols : rhs->rows != a->rows)
            inference.refuse(label(resolution(), A.index()) + " and " + label(resolution(), b.index()) +
                             " do not fit: A \\ b needs as many rows in b as in A, b / A as many columns");
        inference.set(x, is_right ? *rhs : Size{a->cols, rhs->cols, rhs->is_matrix});
        const int size = any_shape               ? a->rows * (a->cols + rhs->cols) + a->cols
                         : *method == "cholesky" ? a->count() + a->rows * (rhs->cols + 8)
                                                 : a->count() + rhs->count();
        inference.set(work, Size{size, 1, false});
    }

  private:
    const bool is_right = *side == "right";
};

} // namespace

void add_linear_algebra(Library& library) {
    library.group("math")
        .add<MatrixInverse>("MatrixInverse", "Inverse of a square matrix. y = u⁻¹ by LU with partial "
                                             "pivoting; a singular matrix stops the run.")
        .add<PseudoInverse>("PseudoInverse",
                            "Pseudo-inverse that tolerates lost rank. Damped: y = uᵀ (u uᵀ + σ I)⁻¹; "
                            "truncated: y = Σ v uᵀ / σ over the singular values above the tolerance.")
        .add<LinearSolve>(
            "LinearSolve",
            "Solves linear equations. x = A \\ b, or b / A; a singular matrix stops the run, except by "
            "least_squares. Reference: Golub & Van Loan, Matrix Computations, §3.4, §4.2, §5.4, §5.5.");
}

} // namespace bf::blocks
