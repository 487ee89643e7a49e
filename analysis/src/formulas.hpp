// Rules whose derivative is a formula on whole matrices.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "dual.hpp"

#include <string_view>
#include <vector>

namespace bf::analysis {

/// An operand of a rule with its values, and where it begins among what moves; -1: it does not.
struct RuleOperand {
    kernels::View<Dual> view;
    int from = -1;
};

/// Slopes of the first operand along all directions: of a product d(A B) = dA B + A dB, of the solution of
/// A X = B with A positive definite dX = A⁻¹ (dB - dA X), for which the kernels on numbers with derivatives
/// would do the same work again for each. False: the kernel is none of these.
bool by_formula(std::string_view kernel, const std::vector<RuleOperand>& operands, const Matrix& directions,
                Matrix& slopes);

} // namespace bf::analysis
