// C11 spellings of types, numbers and functions.
#pragma once

#include "bf/core/declaration.hpp"

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

} // namespace bf::codegen
