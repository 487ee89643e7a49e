// C++ of the model's expressions: what generated code computes again when a variable changes.
#pragma once

#include "bf/elaborate/tuning.hpp"

#include <map>
#include <string>
#include <vector>

namespace bf::codegen {

/// A variable of the model as a member of the generated class.
struct VariableField {
    int definition;
    std::string member;
};

/// A variable or parameter that follows from variables.
struct Formula {
    int definition;
    std::string code;
};

struct Formulas {
    std::vector<VariableField> variables; ///< that a program may change
    std::vector<Formula> formulas;        ///< in the order in which they are computed
    /// Variables that are fixed in the program, with the reason.
    std::vector<std::pair<std::string, std::string>> fixed;
};

/// Expressions that matlab::resolve knows become arithmetic and calls of bf::generated::Formula. A variable
/// that some other expression uses is fixed.
Formulas formulas_of(const Diagram& diagram);

} // namespace bf::codegen
