// Formulas as text, for kernels::Expression.
#pragma once

#include <string>
#include <vector>

namespace bf::blocks {

/// A formula, compiled.
struct Formula {
    std::vector<double> code;        ///< see kernels::Expression
    int inputs = 0;                  ///< the highest number of an input in it
    int parameters = 0;              ///< the highest index of p in it
    bool is_parameter_whole = false; ///< p stands in it without an index
    int edges = 0;                   ///< operations in it that jump or have a corner
    bool is_single = true;           ///< the only input is called u throughout
    std::vector<bool> whole;         ///< per input: is it read element by element, and not only u(i)?
    std::vector<int> elements;       ///< per input: the highest i in u(i)
};

/// Compiles `text` with MATLAB's operators and precedence. Throws std::invalid_argument with what is wrong
/// and where.
Formula formula(const std::string& text);

} // namespace bf::blocks
