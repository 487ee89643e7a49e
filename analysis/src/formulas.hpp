// Rules whose derivative is a formula on whole matrices.
#pragma once

#include "bf/analysis/linear_system.hpp"

#include <string_view>
#include <vector>

namespace bf::analysis {

/// Slopes of what a rule reads, where it moves.
struct Moving {
    const Matrix* slopes;              ///< elements × some of all directions
    std::vector<Eigen::Index> columns; ///< which ones
};

/// An operand of a rule, column by column.
struct RuleOperand {
    const double* data;
    int rows, cols;
    const Moving* moving; ///< null: it does not
};

/// Slopes of the first operand along all directions, which are 0 at first: of a product d(A B) = dA B + A dB,
/// of the solution of A X = B with A positive definite dX = A⁻¹ (dB - dA X), for which the kernels on numbers
/// with derivatives would do the same work again for each. False: the kernel is none of these.
bool by_formula(std::string_view kernel, const std::vector<RuleOperand>& operands, Matrix& slopes);

/// Adds what a result has of an operand beside it, from that row on: `own` its slopes by that element alone.
void add_elements(const Vector& own, const Moving& moving, Eigen::Index row, Matrix& slopes);

} // namespace bf::analysis
