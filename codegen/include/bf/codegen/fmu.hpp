// Diagram → the source files of an FMU, and the variables by which it is called.
#pragma once

#include "bf/codegen/generate.hpp"

#include <string>
#include <vector>

namespace bf::codegen {

/// A variable of the FMU. Its value reference in FMI 3.0 is its place in the list, from 1; in FMI 2.0, where
/// each element of an array is a variable, elements are counted row by row through the list, from 1.
struct FmuVariable {
    enum class Role {
        input,
        output,
        parameter,  ///< a parameter or variable of the model that may be changed while it runs
        fixed,      ///< a parameter that initial states follow from, and nothing else
        calculated, ///< one that follows from variables of the model
        signal,     ///< that the model records
        state,      ///< a continuous one, as a vector; of model exchange
        rate,       ///< its derivative; they stand behind the states, in their order
        crossings   ///< the zero-crossing functions, at most one vector of them
    };
    Role role;
    std::string name, unit, doc;
    Type type;
    int rows, cols;
    Limits limits;
    std::vector<double> start;       ///< of inputs and parameters: all elements, column by column
    std::vector<std::string> inputs; ///< names of those on which an output depends in the same instant
};

struct FmuCode {
    Files files;                      ///< sources and headers; the latter are included from the same folder
    std::vector<std::string> sources; ///< which of them to compile, as C++17
    std::vector<FmuVariable> variables;
    std::vector<std::string> options; ///< of GCC and Clang
    std::string identifier;           ///< of the model, a C name
    std::string token;                ///< of this code, which the description has to name
};

/// An FMU of FMI `version` 2.0 or 3.0, whose code is that of generate(). Throws GenerationError for diagrams
/// that generate() refuses, and for names of two variables that are one.
FmuCode generate_fmu(const Diagram& diagram, int version, const Options& options = {});

} // namespace bf::codegen
