// Diagram → the source files of an FMU, and the variables by which it is called.
#pragma once

#include "bf/codegen/generate.hpp"

#include <cstdint>
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
    std::vector<double> start; ///< of inputs and parameters: all elements, column by column
    /// Of an output: names of inputs and states, and "time", on which it depends in the same instant.
    std::vector<std::string> dependencies;
    std::vector<std::pair<double, std::string>> names = {}; ///< of the values of an enumeration
    std::vector<int> clocks = {}; ///< numbers of those in whose ticks it has values; none: always
    /// Numbers of the structural parameters that rows and columns are; -1: they are constant.
    int rows_by = -1, cols_by = -1;
};

/// A rate of the model as a periodic clock of FMI 3.0. Its value reference follows those of variables.
struct FmuClock {
    std::string name;
    std::int64_t ticks, offset; ///< steps of the model
    /// Interval and shift are these counts of 1 / resolution s, exactly; 0: no resolution gives them so.
    std::uint64_t resolution = 0, interval = 0, shift = 0;
};

struct FmuCode {
    Files files;                      ///< sources and headers; the latter are included from the same folder
    std::vector<std::string> sources; ///< which of them to compile, as C++17
    std::vector<FmuVariable> variables;
    std::vector<FmuClock> clocks;
    std::vector<std::string> options; ///< of GCC and Clang
    std::string identifier;           ///< of the model, a C name
    std::string token;                ///< of this code, which the description has to name
    /// Are blocks made from plugins? They stand beside the library, with libbf_core.so and what else they
    /// need; the code then needs the headers of BlockFactory.
    bool is_hosted = false;
    std::vector<std::string> plugins;  ///< their names
    bool uses_standard_blocks = false; ///< are standard blocks made, which libbf_blocks.a has?
    bool has_derivatives = false;      ///< of model exchange
    bool has_model_exchange = true;    ///< or are there states that some models have not?
};

/// How an FMU is made.
struct FmuChoice {
    int version = 3; ///< of FMI: 2 or 3
    /// Are the rates of the model clocks, which importers tick? FMI 3.0.
    bool has_clocks = false;
    /// Names of the structural parameters, of FMI 3.0.
    std::vector<std::string> structural = {};
};

/// A model, and for which values of structural parameters it is that.
struct FmuModel {
    const Diagram* diagram;
    Options options = {};
    /// Where blocks from plugins look for files, by their paths, relative to the model's folder, if not in
    /// that of their own file.
    std::map<std::string, std::string> folders = {};
    std::vector<std::uint64_t> structure = {};
};

/// An FMU of FMI 2.0 or 3.0, whose code is that of generate(): of one model, or of one for each combination
/// of values of structural parameters, the first of which is that of the description. A size is then constant
/// or one of these parameters. Signals and parameters that are not in all models or have other sizes are left
/// out, as is model exchange where its states or guards are such; parameters that follow from structural ones
/// are calculated. Throws GenerationError for diagrams that generate() refuses, for names of two variables
/// that are one, and for inputs and outputs that are not in all models or have other sizes.
FmuCode generate_fmu(const std::vector<FmuModel>& models, const FmuChoice& choice);

} // namespace bf::codegen
