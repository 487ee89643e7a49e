// Polynomials that blocks get as arguments.
#pragma once

#include "bf/core/block.hpp"

#include <string>
#include <vector>

namespace bf::blocks {

/// A rational function Σ b_i xⁿ⁻ⁱ / Σ a_i xⁿ⁻ⁱ with as many b as a, a_0 = 1; strictly proper if b_0 = 0.
struct Rational {
    std::vector<double> b{0, 1}, a{1, 1};
    int order() const { return static_cast<int>(a.size()) - 1; }
    bool is_proper() const { return b.front() == 0; }
};

/// From the coefficients of numerator and denominator, highest power first. A problem of the block: leading
/// zero, numerator longer than the denominator.
Rational rational(Block& block, const std::vector<double>& numerator, const std::vector<double>& denominator);

/// gain Π(x - zero) / Π(x - pole). Roots are a row or column of real numbers, or rows [real imaginary]. A
/// problem of the block: complex roots without their conjugates, more zeros than poles.
Rational rational(Block& block, const Matrix& zeros, const Matrix& poles, double gain);

} // namespace bf::blocks
