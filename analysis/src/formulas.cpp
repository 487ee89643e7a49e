#include "formulas.hpp"

#include "bf/kernels/linear_algebra.hpp"
#include "bf/kernels/matrix.hpp"
#include "bf/kernels/standard.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace bf::analysis {

namespace {

using Values = Eigen::Map<const Matrix>;

Line row(const RuleOperand& of, int i) { return {i, of.rows, of.cols}; }
Line column(const RuleOperand& of, int j) { return {j * of.rows, 1, of.rows}; }

/// Adds those of A d, where d are elements from the first one on, as many as B has.
void add_product(const double* A, const RuleOperand& B, const SlopeRow* d, const RuleOperand& y,
                 std::vector<ProductOfSlopes>& to) {
    for (int j = 0; j < y.cols; ++j) to.push_back({A, 1, y.rows, d, column(B, j), column(y, j)});
}
/// Adds those of d B.
void add_product(const RuleOperand& A, const SlopeRow* d, const double* B, const RuleOperand& y,
                 std::vector<ProductOfSlopes>& to) {
    for (int i = 0; i < y.rows; ++i) to.push_back({B, A.cols, 1, d, row(A, i), row(y, i)});
}

bool of_solution(const RuleOperand& x, const RuleOperand& a, const RuleOperand& b,
                 const std::vector<SlopeRow>& elements, SlopeMemory& memory, Slopes& slopes) {
    const Values A(a.data, a.rows, a.cols), B(b.data, b.rows, b.cols);
    const Eigen::LLT<Matrix> factor(A); // of which the lower triangle is read
    if (factor.info() != Eigen::Success) return false;
    const Matrix inverse = factor.solve(Matrix::Identity(a.rows, a.rows)), minus_X = -factor.solve(B);
    const auto size = static_cast<std::size_t>(x.rows * x.cols);
    const SlopeRow* right = b.first >= 0 ? elements.data() + b.first : nullptr;
    std::vector<ProductOfSlopes> products;
    products.reserve(static_cast<std::size_t>(std::max(x.rows, x.cols)));
    std::vector<SlopeRow> symmetric, changes;
    Slopes change;
    if (a.first >= 0) { // dB - dA X
        symmetric.reserve(static_cast<std::size_t>(a.rows * a.cols));
        changes.reserve(size);
        for (int j = 0; j < a.cols; ++j)
            for (int i = 0; i < a.rows; ++i)
                symmetric.push_back(
                    elements[static_cast<std::size_t>(a.first + std::max(i, j) + std::min(i, j) * a.rows)]);
        add_product(a, symmetric.data(), minus_X.data(), x, products);
        sum(size, products, right, memory, change);
        products.clear();
        for (int e = 0; e < x.rows * x.cols; ++e) changes.push_back(change.row(e));
        right = changes.data();
    }
    add_product(inverse.data(), b, right, x, products);
    sum(size, products, nullptr, memory, slopes);
    return true;
}

} // namespace

bool by_formula(std::string_view kernel, const std::vector<RuleOperand>& operands,
                const std::vector<SlopeRow>& elements, SlopeMemory& memory, Slopes& slopes) {
    const bool may_scale = kernel == kernels::ScalarOrMatrixProduct::name,
               is_product = may_scale || kernel == kernels::MatrixProduct::name,
               is_solution = kernel == kernels::CholeskySolve::name;
    if (!is_product && !is_solution) return false;
    const RuleOperand &y = operands[0], &A = operands[1], &B = operands[2];
    const auto is_number = [](const RuleOperand& of) { return of.rows * of.cols == 1; };
    if (may_scale && (is_number(A) || is_number(B))) return false;
    if (is_solution) return of_solution(y, A, B, elements, memory, slopes);
    std::vector<ProductOfSlopes> products;
    products.reserve(static_cast<std::size_t>(y.rows + y.cols));
    if (A.first >= 0) add_product(A, elements.data() + A.first, B.data, y, products);
    if (B.first >= 0) add_product(A.data, B, elements.data() + B.first, y, products);
    sum(static_cast<std::size_t>(y.rows * y.cols), products, nullptr, memory, slopes);
    return true;
}

} // namespace bf::analysis
