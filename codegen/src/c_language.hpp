// C11 spellings of types, numbers and functions.
#pragma once

#include "bf/core/declaration.hpp"

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace bf::codegen {

/// double, float, int8_t, ...
std::string c_name(Type type);
/// As `literal` in C++.
std::string c_literal(double value, Type type);

/// A function of numbers by its name in `kernels/scalar.hpp` or <cmath>, and the type of these numbers.
using CFunction = std::pair<std::string, Type>;
/// How it is called: sqrt, sqrtf, or a function of ours with that prefix, e.g. motor_modulo_int8.
std::string c_name(const CFunction& function, const std::string& prefix);
/// The definition of a function of ours, which does what that of `kernels/scalar.hpp` does; empty where
/// <math.h> has it. The functions that it calls stand before it.
std::string c_definition(const CFunction& function, const std::string& prefix);
std::vector<CFunction> c_needs(const CFunction& function);

/// Texts by name, in which @T@ is the type, @f@ the suffix of <math.h>, @name@ the function, and the name of
/// another function of the same type that function.
using CDefinitions = std::map<std::string, std::string, std::less<>>;
/// Of real numbers: inverses, decompositions and what they need.
const CDefinitions& c_matrix_definitions();

} // namespace bf::codegen
