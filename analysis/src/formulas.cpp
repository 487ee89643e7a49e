#include "formulas.hpp"

#include <Eigen/Cholesky>

namespace bf::analysis {

namespace {

Matrix values(const RuleOperand& operand) {
    const auto& view = operand.view;
    return Matrix::NullaryExpr(view.rows, view.cols, [&](Eigen::Index i, Eigen::Index j) {
        return view.data[i + j * view.rows].value;
    });
}

/// Its change along a direction.
Eigen::Map<const Matrix> change(const RuleOperand& operand, const Matrix& directions, Eigen::Index c) {
    return {directions.col(c).data() + operand.from, operand.view.rows, operand.view.cols};
}

} // namespace

bool by_formula(std::string_view kernel, const std::vector<RuleOperand>& operands, const Matrix& directions,
                Matrix& slopes) {
    const bool may_scale = kernel == kernels::ScalarOrMatrixProduct::name,
               is_product = may_scale || kernel == kernels::MatrixProduct::name,
               is_solution = kernel == kernels::CholeskySolve::name;
    if (!is_product && !is_solution) return false;
    const RuleOperand &y = operands[0], &first = operands[1], &second = operands[2];
    if (may_scale && (first.view.size() == 1 || second.view.size() == 1)) return false;
    const Matrix A = values(first), B = values(second);
    Matrix Y;
    Eigen::LLT<Matrix> factor;
    if (is_solution) { // of A the lower triangle is read
        factor.compute(A);
        if (factor.info() != Eigen::Success) return false;
        Y = factor.solve(B);
    }
    Matrix dY(y.view.rows, y.view.cols);
    for (Eigen::Index c = 0; c < directions.cols(); ++c) {
        dY.setZero();
        if (is_product) {
            if (first.from >= 0) dY.noalias() += change(first, directions, c) * B;
            if (second.from >= 0) dY.noalias() += A * change(second, directions, c);
        } else {
            if (second.from >= 0) dY = change(second, directions, c);
            if (first.from >= 0)
                dY.noalias() -= change(first, directions, c).selfadjointView<Eigen::Lower>() * Y;
            factor.solveInPlace(dY);
        }
        slopes.col(c).head(dY.size()) = dY.reshaped();
    }
    return true;
}

} // namespace bf::analysis
