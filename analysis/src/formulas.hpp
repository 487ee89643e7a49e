// Rules whose derivative is a formula on whole matrices.
#pragma once

#include "slopes.hpp"

#include <string_view>
#include <vector>

namespace bf::analysis {

/// An operand of a rule, column by column.
struct RuleOperand {
    const double* data;
    int rows, cols;
    int first; ///< of its elements, among all that move; -1: it does not
};

/// Slopes of the first operand, from those of all elements that move: of a product d(A B) = dA B + A dB, of
/// the solution of A X = B with A positive definite dX = A⁻¹ (dB - dA X), for which the kernels on numbers
/// with derivatives would do the same work again for each seed. False: the kernel is none of these.
bool by_formula(std::string_view kernel, const std::vector<RuleOperand>& operands,
                const std::vector<SlopeRow>& elements, SlopeMemory& memory, Slopes& slopes);

} // namespace bf::analysis
