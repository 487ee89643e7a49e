#include "formulas.hpp"

#include "bf/kernels/linear_algebra.hpp"
#include "bf/kernels/matrix.hpp"
#include "bf/kernels/standard.hpp"

#include <Eigen/Cholesky>

namespace bf::analysis {

namespace {

using Values = Eigen::Map<const Matrix>;

/// slopes(from d) += d, for each direction d of an operand.
void add(const Eigen::Ref<const Matrix>& changes, const Moving& moving, Matrix& slopes) {
    for (std::size_t c = 0; c < moving.columns.size(); ++c)
        slopes.col(moving.columns[c]).head(changes.rows()) += changes.col(static_cast<Eigen::Index>(c));
}

// All directions are multiplied at once: small products one by one would mostly be calls.

/// Of A d.
void add_product(const Values& A, const RuleOperand& d, Matrix& slopes) {
    const Eigen::Index count = d.moving->slopes->cols();
    const Values side_by_side(d.moving->slopes->data(), d.rows, d.cols * count);
    const Matrix product = A * side_by_side;
    add(Values(product.data(), A.rows() * d.cols, count), *d.moving, slopes);
}

/// Of factor d B; of a symmetric d its lower triangle is there.
void add_product(double factor, const RuleOperand& d, bool is_symmetric, const Eigen::Ref<const Matrix>& B,
                 Matrix& slopes) {
    const Eigen::Index count = d.moving->slopes->cols();
    Matrix below(d.rows * count, d.cols); // one another
    for (Eigen::Index c = 0; c < count; ++c) {
        const Values one(d.moving->slopes->col(c).data(), d.rows, d.cols);
        auto to = below.middleRows(c * d.rows, d.rows);
        if (is_symmetric)
            to = one.selfadjointView<Eigen::Lower>();
        else
            to = one;
    }
    const Matrix product = factor * below * B;
    Matrix changes(d.rows * B.cols(), count);
    for (Eigen::Index c = 0; c < count; ++c)
        Eigen::Map<Matrix>(changes.col(c).data(), d.rows, B.cols()) = product.middleRows(c * d.rows, d.rows);
    add(changes, *d.moving, slopes);
}

} // namespace

bool by_formula(std::string_view kernel, const std::vector<RuleOperand>& operands, Matrix& slopes) {
    const bool may_scale = kernel == kernels::ScalarOrMatrixProduct::name,
               is_product = may_scale || kernel == kernels::MatrixProduct::name,
               is_solution = kernel == kernels::CholeskySolve::name;
    if (!is_product && !is_solution) return false;
    const RuleOperand &y = operands[0], &first = operands[1], &second = operands[2];
    const auto is_number = [](const RuleOperand& of) { return of.rows * of.cols == 1; };
    if (may_scale && (is_number(first) || is_number(second))) return false;
    const Values A(first.data, first.rows, first.cols), B(second.data, second.rows, second.cols);
    if (is_product) {
        if (first.moving) add_product(1, first, false, B, slopes);
        if (second.moving) add_product(A, second, slopes);
        return true;
    }
    const Eigen::LLT<Matrix> factor(A); // of which the lower triangle is read
    if (factor.info() != Eigen::Success) return false;
    Matrix right = Matrix::Zero(y.rows * y.cols, slopes.cols());
    if (second.moving) add(*second.moving->slopes, *second.moving, right);
    if (first.moving) add_product(-1, first, true, factor.solve(B), right);
    Eigen::Map<Matrix> side_by_side(right.data(), y.rows, y.cols * right.cols());
    factor.solveInPlace(side_by_side);
    slopes.topRows(right.rows()) = right; // beside it may stand a workspace
    return true;
}

void add_elements(const Vector& own, const Moving& moving, Eigen::Index row, Matrix& slopes) {
    for (std::size_t c = 0; c < moving.columns.size(); ++c) {
        const auto of = moving.slopes->col(static_cast<Eigen::Index>(c));
        const bool is_one = of.size() == 1;
        auto to = slopes.col(moving.columns[c]).segment(row, own.size());
        // What does not move adds nothing, however steep it is.
        for (Eigen::Index e = 0; e < own.size(); ++e)
            if (const double change = of[is_one ? 0 : e]; change != 0) to[e] += own[e] * change;
    }
}

} // namespace bf::analysis
